"""Colour of the ground at a point: noise, smooth edges of paint, and averaged colours for distant ground."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.pictures.camera.ground.lookup import (
    GroundArrays,
    cell_at,
    is_mixed,
    material_in,
    material_of_part,
    materials_around,
    part_at,
    part_of,
)
from dorothie_gym.support.compilation import compiled, inlined

TEXEL = 0.5
"""Width of a texel of the finest averaged picture [m]; doubles from level to level."""

NOISE_SIZE = 256
_NOISE_BITS = 8

GRAINS, PATCHES = 24.0, 2.1
"""Points of noise of two sizes [1/m]."""

BLENDED = 0.3
"""Width of a footprint at which averaged colours begin to be blended in [m]."""

SHARP = 0.03
"""Width of a footprint up to which one sample is sufficient [m]."""

LONG = 0.7
"""Length of a footprint from which points along the ray are sampled [m]; shorter ones are sampled as squares."""

WIDE = 0.4
"""Width of a long footprint from which averaged colours are sufficient [m]: lines are then much narrower."""

_SHORT = 2.5  # [m] length of a footprint up to which four points suffice
_FAR_POINTS = 6  # points along a wide footprint
_GOLDEN, _FIRST_ASIDE = 0.618033988749895, 0.5  # places across a footprint: no two points lie side by side
_PATCH_SHARE = 0.5  # strength of the patches relative to the grains
_SHIFT = 1 << 20  # makes all coordinates positive: truncation instead of rounding down
_MASK = NOISE_SIZE - 1


@compiled
def colour_at(ground: GroundArrays, sheet: int, x: float, y: float, footprint: float) -> tuple[float, float, float]:
    """Returns red, green and blue, 0..255, at a position [m], averaged over a square of a width `footprint` [m]."""
    if footprint >= TEXEL:
        return _averaged(ground, sheet, x, y, footprint)
    red, green, blue = _sampled(ground, sheet, x, y, footprint)
    if footprint > BLENDED:
        share = (footprint - BLENDED) / (TEXEL - BLENDED)
        other = _averaged(ground, sheet, x, y, TEXEL)
        red, green, blue = (
            red + share * (other[0] - red),
            green + share * (other[1] - green),
            blue + share * (other[2] - blue),
        )
    return red, green, blue


@compiled
def _sampled(ground: GroundArrays, sheet: int, x: float, y: float, footprint: float) -> tuple[float, float, float]:
    """Returns the colour of the material, or the mean of four samples where they differ, with noise."""
    middle = part_at(ground, sheet, x, y)
    if footprint <= SHARP or not is_mixed(ground, sheet, middle):
        red, green, blue, grain = _look(ground, material_of_part(ground, sheet, middle, x, y))
    else:
        first, second, third, fourth = materials_around(ground, sheet, x, y, footprint / 4.0)
        red, green, blue, grain = mean_look(ground, first, second, third, fourth)
    noise = noise_at(ground.noise, noise_place(x, y, GRAINS)) * grain_weight(footprint)
    noise += noise_at(ground.noise, noise_place(x, y, PATCHES)) * patch_weight(footprint)
    factor = 1.0 + grain * noise
    return red * factor, green * factor, blue * factor


@compiled
def look_along(
    ground: GroundArrays, sheet: int, x: float, y: float, ahead_x: float, ahead_y: float, length: float, width: float
) -> tuple[float, float, float, float]:
    """Returns the mean red, green, blue and strength of the noise in a long footprint, from points along the ray.

    A square footprint of the same area would be many times as wide as the pixel, and lines would fade.

    Args:
        ground: materials.
        sheet: sheet of the ground.
        x: x coordinate of the middle [m].
        y: y coordinate of the middle [m].
        ahead_x: x of the unit vector along the footprint.
        ahead_y: y of the unit vector along the footprint.
        length: [m].
        width: [m].
    """
    count = 4 if length < _SHORT else 6
    red = green = blue = grain = 0.0
    left, top = ground.origins[sheet, 0], ground.origins[sheet, 1]
    inverse, columns, rows = 1.0 / ground.size[0], ground.shapes[sheet, 0], ground.shapes[sheet, 1]
    step, same, last, aside = length / count, 0, -1, _FIRST_ASIDE
    for k in range(count):
        along, across = (k + 0.5) * step - 0.5 * length, (aside - 0.5) * width
        aside += _GOLDEN if aside < 1.0 - _GOLDEN else _GOLDEN - 1.0
        px, py = x + along * ahead_x - across * ahead_y, y + along * ahead_y + across * ahead_x
        material = material_of_part(ground, sheet, part_of(left, top, inverse, columns, rows, px, py), px, py)
        if material == last:
            same += 1
            continue
        if same:
            r, g, b, n = _look(ground, last)
            red, green, blue, grain = red + same * r, green + same * g, blue + same * b, grain + same * n
        last, same = material, 1
    r, g, b, n = _look(ground, last)
    share = 1.0 / count
    return (red + same * r) * share, (green + same * g) * share, (blue + same * b) * share, (grain + same * n) * share


@compiled
def averaged_along(
    ground: GroundArrays, sheet: int, x: float, y: float, ahead_x: float, ahead_y: float, length: float, width: float
) -> tuple[float, float, float]:
    """Returns the mean red, green and blue in a footprint that is wide as well, from averaged colours along the ray.

    Arguments are those of `look_along`.
    """
    level, density, last = 0, 1.0 / TEXEL, ground.levels.shape[1] - 1
    while level < last and width * density >= 2.0:
        level, density = level + 1, 0.5 * density
    columns, rows, first = (
        ground.levels[sheet, level, 0],
        ground.levels[sheet, level, 1],
        ground.levels[sheet, level, 2],
    )
    u, v = (x - ground.origins[sheet, 0]) * density, (y - ground.origins[sheet, 1]) * density
    step = length * density / _FAR_POINTS
    red = green = blue = 0.0
    for k in range(_FAR_POINTS):
        along = (k + 0.5 - 0.5 * _FAR_POINTS) * step
        column, row = math.floor(u + along * ahead_x), math.floor(v + along * ahead_y)
        if column < 0 or row < 0 or column >= columns or row >= rows:
            r, g, b, _ = _look(ground, int(ground.outside[sheet]))
        else:
            texel = first + row * columns + column
            r, g, b = float(ground.texels[texel, 0]), float(ground.texels[texel, 1]), float(ground.texels[texel, 2])
        red, green, blue = red + r, green + g, blue + b
    return red * (1.0 / _FAR_POINTS), green * (1.0 / _FAR_POINTS), blue * (1.0 / _FAR_POINTS)


@inlined
def _look(ground: GroundArrays, material: int) -> tuple[float, float, float, float]:
    """Returns red, green, blue and the strength of the noise of a material."""
    colours = ground.colours
    return (
        float(colours[material, 0]),
        float(colours[material, 1]),
        float(colours[material, 2]),
        float(ground.grains[material]),
    )


@inlined
def mean_look(
    ground: GroundArrays, first: int, second: int, third: int, fourth: int
) -> tuple[float, float, float, float]:
    """Returns the mean red, green, blue and strength of the noise of `materials_around` a place."""
    red, green, blue, grain = _look(ground, first)
    r, g, b, n = _look(ground, fourth)
    red, green, blue, grain, share = red + r, green + g, blue + b, grain + n, 0.5
    if first != fourth:
        for k in range(2):
            r, g, b, n = _look(ground, second if k == 0 else third)
            red, green, blue, grain = red + r, green + g, blue + b, grain + n
        share = 0.25
    return red * share, green * share, blue * share, grain * share


@inlined
def noise_place(x: float, y: float, density: float) -> int:
    """Returns the index into the noise table at a position [m]; `density` is the number of its entries per metre."""
    return (int(y * density + _SHIFT) & _MASK) * NOISE_SIZE + (int(x * density + _SHIFT) & _MASK)


@inlined
def noise_at(noise: NDArray[np.uint8], place: int) -> float:
    """Returns noise in about -1..1 around 0."""
    return int(noise[place >> _NOISE_BITS, place & _MASK]) * (1.0 / 128.0) - 1.0


@inlined
def grain_weight(footprint: float) -> float:
    """Returns the strength of grains, which large footprints [m] average out."""
    return max(0.0, 1.0 - footprint * 6.0)


@inlined
def patch_weight(footprint: float) -> float:
    """Returns the strength of patches for a footprint [m]."""
    return _PATCH_SHARE * max(0.0, 1.0 - footprint * (1.0 / TEXEL))


@compiled
def _averaged(ground: GroundArrays, sheet: int, x: float, y: float, footprint: float) -> tuple[float, float, float]:
    """Returns the colour of the averaged pictures: linear within two levels and between them."""
    level, density, last = 0, 1.0 / TEXEL, ground.levels.shape[1] - 1
    while level < last and footprint * density >= 2.0:
        level, density = level + 1, 0.5 * density
    red, green, blue = _level_colour(ground, sheet, level, density, x, y)
    share = min(max(footprint * density - 1.0, 0.0), 1.0)
    if share > 0.0 and level < last:
        r, g, b = _level_colour(ground, sheet, level + 1, 0.5 * density, x, y)
        red, green, blue = red + share * (r - red), green + share * (g - green), blue + share * (b - blue)
    return red, green, blue


@compiled
def _level_colour(
    ground: GroundArrays, sheet: int, level: int, density: float, x: float, y: float
) -> tuple[float, float, float]:
    """Returns the bilinear colour of one level with a number of texels per metre, a power of two."""
    columns, rows = ground.levels[sheet, level, 0], ground.levels[sheet, level, 1]
    u, v = (x - ground.origins[sheet, 0]) * density - 0.5, (y - ground.origins[sheet, 1]) * density - 0.5
    if u < -0.5 or v < -0.5 or u > columns - 0.5 or v > rows - 0.5:
        red, green, blue, _ = _look(ground, int(ground.outside[sheet]))
        return red, green, blue
    u, v = min(max(u, 0.0), columns - 1.0), min(max(v, 0.0), rows - 1.0)
    left, top = int(u), int(v)
    right, below = min(left + 1, columns - 1), min(top + 1, rows - 1)
    u, v = u - left, v - top
    first, texels = ground.levels[sheet, level, 2], ground.texels
    a, b = first + top * columns + left, first + top * columns + right
    c, d = first + below * columns + left, first + below * columns + right
    both = u * v
    wa, wb, wc, wd = 1.0 - u - v + both, u - both, v - both, both
    return (
        int(texels[a, 0]) * wa + int(texels[b, 0]) * wb + int(texels[c, 0]) * wc + int(texels[d, 0]) * wd,
        int(texels[a, 1]) * wa + int(texels[b, 1]) * wb + int(texels[c, 1]) * wc + int(texels[d, 1]) * wd,
        int(texels[a, 2]) * wa + int(texels[b, 2]) * wb + int(texels[c, 2]) * wc + int(texels[d, 2]) * wd,
    )


# --- Building ---------------------------------------------------------------------------------------------------------

SAMPLES = 4
"""Samples along each side of a texel of the finest averaged picture."""


@compiled
def paint_finest(ground: GroundArrays, sheet: int, columns: int, rows: int, out: NDArray[np.uint8]) -> None:
    """Writes the averaged colours of the finest level of a sheet to `out` (rows * columns, 3)."""
    for row in range(rows):
        for column in range(columns):
            x, y = ground.origins[sheet, 0] + column * TEXEL, ground.origins[sheet, 1] + row * TEXEL
            # a texel lies in one cell: cells are whole texels wide
            value = cell_at(ground, sheet, x + TEXEL / 2.0, y + TEXEL / 2.0)
            red = green = blue = 0.0
            count = 1 if value >= 0 else SAMPLES
            for k in range(count):
                for i in range(count):
                    material = value
                    if value < 0:
                        # no two samples of a texel share a column or a row: thin lines keep their share
                        across = (i + (k + 0.5) / count) / count * TEXEL
                        down = (k + (i + 0.5) / count) / count * TEXEL
                        material = material_in(ground, sheet, -1 - value, x + across, y + down)
                    red += ground.colours[material, 0]
                    green += ground.colours[material, 1]
                    blue += ground.colours[material, 2]
            number = row * columns + column
            out[number, 0] = int(red / (count * count) + 0.5)
            out[number, 1] = int(green / (count * count) + 0.5)
            out[number, 2] = int(blue / (count * count) + 0.5)


def halved(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Returns a picture (rows, columns, 3) at half the size, odd edges repeated."""
    rows, columns, _ = picture.shape
    even = np.pad(picture, ((0, rows % 2), (0, columns % 2), (0, 0)), mode="edge").astype(np.uint16)
    total = even[::2, ::2] + even[1::2, ::2] + even[::2, 1::2] + even[1::2, 1::2]
    return np.asarray((total + 2) // 4).astype(np.uint8)


def ground_noise() -> NDArray[np.uint8]:
    """Returns noise (256, 256) that repeats without seams: waves of falling strength, and single grains."""
    rng = np.random.default_rng(20)
    total = np.zeros((NOISE_SIZE, NOISE_SIZE))
    for octave in range(6):
        cells = 4 << octave
        lattice = rng.uniform(-1.0, 1.0, (cells, cells))
        at = np.arange(NOISE_SIZE) * cells / NOISE_SIZE
        low = at.astype(int)
        share = at - low
        share = share * share * (3.0 - 2.0 * share)
        across = lattice[:, low] * (1.0 - share) + lattice[:, (low + 1) % cells] * share
        smooth = across[low] * (1.0 - share)[:, None] + across[(low + 1) % cells] * share[:, None]
        total += smooth * math.prod([0.62] * octave)
    total = total / np.abs(total).max() * 110.0 + rng.normal(0.0, 9.0, total.shape)
    return np.asarray(np.clip(128.0 + total - total.mean(), 0, 255)).astype(np.uint8)
