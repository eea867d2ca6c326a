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

_BEHIND = -1e-7  # [m] nearest that the plane of a triangle may be to the camera

# projections of a batch of triangles: each quantity takes a stretch of one array, see `samples`
_BATCH = 64
_STRETCH = _BATCH + 8
_AX, _AY = 0 * _STRETCH, 1 * _STRETCH
_BX, _BY = 2 * _STRETCH, 3 * _STRETCH
_CX, _CY = 4 * _STRETCH, 5 * _STRETCH
_OFFSET, _CHOICE = 6 * _STRETCH, 7 * _STRETCH
_QUANTITIES = 8
_NONE, _WHOLE, _CUT = 0.0, 1.0, 2.0  # what is drawn of a triangle: nothing, all, or what the near plane leaves

_MARGIN = 0.5 + 1e-6  # [samples] from the left side of a sample to its middle, and a little more


@by_reference
class VisibilityBuffer(NamedTuple):
    """Nearest triangles at the samples of a picture.

    Attributes:
        nearness: (h, w) float32 inverse depth [1/m], 0 for the sky.
        triangles: (h, w) int32 number of the triangle, `SKY` for none.
        values: scratch: corners of a batch of triangles in the picture [samples], and what is drawn of each.
        kept: (_BATCH,) scratch: those of the batch that may cover a sample.
        corners: (3, 3) scratch: a triangle's corners to the right and up, times the focal length, and forward.
        cut: (4, 2) scratch: the picture coordinates of what the near plane leaves of a triangle.
    """

    nearness: NDArray[np.float32]
    triangles: NDArray[np.int32]
    values: Array
    kept: NDArray[np.int64]
    corners: Array
    cut: Array


def new_buffer(width: int, height: int) -> VisibilityBuffer:
    """Returns a buffer for a picture."""
    return VisibilityBuffer(
        np.zeros((height, width), np.float32), np.full((height, width), SKY, np.int32),
        np.zeros(_QUANTITIES * _STRETCH), np.zeros(_BATCH, np.int64), np.zeros((3, 3)), np.zeros((4, 2)),
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
    axes, focal, values, kept = view.axes, view.focal, buffer.values, buffer.kept
    wide, high, inverse = 0.5 * view.width, 0.5 * view.height, 1.0 / focal
    for start in range(first, last, _BATCH):
        for place in range(_select(view, buffer, mesh, start, min(_BATCH, last - start))):
            k = kept[place]
            row = start + k
            # 1 / depth is affine in the picture: normal . ray / (normal . (corner - origin))
            nx, ny, nz = float(mesh.normals[row, 0]), float(mesh.normals[row, 1]), float(mesh.normals[row, 2])
            scale = 1.0 / min(values[_OFFSET + k], _BEHIND)
            step = scale * inverse
            right = (nx * axes[0, 0] + ny * axes[0, 1] + nz * axes[0, 2]) * step
            down = -(nx * axes[1, 0] + ny * axes[1, 1] + nz * axes[1, 2]) * step
            middle = (nx * axes[2, 0] + ny * axes[2, 1] + nz * axes[2, 2]) * scale - right * wide - down * high
            identity = number + row - first
            if values[_CHOICE + k] == _WHOLE:
                _fill(
                    buffer, values[_AX + k], values[_AY + k], values[_BX + k], values[_BY + k], values[_CX + k],
                    values[_CY + k], middle, right, down, identity,
                )  # fmt: skip
            else:
                cut = buffer.cut
                for j in range(1, _cut_off(view, mesh, row, buffer.corners, cut) - 1):
                    _fill(
                        buffer, cut[0, 0], cut[0, 1], cut[j, 0], cut[j, 1], cut[j + 1, 0], cut[j + 1, 1], middle,
                        right, down, identity,
                    )  # fmt: skip


@compiled
def _select(view: View, buffer: VisibilityBuffer, mesh: Mesh, first: int, count: int) -> int:
    """Lists the triangles of a batch that may cover a sample, and projects them; returns their number."""
    values, kept = buffer.values, buffer.kept
    _project(view, mesh, first, values, count)
    found = 0
    for k in range(count):
        kept[found] = k
        found += values[_CHOICE + k] > _NONE
    return found


@inlined
def _project(view: View, mesh: Mesh, first: int, values: Array, count: int) -> None:
    """Projects a batch and chooses what is drawn of it; written so that the compiler makes vectors of it."""
    origin, axes, focal = view.origin, view.axes, view.focal
    x0, y0, z0 = origin[0], origin[1], origin[2]
    rx, ry, rz = focal * axes[0, 0], focal * axes[0, 1], focal * axes[0, 2]
    ux, uy, uz = focal * axes[1, 0], focal * axes[1, 1], focal * axes[1, 2]
    fx, fy, fz = axes[2, 0], axes[2, 1], axes[2, 2]
    wide, high, height = 0.5 * view.width, 0.5 * view.height, float(view.height)
    parts = mesh.components[:, first : first + count]
    corner_ax, corner_ay, corner_az = parts[0], parts[1], parts[2]
    corner_bx, corner_by, corner_bz = parts[3], parts[4], parts[5]
    corner_cx, corner_cy, corner_cz = parts[6], parts[7], parts[8]
    normal_x, normal_y, normal_z = parts[9], parts[10], parts[11]
    for k in range(count):
        x, y, z = corner_ax[k] - x0, corner_ay[k] - y0, corner_az[k] - z0
        offset = float(normal_x[k]) * x + float(normal_y[k]) * y + float(normal_z[k]) * z
        a_right, a_up, a = x * rx + y * ry + z * rz, x * ux + y * uy + z * uz, x * fx + y * fy + z * fz
        x, y, z = corner_bx[k] - x0, corner_by[k] - y0, corner_bz[k] - z0
        b_right, b_up, b = x * rx + y * ry + z * rz, x * ux + y * uy + z * uz, x * fx + y * fy + z * fz
        x, y, z = corner_cx[k] - x0, corner_cy[k] - y0, corner_cz[k] - z0
        c_right, c_up, c = x * rx + y * ry + z * rz, x * ux + y * uy + z * uz, x * fx + y * fy + z * fz
        is_outside = (
            (offset >= _BEHIND)  # seen from behind, or edge-on
            | ((a < NEAR) & (b < NEAR) & (c < NEAR))
            | ((a_right < -wide * a) & (b_right < -wide * b) & (c_right < -wide * c))
            | ((a_right > wide * a) & (b_right > wide * b) & (c_right > wide * c))
            | ((a_up < -high * a) & (b_up < -high * b) & (c_up < -high * c))
            | ((a_up > high * a) & (b_up > high * b) & (c_up > high * c))
        )  # all corners lie on the outer side of one edge of the picture
        in_front = (a >= NEAR) & (b >= NEAR) & (c >= NEAR)
        scale_a, scale_b, scale_c = 1.0 / max(a, NEAR), 1.0 / max(b, NEAR), 1.0 / max(c, NEAR)
        ax, bx, cx = wide + a_right * scale_a, wide + b_right * scale_b, wide + c_right * scale_c
        ay, by, cy = high - a_up * scale_a, high - b_up * scale_b, high - c_up * scale_c
        top, bottom = min(min(ay, by), cy), max(max(ay, by), cy)
        left, right = min(min(ax, bx), cx), max(max(ax, bx), cx)
        is_between = (  # two rows of samples, or two samples of each row
            np.ceil(min(max(top - 0.5, 0.0), height)) == np.ceil(min(max(bottom - 0.5, 0.0), height))
        ) | (np.ceil(left - _MARGIN) == np.ceil(right - (1.0 - _MARGIN)))
        choice = _NONE if is_outside | (in_front & is_between) else _WHOLE if in_front else _CUT
        values[_AX + k], values[_BX + k], values[_CX + k] = ax, bx, cx
        values[_AY + k], values[_BY + k], values[_CY + k] = ay, by, cy
        values[_OFFSET + k], values[_CHOICE + k] = offset, choice


@compiled
def _cut_off(view: View, mesh: Mesh, row: int, corners: Array, cut: Array) -> int:
    """Projects what the near plane leaves of a triangle: three or four corners; returns their number."""
    origin, axes, focal, wide, high = view.origin, view.axes, view.focal, 0.5 * view.width, 0.5 * view.height
    for j in range(3):
        x = mesh.corners[row, j, 0] - origin[0]
        y = mesh.corners[row, j, 1] - origin[1]
        z = mesh.corners[row, j, 2] - origin[2]
        for k in range(3):
            scale = focal if k < 2 else 1.0
            corners[j, k] = x * (scale * axes[k, 0]) + y * (scale * axes[k, 1]) + z * (scale * axes[k, 2])
    count = 0
    for j in range(3):
        k = j + 1 if j < 2 else 0
        here, there = corners[j, 2] - NEAR, corners[k, 2] - NEAR
        if here >= 0.0:
            scale = 1.0 / corners[j, 2]
            cut[count, 0] = wide + corners[j, 0] * scale
            cut[count, 1] = high - corners[j, 1] * scale
            count += 1
        if (here >= 0.0) != (there >= 0.0):
            a, b = (j, k) if here >= 0.0 else (k, j)  # the neighbour cuts from the same end
            share = (corners[a, 2] - NEAR) / (corners[a, 2] - corners[b, 2])
            x = corners[a, 0] + share * (corners[b, 0] - corners[a, 0])
            y = corners[a, 1] + share * (corners[b, 1] - corners[a, 1])
            cut[count, 0] = wide + x / NEAR
            cut[count, 1] = high - y / NEAR
            count += 1
    return count


@inlined
def _row(y: float, height: int) -> int:
    """Returns the first row of samples at or below a coordinate, within the picture."""
    return math.ceil(min(max(y - 0.5, 0.0), float(height)))


@compiled
def _fill(
    buffer: VisibilityBuffer, ax: float, ay: float, bx: float, by: float, cx: float, cy: float, middle: float,
    right: float, down: float, number: int,
) -> None:  # fmt: skip
    """Draws a triangle of corners in the picture [samples], whose nearness is affine there."""
    height, width = buffer.nearness.shape[0], float(buffer.nearness.shape[1])
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
    along = (cx - ax) / (cy - ay)
    is_right = (bx - ax) * (cy - ay) > (by - ay) * (cx - ax)  # whether the middle corner is right of the long edge
    x, y, step = ax, ay, (bx - ax) / (by - ay) if top < turn else 0.0
    for row in range(top, bottom):
        if row == turn:
            x, y, step = bx, by, (cx - bx) / (cy - by)
        one, two = ax + (row + 0.5 - ay) * along, x + (row + 0.5 - y) * step
        start, end = (one, two) if is_right else (two, one)
        first = math.ceil(min(max(start - 0.5, 0.0), width))
        last = math.ceil(min(max(end - 0.5, 0.0), width))
        if first < last:
            nearness = middle + right * (first + 0.5) + down * (row + 0.5)
            _fill_span(buffer.nearness[row, first:last], buffer.triangles[row, first:last], nearness, right, number)


@inlined
def _fill_span(
    nearness: NDArray[np.float32], triangles: NDArray[np.int32], first: float, step: float, number: int
) -> None:
    """Draws samples of a row; written so that the compiler makes vectors of it."""
    identity = np.int32(number)
    for k in range(len(nearness)):
        value, old, other = np.float32(first + step * np.int32(k)), nearness[k], triangles[k]
        # without the sum, the compiler stores under a mask, which takes some processors ten times as long
        nearness[k] = np.float32(max(value, old) + np.float32(0.0))
        triangles[k] = identity if value > old else other
