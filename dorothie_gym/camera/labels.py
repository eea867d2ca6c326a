"""Depth, semantic class and instance of every pixel, and the boxes of what is seen of each instance."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.camera.ground.lookup import GroundArrays, material_at
from dorothie_gym.camera.mesh import Mesh, Surface
from dorothie_gym.camera.pose import View
from dorothie_gym.camera.rasterizer import SKY, VisibilityBuffer
from dorothie_gym.compilation import compiled, concurrent, inlined
from dorothie_gym.compilation.by_reference import by_reference
from dorothie_gym.ontology import ObjectClass

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
        np.full((height, width), np.inf, np.float32), np.full((height, width), _SKY_CLASS, np.uint8),
        np.zeros((height, width), np.int32),
    )  # fmt: skip


@concurrent
def write_labels(
    view: View, buffer: VisibilityBuffer, town: Mesh, overlay: Mesh, bodies: Mesh, ground: GroundArrays, labels: Labels
) -> None:
    """Writes the labels of the pixels of a buffer.

    Args:
        view: projection of the buffer.
        buffer: numbers of the triangles, see `mesh_of`.
        town: what stands in every session.
        overlay: what stands in this session.
        bodies: what moves.
        ground: materials of the ground.
        labels: to be written.
    """
    last, mesh, row, kind = SKY, town, 0, _SKY_CLASS
    offset, nx, ny, nz = 0.0, 0.0, 0.0, 0.0
    for y in range(view.height):
        for x in range(view.width):
            number = buffer.triangles[y, x]
            if number == SKY:
                labels.depth[y, x], labels.semantic[y, x], labels.instance[y, x] = np.inf, _SKY_CLASS, 0
                continue
            if number != last:
                last, mesh, row = number, mesh_of(town, overlay, bodies, number), row_in(town, overlay, number)
                offset, nx, ny, nz = plane_of(view, mesh, row)
                kind = -1 if mesh.surfaces[row] & _GROUND else int(mesh.classes[row])
            right, up = (x + 0.5 - 0.5 * view.width) / view.focal, (0.5 * view.height - y - 0.5) / view.focal
            depth = offset / (nx * right + ny * up + nz)
            labels.depth[y, x], labels.instance[y, x] = depth, mesh.instances[row]
            labels.semantic[y, x] = kind if kind >= 0 else _ground_class(view, mesh, row, right, up, depth, ground)


@inlined
def _ground_class(view: View, mesh: Mesh, row: int, right: float, up: float, depth: float, ground: GroundArrays) -> int:
    """Returns the class of the ground at a depth [m] in a direction (right, up, 1)."""
    axes, origin = view.axes, view.origin
    x = origin[0] + depth * (axes[2, 0] + right * axes[0, 0] + up * axes[1, 0])
    y = origin[1] + depth * (axes[2, 1] + right * axes[0, 1] + up * axes[1, 1])
    return int(ground.classes[material_at(ground, int(mesh.textures[row]), x, y)])


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
        x * (mesh.corners[row, 0, 0] - origin[0]) + y * (mesh.corners[row, 0, 1] - origin[1])
        + z * (mesh.corners[row, 0, 2] - origin[2])
    )  # fmt: skip
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
        keys: (n,) ascending; others are left out.
        boxes: (n, 5): left, top, right, bottom (behind the last pixel) [pixels], number of pixels; zeros if unseen.
    """
    height, width = instance.shape
    for k in range(len(keys)):
        boxes[k, 0], boxes[k, 1], boxes[k, 2], boxes[k, 3], boxes[k, 4] = width, height, 0, 0, 0
    last, row = 0, -1
    for y in range(height):
        for x in range(width):
            key = instance[y, x]
            if key != last:
                last, row = key, _row_of(keys, key)
            if row >= 0:
                boxes[row, 0], boxes[row, 2] = min(boxes[row, 0], x), max(boxes[row, 2], x + 1)
                boxes[row, 1], boxes[row, 3] = min(boxes[row, 1], y), y + 1
                boxes[row, 4] += 1
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
