"""Attribution of exchanges to the exceptions that they handle, by a rule over events and references.

An exchange handles an exception if it begins within `HANDLING_WINDOW` after it, and one of its acts refers to it. In
sessions with recorded meanings, the propositions decide (`exception_mentions`). In others, slots and words do:

- weather: the object classes it covers (sky, ground, water), or words for fog, rain, night, ...; within
  `PROMPT_WINDOW` also speed or lights;
- appearing vehicles or pedestrians: their object class;
- an object on the road: an obstacle, or words for a blocked or cleared way; within `PROMPT_WINDOW` after the car has
  come near, a U-turn or another lane as well;
- a sensor fault: words for a sensor or its picture; or the car begins the exchange within `MAX_FAULT_DURATION` with a
  question for an action;
- a task exception: the landmark of the task, or an abandoned or postponed goal.

For an object on the road, the window starts again when the car comes near. A question within `ANSWER_TIMEOUT` after an
exchange that handles an object on the road belongs to it if it names no landmark; after an exchange that handles a task
exception, a question for status or destination does. If several exceptions match, the latest counts.

If annotators have marked what an exchange handles, their mark counts.
"""

from __future__ import annotations

import bisect
import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cache, partial
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

import numpy as np

from dorothie_gym.dialogue.exchanges import ANSWER_TIMEOUT
from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.evaluation.analysis.exception_mentions import mentions
from dorothie_gym.ontology.dialogue_acts import MoveGroup
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import ActionValue, GoalStatus, LandmarkName, ObjectClass, Slot, SlotValue
from dorothie_gym.ontology.world_exceptions import ExceptionKind
from dorothie_gym.session.recording.events import Event, EventType
from dorothie_gym.sim.config import FRAME_RATE

if TYPE_CHECKING:
    from dorothie_gym.evaluation.analysis.units import SaidUnit, Units
    from dorothie_gym.session.recording.session import Session

HANDLING_WINDOW: Final = 60.0
"""Time within which an exception is handled [s]."""

PROMPT_WINDOW: Final = 20.0
"""Longest time between an exception and an act that refers to it only by an action of the car [s]."""

MAX_FAULT_DURATION: Final = 30.0
"""Longest duration of a sensor fault [s] (spec: design)."""

MEETING_DISTANCE: Final = 60.0
"""Distance at which the car meets an object on the road [m]: the object is visible from there by day."""

OBSTACLES: Final = (
    ObjectClass.STATIC, ObjectClass.DYNAMIC, ObjectClass.OTHER, ObjectClass.FENCE, ObjectClass.VEGETATION,
    ObjectClass.TRAFFIC_SIGN, ObjectClass.GUARD_RAIL, ObjectClass.WALL, ObjectClass.UNLABELED,
)  # fmt: skip
"""Object classes by which speakers refer to an obstacle on the road."""


class Handled(StrEnum):
    """Kind of exception that an exchange handles."""

    ENVIRONMENTAL = "environmental"
    TASK = "task"
    NONE = "none"


_AROUND: Final[frozenset[SlotValue]] = frozenset({ActionValue.U_TURN, ActionValue.LANE_SWITCH})
"""Actions that refer to an obstacle once the car is near."""

_CAUTION: Final[frozenset[SlotValue]] = frozenset({ActionValue.SPEED_CHANGE, ActionValue.LIGHT_CHANGE})
"""Actions that refer to the weather."""

_REFERENCES: Final[Mapping[ExceptionKind, frozenset[SlotValue]]] = MappingProxyType(
    {
        ExceptionKind.WEATHER: frozenset({ObjectClass.SKY, ObjectClass.GROUND, ObjectClass.WATER, ObjectClass.TERRAIN}),
        ExceptionKind.SPAWN_VEHICLES: frozenset({ObjectClass.VEHICLES}),
        ExceptionKind.SPAWN_PEDESTRIANS: frozenset({ObjectClass.PEDESTRIAN}),
        ExceptionKind.PLACE_PROP: frozenset(OBSTACLES),
        ExceptionKind.MOVE_PROP: frozenset(OBSTACLES),
        ExceptionKind.DELETE_PROP: frozenset(OBSTACLES),
    }
)

_BLOCKED: Final = re.compile(
    r"\b(?:road ?)?block(?:s|ed|ing|ade)?\b|\bobstacles?\b|\bbarriers?\b|\bcones?\b|\bdetour\b|\bdead end\b"
    r"|\b(?:road|street|lane|way|it)(?:'s| is) (?:closed|shut|clear|free|open)\b|\bget (?:past|through|around)\b"
    r"|\b(?:another|different|other) way\b|\bway (?:a)?round\b|\bin the (?:way|road)\b|\bacross the road\b"
)
_WORDS: Final[Mapping[ExceptionKind, re.Pattern[str]]] = MappingProxyType(
    {
        ExceptionKind.WEATHER: re.compile(
            r"\bfog\w*|\bmist\w*|\brain\w*|\bpour(?:s|ing)\b|\bdrizzl\w*|\bstorm\w*|\bcloud\w*|\bwind(?:y|s)?\b"
            r"|\bdark\w*|\bnight\w*|\bdusk\b|\bsun(?:set|light|shine|ny)?\b|\b(?:day|head)?lights? (?:on|off)\b"
            r"|\bvisibility\b|\bwet\b|\bslippery\b|\bpuddles?\b|\bweather\b|\b(?:hardly|barely) see\b"
            r"|\bclear(?:s|ed|ing)? up\b"
        ),
        ExceptionKind.SPAWN_VEHICLES: re.compile(r"\btraffic(?! lights?)\b|\bjam\b|\bcongest\w+|\bso many cars\b"),
        ExceptionKind.SPAWN_PEDESTRIANS: re.compile(r"\bcrowd\w*|\bpedestrians?\b|\bso many people\b"),
        ExceptionKind.PLACE_PROP: _BLOCKED,
        ExceptionKind.MOVE_PROP: _BLOCKED,
        ExceptionKind.DELETE_PROP: _BLOCKED,
        ExceptionKind.SENSOR_FAULT: re.compile(
            r"\bgps\b|\bsatellites?\b|\bpositioning\b|\b(?:my|our) position\b|\bcameras?\b"
            r"|\b(?:the|my) (?:view|picture)\b|\bblur\w*|\bsensors?\b|\bwhere (?:we are|i am|we're|i'm)\b"
            r"|\bcan(?:'t|not) see anything\b"
        ),
    }
)
"""Words that refer to an exception of a kind, in case-folded text."""

_ABOUT_THE_WAY: Final = frozenset({Predicate.WILL, Predicate.SHORTER, Predicate.HAS_ROUTE, Predicate.RIGHT_WAY})
_PUT_OFF: Final = frozenset({GoalStatus.ABANDONED, GoalStatus.PENDING})
_ASKING: Final = frozenset(MoveGroup.ASK.moves)


def kind_of(event: Event) -> ExceptionKind | None:
    """Returns the kind of an exception; None for other events and for unknown kinds."""
    name = str(event.data.get("kind")).upper() if event.type is EventType.EXCEPTION else ""
    return ExceptionKind[name] if name in ExceptionKind.__members__ else None


def place_of(event: Event) -> tuple[float, float] | None:
    """Returns the place of an exception (x, y) [m]: of its object, or the centre of its area; None if it has none."""
    data = event.data
    x, y = data.get("x"), data.get("y")
    if isinstance(x, int | float) and isinstance(y, int | float):
        return float(x), float(y)
    corners = [data.get(name) for name in ("x0", "x1", "y0", "y1")]
    known = [float(value) for value in corners if isinstance(value, int | float)]
    return ((known[0] + known[1]) / 2.0, (known[2] + known[3]) / 2.0) if len(known) == 4 else None


def is_near(session: Session, event: Event, time: float) -> bool:
    """Returns whether the car is near the place of an exception at a time [s]; True if it has none."""
    place, rows = place_of(event), session.trajectory
    if place is None or not len(rows):
        return True
    row = rows[min(int(np.searchsorted(rows["frame"], round(time * FRAME_RATE))), len(rows) - 1)]
    return math.hypot(row["x"] - place[0], row["y"] - place[1]) <= MEETING_DISTANCE


def time_met(session: Session, event: Event) -> float:
    """Returns the time at which the car first came near an exception's object on the road [s]; infinity if never."""
    x, y = event.data.get("x"), event.data.get("y")
    if not isinstance(x, int | float) or not isinstance(y, int | float):
        return math.inf
    rows = session.trajectory[session.trajectory["frame"] >= event.frame]
    near = np.flatnonzero((rows["x"] - x) ** 2 + (rows["y"] - y) ** 2 <= MEETING_DISTANCE**2)
    return float(rows["frame"][near[0]]) / FRAME_RATE if len(near) else math.inf


def handled_by(units: Units) -> dict[int, Event]:
    """Returns the exception that each exchange handles, by number of the exchange."""
    session = units.session
    happened = [
        _Happened(event, kind, time_met(session, event) if kind.is_plan_level else math.inf)
        for event in session.of_type(EventType.EXCEPTION)
        if (kind := kind_of(event)) is not None
    ]
    times = [each.event.time for each in happened]
    met = [k for k, each in enumerate(happened) if math.isfinite(each.met)]
    found: dict[int, Event] = {}
    last: tuple[float, _Happened] | None = None
    meant = any(move.meaning for move in session.moves())
    for exchange in sorted(units.exchanges, key=lambda unit: unit.start):
        fresh = range(
            bisect.bisect_left(times, exchange.start - HANDLING_WINDOW), bisect.bisect_right(times, exchange.start)
        )
        latest = (happened[k] for k in sorted({*fresh, *met}, reverse=True))
        if meant:
            said = [proposition for move in exchange.moves for proposition in move.meaning]
            cause = next((each for each in latest if each.is_meant_in(session, exchange, said)), None)
        else:
            mentioned = cache(partial(_mentions, exchange))  # each kind once, however many exceptions there are
            cause = next((each for each in latest if each.is_handled_in(exchange, mentioned)), None)
        if (
            cause is None
            and last is not None
            and exchange.start - last[0] <= ANSWER_TIMEOUT
            and last[1].is_asked_on(exchange, meant=meant)
        ):
            cause = last[1]
        if cause is not None:
            found[exchange.id] = cause.event
            last = exchange.end, cause
    return found


def times_mentioned(units: Units) -> dict[int, list[float]]:
    """Returns when each exception is talked about [s], by `id` of its event.

    With recorded meanings, these are the starts of the acts about the exception; otherwise the starts of exchanges.
    """
    session, found = units.session, dict[int, list[float]]()
    moves = [move for move in session.moves() if move.meaning]
    if not moves:
        starts = {unit.id: unit.start for unit in units.exchanges}
        for number, event in handled_by(units).items():
            found.setdefault(id(event), []).append(starts[number])
        return found
    for event in session.of_type(EventType.EXCEPTION):
        kind = kind_of(event)
        if kind is None:
            continue
        for move in moves:
            near = is_near(session, event, move.start)
            if move.start >= event.time and mentions(move.meaning, kind, event, near=near):
                found.setdefault(id(event), []).append(move.start)
    return found


def handling(units: Units) -> dict[int, Handled]:
    """Returns the kind of exception that each exchange handles, by number of the exchange."""
    events = handled_by(units)
    kinds = {number: kind_of(event) for number, event in events.items()}
    found = {
        unit.id: Handled.NONE
        if (kind := kinds.get(unit.id)) is None
        else (Handled.TASK if kind.is_task else Handled.ENVIRONMENTAL)
        for unit in units.exchanges
    }
    marked = {number: Handled(kind) for number, kind in units.marked_exceptions.items() if kind in set(Handled)}
    return {**found, **marked}


def handling_of_events(units: Units) -> dict[int, Handled]:
    """Returns the kind of exception that each dialogue move and physical action handles, by number of its event.

    A move counts as its exchange does. A physical action belongs to the exchange of the last move that ended before it,
    if that was at most `ANSWER_TIMEOUT` ago, the time for which an exchange stays open.
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
        recent = last >= 0 and action.frame - frames[last] <= ANSWER_TIMEOUT * FRAME_RATE
        found[action.index] = found[said[last].index] if recent else Handled.NONE
    return found


def _mentions(exchange: SaidUnit, kind: ExceptionKind) -> bool:
    """Returns whether an act of an exchange contains a word for a kind of exceptions."""
    words = _WORDS.get(kind)
    return words is not None and any(words.search(move.span.casefold().replace("’", "'")) for move in exchange.moves)


@dataclass(frozen=True)
class _Happened:
    """Exception with its kind, and the time at which the car came near its object on the road [s]."""

    event: Event
    kind: ExceptionKind
    met: float

    def is_meant_in(self, session: Session, exchange: SaidUnit, said: Sequence[Proposition]) -> bool:
        """Returns whether an exchange is within the window and a proposition in it is about the exception."""
        was_met = 0.0 <= exchange.start - self.met <= HANDLING_WINDOW
        if not was_met and not 0.0 <= exchange.start - self.event.time <= HANDLING_WINDOW:
            return False
        return mentions(said, self.kind, self.event, near=is_near(session, self.event, exchange.start))

    def is_handled_in(self, exchange: SaidUnit, mentioned: Callable[[ExceptionKind], bool]) -> bool:
        """Returns whether an exchange is within the window and one of its acts refers to the exception."""
        is_near = 0.0 <= exchange.start - self.met <= HANDLING_WINDOW
        since = exchange.start - self.event.time
        if not is_near and not 0.0 <= since <= HANDLING_WINDOW:
            return False
        values = exchange.values
        if self.kind.is_task:
            return bool(_PUT_OFF & values) or self._place() in values
        if values & _REFERENCES.get(self.kind, frozenset()) or self._is_met_by(values, exchange.start):
            return True
        if mentioned(self.kind):
            return True
        return self.kind is ExceptionKind.SENSOR_FAULT and since <= MAX_FAULT_DURATION and _asks_what_to_do(exchange)

    def _is_met_by(self, values: frozenset[SlotValue], time: float) -> bool:
        """Returns whether an action named at a time [s] responds to the exception, within `PROMPT_WINDOW` after it."""
        if self.kind is ExceptionKind.WEATHER:
            return time - self.event.time <= PROMPT_WINDOW and bool(values & _CAUTION)
        return 0.0 <= time - self.met <= PROMPT_WINDOW and bool(values & _AROUND)

    def is_asked_on(self, exchange: SaidUnit, *, meant: bool = False) -> bool:
        """Returns whether an exchange, right after one that handles the exception, continues it by a question.

        Args:
            exchange: the exchange.
            meant: whether the session has meanings; a question about an obstacle must then be about the route.
        """
        first = exchange.moves[0].act
        if meant and self.kind.is_plan_level:
            about_way = any(said.predicate in _ABOUT_THE_WAY for said in exchange.moves[0].meaning)
            return about_way and first.move in _ASKING and not first.values(Slot.LANDMARK)
        if first.move not in _ASKING:
            return False
        if self.kind.is_task:
            return bool(first.values(Slot.STATUS)) or LandmarkName.QUERIED in first.slots
        return self.kind.is_plan_level and not first.values(Slot.LANDMARK)

    def _place(self) -> LandmarkName | None:
        label = self.event.data.get("landmark")
        return next((name for name in LandmarkName if name.label == label), None)


def _asks_what_to_do(exchange: SaidUnit) -> bool:
    first = exchange.moves[0]
    asks = first.act.move in _ASKING and bool(first.act.values(Slot.ACTION))
    return first.speaker is Role.CO_WIZARD and asks
