"""Who may cross a junction: one vehicle at a time on paths that cross (until lights and priorities rule them).

Stock IDM vehicles do not see each other across a junction. Here each asks before it enters; it is let in when nobody
holds a connector that crosses its own, nobody asked for one before, and there is room behind the junction.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import cdist

from dorothie_gym.world.town.model import Array, Lane, Town

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

PATIENCE = 3.0
"""Who holds a connector and stands before it for this long loses it [s]."""

LAPSE = 1.0
"""Who holds a connector without asking for it any more (it goes elsewhere) loses it after this long [s]."""


@dataclass
class _Claim:
    """A connector that a vehicle holds or waits for.

    Attributes:
        connector: the lane.
        since: when the vehicle began to wait, or to stand before it [s].
        asked: when it asked last [s].
        entered: whether it is on it.
    """

    connector: int
    since: float
    asked: float
    entered: bool = False


class JunctionControl:
    """Grants the connectors of all junctions of a town, first come, first served."""

    def __init__(self, town: Town) -> None:
        self._town = town
        self._crossing: dict[tuple[int, int], bool] = {}
        self._held: dict[int, list[_Claim]] = {}
        self._waiting: dict[int, _Claim] = {}
        self._closed: dict[int, tuple[int, float]] = {}  # junction: who closed it, and when it asked last

    def close(self, key: int, junction: int, now: float) -> bool:
        """Asks for a whole junction, to turn round in its mouth; to be repeated as long as it is needed.

        Args:
            key: tells the vehicle apart.
            junction: id of the junction.
            now: simulated time [s].

        Returns:
            Whether it is empty; then nobody else is let in while this is repeated.
        """
        self._closed[junction] = (key, now)
        return not any(
            self._junction(claim.connector) == junction
            for other, claims in self._held.items()
            if other != key
            for claim in claims
        )

    def _is_closed_to(self, key: int, junction: int, now: float) -> bool:
        closed = self._closed.get(junction)
        return closed is not None and closed[0] != key and now - closed[1] < LAPSE

    def request(self, key: int, connector: int, now: float, *, room: bool) -> bool:
        """Asks to enter a connector; to be repeated until the vehicle is on it.

        Args:
            key: tells the vehicle apart.
            connector: lane across the junction.
            now: simulated time [s].
            room: whether there is room for the vehicle behind the junction.

        Returns:
            Whether it may enter. The grant stays until the vehicle has crossed, or lapses if it is not used.
        """
        held = self._held.get(key, [])
        # a vehicle may still be crossing the last junction, but heads for one connector only
        held[:] = [claim for claim in held if claim.entered or claim.connector == connector]
        for claim in held:
            if claim.connector == connector:
                claim.asked = now
                return True
        waiting = self._waiting.get(key)
        if waiting is None or waiting.connector != connector:
            waiting = self._waiting[key] = _Claim(connector, now, now)
        waiting.asked = now
        if not room:
            waiting.since = math.inf  # whoever cannot leave the junction keeps nobody waiting
            return False
        waiting.since = min(waiting.since, now)
        if self._is_closed_to(key, self._junction(connector), now):
            return False
        if any(
            self.crosses(connector, claim.connector)
            for other, claims in self._held.items()
            if other != key
            for claim in claims
        ):
            return False
        if any(
            other.since < waiting.since and now - other.asked < LAPSE and self.crosses(connector, other.connector)
            for k, other in self._waiting.items()
            if k != key
        ):
            return False
        del self._waiting[key]
        self._held.setdefault(key, []).append(_Claim(connector, now, now))
        return True

    def holds(self, key: int) -> int | None:
        """Connector that a vehicle was granted last."""
        held = self._held.get(key)
        return held[-1].connector if held else None

    def note(self, key: int, lane: int, speed: float, now: float) -> None:
        """Takes note of where a vehicle is: enters or leaves its connector, or does not use what it was granted."""
        held = self._held.get(key)
        if not held:
            return
        junction = self._junction(lane)
        held[:] = [claim for claim in held if self._stands(claim, junction, speed, now)]

    def _stands(self, claim: _Claim, junction: int, speed: float, now: float) -> bool:
        if junction == self._junction(claim.connector):
            claim.entered = True
            return True
        if claim.entered:
            return False
        if speed > 0.3:
            claim.since = now
        return now - claim.since <= PATIENCE and now - claim.asked <= LAPSE

    def release(self, key: int) -> None:
        """Gives back what a vehicle holds or waits for."""
        self._held.pop(key, None)
        self._waiting.pop(key, None)

    def crosses(self, one: int, other: int) -> bool:
        """Whether two connectors cannot be driven at the same time by two vehicles."""
        if one == other or self._junction(one) != self._junction(other):
            return False
        pair = (min(one, other), max(one, other))
        if pair not in self._crossing:
            self._crossing[pair] = _meet(self._town.lanes[pair[0]], self._town.lanes[pair[1]])
        return self._crossing[pair]

    def _junction(self, lane: int) -> int:
        return self._town.lanes[lane].junction_id


def _meet(one: Lane, other: Lane) -> bool:
    level = abs(one.height_at(one.length / 2) - other.height_at(other.length / 2)) <= HEIGHT
    turning = any(abs(lane.headings[-1] - lane.headings[0]) > TURN for lane in (one, other))
    clearance = TURNING_CLEARANCE if turning else CLEARANCE
    return bool(level and cdist(_swept(one), _swept(other)).min() < clearance)


def _swept(lane: Lane) -> Array:
    """Centres of the circles that cover a vehicle, at every metre of its way along a lane (n, 2) [m]."""
    stations = np.linspace(0.0, lane.length, int(lane.length) + 2)
    headings = np.array([lane.heading_at(s) for s in stations])
    middles = np.array([lane.position(s) for s in stations])
    along = np.column_stack((np.cos(headings), np.sin(headings)))
    return np.concatenate([middles + offset * along for offset in (-CIRCLE_OFFSET, 0.0, CIRCLE_OFFSET)])
