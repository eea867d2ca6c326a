"""What there is to paint on a map, in world coordinates and in the order of painting."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from dorothie_gym.world.graphics import palette
from dorothie_gym.world.graphics.ground import junction_fillings, landscape
from dorothie_gym.world.graphics.shapes import (
    Shape,
    dashes,
    disc,
    place,
    ribbon,
    sample,
    side_line,
    stroke,
    turn_arrow,
    widths_at,
    zebra,
)
from dorothie_gym.world.town.model import Array, Lane, LinkType, SignalKind, Town

_STEP = 2.0  # [m] between the samples that decide what lies above and beside what
_CLEARANCE = 3.0  # [m] a lane this much higher than another passes over it
_BRIDGE_REACH = 12.0  # [m] of road drawn as a bridge before and after the crossing
_SIDEWALK = 2.2
_KERB = 0.45
_JOINT = 0.15
_PLOT = 5.0


@dataclass(frozen=True, eq=False)
class Samples:
    """All lanes, sampled: lane index (n,), station (n,) [m], heading (n,) [rad], and points (n, 3) [m] on it."""

    lane: NDArray[np.int64]
    station: Array
    heading: Array
    half_width: Array
    centre: Array

    @classmethod
    def of(cls, town: Town) -> Samples:
        """Samples every lane of a town about every two metres."""
        columns: list[list[Array]] = [[], [], [], []]
        owners = []
        for lane in town.lanes:
            s = sample(lane, 0.0, lane.length, _STEP)
            xyz = np.column_stack((side_line(lane, s, 0.0), np.interp(s, lane.stations, lane.points[:, 2])))
            heading = np.interp(s, lane.stations, lane.headings)
            for column, value in zip(columns, (s, heading, widths_at(lane, s) / 2.0, xyz), strict=True):
                column.append(value)
            owners.append(np.full(len(s), lane.id, dtype=np.int64))
        station, heading, half, centre = (np.concatenate(column) for column in columns)
        return cls(np.concatenate(owners), station, heading, half, centre)

    def side(self, sign: float) -> Array:
        """Points (n, 2) [m] on the right (+1) or left (-1) edges."""
        normal = np.stack((-np.sin(self.heading), np.cos(self.heading)), axis=-1)
        return np.asarray(self.centre[:, :2] + sign * self.half_width[:, None] * normal)


def bridges(town: Town, samples: Samples) -> list[tuple[int, int, float, float]]:
    """Stretches of lanes that pass over others: (level from 1 up, lane, start [m], end [m]), lower levels first."""
    pairs = cKDTree(samples.centre[:, :2]).query_pairs(6.0, output_type="ndarray")
    z = samples.centre[:, 2]
    pairs = np.where((z[pairs[:, 0]] <= z[pairs[:, 1]])[:, None], pairs, pairs[:, ::-1])  # lower, upper
    gap = np.hypot(*(samples.centre[pairs[:, 0], :2] - samples.centre[pairs[:, 1], :2]).T)
    reach = samples.half_width[pairs].sum(axis=1)
    pairs = pairs[(z[pairs[:, 1]] - z[pairs[:, 0]] > _CLEARANCE) & (gap < reach)]
    level = np.zeros(len(z), dtype=np.int64)
    for low, high in pairs[np.argsort(z[pairs[:, 1]], kind="stable")].tolist():
        level[high] = max(level[high], level[low] + 1)
    found: list[tuple[int, int, float, float]] = []
    for lane_id in np.unique(samples.lane[level > 0]).tolist():
        lane = town.lanes[lane_id]
        for height in np.unique(level[(samples.lane == lane_id) & (level > 0)]).tolist():
            stations = samples.station[(samples.lane == lane_id) & (level == height)]
            for run in np.split(stations, np.flatnonzero(np.diff(stations) > 2.5 * _BRIDGE_REACH) + 1):
                start, end = max(0.0, run[0] - _BRIDGE_REACH), min(lane.length, run[-1] + _BRIDGE_REACH)
                found.append((height, lane_id, float(start), float(end)))
    return sorted(found)


@dataclass(frozen=True)
class Edge:
    """A stretch of a lane's left (-1) or right (+1) side.

    Attributes:
        lane: index of the lane.
        sign: which side.
        kind: "lane" (same direction beyond it), "centre" (oncoming) or "kerb".
        start, end: stations [m].
        beyond: lane on the other side of it, or -1.
    """

    lane: int
    sign: int
    kind: str
    start: float
    end: float
    beyond: int


def edges(town: Town, samples: Samples) -> list[Edge]:
    """What lies beyond the sides of the lanes outside junctions; a line between two lanes is given once."""
    outside = np.array([not lane.in_junction for lane in town.lanes])[samples.lane]
    if not outside.any():
        return []
    left, right = samples.side(-1.0), samples.side(1.0)
    found = []
    for sign, own, same, oncoming in ((-1, left, right, left), (1, right, left, right)):
        beside = _beyond(samples, outside, own, same, turned=False)
        facing = _beyond(samples, outside, own, oncoming, turned=True)
        for start, end in _runs(samples.lane, outside):
            lane_id = int(samples.lane[start])
            kinds = np.where(beside[start:end] >= 0, 1, np.where(facing[start:end] >= 0, 2, 0))
            for a, b in _constant(kinds):
                kind = ("kerb", "lane", "centre")[kinds[a]]
                if kind == "lane" and sign > 0:
                    continue  # drawn from the other lane, whose left side it is
                if kind == "centre" and facing[start + a] < lane_id:
                    continue
                s = samples.station[start:end]
                beyond = int((beside if kind == "lane" else facing)[start + a]) if kind != "kerb" else -1
                found.append(Edge(lane_id, sign, kind, float(s[a]), float(s[min(b, len(s) - 1)]), beyond))
    return found


def _beyond(samples: Samples, ok: NDArray[np.bool_], own: Array, other: Array, turned: bool) -> NDArray[np.int64]:
    """Lane (n,) whose given edge coincides with one's own, or -1."""
    index = np.flatnonzero(ok)
    near, where = cKDTree(other[index]).query(own, k=6, distance_upper_bound=1.5)
    candidate = index[np.minimum(where, len(index) - 1)]  # (n, 6)
    turn = np.cos(samples.heading[candidate] - samples.heading[:, None])
    fits = np.isfinite(near) & (samples.lane[candidate] != samples.lane[:, None])
    fits &= (turn < -0.9) if turned else (turn > 0.9)
    fits &= np.abs(samples.centre[candidate, 2] - samples.centre[:, 2][:, None]) < _CLEARANCE / 2.0
    first = np.argmax(fits, axis=1)
    return np.where(fits.any(axis=1), samples.lane[candidate[np.arange(len(own)), first]], -1)


def _runs(owner: NDArray[np.int64], ok: NDArray[np.bool_]) -> Iterator[tuple[int, int]]:
    """Index ranges of the samples of each lane that is wanted."""
    cuts = np.concatenate(([0], np.flatnonzero(np.diff(owner)) + 1, [len(owner)])).tolist()
    for start, end in zip(cuts[:-1], cuts[1:], strict=True):
        if ok[start]:
            yield start, end


def _constant(values: NDArray[np.int64]) -> Iterator[tuple[int, int]]:
    """Index ranges in which values do not change."""
    cuts = np.concatenate(([0], np.flatnonzero(np.diff(values)) + 1, [len(values)])).tolist()
    yield from zip(cuts[:-1], cuts[1:], strict=True)


class Plan:
    """Everything on the map but its words.

    Attributes:
        shapes: polygons, in the order of painting.
        edges: what lies beyond the sides of the lanes; labels are set along them.
        bridges: stretches of lanes that pass over others: (level, lane, start [m], end [m]).
    """

    def __init__(self, town: Town, *, pen: float = 0.0, border: float = 6.0) -> None:
        """Works out a town.

        Args:
            town: what to paint.
            pen: thinnest line that is still seen [m].
            border: how far the country reaches beyond the streets [m].
        """
        self.town, self.pen = town, pen
        samples = Samples.of(town)
        self.edges = edges(town, samples)
        self.bridges = raised = bridges(town, samples)
        self.shapes: list[Shape] = [*landscape(town, border), *self._sites()]
        self.shapes += self._streets()
        for level in sorted({row[0] for row in raised}):
            self.shapes += self._bridge([row[1:] for row in raised if row[0] == level])
        self.shapes += self._lights()

    def _streets(self) -> Iterator[Shape]:
        lanes = self.town.lanes
        for margin, colour in ((_SIDEWALK, palette.SIDEWALK), (_KERB, palette.KERB), (0.0, palette.ROAD)):
            for lane in lanes:
                # Connectors a little wider, as for the fillings between them: no slivers of kerb remain inside.
                wider = _JOINT if lane.in_junction and colour is palette.ROAD else 0.0
                yield Shape(ribbon(lane, margin + wider), colour)
                for s in (0.0, lane.length):  # rounded joints
                    yield Shape(disc(lane.position(s), lane.width_at(s) / 2.0 + margin), colour)
            if colour is palette.KERB:
                fillings = junction_fillings(self.town)
        for outline in fillings:
            yield Shape(outline, palette.ROAD)
        for edge in self.edges:
            yield from self._line(edge, edge.start, edge.end)
        for crossing in self.town.crosswalks:
            for bar in zebra(crossing.outline):
                yield Shape(bar, palette.ZEBRA)
        for lane in lanes:
            yield from self._end(lane)

    def _line(self, edge: Edge, start: float, end: float) -> Iterator[Shape]:
        lane = self.town.lanes[edge.lane]
        if edge.kind == "kerb" or end - start < 3.0:
            return
        s = sample(lane, start, end, 3.0)
        line = side_line(lane, s, edge.sign * widths_at(lane, s) / 2.0)
        if edge.kind == "centre":
            yield Shape(stroke(line, max(0.22, self.pen)), palette.CENTRE_LINE)
        else:
            for dash in dashes(line, max(0.2, self.pen), 3.0, 4.0):
                yield Shape(dash, palette.LANE_LINE)

    def _end(self, lane: Lane) -> Iterator[Shape]:
        """The stop line and the arrow at the end of a lane before a junction with a choice."""
        exits = self.town.exits(lane.id)
        turns = {LinkType.LEFT, LinkType.RIGHT, LinkType.U_TURN}
        if lane.in_junction or not any(e.type in turns and e.junction_id >= 0 for e in exits):
            return
        half = lane.width_at(lane.length) / 2.0
        back = min(0.6, lane.length / 4.0)
        bar = np.array([lane.position(lane.length - back, -half + 0.2), lane.position(lane.length - back, half - 0.2)])
        yield Shape(stroke(bar, max(0.4, self.pen)), palette.STOP_LINE)
        tail = lane.length - back - 8.0
        if tail < 2.0:
            return
        kinds = [kind for kind in _ARROW_ORDER if any(e.type is kind for e in exits)]
        for outline in turn_arrow(kinds, lane.position(tail), lane.heading_at(tail), max(0.4, self.pen)):
            yield Shape(outline, palette.ARROW)

    def _bridge(self, stretches: list[tuple[int, float, float]]) -> Iterator[Shape]:
        lanes = self.town.lanes
        layers = ((2.0, 0.0, palette.BRIDGE_SHADOW), (0.9, 0.0, palette.BRIDGE_EDGE), (0.05, 6.0, palette.ROAD))
        for margin, further, colour in layers:
            for k, start, end in stretches:
                # The asphalt goes on further: lanes side by side do not start their bridges at the same place.
                reach = max(0.0, start - further), min(lanes[k].length, end + further)
                yield Shape(ribbon(lanes[k], margin, *reach), colour)
        for k, start, end in stretches:
            for edge in self.edges:
                if edge.lane == k:
                    yield from self._line(edge, max(start - 6.0, edge.start), min(end + 6.0, edge.end))

    def _sites(self) -> Iterator[Shape]:
        """A small plot for each place where a landmark may stand, and the drive that leads to it."""
        for site in self.town.sites:
            middle, door = np.array(site.position), np.array(site.waypoint)
            heading = self.town.lanes[site.lane].heading_at(site.station)
            yield Shape(stroke(np.array([door, middle + 1e-3]), 1.6), palette.SIDEWALK)
            for size, colour in ((_PLOT, palette.PLOT_EDGE), (_PLOT - 0.5, palette.PLOT)):
                corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * size / 2.0
                yield Shape(place(corners, middle, heading), colour)

    def _lights(self) -> Iterator[Shape]:
        size = max(1.0, 2.2 * self.pen)
        for signal in self.town.signals:
            if signal.kind is not SignalKind.TRAFFIC_LIGHT:
                continue
            centre = np.array(signal.position[:2])
            body = np.array([[-0.75, -1.55], [0.75, -1.55], [0.75, 1.55], [-0.75, 1.55]]) * size
            yield Shape(centre + body, palette.LIGHT_BODY)
            lamps = (palette.LIGHT_RED, palette.LIGHT_AMBER, palette.LIGHT_GREEN)
            for k, colour in enumerate(lamps):
                yield Shape(disc(centre + np.array([0.0, (k - 1) * size]), 0.42 * size, 12), colour)


_ARROW_ORDER = (LinkType.STRAIGHT, LinkType.LEFT, LinkType.RIGHT, LinkType.U_TURN)
