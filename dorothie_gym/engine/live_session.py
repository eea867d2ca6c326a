"""One session in progress: carries out the decisions of the roles, logs events and computes rewards."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NotRequired, TypeAlias, TypedDict

import numpy as np

from dorothie_gym.dialogue import Utterance
from dorothie_gym.engine.beliefs import BeliefTracker
from dorothie_gym.engine.config import EnvConfig
from dorothie_gym.engine.dialogue_channel import DialogueChannel
from dorothie_gym.engine.exception_executor import ExceptionExecutor
from dorothie_gym.engine.masks import ActionMasks
from dorothie_gym.engine.observations import DeliveredMessages, ObservationBuilder
from dorothie_gym.engine.scenario import Scenario, header_of
from dorothie_gym.engine.upcoming_junction import UpcomingJunction
from dorothie_gym.maps import Town
from dorothie_gym.ontology import (
    AGENT_ROLES,
    ARRIVAL_DISTANCE,
    NAVIGATION_ACTIONS,
    ExceptionKind,
    MentalAction,
    PhysicalAction,
    Role,
)
from dorothie_gym.recording import Event, EventType, SessionHeader
from dorothie_gym.sim.infractions import INFRACTION_KINDS, WorldEventKind
from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.sim.world import World
from dorothie_gym.spaces import (
    AdWizardAction,
    CoWizardAction,
    Mental,
    Observation,
    ParticipantAction,
    Physical,
    RoleAction,
    SpaceLimits,
)
from dorothie_gym.tasks import TaskState

_SIGNS = ((Role.PARTICIPANT, 1.0), (Role.CO_WIZARD, 1.0), (Role.AD_WIZARD, -1.0))
"""Roles and the sign of the shared reward terms: the Ad-Wizard plays against the others."""

STANDING = 0.1
"""Greatest speed at which the ego counts as standing [m/s]."""

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


RewardTerms: TypeAlias = dict[str, float]
"""Terms of a role's reward, by name."""


class SubgoalCounts(TypedDict):
    """Number of subgoals that are live, and of those that are reached."""

    live: int
    reached: int


class SessionCounts(TypedDict):
    """Counts of what the roles did."""

    utterances: int
    acts: int
    physical_actions: int
    exceptions: int
    refusals: int


class SessionSummary(SessionCounts):
    """State of a session; `reason` is there when it is over ("arrived", "out of time" and the like)."""

    success: bool
    arrived: bool
    subgoals: SubgoalCounts
    collisions: int
    infractions: dict[str, int]
    seconds: float
    exchanges: int
    transactions: int
    reason: NotRequired[str]


class LiveSession:
    """A session in progress.

    Attributes:
        scenario: storyboard, street names and departure.
        config: settings.
        limits: sizes of the spaces.
        world: simulated world.
        task: progress in the storyboard.
        beliefs: goals and places of hidden landmarks as the Co-Wizard has stated them.
        masks: masks of the actions that would be carried out now.
        events: events of the last decision.
        refused: reasons for the refusals of the last decision, by role.
        messages: messages of the Ad-Wizard so far, with their times [s].
        trail: positions of the ego [m], one for each decision.
        counts: counts for the summary.
        decisions: decisions played so far.
    """

    def __init__(
        self, town: Town, network: TownNetwork, scenario: Scenario, config: EnvConfig, limits: SpaceLimits
    ) -> None:
        self.scenario, self.config, self.limits = scenario, config, limits
        # A new subsystem takes a further child at the end: the seeds of the others stay as they are.
        world_seed, word_seed, ear_seed, style_seed = np.random.SeedSequence([scenario.seed, 1]).spawn(4)
        self.world = World(town, config.world, seed=world_seed, departure=scenario.departure, network=network)
        self.task = TaskState(scenario.storyboard)
        self.beliefs = BeliefTracker(town, scenario)
        self._exceptions = ExceptionExecutor(self.world, self.task, limits.props)
        self._dialogue = DialogueChannel(
            scenario, config, limits.spans, words=word_seed, ears=ear_seed, styles=style_seed
        )
        junction = UpcomingJunction(self.world)
        self._observations = ObservationBuilder(
            self.world, scenario, self.task, self.beliefs, limits, config.observe_acts, junction
        )
        self.masks = ActionMasks(self.world, self.task, limits, junction)
        self.decisions = 0
        self.events: list[Event] = []
        self.refused: dict[Role, list[str]] = {role: [] for role in AGENT_ROLES}
        self.messages: list[tuple[float, str]] = []
        self.trail: list[tuple[float, float]] = [self._ego_position()]
        self.counts = SessionCounts(utterances=0, acts=0, physical_actions=0, exceptions=0, refusals=0)
        self._statuses = [self.task.status(i) for i in range(len(scenario.storyboard.subgoals))]
        self._waypoints = [(*landmark.waypoint, landmark.index) for landmark in scenario.storyboard.landmarks]
        self._time_reward = config.rewards.time / config.decision_frequency
        self._known_reached = (-1, 0)  # version of the task, number of its live subgoals that are reached
        self._end_reason: str | None = None
        self._delivered = self._deliver("")

    # --- one decision -----------------------------------------------------------------------------------------------

    def step(self, actions: Mapping[Role, RoleAction]) -> dict[Role, RewardTerms]:
        """Carries out one action of each role, runs the physics until the next decision, returns the reward terms."""
        self.decisions += 1
        self.events = []
        self.refused = {role: [] for role in AGENT_ROLES}
        collisions, reached = self.world.collisions, self._reached()
        message = self._play_ad_wizard(actions[Role.AD_WIZARD])
        spoken = {role: self._speak(role, actions[role]) for role in (Role.PARTICIPANT, Role.CO_WIZARD)}
        self._play_co_wizard(actions[Role.CO_WIZARD])
        for event in self.world.step(self.config.frames):
            self._log(_WORLD_EVENTS[event.kind], Role.AGENT, event.data, frame=event.frame)
        self._note_arrivals()
        self._delivered = self._deliver(message)
        self.trail.append(self._ego_position())
        return self._rewards(self._reached() - reached, self.world.collisions - collisions, spoken)

    def observe(self, role: Role) -> Observation:
        """Builds the observation of one role at the present decision."""
        return self._observations.build(self._delivered, (role,))[role]

    def observations(self, roles: Sequence[Role] = AGENT_ROLES) -> dict[str, Observation]:
        """Builds the observations of some roles, by agent; what several of them need is computed once."""
        return {str(role): found for role, found in self._observations.build(self._delivered, roles).items()}

    def end(self, reason: str) -> None:
        """Closes the session."""
        self._log(EventType.END, Role.AGENT, {"success": self.success, "reason": reason})
        self._end_reason = reason

    @property
    def over(self) -> bool:
        """Whether the session is closed."""
        return self._end_reason is not None

    @property
    def success(self) -> bool:
        """Whether every live subgoal was reached, the destination last, without a collision that the ego caused."""
        return self.world.collisions == 0 and self.task.done and self.task.success

    @property
    def said(self) -> Sequence[Utterance]:
        """All utterances that are over."""
        return self._dialogue.said

    @property
    def infractions(self) -> dict[str, int]:
        """Number of infractions so far by kind, collisions of any cause included."""
        counts = self.world.reports.infractions
        return {name: counts.get(kind, 0) for name, kind in _INFRACTIONS}

    # --- actions of the roles ---------------------------------------------------------------------------------------

    def _play_ad_wizard(self, action: RoleAction) -> str:
        assert isinstance(action, AdWizardAction)
        if action.exception is ExceptionKind.NONE:
            return ""
        outcome = self._exceptions.execute(action)
        name = action.exception.name.lower()
        if isinstance(outcome, str):
            self._refuse(Role.AD_WIZARD, name, outcome)
            return ""
        if action.exception is not ExceptionKind.MESSAGE:
            self.counts["exceptions"] += 1
            self._log(EventType.EXCEPTION, Role.AD_WIZARD, {"kind": name, **outcome})
        if action.exception.is_task:
            self._note_statuses(name)
        if action.message:
            self.messages.append((self.world.time, action.message))
            self._log(EventType.MESSAGE, Role.AD_WIZARD, {"text": action.message})
        return action.message

    def _speak(self, role: Role, action: RoleAction) -> bool:
        assert isinstance(action, ParticipantAction | CoWizardAction)
        if action.speech is None:
            return False
        reason = self._dialogue.say(role, action.speech, self.world.time)
        if reason is not None:
            self._refuse(role, "speech", reason)
        return reason is None

    def _play_co_wizard(self, action: RoleAction) -> None:
        assert isinstance(action, CoWizardAction)
        if action.mental is not None:
            self._update_beliefs(action.mental)
        if action.physical is not None:
            self._drive(action.physical)

    def _drive(self, physical: Physical) -> None:
        action = physical.action
        reason = self.world.ego.apply(action, angle=physical.angle, up=physical.up)
        if reason is not None:
            self._refuse(Role.CO_WIZARD, action.label, reason)
            return
        self.counts["physical_actions"] += 1
        angle = physical.angle if action in (PhysicalAction.J_TURN, PhysicalAction.LANE_SWITCH) else None
        up = physical.up if action in (PhysicalAction.SPEED_CHANGE, PhysicalAction.LIGHT_CHANGE) else None
        data = {"action": action.label, "angle": angle, "up": up}
        self._log(EventType.PHYSICAL_ACTION, Role.CO_WIZARD, data, flagged=action in NAVIGATION_ACTIONS)

    def _update_beliefs(self, mental: Mental) -> None:
        town = self.world.town
        data: dict[str, Any] = {"action": mental.action.label}
        if mental.action is MentalAction.PLAN_UPDATE:
            unknown = [k for k in mental.plan if k >= len(town.junctions)]
            if unknown:
                self._refuse(Role.CO_WIZARD, mental.action.label, f"the town has no junction number {unknown[0]}")
                return
            data["junctions"] = [town.junctions[k].id for k in mental.plan]
        elif mental.action is MentalAction.GOAL_UPDATE:
            self.beliefs.goals = mental.goals
            data["landmarks"] = [name.label for name in mental.goals]
        elif mental.action is MentalAction.STATUS_UPDATE:
            data["landmark"], data["status"] = mental.landmark.label, mental.status.label
        elif mental.action is MentalAction.KNOWLEDGE_UPDATE:
            lane, metres = mental.place.lane, float(mental.place.metres)
            if lane >= len(town.lanes) or metres > town.lanes[lane].length + 1.0:
                self._refuse(Role.CO_WIZARD, mental.action.label, "the guessed place is not on a lane of the town")
                return
            pose, covariance = self.world.localizer.pose, self.world.localizer.covariance
            self.beliefs.guess(mental.landmark, lane, metres, pose=pose, covariance=covariance, sight=self.world.sight)
            x, y = town.lanes[lane].position(metres)
            data.update(landmark=mental.landmark.label, x=round(float(x), 3), y=round(float(y), 3))
        self.world.ego.set_goals(self.beliefs.goal_places())
        self._log(EventType.BELIEF_UPDATE, Role.CO_WIZARD, data)

    # --- consequences -----------------------------------------------------------------------------------------------

    def _note_arrivals(self) -> None:
        if self.world.car.speed > STANDING:
            return
        x, y = self._ego_position()
        for place_x, place_y, landmark in self._waypoints:
            if abs(place_x - x) <= ARRIVAL_DISTANCE and math.hypot(place_x - x, place_y - y) <= ARRIVAL_DISTANCE:
                for i in self.task.arrive(landmark):
                    self._log_subgoal(i, "arrival")
                self._note_statuses("arrival", log=False)

    def _note_statuses(self, cause: str, *, log: bool = True) -> None:
        for i in range(len(self._statuses)):
            status = self.task.status(i)
            if status is not self._statuses[i] and log:
                self._log_subgoal(i, cause)
            self._statuses[i] = status

    def _log_subgoal(self, i: int, cause: str) -> None:
        landmark = self.scenario.storyboard.landmarks[self.task.landmark_of(i)]
        status = self.task.status(i)
        self._dialogue.note(landmark.name, status)
        data = {"subgoal": i, "landmark": landmark.name.label, "status": status.label, "cause": cause}
        self._log(EventType.SUBGOAL, Role.AGENT, data)

    def _deliver(self, message: str) -> DeliveredMessages:
        """Delivers the utterances that are over and logs their acts; `message` is that of the Ad-Wizard."""
        said: dict[Role, Utterance] = {}
        heard: dict[Role, Utterance] = {}
        now = self.world.time
        for utterance in self._dialogue.deliver(now):
            speaker = utterance.said.speaker
            said[speaker], heard[speaker] = utterance.said, utterance.heard
            self.beliefs.hear(speaker, utterance.understood)
            self.counts["utterances"] += 1
            self.counts["acts"] += len(utterance.records)
            for data in utterance.records:
                self._log(EventType.DIALOGUE_MOVE, speaker, data, flagged=True)
        return DeliveredMessages(said=said, heard=heard, message=message, speaking=self._dialogue.speaking(now))

    def _rewards(self, reached: int, collisions: int, spoken: Mapping[Role, bool]) -> dict[Role, RewardTerms]:
        weights = self.config.rewards
        subgoal, success = weights.subgoal * reached, weights.success * self.success
        collision, time = weights.collision * collisions, self._time_reward
        terms = {}
        for role, sign in _SIGNS:
            terms[role] = {
                "subgoal": sign * subgoal,
                "success": sign * success,
                "collision": sign * collision,
                "time": sign * time,
                "refusal": weights.refusal * len(self.refused[role]),
            }
            if role in spoken:
                terms[role]["talk"] = weights.talk * spoken[role]
        return terms

    def _reached(self) -> int:
        version, reached = self._known_reached
        if version != self.task.version:
            reached = sum(self.task.reached(i) for i in self.task.live)
            self._known_reached = self.task.version, reached
        return reached

    def _refuse(self, role: Role, action: str, reason: str) -> None:
        self.refused[role].append(f"{action}: {reason}")
        self.counts["refusals"] += 1
        self._log(EventType.REFUSAL, role, {"action": action, "reason": reason})

    def _log(
        self, kind: EventType, source: Role, data: Mapping[str, Any], *, flagged: bool = False, frame: int | None = None
    ) -> None:
        at = self.world.frame if frame is None else frame
        self.events.append(Event(frame=at, type=kind, source=source, flagged=flagged, data=dict(data)))

    def _ego_position(self) -> tuple[float, float]:
        x, y = self.world.car.position.tolist()
        return x, y

    # --- record -----------------------------------------------------------------------------------------------------

    def header(self) -> SessionHeader:
        """Returns the header of the session's record."""
        return header_of(self.scenario, self.world.town.name, self.config)

    def summary(self) -> SessionSummary:
        """Returns the state of the session in JSON types: success, subgoals, counts."""
        summary = SessionSummary(
            success=self.success,
            arrived=self.task.done,
            subgoals=SubgoalCounts(live=len(self.task.live), reached=self._reached()),
            collisions=self.world.collisions,
            infractions=self.infractions,
            seconds=round(self.world.time, 3),
            utterances=self.counts["utterances"],
            acts=self.counts["acts"],
            physical_actions=self.counts["physical_actions"],
            exceptions=self.counts["exceptions"],
            refusals=self.counts["refusals"],
            exchanges=self._dialogue.exchanges,
            transactions=self._dialogue.transactions,
        )
        if self._end_reason is not None:
            summary["reason"] = self._end_reason
        return summary
