"""Slopes of the roads, which tilt vehicles and their cameras."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps.model import Array
from dorothie_gym.pictures.maps.shapes import TownSamples
from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.support.compilation import compiled
from dorothie_gym.support.compilation.records import by_reference
from dorothie_gym.support.copying import shared

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town

_CELL = 5.0  # [m]; samples as far away count
_LEVEL = 1.5  # [m] of height between a vehicle and its road, at most
_SMALLEST = 1e-3  # minimum slope of the samples that are kept
_FAINT = 1e-3  # weight, of 1 for a sample at the place itself, of level ground


@by_reference
@shared
class RoadSlopes(NamedTuple):
    """Samples of lanes on slopes, by square cells that are numbered row by row.

    Attributes:
        origin: (2,) first corner of the cells [m].
        shape: (2,) columns and rows of cells.
        firsts: (cells + 1,) int32 first sample of each cell.
        places: (n, 3) positions [m].
        ways: (n, 3) direction along x and y, and rise per metre in that direction.
    """

    origin: Array
    shape: NDArray[np.int64]
    firsts: NDArray[np.int32]
    places: Array
    ways: Array


def road_slopes(town: Town) -> RoadSlopes:
    """Returns the slopes of all roads of a town; the result has no cells if all roads are level."""
    samples = TownSamples.of(town)
    slope = np.zeros(len(samples.station))
    for a, b in samples.bounds.tolist():
        if b - a > 1:
            slope[a:b] = np.gradient(samples.centre[a:b, 2], samples.station[a:b])
    keep = np.full(len(slope), bool((np.abs(slope) > _SMALLEST).any()))  # including level ones, such as beside a slope
    places = samples.centre[keep]
    ways = np.column_stack((pn.cos(samples.heading), pn.sin(samples.heading), slope))[keep]
    if not len(places):
        empty = np.zeros(1, dtype=np.int32)
        return RoadSlopes(np.zeros(2), np.zeros(2, dtype=np.int64), empty, np.zeros((0, 3)), np.zeros((0, 3)))
    origin = places[:, :2].min(axis=0) - _CELL
    column, row = np.floor((places[:, :2] - origin) / _CELL).astype(np.int64).T
    shape = np.array([column.max() + 2, row.max() + 2])
    cell = row * shape[0] + column
    order = np.argsort(cell, kind="stable")
    firsts = np.searchsorted(cell[order], np.arange(shape.prod() + 1)).astype(np.int32)
    return RoadSlopes(origin, shape, firsts, np.ascontiguousarray(places[order]), np.ascontiguousarray(ways[order]))


@compiled
def rise_at(slopes: RoadSlopes, x: float, y: float, z: float, cos: float, sin: float) -> float:
    """Returns the rise per metre of the road at a position [m] in a direction, 0 beside the roads.

    The slope is that of the best-fitting plane of the surrounding lanes, so that it changes continuously along a drive.
    """
    if slopes.shape[0] == 0:
        return 0.0
    column, row = int(np.floor((x - slopes.origin[0]) / _CELL)), int(np.floor((y - slopes.origin[1]) / _CELL))
    # least squares: of the squared differences in rise along the lanes, and of the slope itself
    xx, xy, yy, along_x, along_y = _FAINT, 0.0, _FAINT, 0.0, 0.0
    for j in range(max(row - 1, 0), min(row + 2, slopes.shape[1])):
        for i in range(max(column - 1, 0), min(column + 2, slopes.shape[0])):
            cell = j * slopes.shape[0] + i
            for k in range(slopes.firsts[cell], slopes.firsts[cell + 1]):
                away = (slopes.places[k, 0] - x) ** 2 + (slopes.places[k, 1] - y) ** 2
                if away < _CELL * _CELL and abs(slopes.places[k, 2] - z) < _LEVEL:
                    share = 1.0 - away / (_CELL * _CELL)
                    weight, c, s, rise = share * share, slopes.ways[k, 0], slopes.ways[k, 1], slopes.ways[k, 2]
                    xx, xy, yy = xx + weight * c * c, xy + weight * c * s, yy + weight * s * s
                    along_x, along_y = along_x + weight * c * rise, along_y + weight * s * rise
    scale = 1.0 / (xx * yy - xy * xy)
    return float(scale * ((yy * along_x - xy * along_y) * cos + (xx * along_y - xy * along_x) * sin))
