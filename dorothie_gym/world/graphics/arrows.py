"""The arrows painted on lanes: where a lane leads at the next junction, and which way a street goes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from dorothie_gym.world.graphics.borders import Borders
from dorothie_gym.world.graphics.shapes import place, stroke
from dorothie_gym.world.town.model import Array, LinkType, Town

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
