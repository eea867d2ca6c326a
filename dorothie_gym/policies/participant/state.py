"""State of the scripted participant between decisions: conversation, tasks, guidance, route and motion of the car.

Each group is frozen. Its methods are the only places where its fields change, and each returns a new group. A step
works on a shallow copy of `ParticipantState` and replaces whole groups in it; the state handed in is not changed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TypeAlias

from dorothie_gym.dialogue.propositions import Proposition
from dorothie_gym.errors import PolicyStateError
from dorothie_gym.ontology.dialogue_acts import DialogueAct
from dorothie_gym.ontology.slots import LandmarkName
from dorothie_gym.policies.heard_utterance import HeardUtterance
from dorothie_gym.policies.notable_conditions import Noticed
from dorothie_gym.policies.observation_parser import SeenLandmark, SeenSubgoal
from dorothie_gym.policies.participant.config import ParticipantConfig, ParticipantStyle
from dorothie_gym.policies.participant.order_history import GivenOrder
from dorothie_gym.policies.participant.trip_memory import TripMemory
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.route_state import RouteState
from dorothie_gym.policies.speech import Remark, SpeakingState

UNSAID = 6.0
"""Time within which an equal step replaces one that has not been said yet [s]."""

NUDGED = 8.0
"""Way of the car after which an instruction to drive on a little has worked [m]."""

CLOSE_BY, LEFT_AGAIN = 25.0, 40.0
"""Distance up to which the car comes close to a place, and from which on it has left it again [m]."""

StepKey: TypeAlias = tuple[str, int, int]
"""Identity of a guidance step: "turn", "lane", "round" or "on", and the lanes concerned."""


@dataclass(frozen=True, kw_only=True)
class ConversationState:
    """Course of the conversation apart from the guidance.

    Attributes:
        heard_at: time of the last utterance of the car [s].
        puzzled_by: utterance of the car that was not understood and needs to be repeated.
        asked_at: time of the last question about a standstill [s].
        wondered_at: time at which unexpected behaviour was last asked about or ignored [s].
        chat_at: time of the next remark unrelated to the task [s].
        lights_at: time at which the headlights were last mentioned [s].
        slowed: whether a lower speed for the weather has been requested or was not needed.
        bad_weather_since: start of the current bad weather [s]; infinite in good weather.
        hurried: whether the car has been asked to go faster.
        noticed: weather and crowds that have been noticed.
        blind_since: time since which the camera shows less than the weather explains [s]; infinite while it does not.
        asked_about_view: whether that has been talked about.
        how_far_at: time at which the car last said how far it is [s].
    """

    heard_at: float = 0.0
    puzzled_by: HeardUtterance | None = None
    asked_at: float = -math.inf
    wondered_at: float = -math.inf
    chat_at: float = math.inf
    lights_at: float = -math.inf
    slowed: bool = False
    bad_weather_since: float = math.inf
    hurried: bool = False
    noticed: Noticed = field(default_factory=Noticed)
    blind_since: float = math.inf
    asked_about_view: bool = False
    how_far_at: float = -math.inf

    def after_hearing(self, now: float) -> ConversationState:
        """Records an utterance of the car at `now` [s]."""
        return replace(self, heard_at=now)

    def after_hearing_how_far(self, now: float) -> ConversationState:
        """Records that the car has said how far it is, or how long it takes."""
        return replace(self, how_far_at=now)

    def with_puzzle(self, heard: HeardUtterance | None) -> ConversationState:
        """Sets the utterance that needs to be repeated; None once it has been clarified."""
        return replace(self, puzzled_by=heard)

    def after_asking_why(self, now: float) -> ConversationState:
        """Records a question about a standstill."""
        return replace(self, asked_at=now)

    def after_wondering(self, now: float) -> ConversationState:
        """Records that unexpected behaviour was asked about or ignored."""
        return replace(self, wondered_at=now)

    def with_next_chat(self, at: float) -> ConversationState:
        """Sets the time of the next remark unrelated to the task [s]."""
        return replace(self, chat_at=at)

    def after_mentioning_lights(self, now: float) -> ConversationState:
        """Records a mention of the headlights."""
        return replace(self, lights_at=now)

    def with_weather(self, now: float, *, bad: bool) -> ConversationState:
        """Updates the start of the current bad weather."""
        since = min(self.bad_weather_since, now) if bad else math.inf
        return self if since == self.bad_weather_since else replace(self, bad_weather_since=since)

    def with_view(self, now: float, *, blind: bool) -> ConversationState:
        """Updates the time since which the camera shows too little."""
        since = min(self.blind_since, now) if blind else math.inf
        same = since == self.blind_since and (blind or not self.asked_about_view)
        return self if same else replace(self, blind_since=since, asked_about_view=self.asked_about_view and blind)

    def after_talking_about_view(self) -> ConversationState:
        """Records that the failing camera has been talked about."""
        return replace(self, asked_about_view=True)

    def with_slowed(self, slowed: bool) -> ConversationState:
        """Sets whether a lower speed for the weather has been requested or was not needed."""
        return replace(self, slowed=slowed)

    def with_noticed(self, noticed: Noticed) -> ConversationState:
        """Sets the noticed weather and crowds."""
        return self if noticed is self.noticed else replace(self, noticed=noticed)

    def after_hurrying(self) -> ConversationState:
        """Records a request to go faster."""
        return replace(self, hurried=True)


@dataclass(frozen=True, kw_only=True)
class TaskProgress:
    """Subgoals, and the target: the car's current subgoal.

    Attributes:
        subgoals: subgoals at the last decision.
        listed: text of the list of errands at the last decision.
        target: index of the target.
        goal: landmark of the target.
        announced: whether the target has been announced to the car.
        announced_at: time of the last announcement or reminder [s].
        described: whether the place of the target has been described to the car.
        same_breath: whether the next task is named in the same breath as the report of the last one.
        next_at: time before which the next task is not named unless the car asks [s].
        resume_at: time at which a waiting car is instructed to continue [s]; infinite if it does not wait.
        put_off: interrupted subgoals, which will be resumed.
        told: statements made about the route to the target, its place, and the speaker's feelings about it.
        finished: landmark of the last completed errand, and the time of its completion [s].
        mentioned: landmarks of later errands that the car has been told of.
    """

    subgoals: tuple[SeenSubgoal, ...] = ()
    listed: str = ""
    target: int | None = None
    goal: SeenLandmark | None = None
    announced: bool = False
    announced_at: float = -math.inf
    described: bool = False
    same_breath: bool = False
    next_at: float = -math.inf
    resume_at: float = math.inf
    put_off: frozenset[int] = frozenset()
    told: frozenset[Proposition] = frozenset()
    finished: tuple[LandmarkName | None, float] = (None, -math.inf)
    mentioned: frozenset[LandmarkName] = frozenset()

    @property
    def destination(self) -> SeenLandmark:
        """Landmark of the target, for code that requires one; raises `PolicyStateError` without a target."""
        if self.goal is None:
            raise PolicyStateError("the participant has no target: none of its subgoals is open, allowed and known")
        return self.goal

    def with_subgoals(self, subgoals: tuple[SeenSubgoal, ...], listed: str) -> TaskProgress:
        """Sets the subgoals, and the text of their list, as observed."""
        return replace(self, subgoals=subgoals, listed=listed)

    def with_target(self, index: int, goal: SeenLandmark) -> TaskProgress:
        """Sets the target."""
        return replace(self, target=index, goal=goal)

    def without_target(self) -> TaskProgress:
        """Drops the target."""
        return replace(self, target=None, goal=None, announced=False, described=False, told=frozenset())

    def after_telling(self, said: Proposition) -> TaskProgress:
        """Records a statement about the target."""
        return replace(self, told=self.told | {said})

    def after_announcement(self, now: float) -> TaskProgress:
        """Records that the target was announced."""
        return replace(self, announced=True, announced_at=now)

    def after_reminding(self, now: float) -> TaskProgress:
        """Records a reminder of the target."""
        return replace(self, announced_at=now)

    def after_describing(self) -> TaskProgress:
        """Records a description of the place of the target."""
        return replace(self, described=True)

    def with_next_task(self, *, same_breath: bool, next_at: float) -> TaskProgress:
        """Sets when the next task is named: in the same breath, or not before a time [s]."""
        return replace(self, same_breath=same_breath, next_at=next_at)

    def with_same_breath(self, same_breath: bool) -> TaskProgress:
        """Sets whether the next task is named in the same breath."""
        return self if same_breath is self.same_breath else replace(self, same_breath=same_breath)

    def waiting_until(self, resume_at: float) -> TaskProgress:
        """Sets the time at which a waiting car is instructed to continue [s]; infinite if it does not wait."""
        return replace(self, resume_at=resume_at)

    def put_off_target(self) -> TaskProgress:
        """Marks the target as interrupted."""
        return self if self.target is None else replace(self, put_off=self.put_off | {self.target})

    def after_finishing(self, landmark: LandmarkName | None, now: float) -> TaskProgress:
        """Records the landmark of an errand that is done, at a time [s]."""
        return replace(self, finished=(landmark, now))

    def after_mentioning(self, landmark: LandmarkName) -> TaskProgress:
        """Records that the car was told of an errand for later."""
        return replace(self, mentioned=self.mentioned | {landmark})

    def closed(self, index: int) -> TaskProgress:
        """Removes a subgoal from those to be resumed."""
        return replace(self, put_off=self.put_off - {index})


@dataclass(frozen=True, kw_only=True)
class GuidanceState:
    """Turn-by-turn guidance to the target.

    Attributes:
        guiding: whether the car is guided turn by turn.
        best: minimum distance to the target so far [m].
        step: last step that was announced.
        step_at: time at which it was announced [s].
        repeats: number of repetitions of that step.
        u_turns: number of U-turns announced on the way to the target.
        given: orders that were said about the target since the last remark that something was tried in vain.
        passes: number of times that the car has driven past the place.
        visits: number of times that it has come close to the place.
        close: whether it is close to the place.
        wrong_way_at: time of the last remark that the car is going the wrong way [s].
        retries: number of other routes that were tried.
        wrong_turns: turns that were announced and not taken.
        lane_changes: lanes that the car was instructed to leave, and the times of the instructions [s].
        approach_announced: whether the car has been informed that the place is near.
        slowed_early: whether the car has been asked to slow down because the place is easily missed.
        stop_text: words to stop the car with; empty until they are chosen.
        points_out: whether these words only state that this is the place.
        stop_said: words of the last stop instruction, which are not repeated: they may be hard to recognise.
        stopped_at: time of the last stop instruction [s].
        nudged_at: time of the last instruction to drive on a little [s].
        nudges: number of such instructions, and of remarks about them, while the car has hardly moved.
        nudged_from: distance to the place at the first of them [m].
        planned_nudge: such an instruction, or remark about them, that has not been said yet.
        sent_straight_on: whether the last of them did not say how far.
        way: steps of the way ahead that have been described and are still to come.
        way_at: time of that description [s].
        way_taken_up: whether the car has repeated it.
        looked_ahead: last step for which it was decided whether to describe the way, and whether it was near.
        considered: last step for which it was decided whether to wait for a question of the car.
        left_to_ask: result of that decision.
        corrected: last turn before which the car was corrected.
        rerouted: whether a described way no longer holds, which has not been remarked on.
    """

    guiding: bool = False
    best: float = math.inf
    step: StepKey | None = None
    step_at: float = -math.inf
    repeats: int = 0
    u_turns: int = 0
    given: tuple[GivenOrder, ...] = ()
    passes: int = 0
    visits: int = 0
    close: bool = False
    wrong_way_at: float = -math.inf
    retries: int = 0
    wrong_turns: tuple[StepKey, ...] = ()
    lane_changes: tuple[tuple[int, float], ...] = ()
    approach_announced: bool = False
    slowed_early: bool = False
    stop_text: str = ""
    stop_said: str = ""
    points_out: bool = False
    stopped_at: float = -math.inf
    nudged_at: float = -math.inf
    nudges: int = 0
    nudged_from: float = math.inf
    planned_nudge: DialogueAct | None = None
    sent_straight_on: bool = False
    way: tuple[StepKey, ...] = ()
    way_at: float = -math.inf
    way_taken_up: bool = False
    looked_ahead: tuple[StepKey, bool] | None = None
    considered: StepKey | None = None
    left_to_ask: bool = False
    corrected: StepKey | None = None
    rerouted: bool = False

    def with_guiding(self, guiding: bool) -> GuidanceState:
        """Begins or ends the guidance."""
        return self if guiding is self.guiding else replace(self, guiding=guiding)

    def for_new_target(self) -> GuidanceState:
        """Resets all state that belongs to one target."""
        kept = GuidanceState()
        return replace(kept, step_at=self.step_at, considered=self.considered, left_to_ask=self.left_to_ask)

    def with_distance(self, left: float) -> GuidanceState:
        """Updates the minimum distance to the target [m]."""
        return self if left >= self.best else replace(self, best=left)

    def for_new_route(self, left: float) -> GuidanceState:
        """Restarts step and minimum distance on a route around a roadblock."""
        return replace(self, best=left, step=None, way=(), given=())

    def after_step(self, step: StepKey, now: float, return_time: float) -> GuidanceState:
        """Records a step announced at `now` [s].

        Args:
            step: the step.
            now: time [s].
            return_time: time after which a repeated lane change counts as a return to the lane [s].
        """
        changes = self.lane_changes
        if step[0] == "lane" and all(lane != step[1] or now - at > return_time for lane, at in changes):
            changes = (*changes, (step[1], now))
        return replace(
            self,
            step=step,
            step_at=now,
            way=self.way[self.way.index(step) + 1 :] if step in self.way else self.way,
            repeats=self.repeats + 1 if self.step == step else 0,
            u_turns=self.u_turns + (step[0] == "round" and (self.step != step or now - self.step_at > UNSAID)),
            lane_changes=changes,
        )

    def after_describing(self, steps: tuple[StepKey, ...], now: float) -> GuidanceState:
        """Records a description at `now` [s] of the steps of the way ahead behind the present one."""
        return replace(self, way=steps, way_at=now, way_taken_up=False)

    def after_taking_up(self) -> GuidanceState:
        """Records that the car has repeated the way ahead."""
        return self if self.way_taken_up else replace(self, way_taken_up=True)

    def without_way(self) -> GuidanceState:
        """Forgets the description of a way that is not the present route."""
        return self if not self.way else replace(self, way=(), rerouted=True)

    def after_reminding(self) -> GuidanceState:
        """Counts a repetition."""
        return replace(self, repeats=self.repeats + 1)

    def after_wrong_turn(self, step: StepKey) -> GuidanceState:
        """Records a turn that was not taken."""
        return replace(self, wrong_turns=(*self.wrong_turns, step))

    def without_circling(self, lane: int) -> GuidanceState:
        """Restarts the counts of U-turns, and of lane changes on a lane."""
        return replace(self, u_turns=0, lane_changes=tuple(change for change in self.lane_changes if change[0] != lane))

    def for_another_approach(self) -> GuidanceState:
        """Prepares another announcement of the approach."""
        return replace(self, approach_announced=False, stop_text="", points_out=False, nudges=0, nudged_from=math.inf)

    def near_place(self, distance: float) -> GuidanceState:
        """Counts the times that the car comes close to the place, `distance` metres away as the crow flies."""
        close = distance <= (LEFT_AGAIN if self.close else CLOSE_BY)
        if close is self.close:
            return self
        return replace(self, close=close, visits=self.visits + close)

    def after_passing(self) -> GuidanceState:
        """Counts a drive past the place, at most one for each time that the car has come close to it."""
        return replace(self, passes=min(self.passes + 1, self.visits))

    def after_pointing_out(self, now: float) -> GuidanceState:
        """Records a remark at `now` [s] that the car is going the wrong way."""
        return replace(self, wrong_way_at=now)

    def after_miss(self) -> GuidanceState:
        """Prepares another request to slow down."""
        return replace(self, slowed_early=False)

    def with_approach_announced(self, announced: bool) -> GuidanceState:
        """Sets whether the approach to the place has been announced."""
        return replace(self, approach_announced=announced)

    def after_slowing_early(self) -> GuidanceState:
        """Records a request to slow down before the place."""
        return replace(self, slowed_early=True)

    def with_stop_text(self, text: str, *, points_out: bool = False) -> GuidanceState:
        """Sets the words of the stop instruction, and whether they only state that this is the place."""
        return replace(self, stop_text=text, points_out=points_out)

    def after_stopping(self, now: float) -> GuidanceState:
        """Records an instruction to stop; a repetition is worded plainly."""
        return replace(self, stopped_at=now, stop_text="", stop_said=self.stop_text, points_out=False)

    def after_nudging(self, now: float, left: float) -> GuidanceState:
        """Records an instruction at `now` [s] to drive on a little, `left` metres before the place.

        Instructions count together until the car has come `NUDGED` metres closer or is farther away.
        """
        if abs(self.nudged_from - left) < NUDGED:
            return replace(self, nudged_at=now, nudges=self.nudges + 1)
        return replace(self, nudged_at=now, nudges=1, nudged_from=left)

    def after_correcting(self, step: StepKey) -> GuidanceState:
        """Records that the car was corrected before a turn."""
        return replace(self, corrected=step)

    def with_consideration(self, step: StepKey, left_to_ask: bool) -> GuidanceState:
        """Records whether a step is left to a question of the car."""
        return replace(self, considered=step, left_to_ask=left_to_ask)


@dataclass(frozen=True, kw_only=True)
class MotionState:
    """Observed motion of the car.

    Attributes:
        standing_since: start of the standstill that needs an explanation [s]; None while the car moves.
        moved_at: time at which the car was last seen to move [s].
        excused_until: time until which the participant does not ask about a standstill [s].
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
        """Restarts the standstill at a red light, and allows a time to start after it [s]."""
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
class ParticipantState(SpeakingState[ParticipantStyle, ParticipantConfig]):
    """State of the scripted participant; a step works on a shallow copy.

    Attributes:
        conversation: course of the conversation.
        task: subgoals and target.
        guidance: turn-by-turn guidance to the target.
        route: route to the target.
        motion: observed motion of the car.
        trip: what happened on the trip so far.
    """

    conversation: ConversationState = field(default_factory=ConversationState)
    task: TaskProgress = field(default_factory=TaskProgress)
    guidance: GuidanceState = field(default_factory=GuidanceState)
    route: RouteState = field(default_factory=RouteState)
    motion: MotionState = field(default_factory=MotionState)
    trip: TripMemory = field(default_factory=TripMemory)

    def say_only(self, *remarks: Remark) -> None:
        """Replaces the queued remarks."""
        self.speech = self.speech.cleared().plan(*remarks)

    def set_guiding(self, guiding: bool) -> None:
        """Begins or ends the guidance."""
        self.guidance = self.guidance.with_guiding(guiding)

    def forget_target(self) -> None:
        """Drops the target with its route and guidance; roadblocks stay known."""
        self.task = self.task.without_target()
        self.route = self.route.with_progress(None).for_new_goal()
        self.guidance = self.guidance.for_new_target()
