"""Lookup of the material of the ground at a point: the top-most polygon of the map that contains it, exactly.

For most points, a grid of square cells gives the material. In a cell with several materials, the polygons with an edge
in the cell are tested from the topmost down. The test follows a path from the corner of the cell to the point, first
along y and then along x: if the edges of a polygon cross it an odd number of times, exactly one end is inside.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps.model import Array
from dorothie_gym.support.compilation import compiled, inlined
from dorothie_gym.support.compilation.records import by_reference
from dorothie_gym.support.copying import shared

GROUND_SHEET = 0
"""Sheet of the ground; others are bridges and tunnels."""

SQUARES = 16
"""Squares along each side of a mixed cell."""

PARTS = SQUARES * SQUARES
"""Squares of a mixed cell."""

SEVERAL = 255
"""Material of squares that edges touch."""


@by_reference
@shared
class GroundArrays(NamedTuple):
    """Materials and colours of all sheets of ground.

    Cells of a sheet are numbered row by row.

    Attributes:
        origins: (sheets, 2) positions of the first corners of the grids [m].
        shapes: (sheets, 2) columns and rows of cells.
        firsts: (sheets,) number of the first cell of each sheet.
        outside: (sheets,) material beyond the grid.
        size: (1,) width of a cell [m].
        cells: material of a cell, or -1 - k for the mixed cell k.
        bases: material of each mixed cell below all polygons with edges in it.
        squares: (n, SQUARES * SQUARES) material of the squares of each mixed cell, `SEVERAL` where edges are.
        entries: range of candidates of mixed cell k: entries[k] to entries[k + 1], from the top.
        materials: material of each candidate.
        parities: whether the first corner of the cell lies inside the candidate.
        uses: range of the edges of candidate e: uses[e] to uses[e + 1].
        edges: rows of `segments`.
        segments: (n, 4) edges x0, y0, x1, y1 [m].
        colours: (materials, 3) RGB, 0..255.
        grains: (materials,) strength of the noise.
        classes: (materials,) semantic class, `ObjectClass`.
        noise: (256, 256), 128 in the mean.
        levels: (sheets, levels, 3) columns, rows, and first texel of each picture of averaged colours.
        texels: (n, 3) averaged colours.
    """

    origins: Array
    shapes: NDArray[np.int64]
    firsts: NDArray[np.int64]
    outside: NDArray[np.uint8]
    size: Array
    cells: NDArray[np.int32]
    bases: NDArray[np.uint8]
    squares: NDArray[np.uint8]
    entries: NDArray[np.int32]
    materials: NDArray[np.uint8]
    parities: NDArray[np.bool_]
    uses: NDArray[np.int32]
    edges: NDArray[np.int32]
    segments: Array
    colours: NDArray[np.float32]
    grains: NDArray[np.float32]
    classes: NDArray[np.uint8]
    noise: NDArray[np.uint8]
    levels: NDArray[np.int64]
    texels: NDArray[np.uint8]

    @property
    def nbytes(self) -> int:
        """Size of all arrays [bytes]."""
        return sum(array.nbytes for array in self)


@compiled
def cell_at(ground: GroundArrays, sheet: int, x: float, y: float) -> int:
    """Returns the value of the cell at a position [m]: a material, or -1 - k for the mixed cell k."""
    column = int(np.floor((x - ground.origins[sheet, 0]) / ground.size[0]))
    row = int(np.floor((y - ground.origins[sheet, 1]) / ground.size[0]))
    if column < 0 or row < 0 or column >= ground.shapes[sheet, 0] or row >= ground.shapes[sheet, 1]:
        return int(ground.outside[sheet])
    return int(ground.cells[ground.firsts[sheet] + row * ground.shapes[sheet, 0] + column])


@compiled
def material_in(ground: GroundArrays, sheet: int, mixed: int, x: float, y: float) -> int:
    """Returns the material at a position [m] in a mixed cell."""
    size = ground.size[0]
    left = ground.origins[sheet, 0] + np.floor((x - ground.origins[sheet, 0]) / size) * size
    top = ground.origins[sheet, 1] + np.floor((y - ground.origins[sheet, 1]) / size) * size
    for entry in range(ground.entries[mixed], ground.entries[mixed + 1]):
        inside = ground.parities[entry]
        for use in range(ground.uses[entry], ground.uses[entry + 1]):
            edge = ground.edges[use]
            ax, ay = ground.segments[edge, 0], ground.segments[edge, 1]
            bx, by = ground.segments[edge, 2], ground.segments[edge, 3]
            if (ax < left) != (bx < left):
                at = ay + (left - ax) / (bx - ax) * (by - ay)
                inside ^= (at > top) != (at > y)
            if (ay > y) != (by > y):
                at = ax + (y - ay) / (by - ay) * (bx - ax)
                inside ^= (at < left) != (at < x)
        if inside:
            return int(ground.materials[entry])
    return int(ground.bases[mixed])


@inlined
def part_of(left: float, top: float, inverse: float, columns: int, rows: int, x: float, y: float) -> int:
    """Returns the number of the square, `PARTS` for each cell, at a position; -1 outside of the grid.

    Args:
        left: first x of the grid [m].
        top: first y of the grid [m].
        inverse: inverse of the width of a cell [1/m].
        columns: number of columns of cells.
        rows: number of rows of cells.
        x: [m].
        y: [m].
    """
    across, down = (x - left) * inverse, (y - top) * inverse
    column, row = math.floor(across), math.floor(down)
    square = int((down - row) * SQUARES) * SQUARES + int((across - column) * SQUARES)
    inside = (column >= 0) & (row >= 0) & (column < columns) & (row < rows)
    return (row * columns + column) * PARTS + square if inside else -1


@inlined
def is_mixed(ground: GroundArrays, sheet: int, part: int) -> bool:
    """Returns whether there are several materials in the cell of a square."""
    return part >= 0 and ground.cells[ground.firsts[sheet] + part // PARTS] < 0


@inlined
def material_of_square(ground: GroundArrays, sheet: int, part: int) -> int:
    """Returns the material of a square, `SEVERAL` if an edge touches it."""
    if part < 0:
        return int(ground.outside[sheet])
    value = int(ground.cells[ground.firsts[sheet] + part // PARTS])
    return value if value >= 0 else int(ground.squares[-1 - value, part % PARTS])


@inlined
def material_of_part(ground: GroundArrays, sheet: int, part: int, x: float, y: float) -> int:
    """Returns the material at a position [m] whose square is known from `part_of`."""
    if part < 0:
        return int(ground.outside[sheet])
    value = int(ground.cells[ground.firsts[sheet] + part // PARTS])
    if value >= 0:
        return value
    material = int(ground.squares[-1 - value, part % PARTS])
    return material if material != SEVERAL else material_in(ground, sheet, -1 - value, x, y)


@inlined
def part_at(ground: GroundArrays, sheet: int, x: float, y: float) -> int:
    """Returns the number of the square of a sheet at a position [m], see `part_of`."""
    return part_of(
        ground.origins[sheet, 0],
        ground.origins[sheet, 1],
        1.0 / ground.size[0],
        ground.shapes[sheet, 0],
        ground.shapes[sheet, 1],
        x,
        y,
    )


@compiled
def material_at(ground: GroundArrays, sheet: int, x: float, y: float) -> int:
    """Returns the material of a sheet at a position [m]: of the top-most polygon that contains it."""
    return material_of_part(ground, sheet, part_at(ground, sheet, x, y), x, y)


@compiled
def materials_around(ground: GroundArrays, sheet: int, x: float, y: float, step: float) -> tuple[int, int, int, int]:
    """Returns the materials at the corners of a square of `2 * step` around a position [m].

    They are those at the smallest x and y, at the largest x and smallest y, at the smallest x and largest y, and at the
    largest x and y. If the first and the last are equal, the others need not be right.
    """
    x0, y0, x1, y1 = x - step, y - step, x + step, y + step
    part, other = part_at(ground, sheet, x0, y0), part_at(ground, sheet, x1, y1)
    return materials_between(ground, sheet, part, other, x0, y0, x1, y1)


@compiled
def materials_between(
    ground: GroundArrays, sheet: int, part: int, other: int, x0: float, y0: float, x1: float, y1: float
) -> tuple[int, int, int, int]:
    """Returns the materials at the corners of a box [m], as `materials_around` does.

    Args:
        ground: materials.
        sheet: sheet of the ground.
        part: square of the corner at (x0, y0), see `part_of`.
        other: square of the corner at (x1, y1).
        x0: smallest x.
        y0: smallest y.
        x1: largest x.
        y1: largest y.
    """
    first, last = material_of_square(ground, sheet, part), material_of_square(ground, sheet, other)
    if first == last and first != SEVERAL:
        return first, first, first, first
    if part >= 0 and part // PARTS == other // PARTS:
        return _materials_in(ground, sheet, -1 - ground.cells[ground.firsts[sheet] + part // PARTS], x0, y0, x1, y1)
    first, last = material_of_part(ground, sheet, part, x0, y0), material_of_part(ground, sheet, other, x1, y1)
    if first == last:
        return first, first, first, first
    return first, material_at(ground, sheet, x1, y0), material_at(ground, sheet, x0, y1), last


@compiled
def _materials_in(
    ground: GroundArrays, sheet: int, mixed: int, x0: float, y0: float, x1: float, y1: float
) -> tuple[int, int, int, int]:
    """Returns the materials at the corners of a box in a mixed cell, as `material_in` does for each of them.

    A corner is a bit: 1, 2, 4, 8 in the order of `materials_around`.
    """
    size = ground.size[0]
    left = ground.origins[sheet, 0] + np.floor((x0 - ground.origins[sheet, 0]) / size) * size
    top = ground.origins[sheet, 1] + np.floor((y0 - ground.origins[sheet, 1]) / size) * size
    a = b = c = d = int(ground.bases[mixed])
    rest = 15
    for entry in range(ground.entries[mixed], ground.entries[mixed + 1]):
        inside = 15 if ground.parities[entry] else 0
        for use in range(ground.uses[entry], ground.uses[entry + 1]):
            edge = ground.edges[use]
            ax, ay = ground.segments[edge, 0], ground.segments[edge, 1]
            bx, by = ground.segments[edge, 2], ground.segments[edge, 3]
            if (ax < left) != (bx < left):
                at = ay + (left - ax) / (bx - ax) * (by - ay)
                inside ^= (3 if (at > top) != (at > y0) else 0) ^ (12 if (at > top) != (at > y1) else 0)
            if (ay > y0) != (by > y0):
                at = ax + (y0 - ay) / (by - ay) * (bx - ax)
                inside ^= (1 if (at < left) != (at < x0) else 0) ^ (2 if (at < left) != (at < x1) else 0)
            if (ay > y1) != (by > y1):
                at = ax + (y1 - ay) / (by - ay) * (bx - ax)
                inside ^= (4 if (at < left) != (at < x0) else 0) ^ (8 if (at < left) != (at < x1) else 0)
        inside &= rest
        if inside:
            material = int(ground.materials[entry])
            a, b = material if inside & 1 else a, material if inside & 2 else b
            c, d = material if inside & 4 else c, material if inside & 8 else d
            rest ^= inside
            if rest == 0:
                break
    return a, b, c, d


@compiled
def materials_at(ground: GroundArrays, sheet: int, points: Array, out: NDArray[np.uint8]) -> None:
    """Writes the materials of a sheet at positions (n, 2) [m] to `out` (n,)."""
    for k in range(len(points)):
        out[k] = material_at(ground, sheet, points[k, 0], points[k, 1])
