"""Square cells of a mesh, drawn from near to far if they are in view and not hidden."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps.model import Array
from dorothie_gym.pictures.camera.rasterizer import NEAR, VisibilityBuffer, collect_triangles, draw_collected
from dorothie_gym.support.compilation import compiled, concurrent, inlined
from dorothie_gym.support.compilation.records import by_reference
from dorothie_gym.support.copying import shared

if TYPE_CHECKING:
    from dorothie_gym.pictures.camera.mesh import Mesh
    from dorothie_gym.pictures.camera.pose import View

CELL = 24.0
"""Size of a cell [m]."""

TILE = 8
"""Size of a tile of samples [samples]; `find_tiles` compares eight rows and columns at once."""

_RINGS = 128  # distances at which cells are sorted
_RING = 8.0  # [m]
_FIRST_RING, _FARTHER = 2, 4  # rings before which hidden tiles are found: 2, 8, 32


@by_reference
@shared
class CellTable(NamedTuple):
    """Boxes of the cells of a mesh that is sorted by them.

    Attributes:
        low: (m, 3) smallest coordinates of a cell's triangles [m].
        high: (m, 3) largest coordinates [m].
        ranges: (m, 2) int32 first triangle of the cell, and the one after its last.
    """

    low: Array
    high: Array
    ranges: NDArray[np.int32]


@by_reference
class CellOrder(NamedTuple):
    """Scratch space of `draw_cells`.

    Attributes:
        rings: (_RINGS + 1,) int32 where the cells of a distance begin in `order`.
        order: (m,) int32 cells in view, from near to far.
        ring: (m,) int32 distance of each cell in rings, -1 if it is out of view.
        tiles: (rows, columns) float32 smallest nearness in a tile of samples [1/m].
        line: (columns * TILE,) float32 smallest nearness in the columns of a row of tiles [1/m], infinite beyond
            the picture.
    """

    rings: NDArray[np.int32]
    order: NDArray[np.int32]
    ring: NDArray[np.int32]
    tiles: NDArray[np.float32]
    line: NDArray[np.float32]


def sorted_by_cell(mesh: Mesh, size: float = CELL) -> tuple[Mesh, CellTable, NDArray[np.int64]]:
    """Returns the mesh sorted by the cells of its triangles' centres, the cells, and the order of the rows."""
    if not mesh.size:
        empty = np.zeros((0, 3))
        return mesh, CellTable(empty, empty, np.zeros((0, 2), np.int32)), np.zeros(0, np.int64)
    place = np.floor(mesh.corners.mean(axis=1, dtype=np.float64)[:, :2] / size).astype(np.int64)
    order = np.lexsort((place[:, 0], place[:, 1]))
    whole, place = mesh.part(order), place[order]
    first = np.flatnonzero(np.concatenate(([True], (np.diff(place, axis=0) != 0).any(axis=1))))
    low = np.minimum.reduceat(whole.corners.min(axis=1), first).astype(np.float64)
    high = np.maximum.reduceat(whole.corners.max(axis=1), first).astype(np.float64)
    ranges = np.column_stack((first, np.append(first[1:], mesh.size))).astype(np.int32)
    return whole, CellTable(low, high, ranges), order


def new_order(cells: CellTable, width: int, height: int) -> CellOrder:
    """Returns scratch space for the given number of cells and a picture."""
    count, rows, columns = len(cells.ranges), -(-height // TILE), -(-width // TILE)
    return CellOrder(
        np.zeros(_RINGS + 1, np.int32),
        np.zeros(count, np.int32),
        np.zeros(count, np.int32),
        np.zeros((rows, columns), np.float32),
        np.full(columns * TILE, np.inf, np.float32),
    )


@concurrent
def draw_cells(
    view: View, buffer: VisibilityBuffer, mesh: Mesh, cells: CellTable, scratch: CellOrder, number: int
) -> int:
    """Draws the cells of a mesh that are in view and not hidden by nearer ones; returns the number of their triangles.

    Args:
        view: projection.
        buffer: empty buffer to draw to.
        mesh: sorted by cell.
        cells: cells of the mesh.
        scratch: from `new_order`; its tiles remain those of the buffer.
        number: number of the first triangle of the mesh.
    """
    _sort_cells(view, cells, scratch)
    drawn, ring, due = 0, 0, _FIRST_RING
    scratch.tiles[:] = 0.0
    while ring < _RINGS:
        if ring == due:
            find_tiles(view, buffer, scratch)
            due *= _FARTHER
        drawn += _draw_ring(view, buffer, mesh, cells, scratch, scratch.tiles, ring, number)
        ring += 1
    find_tiles(view, buffer, scratch)
    return drawn


@concurrent
def draw_more_cells(
    view: View,
    buffer: VisibilityBuffer,
    mesh: Mesh,
    cells: CellTable,
    scratch: CellOrder,
    tiles: NDArray[np.float32],
    number: int,
) -> int:
    """Draws the cells of a smaller mesh to a buffer whose tiles are known; otherwise as `draw_cells`."""
    _sort_cells(view, cells, scratch)
    drawn = 0
    for ring in range(_RINGS):
        drawn += _draw_ring(view, buffer, mesh, cells, scratch, tiles, ring, number)
    return drawn


@compiled
def _draw_ring(
    view: View,
    buffer: VisibilityBuffer,
    mesh: Mesh,
    cells: CellTable,
    scratch: CellOrder,
    tiles: NDArray[np.float32],
    ring: int,
    number: int,
) -> int:
    """Draws the cells of one distance."""
    drawn, found = 0, 0
    for k in range(scratch.rings[ring], scratch.rings[ring + 1]):
        cell = scratch.order[k]
        if not is_hidden(view, tiles, cells.low[cell], cells.high[cell]):
            first, last = cells.ranges[cell, 0], cells.ranges[cell, 1]
            found = collect_triangles(view, buffer, mesh, first, last, found, number)
            drawn += last - first
    draw_collected(view, buffer, mesh, found, number)
    return drawn


@compiled
def _sort_cells(view: View, cells: CellTable, scratch: CellOrder) -> None:
    """Sorts the cells in view by their distance, in rings."""
    rings, ring = scratch.rings, scratch.ring
    rings[:] = 0
    for k in range(len(ring)):
        ring[k] = -1
        if is_in_view(view, cells.low[k], cells.high[k]):
            x = max(cells.low[k, 0] - view.origin[0], 0.0, view.origin[0] - cells.high[k, 0])
            y = max(cells.low[k, 1] - view.origin[1], 0.0, view.origin[1] - cells.high[k, 1])
            ring[k] = min(int(math.sqrt(x * x + y * y) / _RING), _RINGS - 1)
            rings[ring[k] + 1] += 1
    for k in range(_RINGS):
        rings[k + 1] += rings[k]
    for k in range(len(ring) - 1, -1, -1):  # fills each ring from its end, and leaves the ends one ring too far
        if ring[k] >= 0:
            rings[ring[k] + 1] -= 1
            scratch.order[rings[ring[k] + 1]] = k
    total = 0
    for k in range(len(ring)):
        total += ring[k] >= 0
    for k in range(_RINGS):
        rings[k] = rings[k + 1]
    rings[_RINGS] = total


@compiled
def is_in_view(view: View, low: Array, high: Array) -> bool:
    """Returns whether a box (3,), (3,) [m] touches the view frustum; also True for some boxes beside it."""
    wide, tall = 0.5 * view.width / view.focal, 0.5 * view.height / view.focal
    for side in range(5):
        across = 0 if side < 2 else 1
        sign = 1.0 if side % 2 == 0 else -1.0
        slope = wide if side < 2 else tall
        if side == 4:
            sign, slope = 0.0, 1.0
        best = 0.0
        for k in range(3):
            normal = sign * view.axes[across, k] + slope * view.axes[2, k]
            best += normal * ((high[k] if normal > 0.0 else low[k]) - view.origin[k])
        if best < 0.0:
            return False
    return True


@compiled
def find_tiles(view: View, buffer: VisibilityBuffer, scratch: CellOrder) -> None:
    """Writes the smallest nearness in each tile of samples."""
    tiles, line, last = scratch.tiles, scratch.line, view.height - 1
    for row in range(tiles.shape[0]):
        y, near = row * TILE, buffer.nearness
        _find_line(
            line, near[y], near[min(y + 1, last)], near[min(y + 2, last)], near[min(y + 3, last)],
            near[min(y + 4, last)], near[min(y + 5, last)], near[min(y + 6, last)], near[min(y + 7, last)],
        )  # fmt: skip
        for column in range(tiles.shape[1]):
            tiles[row, column] = _least(line, column * TILE)


@inlined
def _find_line(
    line: NDArray[np.float32],
    a: NDArray[np.float32],
    b: NDArray[np.float32],
    c: NDArray[np.float32],
    d: NDArray[np.float32],
    e: NDArray[np.float32],
    f: NDArray[np.float32],
    g: NDArray[np.float32],
    h: NDArray[np.float32],
) -> None:
    """Writes the smallest value in each column of `TILE` rows; written so that the compiler vectorises it."""
    for k in range(len(a)):
        line[k] = min(min(min(a[k], b[k]), min(c[k], d[k])), min(min(e[k], f[k]), min(g[k], h[k])))


@inlined
def _least(line: NDArray[np.float32], k: int) -> np.float32:
    """Returns the smallest of `TILE` values, which the processor compares side by side."""
    one, two = min(line[k], line[k + 1]), min(line[k + 2], line[k + 3])
    three, four = min(line[k + 4], line[k + 5]), min(line[k + 6], line[k + 7])
    return min(min(one, two), min(three, four))


@compiled
def is_hidden(view: View, tiles: NDArray[np.float32], low: Array, high: Array) -> bool:
    """Returns whether all samples that a box (3,), (3,) [m] may cover see a surface nearer than the whole box."""
    left, right, top, bottom, nearest = np.inf, -np.inf, np.inf, -np.inf, np.inf
    for corner in range(8):
        x = (high[0] if corner & 1 else low[0]) - view.origin[0]
        y = (high[1] if corner & 2 else low[1]) - view.origin[1]
        z = (high[2] if corner & 4 else low[2]) - view.origin[2]
        depth = x * view.axes[2, 0] + y * view.axes[2, 1] + z * view.axes[2, 2]
        if depth < NEAR:
            return False
        scale = view.focal / depth
        across = 0.5 * view.width + (x * view.axes[0, 0] + y * view.axes[0, 1] + z * view.axes[0, 2]) * scale
        down = 0.5 * view.height - (x * view.axes[1, 0] + y * view.axes[1, 1] + z * view.axes[1, 2]) * scale
        left, right, top, bottom = min(left, across), max(right, across), min(top, down), max(bottom, down)
        nearest = min(nearest, depth)
    return _is_covered(tiles, left, right, top, bottom, 1.0 / nearest)


@compiled
def _is_covered(
    tiles: NDArray[np.float32], left: float, right: float, top: float, bottom: float, nearness: float
) -> bool:
    rows, columns = tiles.shape
    first = int(min(max(left / TILE, 0.0), columns - 1.0))
    last = int(min(max(right / TILE, 0.0), columns - 1.0))
    for row in range(int(min(max(top / TILE, 0.0), rows - 1.0)), int(min(max(bottom / TILE, 0.0), rows - 1.0)) + 1):
        for column in range(first, last + 1):
            if tiles[row, column] <= nearness:
                return False
    return True
