"""Colours of a picture from its visibility buffer: light, shadows, textures, fog, and smooth edges.

A pixel whose samples all see the same surface is shaded once, others once for each triangle that they see. Neighbours
that see the same triangle are a run, which is coloured at once; light and air follow for many runs together.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.pictures.camera.faces import FACES, Face, add_face, face_of, read_face
from dorothie_gym.pictures.camera.illumination import light_samples
from dorothie_gym.pictures.camera.labels import mesh_of, row_in
from dorothie_gym.pictures.camera.mesh import PLAIN, Mesh, Surface
from dorothie_gym.pictures.camera.paving import add_ground
from dorothie_gym.pictures.camera.rasterizer import SKY, VisibilityBuffer
from dorothie_gym.pictures.camera.samples import BLUE, GREEN, RED, RIGHT, ROOM, UP, WEIGHT, Samples
from dorothie_gym.pictures.camera.sky import add_sky
from dorothie_gym.support.compilation import compiled, concurrent, inlined

if TYPE_CHECKING:
    from dorothie_gym.pictures.camera.daylight import Daylight
    from dorothie_gym.pictures.camera.ground.lookup import GroundArrays
    from dorothie_gym.pictures.camera.head_lights import HeadLights
    from dorothie_gym.pictures.camera.lighting import LampMap
    from dorothie_gym.pictures.camera.optics import Optics
    from dorothie_gym.pictures.camera.pose import View
    from dorothie_gym.pictures.camera.shadows import ShadowMaps
    from dorothie_gym.pictures.camera.texturing import Textures

_GROUND = int(Surface.GROUND)


@concurrent
def shade(
    view: View, optics: Optics, buffer: VisibilityBuffer, side: int, town: Mesh, overlay: Mesh, bodies: Mesh,
    ground: GroundArrays, textures: Textures, light: Daylight, noise: NDArray[np.float32], lamps: LampMap,
    beams: HeadLights, shadows: ShadowMaps, samples: Samples, faces: Face, picture: NDArray[np.uint8],
) -> None:  # fmt: skip
    """Writes the colours of a picture.

    Args:
        view: projection of the picture.
        optics: numbers of the picture.
        buffer: triangles, with `side` x `side` samples in a pixel.
        side: 1 or 2.
        town: objects of every session.
        overlay: static objects of this session.
        bodies: moving bodies.
        ground: materials and colours of the ground.
        textures: textures of the walls.
        light: light and air.
        noise: noise of the sky.
        lamps: light of street lamps on the ground.
        beams: light of the headlights of other vehicles, that was drawn for the picture.
        shadows: maps that were drawn for the picture.
        samples: scratch space.
        faces: scratch space, see `new_faces`.
        picture: (h * w, 3) to be written.
    """
    pixel, count = 0, 0
    for k in range(FACES):
        faces.kind[k, 0] = SKY
    for y in range(view.height):
        upper, lower = buffer.triangles[y * side], buffer.triangles[y * side + side - 1]
        x = 0
        while x < view.width:
            if count > ROOM - 4:
                light_samples(optics, lamps, beams, shadows, samples, count)
                pixel = _write(samples, count, picture, pixel)
                count = 0
            end = x + 1
            if side == 1 or _is_uniform(upper, lower, x * side, town, overlay, bodies):
                number = upper[x * side]
                end = _end_of_run(upper, lower, side, number, end, min(view.width, x + ROOM - count))
                _place(view, optics, samples, count, end - x, x + 0.5, y + 0.5, 1.0)
                _add_run(
                    view, optics, town, overlay, bodies, ground, textures, light, noise, samples, faces, number, count,
                    end - x,
                )  # fmt: skip
                samples.parts[count : count + end - x] = 1
                count += end - x
            else:
                first = count
                for k in range(4):
                    number = _sample(upper, lower, x, k)
                    across, down, share = _place_of(upper, lower, x, k)
                    if share > 0.0:
                        _place(view, optics, samples, count, 1, x + across, y + down, share)
                        _add_run(
                            view, optics, town, overlay, bodies, ground, textures, light, noise, samples, faces, number,
                            count, 1,
                        )  # fmt: skip
                        count += 1
                samples.parts[first] = count - first
            x = end
    light_samples(optics, lamps, beams, shadows, samples, count)
    _write(samples, count, picture, pixel)


# --- Samples ----------------------------------------------------------------------------------------------------------


@inlined
def _end_of_run(
    upper: NDArray[np.int32], lower: NDArray[np.int32], side: int, number: int, first: int, last: int
) -> int:
    """Returns the first pixel from `first` to `last` that does not see a triangle with all its samples."""
    x = first
    if side == 1:
        while x < last and upper[x] == number:
            x += 1
        return x
    while x < last and (
        (upper[2 * x] == number)
        & (upper[2 * x + 1] == number)
        & (lower[2 * x] == number)
        & (lower[2 * x + 1] == number)
    ):
        x += 1
    return x


@inlined
def _sample(upper: NDArray[np.int32], lower: NDArray[np.int32], x: int, k: int) -> int:
    """Returns the triangle that sample k of four in a pixel sees."""
    return int(lower[2 * x + (k & 1)] if k >> 1 else upper[2 * x + (k & 1)])


@compiled
def _place_of(upper: NDArray[np.int32], lower: NDArray[np.int32], x: int, k: int) -> tuple[float, float, float]:
    """Returns the centre and the share of the samples of a pixel that see the triangle of sample k.

    The share is 0 if an earlier sample already sees it.
    """
    number, across, down, count = _sample(upper, lower, x, k), 0, 0, 0
    for j in range(4):
        if _sample(upper, lower, x, j) == number:
            if j < k:
                return 0.0, 0.0, 0.0
            across, down, count = across + (j & 1), down + (j >> 1), count + 1
    return 0.25 + 0.5 * across / count, 0.25 + 0.5 * down / count, 0.25 * count


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
    """Returns whether two triangles lie in one plane and look the same, like the halves of a wall."""
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
def _place(
    view: View, optics: Optics, samples: Samples, first: int, count: int, x: float, y: float, weight: float
) -> None:
    """Writes the places of neighbours in a row of the picture, of which the first is at (x, y) [pixels]."""
    values, size = samples.values[first:], optics.pixel
    left, up = x - 0.5 * view.width, (0.5 * view.height - y) * size
    for k in range(count):
        values[RIGHT + k], values[UP + k], values[WEIGHT + k] = (left + k) * size, up, weight


@compiled
def _add_run(
    view: View, optics: Optics, town: Mesh, overlay: Mesh, bodies: Mesh, ground: GroundArrays, textures: Textures,
    light: Daylight, noise: NDArray[np.float32], samples: Samples, faces: Face, number: int, first: int, count: int,
) -> None:  # fmt: skip
    """Writes colours and surfaces of samples that see a triangle."""
    if number == SKY:
        add_sky(optics, light, noise, samples, first, count)
        return
    face = face_of(faces, number % FACES)
    if number != face.kind[0]:
        mesh, row = mesh_of(town, overlay, bodies, number), row_in(town, overlay, number)
        read_face(view, optics, mesh, row, textures, face)
        face.kind[0] = number
    if face.kind[2] & _GROUND:
        add_ground(optics, ground, samples, face, first, count)
    else:
        add_face(optics, textures, samples, face, first, count)


@inlined
def _write(samples: Samples, count: int, picture: NDArray[np.uint8], first: int) -> int:
    """Writes the colours of pixels, starting with a given one; returns the pixel after the last."""
    values, pixel, k = samples.values, first, 0
    while k < count:
        parts = int(samples.parts[k])
        red, green, blue = values[RED + k], values[GREEN + k], values[BLUE + k]
        if parts > 1:
            red, green, blue = 0.0, 0.0, 0.0
            for j in range(k, k + parts):
                red += values[WEIGHT + j] * values[RED + j]
                green += values[WEIGHT + j] * values[GREEN + j]
                blue += values[WEIGHT + j] * values[BLUE + j]
        picture[pixel, 0], picture[pixel, 1], picture[pixel, 2] = int(red + 0.5), int(green + 0.5), int(blue + 0.5)
        pixel, k = pixel + 1, k + parts
    return pixel
