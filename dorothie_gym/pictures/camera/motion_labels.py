"""Surface normals, and optical flow between two pictures, of every pixel of a visibility buffer."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.pictures.camera.labels import mesh_of, row_in
from dorothie_gym.pictures.camera.mesh import TOWN, Mesh
from dorothie_gym.pictures.camera.rasterizer import NEAR, SKY, VisibilityBuffer
from dorothie_gym.support.compilation import concurrent, inlined
from dorothie_gym.support.compilation.records import RecordArray

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array
    from dorothie_gym.pictures.camera.models.model_bank import PlacementRecord
    from dorothie_gym.pictures.camera.pose import View

MOST = 1e5
"""Largest movement that is written [pixels]: of surfaces that were close beside the camera."""


@concurrent
def write_normals(
    view: View, buffer: VisibilityBuffer, town: Mesh, overlay: Mesh, bodies: Mesh, normals: NDArray[np.float32]
) -> None:
    """Writes the normals of the pixels of a buffer.

    Args:
        view: projection of the buffer.
        buffer: numbers of the triangles, see `labels.mesh_of`.
        town: objects of every session.
        overlay: static objects of this session.
        bodies: moving bodies.
        normals: (h, w, 3) receives unit vectors to the right, down and forward; 0 for the sky.
    """
    axes = view.axes
    for y in range(view.height):
        numbers, first = buffer.triangles[y], 0
        while first < view.width:
            number, last = numbers[first], first + 1
            while last < view.width and numbers[last] == number:
                last += 1
            right, up, forward = 0.0, 0.0, 0.0
            if number != SKY:
                mesh, row = mesh_of(town, overlay, bodies, number), row_in(town, overlay, number)
                for k in range(3):
                    part = float(mesh.normals[row, k])
                    right += part * axes[0, k]
                    up += part * axes[1, k]
                    forward += part * axes[2, k]
            for x in range(first, last):
                normals[y, x, 0], normals[y, x, 1], normals[y, x, 2] = right, -up, forward
            first = last


@concurrent
def write_flow(
    view: View, before: View, buffer: VisibilityBuffer, town: Mesh, overlay: Mesh, bodies: Mesh,
    depth: NDArray[np.float32], placed: RecordArray[PlacementRecord], placed_before: RecordArray[PlacementRecord],
    flow: NDArray[np.float32],
) -> None:  # fmt: skip
    """Writes the movement of the surface of each pixel of a buffer since an earlier picture.

    Bodies are rigid: of a walking person, the movement of the whole. Bodies that were not there have stood still.

    Args:
        view: projection of the buffer.
        before: projection of the earlier picture.
        buffer: numbers of the triangles, see `labels.mesh_of`.
        town: objects of every session.
        overlay: static objects of this session.
        bodies: triangles of moving bodies.
        depth: (h, w) of the buffer [m], infinite for the sky.
        placed: places of the bodies.
        placed_before: their places in the earlier picture, in any order.
        flow: (h, w, 2) receives the movement to the right and down [pixels]; 0 where the surface was behind the camera.
    """
    for y in range(view.height):
        numbers, first = buffer.triangles[y], 0
        while first < view.width:
            number, last = numbers[first], first + 1
            while last < view.width and numbers[last] == number:
                last += 1
            now, then = -1, -1
            if number >= town.corners.shape[0] + overlay.corners.shape[0]:
                key = bodies.instances[row_in(town, overlay, number)]
                if key != TOWN:
                    now, then = _row_of(placed, key), _row_of(placed_before, key)
            if now >= 0 and then >= 0:
                _write_moved(view, before, placed[now], placed_before[then], y, first, last, depth, flow)
            else:
                _write_static(view, before, y, first, last, depth, flow)
            first = last


@inlined
def _row_of(placed: RecordArray[PlacementRecord], key: int) -> int:
    """Returns the row of a body, -1 if it is not there."""
    for k in range(len(placed)):
        if placed[k].key == key:
            return k
    return -1


@inlined
def _write_static(
    view: View, before: View, y: int, first: int, last: int, depth: NDArray[np.float32], flow: NDArray[np.float32]
) -> None:
    """Writes neighbours in a row that see the sky or something that stands."""
    up = (0.5 * view.height - y - 0.5) / view.focal
    for x in range(first, last):
        right, away = (x + 0.5 - 0.5 * view.width) / view.focal, float(depth[y, x])
        dx, dy, dz = _direction(view.axes, right, up)
        if away < np.inf:
            dx = view.origin[0] - before.origin[0] + away * dx
            dy = view.origin[1] - before.origin[1] + away * dy
            dz = view.origin[2] - before.origin[2] + away * dz
        _write_pixel(before, dx, dy, dz, y, x, flow)


@inlined
def _write_moved(
    view: View, before: View, now: PlacementRecord, then: PlacementRecord, y: int, first: int, last: int,
    depth: NDArray[np.float32], flow: NDArray[np.float32],
) -> None:  # fmt: skip
    """Writes neighbours in a row that see a body with another place before."""
    up = (0.5 * view.height - y - 0.5) / view.focal
    for x in range(first, last):
        right, away = (x + 0.5 - 0.5 * view.width) / view.focal, float(depth[y, x])
        dx, dy, dz = _direction(view.axes, right, up)
        dx = view.origin[0] + away * dx - now.x
        dy = view.origin[1] + away * dy - now.y
        dz = view.origin[2] + away * dz - now.z
        ahead, aside = dx * now.cos + dy * now.sin, dy * now.cos - dx * now.sin
        above = dz - ahead * now.rise
        _write_pixel(
            before,
            then.x + ahead * then.cos - aside * then.sin - before.origin[0],
            then.y + ahead * then.sin + aside * then.cos - before.origin[1],
            then.z + above + ahead * then.rise - before.origin[2],
            y,
            x,
            flow,
        )


@inlined
def _direction(axes: Array, right: float, up: float) -> tuple[float, float, float]:
    """Returns the direction through a place in the picture, of length 1 along the axis."""
    return (
        axes[2, 0] + right * axes[0, 0] + up * axes[1, 0],
        axes[2, 1] + right * axes[0, 1] + up * axes[1, 1],
        axes[2, 2] + right * axes[0, 2] + up * axes[1, 2],
    )


@inlined
def _write_pixel(before: View, dx: float, dy: float, dz: float, y: int, x: int, flow: NDArray[np.float32]) -> None:
    """Writes the flow to a pixel from a position relative to the earlier camera."""
    axes = before.axes
    depth = dx * axes[2, 0] + dy * axes[2, 1] + dz * axes[2, 2]
    if depth < NEAR:
        flow[y, x, 0], flow[y, x, 1] = 0.0, 0.0
        return
    scale = before.focal / depth
    right = x + 0.5 - 0.5 * before.width - (dx * axes[0, 0] + dy * axes[0, 1] + dz * axes[0, 2]) * scale
    down = y + 0.5 - 0.5 * before.height + (dx * axes[1, 0] + dy * axes[1, 1] + dz * axes[1, 2]) * scale
    flow[y, x, 0], flow[y, x, 1] = min(max(right, -MOST), MOST), min(max(down, -MOST), MOST)
