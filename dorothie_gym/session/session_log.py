"""Log of a session in progress: events, refusals, counts and changes of subgoals, and the types of the summary."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Final, NotRequired, TypeAlias, TypedDict

from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import ARRIVAL_DISTANCE
from dorothie_gym.session.recording.events import Event, EventType
from dorothie_gym.sim.traffic_rules import INFRACTION_KINDS, WorldEvent, WorldEventKind
from dorothie_gym.support import portable_math as pm

if TYPE_CHECKING:
    from dorothie_gym.session.dialogue_channel import DialogueChannel
    from dorothie_gym.session.scenario import Scenario
    from dorothie_gym.sim.world import World
    from dorothie_gym.tasks.storyboard import TaskState

_WORLD_EVENTS = {
    WorldEventKind.HAZARD_STOP: EventType.HAZARD_STOP,
    WorldEventKind.HAZARD_END: EventType.HAZARD_END,
    WorldEventKind.COLLISION: EventType.COLLISION,
    WorldEventKind.RED_LIGHT: EventType.RED_LIGHT,
    WorldEventKind.STOP_SIGN: EventType.STOP_SIGN,
    WorldEventKind.OFF_ROAD: EventType.OFF_ROAD,
    WorldEventKind.WRONG_WAY: EventType.WRONG_WAY,
}

_INFRACTIONS = tuple((kind.value, kind) for kind in INFRACTION_KINDS)

EventData: TypeAlias = dict[str, object]
"""Data of an event, in JSON types."""

Outcome: TypeAlias = str | EventData
"""Reason of a refusal, or the event data of an executed action."""


class SubgoalCounts(TypedDict):
    """Number of subgoals that are live, and of those that are reached."""

    live: int
    reached: int


class SessionCounts(TypedDict):
    """Counts of the roles' actions."""

    utterances: int
    acts: int
    physical_actions: int
    exceptions: int
    refusals: int


class SessionSummary(SessionCounts):
    """State of a session; `reason` is set when it has ended ("arrived", "out of time" and the like).

    `usage` is set for sessions with policies that have a cost (calls, tokens), by role.
    """

    success: bool
    arrived: bool
    subgoals: SubgoalCounts
    collisions: int
    infractions: dict[str, int]
    seconds: float
    exchanges: int
    transactions: int
    reason: NotRequired[str]
    usage: NotRequired[Mapping[str, Mapping[str, object]]]


REFUSABLE: Final[Mapping[Role, tuple[str, ...]]] = MappingProxyType(
    {
        Role.PARTICIPANT: ("speech",),
        Role.CO_WIZARD: ("speech", "mental", "physical"),
        Role.AD_WIZARD: ("exception",),
    }
)
"""Kinds of actions of each role that can be refused, the keys of `info["refused"]`; a decision has one of each."""


_NO_REFUSALS: Final[Mapping[Role, Mapping[str, str]]] = {
    role: dict.fromkeys(kinds, "") for role, kinds in REFUSABLE.items()
}
_NONE_REFUSED: Final[Mapping[Role, Sequence[str]]] = {role: () for role in REFUSABLE}


class EventLog:
    """Events and refusals of the last decision, and counts of the session.

    Attributes:
        events: events of the last decision.
        refusals: reason for the refusal of each kind of action at the last decision, by role; "" where none was.
        counts: counts of the roles' actions so far.
    """

    def __init__(self, world: World) -> None:
        self._world = world
        self.counts = SessionCounts(utterances=0, acts=0, physical_actions=0, exceptions=0, refusals=0)
        self.clear()

    def clear(self) -> None:
        """Begins another decision."""
        self.events: list[Event] = []
        self.refusals = _NO_REFUSALS

    @property
    def refused(self) -> Mapping[Role, Sequence[str]]:
        """Reasons for the refusals of the last decision, by role."""
        if self.refusals is _NO_REFUSALS:
            return _NONE_REFUSED
        return {role: [reason for reason in kinds.values() if reason] for role, kinds in self.refusals.items()}

    def add(
        self,
        kind: EventType,
        source: Role,
        data: Mapping[str, object],
        *,
        flagged: bool = False,
        frame: int | None = None,
    ) -> None:
        """Logs an event; its frame is the current one unless another is given."""
        at = self._world.frame if frame is None else frame
        self.events.append(Event(frame=at, type=kind, source=source, flagged=flagged, data=dict(data)))

    def add_world_event(self, event: WorldEvent) -> None:
        """Logs an event of the world."""
        self.add(_WORLD_EVENTS[event.kind], Role.AGENT, event.data, frame=event.frame)

    def refuse(self, role: Role, kind: str, action: str, reason: str) -> None:
        """Logs the refusal of an action of one of the role's kinds."""
        assert self.refusals[role][kind] == ""  # one action of each kind in a decision
        self.refusals = {**self.refusals, role: {**self.refusals[role], kind: f"{action}: {reason}"}}
        self.counts["refusals"] += 1
        self.add(EventType.REFUSAL, role, {"action": action, "reason": reason})

    @property
    def infractions(self) -> dict[str, int]:
        """Number of infractions so far by kind, collisions of any cause included."""
        counts = self._world.reports.infractions
        return {name: counts.get(kind, 0) for name, kind in _INFRACTIONS}

    def summary(self, task: TaskState, dialogue: DialogueChannel, *, reached: int, success: bool) -> SessionSummary:
        """Returns the state of the session in JSON types, without the reason of its end.

        Args:
            task: progress in the storyboard.
            dialogue: dialogue channel, which counts exchanges and transactions.
            reached: number of live subgoals that are reached.
            success: whether every live subgoal is reached and no collision was caused by the ego.
        """
        counts = self.counts
        return SessionSummary(
            success=success,
            arrived=task.done,
            subgoals=SubgoalCounts(live=len(task.live), reached=reached),
            collisions=self._world.collisions,
            infractions=self.infractions,
            seconds=round(self._world.time, 3),
            utterances=counts["utterances"],
            acts=counts["acts"],
            physical_actions=counts["physical_actions"],
            exceptions=counts["exceptions"],
            refusals=counts["refusals"],
            exchanges=dialogue.exchanges,
            transactions=dialogue.transactions,
        )


class SubgoalTracker:
    """Tracker of the subgoals: logs arrivals and changes of status, and passes them to the dialogue annotation.

    Args:
        scenario: scenario of the session.
        task: progress in the storyboard.
        dialogue: dialogue channel, whose transactions end with a subgoal.
        log: log of the session.
    """

    def __init__(self, scenario: Scenario, task: TaskState, dialogue: DialogueChannel, log: EventLog) -> None:
        storyboard = scenario.storyboard
        self._task, self._dialogue, self._log = task, dialogue, log
        self._landmarks = storyboard.landmarks
        self._statuses = [task.status(i) for i in range(len(storyboard.subgoals))]
        self._waypoints = [(*landmark.waypoint, landmark.index) for landmark in storyboard.landmarks]
        self._known_reached = (-1, 0)  # version of the task, number of its live subgoals that are reached

    @property
    def reached(self) -> int:
        """Number of live subgoals that are reached."""
        version, reached = self._known_reached
        if version != self._task.version:
            reached = sum(self._task.reached(i) for i in self._task.live)
            self._known_reached = self._task.version, reached
        return reached

    def note_arrivals(self, x: float, y: float) -> None:
        """Completes the subgoals whose waypoint is close to the place (x, y) of a standing ego [m]."""
        for place_x, place_y, landmark in self._waypoints:
            if abs(place_x - x) <= ARRIVAL_DISTANCE and pm.hypot(place_x - x, place_y - y) <= ARRIVAL_DISTANCE:
                for i in self._task.arrive(landmark):
                    self._add(i, "arrival")
                self._statuses = [self._task.status(i) for i in range(len(self._statuses))]

    def note_changes(self, cause: str) -> None:
        """Logs the subgoals whose status has changed, with the name of the exception that changed them."""
        for i, before in enumerate(self._statuses):
            self._statuses[i] = self._task.status(i)
            if self._statuses[i] is not before:
                self._add(i, cause)

    def _add(self, i: int, cause: str) -> None:
        landmark, status = self._landmarks[self._task.landmark_of(i)], self._task.status(i)
        self._dialogue.note(landmark.name, status)
        data = {"subgoal": i, "landmark": landmark.name.label, "status": status.label, "cause": cause}
        self._log.add(EventType.SUBGOAL, Role.AGENT, data)
