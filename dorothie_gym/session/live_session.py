"""One session in progress: order of the roles' actions in a decision, and their consequences."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dorothie_gym.dialogue.conversation import Utterance
from dorothie_gym.maps.town import Town
from dorothie_gym.ontology.actions import NAVIGATION_ACTIONS, PhysicalAction
from dorothie_gym.ontology.roles import AGENT_ROLES, Role
from dorothie_gym.ontology.world_exceptions import ExceptionKind, WeatherParameter
from dorothie_gym.session.beliefs import BeliefTracker
from dorothie_gym.session.cabin import CabinState
from dorothie_gym.session.config import EnvConfig, RewardTerms
from dorothie_gym.session.dialogue_channel import DialogueChannel
from dorothie_gym.session.exception_executor import ExceptionExecutor
from dorothie_gym.session.masks import ActionMasks
from dorothie_gym.session.observations import DeliveredMessages, ObservationBuilder
from dorothie_gym.session.perception_model import PerceptionModel
from dorothie_gym.session.providers import Pictures, VisiblePerception, draw_pictures, see_by_camera
from dorothie_gym.session.recording.events import EndReason, Event, EventType
from dorothie_gym.session.recording.header import SessionHeader
from dorothie_gym.session.scenario import Scenario, header_of
from dorothie_gym.session.session_log import EventLog, SessionSummary, SubgoalCounts, SubgoalTracker
from dorothie_gym.session.session_views import SessionViews
from dorothie_gym.session.spaces.actions import (
    AdWizardAction,
    CoWizardAction,
    Mental,
    ParticipantAction,
    Physical,
    RoleAction,
)
from dorothie_gym.session.spaces.limits import SpaceLimits
from dorothie_gym.session.spaces.observations import Observation
from dorothie_gym.session.view_arrays import RoleArrays
from dorothie_gym.session.view_steps import EVERYTHING
from dorothie_gym.sim.ego.limits import EGO_STANDING
from dorothie_gym.sim.infractions import INFRACTION_KINDS, WorldEvent
from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.sim.state.world_arrays import WorldArrays
from dorothie_gym.sim.world import World
from dorothie_gym.tasks.state import TaskState

if TYPE_CHECKING:
    from dorothie_gym.pictures.camera.first_person_camera import CameraFrame
    from dorothie_gym.support.audio import Samples

_INFRACTIONS = tuple((kind.value, kind) for kind in INFRACTION_KINDS)


def session_seeds(scenario: Scenario) -> list[np.random.SeedSequence]:
    """Returns the seeds of a session: of the world, of words, of the recogniser, of styles, and of voices."""
    # A new subsystem takes a further child at the end: the seeds of the others stay as they are.
    return np.random.SeedSequence([scenario.seed, 1]).spawn(5)


def world_seed_of(scenario: Scenario) -> np.random.SeedSequence:
    """Returns the first of the seeds of a session, that of the world, without the others."""
    return np.random.SeedSequence([scenario.seed, 1], spawn_key=(0,))


class StepBegun(NamedTuple):
    """State from the beginning of a decision that its end needs.

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
        world: simulated world.
        task: progress in the storyboard.
        beliefs: goals and places of hidden landmarks as the Co-Wizard has stated them.
        messages: messages of the Ad-Wizard so far, with their times [s].
        exceptions: times [s] of the exceptions so far, positions of the ego [m], and data of their events.
        trail: positions of the ego [m], one for each decision.
        decisions: decisions played so far.
        over: whether the session is closed.
        camera_perception: objects in the picture, with perception by the camera.
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
        world_seed, word_seed, ear_seed, style_seed, voice_seed = session_seeds(scenario)
        self.world = World(
            town, config.world, seed=world_seed, departure=scenario.departure, network=network, arrays=arrays
        )
        self.task = TaskState(scenario.storyboard)
        self.beliefs = BeliefTracker(town, scenario)
        self._exceptions = ExceptionExecutor(self.world, self.task, limits.props)
        self._dialogue = DialogueChannel(
            scenario,
            config,
            limits.spans,
            words=word_seed,
            ears=ear_seed,
            styles=style_seed,
            voices=voice_seed,
        )
        self._log = EventLog(self.world)
        self._subgoals = SubgoalTracker(scenario, self.task, self._dialogue, self._log)
        self.decisions = 0
        self.messages: list[tuple[float, str]] = []
        self.exceptions: list[tuple[float, tuple[float, float], Mapping[str, object]]] = []
        self.trail: list[tuple[float, float]] = [self._ego_position()]
        self.over = False
        self._end_reason = ""
        self._infractions: dict[str, int] | None = None
        self._delivered = self._deliver("")
        self._pictures: Pictures | None = (
            None if config.camera is None else draw_pictures(self.world, scenario, config.camera)
        )
        self.camera_perception: VisiblePerception | None = (
            see_by_camera(self.world, scenario) if config.perception is PerceptionModel.CAMERA else None
        )

    # made when they are first used: not all sessions observe by dicts, or ask for masks

    @cached_property
    def _views(self) -> SessionViews:
        return SessionViews(self.world, RoleArrays(self.limits, self.config.observe_acts), 0)

    @cached_property
    def _observations(self) -> ObservationBuilder:
        return ObservationBuilder(self._views, self.scenario, self.task, self.beliefs)

    @cached_property
    def masks(self) -> ActionMasks:
        """Masks of the actions that would be carried out now."""
        return ActionMasks(self._views, self.task)

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
        """Draws the consequences of a step of the world, which had these events; returns the reward terms."""
        for event in events:
            self._log.add_world_event(event)
        self._infractions = None
        self.note_arrivals()
        self._delivered = self._deliver(begun.message)
        self.note_place()
        if self.camera_perception is not None:
            self.camera_perception.look()
            self.beliefs.recognised = self.camera_perception.recognised
        return self.config.rewards.terms(
            reached=self._subgoals.reached - begun.reached,
            success=self.success,
            collisions=self.world.collisions - begun.collisions,
            decision_frequency=self.config.decision_frequency,
            refusals={role: len(reasons) for role, reasons in self._log.refused.items()},
            spoken=begun.spoken,
        )

    def share_views(self, arrays: RoleArrays, row: int) -> None:
        """Redirects observations and masks of a session that has not been observed yet to a row of arrays."""
        self._views = SessionViews(self.world, arrays, row)
        self.write_views()

    def write_views(self) -> None:
        """Writes the observations and masks that the compiled code does not write, and the inputs of that code."""
        self.world.write_weather()
        self._observations.write(self._delivered)
        self.masks.write()

    def observe(self) -> None:
        """Writes the session's observations and masks into its row."""
        self.write_views()
        self._views.write(EVERYTHING)

    def observations(self, roles: Sequence[Role] = AGENT_ROLES) -> dict[str, Observation]:
        """Builds the observations of some roles, by agent; shared values are computed once."""
        observations = self._observations.build(self._delivered, roles)
        if self.camera_perception is not None:
            self.camera_perception.add_to(observations)
        if self._pictures is not None:
            self._pictures.add_to(observations, self.decisions)
        return observations

    @property
    def picture(self) -> CameraFrame | None:
        """Picture of the camera on the car at the present decision, boxes included; None without a camera."""
        return None if self._pictures is None else self._pictures.frame(self.decisions)

    def end(self, reason: str) -> None:
        """Closes the session."""
        self._log.add(EventType.END, Role.AGENT, {"success": self.success, "reason": reason})
        self.over, self._end_reason = True, reason

    def break_off(self, reason: EndReason) -> None:
        """Closes the session between two decisions; the events are then those of the end only."""
        self._log.clear()
        self.end(reason.value)

    @property
    def success(self) -> bool:
        """Whether every live subgoal was reached, the destination last, without a collision that the ego caused."""
        return self.world.collisions == 0 and self.task.done and self.task.success

    @property
    def events(self) -> list[Event]:
        """Events of the last decision."""
        return self._log.events

    @property
    def refused(self) -> Mapping[Role, list[str]]:
        """Reasons for the refusals of the last decision, by role."""
        return self._log.refused

    @property
    def refusals(self) -> Mapping[Role, Mapping[str, str]]:
        """Reason for the refusal of each kind of action (`REFUSABLE`) at the last decision, or "", by role."""
        return self._log.refusals

    @property
    def said(self) -> Sequence[Utterance]:
        """All utterances that are over."""
        return self._dialogue.said

    @property
    def in_progress(self) -> Sequence[Utterance]:
        """Utterances that have begun and are not over."""
        return self._dialogue.in_progress

    def give_voices(self, pitches: Mapping[Role, float]) -> None:
        """Sets the pitch of speakers by role, before the first of them speaks."""
        self._dialogue.give_voices(pitches)

    @property
    def recordings(self) -> Mapping[str, Samples]:
        """Audio of the spans that were over at the last decision, at 16 kHz, by file name; empty without speech."""
        return self._dialogue.recordings

    @property
    def infractions(self) -> Mapping[str, int]:
        """Number of infractions so far by kind, collisions of any cause included."""
        if self._infractions is None:
            counts = self.world.reports.infractions
            self._infractions = {name: counts.get(kind, 0) for name, kind in _INFRACTIONS}
        return self._infractions

    # --- actions of the roles ---------------------------------------------------------------------------------------

    def begin_decision(self) -> None:
        """Counts a decision and forgets the events of the last one."""
        self.decisions += 1
        self._log.clear()

    def play_ad_wizard(self, action: RoleAction) -> str:
        """Carries out an action of the Ad-Wizard; returns its message to the participant."""
        assert isinstance(action, AdWizardAction)
        if action.exception is ExceptionKind.NONE:
            return ""
        outcome = self._exceptions.execute(action)
        name = action.exception.name.lower()
        if isinstance(outcome, str):
            self._log.refuse(Role.AD_WIZARD, "exception", name, outcome)
            return ""
        if action.exception is not ExceptionKind.MESSAGE:
            self._log.counts["exceptions"] += 1
            data = {"kind": name, **outcome}
            self.exceptions.append((self.world.time, self._ego_position(), data))
            self._log.add(EventType.EXCEPTION, Role.AD_WIZARD, data)
        if action.exception.is_task:
            self._subgoals.note_changes(name)
        if action.message:
            self.messages.append((self.world.time, action.message))
            self._log.add(EventType.MESSAGE, Role.AD_WIZARD, {"text": action.message})
        return action.message

    def _speak(self, role: Role, action: RoleAction) -> bool:
        assert isinstance(action, ParticipantAction | CoWizardAction)
        if action.speech is None:
            return False
        reason = self._dialogue.say(role, action.speech, self.world.time)
        if reason is not None:
            self._log.refuse(role, "speech", "speech", reason)
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
            self._log.refuse(Role.CO_WIZARD, "physical", action.label, reason)
            return
        self._log.counts["physical_actions"] += 1
        angle = physical.angle if action in (PhysicalAction.J_TURN, PhysicalAction.LANE_SWITCH) else None
        up = physical.up if action in (PhysicalAction.SPEED_CHANGE, PhysicalAction.LIGHT_CHANGE) else None
        data = {"action": action.label, "angle": angle, "up": up}
        self._log.add(EventType.PHYSICAL_ACTION, Role.CO_WIZARD, data, flagged=action in NAVIGATION_ACTIONS)

    def update_beliefs(self, mental: Mental) -> str | None:
        """Carries out a belief update of the Co-Wizard; returns the reason of a refusal."""
        outcome = self.beliefs.update(mental, self.world.localizer, self.world.sight)
        if isinstance(outcome, str):
            self._log.refuse(Role.CO_WIZARD, "mental", mental.action.label, outcome)
            return self._log.refusals[Role.CO_WIZARD]["mental"]
        self.world.ego.set_goals(self.beliefs.goal_places())
        self._log.add(EventType.BELIEF_UPDATE, Role.CO_WIZARD, {"action": mental.action.label, **outcome})
        return None

    # --- consequences -----------------------------------------------------------------------------------------------

    def note_place(self) -> None:
        """Records the place of the ego at a decision."""
        self.trail.append(self._ego_position())

    def note_arrivals(self) -> None:
        """Completes the subgoals whose waypoint the ego has reached, if it stands."""
        if self.world.car.speed <= EGO_STANDING:
            self._subgoals.note_arrivals(*self._ego_position())

    def _deliver(self, message: str) -> DeliveredMessages:
        """Delivers the utterances that are over and logs their acts; `message` is that of the Ad-Wizard."""
        said: dict[Role, Utterance] = {}
        heard: dict[Role, Utterance] = {}
        now = self.world.time
        for utterance in self._dialogue.deliver(now, self._cabin):
            speaker = utterance.said.speaker
            said[speaker], heard[speaker] = utterance.said, utterance.heard
            self.beliefs.hear(speaker, utterance.understood)
            self._log.counts["utterances"] += 1
            self._log.counts["acts"] += len(utterance.records)
            for data in utterance.records:
                self._log.add(EventType.DIALOGUE_MOVE, speaker, data, flagged=True)
        return DeliveredMessages(said=said, heard=heard, message=message, speaking=self._dialogue.speaking(now))

    def _cabin(self) -> CabinState:
        """Returns the noise sources in the car."""
        weather = self.world.weather.values
        return CabinState(
            speed=abs(float(self.world.car.speed)),
            rain=weather[WeatherParameter.PRECIPITATION],
            wind=weather[WeatherParameter.WIND_INTENSITY],
        )

    def _ego_position(self) -> tuple[float, float]:
        x, y = self.world.car.position.tolist()
        return x, y

    # --- record -----------------------------------------------------------------------------------------------------

    def header(self) -> SessionHeader:
        """Returns the header of the session's record."""
        return header_of(self.scenario, self.world.town.name, self.config)

    def summary(self) -> SessionSummary:
        """Returns the state of the session in JSON types: success, subgoals, counts."""
        counts = self._log.counts
        summary = SessionSummary(
            success=self.success,
            arrived=self.task.done,
            subgoals=SubgoalCounts(live=len(self.task.live), reached=self._subgoals.reached),
            collisions=self.world.collisions,
            infractions=dict(self.infractions),
            seconds=round(self.world.time, 3),
            utterances=counts["utterances"],
            acts=counts["acts"],
            physical_actions=counts["physical_actions"],
            exceptions=counts["exceptions"],
            refusals=counts["refusals"],
            exchanges=self._dialogue.exchanges,
            transactions=self._dialogue.transactions,
        )
        if self.over:
            summary["reason"] = self._end_reason
        return summary
