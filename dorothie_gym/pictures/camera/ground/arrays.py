"""Arrays of all sheets of ground, built from their polygons."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.pictures.camera.ground.cells import CELL, Cells, build_cells
from dorothie_gym.pictures.camera.ground.colours import TEXEL, ground_noise, halved, paint_finest
from dorothie_gym.pictures.camera.ground.lookup import GroundArrays
from dorothie_gym.pictures.camera.ground.materials import material_classes, material_colours, material_grains
from dorothie_gym.pictures.camera.ground.squares import find_squares

if TYPE_CHECKING:
    from dorothie_gym.pictures.camera.ground.sheets import Sheet

LEVELS = 8
"""Number of averaged pictures: texels of 0.5 to 64 m."""


def ground_arrays(sheets: Sequence[Sheet]) -> GroundArrays:
    """Returns the lookup of materials and colours of sheets."""
    cells = [build_cells(sheet.polygons, sheet.low, sheet.high, sheet.outside) for sheet in sheets]
    ground = _joined(cells)
    ground = ground._replace(squares=find_squares(ground))
    levels, texels = _pictures(ground, cells)
    return ground._replace(levels=levels, texels=texels)


def _joined(parts: Sequence[Cells]) -> GroundArrays:
    """Returns the arrays without averaged pictures."""
    cells, edges, firsts = [], [], []
    mixed = segments = first = 0
    for part in parts:
        cells.append(np.where(part.cells < 0, part.cells - mixed, part.cells).astype(np.int32))
        edges.append(part.edges + segments)
        firsts.append(first)
        mixed, segments, first = mixed + len(part.bases), segments + len(part.segments), first + len(part.cells)
    counts, uses = (np.concatenate([getattr(part, name) for part in parts]) for name in ("counts", "edge_counts"))
    return GroundArrays(
        origins=np.array([part.origin for part in parts]),
        shapes=np.array([part.shape for part in parts]),
        firsts=np.array(firsts, dtype=np.int64),
        outside=np.array([part.outside for part in parts], dtype=np.uint8),
        size=np.array([CELL]),
        cells=np.concatenate(cells),
        bases=np.concatenate([part.bases for part in parts]),
        entries=_ranges(counts),
        squares=np.zeros((0, 1), np.uint8),
        materials=np.concatenate([part.materials for part in parts]),
        parities=np.concatenate([part.parities for part in parts]),
        uses=_ranges(uses),
        edges=np.concatenate(edges).astype(np.int32),
        segments=np.concatenate([part.segments for part in parts]),
        colours=material_colours(),
        grains=material_grains(),
        classes=material_classes(),
        noise=ground_noise(),
        levels=np.zeros((len(parts), LEVELS, 3), dtype=np.int64),
        texels=np.zeros((0, 3), dtype=np.uint8),
    )


def _ranges(counts: NDArray[np.int64]) -> NDArray[np.int32]:
    return np.concatenate(([0], np.cumsum(counts))).astype(np.int32)


def _pictures(ground: GroundArrays, parts: Sequence[Cells]) -> tuple[NDArray[np.int64], NDArray[np.uint8]]:
    """Returns the sizes and texels of the averaged pictures of all sheets."""
    levels = np.zeros((len(parts), LEVELS, 3), dtype=np.int64)
    pictures, total = [], 0
    for sheet, part in enumerate(parts):
        columns, rows = (int(n) * round(CELL / TEXEL) for n in part.shape)
        flat = np.zeros((rows * columns, 3), dtype=np.uint8)
        paint_finest(ground, sheet, columns, rows, flat)
        picture = flat.reshape(rows, columns, 3)
        for level in range(LEVELS):
            levels[sheet, level] = picture.shape[1], picture.shape[0], total
            pictures.append(picture.reshape(-1, 3))
            total += len(pictures[-1])
            picture = halved(picture)
    return levels, np.concatenate(pictures)
