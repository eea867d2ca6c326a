"""Bodies that move: triangles of their models at their poses, written for every picture."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.pictures.camera.cells import is_hidden, is_in_view
from dorothie_gym.pictures.camera.mesh import PLAIN, Mesh
from dorothie_gym.pictures.camera.rasterizer import BEHIND
from dorothie_gym.support.compilation import concurrent, inlined
from dorothie_gym.support.compilation.records import RecordArray

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array
    from dorothie_gym.pictures.camera.models.model_bank import PlacementRecord
    from dorothie_gym.pictures.camera.pose import View

_ROUNDED = 0.01  # [m] more than rounding moves the plane of a triangle


@concurrent
def copy_bodies(
    view: View,
    tiles: NDArray[np.float32],
    bank: Mesh,
    ranges: NDArray[np.int32],
    boxes: NDArray[np.float32],
    bodies: RecordArray[PlacementRecord],
    box: Array,
    target: Mesh,
) -> int:
    """Writes the triangles of bodies that may be seen; returns their number, or more than the room.

    Triangles that are seen from behind are left out.

    Args:
        view: projection.
        tiles: smallest nearness in tiles of samples, see `cells.find_tiles`.
        bank: triangles of all models.
        ranges: ranges of `ModelBank`.
        boxes: boxes of `ModelBank`.
        bodies: models and places.
        box: (2, 3) scratch space.
        target: receives the triangles.
    """
    count = 0
    for k in range(len(bodies)):
        body = bodies[k]
        surround(body, boxes[body.model], box)
        if is_in_view(view, box[0], box[1]) and not is_hidden(view, tiles, box[0], box[1]):
            count = copy_body(view, bank, ranges, body, target, count)
    return count


@inlined
def copy_body(
    view: View, bank: Mesh, ranges: NDArray[np.int32], body: PlacementRecord, target: Mesh, count: int
) -> int:
    """Writes the triangles of a body that face the view behind the first `count`; returns the new count.

    Without room for the whole body nothing is written, and all of its triangles count.
    """
    first: int = ranges[body.model, 0]
    last: int = ranges[body.model, 1]
    if count + last - first > target.corners.shape[0]:
        return count + last - first
    for row in range(first, last):
        if copy_triangle(view, bank, row, body, target, count):
            count += 1
    return count


@inlined
def surround(body: PlacementRecord, model: NDArray[np.float32], box: Array) -> None:
    """Writes a box around a body in every direction."""
    x, y = max(abs(model[0, 0]), abs(model[1, 0])), max(abs(model[0, 1]), abs(model[1, 1]))
    radius = math.sqrt(x * x + y * y)
    box[0, 0], box[1, 0] = body.x - radius, body.x + radius
    box[0, 1], box[1, 1] = body.y - radius, body.y + radius
    tilt = abs(body.rise) * x
    box[0, 2], box[1, 2] = body.z + model[0, 2] - tilt, body.z + model[1, 2] + tilt


@inlined
def copy_triangle(view: View, bank: Mesh, row: int, body: PlacementRecord, target: Mesh, at: int) -> bool:
    """Writes a triangle unless it is seen from behind; returns whether it was written."""
    c, s = body.cos, body.sin
    if body.rise == 0.0:  # a quick look in the frame of the model
        x, y = view.origin[0] - body.x, view.origin[1] - body.y
        offset = bank.normals[row, 0] * (bank.corners[row, 0, 0] - x * c - y * s)
        offset += bank.normals[row, 1] * (bank.corners[row, 0, 1] + x * s - y * c)
        offset += bank.normals[row, 2] * (bank.corners[row, 0, 2] + body.z - view.origin[2])
        if offset > _ROUNDED:
            return False
    for j in range(3):
        x, y = bank.corners[row, j, 0], bank.corners[row, j, 1]
        target.corners[at, j, 0] = body.x + x * c - y * s
        target.corners[at, j, 1] = body.y + x * s + y * c
        target.corners[at, j, 2] = body.z + bank.corners[row, j, 2] + x * body.rise
    _turn(bank.normals[row], c, s, body.rise, target.normals[at])
    if body.rise != 0.0:
        _shorten(target.normals[at])
    offset = 0.0
    for j in range(3):
        offset += float(target.normals[at, j]) * (float(target.corners[at, 0, j]) - view.origin[j])
    if offset >= BEHIND:
        return False
    for j in range(3):
        for k in range(3):
            target.components[3 * j + k, at] = target.corners[at, j, k]
        target.components[9 + j, at] = target.normals[at, j]
    if bank.textures[row] != PLAIN:
        _turn(bank.u_axes[row], c, s, body.rise, target.u_axes[at])
        _turn(bank.v_axes[row], c, s, body.rise, target.v_axes[at])
        target.u_axes[at, 3], target.v_axes[at, 3] = bank.u_axes[row, 3], bank.v_axes[row, 3]
    for j in range(3):
        target.colours[at, j] = bank.colours[row, j]
    target.textures[at], target.surfaces[at] = bank.textures[row], bank.surfaces[row]
    target.classes[at], target.instances[at] = bank.classes[row], body.key
    return True


@inlined
def _turn(vector: NDArray[np.float32], c: float, s: float, rise: float, out: NDArray[np.float32]) -> None:
    """Writes the gradient (3,) of a function on a body that is sheared upwards along x and turned."""
    x = vector[0] - rise * vector[2]
    out[0], out[1], out[2] = x * c - vector[1] * s, x * s + vector[1] * c, vector[2]


@inlined
def _shorten(vector: NDArray[np.float32]) -> None:
    """Gives a vector (3,) the length 1."""
    scale = 1.0 / math.sqrt(vector[0] * vector[0] + vector[1] * vector[1] + vector[2] * vector[2])
    for k in range(3):
        vector[k] *= scale
