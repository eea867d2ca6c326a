"""Which exchange handles which exception: a rule over events and references, so that it can be found anew.

An exchange handles an exception if it begins after it, within `WINDOW`, and one of its acts refers to it:

- weather: to speed or lights, or to what the weather covers (sky, ground, water);
- vehicles or pedestrians that appear: to such;
- something on the road: to an obstacle, a U-turn or another lane; the time counts anew from when the car comes near;
- a sensor fault: begun by the car with a statement or a question that names no place;
- a task: to the landmark of the task, or to what is given up or put off.

A question that begins within `PATIENCE` after an exchange that handles an exception, and names no place, belongs to it.
Where several fit, the latest counts.
"""

from __future__ import annotations

import bisect
import math
from collections.abc import Mapping
from enum import StrEnum
from types import MappingProxyType
from typing import Final

import numpy as np

from dorothie_gym.dialogue.exchanges import PATIENCE
from dorothie_gym.ontology import (
    ActionValue,
    DialogueMove,
    ExceptionKind,
    GoalStatus,
    MoveGroup,
    ObjectClass,
    Role,
    Slot,
    SlotValue,
)
from dorothie_gym.sessions.events import Event, EventType
from dorothie_gym.sessions.session import Session
from dorothie_gym.sessions.statistics.units import SaidUnit, Units
from dorothie_gym.world.config import FRAME_RATE

WINDOW: Final = 60.0
"""An exception is handled within this time [s]."""

NEAR: Final = 60.0
"""The car has met something on the road when it comes this close to it [m]: it is seen from there by day."""

OBSTACLES: Final = (
    ObjectClass.STATIC, ObjectClass.DYNAMIC, ObjectClass.OTHER, ObjectClass.FENCE, ObjectClass.VEGETATION,
    ObjectClass.TRAFFIC_SIGN, ObjectClass.GUARD_RAIL, ObjectClass.WALL, ObjectClass.UNLABELED,
)  # fmt: skip
"""What lies across a road may be called."""


class Handled(StrEnum):
    """What an exchange handles."""

    ENVIRONMENTAL = "environmental"
    TASK = "task"
    NONE = "none"


_ROADBLOCK: Final[frozenset[SlotValue]] = frozenset({*OBSTACLES, ActionValue.U_TURN, ActionValue.LANE_SWITCH})

_REFERENCES: Final[Mapping[ExceptionKind, frozenset[SlotValue]]] = MappingProxyType(
    {
        ExceptionKind.WEATHER: frozenset(
            {
                ActionValue.SPEED_CHANGE, ActionValue.LIGHT_CHANGE, ObjectClass.SKY, ObjectClass.GROUND,
                ObjectClass.WATER, ObjectClass.TERRAIN,
            }
        ),
        ExceptionKind.SPAWN_VEHICLES: frozenset({ObjectClass.VEHICLES}),
        ExceptionKind.SPAWN_PEDESTRIANS: frozenset({ObjectClass.PEDESTRIAN}),
        ExceptionKind.PLACE_PROP: _ROADBLOCK,
        ExceptionKind.MOVE_PROP: _ROADBLOCK,
        ExceptionKind.DELETE_PROP: _ROADBLOCK,
    }
)  # fmt: skip
_PUT_OFF: Final = frozenset({GoalStatus.ABANDONED, GoalStatus.PENDING})
_ASKING: Final = frozenset(MoveGroup.ASK.moves)


def kind_of(event: Event) -> ExceptionKind | None:
    """Returns the kind of an exception; None for other events and for kinds that are unknown."""
    name = str(event.data.get("kind")).upper() if event.type is EventType.EXCEPTION else ""
    return ExceptionKind[name] if name in ExceptionKind.__members__ else None


def time_met(session: Session, event: Event) -> float:
    """Returns when the car first came near what an exception put on the road [s]; infinity if never, or unknown."""
    x, y = event.data.get("x"), event.data.get("y")
    if not isinstance(x, int | float) or not isinstance(y, int | float):
        return math.inf
    rows = session.trajectory[session.trajectory["frame"] >= event.frame]
    near = np.flatnonzero((rows["x"] - x) ** 2 + (rows["y"] - y) ** 2 <= NEAR**2)
    return float(rows["frame"][near[0]]) / FRAME_RATE if len(near) else math.inf


def handled_by(units: Units) -> dict[int, Event]:
    """Returns for each exchange that handles an exception its number and the exception."""
    session = units.session
    times = [
        (event, kind, (event.time, time_met(session, event) if kind.is_plan_level else math.inf))
        for event in session.of_type(EventType.EXCEPTION)
        if (kind := kind_of(event)) is not None
    ]
    found: dict[int, Event] = {}
    last: tuple[float, Event] | None = None
    for exchange in sorted(units.exchanges, key=lambda unit: unit.start):
        event = next((e for e, kind, begun in reversed(times) if _handles(exchange, e, kind, begun)), None)
        if event is None and last is not None and exchange.start - last[0] <= PATIENCE and _asks_on(exchange):
            event = last[1]
        if event is not None:
            found[exchange.id] = event
            last = exchange.end, event
    return found


def handling(units: Units) -> dict[int, Handled]:
    """Returns for the number of each exchange whether it handles an environmental or a task exception, or none."""
    events = handled_by(units)
    kinds = {number: kind_of(event) for number, event in events.items()}
    return {
        unit.id: Handled.NONE
        if (kind := kinds.get(unit.id)) is None
        else (Handled.TASK if kind.is_task else Handled.ENVIRONMENTAL)
        for unit in units.exchanges
    }


def handling_of_events(units: Units) -> dict[int, Handled]:
    """Returns what each dialogue move and physical action of a session handles, by the number of its event.

    A move handles what its exchange does. A physical action belongs to the exchange of the last move that was over
    before it, if that is at most `PATIENCE` ago: an exchange is open that long.
    """
    kinds = handling(units)
    found = {
        move.index: kinds.get(number, Handled.NONE) if (number := units.exchange_of(move)) is not None else Handled.NONE
        for move in units.session.moves()
    }
    said = units.session.moves()
    frames = [move.frame for move in said]
    for action in units.session.physical_actions:
        last = bisect.bisect_left(frames, action.frame) - 1
        recent = last >= 0 and action.frame - frames[last] <= PATIENCE * FRAME_RATE
        found[action.index] = found[said[last].index] if recent else Handled.NONE
    return found


def _handles(exchange: SaidUnit, event: Event, kind: ExceptionKind, begun: tuple[float, float]) -> bool:
    if not any(0.0 <= exchange.start - time <= WINDOW for time in begun):
        return False
    values = {value for move in exchange.moves for value in move.act.slots}
    if kind.is_task:
        return bool(_PUT_OFF & values) or any(
            value.slot is Slot.LANDMARK and value.label == event.data.get("landmark") for value in values
        )
    if kind is ExceptionKind.SENSOR_FAULT:
        first = exchange.moves[0]
        tells = first.act.move is DialogueMove.EXPLAIN or first.act.move in _ASKING
        return first.speaker is Role.CO_WIZARD and tells and not first.act.values(Slot.LANDMARK)
    return bool(_REFERENCES.get(kind, frozenset()) & values)


def _asks_on(exchange: SaidUnit) -> bool:
    first = exchange.moves[0].act
    return first.move in _ASKING and not first.values(Slot.LANDMARK)
