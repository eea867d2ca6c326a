"""Semantic classes around a camera, seen straight from above without perspective."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.ontology.slots import ObjectClass
from dorothie_gym.pictures.camera.ground.lookup import GroundArrays, material_at
from dorothie_gym.pictures.camera.labels import mesh_of, row_in
from dorothie_gym.pictures.camera.mesh import Mesh, Surface
from dorothie_gym.pictures.camera.rasterizer import SKY, VisibilityBuffer, clear, fill_triangle
from dorothie_gym.support.compilation import compiled, concurrent, inlined
from dorothie_gym.support.compilation.records import RecordArray

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array
    from dorothie_gym.pictures.camera.cells import CellTable
    from dorothie_gym.pictures.camera.models.model_bank import PlacementRecord
    from dorothie_gym.pictures.camera.pose import View

HEADROOM = 3.0
"""Height above the camera beyond which surfaces are left out, other than those of buildings [m]."""

STEEPEST = 0.12
"""Rise of the ground per metre up to which it is not taken for a bridge."""

_DEPTH = 200.0  # [m] below the camera down to which surfaces are drawn
_FLAT = 1e-3  # smallest upward component of the normal of a surface that is seen from above
_LEAF, _GROUND = int(Surface.LEAF), int(Surface.GROUND)
_BUILDING, _NOTHING = int(ObjectClass.BUILDING.value), int(ObjectClass.UNLABELED.value)


@concurrent
def draw_birds_eye(
    view: View,
    metres: float,
    buffer: VisibilityBuffer,
    town: Mesh,
    cells: CellTable,
    overlay: Mesh,
    overlay_cells: CellTable,
    bank: Mesh,
    ranges: NDArray[np.int32],
    bodies: RecordArray[PlacementRecord],
    ground: GroundArrays,
    corners: Array,
    classes: NDArray[np.uint8],
) -> None:
    """Writes the classes of the squares of a grid around a camera, whose heading points up the picture.

    Args:
        view: position and heading of the camera.
        metres: width of a square [m].
        buffer: scratch space (h, w).
        town: objects of every session, sorted by cell.
        cells: cells of the town.
        overlay: static objects of the session, sorted by cell.
        overlay_cells: its cells.
        bank: triangles of all models.
        ranges: ranges of `ModelBank`.
        bodies: models and places.
        ground: materials of the ground.
        corners: (4, 3) scratch space.
        classes: (h, w) receives `ObjectClass`; 0 beyond the map.
    """
    clear(buffer)
    cos, sin = view.axes[2, 0], view.axes[2, 1]
    level = math.sqrt(cos * cos + sin * sin)
    cos, sin = cos / level, sin / level
    first = town.corners.shape[0]
    _draw_mesh(view, metres, cos, sin, buffer, town, cells, 0, corners)
    _draw_mesh(view, metres, cos, sin, buffer, overlay, overlay_cells, first, corners)
    number = first + overlay.corners.shape[0]
    for k in range(len(bodies)):
        body = bodies[k]
        for row in range(ranges[body.model, 0], ranges[body.model, 1]):
            if bank.normals[row, 2] > _FLAT:
                _place(bank, row, body, corners)
                _draw(view, metres, cos, sin, buffer, corners, number + row, False)
    height, width = classes.shape
    for y in range(height):
        for x in range(width):
            number = buffer.triangles[y, x]
            if number == SKY:
                classes[y, x] = _NOTHING
                continue
            mesh, row = mesh_of(town, overlay, bank, number), row_in(town, overlay, number)
            classes[y, x] = mesh.classes[row]
            if mesh.surfaces[row] & _GROUND:
                aside, ahead = (x + 0.5 - 0.5 * width) * metres, (0.5 * height - y - 0.5) * metres
                at_x, at_y = view.origin[0] + ahead * cos - aside * sin, view.origin[1] + ahead * sin + aside * cos
                classes[y, x] = ground.classes[material_at(ground, int(mesh.textures[row]), at_x, at_y)]


@compiled
def _draw_mesh(
    view: View, metres: float, cos: float, sin: float, buffer: VisibilityBuffer, mesh: Mesh, cells: CellTable,
    number: int, corners: Array,
) -> None:  # fmt: skip
    """Draws the triangles of a mesh in the cells around the camera; `number` is that of the first."""
    height, width = buffer.nearness.shape
    reach = 0.5 * metres * math.sqrt(height * height + width * width)
    x0, y0 = view.origin[0], view.origin[1]
    for cell in range(len(cells.ranges)):
        low, high = cells.low[cell], cells.high[cell]
        x, y = max(low[0] - x0, 0.0, x0 - high[0]), max(low[1] - y0, 0.0, y0 - high[1])
        if x * x + y * y > reach * reach:
            continue
        for row in range(cells.ranges[cell, 0], cells.ranges[cell, 1]):
            if mesh.normals[row, 2] <= _FLAT or mesh.surfaces[row] & _LEAF:
                continue
            for j in range(3):
                for k in range(3):
                    corners[j, k] = mesh.corners[row, j, k]
                corners[3, j] = mesh.normals[row, j]
            _draw(view, metres, cos, sin, buffer, corners, number + row, mesh.classes[row] == _BUILDING)


@inlined
def _place(bank: Mesh, row: int, body: PlacementRecord, corners: Array) -> None:
    """Writes the corners (3, 3) and the normal of a triangle of a body."""
    c, s = body.cos, body.sin
    for j in range(3):
        x, y = float(bank.corners[row, j, 0]), float(bank.corners[row, j, 1])
        corners[j, 0], corners[j, 1] = body.x + x * c - y * s, body.y + x * s + y * c
        corners[j, 2] = body.z + bank.corners[row, j, 2] + x * body.rise
    x, y = float(bank.normals[row, 0]) - body.rise * float(bank.normals[row, 2]), float(bank.normals[row, 1])
    corners[3, 0], corners[3, 1], corners[3, 2] = x * c - y * s, x * s + y * c, float(bank.normals[row, 2])


@compiled
def _draw(
    view: View, metres: float, cos: float, sin: float, buffer: VisibilityBuffer, corners: Array, number: int,
    is_building: bool,
) -> None:  # fmt: skip
    """Draws a triangle of given corners (3, 3) and normal unless it hangs above the camera."""
    x0, y0, z0 = view.origin[0], view.origin[1], view.origin[2]
    lowest = min(min(corners[0, 2], corners[1, 2]), corners[2, 2])
    if not is_building and lowest > z0 + HEADROOM:
        near = np.inf
        for j in range(3):
            near = min(near, (corners[j, 0] - x0) ** 2 + (corners[j, 1] - y0) ** 2)
        if lowest > z0 + HEADROOM + STEEPEST * math.sqrt(near):
            return
    height, width = buffer.nearness.shape
    wide, high, scale = 0.5 * width, 0.5 * height, 1.0 / metres
    x, y = corners[0, 0] - x0, corners[0, 1] - y0
    ax, ay = wide + (y * cos - x * sin) * scale, high - (x * cos + y * sin) * scale
    x, y = corners[1, 0] - x0, corners[1, 1] - y0
    bx, by = wide + (y * cos - x * sin) * scale, high - (x * cos + y * sin) * scale
    x, y = corners[2, 0] - x0, corners[2, 1] - y0
    cx, cy = wide + (y * cos - x * sin) * scale, high - (x * cos + y * sin) * scale
    slope = metres / corners[3, 2]
    right = (corners[3, 0] * sin - corners[3, 1] * cos) * slope
    down = (corners[3, 0] * cos + corners[3, 1] * sin) * slope
    middle = corners[0, 2] - z0 + _DEPTH - right * ax - down * ay
    fill_triangle(buffer, ax, ay, bx, by, cx, cy, middle, right, down, number)
