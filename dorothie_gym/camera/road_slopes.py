"""Slopes of the roads, on which vehicles stand tilted."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.compilation import compiled
from dorothie_gym.compilation.by_reference import by_reference
from dorothie_gym.copying import shared
from dorothie_gym.maps.model import Array
from dorothie_gym.maps.town import Town
from dorothie_gym.rendering.shapes import TownSamples

_CELL = 4.0  # [m]
_LEVEL = 1.5  # [m] of height between a vehicle and its road, at most
_SMALLEST = 1e-3  # slope from which on samples are kept


@by_reference
@shared
class RoadSlopes(NamedTuple):
    """Samples of lanes on slopes, by square cells that are numbered row by row.

    Attributes:
        origin: (2,) first corner of the cells [m].
        shape: (2,) columns and rows of cells.
        firsts: (cells + 1,) int32 first sample of each cell.
        places: (n, 3) positions [m].
        rises: (n, 2) rise per metre along x and y.
    """

    origin: Array
    shape: NDArray[np.int64]
    firsts: NDArray[np.int32]
    places: Array
    rises: Array


def road_slopes(town: Town) -> RoadSlopes:
    """Returns the slopes of all roads of a town; there are no cells where all are level."""
    samples = TownSamples.of(town)
    slope = np.zeros(len(samples.station))
    for a, b in samples.bounds.tolist():
        if b - a > 1:
            slope[a:b] = np.gradient(samples.centre[a:b, 2], samples.station[a:b])
    keep = np.full(len(slope), bool((np.abs(slope) > _SMALLEST).any()))  # level ones as well: beside a slope, say
    places = samples.centre[keep]
    rises = slope[keep, None] * np.column_stack((np.cos(samples.heading[keep]), np.sin(samples.heading[keep])))
    if not len(places):
        empty = np.zeros(1, dtype=np.int32)
        return RoadSlopes(np.zeros(2), np.zeros(2, dtype=np.int64), empty, np.zeros((0, 3)), np.zeros((0, 2)))
    origin = places[:, :2].min(axis=0) - _CELL
    column, row = np.floor((places[:, :2] - origin) / _CELL).astype(np.int64).T
    shape = np.array([column.max() + 2, row.max() + 2])
    cell = row * shape[0] + column
    order = np.argsort(cell, kind="stable")
    firsts = np.searchsorted(cell[order], np.arange(shape.prod() + 1)).astype(np.int32)
    return RoadSlopes(origin, shape, firsts, np.ascontiguousarray(places[order]), np.ascontiguousarray(rises[order]))


@compiled
def rise_at(slopes: RoadSlopes, x: float, y: float, z: float, cos: float, sin: float) -> float:
    """Returns the rise per metre of the road at a position [m] in a direction, 0 beside the roads."""
    if slopes.shape[0] == 0:
        return 0.0
    column, row = int(np.floor((x - slopes.origin[0]) / _CELL)), int(np.floor((y - slopes.origin[1]) / _CELL))
    best, nearest = -1, np.inf
    for j in range(max(row - 1, 0), min(row + 2, slopes.shape[1])):
        for i in range(max(column - 1, 0), min(column + 2, slopes.shape[0])):
            cell = j * slopes.shape[0] + i
            for k in range(slopes.firsts[cell], slopes.firsts[cell + 1]):
                away = (slopes.places[k, 0] - x) ** 2 + (slopes.places[k, 1] - y) ** 2
                if away < nearest and abs(slopes.places[k, 2] - z) < _LEVEL:
                    best, nearest = k, away
    return float(slopes.rises[best, 0] * cos + slopes.rises[best, 1] * sin) if best >= 0 else 0.0
