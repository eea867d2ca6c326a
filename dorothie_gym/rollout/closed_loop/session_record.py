"""Measurements of a driven session: the numbers from which every closed-loop metric is computed."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Final

import numpy as np

from dorothie_gym.analysis.exception_attribution import MEETING_DISTANCE, kind_of, time_met
from dorothie_gym.analysis.units import Units
from dorothie_gym.dialogue.exchanges import ExchangeState
from dorothie_gym.maps import Town
from dorothie_gym.maps.routing import Place
from dorothie_gym.ontology import DialogueMove, ExceptionKind, ObjectClass
from dorothie_gym.recording import FRAME_RATE, Event, EventType, Session
from dorothie_gym.rollout.closed_loop.task_progress import (
    TaskRecord,
    TaskWay,
    driven_length,
    is_arrival,
    places_of,
    task_after,
    task_at_end,
    without_reached,
)

CLARIFICATIONS: Final = frozenset({DialogueMove.CONFUSE, DialogueMove.CLARIFY, DialogueMove.CHECK})
"""Moves that repair or make sure (spec: metrics)."""


@dataclass(frozen=True, kw_only=True)
class TalkRecord:
    """Counts of a session's dialogue.

    Attributes:
        utterances: of participant and Co-Wizard.
        exchanges: found anew by the rule (`dialogue.ExchangeTracker`).
        abandoned: of these, those that were given up without an answer.
        clarifications: moves of `CLARIFICATIONS`.
    """

    utterances: int = 0
    exchanges: int = 0
    abandoned: int = 0
    clarifications: int = 0

    def to_json(self) -> dict[str, Any]:
        """Returns the fields."""
        return asdict(self)

    @classmethod
    def from_json(cls, row: Mapping[str, Any]) -> TalkRecord:
        """Reads what `to_json` returned."""
        return cls(**row)


def talk_of(session: Session) -> TalkRecord:
    """Returns the counts of a session."""
    units = Units(session)
    return TalkRecord(
        utterances=len(units.utterances),
        exchanges=len(units.exchanges),
        abandoned=sum(exchange.state is ExchangeState.ABANDONED for exchange in units.states.values()),
        clarifications=sum(
            move.act.move in CLARIFICATIONS for utterance in units.utterances for move in utterance.moves
        ),
    )


# --- Exceptions and recovery ------------------------------------------------------------------------------------------

MIN_PROGRESS: Final = 10.0
"""The car has come forward when so much less is left [m at 40 km/h]: a cell of the router's, its accuracy."""

PROBE_PERIOD: Final = 1.0
"""The car's place is looked at so often [s]."""


@dataclass(frozen=True, kw_only=True)
class MetException:
    """An exception, and what became of it.

    Attributes:
        kind: of the exception.
        met: when it was met [s]; None if never.
        seconds: from then until it was recovered from; None if it was not.
    """

    kind: ExceptionKind
    met: float | None = None
    seconds: float | None = None

    def to_json(self) -> dict[str, Any]:
        """Returns `kind` (lower-case name), `met` and `seconds`."""
        return {"kind": self.kind.name.lower(), "met": self.met, "seconds": self.seconds}

    @classmethod
    def from_json(cls, row: Mapping[str, Any]) -> MetException:
        """Reads what `to_json` returned."""
        return cls(kind=ExceptionKind[row["kind"].upper()], met=row["met"], seconds=row["seconds"])


def met_exceptions(session: Session, town: Town) -> tuple[MetException, ...]:
    """Returns the exceptions of a session, in order, those left out that take something away again.

    Args:
        session: a recorded session.
        town: its map.
    """
    found = []
    for index, event in enumerate(session.events):
        kind = kind_of(event)
        if kind is None or kind in (ExceptionKind.NONE, ExceptionKind.MESSAGE) or _takes_away(kind, event):
            continue
        met = when_met(session, event, kind)
        if math.isinf(met):
            found.append(MetException(kind=kind))
            continue
        seconds = _seconds_to_recovery(session, town, index, met)
        found.append(MetException(kind=kind, met=round(met, 3), seconds=None if math.isinf(seconds) else seconds))
    return tuple(found)


def when_met(session: Session, event: Event, kind: ExceptionKind) -> float:
    """Returns when an exception was met [s], infinity if never; see the module."""
    if kind.is_plan_level:
        return time_met(session, event)
    if kind not in (ExceptionKind.SPAWN_VEHICLES, ExceptionKind.SPAWN_PEDESTRIANS):
        return event.time
    corners = [event.data.get(name) for name in ("x0", "x1", "y0", "y1")]
    numbers = [float(corner) for corner in corners if isinstance(corner, int | float)]
    if len(numbers) < len(corners):
        return event.time  # other corpora do not record the square
    x0, x1, y0, y1 = numbers
    rows = session.trajectory[session.trajectory["frame"] >= event.frame]
    aside = np.maximum(np.maximum(x0 - rows["x"], rows["x"] - x1), 0.0)
    along = np.maximum(np.maximum(y0 - rows["y"], rows["y"] - y1), 0.0)
    near = np.flatnonzero(aside**2 + along**2 <= MEETING_DISTANCE**2)
    return float(rows["frame"][near[0]]) / FRAME_RATE if len(near) else math.inf


def _takes_away(kind: ExceptionKind, event: Event) -> bool:
    return kind is ExceptionKind.DELETE_PROP or (kind is ExceptionKind.SENSOR_FAULT and event.data.get("on") is False)


def _seconds_to_recovery(session: Session, town: Town, index: int, met: float) -> float:
    frame = round(met * FRAME_RATE)
    known = max(index + 1, sum(event.frame <= frame for event in session.events))
    task = task_after(session, known)
    if task.done:
        return 0.0
    step = next((event.frame for event in session.events[known:] if is_arrival(event)), None)
    if step is None:
        return math.inf
    at_step = round((step - frame) / FRAME_RATE, 3)
    frames = range(frame, step, round(PROBE_PERIOD * FRAME_RATE))
    places = places_of(session, town, frames)
    if not places or len(places) < len(frames):
        return at_step  # the recording does not know its lanes
    way = TaskWay(town, task, _on_road(session, known))
    left = [way.left(place) for place in places]
    if not math.isfinite(left[0]):
        return at_step
    behind = max(k for k, metres in enumerate(left) if left[0] - metres < MIN_PROGRESS)
    return min((behind + 1) * PROBE_PERIOD, at_step) if behind + 1 < len(left) else at_step


def _on_road(session: Session, events: int) -> tuple[Place, ...]:
    """Returns the props on the road after a number of events, by their number among those placed."""
    props: list[Place] = []
    for event in session.events[:events]:
        kind, item = kind_of(event), event.data.get("item")
        row = item if isinstance(item, int) and 0 <= item < len(props) else None
        lane, station = event.data.get("lane"), event.data.get("station")
        if kind is ExceptionKind.DELETE_PROP and row is not None:
            del props[row]
        elif isinstance(lane, int) and isinstance(station, int | float):
            if kind is ExceptionKind.PLACE_PROP:
                props.append((lane, float(station)))
            elif kind is ExceptionKind.MOVE_PROP and row is not None:
                props[row] = (lane, float(station))
    return tuple(props)


# --- Record of a driven session ---------------------------------------------------------------------------------------

TIMEOUT: Final = "timeout"
HIT_BY_OTHERS: Final = "hit_by_others"
"""Name of the collisions that are not of the car's own making: they are counted, and cost nothing."""

OUT_OF_TIME: Final = "out of time"
"""Reason of an `End` that cut the session off."""

_RULES: Final = {
    EventType.RED_LIGHT: "red_light",
    EventType.STOP_SIGN: "stop_sign",
    EventType.OFF_ROAD: "off_road",
    EventType.WRONG_WAY: "wrong_way",
}
_TOUCHED: Final = {ObjectClass.PEDESTRIAN: "pedestrian", ObjectClass.VEHICLES: "vehicle"}


@dataclass(frozen=True, kw_only=True)
class SessionRecord:
    """The measures of one session.

    Attributes:
        live: number of live subgoals at the end.
        reached: how many of them were reached.
        success: whether all were, the destination last, without a collision of the car's own making.
        shortest: length of the shortest way through all live subgoals [m]; None where there is none.
        driven: length of the way that was driven [m].
        completion: share of the way that was done, in [0, 1]; None where no way leads to what is left.
        seconds: simulated time.
        decisions: of the agents.
        infractions: how often each kind happened ("pedestrian", "vehicle", "static", "red_light", "stop_sign",
            "timeout", "off_road", "wrong_way", "hit_by_others").
        talk: counts of the dialogue.
        exceptions: those that happened.
    """

    live: int
    reached: int
    success: bool
    shortest: float | None
    driven: float
    completion: float | None
    seconds: float
    decisions: int = 0
    infractions: Mapping[str, int] = field(default_factory=dict)
    talk: TalkRecord = field(default_factory=TalkRecord)
    exceptions: tuple[MetException, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """Returns the fields in JSON types."""
        return {
            **{name: getattr(self, name) for name in _PLAIN},
            "infractions": dict(self.infractions),
            "talk": self.talk.to_json(),
            "exceptions": [each.to_json() for each in self.exceptions],
        }

    @classmethod
    def from_json(cls, row: Mapping[str, Any]) -> SessionRecord:
        """Reads what `to_json` returned; raises `KeyError` or `TypeError` where it is something else."""
        return cls(
            **{name: row[name] for name in _PLAIN},
            infractions=dict(row["infractions"]),
            talk=TalkRecord.from_json(row["talk"]),
            exceptions=tuple(MetException.from_json(each) for each in row["exceptions"]),
        )


_PLAIN: Final = ("live", "reached", "success", "shortest", "driven", "completion", "seconds", "decisions")


def measure(session: Session, town: Town) -> SessionRecord:
    """Returns the measures of a recorded session.

    Args:
        session: one that was played to its end, or as far as it goes.
        town: its map.
    """
    task = task_at_end(session)
    infractions = count_infractions(session)
    own = sum(infractions.get(name, 0) for name in ("pedestrian", "vehicle", "static"))
    start = session.header.departure
    shortest = TaskWay(town, without_reached(task)).shortest(start)
    return SessionRecord(
        live=len(task.live),
        reached=len(task.reached),
        success=task.done and own == 0,
        shortest=None if math.isinf(shortest) else round(shortest, 3),
        driven=round(driven_length(session), 3),
        completion=route_completion(session, town, task),
        seconds=round(session.duration, 3),
        decisions=round(session.duration * session.header.decision_frequency),
        infractions=infractions,
        talk=talk_of(session),
        exceptions=met_exceptions(session, town),
    )


def count_infractions(session: Session) -> dict[str, int]:
    """Returns how often each kind of infraction happened; kinds that did not are left out.

    A collision counts by what was hit: pedestrian, vehicle, or anything else ("static"). One that others caused, while
    the car stood or was run into from behind (`own_fault` of the event), counts as "hit_by_others".
    """
    counts: Counter[str] = Counter()
    for each in session.infractions:
        if each.type is not EventType.COLLISION:
            counts[_RULES[each.type]] += 1
        elif not each.own_fault:
            counts[HIT_BY_OTHERS] += 1
        else:
            counts[_TOUCHED.get(each.other, "static") if each.other is not None else "static"] += 1
    ends = session.of_type(EventType.END)
    counts[TIMEOUT] += sum(event.data.get("reason") == OUT_OF_TIME for event in ends)
    return {name: count for name, count in sorted(counts.items()) if count}


def route_completion(session: Session, town: Town, task: TaskRecord) -> float | None:
    """Returns the share of the way through the live subgoals that was done, in [0, 1].

    1 - (what was left where the car was nearest to the end) / (what there was from the departure), both the router's
    cost in the best order that is allowed. As the leaderboard's it does not fall when the car drives away again: the
    nearest place since the last arrival counts, looked at every two seconds.

    Returns:
        The share; None where no way leads to what is left.
    """
    if task.done:
        return 1.0
    whole = TaskWay(town, without_reached(task)).left(session.header.departure)
    if math.isinf(whole) or whole <= 0.0:
        return None
    way = TaskWay(town, task)
    last = max((event.frame for event in session.events if is_arrival(event)), default=0)
    end = round(session.duration * FRAME_RATE)
    places = places_of(session, town, [*range(last, end, 2 * FRAME_RATE), end]) or [session.header.departure]
    left = min(way.left(place) for place in places)
    return None if math.isinf(left) else round(min(max(1.0 - left / whole, 0.0), 1.0), 6)
