"""Procedural textures of walls, roofs and trees: computed with NumPy from fixed seeds, the same on every machine.

Pictures are RGBA (height, width, 4) in 0..255 with row 0 at the bottom. Patterns of walls are light, so that the colour
of a building tints them; windows and doors are dark. Alpha is the share of own light at night: of lit windows.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.support import portable_arrays as pn

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array
    from dorothie_gym.pictures.camera.lettering import Ink, Picture

BAYS = 4
"""Windows beside and above each other in one repeat of a wall with windows."""

_CELL = 64  # [px] of a bay
_SIZE = 128  # [px] of a pattern without windows
_LIT = 0.45  # share of the windows with light at night
_LIGHT = 200.0  # alpha of a lit window


def brick() -> Picture:
    """Returns courses of bricks with light mortar, 1.6 m by 1.6 m in one repeat."""
    return _bricks(_SIZE, rows=20, columns=6)


def brick_windows() -> Picture:
    """Returns a brick wall with sash windows."""
    base = _bricks(BAYS * _CELL, rows=BAYS * 20, columns=BAYS * 8)
    return _windows(base, (0.27, 0.73, 0.26, 0.80), (236, 234, 226), seed=11, sill=(206, 204, 198))


def plaster() -> Picture:
    """Returns rough plaster."""
    return _grey(247.0 * (1.0 + 0.04 * _noise(_SIZE, 3)))


def plaster_windows() -> Picture:
    """Returns a plastered wall with windows and a ledge between storeys."""
    base = _grey(247.0 * (1.0 + 0.03 * _noise(BAYS * _CELL, 4)))
    _, up = _places(base)
    base[up > 0.955, :3] *= 0.86
    return _windows(base, (0.22, 0.78, 0.24, 0.82), (250, 250, 250), seed=12, sill=(214, 212, 206))


def clapboard_windows() -> Picture:
    """Returns a wall of boards with small windows, for houses."""
    size = BAYS * _CELL
    rows = np.arange(size)[:, None] % 8
    base = _grey(np.broadcast_to(np.where(rows == 0, 205.0, 240.0 + 1.5 * rows), (size, size)).astype(np.float64))
    return _windows(base, (0.30, 0.70, 0.34, 0.78), (252, 252, 250), seed=13, sill=(236, 236, 236))


def panels() -> Picture:
    """Returns storeys of concrete slabs with bands of windows."""
    base = _grey(232.0 * (1.0 + 0.05 * _noise(BAYS * _CELL, 5)))
    across, up = _places(base)
    base[(up < 0.03) | (across < 0.02), :3] *= 0.72
    return _windows(base, (0.03, 0.97, 0.36, 0.84), (120, 124, 128), seed=14, sill=None)


def office() -> Picture:
    """Returns a curtain wall of glass with thin mullions."""
    size = BAYS * _CELL
    base = _grey(np.full((size, size), 236.0))
    across, up = _places(base)
    column, row = _cells(base)
    share = _random(21, (BAYS, BAYS))[row, column]
    tone = 0.82 + 0.30 * up + 0.12 * share
    glass = (across > 0.03) & (across < 0.97) & (up > 0.2)
    base[glass, :3] = (np.array([104.0, 132.0, 152.0]) * tone[..., None])[glass]
    below = (across > 0.03) & (up <= 0.2) & (up > 0.03)
    base[below, :3] = (92, 104, 114)
    base[..., 3] = np.where(glass & (_random(22, (BAYS, BAYS))[row, column] < _LIT), 0.8 * _LIGHT, 0.0)
    return base


def shops() -> Picture:
    """Returns four adjacent shops: awning, window and door; one storey, light at night."""
    height, width = 64, BAYS * 64
    base = np.zeros((height, width, 4), dtype=np.float32)
    up = np.broadcast_to((np.arange(height)[:, None] + 0.5) / height, (height, width))
    across = np.broadcast_to((np.arange(width)[None] + 0.5) / 64.0 % 1.0, (height, width))
    shop = np.broadcast_to(np.arange(width)[None] // 64, (height, width))
    base[..., :3] = (150, 144, 136)
    awnings = np.array([(178, 60, 52), (46, 96, 74), (58, 82, 132), (190, 142, 52)], dtype=np.float32)[shop]
    light = np.array([235.0, 235.0, 228.0], dtype=np.float32)
    striped = np.where((across * 8.0 % 1.0 < 0.5)[..., None], light, awnings)
    awning = (up > 0.74) & (up < 0.88)
    base[..., :3] = np.where(awning[..., None], striped, base[..., :3])
    window = (across > 0.06) & (across < 0.64) & (up > 0.14) & (up < 0.74)
    rim = (across > 0.04) & (across < 0.66) & (up > 0.12) & (up <= 0.74) & ~window
    base[rim, :3] = (62, 60, 58)
    tone = (0.8 + 0.5 * (up - 0.14)) * (0.92 + 0.16 * _random(31, (height // 8, width // 8)).repeat(8, 0).repeat(8, 1))
    base[window, :3] = (np.array([88.0, 102.0, 112.0]) * tone[..., None])[window]
    door = (across > 0.72) & (across < 0.92) & (up < 0.70)
    base[door, :3] = (84, 60, 44)
    pane = (across > 0.75) & (across < 0.89) & (up > 0.26) & (up < 0.66)
    base[pane, :3] = (96, 110, 120)
    base[window | pane, 3] = 0.9 * _LIGHT
    return base


def glass_front() -> Picture:
    """Returns the glazed front of a shop: four panes with thin frames, light at night."""
    height, width = 64, 256
    base = np.zeros((height, width, 4), dtype=np.float32)
    up = np.broadcast_to((np.arange(height)[:, None] + 0.5) / height, (height, width))
    across = np.broadcast_to((np.arange(width)[None] + 0.5) / 64.0 % 1.0, (height, width))
    base[..., :3] = (70, 72, 76)
    pane = (across > 0.04) & (across < 0.96) & (up > 0.10) & (up < 0.96)
    base[pane, :3] = (np.array([112.0, 130.0, 140.0]) * (0.75 + 0.45 * up)[..., None])[pane]
    base[pane, 3] = _LIGHT
    return base


def door() -> Picture:
    """Returns the door of a house with a small window."""
    base = np.zeros((64, 32, 4), dtype=np.float32)
    up, across = np.mgrid[0:64, 0:32] + 0.5
    base[..., :3] = (238, 236, 230)
    leaf = (across > 3) & (across < 29) & (up < 61)
    base[leaf, :3] = (196, 190, 182)
    pane = (across > 9) & (across < 23) & (up > 40) & (up < 54)
    base[pane] = (92, 106, 118, _LIGHT)
    base[(across > 24) & (across < 27) & (up > 26) & (up < 31), :3] = (120, 100, 40)
    return base


def roof_tiles() -> Picture:
    """Returns rows of tiles."""
    size = _SIZE
    row, column = np.mgrid[0:size, 0:size]
    share = _random(41, (16, 17))[row // 8, (column + 4 * (row // 8 % 2)) // 8]
    edge = ((column + 4 * (row // 8 % 2)) % 8 == 0) | (row % 8 == 0)
    return _grey(np.where(edge, 168.0, 214.0 + 5.0 * (row % 8)) * (0.9 + 0.14 * share))


def leaves() -> Picture:
    """Returns foliage: clumps of light and shade."""
    fine = _random(51, (_SIZE // 2, _SIZE // 2)).repeat(2, 0).repeat(2, 1)
    clumps = _noise(_SIZE, 52, octaves=5)
    return _grey(255.0 * (0.74 + 0.34 * clumps + 0.36 * (fine - 0.45)))


def concrete() -> Picture:
    """Returns concrete with faint stains."""
    return _grey(238.0 * (1.0 + 0.08 * _noise(_SIZE, 61)))


def bark() -> Picture:
    """Returns vertical ridges."""
    columns = _random(71, (1, 32)).repeat(2, 1)
    return _grey(np.broadcast_to(160.0 + 90.0 * columns, (64, 64)) * (1.0 + 0.08 * _noise(64, 72)))


def stripes() -> Picture:
    """Returns a white and an orange stripe that slant, in one repeat."""
    row, column = np.mgrid[0:32, 0:32]
    base = np.zeros((32, 32, 4), dtype=np.float32)
    base[..., :3] = np.where(((row + column) % 32 < 16)[..., None], (240, 240, 236), (240, 98, 24))
    return base


def house_sign() -> Picture:
    """Returns a white house with a door on blue."""
    across, up = _square()
    roof = (up > 0.50) & (up < 0.88) & (np.abs(across - 0.5) < (0.88 - up) * 1.05)
    walls = (np.abs(across - 0.5) < 0.27) & (up > 0.14) & (up <= 0.50)
    door = (np.abs(across - 0.5) < 0.08) & (up > 0.14) & (up < 0.36)
    return _sign((roof | walls) & ~door, (24, 74, 168))


def person_sign() -> Picture:
    """Returns a white person with a raised arm on magenta."""
    across, up = _square()
    head = pn.hypot(across - 0.5, up - 0.80) < 0.10
    body = (np.abs(across - 0.5) < 0.12) & (up > 0.38) & (up < 0.68)
    legs = (np.abs(np.abs(across - 0.5) - 0.065) < 0.05) & (up > 0.08) & (up <= 0.40)
    arm = (np.abs(across - 0.345) < 0.04) & (up > 0.36) & (up < 0.66)
    raised = (np.abs((across - 0.62) - 0.55 * (up - 0.62)) < 0.045) & (up > 0.58) & (up < 0.92)
    return _sign(head | body | legs | arm | raised, (176, 28, 120))


def _square() -> tuple[Array, Array]:
    share = (np.arange(64) + 0.5) / 64.0
    return np.broadcast_to(share[None], (64, 64)), np.broadcast_to(share[:, None], (64, 64))


def _sign(figure: NDArray[np.bool_], ground: Ink) -> Picture:
    """Returns a white figure on a ground with a white rim."""
    across, up = _square()
    rim = np.maximum(np.abs(across - 0.5), np.abs(up - 0.5)) > 0.46
    picture = np.zeros((64, 64, 4), dtype=np.float32)
    picture[..., :3] = np.where((figure | rim)[..., None], 255, ground)
    return picture


def _bricks(size: int, *, rows: int, columns: int) -> Picture:
    row, column = np.mgrid[0:size, 0:size]
    course = (row * rows) // size
    place = column * columns / size + 0.5 * (course % 2)
    number = np.floor(place).astype(np.int64) % columns
    mortar = ((row * rows) % size < 0.16 * size) | (place % 1.0 < 0.08)
    tone = 0.84 + 0.22 * _random(81, (rows, columns))[course, number]
    return _grey(np.where(mortar, 206.0, 250.0 * tone * (1.0 + 0.04 * _noise(size, 82))))


def _windows(
    base: Picture, box: tuple[float, float, float, float], frame: Ink, *, seed: int, sill: Ink | None
) -> Picture:
    """Adds a window to each bay: left, right, lower and upper edge as shares of it; some with curtains or light."""
    left, right, low, high = box
    across, up = _places(base)
    column, row = _cells(base)
    pane = (across >= left) & (across < right) & (up >= low) & (up < high)
    rim = (across >= left - 0.035) & (across < right + 0.035) & (up >= low - 0.035) & (up < high + 0.035) & ~pane
    base[rim, :3] = frame
    if sill is not None:
        base[(across >= left - 0.07) & (across < right + 0.07) & (up >= low - 0.075) & (up < low - 0.035), :3] = sill
    share = _random(seed, (BAYS, BAYS))[row, column]
    height = (up - low) / (high - low)
    tone = 0.78 + 0.5 * height + 0.22 * (share - 0.5)
    base[pane, :3] = (np.array([74.0, 92.0, 108.0]) * tone[..., None])[pane]
    curtain = pane & (_random(seed + 100, (BAYS, BAYS))[row, column] < 0.3) & (height > 0.45)
    base[curtain, :3] = (190, 186, 176)
    middle = (np.abs(across - (left + right) / 2.0) < 0.014) | (np.abs(height - 0.62) < 0.025)
    base[pane & middle, :3] = frame
    lit = pane & ~middle & (_random(seed + 200, (BAYS, BAYS))[row, column] < _LIT)
    base[..., 3] = np.where(lit, _LIGHT, 0.0)
    return base


def _places(base: Picture) -> tuple[Array, Array]:
    """Returns where each texel lies in its bay: shares (height, width) from the left and from below."""
    size = base.shape[0]
    share = (np.arange(size) + 0.5) / _CELL % 1.0
    return np.broadcast_to(share[None], (size, size)), np.broadcast_to(share[:, None], (size, size))


def _cells(base: Picture) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Returns column and row (height, width) of the bay of each texel."""
    size = base.shape[0]
    number = np.arange(size) // _CELL
    return np.broadcast_to(number[None], (size, size)), np.broadcast_to(number[:, None], (size, size))


def _grey(tone: Array) -> Picture:
    picture = np.zeros((*tone.shape, 4), dtype=np.float32)
    picture[..., :3] = np.clip(tone, 0.0, 255.0)[..., None]
    return picture


def _random(seed: int, shape: tuple[int, int]) -> Array:
    return np.random.default_rng(seed).random(shape)


def _noise(size: int, seed: int, octaves: int = 4) -> Array:
    """Returns smooth noise (size, size) in [-1, 1] that repeats at its edges."""
    rng = np.random.default_rng(seed)
    total = np.zeros((size, size))
    for k in range(octaves):
        knots = rng.standard_normal((2 ** (k + 2),) * 2)
        total += _blended(knots, size) / 2.0**k
    total -= total.mean()
    return np.asarray(total / np.abs(total).max())


def _blended(knots: Array, size: int) -> Array:
    """Returns values (size, size) between periodic knots (n, n), with smooth steps."""
    place = np.arange(size) * len(knots) / size
    first = np.floor(place).astype(np.int64)
    share = place - first
    share = share * share * (3.0 - 2.0 * share)
    after = (first + 1) % len(knots)
    rows = knots[first] * (1.0 - share[:, None]) + knots[after] * share[:, None]
    return np.asarray(rows[:, first] * (1.0 - share) + rows[:, after] * share)
