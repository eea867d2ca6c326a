"""Visibility buffer: the nearest triangle at every sample of a picture, drawn by scan lines.

A sample belongs to a triangle if it lies between the crossings of its row with two edges, rounded up. Neighbours
compute the crossing with a shared edge from the same two points in the same order, so that a closed surface has neither
gaps nor samples drawn twice. The near plane cuts edges from their visible end.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.camera.mesh import Mesh
from dorothie_gym.camera.pose import View
from dorothie_gym.compilation import compiled, concurrent, inlined
from dorothie_gym.compilation.by_reference import by_reference
from dorothie_gym.maps.model import Array

SKY = -1
"""Triangle of samples that see none."""

NEAR = 0.05
"""Depth of the near plane [m]."""


@by_reference
class VisibilityBuffer(NamedTuple):
    """Nearest triangles at the samples of a picture.

    Attributes:
        nearness: (h, w) float32 inverse depth [1/m], 0 for the sky.
        triangles: (h, w) int32 number of the triangle, `SKY` for none.
        corners: (3, 3) scratch: a triangle's corners to the right, up and forward of the camera.
        cut: (4, 2) scratch: the picture coordinates of what the near plane leaves of a triangle.
    """

    nearness: NDArray[np.float32]
    triangles: NDArray[np.int32]
    corners: Array
    cut: Array


def new_buffer(width: int, height: int) -> VisibilityBuffer:
    """Returns a buffer for a picture."""
    return VisibilityBuffer(
        np.zeros((height, width), np.float32), np.full((height, width), SKY, np.int32), np.zeros((3, 3)),
        np.zeros((4, 2)),
    )  # fmt: skip


@concurrent
def clear(buffer: VisibilityBuffer) -> None:
    """Empties a buffer."""
    buffer.nearness[:] = 0.0
    buffer.triangles[:] = SKY


@concurrent
def draw_triangles(
    view: View, buffer: VisibilityBuffer, mesh: Mesh, first: int, last: int, number: int
) -> None:  # fmt: skip
    """Draws a range of a mesh's triangles, of which the first has a number."""
    origin, axes = view.origin, view.axes
    for k in range(first, last):
        # 1 / depth is affine in the picture: normal . ray / (normal . (corner - origin))
        nx, ny, nz = float(mesh.normals[k, 0]), float(mesh.normals[k, 1]), float(mesh.normals[k, 2])
        offset = (
            nx * (mesh.corners[k, 0, 0] - origin[0]) + ny * (mesh.corners[k, 0, 1] - origin[1])
            + nz * (mesh.corners[k, 0, 2] - origin[2])
        )  # fmt: skip
        if offset >= -1e-7:
            continue  # seen from behind, or edge-on
        behind = _to_camera(view, mesh, k, buffer.corners)
        if behind == 3 or _is_outside(view, buffer.corners):
            continue
        scale = 1.0 / offset
        right = (nx * axes[0, 0] + ny * axes[0, 1] + nz * axes[0, 2]) * scale / view.focal
        down = -(nx * axes[1, 0] + ny * axes[1, 1] + nz * axes[1, 2]) * scale / view.focal
        ahead = (nx * axes[2, 0] + ny * axes[2, 1] + nz * axes[2, 2]) * scale
        middle = ahead - right * 0.5 * view.width - down * 0.5 * view.height
        if behind == 0:
            _project(view, buffer.corners, buffer.cut)
            _fill(buffer, 1, 2, middle, right, down, number + k - first)
        else:
            corners = _cut_off(view, buffer.corners, buffer.cut)
            for j in range(1, corners - 1):
                _fill(buffer, j, j + 1, middle, right, down, number + k - first)


@inlined
def _to_camera(view: View, mesh: Mesh, k: int, corners: Array) -> int:
    """Writes the corners of a triangle relative to the camera; returns how many lie before the near plane."""
    origin, axes, behind = view.origin, view.axes, 0
    for j in range(3):
        x, y, z = (
            mesh.corners[k, j, 0] - origin[0], mesh.corners[k, j, 1] - origin[1], mesh.corners[k, j, 2] - origin[2],
        )  # fmt: skip
        corners[j, 0] = x * axes[0, 0] + y * axes[0, 1] + z * axes[0, 2]
        corners[j, 1] = x * axes[1, 0] + y * axes[1, 1] + z * axes[1, 2]
        depth = x * axes[2, 0] + y * axes[2, 1] + z * axes[2, 2]
        corners[j, 2] = depth
        behind += depth < NEAR
    return behind


@inlined
def _is_outside(view: View, corners: Array) -> bool:
    """Returns whether all corners lie on the outer side of one edge of the picture."""
    wide, high = 0.5 * view.width / view.focal, 0.5 * view.height / view.focal
    left, right, top, bottom = True, True, True, True
    for j in range(3):
        x, y, depth = corners[j, 0], corners[j, 1], corners[j, 2]
        left &= x < -wide * depth
        right &= x > wide * depth
        bottom &= y < -high * depth
        top &= y > high * depth
    return left or right or top or bottom


@inlined
def _project(view: View, corners: Array, cut: Array) -> None:
    for j in range(3):
        scale = view.focal / corners[j, 2]
        cut[j, 0] = 0.5 * view.width + corners[j, 0] * scale
        cut[j, 1] = 0.5 * view.height - corners[j, 1] * scale


@compiled
def _cut_off(view: View, corners: Array, cut: Array) -> int:
    """Projects what the near plane leaves of a triangle: three or four corners; returns their number."""
    count = 0
    for j in range(3):
        k = j + 1 if j < 2 else 0
        here, there = corners[j, 2] - NEAR, corners[k, 2] - NEAR
        if here >= 0.0:
            scale = view.focal / corners[j, 2]
            cut[count, 0] = 0.5 * view.width + corners[j, 0] * scale
            cut[count, 1] = 0.5 * view.height - corners[j, 1] * scale
            count += 1
        if (here >= 0.0) != (there >= 0.0):
            a, b = (j, k) if here >= 0.0 else (k, j)  # the neighbour cuts from the same end
            share = (corners[a, 2] - NEAR) / (corners[a, 2] - corners[b, 2])
            x = corners[a, 0] + share * (corners[b, 0] - corners[a, 0])
            y = corners[a, 1] + share * (corners[b, 1] - corners[a, 1])
            cut[count, 0] = 0.5 * view.width + view.focal * x / NEAR
            cut[count, 1] = 0.5 * view.height - view.focal * y / NEAR
            count += 1
    return count


@inlined
def _row(y: float, height: int) -> int:
    """Returns the first row of samples at or below a coordinate, within the picture."""
    return math.ceil(min(max(y - 0.5, 0.0), float(height)))


@inlined
def _fill(
    buffer: VisibilityBuffer, second: int, third: int, middle: float, right: float, down: float, number: int
) -> None:
    """Draws the triangle of the first and two other corners of `cut`, whose nearness is affine in the picture."""
    height = buffer.nearness.shape[0]
    ax, ay = buffer.cut[0, 0], buffer.cut[0, 1]
    bx, by = buffer.cut[second, 0], buffer.cut[second, 1]
    cx, cy = buffer.cut[third, 0], buffer.cut[third, 1]
    if (bx - ax) * (cy - ay) <= (by - ay) * (cx - ax):
        return  # edge-on: rounded, it is seen from behind, and its neighbours cover its samples
    if ay > by:
        ax, ay, bx, by = bx, by, ax, ay
    if by > cy:
        bx, by, cx, cy = cx, cy, bx, by
        if ay > by:
            ax, ay, bx, by = bx, by, ax, ay
    top, turn, bottom = _row(ay, height), _row(by, height), _row(cy, height)
    if top == bottom:
        return
    long = (cx - ax) / (cy - ay)
    is_right = (bx - ax) * (cy - ay) > (by - ay) * (cx - ax)  # whether the middle corner is right of the long edge
    if top < turn:
        _fill_rows(
            buffer, top, turn, ax, ay, long, ax, ay, (bx - ax) / (by - ay), is_right, middle, right, down, number
        )
    if turn < bottom:
        _fill_rows(
            buffer, turn, bottom, ax, ay, long, bx, by, (cx - bx) / (cy - by), is_right, middle, right, down, number
        )


@inlined
def _fill_rows(
    buffer: VisibilityBuffer, top: int, bottom: int, ax: float, ay: float, along: float, bx: float, by: float,
    other: float, is_right: bool, middle: float, right: float, down: float, number: int,
) -> None:  # fmt: skip
    """Draws rows between the long edge from (ax, ay) and another one from (bx, by), with their steps in x per row."""
    width = float(buffer.nearness.shape[1])
    for y in range(top, bottom):
        one, two = ax + (y + 0.5 - ay) * along, bx + (y + 0.5 - by) * other
        start, end = (one, two) if is_right else (two, one)
        first = math.ceil(min(max(start - 0.5, 0.0), width))
        last = math.ceil(min(max(end - 0.5, 0.0), width))
        if first < last:
            nearness = middle + right * (first + 0.5) + down * (y + 0.5)
            _fill_span(buffer.nearness[y, first:last], buffer.triangles[y, first:last], nearness, right, number)


@inlined
def _fill_span(
    nearness: NDArray[np.float32], triangles: NDArray[np.int32], first: float, step: float, number: int
) -> None:
    """Draws samples of a row; written so that the compiler makes vectors of it."""
    identity = np.int32(number)
    for k in range(len(nearness)):
        value, old = np.float32(first + step * k), nearness[k]
        is_nearer = value > old
        nearness[k] = value if is_nearer else old
        triangles[k] = identity if is_nearer else triangles[k]
