"""Sessions in progress: order of the roles' actions in a decision, their consequences, and the end of the session."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.copying import Restorable
from dorothie_gym.dialogue import Utterance
from dorothie_gym.engine.beliefs import BeliefTracker
from dorothie_gym.engine.config import EnvConfig, RewardTerms
from dorothie_gym.engine.dialogue_channel import DialogueChannel
from dorothie_gym.engine.exception_executor import ExceptionExecutor
from dorothie_gym.engine.masks import ActionMasks, RoleMask
from dorothie_gym.engine.observations import DeliveredMessages, LazyObservations, ObservationBuilder
from dorothie_gym.engine.path_measurements import UpcomingJunction
from dorothie_gym.engine.scenario import Scenario, draw_scenario, header_of, template_option
from dorothie_gym.engine.session_log import EventLog, SessionSummary, SubgoalCounts, SubgoalTracker
from dorothie_gym.maps import Town, load_town
from dorothie_gym.ontology import AGENT_ROLES, NAVIGATION_ACTIONS, ExceptionKind, PhysicalAction, Role
from dorothie_gym.recording import Event, EventType, SessionHeader
from dorothie_gym.sim.ego.limits import EGO_STANDING
from dorothie_gym.sim.infractions import INFRACTION_KINDS
from dorothie_gym.sim.network.network import TownNetwork, network_of
from dorothie_gym.sim.state.world_arrays import WorldArrays
from dorothie_gym.sim.world import World
from dorothie_gym.spaces import (
    ActionDecoder,
    ActionMapping,
    AdWizardAction,
    CoWizardAction,
    Mental,
    Observation,
    ParticipantAction,
    Physical,
    RoleAction,
    SpaceLimits,
    StepInfo,
)
from dorothie_gym.tasks import StoryboardTemplate, TaskState

_INFRACTIONS = tuple((kind.value, kind) for kind in INFRACTION_KINDS)


def session_seeds(scenario: Scenario) -> list[np.random.SeedSequence]:
    """Returns the seeds of a session: of the world, of words, of the recogniser, and of styles."""
    # A new subsystem takes a further child at the end: the seeds of the others stay as they are.
    return np.random.SeedSequence([scenario.seed, 1]).spawn(4)


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
    """

    def __init__(
        self, town: Town, network: TownNetwork, scenario: Scenario, config: EnvConfig, limits: SpaceLimits,
        arrays: WorldArrays | None = None,
    ) -> None:  # fmt: skip
        """Begins a session, or takes over one of which only the world has been played.

        Args:
            town: the map.
            network: its network.
            scenario: storyboard, street names and departure.
            config: settings.
            limits: sizes of the spaces.
            arrays: arrays of the world of a session that has begun, by `session_seeds` and `start_world`.
        """
        self.scenario, self.config, self.limits = scenario, config, limits
        world_seed, word_seed, ear_seed, style_seed = session_seeds(scenario)
        self.world = World(
            town, config.world, seed=world_seed, departure=scenario.departure, network=network, arrays=arrays
        )  # fmt: skip
        self.task = TaskState(scenario.storyboard)
        self.beliefs = BeliefTracker(town, scenario)
        self._exceptions = ExceptionExecutor(self.world, self.task, limits.props)
        self._dialogue = DialogueChannel(
            scenario, config, limits.spans, words=word_seed, ears=ear_seed, styles=style_seed
        )
        self._junction = UpcomingJunction(self.world)
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

    # made when they are first used: not all sessions observe by dicts, or ask for masks

    @cached_property
    def _observations(self) -> ObservationBuilder:
        return ObservationBuilder(
            self.world, self.scenario, self.task, self.beliefs, self.limits, self.config.observe_acts, self._junction
        )

    @cached_property
    def masks(self) -> ActionMasks:
        """Masks of the actions that would be carried out now."""
        return ActionMasks(self.world, self.task, self.limits, self._junction)

    # --- one decision -----------------------------------------------------------------------------------------------

    def step(self, actions: Mapping[Role, RoleAction]) -> dict[Role, RewardTerms]:
        """Carries out one action of each role, runs the physics until the next decision, returns the reward terms."""
        self.begin_decision()
        collisions, reached = self.world.collisions, self._subgoals.reached
        message = self.play_ad_wizard(actions[Role.AD_WIZARD])
        spoken = {role: self._speak(role, actions[role]) for role in (Role.PARTICIPANT, Role.CO_WIZARD)}
        self._play_co_wizard(actions[Role.CO_WIZARD])
        for event in self.world.step(self.config.frames):
            self._log.add_world_event(event)
        self._infractions = None
        self.note_arrivals()
        self._delivered = self._deliver(message)
        self.note_place()
        return self.config.rewards.terms(
            reached=self._subgoals.reached - reached,
            success=self.success,
            collisions=self.world.collisions - collisions,
            decision_frequency=self.config.decision_frequency,
            refusals={role: len(reasons) for role, reasons in self._log.refused.items()},
            spoken=spoken,
        )

    def observations(self, roles: Sequence[Role] = AGENT_ROLES) -> dict[str, Observation]:
        """Builds the observations of some roles, by agent; what several of them need is computed once."""
        return self._observations.build(self._delivered, roles)

    def end(self, reason: str) -> None:
        """Closes the session."""
        self._log.add(EventType.END, Role.AGENT, {"success": self.success, "reason": reason})
        self.over, self._end_reason = True, reason

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
    def said(self) -> Sequence[Utterance]:
        """All utterances that are over."""
        return self._dialogue.said

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
            self._log.refuse(Role.AD_WIZARD, name, outcome)
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
            self._log.refuse(role, "speech", reason)
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
            self._log.refuse(Role.CO_WIZARD, action.label, reason)
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
            self._log.refuse(Role.CO_WIZARD, mental.action.label, outcome)
            return self._log.refused[Role.CO_WIZARD][-1]
        self.world.ego.set_goals(self.beliefs.goal_places())
        self._log.add(EventType.BELIEF_UPDATE, Role.CO_WIZARD, {"action": mental.action.label, **outcome})
        return None

    # --- consequences -----------------------------------------------------------------------------------------------

    def note_place(self) -> None:
        """Notes the place of the ego at a decision."""
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
        for utterance in self._dialogue.deliver(now):
            speaker = utterance.said.speaker
            said[speaker], heard[speaker] = utterance.said, utterance.heard
            self.beliefs.hear(speaker, utterance.understood)
            self._log.counts["utterances"] += 1
            self._log.counts["acts"] += len(utterance.records)
            for data in utterance.records:
                self._log.add(EventType.DIALOGUE_MOVE, speaker, data, flagged=True)
        return DeliveredMessages(said=said, heard=heard, message=message, speaking=self._dialogue.speaking(now))

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


# --- sessions of a town -----------------------------------------------------------------------------------------------


class StepOutcome(NamedTuple):
    """Outcome of one decision.

    Attributes:
        reward_terms: terms of each role's reward, by name.
        terminated: whether the destination was reached.
        truncated: whether the time is up.
    """

    reward_terms: Mapping[Role, RewardTerms]
    terminated: bool
    truncated: bool


class SessionEngine(Restorable):
    """Plays the sessions of one town, one after the other, for all three roles.

    Environments are views of an engine; corpora, rollouts and replay checks step it without one.

    Args:
        town: name of a town, path of an `.xodr` or `.yaml` file, or a `Town`.
        storyboard: name of a template, path of a `.json` file, or a `StoryboardTemplate`; None draws one in each reset.
        config: settings of the sessions.
        max_cycles: decisions until truncation, instead of `config.max_seconds`.

    Attributes:
        town: the map.
        template: template of the storyboards, or None.
        config: see above.
        max_cycles: see above.
        limits: sizes of the spaces that the town needs.
    """

    CHANGES: ClassVar[Sequence[str]] = ("_session", "_seeds")

    def __init__(
        self,
        town: str | Path | Town,
        storyboard: str | Path | StoryboardTemplate | None = None,
        *,
        config: EnvConfig | None = None,
        max_cycles: int | None = None,
    ) -> None:
        if max_cycles is not None and max_cycles < 1:
            raise ValueError(f"max_cycles is {max_cycles}; it must be at least 1")
        if config is not None and not isinstance(config, EnvConfig):
            raise ValueError(
                f"config is a {type(config).__name__}; it must be an EnvConfig, such as EnvConfig(max_seconds=600.0)"
            )
        self.town = town if isinstance(town, Town) else load_town(town)
        self.template = template_option(storyboard)
        self.config = config or EnvConfig()
        self.max_cycles = max_cycles
        self.limits = SpaceLimits.for_town(self.town)
        self._network = network_of(self.town)
        self._decoders = {str(role): (role, ActionDecoder(role, self.limits)) for role in AGENT_ROLES}
        self._seeds = np.random.default_rng()
        self._session: LiveSession | None = None
        self._observations: LazyObservations | None = None

    def apply_values(self, values: dict[str, object]) -> None:
        """Applies a session and the series of seeds; the observations are built when they are read."""
        super().apply_values(values)
        self._observations = None

    def compatibility(self) -> dict[str, object]:
        """Returns the town and the settings."""
        return {**super().compatibility(), "the town": self.town, "the settings": self.config}

    @property
    def engine(self) -> SessionEngine:
        """This engine: an engine is played like an environment that has one."""
        return self

    def reset(self, seed: int | None = None, *, scenario: Scenario | None = None) -> LazyObservations:
        """Begins a session.

        Args:
            seed: seed of the scenario; None takes the next number of the series that the last given seed began.
            scenario: played in place of a drawn one; its seed is then the session's.

        Raises:
            StoryboardError: the template does not fit the town.
        """
        if scenario is None:
            if seed is not None:
                self._seeds = np.random.default_rng(seed)
            session_seed = seed if seed is not None else int(self._seeds.integers(2**31))
            scenario = draw_scenario(self.town, self.template, session_seed)
        self._session = LiveSession(self.town, self._network, scenario, self.config, self.limits)
        self._observations = None
        return self.observations

    def step(self, actions: Mapping[str, ActionMapping]) -> StepOutcome:
        """Plays one decision: the actions of all roles, then the physics until the next decision.

        Args:
            actions: an action for each agent, see `dorothie_gym.spaces.action_space`.

        Raises:
            ValueError: an action is missing or malformed; the message names the agent and the field.
            RuntimeError: no session has begun, or it is over.
        """
        session = self.session
        if session.over:
            raise RuntimeError("the session is over: call reset() first")
        decoded = {}
        if type(actions) is not dict and not isinstance(actions, Mapping):
            raise ValueError(f"actions is a {type(actions).__name__}; it must be a dict with an action for each agent")
        for agent, (role, decoder) in self._decoders.items():
            if agent not in actions:
                raise ValueError(f"the action of {agent} is missing; it is needed from {', '.join(self._decoders)}")
            decoded[role] = decoder(actions[agent])
        self._observations = None
        terms = session.step(decoded)
        terminated = session.task.done
        truncated = not terminated and self._out_of_time(session)
        if terminated or truncated:
            session.end("arrived" if terminated else "out of time")
        return StepOutcome(reward_terms=terms, terminated=terminated, truncated=truncated)

    def _out_of_time(self, session: LiveSession) -> bool:
        if self.max_cycles is not None:
            return session.decisions >= self.max_cycles
        return session.world.time >= self.config.max_seconds - 1e-9

    # --- the present decision ---------------------------------------------------------------------------------------

    @property
    def over(self) -> bool:
        """Whether the session is over; raises `RuntimeError` before the first reset."""
        return self.session.over

    @property
    def session(self) -> LiveSession:
        """The session in progress, or the last one; raises `RuntimeError` before the first reset."""
        if self._session is None:
            raise RuntimeError("call reset() first")
        return self._session

    @property
    def observations(self) -> LazyObservations:
        """Observations at the present decision, the same object until the next step."""
        if self._observations is None:
            self._observations = LazyObservations(self.session)
        return self._observations

    def mask(self, role: Role) -> RoleMask:
        """Returns the mask of a role's action space at the present decision."""
        return self.session.masks.mask(role)

    def info(self, role: Role, terms: RewardTerms | None = None) -> StepInfo:
        """Returns the info dictionary of a role; the caller owns everything in it.

        Args:
            role: the role.
            terms: reward terms of the last decision; None for a session that has just begun.
        """
        session = self.session
        return {
            "action_mask": session.masks.mask(role),
            "reward_terms": dict(terms) if terms else {},
            "refused": session.refused[role].copy(),
            "infractions": dict(session.infractions),
        }

    # --- the record -------------------------------------------------------------------------------------------------

    @property
    def scenario(self) -> Scenario:
        """Scenario of the session."""
        return self.session.scenario

    @property
    def last_events(self) -> tuple[Event, ...]:
        """Events of the last decision."""
        return tuple(self.session.events)

    @property
    def last_frames(self) -> NDArray[np.float64]:
        """Trajectory of the last decision (n, 9), see `dorothie_gym.sim.config.FRAME_COLUMNS`."""
        return self.session.world.frames

    def session_header(self) -> SessionHeader:
        """Returns the header of the session's record."""
        return self.session.header()

    def summary(self) -> SessionSummary:
        """Returns the state of the session in JSON types: success, subgoals, counts."""
        return self.session.summary()
