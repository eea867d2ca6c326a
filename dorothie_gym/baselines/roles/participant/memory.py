"""Working memory of the learned participant: the target, the route to it, past remarks and events.

The target and whether the car is guided are chosen by the network. Everything else is derived from its observation and
remarks, in the records that the scripted participant keeps as well (`ParticipantState`).
"""

from __future__ import annotations

import enum
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from dorothie_gym.baselines.roles.learned_role.remark_forms import topic_of
from dorothie_gym.baselines.roles.participant.records import note_remark
from dorothie_gym.dialogue.speaker_style import draw_style
from dorothie_gym.ontology.dialogue_acts import DialogueMove
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import GoalStatus, LandmarkName, ObjectClass, Slot
from dorothie_gym.policies.participant.config import ParticipantConfig, ParticipantStyle
from dorothie_gym.policies.participant.failed_guidance import stop_circling
from dorothie_gym.policies.participant.final_approach import prepare_stop
from dorothie_gym.policies.participant.route_steps import is_last_stretch
from dorothie_gym.policies.participant.standstill import TURN_TIME, excuse_at_light
from dorothie_gym.policies.participant.state import ParticipantState, StepKey
from dorothie_gym.policies.participant.turn_by_turn_guidance import follow_route
from dorothie_gym.policies.participant.unprompted_remarks import note_blocked
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.route_progress import RouteProgress
from dorothie_gym.policies.speech import Remark, SpeechState

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.policies.heard_utterance import HeardUtterance
    from dorothie_gym.policies.observation_parser import SeenLandmark, SeenSubgoal
    from dorothie_gym.policies.participant.view import ParticipantView

AVERAGE: Final = ParticipantStyle(
    guides=0.0, names_street=0.2, hurries=0.3, patience=10.0, chat=250.0, waits=0.4, hints=0.2,
    reasons=0.12, aligns=0.02, nods=0.5, curious=0.05, notices=0.9, puzzled=0.0, points_out=0.5, thanks=0.5,
    verifies=0.05,
)  # fmt: skip
"""Style of the learned participant's records, and of the teacher in practice: few choices are random."""

KEEP_TARGET: Final = -1
"""TargetChoice of the target: no change."""

LONGEST_WAIT: Final = 12.0
"""Time after which a remark that could not be said is dropped [s]."""


class NotedEvent(enum.IntEnum):
    """Event of the tasks, the drive or the talk; the memory keeps its time and its place."""

    DONE = 0
    ADDED = 1
    DROPPED = 2
    MOVED = 3
    """The place of a task was changed; the place is the new one."""
    FORMER = 4
    """As `MOVED`; the place is the old one."""
    MESSAGE = 5
    MISSED = 6
    PASSED = 7
    STRAYED = 8
    """A new route was planned because the car has left the previous one."""
    WRONG_TURN = 9
    REROUTED = 10
    """A route that avoids manoeuvres was planned after failures."""
    BLOCKED = 11
    RED_LIGHT = 12


@dataclass(frozen=True, kw_only=True)
class TargetChoice:
    """Output of the network for the memory.

    Attributes:
        target: number of the subgoal that becomes the target; `KEEP_TARGET` for no change.
        guiding: whether the car is guided turn by turn.
    """

    target: int = KEEP_TARGET
    guiding: bool = False


@dataclass(frozen=True, kw_only=True)
class SessionMemory:
    """Working memory.

    Attributes:
        records: records of tasks, route, guidance, motion and talk; they are not changed.
        events: time [s] and place of the latest of each kind of event; places are None where none belongs to it.
        said_at: time of its last remark by predicate or, without content, by move [s].
        message: the latest message.
    """

    records: ParticipantState
    events: tuple[tuple[NotedEvent, float, LandmarkName | None], ...] = ()
    said_at: tuple[tuple[str, float], ...] = ()
    message: str = ""

    @classmethod
    def begin(cls, town: Town, seed: int) -> SessionMemory:
        """Returns the memory before the first decision, with the voice of an average speaker."""
        style = draw_style(Role.PARTICIPANT, np.random.default_rng((seed, 0)))
        voice = SpeechState(role=Role.PARTICIPANT, style=style)
        return cls(
            records=ParticipantState(seed=seed, town=town, style=AVERAGE, config=ParticipantConfig(), speech=voice)
        )

    def event(self, kind: NotedEvent) -> tuple[float, LandmarkName | None] | None:
        """Returns time and place of the latest event of a kind; None if there was none."""
        return next(((at, place) for event, at, place in self.events if event is kind), None)

    def happened(self, kind: NotedEvent, now: float, place: LandmarkName | None = None) -> SessionMemory:
        """Records an event."""
        events = tuple(one for one in self.events if one[0] is not kind)
        return replace(self, events=(*events, (kind, now, place)))

    def looking(self, view: ParticipantView) -> tuple[SessionMemory, ParticipantView]:
        """Brings tasks, motion and route up to date with an observation; returns the view as it is understood."""
        records, _ = self.records.next_decision()
        records.clock = records.clock.ticked(view.time)
        if view.turning and records.motion.standstill(view.time) > TURN_TIME:
            view = replace(view, turning=False)
        records.motion = records.motion.observed(view.time, standing=view.standing)
        moved_at = records.motion.standing_since
        excuse_at_light(records, view)
        memory = replace(self, records=records)
        if records.motion.standing_since != moved_at:
            memory = memory.happened(NotedEvent.RED_LIGHT, view.time)
        text = str(view.raw["message"]).strip()
        if text and text != self.message:
            memory = replace(memory, message=text).happened(NotedEvent.MESSAGE, view.time)
        return memory._noting_tasks(view)._following(view), view

    def hearing(self, heard: HeardUtterance, view: ParticipantView, rng: np.random.Generator) -> SessionMemory:
        """Processes an utterance of the car, which may be answered and whose content is not repeated."""
        records = self._copied()
        records.conversation = records.conversation.after_hearing(view.time)
        speech = records.speech.heard_other(view.time, heard.acts, rng, records.clock.interval / 2.0)
        records.speech = speech.without_told(heard.words.told)
        memory = replace(self, records=records)
        explained = [act for act in heard.acts if act.move is DialogueMove.EXPLAIN and act.values(Slot.OBJECT)]
        if explained:
            records.motion = records.motion.excused(view.time + records.config.excuse_time)
        if any(ObjectClass.STATIC in act.values(Slot.OBJECT) for act in explained):
            memory = memory._noting_blocked(view, near=True)
        return memory

    def chosen(self, choice: TargetChoice, view: ParticipantView, rng: np.random.Generator) -> SessionMemory:
        """Stores a choice of the network, and prepares the words for the stop at the target."""
        records = self._copied()
        if choice.target != KEEP_TARGET and choice.target != records.task.target:
            subgoal = view.subgoals[choice.target]
            landmark = view.landmark(subgoal.landmark)
            if landmark is not None:
                _aim_at(records, view, subgoal, landmark)
        records.set_guiding(choice.guiding)
        progress = records.route.progress
        if progress is not None and is_last_stretch(records, view) and not view.standing:
            prepare_stop(records, view, progress.left(view.station), rng)
        return replace(self, records=records)

    def decided(self, remarks: Sequence[Remark], view: ParticipantView, rng: np.random.Generator) -> SessionMemory:
        """Records remarks and queues them; urgent remarks replace queued ones."""
        records, memory = self._copied(), self
        voice = records.speech
        if any(GoalStatus.COMPLETE in one.act.slots for one in remarks):
            # leaves the car time to report its arrival first
            voice = voice.hold(view.time + float(rng.uniform(*records.config.report_delay)))
        if remarks:
            planned = [replace(one, expires=min(one.expires, view.time + LONGEST_WAIT)) for one in remarks]
            voice = voice.cleared().plan(*planned) if remarks[0].urgent else voice.plan_first(*planned)
        for one in remarks:
            note_remark(records, view, one)
            topic = topic_of(one)
            said = (*(pair for pair in memory.said_at if pair[0] != topic), (topic, view.time))
            memory = replace(memory, said_at=said)
        records.speech = voice
        return replace(memory, records=records)

    def spoken(self, speech: SpeechState, view: ParticipantView) -> SessionMemory:
        """Stores the voice after a decision, and the speed of the car for the next one."""
        records = self._copied()
        records.speech, records.motion = speech, records.motion.with_speed(view.speed)
        return replace(self, records=records)

    def _copied(self) -> ParticipantState:
        return replace(self.records)

    def _noting_tasks(self, view: ParticipantView) -> SessionMemory:
        """Records tasks that are done, new, dropped or changed; a target that is no longer open is given up."""
        memory, records, now = self, self._copied(), view.time
        before = records.task.subgoals
        records.task = records.task.with_subgoals(view.subgoals, str(view.raw["tasks"]))
        for old, new in zip(before, view.subgoals, strict=False):
            place, former = _name(view, new), _name(view, old)
            moved = new.open and old.open and new.landmark != old.landmark
            if new.reached and not old.reached:
                memory = memory.happened(NotedEvent.DONE, now, place)
                records.task = records.task.closed(new.index).after_finishing(place, now)
            elif new.open and not old.live:
                memory = memory.happened(NotedEvent.ADDED, now, place)
            elif old.open and not new.live:
                memory = memory.happened(NotedEvent.DROPPED, now, former)
                records.task = records.task.closed(new.index)
            elif moved:
                memory = memory.happened(NotedEvent.MOVED, now, place).happened(NotedEvent.FORMER, now, former)
            if new.index == records.task.target and (moved or not (new.open and new.allowed)):
                records.forget_target()
                next_at = now + records.config.next_task_delay if new.reached else now
                records.task = records.task.with_next_task(same_breath=False, next_at=next_at)
        return replace(memory, records=records)

    def _following(self, view: ParticipantView) -> SessionMemory:
        """Follows the route; plans another one if the car has left it, or if it has failed twice."""
        memory = self._noting_blocked(view, near=False)
        records = memory._copied()
        guiding, guidance, route = records.guidance.guiding, records.guidance, records.route
        _silently(records, lambda: follow_route(records, view))
        after, now = records.guidance, view.time
        if route.progress is not None and records.route.progress is not None:
            if records.route.progress.route is not route.progress.route:
                memory = memory.happened(NotedEvent.STRAYED, now)
            if records.route.misses > route.misses:
                memory = memory.happened(NotedEvent.MISSED, now)
            if after.passes > guidance.passes:
                memory = memory.happened(NotedEvent.PASSED, now)
            wrong = _is_wrong_turn(guidance.step, route.progress, records.route.progress, view, records.config)
            if wrong and guiding:
                memory = memory.happened(NotedEvent.WRONG_TURN, now)
        astray = records.route.progress is not None and records.route.progress.astray > 0
        if records.route.progress is not None and records.task.announced and not view.turning and not astray:
            _silently(records, lambda: stop_circling(records, view))
        costs = [None if one is None else one.manoeuvre_cost for one in (route.progress, records.route.progress)]
        if None not in costs and (costs[0] != costs[1] or records.route.avoided != route.avoided):
            memory = memory.happened(NotedEvent.REROUTED, now)
        records.set_guiding(guiding)
        return replace(memory, records=records)

    def _noting_blocked(self, view: ParticipantView, *, near: bool) -> SessionMemory:
        """Records obstacles on the route, and plans around them."""
        records = self._copied()
        known = records.route.blocked
        _silently(records, lambda: note_blocked(records, view, near=near))
        memory = replace(self, records=records)
        return memory.happened(NotedEvent.BLOCKED, view.time) if records.route.blocked != known else memory


def _silently(records: ParticipantState, bookkeeping: Callable[[], None]) -> None:
    """Updates the records of the scripted participant without its remarks."""
    voice = records.speech
    bookkeeping()
    records.speech = voice


def _name(view: ParticipantView, subgoal: SeenSubgoal) -> LandmarkName | None:
    landmark = view.landmark(subgoal.landmark)
    return None if landmark is None else landmark.name


def _is_wrong_turn(
    step: StepKey | None, former: RouteProgress, now: RouteProgress, view: ParticipantView, config: ParticipantConfig
) -> bool:
    """Returns whether the car has just left the route at a turn that was announced."""
    if step is None or step[0] != "turn" or now.route is former.route:
        return False
    return now.left(view.station) > former.left(view.station) + config.wrong_turn_detour


def _aim_at(records: ParticipantState, view: ParticipantView, subgoal: SeenSubgoal, landmark: SeenLandmark) -> None:
    """Makes a subgoal the target; an open previous target is postponed."""
    if records.task.target is not None:
        records.task = records.task.put_off_target()
        records.forget_target()
    records.task = records.task.with_target(subgoal.index, landmark)
    blocked, cost = records.route.blocked, records.config.manoeuvre_cost
    progress = RouteProgress.plan(records.town, view.place, landmark.place, blocked, cost)
    records.route = records.route.with_progress(progress)
