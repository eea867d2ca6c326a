"""Right of way at junctions: conflicts between connectors and priority, derived once from lanes and signs.

The model is that of SUMO: each `request` of a junction lists the `foes` of one connection, which conflict with
it, and its `response`, the foes with priority (https://sumo.dlr.de/docs/Networks/SUMO_Road_Networks.html).
Traffic lights are not considered here; see `Town.light`.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.maps.model import LEVEL_HEIGHT, Array, Lane, LaneLink, LinkType, SignalKind
from dorothie_gym.support import portable_arrays as pn

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town

CIRCLE_OFFSET = 1.7
"""Three circles of radius 1.3 m, one in the centre and one this far to either side, cover a car of 5 m x 2 m [m]."""

CLEARANCE = 3.1
"""Distance below which the circles of two vehicles driving straight (almost) touch [m]."""

TURNING_CLEARANCE = 3.9
"""The same if one of them turns: highway-env's steering cuts corners by up to 0.8 m [m]."""

TURN = np.radians(20.0)
"""Smallest change of direction of a turn [rad]."""

FACING = np.radians(45.0)
"""Largest deviation from opposite directions of lanes that face each other [rad]."""

_CONTROLS = (SignalKind.TRAFFIC_LIGHT, SignalKind.STOP, SignalKind.YIELD)  # a light overrides a sign


class RightOfWay:
    """Conflicts and priorities of all connectors of a town; see `right_of_way`.

    Signs count first: traffic from a stop or yield sign waits for traffic without one (roundabout entries have yield
    signs, so they wait for the ring). Among equals, turns across oncoming traffic (left turns, or right turns where
    traffic keeps to the left) and U-turns wait for oncoming traffic that goes straight or turns to its kerb. All others
    are equal and go in order of arrival, as do movements that only pass each other too closely, such as a turn that
    ends beside the lane of oncoming traffic.

    A connector waits only if it has a sign and the other has none, or if it crosses oncoming traffic, the other does
    not, and both have equal signs. This order has no cycles, so no set of connectors waits for each other.
    """

    def __init__(self, town: Town) -> None:
        self._control = _controls(town)
        sources = [set(town.predecessors(lane.id)) for lane in town.lanes]
        connectors: defaultdict[int, list[Lane]] = defaultdict(list)
        for lane in town.lanes:
            if lane.in_junction:
                connectors[lane.junction_id].append(lane)
        foes: defaultdict[int, dict[int, bool]] = defaultdict(dict)  # with whether exact driving would touch
        for group in connectors.values():
            for one, other, touch in _meetings(group):
                follows = one in sources[other] or other in sources[one] or sources[one] & sources[other]
                if not follows:  # vehicles from the same lane drive one behind the other anyway
                    foes[one][other] = foes[other][one] = touch
        self._foes = {connector: tuple(sorted(others)) for connector, others in foes.items()}
        crosses = {number: town.traffic.crosses_oncoming(turn) for number, turn in _turns(town).items()}
        signed = {connector: self._is_signed(sources[connector]) for connector in self._foes}
        self._waits = {
            connector: tuple(
                other
                for other in others
                if foes[connector][other] and _waits(town.lanes[connector], town.lanes[other], crosses, signed)
            )
            for connector, others in self._foes.items()
        }

    def foes(self, connector: int) -> tuple[int, ...]:
        """Returns the connectors of the junction that conflict with a connector for vehicles of 5 m x 2 m.

        Conflicting connectors cross it, merge with it, or begin too close beside it. Connectors from the same lane and
        successive connectors do not conflict: vehicles follow each other there.

        Returns:
            Ids in ascending order; empty for a lane that is not a connector. The relation is symmetric.
        """
        return self._foes.get(connector, ())

    def waits_for(self, connector: int) -> tuple[int, ...]:
        """Returns the foes with priority over a connector, in ascending order of ids."""
        return self._waits.get(connector, ())

    def control(self, lane: int) -> SignalKind | None:
        """Returns the control at the end of a lane: light, stop or yield sign (a light overrides a sign), or None."""
        return self._control.get(lane)

    def _is_signed(self, sources: Iterable[int]) -> bool:
        return any(self.control(source) in (SignalKind.STOP, SignalKind.YIELD) for source in sources)


@lru_cache(maxsize=16)
def right_of_way(town: Town) -> RightOfWay:
    """Returns the right of way of a town; computed once for each town (0.1 s for 500 lanes)."""
    return RightOfWay(town)


def opposition(one: Lane, other: Lane) -> float:
    """Returns the deviation of two lanes from opposite directions at their starts: 0 facing, pi parallel [rad]."""
    return abs(float(other.headings[0] - one.headings[0]) % (2.0 * np.pi) - np.pi)


def turn_into(link: LaneLink, lanes: Sequence[Lane]) -> LinkType:
    """Returns the turn type of a connector: that of the link, or by shape if the link comes from another connector.

    Links carry the turn type where a road enters a junction; adjacent junctions are entered from connectors.
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
    """Returns the turn type of each connector; links from roads take precedence over links from connectors."""
    entering = [k for k in town.links if not k.type.is_lane_change and town.lanes[k.target].in_junction]
    entering.sort(key=lambda link: not town.lanes[link.source].in_junction)
    return {link.target: turn_into(link, town.lanes) for link in entering}


def _waits(one: Lane, other: Lane, crosses: Mapping[int, bool], signed: Mapping[int, bool]) -> bool:
    if signed[one.id] != signed[other.id]:
        return signed[one.id]
    return crosses.get(one.id, False) and not crosses.get(other.id, False) and opposition(one, other) < FACING


def _meetings(lanes: Sequence[Lane]) -> Iterator[tuple[int, int, bool]]:
    """Yields the conflicting pairs of lanes of one junction, each pair once.

    The third entry is True if vehicles touch, and False if they only pass too closely where turns cut corners.
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
        meets = (nearest < clearance) & (np.abs(heights[rest] - heights[k]) <= LEVEL_HEIGHT)
        for other in np.flatnonzero(meets) + k + 1:
            yield lanes[k].id, lanes[int(other)].id, bool(nearest[other - k - 1] < CLEARANCE)


def _gaps(points: Array, others: Array) -> Array:
    """Returns the distance of each point (n, 2) to the nearest of `others` (m, 2): (n,) [m]."""
    east = points[:, None, 0] - others[:, 0]
    south = points[:, None, 1] - others[:, 1]
    gaps: Array = np.sqrt((east * east + south * south).min(axis=1))
    return gaps


def _swept(lane: Lane) -> Array:
    """Returns the centres of the circles that cover a vehicle at each metre of a lane (n, 2) [m]."""
    stations = np.linspace(0.0, lane.length, int(lane.length) + 2)
    headings = np.interp(stations, lane.stations, lane.headings)
    middles = np.column_stack([np.interp(stations, lane.stations, lane.points[:, k]) for k in (0, 1)])
    along = np.column_stack((pn.cos(headings), pn.sin(headings)))
    return np.concatenate([middles + offset * along for offset in (-CIRCLE_OFFSET, 0.0, CIRCLE_OFFSET)])
