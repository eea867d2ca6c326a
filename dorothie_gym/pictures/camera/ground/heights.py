"""Height of the ground: at the lanes' heights on roads, with banks and slopes down or up to the land between them."""

from __future__ import annotations

import enum
from collections.abc import Iterable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree
from shapely.geometry.base import BaseGeometry

from dorothie_gym.pictures.maps.shapes import SAMPLE_STEP, TownSamples, polyline_stations
from dorothie_gym.support import portable_arrays as pn

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array
    from dorothie_gym.maps.town import Town
    from dorothie_gym.pictures.maps.levels import LevelStretch

_FLAT = 1e-3  # [m] difference of height in a town without hills
_STEEPEST = 0.12  # slope of the land: steeper roads are on banks
_BANK = 1.0  # slope of banks below a road that is higher than the land
_CUTTING = 1.8  # slope of the sides of a cutting, as the map draws them
_SHOULDER = 0.3  # [m] of level ground beside the lanes of a road on a bank or in a cutting
_LEVEL = 4.5  # [m] of level ground beside other roads: their pavements
_BESIDE = 0.5  # [m] further from the edge of a lane than from the nearest one; its height counts as well
_ALIKE = 1.0  # [m] between road and land at which the level ground is narrow
_APART = 0.25  # [m] of height between a pavement and the land from which it is a bench
_WIDEST_VERGE = 7.0  # [m] from a road to the centre of its pavement
_OWN_ROAD = 1.5  # [m] of height between a pavement and the road beside it, at most
_NEAREST = 24  # samples of lanes that are considered at a point
_AROUND = 12  # samples of the land that are considered at a point
_THIN = 4  # every such sample gives the height of the land
_AHEAD = 6.0  # [m] along a lane over which a sample's slope is extrapolated


class Zone(enum.IntEnum):
    """Lanes that give the height."""

    OPEN = 0
    """All but those on bridges and in tunnels."""
    COVER = 1
    """Above tunnels: those on the land."""


class HeightField:
    """Heights of the ground of a town.

    Attributes:
        flat: whether all lanes are equally high.
    """

    def __init__(self, town: Town, stretches: Iterable[LevelStretch]) -> None:
        """Collects the lanes of all zones.

        Args:
            town: the town.
            stretches: its bridges and tunnels.
        """
        samples = TownSamples.of(town)
        z = samples.centre[:, 2]
        self.flat = bool(np.ptp(z) < _FLAT)
        self._base = float(np.median(z))
        if self.flat:
            return
        level = np.zeros(len(z), dtype=np.int64)
        for part in stretches:
            a, b = samples.bounds[part.lane]
            inside = (samples.station[a:b] >= part.start) & (samples.station[a:b] <= part.end)
            level[a:b][inside] = part.level
        sunken = (z < -0.05) if (level < 0).any() else np.zeros(len(z), dtype=bool)
        self._lanes = {
            Zone.OPEN: _Lanes(samples, level == 0),
            Zone.COVER: _Lanes(samples, (level == 0) & ~sunken),
        }
        walks = _sidewalk_samples(town)
        away, beside = (np.asarray(row) for row in cKDTree(samples.centre).query(walks.centre))
        # level from the road to the pavement, and equally far on its other side
        verge = np.clip(away - samples.half_width[beside], 0.0, _WIDEST_VERGE)
        walks = replace(walks, half_width=np.maximum(walks.half_width, verge))
        # those in tunnels count before the mouths; above, only lanes do
        self._walks = _Lanes(walks, (level[beside] <= 0) & (np.abs(z[beside] - walks.centre[:, 2]) < _OWN_ROAD))
        self._apart = {k: _Lanes(samples, level == k) for k in np.unique(level[level != 0]).tolist()}
        # the land below raised roads rises no more steeply than roads do, and it is as it was below bridges
        land = np.flatnonzero(~sunken & (level <= 0))[::_THIN]
        place, height = samples.centre[land, :2], z[land].copy()
        reach = float(np.ptp(height)) / _STEEPEST
        tree = cKDTree(place)
        for start in range(0, len(land), 512):
            near = tree.query_ball_point(place[start : start + 512], reach, return_sorted=True)
            for k, rows in enumerate(near, start):
                away = pn.hypot(*(place[rows] - place[k]).T)
                height[k] = min(height[k], float((z[land[rows]] + _STEEPEST * away).min()))
        self._land, self._land_height = tree, height

    def land(self, points: ArrayLike) -> Array:
        """Returns the height of the land (n,) at positions (n, 2) [m], without roads on banks or in cuttings."""
        places = np.asarray(points, dtype=np.float64)
        if self.flat:
            return np.full(len(places), self._base)
        count = min(_AROUND, len(self._land_height))
        away, index = (np.reshape(row, (len(places), count)) for row in self._land.query(places, k=count))
        # weights fall to zero at the farthest one, so that the height has no steps
        weight = np.maximum(away[:, -1:] - away, 1e-9) ** 2 / ((away + 1.0) * (away + 1.0) * (away + 1.0))
        return np.asarray((weight * self._land_height[index]).sum(axis=1) / weight.sum(axis=1))

    def benches(self) -> tuple[BaseGeometry, BaseGeometry]:
        """Returns the area of pavements that are higher or lower than the land, and this area with their banks."""
        empty = shapely.MultiPolygon()
        if self.flat or not self._walks.count:
            return empty, empty
        centre = self._walks.centre
        beside = centre[:, 2] - self.land(centre[:, :2])
        apart = np.abs(beside) > _APART
        bank = np.abs(beside) / np.where(beside > 0.0, _BANK, _CUTTING)
        strips = (
            self._walks.strips(apart, np.full(len(centre), _SHOULDER)),
            self._walks.strips(apart, _SHOULDER + bank),
        )
        return shapely.union_all(strips[0]), shapely.union_all(strips[1])

    def road(self, points: ArrayLike, level: int) -> Array:
        """Returns the height (n,) of bridges of a level, or of tunnels (-1), at positions (n, 2) on them [m]."""
        places = np.asarray(points, dtype=np.float64)
        if self.flat:
            return np.full(len(places), self._base)
        return _nearest(*self._apart[level].near(places))

    def ground(self, points: ArrayLike, zone: Zone = Zone.OPEN, built: NDArray[np.bool_] | bool = False) -> Array:
        """Returns the height (n,) of the ground at positions (n, 2) [m], kerbs left out.

        Args:
            points: positions.
            zone: lanes that count.
            built: whether the places belong to a road (n,): asphalt and medians have no banks.
        """
        places = np.asarray(points, dtype=np.float64)
        land = self.land(places)
        if self.flat or not self._lanes[zone].count:
            return land
        edge, height, away = self._lanes[zone].near(places)
        road = _nearest(edge, height, away)
        if zone is Zone.OPEN and self._walks.count:
            pavement = self._walks.near(places)
            edge, height = (np.concatenate(rows, axis=1) for rows in zip((edge, height), pavement[:2], strict=True))
        beside = height - land[:, None]
        level = _SHOULDER + (_LEVEL - _SHOULDER) * (1.0 - np.clip(np.abs(beside) / _ALIKE, 0.0, 1.0))
        room = np.maximum(0.0, edge - level)
        low = height - np.where(beside > 0.0, _BANK, _CUTTING) * room
        high = height + np.where(beside > 0.0, _BANK, _CUTTING) * room
        rows = np.arange(len(places))
        lowest, highest = high.argmin(axis=1), low.argmax(axis=1)
        upper, lower = high[rows, lowest], low[rows, highest]
        free = np.clip(land, lower, np.maximum(lower, upper))
        # between a low and a high road that are close to each other
        a, b = edge[rows, lowest], edge[rows, highest]
        share = np.where(a + b > 1e-9, a / np.maximum(a + b, 1e-9), 0.5)
        banks = np.where(lower <= upper, free, upper + share * (lower - upper))
        return np.asarray(np.where(built, road, banks))


def _nearest(edge: Array, height: Array, away: Array) -> Array:
    """Returns the height (n,) of the nearest lane; arguments as from `_Lanes.near`."""
    weight = (edge <= edge.min(axis=1, keepdims=True) + _BESIDE) / np.square(np.square(away + 0.05))
    return np.asarray((weight * height).sum(axis=1) / weight.sum(axis=1))


def _sidewalk_samples(town: Town) -> TownSamples:
    """Samples the pavements of a town as if they were lanes."""
    columns: list[list[Array]] = [[np.zeros(0)], [np.zeros(0)], [np.zeros(0)], [np.zeros((0, 3))]]
    owners, bounds, count = [np.zeros(0, dtype=np.int64)], [(0, 0)], 0
    for walk in town.sidewalks:
        stations = polyline_stations(walk.points[:, :2])
        s = np.linspace(0.0, stations[-1], max(2, int(np.ceil(stations[-1] / SAMPLE_STEP)) + 1))
        centre = np.column_stack([np.interp(s, stations, column) for column in walk.points.T])
        heading = pn.arctan2(*np.gradient(centre[:, :2], axis=0).T[::-1])
        half = np.full(len(s), walk.width / 2.0)
        for column, value in zip(columns, (s, heading, half, centre), strict=True):
            column.append(value)
        owners.append(np.full(len(s), walk.id, dtype=np.int64))
        bounds.append((count, count + len(s)))
        count += len(s)
    station, heading, half, centre = (np.concatenate(column) for column in columns)
    return TownSamples(np.concatenate(owners), station, heading, half, centre, np.array(bounds, dtype=np.int64))


class _Lanes:
    """Samples of lanes or pavements with their slopes."""

    def __init__(self, samples: TownSamples, keep: NDArray[np.bool_]) -> None:
        slope = np.zeros(len(keep))
        for a, b in samples.bounds.tolist():
            if b - a > 1:
                slope[a:b] = np.gradient(samples.centre[a:b, 2], samples.station[a:b])
        self.count = int(keep.sum())
        self.centre, self._half = samples.centre[keep], samples.half_width[keep]
        self._slope, self._heading = slope[keep], samples.heading[keep]
        rows = np.flatnonzero(keep)
        follows = (np.diff(rows) == 1) & (np.diff(samples.lane[rows]) == 0)
        self._followed = np.append(follows, np.zeros(min(1, len(rows)), dtype=bool))
        self._tree = cKDTree(self.centre[:, :2])

    def strips(self, chosen: NDArray[np.bool_], margins: Array) -> NDArray[np.object_]:
        """Returns areas (m,) from one chosen sample (n,) to the next one, wider by margins (n,) [m]."""
        aside = (self._half + margins)[:, None] * np.column_stack((-pn.sin(self._heading), pn.cos(self._heading)))
        right, left = self.centre[:, :2] + aside, self.centre[:, :2] - aside
        rows = np.flatnonzero(self._followed[:-1] & chosen[:-1] & chosen[1:])
        corners = np.stack((right[rows], right[rows + 1], left[rows + 1], left[rows]), axis=1)
        return np.asarray(shapely.make_valid(shapely.polygons(corners)), dtype=np.object_)

    def near(self, places: Array) -> tuple[Array, Array, Array]:
        """Returns of the nearest samples (n, k): distance from the lane's edge, height at the places, distance [m]."""
        count = min(_NEAREST, self.count)
        away, index = (np.reshape(row, (len(places), count)) for row in self._tree.query(places, k=count))
        offset = places[:, None] - self.centre[index, :2]
        c, s = pn.cos(self._heading[index]), pn.sin(self._heading[index])
        along, aside = offset[..., 0] * c + offset[..., 1] * s, offset[..., 1] * c - offset[..., 0] * s
        height = self.centre[index, 2] + self._slope[index] * np.clip(along, -_AHEAD, _AHEAD)
        beside = np.maximum(0.0, np.abs(aside) - self._half[index])
        return pn.hypot(beside, np.maximum(0.0, np.abs(along) - SAMPLE_STEP)), height, away
