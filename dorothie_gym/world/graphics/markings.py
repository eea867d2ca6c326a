"""What is painted on the road: lines, stop lines, yield triangles, crossings and arrows."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from dorothie_gym.world.graphics import palette
from dorothie_gym.world.graphics.arrows import ARROW_LENGTH, LaneArrow, turn_arrow
from dorothie_gym.world.graphics.borders import Border, BorderKind
from dorothie_gym.world.graphics.palette import Colour
from dorothie_gym.world.graphics.shapes import Shape, cut, dash_pattern, stroke, zebra
from dorothie_gym.world.town.model import Array, Lane, SignalKind, Town

_PIECE = 8.0  # [m] of a solid line in one piece
_DASH, _GAP = 3.0, 4.5  # [m]
_BACK = 0.5  # [m] between a stop line and the end of its lane
_BEFORE_CROSSING = 1.0  # [m] between a stop line and a crossing
_LOOK_BACK = 14.0  # [m] of a lane's end in which a crossing moves the stop line


@dataclass(frozen=True)
class Detail:
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
    def at(cls, scale: float) -> Detail:
        """For a picture of a scale [px/m]."""
        return cls(pen=0.8 / scale, fine=scale >= 4.0, arrows=scale >= 2.0)


def lines(borders: Iterable[Border], detail: Detail) -> Iterator[Shape]:
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


def _centre(border: Border, detail: Detail) -> Iterator[Shape]:
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
