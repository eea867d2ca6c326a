"""Colours of the ground in a picture."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.pictures.camera.ground.colours import (
    BLENDED,
    GRAINS,
    LONG,
    PATCHES,
    SHARP,
    WIDE,
    averaged_along,
    colour_at,
    grain_weight,
    look_along,
    mean_look,
    noise_at,
    noise_place,
    patch_weight,
)
from dorothie_gym.pictures.camera.ground.lookup import (
    PARTS,
    SEVERAL,
    GroundArrays,
    material_of_square,
    materials_between,
    part_of,
)
from dorothie_gym.pictures.camera.mesh import Surface
from dorothie_gym.pictures.camera.samples import (
    AMBIENT,
    BIAS,
    BLUE,
    BRIGHT,
    DEPTH,
    FIRST,
    GREEN,
    LAMP,
    ONE,
    OWN,
    RED,
    RIGHT,
    SECOND,
    SLANT,
    SUN,
    THIRD,
    THREE,
    TWO,
    UP,
    Samples,
    X,
    Y,
    whole_vectors,
)
from dorothie_gym.support.compilation import compiled, inlined

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array
    from dorothie_gym.pictures.camera.faces import Face
    from dorothie_gym.pictures.camera.optics import Optics

_GROUND = int(Surface.GROUND)
_LEAST_SLANT = 0.012  # a view as flat as this one has the footprints of it
_DONE = -1  # instead of a material: the colour has been written


@compiled
def add_ground(optics: Optics, ground: GroundArrays, samples: Samples, face: Face, first: int, count: int) -> None:
    """Writes colours and surfaces of samples from `first` on that see a triangle of the ground."""
    values, places, sheet = samples.values[first:], samples.indices[first:], face.kind[1]
    _place_ground(optics, ground, values, places, face, count)
    samples.surfaces[first : first + count] = _GROUND
    cells, noise = ground.cells[ground.firsts[sheet] :], ground.noise
    outside, inverse = int(ground.outside[sheet]), 1.0 / ground.size[0]
    for k in range(count):
        across = values[DEPTH + k] * optics.pixel
        along = across / max(values[SLANT + k], _LEAST_SLANT)
        if along > LONG:
            _add_long(optics, ground, sheet, values, places, k, along, across)
            continue
        width, place, material = values[ONE + k], places[FIRST + k], outside
        if place >= 0:
            material = int(cells[place // PARTS])
            if material < 0:
                material = SEVERAL
                if width <= SHARP:
                    material = material_of_square(ground, sheet, place)
                elif width <= BLENDED:
                    material = _add_mixed(ground, sheet, inverse, values, places, k, width / 4.0)
        if material == _DONE:
            continue
        if material != SEVERAL and width <= BLENDED:
            factor = 1.0 + float(ground.grains[material]) * _noise(noise, values, places, k)
            values[RED + k] = float(ground.colours[material, 0]) * factor
            values[GREEN + k] = float(ground.colours[material, 1]) * factor
            values[BLUE + k] = float(ground.colours[material, 2]) * factor
        else:
            values[RED + k], values[GREEN + k], values[BLUE + k] = colour_at(
                ground, sheet, values[X + k], values[Y + k], width
            )


@inlined
def _add_long(
    optics: Optics,
    ground: GroundArrays,
    sheet: int,
    values: Array,
    places: NDArray[np.int64],
    k: int,
    along: float,
    across: float,
) -> None:
    """Writes the colour of a sample with a long footprint, where the view of the ground is grazing."""
    x, y = values[X + k], values[Y + k]
    dx, dy = x - optics.x, y - optics.y
    scale = 1.0 / max(math.sqrt(dx * dx + dy * dy), 1e-6)
    if across >= WIDE:
        values[RED + k], values[GREEN + k], values[BLUE + k] = averaged_along(
            ground, sheet, x, y, dx * scale, dy * scale, along, across
        )
        return
    red, green, blue, grain = look_along(ground, sheet, x, y, dx * scale, dy * scale, along, across)
    factor = 1.0 + grain * _noise(ground.noise, values, places, k)
    values[RED + k], values[GREEN + k], values[BLUE + k] = red * factor, green * factor, blue * factor


@inlined
def _noise(noise: NDArray[np.uint8], values: Array, places: NDArray[np.int64], k: int) -> float:
    """Returns the noise of a sample."""
    fine, coarse = places[SECOND + k], places[THIRD + k]
    return float(noise_at(noise, fine) * values[TWO + k] + noise_at(noise, coarse) * values[THREE + k])


@inlined
def _add_mixed(
    ground: GroundArrays, sheet: int, inverse: float, values: Array, places: NDArray[np.int64], k: int, step: float
) -> int:
    """Writes the colour of a sample with several materials around, as `colour_at` does, and returns `_DONE`.

    If both samples that count first show one material, it is returned instead.
    """
    x0, y0, x1, y1 = values[X + k] - step, values[Y + k] - step, values[X + k] + step, values[Y + k] + step
    left, top = ground.origins[sheet, 0], ground.origins[sheet, 1]
    columns, rows = ground.shapes[sheet, 0], ground.shapes[sheet, 1]
    part, other = part_of(left, top, inverse, columns, rows, x0, y0), part_of(left, top, inverse, columns, rows, x1, y1)
    material = material_of_square(ground, sheet, part)
    if material != SEVERAL and (other == part or material_of_square(ground, sheet, other) == material):
        return material
    first, second, third, fourth = materials_between(ground, sheet, part, other, x0, y0, x1, y1)
    red, green, blue, grain = mean_look(ground, first, second, third, fourth)
    factor = 1.0 + grain * _noise(ground.noise, values, places, k)
    values[RED + k], values[GREEN + k], values[BLUE + k] = red * factor, green * factor, blue * factor
    return _DONE


@inlined
def _place_ground(
    optics: Optics, ground: GroundArrays, values: Array, places: NDArray[np.int64], face: Face, count: int
) -> None:
    """Writes the positions of samples and their common values."""
    plane, sheet, inverse = face.plane, face.kind[1], 1.0 / ground.size[0]
    offset, rightward, upward, inward = plane[0], plane[1], plane[2], plane[3]
    sun, bias, ambient = face.light[0], face.light[1], face.light[2]
    left, top = ground.origins[sheet, 0], ground.origins[sheet, 1]
    columns, rows = ground.shapes[sheet, 0], ground.shapes[sheet, 1]
    for k in range(whole_vectors(count)):
        right, up = values[RIGHT + k], values[UP + k]
        toward = min(rightward * right + upward * up + inward, -1e-6)
        depth = offset / toward
        x = optics.x + depth * (optics.ahead_x + right * optics.right_x + up * optics.up_x)
        y = optics.y + depth * (optics.ahead_y + right * optics.right_y + up * optics.up_y)
        width = depth * optics.pixel / math.sqrt(max(-toward, 0.02))
        values[DEPTH + k], values[SLANT + k], values[X + k], values[Y + k] = depth, -toward, x, y
        values[ONE + k] = width
        values[TWO + k], values[THREE + k] = grain_weight(width), patch_weight(width)
        places[FIRST + k] = part_of(left, top, inverse, columns, rows, x, y)
        places[SECOND + k], places[THIRD + k] = noise_place(x, y, GRAINS), noise_place(x, y, PATCHES)
    for k in range(count):
        values[OWN + k], values[BRIGHT + k], values[LAMP + k] = 0.0, 0.0, 1.0
        values[SUN + k], values[BIAS + k], values[AMBIENT + k] = sun, bias, ambient
