"""State of the scripted participant between decisions: conversation, errand, guidance, route and motion of the car.

Each group is frozen. Its methods are the only places where its fields change, and each returns a new group. A step
works on a shallow copy of `ParticipantState` and replaces whole groups in it; the state handed in is not changed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TypeAlias

from dorothie_gym.maps import Town
from dorothie_gym.ontology import DialogueAct, Role
from dorothie_gym.policies.observation_parser import SeenLandmark, SeenSubgoal
from dorothie_gym.policies.participant.config import ParticipantConfig, ParticipantStyle
from dorothie_gym.policies.policy import DecisionClock
from dorothie_gym.policies.route_progress import RouteState
from dorothie_gym.policies.speech import Remark, SpeechState
from dorothie_gym.policies.utterance_input import HeardUtterance

StepKey: TypeAlias = tuple[str, int, int]
"""Identity of a guidance step: "turn", "lane", "round" or "on", and the lanes concerned."""


@dataclass(frozen=True, kw_only=True)
class ConversationState:
    """Course of the conversation beside the guidance.

    Attributes:
        speech: remarks queued and said.
        heard_at: time of the last utterance of the car [s].
        puzzled_by: utterance of the car that was not understood and has to be repeated.
        asked_at: time of the last question why the car stands [s].
        wondered_at: time at which unexpected behaviour was last asked about, or let pass [s].
        chat_at: time of the next remark beside the task [s].
        lights_at: time at which the head lights were last mentioned [s].
        slowed: whether slowing down for the weather has been dealt with.
        bad_weather_since: start of the present bad weather [s]; infinite in good weather.
        hurried: whether the car has been told to go faster.
    """

    speech: SpeechState = field(default_factory=lambda: SpeechState(role=Role.PARTICIPANT))
    heard_at: float = 0.0
    puzzled_by: HeardUtterance | None = None
    asked_at: float = -math.inf
    wondered_at: float = -math.inf
    chat_at: float = math.inf
    lights_at: float = -math.inf
    slowed: bool = False
    bad_weather_since: float = math.inf
    hurried: bool = False

    def with_speech(self, speech: SpeechState) -> ConversationState:
        """Replaces the queued and said remarks."""
        return replace(self, speech=speech)

    def after_hearing(self, now: float, acts: Sequence[DialogueAct]) -> ConversationState:
        """Notes an utterance of the car at `now` [s]."""
        return replace(self, heard_at=now, speech=self.speech.heard_other(now, acts))

    def with_puzzle(self, heard: HeardUtterance | None) -> ConversationState:
        """Notes an utterance that has to be repeated; None when it has been dealt with."""
        return replace(self, puzzled_by=heard)

    def after_asking_why(self, now: float) -> ConversationState:
        """Notes a question why the car stands."""
        return replace(self, asked_at=now)

    def after_wondering(self, now: float) -> ConversationState:
        """Notes that unexpected behaviour has been dealt with."""
        return replace(self, wondered_at=now)

    def with_next_chat(self, at: float) -> ConversationState:
        """Sets the time of the next remark beside the task [s]."""
        return replace(self, chat_at=at)

    def after_mentioning_lights(self, now: float) -> ConversationState:
        """Notes that the head lights were mentioned."""
        return replace(self, lights_at=now)

    def with_weather(self, now: float, *, bad: bool) -> ConversationState:
        """Updates the beginning of the present bad weather."""
        since = min(self.bad_weather_since, now) if bad else math.inf
        return self if since == self.bad_weather_since else replace(self, bad_weather_since=since)

    def with_slowed(self, slowed: bool) -> ConversationState:
        """Sets whether slowing down for the weather has been dealt with."""
        return replace(self, slowed=slowed)

    def after_hurrying(self) -> ConversationState:
        """Notes that the car was told to go faster."""
        return replace(self, hurried=True)


@dataclass(frozen=True, kw_only=True)
class ErrandState:
    """Subgoals and the one in hand, the target.

    Attributes:
        subgoals: subgoals at the last decision.
        target: index of the target.
        goal: landmark of the target.
        told: whether the car has been told of the target.
        told_at: time at which it was told [s].
        described: whether the place of the target has been described to the car.
        goes_on: whether the next task is named in the breath that reports the last.
        next_at: time before which the next task is not named unless the car asks [s].
        go_at: time at which a car that was told to wait is to go on [s].
        put_off: subgoals that were interrupted and are to be resumed.
    """

    subgoals: tuple[SeenSubgoal, ...] = ()
    target: int | None = None
    goal: SeenLandmark | None = None
    told: bool = False
    told_at: float = -math.inf
    described: bool = False
    goes_on: bool = False
    next_at: float = -math.inf
    go_at: float = math.inf
    put_off: frozenset[int] = frozenset()

    def with_subgoals(self, subgoals: tuple[SeenSubgoal, ...]) -> ErrandState:
        """Sets the subgoals as observed."""
        return replace(self, subgoals=subgoals)

    def with_target(self, index: int, goal: SeenLandmark) -> ErrandState:
        """Sets the target."""
        return replace(self, target=index, goal=goal)

    def without_target(self) -> ErrandState:
        """Drops the target."""
        return replace(self, target=None, goal=None, told=False, described=False)

    def after_telling(self, now: float) -> ErrandState:
        """Notes that the car was told of the target."""
        return replace(self, told=True, told_at=now)

    def after_reminding(self, now: float) -> ErrandState:
        """Notes that the car was reminded of the target."""
        return replace(self, told_at=now)

    def after_describing(self) -> ErrandState:
        """Notes that the place of the target was described."""
        return replace(self, described=True)

    def with_next_task(self, *, goes_on: bool, next_at: float) -> ErrandState:
        """Sets when the next task is named: in the same breath, or not before a time [s]."""
        return replace(self, goes_on=goes_on, next_at=next_at)

    def going_on(self, goes_on: bool) -> ErrandState:
        """Sets whether the next task is named in the same breath."""
        return self if goes_on is self.goes_on else replace(self, goes_on=goes_on)

    def halted_until(self, go_at: float) -> ErrandState:
        """Sets when a waiting car is to go on [s]; infinite for a car that does not wait."""
        return replace(self, go_at=go_at)

    def put_off_target(self) -> ErrandState:
        """Marks the target as interrupted."""
        return self if self.target is None else replace(self, put_off=self.put_off | {self.target})

    def closed(self, index: int) -> ErrandState:
        """Removes a subgoal from those to be resumed."""
        return replace(self, put_off=self.put_off - {index})


@dataclass(frozen=True, kw_only=True)
class GuidanceState:
    """Turn-by-turn guidance to the target.

    Attributes:
        guiding: whether the car is guided turn by turn.
        best: least distance to the target so far [m].
        step: last step that the car was told.
        step_at: time at which it was told [s].
        repeats: number of repetitions of that step.
        u_turns: number of U-turns told on the way to the target.
        lane_changes: lanes that the car was told to leave, and when [s].
        announced: whether the car has been told that the place is near.
        eased: whether it has been told to go slowly because the place is easily missed.
        stop_text: words to stop the car with; empty until they are chosen.
        stopped_at: time at which they were said [s].
        nudged_at: time at which the car was last told to go on a little [s].
        considered: step for which leaving it to a question has been decided on.
        left_to_ask: that decision.
    """

    guiding: bool = False
    best: float = math.inf
    step: StepKey | None = None
    step_at: float = -math.inf
    repeats: int = 0
    u_turns: int = 0
    lane_changes: tuple[tuple[int, float], ...] = ()
    announced: bool = False
    eased: bool = False
    stop_text: str = ""
    stopped_at: float = -math.inf
    nudged_at: float = -math.inf
    considered: StepKey | None = None
    left_to_ask: bool = False

    def with_guiding(self, guiding: bool) -> GuidanceState:
        """Begins or ends the guidance."""
        return self if guiding is self.guiding else replace(self, guiding=guiding)

    def for_new_target(self) -> GuidanceState:
        """Resets everything that belongs to one target."""
        kept = GuidanceState()
        return replace(kept, step_at=self.step_at, considered=self.considered, left_to_ask=self.left_to_ask)

    def with_distance(self, left: float) -> GuidanceState:
        """Updates the least distance to the target [m]."""
        return self if left >= self.best else replace(self, best=left)

    def for_new_route(self, left: float) -> GuidanceState:
        """Restarts step and least distance on a route around a roadblock."""
        return replace(self, best=left, step=None)

    def after_step(self, step: StepKey, now: float, return_time: float) -> GuidanceState:
        """Notes a step told at `now` [s].

        Args:
            step: the step.
            now: time [s].
            return_time: time after which a repeated lane change counts as a return to the lane [s].
        """
        changes = self.lane_changes
        if step[0] == "lane" and all(lane != step[1] or now - told > return_time for lane, told in changes):
            changes = (*changes, (step[1], now))
        return replace(
            self,
            step=step,
            step_at=now,
            repeats=self.repeats + 1 if self.step == step else 0,
            u_turns=self.u_turns + (step[0] == "round"),
            lane_changes=changes,
        )

    def after_reminding(self) -> GuidanceState:
        """Counts a repetition."""
        return replace(self, repeats=self.repeats + 1)

    def without_circling(self, lane: int) -> GuidanceState:
        """Restarts the counts of U-turns, and of lane changes on a lane."""
        return replace(self, u_turns=0, lane_changes=tuple(told for told in self.lane_changes if told[0] != lane))

    def for_another_approach(self) -> GuidanceState:
        """Prepares to announce the place again."""
        return replace(self, announced=False, stop_text="")

    def after_miss(self) -> GuidanceState:
        """Prepares to slow the car down again."""
        return replace(self, eased=False)

    def with_announced(self, announced: bool) -> GuidanceState:
        """Sets whether the place has been announced."""
        return replace(self, announced=announced)

    def after_easing(self) -> GuidanceState:
        """Notes that the car was told to go slowly."""
        return replace(self, eased=True)

    def with_stop_text(self, text: str) -> GuidanceState:
        """Sets the words to stop the car with."""
        return replace(self, stop_text=text)

    def after_stopping(self, now: float) -> GuidanceState:
        """Notes that the car was told to stop."""
        return replace(self, stopped_at=now)

    def after_nudging(self, now: float) -> GuidanceState:
        """Notes that the car was told to go on a little."""
        return replace(self, nudged_at=now)

    def with_consideration(self, step: StepKey, left_to_ask: bool) -> GuidanceState:
        """Notes whether a step is left to a question of the car."""
        return replace(self, considered=step, left_to_ask=left_to_ask)


@dataclass(frozen=True, kw_only=True)
class MotionState:
    """Observed motion of the car.

    Attributes:
        standing_since: start of the standstill that needs an explanation [s]; None while the car moves.
        moved_at: time at which the car was last seen to move [s].
        excused_until: time until which a standstill is not asked about [s].
        speed: speed at the last decision [m/s].
    """

    standing_since: float | None = 0.0
    moved_at: float = 0.0
    excused_until: float = 0.0
    speed: float = 0.0

    def observed(self, now: float, *, standing: bool) -> MotionState:
        """Updates the standstill."""
        if not standing:
            return replace(self, standing_since=None, moved_at=now)
        return self if self.standing_since is not None else replace(self, standing_since=now)

    def at_red_light(self, now: float, start_time: float) -> MotionState:
        """Restarts the standstill at a red light and excuses the time to start afterwards [s]."""
        return replace(self, standing_since=now, excused_until=max(self.excused_until, now + start_time))

    def excused(self, until: float) -> MotionState:
        """Excuses a standstill until a time [s]."""
        return replace(self, excused_until=until)

    def with_speed(self, speed: float) -> MotionState:
        """Sets the speed for the next decision [m/s]."""
        return self if speed == self.speed else replace(self, speed=speed)

    def standstill(self, now: float) -> float:
        """Returns the duration of the standstill [s]; 0 for a moving car."""
        return 0.0 if self.standing_since is None else now - self.standing_since


@dataclass(kw_only=True)
class ParticipantState:
    """State of the scripted participant; a step works on a shallow copy.

    Attributes:
        seed: seed of all random draws.
        town: the map.
        style: traits drawn for the session.
        config: tunable numbers.
        count: number of decisions taken.
        clock: time between decisions.
        conversation: course of the conversation.
        errand: subgoals and target.
        guidance: turn-by-turn guidance to the target.
        route: route to the target.
        motion: observed motion of the car.
    """

    seed: int
    town: Town
    style: ParticipantStyle
    config: ParticipantConfig = field(default_factory=ParticipantConfig)
    count: int = 0
    clock: DecisionClock = field(default_factory=DecisionClock)
    conversation: ConversationState = field(default_factory=ConversationState)
    errand: ErrandState = field(default_factory=ErrandState)
    guidance: GuidanceState = field(default_factory=GuidanceState)
    route: RouteState = field(default_factory=RouteState)
    motion: MotionState = field(default_factory=MotionState)

    @property
    def speech(self) -> SpeechState:
        """Remarks queued and said."""
        return self.conversation.speech

    @speech.setter
    def speech(self, speech: SpeechState) -> None:
        self.conversation = self.conversation.with_speech(speech)

    def say(self, *remarks: Remark) -> None:
        """Queues remarks at the end."""
        self.speech = self.speech.plan(*remarks)

    def say_first(self, *remarks: Remark) -> None:
        """Queues remarks in front."""
        self.speech = self.speech.plan_first(*remarks)

    def say_only(self, *remarks: Remark) -> None:
        """Replaces the queued remarks."""
        self.speech = self.speech.cleared().plan(*remarks)

    def set_guiding(self, guiding: bool) -> None:
        """Begins or ends the guidance."""
        self.guidance = self.guidance.with_guiding(guiding)

    def forget_target(self) -> None:
        """Drops the target with its route and guidance; roadblocks stay known."""
        self.errand = self.errand.without_target()
        self.route = self.route.with_progress(None).for_new_goal()
        self.guidance = self.guidance.for_new_target()
