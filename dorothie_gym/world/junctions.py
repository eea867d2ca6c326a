"""Who may cross a junction: one vehicle at a time on paths that cross (until lights and priorities rule them).

Stock IDM vehicles do not see each other across a junction. Here each asks before it enters; it is let in when nobody
holds a connector that crosses its own, nobody asked for one before, and there is room behind the junction.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import cdist

from dorothie_gym.world.town.model import Lane, Town

CLEARANCE = 3.2
"""Centre lines closer than this cannot be driven at the same time [m]: two car widths of 2 m less a shared margin."""

HEIGHT = 2.5
"""Connectors further apart in height do not meet [m]."""

PATIENCE = 3.0
"""Who holds a connector without entering it for this long loses it [s]."""


@dataclass
class _Claim:
    connector: int
    since: float
    entered: bool = False


class JunctionControl:
    """Grants the connectors of all junctions of a town, first come, first served."""

    def __init__(self, town: Town) -> None:
        self._town = town
        self._crossing: dict[tuple[int, int], bool] = {}
        self._held: dict[int, _Claim] = {}
        self._waiting: dict[int, _Claim] = {}

    def request(self, key: int, connector: int, now: float, *, room: bool) -> bool:
        """Asks to enter a connector.

        Args:
            key: tells the vehicle apart.
            connector: lane across the junction.
            now: simulated time [s].
            room: whether there is room for the vehicle behind the junction.

        Returns:
            Whether it may enter. The grant stays until `release`, or lapses if it is not used.
        """
        claim = self._held.get(key)
        if claim is not None and claim.connector == connector:
            return True
        if claim is not None:
            self.release(key)
        waiting = self._waiting.get(key)
        if waiting is None or waiting.connector != connector:
            waiting = self._waiting[key] = _Claim(connector, now)
        if not room:
            waiting.since = now  # whoever cannot leave the junction keeps nobody waiting
            return False
        if any(self.crosses(connector, other.connector) for k, other in self._held.items() if k != key):
            return False
        if any(
            other.since < waiting.since and self.crosses(connector, other.connector)
            for k, other in self._waiting.items()
            if k != key
        ):
            return False
        del self._waiting[key]
        self._held[key] = _Claim(connector, now)
        return True

    def holds(self, key: int) -> int | None:
        """Connector that a vehicle was granted."""
        claim = self._held.get(key)
        return None if claim is None else claim.connector

    def note(self, key: int, lane: int, speed: float, now: float) -> None:
        """Takes note of where a vehicle is: enters or leaves its connector, or stands before it for too long."""
        claim = self._held.get(key)
        if claim is None:
            return
        if lane == claim.connector or self._town.lanes[lane].junction_id == self._junction(claim.connector):
            claim.entered = True
        elif claim.entered:
            self.release(key)
        elif speed > 0.3:
            claim.since = now
        elif now - claim.since > PATIENCE:
            self.release(key)

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
    points = [
        np.array([lane.position(s) for s in np.linspace(0, lane.length, int(lane.length) + 2)]) for lane in (one, other)
    ]
    near = cdist(*points).min()
    level = abs(one.height_at(one.length / 2) - other.height_at(other.length / 2)) <= HEIGHT
    return bool(near < CLEARANCE and level)
