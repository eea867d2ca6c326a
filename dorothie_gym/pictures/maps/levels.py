"""Bridges and tunnels: parts of lanes above or below other roads."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from dorothie_gym.pictures.maps.shapes import TownSamples, right_of
from dorothie_gym.support import portable_arrays as pn

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array
    from dorothie_gym.maps.town import Town

BRIDGE_CLEARANCE = 3.0
"""Minimum height of a lane above another one that it crosses [m]."""

_NEAR = 6.0  # [m] within which samples of two lanes that cross are found
_REACH = 12.0  # [m] of road drawn as a bridge before and after a crossing, at least
_FARTHEST = 60.0  # [m] of it at most, while it stays high enough
_COVER = 4.5  # [m] of cover beyond the edges of a street over a tunnel: its pavements
_SKEWEST = 0.3  # sine of the smallest angle between crossing roads
_CUTTING = -1.0  # [m] a lower road lies in a cutting
_LONGEST_CUTTING = 200.0  # [m] on either side
_TUNNEL_DEPTH = -2.0  # [m] a lower road under a street on the ground is a tunnel
_ON_GROUND = 3.0  # [m] a lower street is on the ground


@dataclass(frozen=True)
class LevelStretch:
    """Part of a lane above or below the ground.

    Attributes:
        level: 1 and more for bridges, higher for a bridge over a bridge; -1 for tunnels, which a street on the ground
            covers; 0 for the open cuttings at their ends.
        lane: id of the lane.
        start, end: stations [m].
    """

    level: int
    lane: int
    start: float
    end: float


def stretches(town: Town, samples: TownSamples) -> list[LevelStretch]:
    """Returns the stretches of lanes that are bridges or tunnels, lower levels first."""
    lower, upper = _crossings(samples)
    z = samples.centre[:, 2]
    deep = (z[lower] < _TUNNEL_DEPTH) & (z[upper] < _ON_GROUND)
    found = _raised(town, samples, lower[~deep], upper[~deep])
    for lane, start, end in _merged(_covered(town, samples, lower[deep], upper[deep])):
        found.append(LevelStretch(-1, lane, start, end))
    return sorted(found, key=lambda row: (row.level, row.lane, row.start))


def cuttings(town: Town, tunnels: Iterable[LevelStretch]) -> list[LevelStretch]:
    """Returns the stretches of lanes in open cuttings on both sides of tunnels."""
    pieces: list[tuple[int, float, float]] = []
    for part in tunnels:
        for station, direction in ((part.start, -1.0), (part.end, 1.0)):
            pieces += _walk(town, part.lane, station, direction, _CUTTING, -1.0)
    return [LevelStretch(0, *piece) for piece in _merged(pieces)]


def _crossings(samples: TownSamples) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Returns pairs of samples with the second above the first, as two index arrays (m,)."""
    pairs = cKDTree(samples.centre[:, :2]).query_pairs(_NEAR, output_type="ndarray")
    z = samples.centre[:, 2]
    pairs = np.where((z[pairs[:, 0]] <= z[pairs[:, 1]])[:, None], pairs, pairs[:, ::-1])
    gap = pn.hypot(*(samples.centre[pairs[:, 0], :2] - samples.centre[pairs[:, 1], :2]).T)
    over = (z[pairs[:, 1]] - z[pairs[:, 0]] > BRIDGE_CLEARANCE) & (gap < samples.half_width[pairs].sum(axis=1))
    return pairs[over, 0], pairs[over, 1]


def _raised(town: Town, samples: TownSamples, lower: NDArray[np.int64], upper: NDArray[np.int64]) -> list[LevelStretch]:
    z = samples.centre[:, 2]
    level = np.zeros(len(z), dtype=np.int64)
    order = np.argsort(z[upper], kind="stable")
    for low, high in zip(lower[order].tolist(), upper[order].tolist(), strict=True):
        level[high] = max(level[high], level[low] + 1)
    found = []
    for height in np.unique(level[level > 0]).tolist():
        own = level[upper] == height
        for lane, start, end in _merged(_grown(town, samples, upper[own], z[lower[own]] + BRIDGE_CLEARANCE)):
            found.append(LevelStretch(height, lane, start, end))
    return found


def _covered(
    town: Town, samples: TownSamples, lower: NDArray[np.int64], upper: NDArray[np.int64]
) -> Iterator[tuple[int, float, float]]:
    """Yields the parts under streets as (lane, start, end): exact for straight roads, independent of the sampling."""
    offset = samples.centre[lower, :2] - samples.centre[upper, :2]
    aside = (offset * right_of(samples.heading[upper])).sum(axis=1)
    slope = pn.sin(samples.heading[lower] - samples.heading[upper])  # rate of the lateral offset along the lane
    slope = np.where(slope < 0.0, -1.0, 1.0) * np.maximum(np.abs(slope), _SKEWEST)
    middle = samples.station[lower] - aside / slope
    reach = samples.half_width[upper] / np.abs(slope) + _COVER
    for lane, start, end in zip(samples.lane[lower].tolist(), middle - reach, middle + reach, strict=True):
        length = town.lanes[lane].length
        yield lane, max(0.0, float(start)), min(length, float(end))
        if start < 0.0:
            for before in town.predecessors(lane):
                yield before, max(0.0, town.lanes[before].length + float(start)), town.lanes[before].length
        if end > length:
            for link in town.successors(lane):
                yield link.target, 0.0, min(town.lanes[link.target].length, float(end) - length)


def _grown(town: Town, samples: TownSamples, at: NDArray[np.int64], limit: Array) -> Iterator[tuple[int, float, float]]:
    """Yields the samples of crossings as (lane, start, end), extended along the road while it stays above a limit."""
    for lane in np.unique(samples.lane[at]).tolist():
        own = samples.lane[at] == lane
        stations = samples.station[at[own]]
        bound = float(limit[own].max())
        for run in np.split(np.sort(stations), np.flatnonzero(np.diff(np.sort(stations)) > 2.5 * _REACH) + 1):
            yield from _walk(town, lane, float(run[0]), -1.0, bound, 1.0)
            yield from _walk(town, lane, float(run[-1]), 1.0, bound, 1.0)
            yield lane, float(run[0]), float(run[-1])


def _walk(
    town: Town, lane_id: int, station: float, direction: float, bound: float, sign: float
) -> Iterator[tuple[int, float, float]]:
    """Follows the road from a station, across the ends of lanes, until it descends to a bound (rises if sign < 0)."""
    farthest = _FARTHEST if sign > 0 else _LONGEST_CUTTING
    todo, seen = [(lane_id, station, 0.0)], {lane_id}
    while todo:
        number, begin, gone = todo.pop()
        lane = town.lanes[number]
        room = lane.length - begin if direction > 0 else begin
        steps = np.arange(0.0, min(room, farthest - gone), 1.0)
        heights = np.interp(begin + direction * steps, lane.stations, lane.points[:, 2])
        stop = (sign * (heights - bound) < 0.0) & (gone + steps > (_REACH if sign > 0 else 0.0))
        far = float(steps[int(np.argmax(stop))]) if stop.any() else min(room, farthest - gone)
        end = begin + direction * far
        yield number, min(begin, end), max(begin, end)
        if stop.any() or far < room:
            continue
        beyond = [link.target for link in town.successors(number)] if direction > 0 else town.predecessors(number)
        for k in beyond:
            if k not in seen:
                seen.add(k)
                todo.append((k, 0.0 if direction > 0 else town.lanes[k].length, gone + far))


def _merged(pieces: Iterable[tuple[int, float, float]]) -> Iterator[tuple[int, float, float]]:
    """Yields the stretches with overlapping and almost touching ones merged."""
    last: tuple[int, float, float] | None = None
    for lane, start, end in sorted(pieces):
        if last is not None and last[0] == lane and start <= last[2] + _REACH:
            last = lane, last[1], max(last[2], end)
            continue
        if last is not None:
            yield last
        last = lane, start, end
    if last is not None:
        yield last


class LevelLookup:
    """Lookup of world positions on given stretches of lanes, with heights."""

    def __init__(self, samples: TownSamples, parts: Iterable[LevelStretch], further: float = 0.0) -> None:
        """Builds the lookup; `further` extends each stretch at both ends [m]."""
        keep = np.zeros(len(samples.lane), dtype=bool)
        for part in parts:
            a, b = samples.bounds[part.lane]
            s = samples.station[a:b]
            keep[a:b] |= (s >= part.start - further) & (s <= part.end + further)
        self._centre, self._half = samples.centre[keep], samples.half_width[keep]
        self._tree = cKDTree(self._centre[:, :2]) if len(self._centre) else None

    def hold(self, points: Array) -> NDArray[np.bool_]:
        """Returns which positions (n, 3) [m] lie on the stretches (n,)."""
        if self._tree is None or not len(points):
            return np.zeros(len(points), dtype=bool)
        found = self._tree.query(points[:, :2], k=min(4, len(self._centre)))
        distance, index = (np.reshape(row, (len(points), -1)) for row in found)
        level = np.abs(self._centre[index, 2] - points[:, 2][:, None]) < BRIDGE_CLEARANCE / 2.0
        return np.asarray((level & (distance < self._half[index] + 0.8)).any(axis=1))

    def beside(self, points: Array, within: float) -> NDArray[np.bool_]:
        """Returns which positions (n, 3) [m] lie beside stretches at their height, up to a distance [m] (n,)."""
        if self._tree is None or not len(points):
            return np.zeros(len(points), dtype=bool)
        near = self._tree.query_ball_point(points[:, :2], within)
        level = [
            np.abs(self._centre[k, 2] - z) < BRIDGE_CLEARANCE / 2.0 for k, z in zip(near, points[:, 2], strict=True)
        ]
        return np.array([bool(row.any()) for row in level])

    def cross(self, points: Array, within: float) -> NDArray[np.bool_]:
        """Returns which positions (n, 3) [m] have a stretch at another height within a distance [m] (n,)."""
        if self._tree is None or not len(points):
            return np.zeros(len(points), dtype=bool)
        near = self._tree.query_ball_point(points[:, :2], within)
        return np.array(
            [
                bool((np.abs(self._centre[k, 2] - z) > BRIDGE_CLEARANCE / 2.0).any())
                for k, z in zip(near, points[:, 2], strict=True)
            ]
        )
