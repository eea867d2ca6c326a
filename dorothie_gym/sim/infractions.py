"""Infractions of the ego: red lights, stop signs, leaving the road, driving against the traffic.

They follow from the ego's trajectory alone, whatever drove it, and are counted and listed by `sim.traffic_rules`;
collisions, the fifth kind, are detected in `sim.collisions`. This module reads the lists.
"""

from __future__ import annotations

import enum
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.ontology.slots import ObjectClass
from dorothie_gym.sim.config import FRAME_RATE
from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.sim.state.codes import EventCode
from dorothie_gym.sim.state.ego_records import EventRecord
from dorothie_gym.sim.state.record_views import ArrayHolder
from dorothie_gym.sim.state.sensing_records import BreachRecord
from dorothie_gym.sim.state.world_arrays import WorldArrays
from dorothie_gym.support.compilation.records import plain
from dorothie_gym.support.copying import CachedViews


class WorldEventKind(enum.StrEnum):
    """Kind of an event of the ego."""

    HAZARD_STOP = "hazard_stop"
    HAZARD_END = "hazard_end"
    COLLISION = "collision"
    RED_LIGHT = "red_light"
    """The front of the car passes the end of its lane while the lane's light is red."""
    STOP_SIGN = "stop_sign"
    """It passes the end of a lane with a stop sign and has not stood there with its front within `AT_LINE`."""
    OFF_ROAD = "off_road"
    """Its middle is farther than `OFF_ROAD_MARGIN` outside of every lane's area, and it is not turning round."""
    WRONG_WAY = "wrong_way"
    """Its middle is on lanes that all run against it, outside junctions, and it is not turning round."""


INFRACTION_KINDS = (
    WorldEventKind.COLLISION,
    WorldEventKind.RED_LIGHT,
    WorldEventKind.STOP_SIGN,
    WorldEventKind.OFF_ROAD,
    WorldEventKind.WRONG_WAY,
)
"""Kinds of infractions, in the order of `codes.Breach`; their data names place and counterpart."""

_RULES = frozenset(INFRACTION_KINDS) - {WorldEventKind.COLLISION}
_SIGNALS = {WorldEventKind.RED_LIGHT: ObjectClass.TRAFFIC_LIGHT, WorldEventKind.STOP_SIGN: ObjectClass.TRAFFIC_SIGN}
"""Class of the signal that is disregarded."""


@dataclass(frozen=True, kw_only=True)
class WorldEvent:
    """Something that happened to the car, at a frame."""

    frame: int
    kind: WorldEventKind
    data: Mapping[str, object] = field(default_factory=dict)


class WorldEventLog(CachedViews):
    """Events of the ego, read from the lists that the compiled loops keep of them."""

    CACHED_VIEWS: ClassVar[Sequence[str]] = ("_counts_of", "_own_counts")

    _counts_of: WorldArrays | None = None

    def __init__(self, network: TownNetwork, holder: ArrayHolder) -> None:
        """Reads the lists in `holder.arrays`, which may be replaced by others with more room."""
        self._network, self._town, self._holder = network, network.town, holder
        self._events: list[WorldEvent] = []

    @property
    def counts(self) -> NDArray[np.int64]:
        """Number of infractions so far (5,), in the order of `INFRACTION_KINDS`; a view."""
        arrays = self._holder.arrays
        if arrays is not self._counts_of:
            self._counts_of, self._own_counts = arrays, plain(arrays.watch)["counts"][0]
        counts: NDArray[np.int64] = self._own_counts
        return counts

    @property
    def infractions(self) -> Mapping[WorldEventKind, int]:
        """Number of infractions so far by kind, including collisions caused by others."""
        return dict(zip(INFRACTION_KINDS, self.counts.tolist(), strict=True))

    def note(self, events: int, breaches: int) -> None:
        """Records a number of events and infractions of the last call of `sim.step.step`."""
        arrays = self._holder.arrays
        for event in arrays.events[:events]:
            self._note_event(event)
        for breach in arrays.breaches[:breaches]:
            self._note_breach(breach)

    def take(self) -> list[WorldEvent]:
        """Returns the recorded events in the order of their frames, and forgets them."""
        if not self._events:
            return []
        events, self._events = sorted(self._events, key=lambda event: (event.frame, event.kind in _RULES)), []
        return events

    def _note_event(self, event: EventRecord) -> None:
        """Records a hazard stop or a collision."""
        frame, kind = int(event.frame), ObjectClass(int(event.kind))
        if event.code == EventCode.HAZARD_STOP:
            self._add(WorldEventKind.HAZARD_STOP, frame, reason=kind.label, distance=round(float(event.value), 2))
        elif event.code == EventCode.HAZARD_END:
            seconds = round(float(event.value) / FRAME_RATE, 2)
            self._add(WorldEventKind.HAZARD_END, frame, reason=kind.label, seconds=seconds)
        else:
            self._add(
                WorldEventKind.COLLISION,
                frame,
                **_place(int(event.lane), float(event.station), float(event.x), float(event.y)),
                key=int(event.key),
                other=kind.label,
                own_fault=bool(event.own),
                speed=round(float(event.value), 2),
            )

    def _note_breach(self, breach: BreachRecord) -> None:
        """Records an infraction, with the light or sign, or the nearest lane."""
        kind, lane, station = INFRACTION_KINDS[breach.kind], int(breach.lane), float(breach.station)
        x, y = float(breach.x), float(breach.y)
        if lane < 0:
            place = np.array([x, y])
            index = self._network.get_closest_lane_index(place, height=float(breach.height))
            lane = self._network.lane_id(index)
            station = float(self._network.get_lane(index).local_coordinates(place)[0])
        station = min(max(station, 0.0), self._town.lanes[lane].length)
        key, other = (int(breach.signal), _SIGNALS[kind].label) if kind in _SIGNALS else (None, None)
        self._add(kind, int(breach.frame), **_place(lane, station, x, y), key=key, other=other)

    def _add(self, kind: WorldEventKind, frame: int, **data: object) -> None:
        self._events.append(WorldEvent(frame=frame, kind=kind, data=data))


def _place(lane: int, station: float, x: float, y: float) -> dict[str, object]:
    return {"lane": lane, "station": round(station, 2), "x": round(x, 3), "y": round(y, 3)}
