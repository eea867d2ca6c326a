"""Road markings: lines, stop lines, yield triangles, crosswalks and arrows."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.maps.model import Array, Lane, LinkType, SignalKind
from dorothie_gym.pictures import palette
from dorothie_gym.pictures.maps.borders import Border, BorderKind, Borders
from dorothie_gym.pictures.maps.shapes import Shape, cut, dash_pattern, place, stroke, zebra
from dorothie_gym.support import portable_arrays as pn

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.pictures.palette import Colour

ARROW_LENGTH = 6.0
"""Length of a turn arrow [m]."""

TURNS = (LinkType.STRAIGHT, LinkType.LEFT, LinkType.RIGHT, LinkType.U_TURN)
"""Turn types that an arrow can show, in the order of drawing."""

_BEFORE_LINE = 2.0  # [m] between the tip of an arrow and the stop line
_SHORTEST_LANE = 7.5  # [m]
_ONE_WAY_SPACING = 45.0  # [m]
_ONE_WAY_SHORTEST = 14.0  # [m]
_MIRROR = np.array([1.0, -1.0])


def _bend(radius: float, start: float, turn: float) -> Array:
    """Returns a shaft that runs straight to `start` [m] and then turns left on an arc."""
    angle = np.linspace(0.0, turn, 7)
    arc = np.stack((start + radius * pn.sin(angle), -radius * (1.0 - pn.cos(angle))), axis=-1)
    return np.concatenate(([[0.0, 0.0]], arc))


def _head(tip: Array, direction: float, length: float, width: float) -> Array:
    """Returns a triangle with its base centred on a point, rotated left by an angle [rad]."""
    c, s = pn.cos(direction), -pn.sin(direction)
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
    """Returns the outlines [m] of an arrow with the given turn types; its tail is at the origin."""
    out = []
    for kind in kinds:
        base = LinkType.LEFT if kind is LinkType.RIGHT else kind
        shaft, head = _SHAFTS[base], _HEADS[base]
        if kind is LinkType.RIGHT:
            shaft, head = shaft * _MIRROR, head * _MIRROR
        out += [place(stroke(shaft, pen), origin, heading), place(head, origin, heading)]
    return out


def one_way_arrow(origin: Array, heading: float, length: float = 7.0) -> list[Array]:
    """Returns the outlines [m] of a slim arrow along a one-way street, centred on the origin."""
    half = length / 2.0
    shaft = np.array([[-half, -0.16], [half - 1.4, -0.16], [half - 1.4, 0.16], [-half, 0.16]])
    head = np.array([[half - 1.8, -0.75], [half, 0.0], [half - 1.8, 0.75], [half - 1.4, 0.0]])
    return [place(shaft, origin, heading), place(head, origin, heading)]


@dataclass(frozen=True)
class LaneArrow:
    """Turn arrow: lane whose exits it shows, turn types, and lane and station [m] of its tail."""

    shows: int
    turns: tuple[LinkType, ...]
    lane: int
    station: float


def lane_arrows(town: Town, shared: Iterable[int], stops: Mapping[int, float]) -> Iterator[LaneArrow]:
    """Yields the arrows before junctions.

    A lane has an arrow if it has an exit that turns, or if there are parallel lanes to choose from.

    Args:
        town: town to paint.
        shared: lanes with a parallel lane in the same direction.
        stops: station of the (possible) stop line of each lane [m].
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
    """Returns lane and station of the tail of an arrow, on the only predecessor if the lane is short, or None."""
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
    """Yields lanes and stations [m] of the arrows along one-way streets."""
    for lane in town.lanes:
        innermost, seen = lane.id, {lane.id}
        while (beside := borders.inner_neighbour.get(innermost, innermost)) not in seen:
            seen.add(beside)
            innermost = beside
        if lane.in_junction or innermost in borders.divided or lane.length < _ONE_WAY_SHORTEST:
            continue
        count = max(1, round(lane.length / _ONE_WAY_SPACING))
        yield from ((lane.id, (k + 0.5) / count * lane.length) for k in range(count))


# --- Lines and controls ----------------------------------------------------------------------------------------------

_PIECE = 8.0  # [m] of a solid line per polygon
_DASH, _GAP = 3.0, 4.5  # [m]
_STOP_LINE_BACK = 0.5  # [m] between a stop line and the end of its lane
_BEFORE_CROSSING = 1.0  # [m] between a stop line and a crossing
_LOOK_BACK = 14.0  # [m] at the end of a lane in which a crosswalk moves the stop line


@dataclass(frozen=True)
class MapDetail:
    """Level of detail of a picture.

    Attributes:
        pen: width of the thinnest visible line [m].
        fine: whether edge lines and the gap of double lines are visible.
        arrows: whether arrows are legible.
    """

    pen: float
    fine: bool
    arrows: bool

    @classmethod
    def at(cls, scale: float) -> MapDetail:
        """Returns the level of detail for a scale [px/m]."""
        return cls(pen=0.8 / scale, fine=scale >= 4.0, arrows=scale >= 2.0)


def lines(borders: Iterable[Border], detail: MapDetail) -> Iterator[Shape]:
    """Yields dashes between lanes of one direction, double lines between directions, solid lines at the edges."""
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
    total = float(pn.hypot(*np.diff(line[:, :2], axis=0).T).sum())
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
    total = float(pn.hypot(*np.diff(line, axis=0).T).sum())
    ends = np.linspace(0.0, total, max(2, round(total / _PIECE) + 1))
    for piece in cut(full, list(zip(ends[:-1].tolist(), ends[1:].tolist(), strict=True))):
        yield Shape(stroke(piece[:, :2], width), colour, float(piece[:, 2].mean()))


def ruled_lanes(town: Town) -> dict[int, SignalKind]:
    """Returns the control at the end of each lane that has one: a light, else a stop sign, else a yield sign."""
    ruled: dict[int, SignalKind] = {}
    for kind in (SignalKind.YIELD, SignalKind.STOP, SignalKind.TRAFFIC_LIGHT):
        for signal in town.signals:
            if signal.kind is kind:
                ruled |= {lane: kind for lane in signal.lanes if not town.lanes[lane].in_junction}
    return dict(sorted(ruled.items()))


def stop_stations(town: Town) -> dict[int, float]:
    """Returns the station of the (possible) stop line of lanes before junctions [m], in front of any crosswalk."""
    outlines = [crossing.outline for crossing in town.crosswalks]
    low = np.array([outline.min(axis=0) for outline in outlines]).reshape(-1, 2) - _LOOK_BACK
    high = np.array([outline.max(axis=0) for outline in outlines]).reshape(-1, 2) + _LOOK_BACK
    found = {}
    for lane in town.lanes:
        if lane.in_junction or not any(e.junction_id >= 0 for e in town.exits(lane.id)):
            continue
        station = lane.length - min(_STOP_LINE_BACK, lane.length / 4.0)
        end = lane.points[-1, :2]
        near = np.flatnonzero(((end >= low) & (end <= high)).all(axis=1)).tolist()
        found[lane.id] = min([station, *(_before(lane, outlines[k]) for k in near)])
    return found


def _before(lane: Lane, outline: Array) -> float:
    """Returns the stop position before a crosswalk over the last metres of a lane [m]; infinite without one."""
    for s in np.arange(max(0.0, lane.length - _LOOK_BACK), lane.length, 0.5).tolist():
        if _inside(lane.position(s), outline):
            return max(1.0, float(s) - _BEFORE_CROSSING)
    return math.inf


def _inside(point: Array, outline: Array) -> bool:
    """Returns whether a point (2,) lies in a polygon (n, 2), by the even-odd rule."""
    a, b = outline, np.roll(outline, -1, axis=0)
    crosses = (a[:, 1] > point[1]) != (b[:, 1] > point[1])
    rise = np.where(crosses, b[:, 1] - a[:, 1], 1.0)
    return bool((crosses & (a[:, 0] + (point[1] - a[:, 1]) / rise * (b[:, 0] - a[:, 0]) > point[0])).sum() % 2)


def stop_bar(lane: Lane, station: float, pen: float) -> Array:
    """Returns the outline (n, 2) [m] of a stop line across a lane."""
    half = lane.width_at(station) / 2.0 - 0.2
    return stroke(np.array([lane.position(station, -half), lane.position(station, half)]), max(0.5, pen))


def yield_triangles(lane: Lane, station: float) -> Iterator[Array]:
    """Yields the outlines (3, 2) [m] of yield triangles across a lane, which point at approaching traffic."""
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
    """Yields stop lines at lights and stop signs, and triangles at yield signs."""
    for k, kind in ruled.items():
        lane = town.lanes[k]
        station = stops.get(k, lane.length - _STOP_LINE_BACK)
        height = lane.height_at(station)
        if kind is SignalKind.YIELD:
            for triangle in yield_triangles(lane, station):
                yield Shape(triangle, palette.STOP_LINE, height)
        else:
            yield Shape(stop_bar(lane, station, pen), palette.STOP_LINE, height)


def crossings(town: Town) -> Iterator[Shape]:
    """Yields the bars of the crosswalks."""
    for crossing in town.crosswalks:
        for bar in zebra(crossing.outline):
            yield Shape(bar, palette.ZEBRA)


def painted_arrows(town: Town, arrows: Sequence[LaneArrow], pen: float) -> Iterator[Shape]:
    """Yields the turn arrows."""
    for arrow in arrows:
        lane = town.lanes[arrow.lane]
        at, heading = lane.position(arrow.station), lane.heading_at(arrow.station + ARROW_LENGTH / 2.0)
        height = lane.height_at(arrow.station)
        for outline in turn_arrow(arrow.turns, at, heading, max(0.42, pen)):
            yield Shape(outline, palette.ARROW, height)
