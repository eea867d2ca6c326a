"""Measurements of a driven session: the numbers from which every closed-loop metric is computed."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Final, NotRequired, TypeAlias, TypedDict

import numpy as np
from msgspec import Meta

from dorothie_gym.dialogue.exchanges import ExchangeState
from dorothie_gym.errors import RolloutError, short_repr
from dorothie_gym.evaluation.analysis.exception_attribution import MEETING_DISTANCE, kind_of, time_met
from dorothie_gym.evaluation.analysis.units import Units
from dorothie_gym.evaluation.closed_loop.infractions import InfractionEvent, InfractionPage, infraction_kind
from dorothie_gym.evaluation.closed_loop.metric import TIMEOUT
from dorothie_gym.evaluation.closed_loop.sub_scores import ConductPage, ConductRecord, conduct_of
from dorothie_gym.evaluation.closed_loop.talk_verdict import TalkVerdict, TalkVerdictPage, verdict_of
from dorothie_gym.evaluation.closed_loop.task_progress import (
    TaskRecord,
    TaskRoutes,
    driven_length,
    is_arrival,
    places_of,
    task_after,
    task_at_end,
    without_reached,
)
from dorothie_gym.ontology.dialogue_acts import DialogueMove
from dorothie_gym.ontology.world_exceptions import ExceptionKind
from dorothie_gym.session.recording.events import EndReason, Event, EventType
from dorothie_gym.session.scenario import ReferenceDrive, ReferencePage, recorded_reference
from dorothie_gym.sim.config import FRAME_RATE

if TYPE_CHECKING:
    from dorothie_gym.maps.routing import Place
    from dorothie_gym.maps.town import Town
    from dorothie_gym.session.recording.session import Session

Count: TypeAlias = Annotated[int, Meta(ge=0, lt=2**31)]
"""Number in JSON."""

Amount: TypeAlias = Annotated[float, Meta(ge=0.0, le=1e12)]
"""Duration or length in JSON [s, m]."""

Share: TypeAlias = Annotated[float, Meta(ge=0.0, le=1.0)]
"""Share in JSON."""

CLARIFICATIONS: Final = frozenset({DialogueMove.CONFUSE, DialogueMove.CLARIFY, DialogueMove.CHECK})
"""Moves that repair or check understanding (spec: metrics)."""


class TalkPage(TypedDict):
    """Counts of a session's dialogue in JSON types; fields as in `TalkRecord`."""

    utterances: Count
    exchanges: Count
    abandoned: Count
    clarifications: Count


@dataclass(frozen=True, kw_only=True)
class TalkRecord:
    """Counts of a session's dialogue.

    Attributes:
        utterances: number of utterances of participant and Co-Wizard.
        exchanges: number of exchanges, derived by the rule of `dialogue.exchanges`.
        abandoned: number of exchanges that were abandoned without an answer.
        clarifications: number of moves of `CLARIFICATIONS`.
    """

    utterances: int = 0
    exchanges: int = 0
    abandoned: int = 0
    clarifications: int = 0

    def to_json(self) -> TalkPage:
        """Returns the fields in JSON types."""
        return {
            "utterances": self.utterances,
            "exchanges": self.exchanges,
            "abandoned": self.abandoned,
            "clarifications": self.clarifications,
        }

    @classmethod
    def from_json(cls, row: TalkPage) -> TalkRecord:
        """Parses the output of `to_json`."""
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
"""Decrease of the remaining route that counts as progress [m at 40 km/h]: a cell, thus the accuracy, of the router."""

PROBE_PERIOD: Final = 1.0
"""Period at which the remaining route is computed [s]."""


class MetExceptionPage(TypedDict):
    """Exception in JSON types; fields as in `MetException`."""

    kind: str
    met: Amount | None
    seconds: Amount | None


@dataclass(frozen=True, kw_only=True)
class MetException:
    """Exception of a session, with the times of meeting it and of recovery.

    Attributes:
        kind: kind of the exception.
        met: time at which it was met [s]; None if never.
        seconds: time from then until recovery [s]; None without recovery.
    """

    kind: ExceptionKind
    met: float | None = None
    seconds: float | None = None

    def to_json(self) -> MetExceptionPage:
        """Returns `kind` (lower-case name), `met` and `seconds`."""
        return {"kind": self.kind.name.lower(), "met": self.met, "seconds": self.seconds}

    @classmethod
    def from_json(cls, row: MetExceptionPage) -> MetException:
        """Parses the output of `to_json`; raises `RolloutError` if the kind is unknown."""
        kind = ExceptionKind.__members__.get(row["kind"].upper())
        if kind is None:
            raise RolloutError(f"field 'kind' is {short_repr(row['kind'])}; it must be a kind of exceptions")
        return cls(kind=kind, met=row["met"], seconds=row["seconds"])


def met_exceptions(session: Session, town: Town) -> tuple[MetException, ...]:
    """Returns the exceptions of a session in order, without those that remove a prop or end a sensor fault.

    Args:
        session: a recorded session.
        town: its town.
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
    """Returns the time at which an exception was met [s]; infinity if never.

    An object on the road is met when the car comes within `MEETING_DISTANCE` of it, spawned actors when the car comes
    that near to their square, and any other exception when it takes effect.
    """
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
    """Returns the time from meeting an exception to recovery [s]; infinity without recovery.

    Args:
        session: a recorded session.
        town: its town.
        index: number of the exception's event.
        met: time at which it was met [s].
    """
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
        return at_step  # the lanes were not recorded
    way = TaskRoutes(town, task, _on_road(session, known))
    left = [way.remaining(place) for place in places]
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


class SessionRecordPage(TypedDict):
    """Measures of one session in JSON types; fields as in `SessionRecord`."""

    live: Count
    reached: Count
    success: bool
    shortest: Amount | None
    driven: Amount
    completion: Share | None
    seconds: Amount
    decisions: Count
    infractions: dict[str, Count]
    talk: TalkPage
    exceptions: list[MetExceptionPage]
    conduct: NotRequired[ConductPage]
    reference: NotRequired[ReferencePage]
    talk_task: NotRequired[TalkVerdictPage]
    infraction_events: NotRequired[list[InfractionPage]]


@dataclass(frozen=True, kw_only=True)
class SessionRecord:
    """Measures of one session.

    Attributes:
        live: number of live subgoals at the end.
        reached: number of live subgoals that were reached.
        success: whether all live subgoals were reached, the destination last, without a collision caused by the car.
        shortest: length of the shortest route through all live subgoals [m]; None without a route.
        driven: distance driven [m].
        completion: completed share of the route, in [0, 1]; None if no route leads to the remaining subgoals.
        seconds: simulated time [s].
        decisions: number of decisions of the agents.
        infractions: number of infractions of each kind ("pedestrian", "vehicle", "static", "red_light", "stop_sign",
            "timeout", "off_road", "wrong_way", "hit_by_others").
        talk: counts of the dialogue.
        exceptions: exceptions of the session.
        conduct: answers, truth and comfort; None in results of versions that did not measure them.
        reference: reference of the scenario; None if it was not measured.
        talk_task: verdict on the talk task; None if the session has none.
        infraction_events: time, place and counterpart of each infraction but "timeout", in order.
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
    conduct: ConductRecord | None = None
    reference: ReferenceDrive | None = None
    talk_task: TalkVerdict | None = None
    infraction_events: tuple[InfractionEvent, ...] = ()

    @property
    def passed(self) -> bool:
        """Whether the session does what its scenario asks for: the right reaction to a talk task, else `success`."""
        return self.success if self.talk_task is None else self.talk_task.passed

    def to_json(self) -> SessionRecordPage:
        """Returns the fields in JSON types; the last four are left out if there are none."""
        page: SessionRecordPage = {
            "live": self.live,
            "reached": self.reached,
            "success": self.success,
            "shortest": self.shortest,
            "driven": self.driven,
            "completion": self.completion,
            "seconds": self.seconds,
            "decisions": self.decisions,
            "infractions": dict(self.infractions),
            "talk": self.talk.to_json(),
            "exceptions": [each.to_json() for each in self.exceptions],
        }
        if self.conduct is not None:
            page["conduct"] = self.conduct.to_json()
        if self.reference is not None:
            page["reference"] = self.reference.to_json()
        if self.talk_task is not None:
            page["talk_task"] = self.talk_task.to_json()
        if self.infraction_events:
            page["infraction_events"] = [each.to_json() for each in self.infraction_events]
        return page

    @classmethod
    def from_json(cls, row: SessionRecordPage) -> SessionRecord:
        """Parses the output of `to_json`; raises `RolloutError` if the fields contradict each other."""
        if row["reached"] > row["live"]:
            raise RolloutError(f"field 'reached' is {row['reached']}, more than the {row['live']} live subgoals")
        return cls(
            live=row["live"],
            reached=row["reached"],
            success=row["success"],
            shortest=row["shortest"],
            driven=row["driven"],
            completion=row["completion"],
            seconds=row["seconds"],
            decisions=row["decisions"],
            infractions=dict(row["infractions"]),
            talk=TalkRecord.from_json(row["talk"]),
            exceptions=tuple(MetException.from_json(each) for each in row["exceptions"]),
            conduct=ConductRecord.from_json(row["conduct"]) if "conduct" in row else None,
            reference=ReferenceDrive.from_json(row["reference"]) if "reference" in row else None,
            talk_task=TalkVerdict.from_json(row["talk_task"]) if "talk_task" in row else None,
            infraction_events=tuple(InfractionEvent.from_json(each) for each in row.get("infraction_events", [])),
        )


def measure(session: Session, town: Town) -> SessionRecord:
    """Returns the measures of a recorded session.

    Args:
        session: a complete or an interrupted session.
        town: its town.
    """
    task = task_at_end(session)
    infractions = count_infractions(session)
    own = sum(infractions.get(name, 0) for name in ("pedestrian", "vehicle", "static"))
    start = session.header.departure
    shortest = TaskRoutes(town, without_reached(task)).shortest(start)
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
        conduct=conduct_of(session, town),
        reference=recorded_reference(session.header),
        talk_task=verdict_of(session, town),
        infraction_events=tuple(InfractionEvent.of(each) for each in session.infractions),
    )


def count_infractions(session: Session) -> dict[str, int]:
    """Returns the number of infractions of each kind (`infraction_kind`); kinds without infractions are left out."""
    counts = Counter(infraction_kind(each) for each in session.infractions)
    ends = session.of_type(EventType.END)
    counts[TIMEOUT] += sum(event.data.get("reason") == EndReason.OUT_OF_TIME for event in ends)
    return {name: count for name, count in sorted(counts.items()) if count}


def route_completion(session: Session, town: Town, task: TaskRecord) -> float | None:
    """Returns the completed share of the route through the live subgoals, in [0, 1].

    It is 1 - remaining / total, both the router's cost in the best allowed order. As in the CARLA leaderboard, it does
    not fall when the car drives away again: the smallest remaining cost since the last arrival counts, computed every
    two seconds.

    Returns:
        The share; None if no route leads to the remaining subgoals.
    """
    if task.done:
        return 1.0
    whole = TaskRoutes(town, without_reached(task)).remaining(session.header.departure)
    if math.isinf(whole) or whole <= 0.0:
        return None
    way = TaskRoutes(town, task)
    last = max((event.frame for event in session.events if is_arrival(event)), default=0)
    end = round(session.duration * FRAME_RATE)
    places = places_of(session, town, [*range(last, end, 2 * FRAME_RATE), end]) or [session.header.departure]
    left = min(way.remaining(place) for place in places)
    return None if math.isinf(left) else round(min(max(1.0 - left / whole, 0.0), 1.0), 6)
