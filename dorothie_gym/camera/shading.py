"""Colours of a picture from its visibility buffer: light, shadows, textures, fog, and smooth edges.

The picture is shaded in bands of rows. A pixel whose samples all see the same surface is shaded once, others once for
each sample. What has to be shaded is first sorted by kind: sky, ground, and solid bodies.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.camera.atlas import AtlasArrays
from dorothie_gym.camera.daylight import Daylight
from dorothie_gym.camera.faces import Face, read_face, solid_colour
from dorothie_gym.camera.ground.colours import colour_at
from dorothie_gym.camera.ground.lookup import GroundArrays
from dorothie_gym.camera.labels import mesh_of, row_in
from dorothie_gym.camera.lighting import WARM, LampMap, air_colour, head_light, lamp_light, wet_colour
from dorothie_gym.camera.mesh import PLAIN, Mesh, Surface
from dorothie_gym.camera.pose import View
from dorothie_gym.camera.rasterizer import SKY, VisibilityBuffer
from dorothie_gym.camera.shadows import REACH, ShadowMaps, sunlit
from dorothie_gym.camera.sky import sky_colour
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
    view: View, buffer: VisibilityBuffer, samples: int, town: Mesh, overlay: Mesh, bodies: Mesh, ground: GroundArrays,
    atlas: AtlasArrays, light: Daylight, noise: NDArray[np.float32], lamps: LampMap, shadows: ShadowMaps,
    canvas: Canvas, face: Face, picture: NDArray[np.uint8],
) -> None:  # fmt: skip
    """Writes the colours of a picture.

    Args:
        view: projection of the picture.
        buffer: triangles, with `samples` x `samples` samples in a pixel.
        samples: 1 or 2.
        town: what stands in every session.
        overlay: what stands in this session.
        bodies: what moves.
        ground: materials and colours of the ground.
        atlas: textures.
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
        _gather(view, buffer, samples, town, overlay, bodies, top, rows, canvas)
        _shade_skies(view, light, noise, canvas)
        _shade_grounds(view, town, overlay, bodies, ground, light, lamps, shadows, canvas)
        _shade_solids(view, town, overlay, bodies, atlas, light, lamps, shadows, canvas, face)
        for y in range(rows):
            for x in range(view.width):
                for k in range(3):
                    picture[top + y, x, k] = int(canvas.sums[y * view.width + x, k] + np.float32(0.5))


# --- Samples ----------------------------------------------------------------------------------------------------------


@compiled
def _gather(
    view: View, buffer: VisibilityBuffer, samples: int, town: Mesh, overlay: Mesh, bodies: Mesh, top: int, rows: int,
    canvas: Canvas,
) -> None:  # fmt: skip
    """Sorts the samples of a band."""
    triangles = buffer.triangles
    for k in range(3):
        canvas.counts[k] = 0
    for y in range(rows):
        for x in range(view.width):
            pixel = y * view.width + x
            canvas.sums[pixel, 0] = canvas.sums[pixel, 1] = canvas.sums[pixel, 2] = 0.0
            row, column = (top + y) * samples, x * samples
            number = triangles[row, column]
            if samples == 1 or _is_uniform(triangles, row, column, town, overlay, bodies):
                _add_sample(view, town, overlay, bodies, canvas, pixel, number, x + 0.5, top + y + 0.5, 1.0)
            else:
                for k in range(4):
                    i, j = column + (k & 1), row + (k >> 1)
                    _add_sample(
                        view, town, overlay, bodies, canvas, pixel, triangles[j, i], (i + 0.5) * 0.5, (j + 0.5) * 0.5,
                        0.25,
                    )  # fmt: skip


@inlined
def _is_uniform(triangles: NDArray[np.int32], row: int, column: int, town: Mesh, overlay: Mesh, bodies: Mesh) -> bool:
    """Returns whether the four samples of a pixel see one surface."""
    first = triangles[row, column]
    for k in range(1, 4):
        other = triangles[row + (k >> 1), column + (k & 1)]
        if other != first and not _is_same_surface(town, overlay, bodies, first, other):
            return False
    return True


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
def _add_sample(
    view: View, town: Mesh, overlay: Mesh, bodies: Mesh, canvas: Canvas, pixel: int, number: int, x: float, y: float,
    weight: float,
) -> None:  # fmt: skip
    kind = _SKIES
    if number != SKY:
        mesh = mesh_of(town, overlay, bodies, number)
        kind = _GROUNDS if mesh.surfaces[row_in(town, overlay, number)] & _GROUND else _SOLIDS
    at = canvas.counts[kind]
    canvas.counts[kind] = at + 1
    canvas.pixels[kind, at], canvas.numbers[kind, at] = pixel, number
    canvas.places[kind, at, 0] = (x - 0.5 * view.width) / view.focal
    canvas.places[kind, at, 1] = (0.5 * view.height - y) / view.focal
    canvas.places[kind, at, 2] = weight


@inlined
def _add_colour(canvas: Canvas, kind: int, k: int) -> None:
    """Adds the present colour to the pixel of a sample."""
    pixel, weight = canvas.pixels[kind, k], canvas.places[kind, k, 2]
    for j in range(3):
        canvas.sums[pixel, j] += weight * min(canvas.colour[j], 255.0)


# --- Kinds ------------------------------------------------------------------------------------------------------------


@compiled
def _shade_skies(view: View, light: Daylight, noise: NDArray[np.float32], canvas: Canvas) -> None:
    axes = view.axes
    for k in range(canvas.counts[_SKIES]):
        right, up = canvas.places[_SKIES, k, 0], canvas.places[_SKIES, k, 1]
        scale = 1.0 / math.sqrt(1.0 + right * right + up * up)
        sky_colour(
            light, noise, (axes[2, 0] + right * axes[0, 0] + up * axes[1, 0]) * scale,
            (axes[2, 1] + right * axes[0, 1] + up * axes[1, 1]) * scale,
            (axes[2, 2] + right * axes[0, 2] + up * axes[1, 2]) * scale, canvas.colour,
        )  # fmt: skip
        _add_colour(canvas, _SKIES, k)


@compiled
def _shade_grounds(
    view: View, town: Mesh, overlay: Mesh, bodies: Mesh, ground: GroundArrays, light: Daylight, lamps: LampMap,
    shadows: ShadowMaps, canvas: Canvas,
) -> None:  # fmt: skip
    colour, last, mesh, row = canvas.colour, SKY, town, 0
    for k in range(canvas.counts[_GROUNDS]):
        if canvas.numbers[_GROUNDS, k] != last:
            last = canvas.numbers[_GROUNDS, k]
            mesh, row = mesh_of(town, overlay, bodies, last), row_in(town, overlay, last)
        right, up = canvas.places[_GROUNDS, k, 0], canvas.places[_GROUNDS, k, 1]
        _shade_ground(view, mesh, row, right, up, ground, light, lamps, shadows, colour)
        _add_colour(canvas, _GROUNDS, k)


@inlined
def _shade_ground(
    view: View, mesh: Mesh, row: int, right: float, up: float, ground: GroundArrays, light: Daylight, lamps: LampMap,
    shadows: ShadowMaps, colour: Array,
) -> None:  # fmt: skip
    """Writes the colour of the ground in a direction."""
    axes, origin, normal = view.axes, view.origin, mesh.normals[row]
    dx = axes[2, 0] + right * axes[0, 0] + up * axes[1, 0]
    dy = axes[2, 1] + right * axes[0, 1] + up * axes[1, 1]
    dz = axes[2, 2] + right * axes[0, 2] + up * axes[1, 2]
    toward = normal[0] * dx + normal[1] * dy + normal[2] * dz
    corner = mesh.corners[row, 0]
    depth = (
        normal[0] * (corner[0] - origin[0]) + normal[1] * (corner[1] - origin[1]) + normal[2] * (corner[2] - origin[2])
    ) / min(toward, -1e-6)
    x, y, z = origin[0] + depth * dx, origin[1] + depth * dy, origin[2] + depth * dz
    length = math.sqrt(dx * dx + dy * dy + dz * dz)
    distance, slant = depth * length, -toward / length
    across = depth / view.focal
    colour_at(ground, int(mesh.textures[row]), x, y, across / math.sqrt(max(slant, 0.02)), colour)
    facing = normal[0] * light.sun[0] + normal[1] * light.sun[1] + normal[2] * light.sun[2]
    lit = max(facing, 0.0)
    if lit > 0.0 and shadows.strength[0] > 0.0 and distance < REACH:
        lit *= _faded(sunlit(shadows, x, y, z, 0.05), distance)
    glow = lamp_light(lamps, x, y) * light.lamps
    beam = head_light(view, light, x - origin[0], y - origin[1], z - origin[2], slant)
    for k in range(3):
        colour[k] *= light.ambient[k] * (0.8 + 0.2 * normal[2]) + light.sunshine[k] * lit + (glow + beam) * WARM[k]
    if light.wetness > 0.0:
        wet_colour(light, slant, colour)
    air_colour(light, distance, colour)


@inlined
def _faded(lit: float, distance: float) -> float:
    """Returns the share of light in the shadow with the fading of distant shadows."""
    return lit + (1.0 - lit) * min(1.0, max(0.0, (distance / REACH - 0.75) * 4.0))


@compiled
def _shade_solids(
    view: View, town: Mesh, overlay: Mesh, bodies: Mesh, atlas: AtlasArrays, light: Daylight, lamps: LampMap,
    shadows: ShadowMaps, canvas: Canvas, face: Face,
) -> None:  # fmt: skip
    last = SKY
    for k in range(canvas.counts[_SOLIDS]):
        if canvas.numbers[_SOLIDS, k] != last:
            last = canvas.numbers[_SOLIDS, k]
            read_face(view, mesh_of(town, overlay, bodies, last), row_in(town, overlay, last), atlas, light, face)
        right, up = canvas.places[_SOLIDS, k, 0], canvas.places[_SOLIDS, k, 1]
        solid_colour(view, face, right, up, atlas, light, lamps, shadows, canvas.colour)
        _add_colour(canvas, _SOLIDS, k)
