"""One session in progress: order of the roles' actions in a decision, and their consequences.

The engine calls `begin_step` before each step of the world and `end_step` after it. A session has a world (`World`), a
storyboard (`TaskState`), beliefs of the Co-Wizard (`BeliefTracker`), speech (`DialogueChannel`), exceptions of the
Ad-Wizard (`ExceptionExecutor`), a log, and observations of the roles (`SessionObserver`).

Third of the five files that explain the package. Next: `sim/world.py`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

from dorothie_gym.ontology.actions import NAVIGATION_ACTIONS, PhysicalAction
from dorothie_gym.ontology.roles import AGENT_ROLES, Role
from dorothie_gym.ontology.world_exceptions import ExceptionKind
from dorothie_gym.session.beliefs import BeliefTracker
from dorothie_gym.session.dialogue_channel import DialogueChannel, cabin_of
from dorothie_gym.session.exception_executor import ExceptionExecutor
from dorothie_gym.session.observations import DeliveredMessages, SessionObserver
from dorothie_gym.session.recording.events import EndReason, Event, EventType
from dorothie_gym.session.scenario import Scenario, session_seeds
from dorothie_gym.session.session_log import EventLog, SessionSummary, SubgoalTracker
from dorothie_gym.session.spaces.actions import (
    AdWizardAction,
    CoWizardAction,
    Mental,
    ParticipantAction,
    Physical,
    RoleAction,
)
from dorothie_gym.session.time_allowed import time_allowed, time_extended
from dorothie_gym.sim.ego.limits import EGO_STANDING
from dorothie_gym.sim.world import World
from dorothie_gym.tasks.storyboard import TaskState

if TYPE_CHECKING:
    from dorothie_gym.dialogue.conversation import Utterance
    from dorothie_gym.maps.town import Town
    from dorothie_gym.pictures.camera.first_person_camera import CameraFrame
    from dorothie_gym.session.config import EnvConfig
    from dorothie_gym.session.rewards import RewardTerms
    from dorothie_gym.session.spaces.fields import SpaceLimits
    from dorothie_gym.session.spaces.observations import Observation
    from dorothie_gym.sim.network.network import TownNetwork
    from dorothie_gym.sim.state.world_arrays import WorldArrays
    from dorothie_gym.sim.traffic_rules import WorldEvent


class StepBegun(NamedTuple):
    """State from the start of a decision that is needed at its end.

    Attributes:
        message: message of the Ad-Wizard.
        spoken: whether an utterance span began, for the roles that speak.
        collisions: number of collisions before.
        reached: number of subgoals reached before.
    """

    message: str
    spoken: Mapping[Role, bool]
    collisions: int
    reached: int


class LiveSession:
    """One session in progress, with decoded actions.

    Attributes:
        scenario: storyboard, street names and departure.
        config: settings.
        limits: sizes of the spaces.
        seconds_allowed: time after which the session is truncated, if no subgoal is added [s].
        world: simulated world.
        task: progress in the storyboard.
        beliefs: goals and places of hidden landmarks as the Co-Wizard has stated them.
        messages: messages of the Ad-Wizard so far, with their times [s].
        exceptions: times [s] of the exceptions so far, positions of the ego [m], and data of their events.
        trail: positions of the ego [m], one for each decision.
        decisions: decisions played so far.
        over: whether the session is closed.
        dialogue: past and current utterances of participant and Co-Wizard.
        log: events and refusals of the last decision, infractions and counts so far.
        observer: observations, masks and pictures of the roles.
    """

    def __init__(
        self,
        town: Town,
        network: TownNetwork,
        scenario: Scenario,
        config: EnvConfig,
        limits: SpaceLimits,
        arrays: WorldArrays | None = None,
    ) -> None:
        """Begins a session, or takes over a session of which only the world has been simulated.

        Args:
            town: the map.
            network: its network.
            scenario: storyboard, street names and departure.
            config: settings.
            limits: sizes of the spaces.
            arrays: arrays of the world of a session that has begun, by `session_seeds` and `start_world`.
        """
        self.scenario, self.config, self.limits = scenario, config, limits
        self.seconds_allowed = time_allowed(town, scenario, config)
        world_seed, word_seed, ear_seed, style_seed, voice_seed = session_seeds(scenario)
        self.world = World(
            town, config.world, seed=world_seed, departure=scenario.departure, network=network, arrays=arrays
        )
        self.task = TaskState(scenario.storyboard)
        self._planned = len(self.task.live)
        self.beliefs = BeliefTracker(town, scenario)
        self._exceptions = ExceptionExecutor(self.world, self.task, limits.props)
        self.dialogue = DialogueChannel(
            scenario, config, limits.spans, words=word_seed, ears=ear_seed, styles=style_seed, voices=voice_seed
        )
        self.log = EventLog(self.world)
        self._subgoals = SubgoalTracker(scenario, self.task, self.dialogue, self.log)
        self.decisions = 0
        self.messages: list[tuple[float, str]] = []
        self.exceptions: list[tuple[float, tuple[float, float], Mapping[str, object]]] = []
        self.trail: list[tuple[float, float]] = [self._ego_position()]
        self.over = False
        self._end_reason = ""
        self.observer = SessionObserver(
            self.world, scenario, self.task, self.beliefs, config, limits, self._deliver("")
        )

    # --- one decision -----------------------------------------------------------------------------------------------

    def begin_step(self, actions: Mapping[Role, RoleAction]) -> StepBegun:
        """Carries out one action of each role."""
        self.begin_decision()
        collisions, reached = self.world.collisions, self._subgoals.reached
        message = self.play_ad_wizard(actions[Role.AD_WIZARD])
        spoken = {role: self._speak(role, actions[role]) for role in (Role.PARTICIPANT, Role.CO_WIZARD)}
        self._play_co_wizard(actions[Role.CO_WIZARD])
        return StepBegun(message, spoken, collisions, reached)

    def end_step(self, begun: StepBegun, events: Sequence[WorldEvent]) -> dict[Role, RewardTerms]:
        """Processes the events of a step of the world; returns the reward terms."""
        for event in events:
            self.log.add_world_event(event)
        self.note_arrivals()
        self.observer.delivered = self._deliver(begun.message)
        self.note_place()
        self.observer.look(events)
        return self.config.rewards.terms(
            reached=self._subgoals.reached - begun.reached,
            success=self.success,
            collisions=self.world.collisions - begun.collisions,
            decision_frequency=self.config.decision_frequency,
            refusals={role: len(reasons) for role, reasons in self.log.refused.items()},
            spoken=begun.spoken,
        )

    def observations(self, roles: Sequence[Role] = AGENT_ROLES) -> dict[str, Observation]:
        """Builds the observations of the given roles, by agent; shared values are computed once."""
        return self.observer.observations(roles, self.decisions)

    @property
    def picture(self) -> CameraFrame | None:
        """Picture of the camera on the car at the current decision, boxes included; None without a camera."""
        return self.observer.picture(self.decisions)

    def end(self, reason: str) -> None:
        """Closes the session."""
        self.log.add(EventType.END, Role.AGENT, {"success": self.success, "reason": reason})
        self.over, self._end_reason = True, reason

    def break_off(self, reason: EndReason) -> None:
        """Closes the session between two decisions; the events are then those of the end only."""
        self.log.clear()
        self.end(reason.value)

    @property
    def time_limit(self) -> float:
        """Time after which the session is truncated, with its subgoals so far [s]."""
        return time_extended(self.seconds_allowed, self._planned, len(self.task.live), self.config)

    @property
    def success(self) -> bool:
        """Whether every live subgoal was reached, the destination last, without a collision that the ego caused."""
        return self.world.collisions == 0 and self.task.done and self.task.success

    @property
    def events(self) -> list[Event]:
        """Events of the last decision."""
        return self.log.events

    # --- actions of the roles ---------------------------------------------------------------------------------------

    def begin_decision(self) -> None:
        """Counts a decision and forgets the events of the last one."""
        self.decisions += 1
        self.log.clear()
        self.observer.begin_decision()

    def play_ad_wizard(self, action: RoleAction) -> str:
        """Carries out an action of the Ad-Wizard; returns its message to the participant."""
        assert isinstance(action, AdWizardAction)
        if action.exception is ExceptionKind.NONE:
            return ""
        outcome = self._exceptions.execute(action)
        name = action.exception.name.lower()
        if isinstance(outcome, str):
            self.log.refuse(Role.AD_WIZARD, "exception", name, outcome)
            return ""
        if action.exception is not ExceptionKind.MESSAGE:
            self.log.counts["exceptions"] += 1
            data = {"kind": name, **outcome}
            self.exceptions.append((self.world.time, self._ego_position(), data))
            self.log.add(EventType.EXCEPTION, Role.AD_WIZARD, data)
        if action.exception.is_task:
            self._subgoals.note_changes(name)
        if action.message:
            self.messages.append((self.world.time, action.message))
            self.log.add(EventType.MESSAGE, Role.AD_WIZARD, {"text": action.message})
        return action.message

    def _speak(self, role: Role, action: RoleAction) -> bool:
        assert isinstance(action, ParticipantAction | CoWizardAction)
        if action.speech is None:
            return False
        reason = self.dialogue.say(role, action.speech, self.world.time)
        if reason is not None:
            self.log.refuse(role, "speech", "speech", reason)
        return reason is None

    def _play_co_wizard(self, action: RoleAction) -> None:
        assert isinstance(action, CoWizardAction)
        if action.mental is not None:
            self.update_beliefs(action.mental)
        if action.physical is not None:
            self._drive(action.physical)

    def _drive(self, physical: Physical) -> None:
        action = physical.action
        reason = self.world.ego.apply(action, angle=physical.angle, up=physical.up)
        if reason is not None:
            self.log.refuse(Role.CO_WIZARD, "physical", action.label, reason)
            return
        self.log.counts["physical_actions"] += 1
        angle = physical.angle if action in (PhysicalAction.J_TURN, PhysicalAction.LANE_SWITCH) else None
        up = physical.up if action in (PhysicalAction.SPEED_CHANGE, PhysicalAction.LIGHT_CHANGE) else None
        data = {"action": action.label, "angle": angle, "up": up}
        self.log.add(EventType.PHYSICAL_ACTION, Role.CO_WIZARD, data, flagged=action in NAVIGATION_ACTIONS)

    def update_beliefs(self, mental: Mental) -> str | None:
        """Carries out a belief update of the Co-Wizard; returns the reason of a refusal."""
        outcome = self.beliefs.update(mental, self.world.localizer, self.world.sight)
        if isinstance(outcome, str):
            self.log.refuse(Role.CO_WIZARD, "mental", mental.action.label, outcome)
            return self.log.refusals[Role.CO_WIZARD]["mental"]
        self.world.ego.set_goals(self.beliefs.goal_places())
        self.log.add(EventType.BELIEF_UPDATE, Role.CO_WIZARD, {"action": mental.action.label, **outcome})
        return None

    # --- consequences -----------------------------------------------------------------------------------------------

    def note_place(self) -> None:
        """Records the place of the ego at a decision."""
        self.trail.append(self._ego_position())

    def note_arrivals(self) -> None:
        """Completes the subgoals at whose waypoint the ego has stopped."""
        if self.world.car.speed <= EGO_STANDING:
            self._subgoals.note_arrivals(*self._ego_position())

    def _deliver(self, message: str) -> DeliveredMessages:
        """Delivers the utterances that have ended and logs their acts; `message` is that of the Ad-Wizard."""
        said: dict[Role, Utterance] = {}
        heard: dict[Role, Utterance] = {}
        now = self.world.time
        for utterance in self.dialogue.deliver(now, lambda: cabin_of(self.world)):
            speaker = utterance.said.speaker
            said[speaker], heard[speaker] = utterance.said, utterance.heard
            self.beliefs.hear(speaker, utterance.understood)
            self.log.counts["utterances"] += 1
            self.log.counts["acts"] += len(utterance.records)
            for data in utterance.records:
                self.log.add(EventType.DIALOGUE_MOVE, speaker, data, flagged=True)
        return DeliveredMessages(said=said, heard=heard, message=message, speaking=self.dialogue.speaking(now))

    def _ego_position(self) -> tuple[float, float]:
        x, y = self.world.car.position.tolist()
        return x, y

    # --- record -----------------------------------------------------------------------------------------------------

    def summary(self) -> SessionSummary:
        """Returns the state of the session in JSON types: success, subgoals, counts."""
        summary = self.log.summary(self.task, self.dialogue, reached=self._subgoals.reached, success=self.success)
        if self.over:
            summary["reason"] = self._end_reason
        return summary
