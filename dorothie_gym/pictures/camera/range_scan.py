"""Nearest surfaces along the rays of a scanning sensor: lidar and radar.

Rays lie in columns: half-planes that contain the axis of the sensor. A triangle cuts such a half-plane in a segment
between two of its edges, and is hit by the rays whose slopes lie between those of the two ends. Neighbours compute the
crossing with a shared edge from the same two points in the same order, so that closed surfaces have no gaps, as in
`rasterizer`. The distance follows from the plane of the triangle, as the depth of pictures does.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps.model import Array
from dorothie_gym.pictures.camera.bodies import copy_body, surround
from dorothie_gym.pictures.camera.ground.lookup import GroundArrays, material_at
from dorothie_gym.pictures.camera.labels import mesh_of, row_in
from dorothie_gym.pictures.camera.mesh import PADDING, Mesh, Surface
from dorothie_gym.pictures.camera.rasterizer import BEHIND, SKY
from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.support.compilation import compiled, concurrent, inlined
from dorothie_gym.support.compilation.records import RecordArray, by_reference

if TYPE_CHECKING:
    from dorothie_gym.pictures.camera.cells import CellTable
    from dorothie_gym.pictures.camera.models.model_bank import PlacementRecord
    from dorothie_gym.pictures.camera.pose import View

NEAREST = 0.05
"""Distance from the axis of the sensor below which nothing is hit [m]."""

_BATCH = 256  # triangles that are projected at once
_STRETCH = _BATCH + 8
_A, _B, _C = 0 * _STRETCH, 3 * _STRETCH, 6 * _STRETCH  # corners, each ahead, to the right and up [m]
_OFFSET = 9 * _STRETCH  # of the plane [m]
_FIRST, _LAST = 10 * _STRETCH, 11 * _STRETCH  # columns, in columns from straight ahead; none where first > last
_NORMAL = 12 * _STRETCH  # ahead, to the right and up
_QUANTITIES = 15
_ROUGH = 3e-4  # [rad] largest error of `_angle`
_GROUND = int(Surface.GROUND)


@by_reference
class RayGrid(NamedTuple):
    """Directions of a scanning sensor, in columns of equal azimuth.

    Attributes:
        cosines: (columns,) of the azimuths.
        sines: (columns,) of the azimuths, positive to the right.
        slopes: (rows,) tangents of the altitudes, ascending.
        lengths: (rows,) lengths of directions of these slopes with a horizontal part of 1.
        first: (1,) azimuth of the first column [rad].
        step: (1,) from one column to the next [rad].
        whole: (1,) whether the columns go all around.
        range: (1,) largest distance [m].
    """

    cosines: Array
    sines: Array
    slopes: Array
    lengths: Array
    first: Array
    step: Array
    whole: NDArray[np.bool_]
    range: Array


@by_reference
class Scan(NamedTuple):
    """Nearest surfaces along the rays of a grid.

    Attributes:
        nearness: (columns, rows) float32 inverse of the distance from the axis of the sensor [1/m], 0 for none.
        triangles: (columns, rows) int32 number of the triangle, `SKY` for none.
        values: scratch: projections of a batch of triangles.
    """

    nearness: NDArray[np.float32]
    triangles: NDArray[np.int32]
    values: Array


def ray_grid(azimuths: Array, altitudes: Array, reach: float, *, whole: bool) -> RayGrid:
    """Returns the rays with azimuths (columns,) and altitudes (rows,), both ascending in equal steps [rad].

    Args:
        azimuths: clockwise from straight ahead.
        altitudes: upwards.
        reach: largest distance [m].
        whole: whether the azimuths go all around.
    """
    slopes = pn.tan(altitudes)
    step = float(azimuths[1] - azimuths[0]) if len(azimuths) > 1 else 2.0 * math.pi
    return RayGrid(
        pn.cos(azimuths),
        pn.sin(azimuths),
        slopes,
        np.sqrt(1.0 + slopes * slopes),
        azimuths[:1].copy(),
        np.array([step]),
        np.array([whole]),
        np.array([reach]),
    )


def new_scan(columns: int, rows: int) -> Scan:
    """Returns room for a scan."""
    return Scan(
        np.zeros((columns, rows), np.float32), np.full((columns, rows), SKY, np.int32), np.zeros(_QUANTITIES * _STRETCH)
    )


@concurrent
def scan_scene(
    view: View,
    grid: RayGrid,
    scan: Scan,
    town: Mesh,
    cells: CellTable,
    overlay: Mesh,
    overlay_cells: CellTable,
    bank: Mesh,
    ranges: NDArray[np.int32],
    boxes: NDArray[np.float32],
    bodies: RecordArray[PlacementRecord],
    box: Array,
    placed: Mesh,
) -> int:
    """Finds the nearest surfaces of a scene; returns the number of triangles of bodies.

    Args:
        view: place and axes of the sensor.
        grid: rays.
        scan: receives the surfaces.
        town: objects of every session, sorted by cell.
        cells: cells of the town.
        overlay: static objects of the session, sorted by cell.
        overlay_cells: cells of the overlay.
        bank: triangles of all models.
        ranges: ranges of `ModelBank`.
        boxes: boxes of `ModelBank`.
        bodies: models and places.
        box: (2, 3) scratch space.
        placed: receives the triangles of bodies. If it has too little room, they are left out.
    """
    scan.nearness[:] = 0.0
    scan.triangles[:] = SKY
    first = town.corners.shape[0]
    count = _copy_bodies(view, grid.range[0], bank, ranges, boxes, bodies, box, placed)
    if count <= placed.corners.shape[0]:
        _scan_triangles(view, grid, scan, placed, 0, count, first + overlay.corners.shape[0])
    _scan_cells(view, grid, scan, overlay, overlay_cells, first)
    _scan_cells(view, grid, scan, town, cells, 0)
    return count


@compiled
def _copy_bodies(
    view: View, reach: float, bank: Mesh, ranges: NDArray[np.int32], boxes: NDArray[np.float32],
    bodies: RecordArray[PlacementRecord], box: Array, target: Mesh,
) -> int:  # fmt: skip
    """Writes the triangles of bodies within a distance; returns their number, or more than the room."""
    count = 0
    for k in range(len(bodies)):
        body = bodies[k]
        surround(body, boxes[body.model], box)
        if _distance(view.origin, box[0], box[1]) <= reach:
            count = copy_body(view, bank, ranges, body, target, count)
    return count


@inlined
def _distance(origin: Array, low: Array, high: Array) -> float:
    """Returns the distance from a place to a box [m]."""
    x = max(low[0] - origin[0], 0.0, origin[0] - high[0])
    y = max(low[1] - origin[1], 0.0, origin[1] - high[1])
    z = max(low[2] - origin[2], 0.0, origin[2] - high[2])
    return math.sqrt(x * x + y * y + z * z)


@compiled
def _scan_cells(view: View, grid: RayGrid, scan: Scan, mesh: Mesh, cells: CellTable, number: int) -> None:
    """Scans the cells of a mesh within range; `number` is that of the first triangle."""
    for cell in range(len(cells.ranges)):
        if _distance(view.origin, cells.low[cell], cells.high[cell]) <= grid.range[0]:
            _scan_triangles(view, grid, scan, mesh, cells.ranges[cell, 0], cells.ranges[cell, 1], number)


@compiled
def _scan_triangles(view: View, grid: RayGrid, scan: Scan, mesh: Mesh, first: int, last: int, number: int) -> None:
    """Scans a range of a mesh; `number` is that of the mesh's first triangle."""
    values = scan.values
    for start in range(first, last, _BATCH):
        count = min(_BATCH, last - start)
        _project(view, grid, mesh, start, values, (count + PADDING - 1) // PADDING * PADDING)
        for k in range(count):
            if values[_FIRST + k] <= values[_LAST + k]:
                _fill(grid, scan, values, k, number + start + k)


@inlined
def _angle(ahead: float, right: float) -> float:
    """Returns the azimuth of a direction up to an error of `_ROUGH` [rad], without a branch."""
    a, b = abs(ahead), abs(right)
    ratio = min(a, b) / max(max(a, b), 1e-12)
    square = ratio * ratio
    angle = ((-0.0464964749 * square + 0.15931422) * square - 0.327622764) * square * ratio + ratio
    angle = 0.5 * math.pi - angle if b > a else angle
    angle = math.pi - angle if ahead < 0.0 else angle
    return -angle if right < 0.0 else angle


@inlined
def _project(view: View, grid: RayGrid, mesh: Mesh, first: int, values: Array, count: int) -> None:
    """Writes corners, planes and columns of a batch of triangles; written so that the compiler vectorises it."""
    origin, axes, reach = view.origin, view.axes, grid.range[0]
    x0, y0, z0 = origin[0], origin[1], origin[2]
    rx, ry, rz, ux, uy, uz = axes[0, 0], axes[0, 1], axes[0, 2], axes[1, 0], axes[1, 1], axes[1, 2]
    fx, fy, fz = axes[2, 0], axes[2, 1], axes[2, 2]
    low, high, inverse = grid.slopes[0], grid.slopes[len(grid.slopes) - 1], 1.0 / grid.step[0]
    begin, pad, whole, most = grid.first[0], _ROUGH, grid.whole[0], len(grid.cosines) - 1.0
    parts = mesh.components[:, first : first + count]
    corner_ax, corner_ay, corner_az = parts[0], parts[1], parts[2]
    corner_bx, corner_by, corner_bz = parts[3], parts[4], parts[5]
    corner_cx, corner_cy, corner_cz = parts[6], parts[7], parts[8]
    normal_x, normal_y, normal_z = parts[9], parts[10], parts[11]
    for k in range(count):
        x, y, z = corner_ax[k] - x0, corner_ay[k] - y0, corner_az[k] - z0
        nx, ny, nz = float(normal_x[k]), float(normal_y[k]), float(normal_z[k])
        offset = nx * x + ny * y + nz * z
        af, ar, au = x * fx + y * fy + z * fz, x * rx + y * ry + z * rz, x * ux + y * uy + z * uz
        x, y, z = corner_bx[k] - x0, corner_by[k] - y0, corner_bz[k] - z0
        bf, br, bu = x * fx + y * fy + z * fz, x * rx + y * ry + z * rz, x * ux + y * uy + z * uz
        x, y, z = corner_cx[k] - x0, corner_cy[k] - y0, corner_cz[k] - z0
        cf, cr, cu = x * fx + y * fy + z * fz, x * rx + y * ry + z * rz, x * ux + y * uy + z * uz
        a, b, c = math.sqrt(af * af + ar * ar), math.sqrt(bf * bf + br * br), math.sqrt(cf * cf + cr * cr)
        # cones around the axis are convex on the side of the axis
        above = (au > max(high, 0.0) * a) & (bu > max(high, 0.0) * b) & (cu > max(high, 0.0) * c)
        below = (au < min(low, 0.0) * a) & (bu < min(low, 0.0) * b) & (cu < min(low, 0.0) * c)
        is_outside = (offset >= BEHIND) | (offset < -reach) | above | below
        one, two = _angle(af, ar), _angle(bf, br)
        three = _angle(cf, cr)
        two, three = two - one, three - one
        two -= 2.0 * math.pi * np.floor(two * (0.5 / math.pi) + 0.5)
        three -= 2.0 * math.pi * np.floor(three * (0.5 / math.pi) + 0.5)
        left, right = min(min(two, three), 0.0) - pad, max(max(two, three), 0.0) + pad
        # the axis may pass through it, or a grid that does not go all around lies between its ends
        around = (right - left > math.pi - 4.0 * pad) | (
            (not whole) & ((one + left < -math.pi) | (one + right > math.pi))
        )
        least, last = np.ceil((one + left - begin) * inverse), np.floor((one + right - begin) * inverse)
        least, last = (0.0, most) if around else (least, last) if whole else (max(least, 0.0), min(last, most))
        values[_FIRST + k], values[_LAST + k] = np.inf if is_outside else least, last
        values[_A + k], values[_A + _STRETCH + k], values[_A + 2 * _STRETCH + k] = af, ar, au
        values[_B + k], values[_B + _STRETCH + k], values[_B + 2 * _STRETCH + k] = bf, br, bu
        values[_C + k], values[_C + _STRETCH + k], values[_C + 2 * _STRETCH + k] = cf, cr, cu
        values[_OFFSET + k] = offset
        values[_NORMAL + k] = nx * fx + ny * fy + nz * fz
        values[_NORMAL + _STRETCH + k] = nx * rx + ny * ry + nz * rz
        values[_NORMAL + 2 * _STRETCH + k] = nx * ux + ny * uy + nz * uz


@inlined
def _cut(
    f: float, r: float, u: float, s: float, other_f: float, other_r: float, other_u: float, other_s: float,
    cos: float, sin: float,
) -> tuple[float, float]:  # fmt: skip
    """Returns distance from the axis and height of the crossing of a column with an edge, from its end on the left.

    Ends are given ahead, to the right, up, and to the right of the column.
    """
    if s < 0.0:
        share = s / (s - other_s)
        ahead, right, up = f + share * (other_f - f), r + share * (other_r - r), u + share * (other_u - u)
    else:
        share = other_s / (other_s - s)
        ahead, right = other_f + share * (f - other_f), other_r + share * (r - other_r)
        up = other_u + share * (u - other_u)
    return ahead * cos + right * sin, up


@compiled
def _fill(grid: RayGrid, scan: Scan, values: Array, k: int, number: int) -> None:
    """Scans a triangle of a batch."""
    columns = len(grid.cosines)
    af, ar, au = values[_A + k], values[_A + _STRETCH + k], values[_A + 2 * _STRETCH + k]
    bf, br, bu = values[_B + k], values[_B + _STRETCH + k], values[_B + 2 * _STRETCH + k]
    cf, cr, cu = values[_C + k], values[_C + _STRETCH + k], values[_C + 2 * _STRETCH + k]
    scale = 1.0 / min(values[_OFFSET + k], BEHIND)
    nf, nr = values[_NORMAL + k] * scale, values[_NORMAL + _STRETCH + k] * scale
    nu = values[_NORMAL + 2 * _STRETCH + k] * scale
    for column in range(int(values[_FIRST + k]), int(values[_LAST + k]) + 1):
        at = column + columns if column < 0 else column - columns if column >= columns else column
        cos, sin = grid.cosines[at], grid.sines[at]
        a, b, c = ar * cos - af * sin, br * cos - bf * sin, cr * cos - cf * sin  # to the right of the column
        is_left, b_left, c_left = a < 0.0, b < 0.0, c < 0.0
        if is_left == b_left and b_left == c_left:
            continue
        if b_left == c_left:  # the corner that lies alone on its side begins both edges
            near, low = _cut(af, ar, au, a, bf, br, bu, b, cos, sin)
            far, high = _cut(af, ar, au, a, cf, cr, cu, c, cos, sin)
        elif is_left == c_left:
            near, low = _cut(bf, br, bu, b, af, ar, au, a, cos, sin)
            far, high = _cut(bf, br, bu, b, cf, cr, cu, c, cos, sin)
        else:
            near, low = _cut(cf, cr, cu, c, af, ar, au, a, cos, sin)
            far, high = _cut(cf, cr, cu, c, bf, br, bu, b, cos, sin)
        if max(near, far) >= NEAREST:
            one, two = _slope(near, low, far, high), _slope(far, high, near, low)
            _fill_column(
                scan.nearness[at],
                scan.triangles[at],
                grid.slopes,
                min(one, two),
                max(one, two),
                nf * cos + nr * sin,
                nu,
                number,
            )


@inlined
def _slope(near: float, low: float, far: float, high: float) -> float:
    """Returns the slope of the first end of a segment in a column, which is cut off close to the axis."""
    if near < NEAREST:
        low += (NEAREST - near) / (far - near) * (high - low)
        near = NEAREST
    return low / near


@inlined
def _fill_column(
    nearness: NDArray[np.float32],
    triangles: NDArray[np.int32],
    slopes: Array,
    low: float,
    high: float,
    level: float,
    rise: float,
    number: int,
) -> None:
    """Enters a surface into the rays of a column with slopes in [low, high)."""
    identity = np.int32(number)
    for k in range(len(slopes)):
        slope, old, other = slopes[k], nearness[k], triangles[k]
        value = np.float32(level + rise * slope)
        is_nearer = (slope >= low) & (slope < high) & (value > old)
        nearness[k] = value if is_nearer else old
        triangles[k] = identity if is_nearer else other


@concurrent
def read_scan(
    view: View, grid: RayGrid, scan: Scan, town: Mesh, overlay: Mesh, bodies: Mesh, ground: GroundArrays,
    points: NDArray[np.float32], classes: NDArray[np.uint8], instances: NDArray[np.int32],
) -> None:  # fmt: skip
    """Reads returns, classes and instances of a scan.

    Args:
        view: place and axes of the sensor.
        grid: rays.
        scan: surfaces.
        town: objects of every session.
        overlay: static objects of the session.
        bodies: moving bodies.
        ground: materials of the ground.
        points: (rows, columns, 4) receives positions ahead, to the right and up, and the distance [m]; 0 without a
            return.
        classes: (rows, columns) receives `ObjectClass`, 0 without a return.
        instances: (rows, columns) receives keys, 0 for none.
    """
    origin, axes = view.origin, view.axes
    for column in range(len(grid.cosines)):
        cos, sin = grid.cosines[column], grid.sines[column]
        for k in range(len(grid.slopes)):
            number, nearness = scan.triangles[column, k], scan.nearness[column, k]
            points[k, column], classes[k, column], instances[k, column] = 0.0, 0, 0
            if number == SKY or grid.lengths[k] > grid.range[0] * nearness:
                continue
            mesh, row = mesh_of(town, overlay, bodies, number), row_in(town, overlay, number)
            away = 1.0 / float(nearness)
            ahead, right, up = away * cos, away * sin, away * grid.slopes[k]
            points[k, column, 0], points[k, column, 1], points[k, column, 2] = ahead, right, up
            points[k, column, 3] = away * grid.lengths[k]
            classes[k, column], instances[k, column] = mesh.classes[row], mesh.instances[row]
            if mesh.surfaces[row] & _GROUND:
                x = origin[0] + ahead * axes[2, 0] + right * axes[0, 0] + up * axes[1, 0]
                y = origin[1] + ahead * axes[2, 1] + right * axes[0, 1] + up * axes[1, 1]
                classes[k, column] = ground.classes[material_at(ground, int(mesh.textures[row]), x, y)]
