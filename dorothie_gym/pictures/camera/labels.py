"""Depth, semantic class and instance of every pixel, and the boxes of the visible part of each instance."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.ontology.slots import ObjectClass
from dorothie_gym.pictures.camera.ground.lookup import GroundArrays, material_of_part, part_of
from dorothie_gym.pictures.camera.mesh import Mesh, Surface
from dorothie_gym.pictures.camera.rasterizer import SKY, VisibilityBuffer
from dorothie_gym.pictures.camera.samples import FIRST, ROOM, Samples, X, Y
from dorothie_gym.support.compilation import compiled, concurrent, inlined
from dorothie_gym.support.compilation.records import by_reference

if TYPE_CHECKING:
    from dorothie_gym.pictures.camera.pose import View

_SKY_CLASS = int(ObjectClass.SKY.value)
_GROUND = int(Surface.GROUND)


@by_reference
class Labels(NamedTuple):
    """Labels of a picture.

    Attributes:
        depth: (h, w) float32 distance along the axis of the camera [m], infinite for the sky.
        semantic: (h, w) uint8 `ObjectClass`.
        instance: (h, w) int32 key of the body, 0 for none.
    """

    depth: NDArray[np.float32]
    semantic: NDArray[np.uint8]
    instance: NDArray[np.int32]


def new_labels(width: int, height: int) -> Labels:
    """Returns labels of a picture of the sky."""
    return Labels(
        np.full((height, width), np.inf, np.float32),
        np.full((height, width), _SKY_CLASS, np.uint8),
        np.zeros((height, width), np.int32),
    )


@concurrent
def write_labels(
    view: View,
    buffer: VisibilityBuffer,
    town: Mesh,
    overlay: Mesh,
    bodies: Mesh,
    ground: GroundArrays,
    samples: Samples,
    labels: Labels,
) -> None:
    """Writes the labels of the pixels of a buffer.

    Args:
        view: projection of the buffer.
        buffer: numbers of the triangles, see `mesh_of`.
        town: objects of every session.
        overlay: static objects of this session.
        bodies: moving bodies.
        ground: materials of the ground.
        samples: scratch space.
        labels: receives the labels.
    """
    for y in range(view.height):
        numbers, first = buffer.triangles[y], 0
        depth, semantic, instance = labels.depth[y], labels.semantic[y], labels.instance[y]
        while first < view.width:
            number, last, most = numbers[first], first + 1, min(view.width, first + ROOM)
            while last < most and numbers[last] == number:
                last += 1
            if number == SKY:
                depth[first:last], semantic[first:last], instance[first:last] = np.inf, _SKY_CLASS, 0
            else:
                mesh, row = mesh_of(town, overlay, bodies, number), row_in(town, overlay, number)
                instance[first:last], semantic[first:last] = mesh.instances[row], mesh.classes[row]
                _write_depths(view, mesh, row, first + 0.5, y + 0.5, depth[first:last])
                if mesh.surfaces[row] & _GROUND:
                    sheet = int(mesh.textures[row])
                    _write_classes(
                        view, sheet, first + 0.5, y + 0.5, depth[first:last], ground, samples, semantic[first:last]
                    )
            first = last


@inlined
def _write_depths(view: View, mesh: Mesh, row: int, x: float, y: float, depth: NDArray[np.float32]) -> None:
    """Writes the depths of neighbours in a row, of which the first is at (x, y) [pixels]."""
    offset, nx, ny, nz = plane_of(view, mesh, row)
    left, up, focal = x - 0.5 * view.width, (0.5 * view.height - y) / view.focal, view.focal
    for k in range(len(depth)):
        depth[k] = offset / (nx * ((left + k) / focal) + ny * up + nz)


@inlined
def _write_classes(
    view: View,
    sheet: int,
    x: float,
    y: float,
    depth: NDArray[np.float32],
    ground: GroundArrays,
    samples: Samples,
    semantic: NDArray[np.uint8],
) -> None:
    """Writes the classes of neighbours in a row that see the ground, of which the first is at (x, y) [pixels]."""
    values, parts, axes = samples.values, samples.indices, view.axes
    x0, y0, rightward, downward = view.origin[0], view.origin[1], axes[0, 0], axes[0, 1]
    left, up, focal = x - 0.5 * view.width, (0.5 * view.height - y) / view.focal, view.focal
    ahead_x, ahead_y = axes[2, 0] + up * axes[1, 0], axes[2, 1] + up * axes[1, 1]
    low_x, low_y, inverse = ground.origins[sheet, 0], ground.origins[sheet, 1], 1.0 / ground.size[0]
    columns, rows = ground.shapes[sheet, 0], ground.shapes[sheet, 1]
    for k in range(len(depth)):
        right, away = (left + k) / focal, float(depth[k])
        at_x, at_y = x0 + away * (ahead_x + right * rightward), y0 + away * (ahead_y + right * downward)
        values[X + k], values[Y + k] = at_x, at_y
        parts[FIRST + k] = part_of(low_x, low_y, inverse, columns, rows, at_x, at_y)
    for k in range(len(depth)):
        semantic[k] = ground.classes[material_of_part(ground, sheet, parts[FIRST + k], values[X + k], values[Y + k])]


@inlined
def mesh_of(town: Mesh, overlay: Mesh, bodies: Mesh, number: int) -> Mesh:
    """Returns the mesh of a numbered triangle: first the town's, then the overlay's, then those of bodies."""
    mesh = town
    if number >= town.corners.shape[0]:
        mesh = overlay
        if number >= town.corners.shape[0] + overlay.corners.shape[0]:
            mesh = bodies
    return mesh


@inlined
def row_in(town: Mesh, overlay: Mesh, number: int) -> int:
    """Returns the row of a numbered triangle in its mesh, see `mesh_of`."""
    row = number
    if number >= town.corners.shape[0]:
        row -= town.corners.shape[0]
        if row >= overlay.corners.shape[0]:
            row -= overlay.corners.shape[0]
    return row


@inlined
def plane_of(view: View, mesh: Mesh, row: int) -> tuple[float, float, float, float]:
    """Returns the plane of a triangle relative to the camera: depth = first / (second right + third up + fourth)."""
    origin, axes = view.origin, view.axes
    x, y, z = float(mesh.normals[row, 0]), float(mesh.normals[row, 1]), float(mesh.normals[row, 2])
    offset = (
        x * (mesh.corners[row, 0, 0] - origin[0])
        + y * (mesh.corners[row, 0, 1] - origin[1])
        + z * (mesh.corners[row, 0, 2] - origin[2])
    )
    return (
        offset,
        x * axes[0, 0] + y * axes[0, 1] + z * axes[0, 2],
        x * axes[1, 0] + y * axes[1, 1] + z * axes[1, 2],
        x * axes[2, 0] + y * axes[2, 1] + z * axes[2, 2],
    )


@concurrent
def find_boxes(instance: NDArray[np.int32], keys: NDArray[np.int32], boxes: NDArray[np.int32]) -> None:
    """Writes the box and the number of the pixels of each instance.

    Args:
        instance: (h, w).
        keys: (n,) ascending; others, and 0, are left out.
        boxes: (n, 5): left, top, right, bottom (one past the last pixel) [pixels], number of pixels; zeros if unseen.
    """
    height, width = instance.shape
    for k in range(len(keys)):
        boxes[k, 0], boxes[k, 1], boxes[k, 2], boxes[k, 3], boxes[k, 4] = width, height, 0, 0, 0
    for y in range(height):
        line, first = instance[y], 0
        while first < width:
            key, last = line[first], first + 1
            while last < width and line[last] == key:
                last += 1
            row = _row_of(keys, key) if key != 0 else -1
            if row >= 0:
                boxes[row, 0], boxes[row, 2] = min(boxes[row, 0], first), max(boxes[row, 2], last)
                boxes[row, 1], boxes[row, 3] = min(boxes[row, 1], y), y + 1
                boxes[row, 4] += last - first
            first = last
    for k in range(len(keys)):
        if boxes[k, 4] == 0:
            boxes[k] = 0


@compiled
def _row_of(keys: NDArray[np.int32], key: int) -> int:
    """Returns the row of a key, -1 if it is not there."""
    low, high = 0, len(keys)
    while low < high:
        middle = (low + high) // 2
        if keys[middle] < key:
            low = middle + 1
        else:
            high = middle
    return low if low < len(keys) and keys[low] == key else -1
