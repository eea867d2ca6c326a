"""Squares of mixed cells: most of a cell with several materials has one material, and needs no look at the edges."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.pictures.camera.ground.cells import row_span
from dorothie_gym.pictures.camera.ground.lookup import SEVERAL, SQUARES, GroundArrays, material_in
from dorothie_gym.support.compilation import compiled


def find_squares(ground: GroundArrays) -> NDArray[np.uint8]:
    """Returns the materials of the squares of mixed cells (n, SQUARES * SQUARES), `SEVERAL` where edges are."""
    squares = np.zeros((len(ground.bases), SQUARES * SQUARES), np.uint8)
    for sheet in range(len(ground.origins)):
        _fill(ground, sheet, np.zeros(3), squares)
    return squares


@compiled
def _fill(ground: GroundArrays, sheet: int, grid: NDArray[np.float64], squares: NDArray[np.uint8]) -> None:
    """Writes the squares of a sheet; `grid` is scratch space."""
    columns, rows = ground.shapes[sheet, 0], ground.shapes[sheet, 1]
    cell, grid[2] = ground.size[0], ground.size[0] / SQUARES
    for row in range(rows):
        for column in range(columns):
            value = ground.cells[ground.firsts[sheet] + row * columns + column]
            if value < 0:
                mixed = -1 - value
                grid[0], grid[1] = ground.origins[sheet, 0] + column * cell, ground.origins[sheet, 1] + row * cell
                _mark(ground, mixed, grid, squares[mixed])
                for k in range(SQUARES * SQUARES):
                    if squares[mixed, k] != SEVERAL:
                        x, y = grid[0] + (k % SQUARES + 0.5) * grid[2], grid[1] + (k // SQUARES + 0.5) * grid[2]
                        squares[mixed, k] = material_in(ground, sheet, mixed, x, y)


@compiled
def _mark(ground: GroundArrays, mixed: int, grid: NDArray[np.float64], squares: NDArray[np.uint8]) -> None:
    """Marks the squares of a mixed cell that an edge touches."""
    for use in range(ground.uses[ground.entries[mixed]], ground.uses[ground.entries[mixed + 1]]):
        edge = ground.edges[use]
        for row in range(SQUARES):
            first, last = row_span(grid, ground.segments, edge, row)
            for column in range(max(first, 0), min(last, SQUARES - 1) + 1):
                squares[row * SQUARES + column] = SEVERAL
