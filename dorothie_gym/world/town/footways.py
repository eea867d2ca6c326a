"""Where people walk in a town: along pavements, round corners, and over crosswalks."""

from __future__ import annotations

import enum
import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.spatial import cKDTree

from dorothie_gym.world.town.lane_edges import LEVEL, LaneEdges
from dorothie_gym.world.town.model import Array, Crosswalk, Town

KERB_REACH = 7.0
"""The end of a crosswalk is joined to the nearest pavement, no farther away than this [m]."""

SNAP = 3.0
"""A crosswalk that meets a pavement this close to its end meets it there [m]."""

CORNER = 20.0
"""Ends of pavements this close are joined round a corner, if no lane lies between them [m]."""

CORNER_WIDTH = 1.5
"""Width of the ways round corners and from crosswalks to pavements [m]."""

CLEARANCE = 0.2
"""Way round a corner that is kept from the lanes' edges [m]."""


class WayKind(enum.Enum):
    """What a way is."""

    PAVEMENT = "pavement"
    CROSSWALK = "crosswalk"
    CORNER = "corner"


@dataclass(frozen=True, kw_only=True, eq=False)
class Way:
    """A stretch that people walk along, in both directions.

    Attributes:
        kind: what it is.
        ends: nodes at its beginning and end.
        points: its middle line (n, 3) [m].
        stations: distance along it of each point (n,) [m].
        width: [m].
        crosswalk: index in `Town.crosswalks`, or -1.
    """

    kind: WayKind
    ends: tuple[int, int]
    points: Array
    stations: Array
    width: float
    crosswalk: int = -1

    @property
    def length(self) -> float:
        """[m]."""
        return float(self.stations[-1])

    def place(self, station: float) -> tuple[float, float, float]:
        """Point of the middle line at a distance along it (x, y, z) [m]."""
        x, y, z = (float(np.interp(station, self.stations, self.points[:, k])) for k in range(3))
        return x, y, z

    def heading(self, station: float) -> float:
        """Its direction there [rad]."""
        k = min(max(int(np.searchsorted(self.stations, station, side="right")) - 1, 0), len(self.points) - 2)
        dx, dy = self.points[k + 1, :2] - self.points[k, :2]
        return math.atan2(dy, dx)


class Footways:
    """The net of ways of a town.

    Attributes:
        ways: all of them.
        at: by node, the ways that end there.
    """

    def __init__(self, town: Town) -> None:
        self._town = town
        self._nodes: list[tuple[float, float, float]] = []
        self.ways: list[Way] = []
        self._lanes = LaneEdges(town) if town.sidewalks else None
        cuts: defaultdict[int, dict[float, int]] = defaultdict(dict)  # by pavement: nodes at stations
        lines = [(sidewalk.points, _stations(sidewalk.points)) for sidewalk in town.sidewalks]
        for k, (points, stations) in enumerate(lines):
            for station, point in ((0.0, points[0]), (float(stations[-1]), points[-1])):
                cuts[k][station] = self._node(point)
        if lines:
            for crosswalk in town.crosswalks:
                self._lay_crosswalk(crosswalk, lines, cuts)
        for k, (points, stations) in enumerate(lines):
            self._lay_pavement(points, stations, town.sidewalks[k].width, cuts[k])
        self._lay_corners([node for k in range(len(lines)) for node in cuts[k].values()])
        self.at: tuple[tuple[int, ...], ...] = tuple(
            tuple(w for w, way in enumerate(self.ways) if node in way.ends) for node in range(len(self._nodes))
        )

    def _node(self, point: Sequence[float] | Array) -> int:
        self._nodes.append((float(point[0]), float(point[1]), float(point[2])))
        return len(self._nodes) - 1

    def _lay(self, kind: WayKind, ends: tuple[int, int], points: Array, width: float, crosswalk: int = -1) -> None:
        way = Way(
            kind=kind, ends=ends, points=points, stations=_stations(points), width=width, crosswalk=crosswalk
        )  # fmt: skip
        if way.length > 0.1:
            self.ways.append(way)

    def _lay_pavement(self, points: Array, stations: Array, width: float, cuts: dict[float, int]) -> None:
        order = sorted(cuts)
        for start, end in zip(order, order[1:], strict=False):
            inner = (stations > start) & (stations < end)
            at = np.concatenate(([start], stations[inner], [end]))
            line = np.column_stack([np.interp(at, stations, points[:, k]) for k in range(3)])
            self._lay(WayKind.PAVEMENT, (cuts[start], cuts[end]), line, width)

    def _lay_crosswalk(
        self, crosswalk: Crosswalk, lines: Sequence[tuple[Array, Array]], cuts: dict[int, dict[float, int]]
    ) -> None:
        """The crosswalk itself, and ways from its ends to the nearest pavements; none that leads onto a lane."""
        assert self._lanes is not None
        ends, width = axis(crosswalk)
        height = self._lanes.height(ends.mean(axis=0))
        joints = [self._pavement_near(end, height, lines) for end in ends]
        if any(joint is None for joint in joints):
            return
        nodes = []
        for end, joint in zip(ends, joints, strict=True):
            assert joint is not None
            k, station = joint
            points, stations = lines[k]
            if station not in cuts[k]:
                cuts[k][station] = self._node([np.interp(station, stations, points[:, i]) for i in range(3)])
            node = self._node((*end, height))
            foot = cuts[k][station]
            self._lay(WayKind.CORNER, (foot, node), np.array([self._nodes[foot], self._nodes[node]]), CORNER_WIDTH)
            nodes.append(node)
        line = np.array([self._nodes[node] for node in nodes])
        self._lay(WayKind.CROSSWALK, (nodes[0], nodes[1]), line, width, crosswalk.id)

    def _pavement_near(
        self, place: Array, height: float, lines: Sequence[tuple[Array, Array]]
    ) -> tuple[int, float] | None:  # fmt: skip
        """The nearest pavement that is reached without setting foot on a lane: its index, and a station on it [m]."""
        assert self._lanes is not None
        found = []
        for k, (points, stations) in enumerate(lines):
            away, station = _project(points, stations, place)
            if away > KERB_REACH:
                continue
            for end in (0.0, float(stations[-1])):
                if abs(station - end) < SNAP:
                    station = end
            foot = np.array([np.interp(station, stations, points[:, i]) for i in range(3)])
            if abs(foot[2] - height) < LEVEL and self._lanes.is_clear(np.array([place, foot[:2]]), height, 0.0):
                found.append((float(np.hypot(*(foot[:2] - place))), k, station))
        return min(found)[1:] if found else None

    def _lay_corners(self, nodes: list[int]) -> None:
        """Ways between the ends of pavements that meet at a corner."""
        ends = sorted({node for way in self.ways for node in way.ends if way.kind is WayKind.PAVEMENT} & set(nodes))
        if len(ends) < 2 or self._lanes is None:
            return
        places = np.array([self._nodes[node] for node in ends])
        joined = {way.ends for way in self.ways}
        for i, j in sorted(cKDTree(places[:, :2]).query_pairs(CORNER)):
            pair = ends[i], ends[j]
            if abs(places[i, 2] - places[j, 2]) > LEVEL or pair in joined or pair[::-1] in joined:
                continue
            if self._lanes.is_clear(places[[i, j], :2], float(places[i, 2]), CLEARANCE):
                self._lay(WayKind.CORNER, pair, places[[i, j]], CORNER_WIDTH)


def axis(crosswalk: Crosswalk) -> tuple[Array, float]:
    """The middles of the two ends of a crosswalk, across the road, (2, 2), and its width [m].

    A crosswalk is longer than it is wide, so it runs along the longer axis of its outline.
    """
    middle = crosswalk.outline.mean(axis=0)
    _, _, directions = np.linalg.svd(crosswalk.outline - middle)
    along, across = ((crosswalk.outline - middle) @ direction for direction in directions)
    ends = middle + np.array([[along.min()], [along.max()]]) * directions[0]
    return ends, float(across.max() - across.min())


def _stations(points: Array) -> Array:
    return np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(points[:, :2], axis=0).T))))


def _project(points: Array, stations: Array, place: Array) -> tuple[float, float]:
    """Distance of a place from a line, and the station of the nearest point on it [m]."""
    a, d = points[:-1, :2], np.diff(points[:, :2], axis=0)
    squares = np.maximum(np.einsum("ij,ij->i", d, d), 1e-12)
    t = np.clip(np.einsum("ij,ij->i", place - a, d) / squares, 0.0, 1.0)
    away = np.hypot(*(place - (a + t[:, None] * d)).T)
    k = int(np.argmin(away))
    return float(away[k]), float(stations[k] + t[k] * (stations[k + 1] - stations[k]))


@lru_cache(maxsize=16)
def footways(town: Town) -> Footways:
    """The footways of a town, made once."""
    return Footways(town)
