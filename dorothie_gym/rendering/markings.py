"""What is painted on the road: lines, stop lines, yield triangles, crossings and arrows."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from dorothie_gym.maps.model import Array, Lane, LinkType, SignalKind
from dorothie_gym.maps.town import Town
from dorothie_gym.rendering import palette
from dorothie_gym.rendering.borders import Border, BorderKind, Borders
from dorothie_gym.rendering.palette import Colour
from dorothie_gym.rendering.shapes import Shape, cut, dash_pattern, place, stroke, zebra

ARROW_LENGTH = 6.0
"""Length of a turn arrow [m]."""

TURNS = (LinkType.STRAIGHT, LinkType.LEFT, LinkType.RIGHT, LinkType.U_TURN)
"""Ways on that an arrow can show, in the order in which they are drawn."""

_BEFORE_LINE = 2.0  # [m] between an arrow's tip and the stop line
_SHORTEST_LANE = 7.5  # [m]
_ONE_WAY_SPACING = 45.0  # [m]
_ONE_WAY_SHORTEST = 14.0  # [m]
_MIRROR = np.array([1.0, -1.0])


def _bend(radius: float, start: float, turn: float) -> Array:
    """A shaft that goes on straight to `start` [m] and then turns left on an arc."""
    angle = np.linspace(0.0, turn, 7)
    arc = np.stack((start + radius * np.sin(angle), -radius * (1.0 - np.cos(angle))), axis=-1)
    return np.concatenate(([[0.0, 0.0]], arc))


def _head(tip: Array, direction: float, length: float, width: float) -> Array:
    """A triangle whose base is centred on a point, pointing left by an angle [rad]."""
    c, s = np.cos(direction), -np.sin(direction)
    forward, side = np.array([c, s]), np.array([-s, c])
    return np.stack((tip - side * width / 2.0, tip + forward * length, tip + side * width / 2.0))


_SHAFTS = {
    LinkType.STRAIGHT: np.array([[0.0, 0.0], [4.3, 0.0]]),
    LinkType.LEFT: _bend(0.75, 2.3, 1.25),
    LinkType.U_TURN: np.concatenate((_bend(0.5, 3.2, np.pi), [[2.6, -1.0]])),
}
_HEADS = {
    LinkType.STRAIGHT: _head(np.array([4.1, 0.0]), 0.0, 1.9, 1.4),
    LinkType.LEFT: _head(_SHAFTS[LinkType.LEFT][-1], 1.45, 1.05, 1.75),
    LinkType.U_TURN: _head(np.array([2.7, -1.0]), np.pi, 1.5, 1.15),
}


def turn_arrow(kinds: Iterable[LinkType], origin: Array, heading: float, pen: float = 0.42) -> list[Array]:
    """Outlines [m] of the arrow painted on a lane that may be left in these ways; its tail is at the origin."""
    out = []
    for kind in kinds:
        base = LinkType.LEFT if kind is LinkType.RIGHT else kind
        shaft, head = _SHAFTS[base], _HEADS[base]
        if kind is LinkType.RIGHT:
            shaft, head = shaft * _MIRROR, head * _MIRROR
        out += [place(stroke(shaft, pen), origin, heading), place(head, origin, heading)]
    return out


def one_way_arrow(origin: Array, heading: float, length: float = 7.0) -> list[Array]:
    """Outlines [m] of a slim arrow along a one-way street, centred on the origin."""
    half = length / 2.0
    shaft = np.array([[-half, -0.16], [half - 1.4, -0.16], [half - 1.4, 0.16], [-half, 0.16]])
    head = np.array([[half - 1.8, -0.75], [half, 0.0], [half - 1.8, 0.75], [half - 1.4, 0.0]])
    return [place(shaft, origin, heading), place(head, origin, heading)]


@dataclass(frozen=True)
class LaneArrow:
    """An arrow as it stands: the lane whose exits it shows, the ways on, and the lane and place [m] of its tail."""

    shows: int
    turns: tuple[LinkType, ...]
    lane: int
    station: float


def lane_arrows(town: Town, shared: Iterable[int], stops: Mapping[int, float]) -> Iterator[LaneArrow]:
    """The arrows before junctions.

    A lane has one if it can be left by a turn, or if drivers have to choose between lanes.

    Args:
        town: whose lanes.
        shared: lanes that have another one in the same direction beside them.
        stops: where the stop lines lie or would lie, by lane [m].
    """
    beside = frozenset(shared)
    for lane in town.lanes:
        exits = [e for e in town.exits(lane.id) if e.junction_id >= 0]
        turns = tuple(kind for kind in TURNS if any(e.type is kind for e in exits))
        if lane.in_junction or not turns or (turns == (LinkType.STRAIGHT,) and lane.id not in beside):
            continue
        if (tail := _back_from(town, lane.id, stops.get(lane.id, lane.length))) is not None:
            yield LaneArrow(lane.id, turns, *tail)


def _back_from(town: Town, lane: int, stop: float) -> tuple[int, float] | None:
    """Where an arrow before a stop line begins: on the lane before it where it is short, if there is just one."""
    station = stop - _BEFORE_LINE - ARROW_LENGTH
    if station >= 0.0:
        return lane, station
    if stop >= _SHORTEST_LANE:
        return lane, stop - _SHORTEST_LANE
    before = town.predecessors(lane)
    if len(before) != 1 or (previous := town.lanes[before[0]]).in_junction:
        return None
    return (previous.id, previous.length + station) if previous.length + station >= 0.0 else None


def one_way_places(town: Town, borders: Borders) -> Iterator[tuple[int, float]]:
    """Lanes and stations [m] of the arrows along streets that have no oncoming traffic beside them."""
    for lane in town.lanes:
        innermost, seen = lane.id, {lane.id}
        while (beside := borders.left_neighbour.get(innermost, innermost)) not in seen:
            seen.add(beside)
            innermost = beside
        if lane.in_junction or innermost in borders.divided or lane.length < _ONE_WAY_SHORTEST:
            continue
        count = max(1, round(lane.length / _ONE_WAY_SPACING))
        yield from ((lane.id, (k + 0.5) / count * lane.length) for k in range(count))


# --- What is painted on the road: lines, stop lines, yield triangles, crossings and arrows ---------------------------

_PIECE = 8.0  # [m] of a solid line in one piece
_DASH, _GAP = 3.0, 4.5  # [m]
_BACK = 0.5  # [m] between a stop line and the end of its lane
_BEFORE_CROSSING = 1.0  # [m] between a stop line and a crossing
_LOOK_BACK = 14.0  # [m] of a lane's end in which a crossing moves the stop line


@dataclass(frozen=True)
class MapDetail:
    """What is worth drawing at a scale.

    Attributes:
        pen: thinnest line that is still seen [m].
        fine: whether edge lines and the gap of double lines can be seen.
        arrows: whether arrows can be read.
    """

    pen: float
    fine: bool
    arrows: bool

    @classmethod
    def at(cls, scale: float) -> MapDetail:
        """For a picture of a scale [px/m]."""
        return cls(pen=0.8 / scale, fine=scale >= 4.0, arrows=scale >= 2.0)


def lines(borders: Iterable[Border], detail: MapDetail) -> Iterator[Shape]:
    """Dashes between lanes of one direction, a double line between the two, solid lines at the edges."""
    for border in borders:
        match border.kind:
            case BorderKind.LANE:
                yield from _dashed(border, max(0.2, detail.pen))
            case BorderKind.CENTRE:
                yield from _centre(border, detail)
            case BorderKind.MEDIAN if detail.fine:
                yield from _solid(border, border.shifted(0.3), max(0.14, detail.pen), palette.CENTRE_LINE)
            case BorderKind.EDGE if detail.fine:
                colour = palette.EDGE_LINE
                yield from _solid(border, border.shifted(0.3), max(0.14, detail.pen), colour)


def _dashed(border: Border, width: float) -> Iterator[Shape]:
    line = np.column_stack((border.points[:, :2], border.points[:, 2]))
    total = float(np.hypot(*np.diff(line[:, :2], axis=0).T).sum())
    for piece in cut(line, dash_pattern(total, _DASH, _GAP)):
        yield Shape(stroke(piece[:, :2], width), palette.LANE_LINE, float(piece[:, 2].mean()))


def _centre(border: Border, detail: MapDetail) -> Iterator[Shape]:
    middle = border.gap / 2.0
    if not detail.fine:
        yield from _solid(border, border.shifted(-middle), max(0.25, detail.pen), palette.CENTRE_LINE)
        return
    for aside in (-0.17, 0.17):
        yield from _solid(border, border.shifted(aside - middle), max(0.14, 0.9 * detail.pen), palette.CENTRE_LINE)


def _solid(border: Border, line: Array, width: float, colour: Colour) -> Iterator[Shape]:
    full = np.column_stack((line, border.points[:, 2]))
    total = float(np.hypot(*np.diff(line, axis=0).T).sum())
    ends = np.linspace(0.0, total, max(2, round(total / _PIECE) + 1))
    for piece in cut(full, list(zip(ends[:-1].tolist(), ends[1:].tolist(), strict=True))):
        yield Shape(stroke(piece[:, :2], width), colour, float(piece[:, 2].mean()))


def ruled_lanes(town: Town) -> dict[int, SignalKind]:
    """By lane, what a driver must heed at its end: a light, else a stop sign, else a yield sign."""
    ruled: dict[int, SignalKind] = {}
    for kind in (SignalKind.YIELD, SignalKind.STOP, SignalKind.TRAFFIC_LIGHT):
        for signal in town.signals:
            if signal.kind is kind:
                ruled |= {lane: kind for lane in signal.lanes if not town.lanes[lane].in_junction}
    return dict(sorted(ruled.items()))


def stop_stations(town: Town) -> dict[int, float]:
    """By lane that leads to a junction, where its stop line is or would be [m]: before a crossing if there is one."""
    outlines = [crossing.outline for crossing in town.crosswalks]
    low = np.array([outline.min(axis=0) for outline in outlines]).reshape(-1, 2) - _LOOK_BACK
    high = np.array([outline.max(axis=0) for outline in outlines]).reshape(-1, 2) + _LOOK_BACK
    found = {}
    for lane in town.lanes:
        if lane.in_junction or not any(e.junction_id >= 0 for e in town.exits(lane.id)):
            continue
        station = lane.length - min(_BACK, lane.length / 4.0)
        end = lane.points[-1, :2]
        near = np.flatnonzero(((end >= low) & (end <= high)).all(axis=1)).tolist()
        found[lane.id] = min([station, *(_before(lane, outlines[k]) for k in near)])
    return found


def _before(lane: Lane, outline: Array) -> float:
    """Where to stop before a crossing that lies over the lane's last metres [m]; infinite where none does."""
    for s in np.arange(max(0.0, lane.length - _LOOK_BACK), lane.length, 0.5).tolist():
        if _inside(lane.position(s), outline):
            return max(1.0, float(s) - _BEFORE_CROSSING)
    return math.inf


def _inside(point: Array, outline: Array) -> bool:
    """Whether a point (2,) lies in a polygon (n, 2): an odd number of its sides is to the right of it."""
    a, b = outline, np.roll(outline, -1, axis=0)
    crosses = (a[:, 1] > point[1]) != (b[:, 1] > point[1])
    rise = np.where(crosses, b[:, 1] - a[:, 1], 1.0)
    return bool((crosses & (a[:, 0] + (point[1] - a[:, 1]) / rise * (b[:, 0] - a[:, 0]) > point[0])).sum() % 2)


def stop_bar(lane: Lane, station: float, pen: float) -> Array:
    """Outline (n, 2) [m] of a stop line across a lane."""
    half = lane.width_at(station) / 2.0 - 0.2
    return stroke(np.array([lane.position(station, -half), lane.position(station, half)]), max(0.5, pen))


def yield_triangles(lane: Lane, station: float) -> Iterator[Array]:
    """Outlines (3, 2) [m] of the row of triangles across a lane, pointing at who has to yield."""
    half = lane.width_at(station) / 2.0 - 0.25
    count = max(2, round(2.0 * half / 0.85))
    for middle in ((np.arange(count) + 0.5) / count * 2.0 - 1.0) * half:
        base = 0.72 * half / count
        yield np.array(
            [
                lane.position(station, middle - base),
                lane.position(station, middle + base),
                lane.position(station - 0.9, middle),
            ]
        )


def approaches(town: Town, ruled: Mapping[int, SignalKind], stops: Mapping[int, float], pen: float) -> Iterator[Shape]:
    """Stop lines where there is a light or a stop sign, triangles where one has to yield."""
    for k, kind in ruled.items():
        lane = town.lanes[k]
        station = stops.get(k, lane.length - _BACK)
        height = lane.height_at(station)
        if kind is SignalKind.YIELD:
            for triangle in yield_triangles(lane, station):
                yield Shape(triangle, palette.STOP_LINE, height)
        else:
            yield Shape(stop_bar(lane, station, pen), palette.STOP_LINE, height)


def crossings(town: Town) -> Iterator[Shape]:
    """The bars of the crosswalks."""
    for crossing in town.crosswalks:
        for bar in zebra(crossing.outline):
            yield Shape(bar, palette.ZEBRA)


def painted_arrows(town: Town, arrows: Sequence[LaneArrow], pen: float) -> Iterator[Shape]:
    """The turn arrows as they lie on the road."""
    for arrow in arrows:
        lane = town.lanes[arrow.lane]
        at, heading = lane.position(arrow.station), lane.heading_at(arrow.station + ARROW_LENGTH / 2.0)
        height = lane.height_at(arrow.station)
        for outline in turn_arrow(arrow.turns, at, heading, max(0.42, pen)):
            yield Shape(outline, palette.ARROW, height)
