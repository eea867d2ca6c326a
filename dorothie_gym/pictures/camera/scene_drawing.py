"""All triangles of a scene in one call: town, static objects of the session, and bodies."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.pictures.camera.bodies import copy_bodies
from dorothie_gym.pictures.camera.cells import CellOrder, CellTable, draw_cells, draw_more_cells
from dorothie_gym.pictures.camera.rasterizer import VisibilityBuffer, clear, draw_triangles
from dorothie_gym.pictures.camera.shadows import ShadowMaps, draw_shadows
from dorothie_gym.support.compilation import concurrent
from dorothie_gym.support.compilation.records import RecordArray

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array
    from dorothie_gym.pictures.camera.mesh import Mesh
    from dorothie_gym.pictures.camera.models.model_bank import PlacementRecord
    from dorothie_gym.pictures.camera.pose import View


@concurrent
def draw_scene(
    view: View, buffer: VisibilityBuffer, town: Mesh, cells: CellTable, order: CellOrder, overlay: Mesh,
    overlay_cells: CellTable, overlay_order: CellOrder, bank: Mesh, ranges: NDArray[np.int32],
    boxes: NDArray[np.float32], bodies: RecordArray[PlacementRecord], box: Array, placed: Mesh, count: int,
    shadows: ShadowMaps, casts_shadows: bool,
) -> int:  # fmt: skip
    """Draws all triangles to an emptied buffer, and shadows if needed; returns the number of triangles of bodies.

    Args:
        view: projection.
        buffer: buffer to draw to.
        town: objects of every session, sorted by cell.
        cells: cells of the town.
        order: scratch space for them.
        overlay: static objects of the session, sorted by cell.
        overlay_cells: cells of the overlay.
        overlay_order: scratch space for them.
        bank: triangles of all models.
        ranges: ranges of `ModelBank`.
        boxes: boxes of `ModelBank`.
        bodies: models and places.
        box: (2, 3) scratch space.
        placed: triangles of bodies. If it has too little room, they are not drawn.
        count: number of triangles in `placed`, negative if they must be written first.
        shadows: maps of shadows.
        casts_shadows: whether the picture also needs shadows.
    """
    clear(buffer)
    draw_cells(view, buffer, town, cells, order, 0)
    first = town.corners.shape[0]
    draw_more_cells(view, buffer, overlay, overlay_cells, overlay_order, order.tiles, first)
    if count < 0:
        count = copy_bodies(view, order.tiles, bank, ranges, boxes, bodies, box, placed)
    if count <= placed.corners.shape[0]:
        draw_triangles(view, buffer, placed, 0, count, first + overlay.corners.shape[0])
        if casts_shadows:
            draw_shadows(view, shadows, town, cells, overlay, overlay_cells, bank, ranges, boxes, bodies)
    return count
