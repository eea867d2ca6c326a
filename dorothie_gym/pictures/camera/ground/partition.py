"""Plane partition of a sheet into triangles: areas cut by square cells, without gaps or corners on other edges.

All corners lie on a grid of about a millimetre, as whole numbers. Cells are cut into quarters where the ground is not
level. Along the borders of cells, each polygon receives the corners of its neighbours.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from dorothie_gym.pictures.camera.ground.regions import GRID, only_areas

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array

LARGEST = 32.0
"""Width of a cell of level ground [m]."""

SMALLEST = 4.0
"""Width of a cell of the most uneven ground [m]."""

_UNEVEN = 0.1  # [m] by which the height in the middle of a cell may differ from a plane through its corners
_ODD = 0.37109375  # [m] offset of the borders of cells, off the whole metres that roads are often drawn at
_ON_EDGE = 1.5  # [grid steps] from an edge; a corner this near lies on it
_RINGS = 4  # of country around the cells; each is twice as wide as the one inside


class Area(enum.IntFlag):
    """Kinds of areas of a sheet; the others are added to the first three."""

    FLAT = 0
    RAISED = 1
    SLOPE = 2
    COVERED = 4
    """Above tunnels."""
    BELOW = 8
    """Below bridges."""
    BENCH = 16
    """Pavements in cuttings and on banks."""
    BANK = 32
    """These pavements with the slopes beside them, up or down to the land."""


Cut = tuple[int, BaseGeometry]


def cut_ground(
    regions: Sequence[Cut], low: Array, high: Array, height: Callable[[Array], Array] | None
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Returns triangles (n, 3, 2) [grid steps] with their areas (n,), clockwise on the map, out to the horizon.

    Args:
        regions: areas by value, without overlaps; the rest of the plane is `Area.RAISED`.
        low: smallest x and y of the area that is cut into cells (2,) [m].
        high: largest x and y of it [m].
        height: height at positions (n, 2) [m], None where all is level.
    """
    fraction, doublings = math.frexp(max(1.0, float((high - low).max()) / LARGEST))
    size = math.ldexp(LARGEST, doublings - (fraction == 0.5))  # the next power of two
    corner = np.floor((low + high) / 2.0 - size / 2.0) + _ODD
    pieces: list[Cut] = []
    _cut(regions, corner, float(size), height, pieces)
    pieces += [(Area.RAISED, ring) for ring in _rings(corner, float(size))]
    return _triangles(pieces)


def cut_areas(regions: Sequence[Cut], step: float) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Returns triangles (n, 3, 2) [grid steps] with their areas (n,), cut into cells of a width [m]."""
    regions = [row for row in regions if not row[1].is_empty]
    if not regions:
        return np.zeros((0, 3, 2), dtype=np.int64), np.zeros(0, dtype=np.int64)
    x0, y0, x1, y1 = shapely.total_bounds([area for _, area in regions]).tolist()
    corner = np.floor(np.array([x0, y0])) - 1.0 + _ODD
    count = int(np.ceil(max(x1 - corner[0], y1 - corner[1]) / step))
    pieces: list[Cut] = []
    for i in range(count):
        for kind, area in regions:
            # strips first: an intersection costs as much as the polygon has corners
            strip = _clipped(area, corner[0] + i * step, y0 - 1.0, corner[0] + (i + 1) * step, y1 + 1.0)
            for k in range(0 if strip.is_empty else count):
                low = corner + np.array([i, k]) * step
                pieces.append((kind, _clipped(strip, *low, *(low + step))))
    return _triangles(pieces)


def _cut(
    regions: Sequence[Cut], corner: Array, size: float, height: Callable[[Array], Array] | None, pieces: list[Cut]
) -> None:
    """Cuts a square until it is small enough for its ground, and appends its polygons."""
    box = shapely.box(*corner, *(corner + size))
    if size > (4.0 * LARGEST if not regions else LARGEST) or (size > SMALLEST and _uneven(corner, size, height)):
        half = size / 2.0
        for shift in ((0.0, 0.0), (half, 0.0), (0.0, half), (half, half)):
            part = corner + shift
            inside = [(area, _clipped(shape, *part, *(part + half))) for area, shape in regions]
            _cut([row for row in inside if not row[1].is_empty], part, half, height, pieces)
        return
    rest: BaseGeometry = box
    for area, shape in regions:
        pieces.append((area, shape))
        rest = only_areas(shapely.difference(rest, shape, grid_size=GRID))
    pieces.append((Area.RAISED, rest))


def _clipped(shape: BaseGeometry, x0: float, y0: float, x1: float, y1: float) -> BaseGeometry:
    return only_areas(shapely.intersection(shape, shapely.box(x0, y0, x1, y1), grid_size=GRID))


def _uneven(corner: Array, size: float, height: Callable[[Array], Array] | None) -> bool:
    """Returns whether the ground of a square differs from a plane."""
    if height is None:
        return False
    count = max(3, int(size / 8.0) + 1)
    at = np.linspace(0.0, size, count)
    grid = np.stack(np.meshgrid(at, at), axis=-1).reshape(-1, 2)
    z = height(corner + grid)
    centred = grid - 0.5 * size  # its columns are orthogonal: the grid is regular
    slopes = (centred * z[:, None]).sum(axis=0) / np.square(centred).sum(axis=0)
    return bool(np.abs(z.mean() + (centred * slopes).sum(axis=1) - z).max() > _UNEVEN)


def _rings(corner: Array, size: float) -> list[BaseGeometry]:
    """Returns trapezoids around a square, ring by ring."""
    found: list[BaseGeometry] = []
    inner = corner + size * np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    middle, half = corner + size / 2.0, max(size, 200.0)
    for _ in range(_RINGS):
        outer = np.round((middle + half * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])) / GRID) * GRID
        for k in range(4):
            after = (k + 1) % 4
            found.append(shapely.Polygon([inner[k], inner[after], outer[after], outer[k]]))
        inner, half = outer, 2.0 * half
    return found


# --- Triangles --------------------------------------------------------------------------------------------------------


def _triangles(pieces: Sequence[Cut]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Returns the triangles of polygons that share the corners on their common edges."""
    polygons, areas = [], []
    for area, piece in pieces:
        for part in shapely.get_parts(shapely.get_parts([piece])):
            if part.geom_type == "Polygon" and not part.is_empty:
                polygons.append([_whole(ring.coords) for ring in (part.exterior, *part.interiors)])
                areas.append(area)
    rings = [ring for polygon in polygons for ring in polygon]
    near, exact = _assembled(polygons, _with_corners(rings, _ON_EDGE)), _assembled(polygons, _with_corners(rings, 0.0))
    # a corner that is only near an edge may make a polygon touch itself
    full = np.where(shapely.is_valid(near), near, exact)
    cut = shapely.constrained_delaunay_triangles(full)
    parts, owner = shapely.get_parts(cut, return_index=True)
    points = np.rint(shapely.get_coordinates(parts)).astype(np.int64).reshape(-1, 4, 2)[:, :3]
    first, second = points[:, 1] - points[:, 0], points[:, 2] - points[:, 0]
    # Triangles without area connect corners on one line; they are turned as the others of their polygon are.
    twice = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    turned = np.bincount(owner, weights=twice, minlength=len(full))[owner] < 0
    points[turned] = points[turned][:, ::-1]
    return points, np.array(areas, dtype=np.int64)[owner]


def _whole(coordinates: object) -> NDArray[np.int64]:
    return np.rint(np.asarray(coordinates, dtype=np.float64)[:, :2] / GRID).astype(np.int64)


def _assembled(
    polygons: Sequence[Sequence[NDArray[np.int64]]], rings: Sequence[NDArray[np.int64]]
) -> NDArray[np.object_]:
    """Returns polygons of new rings, with as many rings each as before."""
    following = iter(rings)
    made = []
    for polygon in polygons:
        outer, *holes = [next(following) for _ in polygon]
        made.append(shapely.Polygon(outer, holes))
    return np.array(made, dtype=object)


def _with_corners(rings: Sequence[NDArray[np.int64]], within: float) -> list[NDArray[np.int64]]:
    """Returns closed rings (n, 2) with the corners of others that lie on their edges or within a distance of them."""
    starts = np.concatenate([ring[:-1] for ring in rings])
    ends = np.concatenate([ring[1:] for ring in rings])
    corners = np.unique(starts, axis=0)
    tree = shapely.STRtree(np.asarray(shapely.linestrings(np.stack((starts, ends), axis=1))))
    point, edge = tree.query(shapely.points(corners), predicate="dwithin", distance=within)
    place, way = corners[point] - starts[edge], ends[edge] - starts[edge]
    share = (place * way).sum(axis=1) / (way**2).sum(axis=1)
    between = (share > 0.0) & (share < 1.0) & place.any(axis=1) & (corners[point] != ends[edge]).any(axis=1)
    point, edge, share = point[between], edge[between], share[between]
    order = np.lexsort((share, edge))
    point, edge = point[order], edge[order]
    # all corners in one column: that of an edge's start, then those on it
    owner = np.concatenate((np.arange(len(starts)), edge))
    rank = np.concatenate((np.zeros(len(starts), dtype=np.int64), np.arange(1, len(edge) + 1)))
    sequence = np.lexsort((rank, owner))
    column = np.concatenate((starts, corners[point]))[sequence]
    counts = np.bincount(owner, minlength=len(starts))
    last = np.cumsum([len(ring) - 1 for ring in rings])
    lengths = np.diff(np.concatenate(([0], np.cumsum(counts)[last - 1])))
    parts = np.split(column, np.cumsum(lengths)[:-1])
    return [np.concatenate((part, part[:1])) for part in parts]
