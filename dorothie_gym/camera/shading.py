"""Colours of a picture from its visibility buffer: light, shadows, textures, fog, and smooth edges.

The picture is shaded in bands of rows. A pixel whose samples all see the same surface is shaded once, others once for
each sample. What has to be shaded is first sorted by kind: sky, ground, and solid bodies.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.camera.daylight import Daylight
from dorothie_gym.camera.faces import Face, read_face, solid_colour
from dorothie_gym.camera.ground.colours import colour_at
from dorothie_gym.camera.ground.lookup import GroundArrays
from dorothie_gym.camera.labels import mesh_of, row_in
from dorothie_gym.camera.lighting import WARM, LampMap, head_light, lamp_light, mirrored_share, through_air
from dorothie_gym.camera.mesh import PLAIN, Mesh, Surface
from dorothie_gym.camera.optics import Optics, ray
from dorothie_gym.camera.pose import View
from dorothie_gym.camera.rasterizer import SKY, VisibilityBuffer
from dorothie_gym.camera.shadows import REACH, ShadowMaps, faded, sunlit
from dorothie_gym.camera.sky import sky_colour
from dorothie_gym.camera.texturing import Textures
from dorothie_gym.compilation import compiled, inlined
from dorothie_gym.compilation.by_reference import by_reference
from dorothie_gym.maps.model import Array

BAND = 8
"""Rows of pixels that are shaded together."""

_SKIES, _GROUNDS, _SOLIDS = 0, 1, 2
_GROUND = int(Surface.GROUND)


@by_reference
class Canvas(NamedTuple):
    """Scratch space of a band of a picture, n = samples per band.

    Attributes:
        counts: (3,) number of samples of each kind.
        pixels: (3, n) int32 pixel in the band.
        numbers: (3, n) int32 triangle.
        places: (3, n, 3) float32: to the right and up per metre of depth, and weight.
        sums: (pixels, 3) float32 weighted colours.
        colour: (4,) colour of the present sample.
    """

    counts: NDArray[np.int64]
    pixels: NDArray[np.int32]
    numbers: NDArray[np.int32]
    places: NDArray[np.float32]
    sums: NDArray[np.float32]
    colour: Array


def new_canvas(width: int, samples: int) -> Canvas:
    """Returns scratch space for pictures of a width, with `samples` x `samples` samples in a pixel."""
    count = BAND * width * samples * samples
    return Canvas(
        np.zeros(3, np.int64), np.zeros((3, count), np.int32), np.zeros((3, count), np.int32),
        np.zeros((3, count, 3), np.float32), np.zeros((BAND * width, 3), np.float32), np.zeros(4),
    )  # fmt: skip


@compiled
def shade(
    view: View, optics: Optics, buffer: VisibilityBuffer, samples: int, town: Mesh, overlay: Mesh, bodies: Mesh,
    ground: GroundArrays, textures: Textures, light: Daylight, noise: NDArray[np.float32], lamps: LampMap,
    shadows: ShadowMaps, canvas: Canvas, face: Face, picture: NDArray[np.uint8],
) -> None:  # fmt: skip
    """Writes the colours of a picture.

    Args:
        view: projection of the picture.
        optics: numbers of the picture.
        buffer: triangles, with `samples` x `samples` samples in a pixel.
        samples: 1 or 2.
        town: what stands in every session.
        overlay: what stands in this session.
        bodies: what moves.
        ground: materials and colours of the ground.
        textures: of the walls.
        light: light and air.
        noise: of the sky.
        lamps: light of street lamps on the ground.
        shadows: maps that were drawn for the picture.
        canvas: scratch space.
        face: scratch space.
        picture: (h, w, 3) to be written.
    """
    for top in range(0, view.height, BAND):
        rows = min(BAND, view.height - top)
        _gather(view, optics.pixel, buffer, samples, town, overlay, bodies, top, rows, canvas)
        _shade_skies(optics, light, noise, canvas)
        _shade_grounds(optics, town, overlay, bodies, ground, lamps, shadows, canvas)
        _shade_solids(view, optics, town, overlay, bodies, textures, lamps, shadows, canvas, face)
        for y in range(rows):
            for x in range(view.width):
                for k in range(3):
                    picture[top + y, x, k] = int(canvas.sums[y * view.width + x, k] + np.float32(0.5))


# --- Samples ----------------------------------------------------------------------------------------------------------


@compiled
def _gather(
    view: View, size: float, buffer: VisibilityBuffer, samples: int, town: Mesh, overlay: Mesh, bodies: Mesh, top: int,
    rows: int, canvas: Canvas,
) -> None:  # fmt: skip
    """Sorts the samples of a band; `size` is the width of a pixel at a depth of 1 m [m]."""
    triangles, last, kind = buffer.triangles, SKY, _SKIES
    for k in range(3):
        canvas.counts[k] = 0
    for y in range(rows):
        upper = triangles[(top + y) * samples]
        lower = triangles[(top + y) * samples + samples - 1]
        for x in range(view.width):
            pixel, column = y * view.width + x, x * samples
            canvas.sums[pixel, 0] = canvas.sums[pixel, 1] = canvas.sums[pixel, 2] = 0.0
            number = upper[column]
            if samples == 1 or _is_uniform(upper, lower, column, town, overlay, bodies):
                if number != last:
                    last, kind = number, _kind_of(town, overlay, bodies, number)
                _add_sample(view, size, canvas, kind, pixel, number, x + 0.5, top + y + 0.5, 1.0)
            else:
                for k in range(4):
                    number = lower[column + (k & 1)] if k >> 1 else upper[column + (k & 1)]
                    if number != last:
                        last, kind = number, _kind_of(town, overlay, bodies, number)
                    across, down = x + 0.25 + 0.5 * (k & 1), top + y + 0.25 + 0.5 * (k >> 1)
                    _add_sample(view, size, canvas, kind, pixel, number, across, down, 0.25)


@inlined
def _is_uniform(
    upper: NDArray[np.int32], lower: NDArray[np.int32], column: int, town: Mesh, overlay: Mesh, bodies: Mesh
) -> bool:
    """Returns whether the four samples of a pixel in two rows see one surface."""
    one, two, three, four = upper[column], upper[column + 1], lower[column], lower[column + 1]
    if (one == two) & (one == three) & (one == four):
        return True
    return (
        (one == two or _is_same_surface(town, overlay, bodies, one, two))
        and (one == three or _is_same_surface(town, overlay, bodies, one, three))
        and (one == four or _is_same_surface(town, overlay, bodies, one, four))
    )


@compiled
def _is_same_surface(town: Mesh, overlay: Mesh, bodies: Mesh, first: int, second: int) -> bool:
    """Returns whether two triangles lie in a plane and look the same, as the halves of a wall do."""
    if first == SKY or second == SKY:
        return False
    one, two = mesh_of(town, overlay, bodies, first), mesh_of(town, overlay, bodies, second)
    i, j = row_in(town, overlay, first), row_in(town, overlay, second)
    if one.textures[i] != two.textures[j] or one.surfaces[i] != two.surfaces[j]:
        return False
    apart, turned, coloured = 0.0, 0.0, 0
    for k in range(3):
        apart += one.normals[i, k] * (two.corners[j, 0, k] - one.corners[i, 0, k])
        turned += one.normals[i, k] * two.normals[j, k]
        coloured |= one.colours[i, k] ^ two.colours[j, k]
    if one.surfaces[i] & _GROUND:
        return turned > 0.999 and abs(apart) < 0.05
    return turned > 0.9999 and abs(apart) < 2e-3 and coloured == 0 and _are_textured_alike(one, i, two, j)


@inlined
def _are_textured_alike(one: Mesh, i: int, two: Mesh, j: int) -> bool:
    if one.textures[i] == PLAIN:
        return True
    for k in range(3):
        if abs(one.u_axes[i, k] - two.u_axes[j, k]) > 1e-3 or abs(one.v_axes[i, k] - two.v_axes[j, k]) > 1e-3:
            return False
    return True


@inlined
def _kind_of(town: Mesh, overlay: Mesh, bodies: Mesh, number: int) -> int:
    if number == SKY:
        return _SKIES
    surface = mesh_of(town, overlay, bodies, number).surfaces[row_in(town, overlay, number)]
    return _GROUNDS if surface & _GROUND else _SOLIDS


@inlined
def _add_sample(
    view: View, size: float, canvas: Canvas, kind: int, pixel: int, number: int, x: float, y: float, weight: float
) -> None:
    at = canvas.counts[kind]
    canvas.counts[kind] = at + 1
    canvas.pixels[kind, at], canvas.numbers[kind, at] = pixel, number
    canvas.places[kind, at, 0] = (x - 0.5 * view.width) * size
    canvas.places[kind, at, 1] = (0.5 * view.height - y) * size
    canvas.places[kind, at, 2] = weight


@inlined
def _add_colour(canvas: Canvas, kind: int, k: int, red: float, green: float, blue: float) -> None:
    """Adds a colour to the pixel of a sample."""
    pixel, weight = canvas.pixels[kind, k], canvas.places[kind, k, 2]
    canvas.sums[pixel, 0] += weight * min(red, 255.0)
    canvas.sums[pixel, 1] += weight * min(green, 255.0)
    canvas.sums[pixel, 2] += weight * min(blue, 255.0)


# --- Kinds ------------------------------------------------------------------------------------------------------------


@compiled
def _shade_skies(optics: Optics, light: Daylight, noise: NDArray[np.float32], canvas: Canvas) -> None:
    colour = canvas.colour
    for k in range(canvas.counts[_SKIES]):
        right, up = canvas.places[_SKIES, k, 0], canvas.places[_SKIES, k, 1]
        x, y, z = ray(optics, right, up)
        scale = 1.0 / math.sqrt(1.0 + right * right + up * up)
        sky_colour(light, noise, x * scale, y * scale, z * scale, colour)
        _add_colour(canvas, _SKIES, k, colour[0], colour[1], colour[2])


@compiled
def _shade_grounds(
    optics: Optics, town: Mesh, overlay: Mesh, bodies: Mesh, ground: GroundArrays, lamps: LampMap, shadows: ShadowMaps,
    canvas: Canvas,
) -> None:  # fmt: skip
    last, sheet, nx, ny, nz, offset, facing = SKY, 0, 0.0, 0.0, 1.0, 0.0, 0.0
    for k in range(canvas.counts[_GROUNDS]):
        if canvas.numbers[_GROUNDS, k] != last:
            last = canvas.numbers[_GROUNDS, k]
            mesh, row = mesh_of(town, overlay, bodies, last), row_in(town, overlay, last)
            sheet, corner, normal = int(mesh.textures[row]), mesh.corners[row, 0], mesh.normals[row]
            nx, ny, nz = float(normal[0]), float(normal[1]), float(normal[2])
            offset = nx * (corner[0] - optics.x) + ny * (corner[1] - optics.y) + nz * (corner[2] - optics.z)
            facing = max(nx * optics.sun_x + ny * optics.sun_y + nz * optics.sun_z, 0.0)
        right, up = float(canvas.places[_GROUNDS, k, 0]), float(canvas.places[_GROUNDS, k, 1])
        dx, dy, dz = ray(optics, right, up)
        toward = min(nx * dx + ny * dy + nz * dz, -1e-6)
        red, green, blue = _ground_colour(
            optics, sheet, offset / toward, right, up, toward, facing, nz, ground, lamps, shadows, canvas.colour
        )
        _add_colour(canvas, _GROUNDS, k, red, green, blue)


@inlined
def _ground_colour(
    optics: Optics, sheet: int, depth: float, right: float, up: float, toward: float, facing: float, level: float,
    ground: GroundArrays, lamps: LampMap, shadows: ShadowMaps, colour: Array,
) -> tuple[float, float, float]:  # fmt: skip
    """Returns the colour of the ground at a depth in a direction (right, up, 1).

    Args:
        optics: numbers of the picture.
        sheet: of the ground.
        depth: [m].
        right: of the direction.
        up: of the direction.
        toward: scalar product of direction and normal.
        facing: cosine to the sun.
        level: vertical part of the normal.
        ground: materials and colours.
        lamps: light of street lamps.
        shadows: maps.
        colour: scratch space.
    """
    dx, dy, dz = ray(optics, right, up)
    x, y, z = depth * dx, depth * dy, optics.z + depth * dz
    colour_at(ground, sheet, optics.x + x, optics.y + y, depth * optics.pixel / math.sqrt(max(-toward, 0.02)), colour)
    lit = facing
    if lit > 0.0 and optics.shadows and depth < REACH:
        u, v = optics.x + x - optics.slope_x * z, optics.y + y - optics.slope_y * z
        shade = sunlit(
            shadows.town, shadows.bodies, optics.town_x, optics.town_y, optics.bodies_x, optics.bodies_y, u, v, z + 0.05
        )
        lit *= faded(shade, depth)
    lamp, slant = 0.0, 0.0
    if optics.head_lights > 0.0 or optics.wetness > 0.0:
        slant = -toward / math.sqrt(1.0 + right * right + up * up)
    if optics.head_lights > 0.0:
        lamp = head_light(optics, x, y, z - optics.z, slant)
    if optics.lamps > 0.0:
        lamp += lamp_light(lamps, optics.x + x, optics.y + y) * optics.lamps
    ambient = 0.8 + 0.2 * level
    red = colour[0] * (optics.sky_r * ambient + optics.sun_r * lit + lamp * WARM[0])
    green = colour[1] * (optics.sky_g * ambient + optics.sun_g * lit + lamp * WARM[1])
    blue = colour[2] * (optics.sky_b * ambient + optics.sun_b * lit + lamp * WARM[2])
    if optics.wetness > 0.0:
        share = mirrored_share(optics.wetness, slant)
        dark = (1.0 - 0.42 * optics.wetness) * (1.0 - share)
        red, green, blue = (
            red * dark + optics.horizon_r * share, green * dark + optics.horizon_g * share,
            blue * dark + optics.horizon_b * share,
        )  # fmt: skip
    return through_air(optics, red, green, blue, depth, right, up)


@compiled
def _shade_solids(
    view: View, optics: Optics, town: Mesh, overlay: Mesh, bodies: Mesh, textures: Textures, lamps: LampMap,
    shadows: ShadowMaps, canvas: Canvas, face: Face,
) -> None:  # fmt: skip
    last = SKY
    for k in range(canvas.counts[_SOLIDS]):
        if canvas.numbers[_SOLIDS, k] != last:
            last = canvas.numbers[_SOLIDS, k]
            read_face(view, optics, mesh_of(town, overlay, bodies, last), row_in(town, overlay, last), textures, face)
        right, up = float(canvas.places[_SOLIDS, k, 0]), float(canvas.places[_SOLIDS, k, 1])
        red, green, blue = solid_colour(optics, face, right, up, textures, lamps, shadows)
        _add_colour(canvas, _SOLIDS, k, red, green, blue)
