"""Grid of cells of the lookup of materials, built from polygons in the order of painting."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps.model import Array
from dorothie_gym.pictures.camera.ground.materials import Material
from dorothie_gym.support.compilation import compiled

CELL = 1.0
"""Width of a cell [m]."""

# Offsets of grids, in cells: edges between places at whole metres must not pass exactly through a corner of a cell,
# where rounding decides on which side of it they are.
_ODD = np.array([0.28769531, 0.61137695])
_CLOSE = 1e-6  # [m] from an edge; a cell this near counts as touched
_OPEN = -1


class Painted(NamedTuple):
    """Polygon with its material: corners (n, 2) [m]."""

    points: Array
    material: Material


class Cells(NamedTuple):
    """Cells of one sheet; fields as in `GroundArrays`."""

    origin: Array
    shape: NDArray[np.int64]
    outside: Material
    cells: NDArray[np.int32]
    bases: NDArray[np.uint8]
    counts: NDArray[np.int64]
    materials: NDArray[np.uint8]
    parities: NDArray[np.bool_]
    edge_counts: NDArray[np.int64]
    edges: NDArray[np.int32]
    segments: Array


def build_cells(polygons: Sequence[Painted], low: Array, high: Array, outside: Material, size: float = CELL) -> Cells:
    """Returns the cells of a sheet.

    Args:
        polygons: in the order of painting.
        low: smallest x and y of the grid (2,) [m].
        high: largest x and y of the grid (2,) [m].
        outside: material where there is no polygon.
        size: width of a cell [m].
    """
    origin = (np.floor(low / size) - _ODD) * size
    columns, rows = (int(n) for n in np.ceil((high - origin) / size))
    shape = np.array([columns, rows], dtype=np.int64)
    corners = np.concatenate([np.zeros((0, 2)), *(polygon.points for polygon in polygons)])
    ends = np.concatenate([np.zeros((0, 2)), *(np.roll(polygon.points, -1, axis=0) for polygon in polygons)])
    segments = np.ascontiguousarray(np.concatenate((corners, ends), axis=1))
    bounds = np.concatenate(([0], np.cumsum([len(polygon.points) for polygon in polygons], dtype=np.int64)))
    kinds = np.array([polygon.material for polygon in polygons], dtype=np.uint8)
    grid = np.array([*origin, size])
    base = np.full(rows * columns, _OPEN, dtype=np.int16)
    entries, uses = np.zeros(rows * columns + 1, dtype=np.int64), np.zeros(rows * columns + 1, dtype=np.int64)
    toggles = np.zeros((rows + 1) * (columns + 1), dtype=np.bool_)
    touched = np.zeros(rows * columns, dtype=np.int32)
    _count(grid, shape, segments, bounds, kinds, base, entries, uses, toggles, touched)
    entries, uses = (np.concatenate(([0], np.cumsum(row[:-1]))) for row in (entries, uses))
    table = np.zeros((int(entries[-1]), 3), dtype=np.int64)  # material, parity, number of edges
    edges = np.zeros(int(uses[-1]), dtype=np.int32)
    base[:] = _OPEN
    _fill(grid, shape, segments, bounds, kinds, base, entries[:-1].copy(), uses[:-1].copy(), toggles, touched, table,
          edges)  # fmt: skip
    base[base == _OPEN] = outside
    return _trimmed(origin, shape, outside, base, entries, table, edges, segments)


def _trimmed(
    origin: Array,
    shape: NDArray[np.int64],
    outside: Material,
    base: NDArray[np.int16],
    entries: NDArray[np.int64],
    table: NDArray[np.int64],
    edges: NDArray[np.int32],
    segments: Array,
) -> Cells:
    """Omits candidates that make no difference: the lowest ones whose material equals that of the surface below."""
    counts = np.diff(entries)
    owner = np.repeat(np.arange(len(counts)), counts)
    different = table[:, 0] != base[owner]
    rank = np.arange(len(owner)) - entries[owner]
    last = np.full(len(counts), -1)
    np.maximum.at(last, owner[different], rank[different])
    keep = rank <= last[owner]
    kept_edges = np.repeat(keep, table[:, 2])
    kept = table[keep]
    mixed = np.flatnonzero(last >= 0)
    cells = base.astype(np.int32)
    cells[mixed] = -1 - np.arange(len(mixed), dtype=np.int32)
    used = np.unique(edges[kept_edges])
    return Cells(
        origin, shape, outside, cells, base[mixed].astype(np.uint8), last[mixed] + 1, kept[:, 0].astype(np.uint8),
        kept[:, 1].astype(np.bool_), kept[:, 2],
        np.searchsorted(used, edges[kept_edges]).astype(np.int32), np.ascontiguousarray(segments[used]),
    )  # fmt: skip


# --- Compiled ---------------------------------------------------------------------------------------------------------


@compiled
def _box(grid: Array, shape: NDArray[np.int64], segments: Array, first: int, last: int) -> tuple[int, int, int, int]:
    """Returns the first and last column and row of cells that a polygon may touch, within the grid."""
    low_x = high_x = segments[first, 0]
    low_y = high_y = segments[first, 1]
    for k in range(first + 1, last):
        low_x, high_x = min(low_x, segments[k, 0]), max(high_x, segments[k, 0])
        low_y, high_y = min(low_y, segments[k, 1]), max(high_y, segments[k, 1])
    return (
        max(0, int(np.floor((low_x - _CLOSE - grid[0]) / grid[2]))),
        min(shape[0] - 1, int(np.floor((high_x + _CLOSE - grid[0]) / grid[2]))),
        max(0, int(np.floor((low_y - _CLOSE - grid[1]) / grid[2]))),
        min(shape[1] - 1, int(np.floor((high_y + _CLOSE - grid[1]) / grid[2]))),
    )


@compiled
def row_span(grid: Array, segments: Array, edge: int, row: int) -> tuple[int, int]:
    """Returns the first and last column of cells that an edge touches in a row (first > last if none)."""
    ax, ay, bx, by = segments[edge, 0], segments[edge, 1], segments[edge, 2], segments[edge, 3]
    low, high = grid[1] + row * grid[2] - _CLOSE, grid[1] + (row + 1) * grid[2] + _CLOSE
    if max(ay, by) < low or min(ay, by) > high:
        return 0, -1
    x0, x1 = ax, bx
    if ay != by:
        slope = (bx - ax) / (by - ay)
        if min(ay, by) < low:
            if ay < by:
                x0 = ax + (low - ay) * slope
            else:
                x1 = bx + (low - by) * slope
        if max(ay, by) > high:
            if ay < by:
                x1 = bx + (high - by) * slope
            else:
                x0 = ax + (high - ay) * slope
    first = int(np.floor((min(x0, x1) - _CLOSE - grid[0]) / grid[2]))
    return first, int(np.floor((max(x0, x1) + _CLOSE - grid[0]) / grid[2]))


@compiled
def _rasterise(
    grid: Array,
    shape: NDArray[np.int64],
    segments: Array,
    first: int,
    last: int,
    box: tuple[int, int, int, int],
    toggles: NDArray[np.bool_],
    touched: NDArray[np.int32],
) -> None:
    """Marks for one polygon the corners of cells that lie inside, and counts its edges in each cell."""
    left, right, top, bottom = box
    for row in range(top, bottom + 1):
        toggles[row * (shape[0] + 1) + left : row * (shape[0] + 1) + right + 2] = False
        touched[row * shape[0] + left : row * shape[0] + right + 1] = 0
    for edge in range(first, last):
        ax, ay, bx, by = segments[edge, 0], segments[edge, 1], segments[edge, 2], segments[edge, 3]
        begin = max(top, int(np.floor((min(ay, by) - _CLOSE - grid[1]) / grid[2])))
        end = min(bottom, int(np.floor((max(ay, by) + _CLOSE - grid[1]) / grid[2])))
        for row in range(begin, end + 1):
            a, b = row_span(grid, segments, edge, row)
            for column in range(max(a, left), min(b, right) + 1):
                touched[row * shape[0] + column] += 1
            y = grid[1] + row * grid[2]
            if (ay > y) != (by > y):
                at = ax + (y - ay) / (by - ay) * (bx - ax)
                column = int(np.floor((at - grid[0]) / grid[2])) + 1
                while column > left and grid[0] + (column - 1) * grid[2] > at:
                    column -= 1
                while grid[0] + column * grid[2] <= at:
                    column += 1
                if column <= right:
                    toggles[row * (shape[0] + 1) + max(column, left)] ^= True
    for row in range(top, bottom + 1):
        inside = False
        for column in range(left, right + 1):
            inside ^= toggles[row * (shape[0] + 1) + column]
            toggles[row * (shape[0] + 1) + column] = inside


@compiled
def _count(
    grid: Array, shape: NDArray[np.int64], segments: Array, bounds: NDArray[np.int64], kinds: NDArray[np.uint8],
    base: NDArray[np.int16], entries: NDArray[np.int64], uses: NDArray[np.int64], toggles: NDArray[np.bool_],
    touched: NDArray[np.int32],
) -> None:  # fmt: skip
    """Counts candidates and their edges for each cell."""
    for polygon in range(len(kinds) - 1, -1, -1):
        first, last = bounds[polygon], bounds[polygon + 1]
        if first == last:
            continue
        box = _box(grid, shape, segments, first, last)
        _rasterise(grid, shape, segments, first, last, box, toggles, touched)
        for row in range(box[2], box[3] + 1):
            for column in range(box[0], box[1] + 1):
                cell = row * shape[0] + column
                if base[cell] != _OPEN:
                    continue
                if touched[cell] > 0:
                    entries[cell] += 1
                    uses[cell] += touched[cell]
                elif toggles[row * (shape[0] + 1) + column]:
                    base[cell] = kinds[polygon]


@compiled
def _fill(
    grid: Array, shape: NDArray[np.int64], segments: Array, bounds: NDArray[np.int64], kinds: NDArray[np.uint8],
    base: NDArray[np.int16], entries: NDArray[np.int64], uses: NDArray[np.int64], toggles: NDArray[np.bool_],
    touched: NDArray[np.int32], table: NDArray[np.int64], edges: NDArray[np.int32],
) -> None:  # fmt: skip
    """Writes candidates and their edges; `entries` and `uses` are the next free rows of each cell."""
    for polygon in range(len(kinds) - 1, -1, -1):
        first, last = bounds[polygon], bounds[polygon + 1]
        if first == last:
            continue
        box = _box(grid, shape, segments, first, last)
        _rasterise(grid, shape, segments, first, last, box, toggles, touched)
        for edge in range(first, last):
            low, high = min(segments[edge, 1], segments[edge, 3]), max(segments[edge, 1], segments[edge, 3])
            begin = max(box[2], int(np.floor((low - _CLOSE - grid[1]) / grid[2])))
            end = min(box[3], int(np.floor((high + _CLOSE - grid[1]) / grid[2])))
            for row in range(begin, end + 1):
                a, b = row_span(grid, segments, edge, row)
                for column in range(max(a, box[0]), min(b, box[1]) + 1):
                    cell = row * shape[0] + column
                    if base[cell] == _OPEN:
                        edges[uses[cell]] = edge
                        uses[cell] += 1
        for row in range(box[2], box[3] + 1):
            for column in range(box[0], box[1] + 1):
                cell = row * shape[0] + column
                if base[cell] != _OPEN:
                    continue
                inside = toggles[row * (shape[0] + 1) + column]
                if touched[cell] > 0:
                    table[entries[cell], 0] = kinds[polygon]
                    table[entries[cell], 1] = 1 if inside else 0
                    table[entries[cell], 2] = touched[cell]
                    entries[cell] += 1
                elif inside:
                    base[cell] = kinds[polygon]
