"""Visibility buffer: the nearest triangle at every sample of a picture, drawn by scan lines.

A sample belongs to a triangle if it lies between the crossings of its row with two edges, rounded up. Neighbours
compute the crossing with a shared edge from the same two points in the same order, so that a closed surface has neither
gaps nor samples drawn twice. The near plane cuts edges from their visible end.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps.model import Array
from dorothie_gym.pictures.camera.mesh import PADDING, Mesh
from dorothie_gym.support.compilation import compiled, concurrent, inlined
from dorothie_gym.support.compilation.records import by_reference

if TYPE_CHECKING:
    from dorothie_gym.pictures.camera.pose import View

SKY = -1
"""Triangle of samples that see none."""

NEAR = 0.05
"""Depth of the near plane [m]."""

BEHIND = -1e-7
"""Nearest that the plane of a triangle may be to the camera, which sees it from in front [m]."""

# projections of a batch of triangles: each quantity takes a stretch of one array, see `samples`
_BATCH = 256  # triangles that are sifted at once
_ROOM = 2 * _BATCH  # triangles that are projected at once, at most
_STRETCH = _ROOM + 8
_AX, _AY = 0 * _STRETCH, 1 * _STRETCH
_BX, _BY = 2 * _STRETCH, 3 * _STRETCH
_CX, _CY = 4 * _STRETCH, 5 * _STRETCH
_OFFSET, _CHOICE = 6 * _STRETCH, 7 * _STRETCH
_QUANTITIES = 8
_NONE, _WHOLE, _CUT = 0.0, 1.0, 2.0  # drawn part of a triangle: none, all, or the part beyond the near plane

_ROWS = 4  # whose ends are computed at once

_MARGIN = 0.5 + 1e-6  # [samples] from the left side of a sample to its centre, and a little more

# upper bounds of the errors of sifting with half the digits: float32 has 24 bits
_SLACK = 1e-3  # [m]
_SHARE = 1e-6  # of the coordinates of the camera
_SOME = 0.51  # [samples] as `_MARGIN`
_CLOSE = 1.0  # [m] depth below which triangles are not tried for samples


@by_reference
class VisibilityBuffer(NamedTuple):
    """Nearest triangles at the samples of a picture.

    Attributes:
        nearness: (h, w) float32 inverse depth [1/m], 0 for the sky.
        triangles: (h, w) int32 number of the triangle, `SKY` for none.
        values: scratch: corners of a batch of triangles in the picture [samples], and the drawn part of each.
        sifted: (_BATCH,) int32 scratch: 1 for those triangles of a batch that may cover a sample, 0 for others.
        kept: (_ROOM,) scratch: their rows.
        parts: (12, _ROOM) float32 scratch: their components, see `Mesh.components`.
        firsts: (h + _ROWS,) scratch: first sample of a triangle in each of its rows.
        lasts: (h + _ROWS,) scratch: sample after the last one.
        corners: (3, 3) scratch: a triangle's corners to the right and up, times the focal length, and forward.
        cut: (4, 2) scratch: the picture coordinates of a triangle clipped by the near plane.
    """

    nearness: NDArray[np.float32]
    triangles: NDArray[np.int32]
    values: Array
    sifted: NDArray[np.int32]
    kept: NDArray[np.int64]
    parts: NDArray[np.float32]
    firsts: NDArray[np.int64]
    lasts: NDArray[np.int64]
    corners: Array
    cut: Array


def new_buffer(width: int, height: int) -> VisibilityBuffer:
    """Returns a buffer for a picture."""
    return VisibilityBuffer(
        np.zeros((height, width), np.float32),
        np.full((height, width), SKY, np.int32),
        np.zeros(_QUANTITIES * _STRETCH),
        np.zeros(_BATCH, np.int32),
        np.zeros(_ROOM, np.int64),
        np.zeros((12, _ROOM), np.float32),
        np.zeros(height + _ROWS, np.int64),
        np.zeros(height + _ROWS, np.int64),
        np.zeros((3, 3)),
        np.zeros((4, 2)),
    )


@concurrent
def clear(buffer: VisibilityBuffer) -> None:
    """Empties a buffer."""
    buffer.nearness[:] = 0.0
    buffer.triangles[:] = SKY


@concurrent
def draw_triangles(view: View, buffer: VisibilityBuffer, mesh: Mesh, first: int, last: int, number: int) -> None:
    """Draws a range of a mesh's triangles, of which the first has a number."""
    found = collect_triangles(view, buffer, mesh, first, last, 0, number - first)
    draw_collected(view, buffer, mesh, found, number - first)


@compiled
def collect_triangles(
    view: View, buffer: VisibilityBuffer, mesh: Mesh, first: int, last: int, found: int, shift: int
) -> int:
    """Collects the triangles of a range that may cover a sample, and draws the collected ones if there is no room.

    Args:
        view: projection.
        buffer: collects the triangles of one mesh.
        mesh: that mesh.
        first: triangle of the range.
        last: triangle after the range.
        found: number of the triangles that are collected already.
        shift: number of a triangle minus its row.

    Returns:
        The number of collected triangles, to be drawn with `draw_collected`.
    """
    kept, sifted = buffer.kept, buffer.sifted
    for start in range(first, last, _BATCH):
        count = min(_BATCH, last - start)
        # whole vectors; the mesh has as many more columns, which are not looked at
        _sift(view, mesh, start, sifted, (count + PADDING - 1) // PADDING * PADDING)
        for k in range(count):
            kept[found] = start + k
            found += sifted[k]
        if found > _ROOM - _BATCH:
            draw_collected(view, buffer, mesh, found, shift)
            found = 0
    return found


@inlined
def _sift(view: View, mesh: Mesh, first: int, sifted: NDArray[np.int32], count: int) -> None:
    """Finds the triangles of a batch that may cover a sample: all that do, and few others.

    Nine of ten triangles do not: they are seen from behind, out of the picture, or between samples. Half the digits
    suffice for most of these, and twice as many triangles fit into a vector register.
    """
    origin, axes = view.origin, view.axes
    far = max(max(abs(origin[0]), abs(origin[1])), abs(origin[2]))
    slack, focal = np.float32(_SLACK + _SHARE * far), np.float32(view.focal)
    behind, nearest, margin = slack, np.float32(NEAR) - slack, focal * slack
    close, some, one = np.float32(_CLOSE), np.float32(_SOME), np.float32(1.0)
    wide, high = np.float32(0.5 * view.width), np.float32(0.5 * view.height)
    x0, y0, z0 = np.float32(origin[0]), np.float32(origin[1]), np.float32(origin[2])
    rx, ry, rz = focal * np.float32(axes[0, 0]), focal * np.float32(axes[0, 1]), focal * np.float32(axes[0, 2])
    ux, uy, uz = focal * np.float32(axes[1, 0]), focal * np.float32(axes[1, 1]), focal * np.float32(axes[1, 2])
    fx, fy, fz = np.float32(axes[2, 0]), np.float32(axes[2, 1]), np.float32(axes[2, 2])
    parts = mesh.components[:, first : first + count]
    corner_ax, corner_ay, corner_az = parts[0], parts[1], parts[2]
    corner_bx, corner_by, corner_bz = parts[3], parts[4], parts[5]
    corner_cx, corner_cy, corner_cz = parts[6], parts[7], parts[8]
    normal_x, normal_y, normal_z = parts[9], parts[10], parts[11]
    for k in range(count):
        x, y, z = corner_ax[k] - x0, corner_ay[k] - y0, corner_az[k] - z0
        offset = normal_x[k] * x + normal_y[k] * y + normal_z[k] * z
        a_right, a_up, a = x * rx + y * ry + z * rz, x * ux + y * uy + z * uz, x * fx + y * fy + z * fz
        x, y, z = corner_bx[k] - x0, corner_by[k] - y0, corner_bz[k] - z0
        b_right, b_up, b = x * rx + y * ry + z * rz, x * ux + y * uy + z * uz, x * fx + y * fy + z * fz
        x, y, z = corner_cx[k] - x0, corner_cy[k] - y0, corner_cz[k] - z0
        c_right, c_up, c = x * rx + y * ry + z * rz, x * ux + y * uy + z * uz, x * fx + y * fy + z * fz
        is_outside = (
            (offset > behind)
            | (max(max(a, b), c) < nearest)
            | (max(max(a_right + wide * a, b_right + wide * b), c_right + wide * c) < -margin)
            | (min(min(a_right - wide * a, b_right - wide * b), c_right - wide * c) > margin)
            | (max(max(a_up + high * a, b_up + high * b), c_up + high * c) < -margin)
            | (min(min(a_up - high * a, b_up - high * b), c_up - high * c) > margin)
        )
        scale_a, scale_b, scale_c = one / max(a, close), one / max(b, close), one / max(c, close)
        ax, bx, cx = a_right * scale_a, b_right * scale_b, c_right * scale_c
        ay, by, cy = a_up * scale_a, b_up * scale_b, c_up * scale_c
        around = some + margin * max(max(scale_a, scale_b), scale_c)  # from a corner to the next centre of a sample
        low, top = min(min(ay, by), cy), max(max(ay, by), cy)
        left, right = min(min(ax, bx), cx), max(max(ax, bx), cx)
        is_between = (np.ceil(high - top - around) == np.ceil(high - low - one + around)) | (
            np.ceil(wide + left - around) == np.ceil(wide + right - one + around)
        )
        in_front = min(min(a, b), c) >= close
        sifted[k] = 0 if is_outside | (in_front & is_between) else 1


@compiled
def draw_collected(view: View, buffer: VisibilityBuffer, mesh: Mesh, count: int, shift: int) -> None:
    """Draws the first `count` collected triangles; `shift` is added to a row to give its number."""
    axes, focal, values, kept, parts = view.axes, view.focal, buffer.values, buffer.kept, buffer.parts
    wide, high, inverse = 0.5 * view.width, 0.5 * view.height, 1.0 / focal
    for k in range(count):
        for j in range(12):
            parts[j, k] = mesh.components[j, kept[k]]
    _project(view, parts, values, (count + PADDING - 1) // PADDING * PADDING)  # whole vectors
    for k in range(count):
        if values[_CHOICE + k] == _NONE:
            continue
        row = kept[k]
        # 1 / depth is affine in the picture: normal . ray / (normal . (corner - origin))
        nx, ny, nz = float(parts[9, k]), float(parts[10, k]), float(parts[11, k])
        scale = 1.0 / min(values[_OFFSET + k], BEHIND)
        step = scale * inverse
        right = (nx * axes[0, 0] + ny * axes[0, 1] + nz * axes[0, 2]) * step
        down = -(nx * axes[1, 0] + ny * axes[1, 1] + nz * axes[1, 2]) * step
        middle = (nx * axes[2, 0] + ny * axes[2, 1] + nz * axes[2, 2]) * scale - right * wide - down * high
        if values[_CHOICE + k] == _WHOLE:
            fill_triangle(
                buffer, values[_AX + k], values[_AY + k], values[_BX + k], values[_BY + k], values[_CX + k],
                values[_CY + k], middle, right, down, row + shift,
            )  # fmt: skip
        else:
            cut = buffer.cut
            for j in range(1, _cut_off(view, mesh, row, buffer.corners, cut) - 1):
                fill_triangle(
                    buffer, cut[0, 0], cut[0, 1], cut[j, 0], cut[j, 1], cut[j + 1, 0], cut[j + 1, 1], middle,
                    right, down, row + shift,
                )  # fmt: skip


@inlined
def _project(view: View, parts: NDArray[np.float32], values: Array, count: int) -> None:
    """Projects triangles and selects those to draw; written so that the compiler vectorises it."""
    origin, axes, focal = view.origin, view.axes, view.focal
    x0, y0, z0 = origin[0], origin[1], origin[2]
    rx, ry, rz = focal * axes[0, 0], focal * axes[0, 1], focal * axes[0, 2]
    ux, uy, uz = focal * axes[1, 0], focal * axes[1, 1], focal * axes[1, 2]
    fx, fy, fz = axes[2, 0], axes[2, 1], axes[2, 2]
    wide, high, height = 0.5 * view.width, 0.5 * view.height, float(view.height)
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
            (offset >= BEHIND)  # seen from behind, or edge-on
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
    """Projects a triangle clipped by the near plane: three or four corners; returns their number."""
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
def fill_triangle(
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
    is_right = (bx - ax) * (cy - ay) > (by - ay) * (cx - ax)  # whether the middle corner is right of the long edge
    along = (cx - ax) / (cy - ay)
    above = (bx - ax) / (by - ay) if top < turn else 0.0
    below = (cx - bx) / (cy - by) if turn < bottom else 0.0
    firsts, lasts = buffer.firsts, buffer.lasts
    for k in range((bottom - top + _ROWS - 1) // _ROWS * _ROWS):  # whole vectors of the processor
        row = top + k
        x, y, step = (ax, ay, above) if row < turn else (bx, by, below)
        one, two = ax + (row + 0.5 - ay) * along, x + (row + 0.5 - y) * step
        start, end = (one, two) if is_right else (two, one)
        firsts[k] = math.ceil(min(max(start - 0.5, 0.0), width))
        lasts[k] = math.ceil(min(max(end - 0.5, 0.0), width))
    for row in range(top, bottom):
        first, last = firsts[row - top], lasts[row - top]
        if first < last:
            nearness = middle + right * (first + 0.5) + down * (row + 0.5)
            _fill_span(buffer.nearness[row, first:last], buffer.triangles[row, first:last], nearness, right, number)


@inlined
def _fill_span(
    nearness: NDArray[np.float32], triangles: NDArray[np.int32], first: float, step: float, number: int
) -> None:
    """Draws samples of a row; written so that the compiler vectorises it."""
    identity = np.int32(number)
    for k in range(len(nearness)):
        value, old, other = np.float32(first + step * np.int32(k)), nearness[k], triangles[k]
        # without the sum, the compiler stores under a mask, which takes some processors ten times as long
        nearness[k] = np.float32(max(value, old) + np.float32(0.0))
        triangles[k] = identity if value > old else other
