"""Sessions of a town, one after the other: decoding of actions, seeds, and the end of a session.

`SessionEngine.step` runs one decision: it decodes the actions of the three roles, lets the session carry them out
(`begin_step`), steps the world by half a second of physics, and lets the session process the results (`end_step`).
Environments (`envs/`), rollouts (`evaluation/rollout/play.py`) and the console (`lab/console/room.py`) call it.

Second of the five files that explain the package. Next: `session/live_session.py`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, NamedTuple

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from dorothie_gym import maps  # lazy: a town that is given needs no reader
from dorothie_gym.maps.generated.specification import parse_series
from dorothie_gym.ontology.roles import AGENT_ROLES, Role
from dorothie_gym.session.config import EnvConfig, PerceptionModel
from dorothie_gym.session.live_session import LiveSession, StepBegun
from dorothie_gym.session.observations import LazyObservations
from dorothie_gym.session.providers import OBSERVERS, sensor_spaces
from dorothie_gym.session.recording.events import EndReason, Event
from dorothie_gym.session.rewards import RewardTerms, term_names
from dorothie_gym.session.scenario import Scenario, draw_scenario, header_of, template_option
from dorothie_gym.session.spaces.actions import ActionDecoder, AnyAction, RoleAction, StepInfo
from dorothie_gym.session.spaces.fields import SpaceLimits, dict_space
from dorothie_gym.session.spaces.observations import camera_perception_fields, observation_space
from dorothie_gym.sim.network.network import network_of
from dorothie_gym.support.copying import Restorable
from dorothie_gym.support.input_files import settings_of

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.session.observations import RoleMask
    from dorothie_gym.session.recording.header import SessionHeader
    from dorothie_gym.session.session_log import SessionSummary
    from dorothie_gym.sim.traffic_rules import WorldEvent
    from dorothie_gym.support.audio import Samples
    from dorothie_gym.tasks.storyboard import StoryboardTemplate


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
        town: name of a town, path of an `.xodr` or `.yaml` file, or a `Town`; "generated" is another one for each seed.
        storyboard: name of a template, path of a `.json` file, or a `StoryboardTemplate`; None draws one in each reset.
        config: settings of the sessions, also as a mapping, like that in the JSON of `env.spec`.
        max_cycles: decisions until truncation, instead of `config.max_seconds`.
        limits: sizes of the spaces, to make them larger than the town needs.

    Attributes:
        template: template of the storyboards, or None.
        config: see above.
        max_cycles: see above.
        limits: sizes of the spaces.
    """

    MUTABLE_ATTRIBUTES: ClassVar[Sequence[str]] = ("_session", "_seeds")

    def __init__(
        self,
        town: str | Path | Town,
        storyboard: str | Path | StoryboardTemplate | None = None,
        *,
        config: EnvConfig | Mapping[str, object] | None = None,
        max_cycles: int | None = None,
        limits: SpaceLimits | None = None,
    ) -> None:
        if max_cycles is not None and max_cycles < 1:
            raise ValueError(f"max_cycles is {max_cycles}; it must be at least 1")
        self._series = parse_series(town)
        self._town = maps.town_at(self._series or town, 0)
        self.template = template_option(storyboard)
        self.config = EnvConfig() if config is None else settings_of(config, EnvConfig, "config")
        self.max_cycles = max_cycles
        self.limits = limits or SpaceLimits.for_town(self._town)
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
        return {**super().compatibility(), "the town": self._series or self._town.identity, "the settings": self.config}

    @property
    def engine(self) -> SessionEngine:
        """This engine: code that accepts an environment with an engine also accepts an engine."""
        return self

    def reset(self, seed: int | None = None, *, scenario: Scenario | None = None) -> LazyObservations:
        """Begins a session.

        Args:
            seed: seed of the scenario; None takes the next number after the seed of the previous session.
            scenario: played in place of a drawn one; its seed is then the session's.

        Raises:
            StoryboardError: the template does not fit the town.
        """
        if scenario is None:
            if seed is not None:
                self._seeds = np.random.default_rng(seed)
            session_seed = seed if seed is not None else int(self._seeds.integers(2**31))
            town, config = self.town_of(session_seed), self.config
            scenario = draw_scenario(town, self.template, session_seed, config.stops, config.talk, config.storyboards)
        else:
            town = self.town_of(scenario.seed)
        self._session = LiveSession(town, network_of(town), scenario, self.config, self.limits)
        self._observations = None
        return self.observations

    def town_of(self, seed: int) -> Town:
        """Returns the town of the session of a seed: the engine's, unless each seed has another one."""
        return self._town if self._series is None else maps.town_at(self._series, seed)

    def step(self, actions: Mapping[str, AnyAction]) -> StepOutcome:
        """Runs one decision: the actions of all roles, then the physics until the next decision.

        Args:
            actions: an action for each agent, see `session.spaces.action_space`, or a typed one, as `CoWizardAction`.

        Raises:
            ValueError: an action is missing or malformed; the message names the agent and the field.
            RuntimeError: no session has begun, or it has ended.
        """
        return self.end_step(self.begin_step(self.decode(actions)), self.session.world.step(self.config.frames))

    def decode(self, actions: Mapping[str, AnyAction]) -> dict[Role, RoleAction]:
        """Returns the actions of a decision, decoded; errors as in `step`."""
        if self.session.over:
            raise RuntimeError("the session is over: call reset() first")
        decoded = {}
        if type(actions) is not dict and not isinstance(actions, Mapping):
            raise ValueError(f"actions is a {type(actions).__name__}; it must be a dict with an action for each agent")
        for agent, (role, decoder) in self._decoders.items():
            if agent not in actions:
                raise ValueError(f"the action of {agent} is missing; it is needed from {', '.join(self._decoders)}")
            decoded[role] = decoder(actions[agent])
        return decoded

    def begin_step(self, actions: Mapping[Role, RoleAction]) -> StepBegun:
        """Carries out the actions of a decision; callers then step the world and end the step."""
        self._observations = None
        return self.session.begin_step(actions)

    def end_step(self, begun: StepBegun, events: Sequence[WorldEvent]) -> StepOutcome:
        """Ends a decision after the step of the world, with the events of the step."""
        session = self.session
        terms, terminated = session.end_step(begun, events), session.task.done
        truncated = not terminated and self._out_of_time(session)
        if terminated or truncated:
            session.end(EndReason.ARRIVED.value if terminated else EndReason.OUT_OF_TIME.value)
        return StepOutcome(reward_terms=terms, terminated=terminated, truncated=truncated)

    def break_off(self, reason: EndReason) -> None:
        """Ends the session between two decisions, because people left it or the program stops.

        The frames of the last decision are no longer those of `last_frames`: they have been recorded.

        Raises:
            ValueError: the reason is one of the engine itself.
            RuntimeError: no session has begun, or it has ended.
        """
        if not reason.breaks_off:
            allowed = ", ".join(each.value for each in EndReason if each.breaks_off)
            raise ValueError(
                f"reason is {reason.value!r}, which the engine itself determines; it must be one of {allowed}"
            )
        if self.session.over:
            raise RuntimeError("the session is over: call reset() first")
        self.session.break_off(reason)

    def _out_of_time(self, session: LiveSession) -> bool:
        if self.max_cycles is not None:
            return session.decisions >= self.max_cycles
        return session.world.time >= session.time_limit - 1e-9

    # --- the current decision ---------------------------------------------------------------------------------------

    @property
    def over(self) -> bool:
        """Whether the session is over; raises `RuntimeError` before the first reset."""
        return self.session.over

    @property
    def town(self) -> Town:
        """The map: that of the session where each seed has another one."""
        return self._town if self._series is None or self._session is None else self._session.world.town

    @property
    def has_begun(self) -> bool:
        """Whether there was a reset."""
        return self._session is not None

    @property
    def session(self) -> LiveSession:
        """The session in progress, or the last one; raises `RuntimeError` before the first reset."""
        if self._session is None:
            raise RuntimeError("call reset() first")
        return self._session

    def observation_space(self, role: Role) -> spaces.Dict:
        """Returns the observation space of a role, including fields of camera and perception if they are configured."""
        space, config = observation_space(role, self.limits, self.config.observe_acts), self.config
        if role not in OBSERVERS:
            return space
        seen = (
            dict_space(camera_perception_fields(self.limits)).spaces
            if config.perception is PerceptionModel.CAMERA
            else {}
        )
        sensors = sensor_spaces(config, role)
        return spaces.Dict({**space.spaces, **seen, **sensors}) if seen or sensors else space

    @property
    def observations(self) -> LazyObservations:
        """Observations at the current decision, the same object until the next step."""
        if self._observations is None:
            self._observations = LazyObservations(self.session)
        return self._observations

    def mask(self, role: Role) -> RoleMask:
        """Returns the mask of a role's action space at the current decision."""
        return self.session.observer.masks.mask(role)

    def info(self, role: Role, terms: RewardTerms | None = None) -> StepInfo:
        """Returns the info dictionary of a role, always with the same keys; the caller owns its contents.

        Args:
            role: the role.
            terms: reward terms of the last decision; None for a session that has just begun, whose terms are 0.
        """
        session = self.session
        return {
            "action_mask": session.observer.masks.mask(role),
            "reward_terms": dict(terms) if terms else dict.fromkeys(term_names(role), 0.0),
            "refused": {kind: bool(reason) for kind, reason in session.log.refusals[role].items()},
            "refusal_reason": "; ".join(session.log.refused[role]),
            "infractions": session.log.infractions,
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
    def last_recordings(self) -> Mapping[str, Samples]:
        """Audio of the spans that had ended at the last decision, at 16 kHz, by file name; empty without speech."""
        return self.session.dialogue.recordings

    @property
    def last_frames(self) -> NDArray[np.float64]:
        """Trajectory of the last decision (n, 9), see `dorothie_gym.sim.config.FRAME_COLUMNS`."""
        return self.session.world.frames

    def session_header(self) -> SessionHeader:
        """Returns the header of the session's record."""
        session = self.session
        return header_of(session.scenario, session.world.town.name, session.config)

    def summary(self) -> SessionSummary:
        """Returns the state of the session in JSON types: success, subgoals, counts."""
        return self.session.summary()
