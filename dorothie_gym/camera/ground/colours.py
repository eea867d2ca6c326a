"""Colour of the ground at a point: noise, smooth edges of paint, and averaged colours for distant ground."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.camera.ground.lookup import GroundArrays, cell_at, material_at, material_in
from dorothie_gym.compilation import compiled
from dorothie_gym.maps.model import Array

TEXEL = 0.5
"""Width of a texel of the finest averaged picture [m]; doubles from level to level."""

NOISE_SIZE = 256

_FINE, _COARSE = 24.0, 2.1  # [1/m] points of noise: grains, patches
_SHARP = 0.03  # [m] footprint up to which one sample is sufficient
_BLENDED = 0.3  # [m] footprint from which averaged colours are blended in
_COARSE_SHARE = 0.5  # strength of the patches relative to the grains
_SHIFT = 1 << 20  # makes all coordinates positive: truncation instead of rounding down


@compiled
def colour_at(ground: GroundArrays, sheet: int, x: float, y: float, footprint: float, out: Array) -> None:
    """Writes the colour at a position [m], averaged over a square of a width `footprint` [m], to `out` (3,), 0..255."""
    if footprint >= TEXEL:
        _averaged(ground, sheet, x, y, footprint, out)
        return
    _sampled(ground, sheet, x, y, footprint, out)
    if footprint > _BLENDED:
        share = (footprint - _BLENDED) / (TEXEL - _BLENDED)
        red, green, blue = out[0], out[1], out[2]
        _averaged(ground, sheet, x, y, TEXEL, out)
        out[0] = red + share * (out[0] - red)
        out[1] = green + share * (out[1] - green)
        out[2] = blue + share * (out[2] - blue)


@compiled
def _sampled(ground: GroundArrays, sheet: int, x: float, y: float, footprint: float, out: Array) -> None:
    """Writes the colour of the material, or the mean of four samples where they differ, with noise."""
    value = cell_at(ground, sheet, x, y)
    if value >= 0 or footprint <= _SHARP:
        material = value if value >= 0 else material_in(ground, sheet, -1 - value, x, y)
        red, green, blue = ground.colours[material, 0], ground.colours[material, 1], ground.colours[material, 2]
        grain = ground.grains[material]
    else:
        step = footprint / 4.0
        a = material_at(ground, sheet, x - step, y - step)
        d = material_at(ground, sheet, x + step, y + step)
        red = ground.colours[a, 0] + ground.colours[d, 0]
        green = ground.colours[a, 1] + ground.colours[d, 1]
        blue = ground.colours[a, 2] + ground.colours[d, 2]
        grain = ground.grains[a] + ground.grains[d]
        share = np.float32(0.5)
        if a != d:
            b = material_at(ground, sheet, x + step, y - step)
            c = material_at(ground, sheet, x - step, y + step)
            red += ground.colours[b, 0] + ground.colours[c, 0]
            green += ground.colours[b, 1] + ground.colours[c, 1]
            blue += ground.colours[b, 2] + ground.colours[c, 2]
            grain += ground.grains[b] + ground.grains[c]
            share = np.float32(0.25)
        red, green, blue, grain = red * share, green * share, blue * share, grain * share
    factor = 1.0 + grain * _noise(ground, x, y, footprint)
    out[0], out[1], out[2] = red * factor, green * factor, blue * factor


@compiled
def _noise(ground: GroundArrays, x: float, y: float, footprint: float) -> float:
    """Returns noise in about -1..1 around 0, without the grains that are finer than a footprint [m]."""
    mask = NOISE_SIZE - 1
    coarse = ground.noise[int(y * _COARSE + _SHIFT) & mask, int(x * _COARSE + _SHIFT) & mask] / 128.0 - 1.0
    visible = 1.0 - footprint * 6.0
    if visible <= 0.0:
        return float(coarse * _COARSE_SHARE * max(0.0, 1.0 - footprint / TEXEL))
    fine = ground.noise[int(y * _FINE + _SHIFT) & mask, int(x * _FINE + _SHIFT) & mask] / 128.0 - 1.0
    return float(fine * visible + coarse * _COARSE_SHARE * (1.0 - footprint / TEXEL))


@compiled
def _averaged(ground: GroundArrays, sheet: int, x: float, y: float, footprint: float, out: Array) -> None:
    """Writes the colour of the averaged pictures: linear within two levels and between them."""
    last = ground.levels.shape[1] - 1
    depth = np.log2(footprint / TEXEL)
    level = min(int(depth), last)
    share = min(max(depth - level, 0.0), 1.0) if level < last else 0.0
    out[0] = out[1] = out[2] = 0.0
    _add_level(ground, sheet, level, x, y, 1.0 - share, out)
    if share > 0.0:
        _add_level(ground, sheet, level + 1, x, y, share, out)


@compiled
def _add_level(ground: GroundArrays, sheet: int, level: int, x: float, y: float, weight: float, out: Array) -> None:
    """Adds the bilinear colour of one level with a weight."""
    columns, rows = ground.levels[sheet, level, 0], ground.levels[sheet, level, 1]
    size = TEXEL * 2.0**level
    u = (x - ground.origins[sheet, 0]) / size - 0.5
    v = (y - ground.origins[sheet, 1]) / size - 0.5
    if u < -0.5 or v < -0.5 or u > columns - 0.5 or v > rows - 0.5:
        material = ground.outside[sheet]
        for k in range(3):
            out[k] += weight * ground.colours[material, k]
        return
    u, v = min(max(u, 0.0), columns - 1.0), min(max(v, 0.0), rows - 1.0)
    left, top = int(u), int(v)
    right, below = min(left + 1, columns - 1), min(top + 1, rows - 1)
    u, v = u - left, v - top
    first = ground.levels[sheet, level, 2]
    a, b = first + top * columns + left, first + top * columns + right
    c, d = first + below * columns + left, first + below * columns + right
    for k in range(3):
        upper = ground.texels[a, k] * (1.0 - u) + ground.texels[b, k] * u
        lower = ground.texels[c, k] * (1.0 - u) + ground.texels[d, k] * u
        out[k] += weight * (upper * (1.0 - v) + lower * v)


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
        total += smooth * 0.62**octave
    total = total / np.abs(total).max() * 110.0 + rng.normal(0.0, 9.0, total.shape)
    return np.asarray(np.clip(128.0 + total - total.mean(), 0, 255)).astype(np.uint8)
