"""Who crosses whom at the junctions of a town, and who waits for whom: read off its lanes and signs, once.

The model is that of SUMO's networks, where each `request` of a junction lists for one connection its `foes`, which it
conflicts with, and its `response`, those foes that it gives way to (https://sumo.dlr.de/docs/Networks/SUMO_Road_Networks.html).
Whether a light lets somebody go at all is another matter: `Town.light`.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import lru_cache

import numpy as np

from dorothie_gym.maps.model import Array, Lane, LaneLink, LinkType, SignalKind
from dorothie_gym.maps.town import Town

CIRCLE_OFFSET = 1.7
"""Three circles of radius 1.3 m, one in the middle and one this far to either side, cover a car of 5 m x 2 m [m]."""

CLEARANCE = 3.1
"""Circles of two vehicles that go straight, closer than this, touch or nearly so [m]."""

TURNING_CLEARANCE = 3.9
"""The same where one of them turns: stock steering cuts corners by up to 0.8 m [m]."""

TURN = np.radians(20.0)
"""A connector that changes direction by more than this is a turn [rad]."""

HEIGHT = 2.5
"""Connectors further apart in height do not meet [m]."""

FACING = np.radians(45.0)
"""Lanes that are off from running against each other by less than this face each other [rad]."""

LEFTWARD = (LinkType.LEFT, LinkType.U_TURN)
"""Turns that cross the way of who comes towards one."""

_CONTROLS = (SignalKind.TRAFFIC_LIGHT, SignalKind.STOP, SignalKind.YIELD)  # a light overrules a sign


class RightOfWay:
    """For every connector of a town: which others it meets, and for which of them it waits; see `right_of_way`.

    Priority is by sign first: who comes from a stop or yield sign waits for who does not (a roundabout's entries have
    yield signs, so they wait for its ring). Among equals it is by turn: a left or U-turn waits for those who come
    towards it and go straight on or right. Everybody else is equal, and so are those who only pass one another too near
    for comfort, as a turn does that ends beside the lane of the oncoming: the first to come is the first to go.

    Whoever waits is signed while the other is not, or turns left while the other does not and is signed alike. Both
    only ever lead downwards, so nobody waits for one another, nor do any number of connectors in a circle.
    """

    def __init__(self, town: Town) -> None:
        self._control = _controls(town)
        sources = [set(town.predecessors(lane.id)) for lane in town.lanes]
        connectors: defaultdict[int, list[Lane]] = defaultdict(list)
        for lane in town.lanes:
            if lane.in_junction:
                connectors[lane.junction_id].append(lane)
        foes: defaultdict[int, dict[int, bool]] = defaultdict(dict)  # and whether they touch if both drive exactly
        for group in connectors.values():
            for one, other, touch in _meetings(group):
                follows = one in sources[other] or other in sources[one] or sources[one] & sources[other]
                if not follows:  # who comes from the same lane drives one behind the other anyway
                    foes[one][other] = foes[other][one] = touch
        self._foes = {connector: tuple(sorted(others)) for connector, others in foes.items()}
        turns = _turns(town)
        signed = {connector: self._is_signed(sources[connector]) for connector in self._foes}
        self._waits = {
            connector: tuple(
                other
                for other in others
                if foes[connector][other] and _waits(town.lanes[connector], town.lanes[other], turns, signed)
            )
            for connector, others in self._foes.items()
        }

    def foes(self, connector: int) -> tuple[int, ...]:
        """Connectors of the same junction that cannot be driven at the same time as this one by vehicles of 5 m x 2 m.

        They cross it, join it or begin beside it on a neighbouring lane too near. Those that begin on the same lane, or
        go on from one another, are none: there vehicles follow each other.

        Returns:
            Their ids in ascending order; none for a lane that is no connector. If a is among the foes of b, b is
            among those of a.
        """
        return self._foes.get(connector, ())

    def waits_for(self, connector: int) -> tuple[int, ...]:
        """Those of the foes that have priority over this connector, in ascending order of their ids."""
        return self._waits.get(connector, ())

    def control(self, lane: int) -> SignalKind | None:
        """What a driver has to heed at the end of a lane: light, stop or yield sign (a light overrules a sign)."""
        return self._control.get(lane)

    def _is_signed(self, sources: Iterable[int]) -> bool:
        return any(self.control(source) in (SignalKind.STOP, SignalKind.YIELD) for source in sources)


@lru_cache(maxsize=16)
def right_of_way(town: Town) -> RightOfWay:
    """The right of way in a town, found once (0.1 s for a town of 500 lanes)."""
    return RightOfWay(town)


def opposition(one: Lane, other: Lane) -> float:
    """How far two lanes are, where they begin, from running against each other: 0 where they face, pi abreast [rad]."""
    return abs(float(other.headings[0] - one.headings[0]) % (2.0 * np.pi) - np.pi)


def turn_into(link: LaneLink, lanes: Sequence[Lane]) -> LinkType:
    """The turn that a connector makes for who enters it by a link: the link's type, after another connector its shape.

    Links are typed where a road enters a junction; junctions that abut are entered from one another's connectors.
    """
    if not lanes[link.source].in_junction:
        return link.type
    headings = lanes[link.target].headings
    turned = float(headings[-1] - headings[0])
    if abs(turned) <= TURN:
        return LinkType.STRAIGHT
    return LinkType.RIGHT if turned > 0.0 else LinkType.LEFT


def _controls(town: Town) -> dict[int, SignalKind]:
    found: dict[int, SignalKind] = {}
    for kind in reversed(_CONTROLS):
        found.update({lane: kind for signal in town.signals if signal.kind is kind for lane in signal.lanes})
    return found


def _turns(town: Town) -> dict[int, LinkType]:
    """Turn that each connector makes; one that is entered from roads and connectors alike has it from a road."""
    entering = [k for k in town.links if not k.type.is_lane_change and town.lanes[k.target].in_junction]
    entering.sort(key=lambda link: not town.lanes[link.source].in_junction)
    return {link.target: turn_into(link, town.lanes) for link in entering}


def _waits(one: Lane, other: Lane, turns: Mapping[int, LinkType], signed: Mapping[int, bool]) -> bool:
    if signed[one.id] != signed[other.id]:
        return signed[one.id]
    one_left, other_left = (turns.get(lane.id) in LEFTWARD for lane in (one, other))
    return one_left and not other_left and opposition(one, other) < FACING


def _meetings(lanes: Sequence[Lane]) -> Iterator[tuple[int, int, bool]]:
    """Pairs of ids of lanes of one junction that two vehicles cannot drive at the same time, each pair once.

    The third entry tells those that touch from those that pass, but come too near where turning vehicles cut corners.
    """
    swept = [_swept(lane) for lane in lanes]
    first = np.cumsum([0, *(len(circles) for circles in swept)])  # row at which each lane's circles begin
    circles = np.concatenate(swept)
    heights = np.array([lane.height_at(lane.length / 2) for lane in lanes])
    turning = np.array([abs(lane.headings[-1] - lane.headings[0]) > TURN for lane in lanes])
    for k in range(len(lanes) - 1):
        rest = slice(k + 1, len(lanes))
        gaps = _gaps(circles[first[k + 1] :], swept[k])
        nearest = np.minimum.reduceat(gaps, first[rest] - first[k + 1])
        clearance = np.where(turning[rest] | turning[k], TURNING_CLEARANCE, CLEARANCE)
        meets = (nearest < clearance) & (np.abs(heights[rest] - heights[k]) <= HEIGHT)
        for other in np.flatnonzero(meets) + k + 1:
            yield lanes[k].id, lanes[int(other)].id, bool(nearest[other - k - 1] < CLEARANCE)


def _gaps(points: Array, others: Array) -> Array:
    """For each point (n, 2) the distance to the nearest of some others (m, 2) [m]: (n,)."""
    east = points[:, None, 0] - others[:, 0]
    south = points[:, None, 1] - others[:, 1]
    gaps: Array = np.sqrt((east * east + south * south).min(axis=1))
    return gaps


def _swept(lane: Lane) -> Array:
    """Centres of the circles that cover a vehicle, at every metre of its way along a lane (n, 2) [m]."""
    stations = np.linspace(0.0, lane.length, int(lane.length) + 2)
    headings = np.interp(stations, lane.stations, lane.headings)
    middles = np.column_stack([np.interp(stations, lane.stations, lane.points[:, k]) for k in (0, 1)])
    along = np.column_stack((np.cos(headings), np.sin(headings)))
    return np.concatenate([middles + offset * along for offset in (-CIRCLE_OFFSET, 0.0, CIRCLE_OFFSET)])
