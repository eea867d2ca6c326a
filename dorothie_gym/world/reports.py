"""What the world reports of the car: hazard stops, and breaches of the rules of the road."""

from __future__ import annotations

import enum
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from dorothie_gym.ontology import ObjectClass
from dorothie_gym.world.infractions import InfractionWatch
from dorothie_gym.world.network.network import TownNetwork
from dorothie_gym.world.town.model import Array


class WorldEventKind(enum.StrEnum):
    """What the world reports of its own."""

    HAZARD_STOP = "hazard_stop"
    HAZARD_END = "hazard_end"
    COLLISION = "collision"
    RED_LIGHT = "red_light"
    STOP_SIGN = "stop_sign"
    OFF_ROAD = "off_road"
    WRONG_WAY = "wrong_way"


INFRACTION_KINDS = (
    WorldEventKind.COLLISION, WorldEventKind.RED_LIGHT, WorldEventKind.STOP_SIGN, WorldEventKind.OFF_ROAD,
    WorldEventKind.WRONG_WAY,
)  # fmt: skip
"""Reports of a breach of the rules of the road; their data tells place and counterpart (`Reports.infraction`)."""


@dataclass(frozen=True, kw_only=True)
class WorldEvent:
    """Something that happened to the car, at a frame."""

    frame: int
    kind: WorldEventKind
    data: Mapping[str, Any] = field(default_factory=dict)


class Reports:
    """Collects what happens to the car.

    Attributes:
        infractions: how often each rule has been broken, collisions of whosever making among them.
    """

    def __init__(self, network: TownNetwork, length: float) -> None:
        """Begins with nothing; `length` is that of the car [m]."""
        self._watch = InfractionWatch(network, length)
        self._events: list[WorldEvent] = []
        self.infractions: Counter[WorldEventKind] = Counter()

    def add(self, kind: WorldEventKind, frame: int, **data: Any) -> None:
        """Reports something that happened at a frame."""
        self._events.append(WorldEvent(frame=frame, kind=kind, data=data))

    def infraction(
        self, kind: WorldEventKind, frame: int, *, lane: int, station: float, x: float, y: float,
        key: int | None, other: ObjectClass | None, **data: Any,
    ) -> None:  # fmt: skip
        """Reports a breach of the rules.

        Args:
            kind: which rule, one of `INFRACTION_KINDS`.
            frame: when.
            lane: where; `station` how far along it [m].
            station: [m].
            x: of the car [m]; `y` likewise.
            y: [m].
            key: of what was touched, or of the light or sign that was passed.
            other: its class.
            data: what else is to be said of it.
        """
        self.infractions[kind] += 1
        place = {
            "lane": lane, "station": round(float(station), 2), "x": round(float(x), 3), "y": round(float(y), 3),
        }  # fmt: skip
        self.add(kind, frame, **place, key=key, other=None if other is None else other.label, **data)

    def close(self, poses: Array, frame: int, *, stood: bool = False) -> list[WorldEvent]:
        """Looks for breaches on the car's way since the last call, and returns all that has been reported since.

        Args:
            poses: of the car before the way and after each of its frames (n + 1, 6), columns as in `kernel.rules`.
            frame: that of the last of them.
            stood: whether it stood all the time; then they are not looked at.
        """
        first = frame - len(poses) + 1
        if stood:
            self._watch.wait(first, frame)
        for breach in () if stood else self._watch.look(poses, first):
            self.infraction(
                WorldEventKind(breach.kind.value), breach.frame, lane=breach.lane, station=breach.station,
                x=breach.x, y=breach.y, key=breach.key, other=breach.other,
            )  # fmt: skip
        if not self._events:
            return []
        events, self._events = sorted(self._events, key=lambda event: event.frame), []
        return events
