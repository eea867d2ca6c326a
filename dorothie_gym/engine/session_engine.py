"""Engine that plays sessions in one town: draws the scenario, decodes actions, steps the session, ends it in time."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.engine.config import EnvConfig
from dorothie_gym.engine.live_session import LiveSession, RewardTerms, SessionSummary
from dorothie_gym.engine.masks import Mask
from dorothie_gym.engine.scenario import Scenario, draw_scenario
from dorothie_gym.maps import Town, load_town
from dorothie_gym.ontology import AGENT_ROLES, Role
from dorothie_gym.recording import Event, SessionHeader
from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.spaces import ActionDecoder, Observation, SpaceLimits
from dorothie_gym.tasks import StoryboardTemplate, load_template

_AGENTS = {str(role): role for role in AGENT_ROLES}


class LazyObservations(Mapping[str, Observation]):
    """Observations of the roles at one decision, each built when it is first read.

    A mapping is valid until the session takes its next step: it raises `RuntimeError` when an observation that was not
    read in time is asked for afterwards.
    """

    def __init__(self, session: LiveSession) -> None:
        self._session, self._decision = session, session.decisions
        self._built: dict[str, Observation] = {}

    def __getitem__(self, agent: str) -> Observation:
        return self.of((_AGENTS[agent],))[agent]

    def __iter__(self) -> Iterator[str]:
        return iter(_AGENTS)

    def __len__(self) -> int:
        return len(_AGENTS)

    def of(self, roles: Sequence[Role] = AGENT_ROLES) -> dict[str, Observation]:
        """Returns the observations of some roles by agent; those that are missing are built together."""
        missing = [role for role in roles if role not in self._built]
        if missing:
            if self._session.decisions != self._decision:
                raise RuntimeError(f"the session has taken a step since; the observation of {missing[0]} was not read")
            self._built.update(self._session.observations(missing))
        return {str(role): self._built[role] for role in roles}


@dataclass(frozen=True, kw_only=True)
class StepOutcome:
    """Outcome of one decision.

    Attributes:
        reward_terms: terms of each role's reward, by name.
        terminated: whether the destination was reached.
        truncated: whether the time is up.
    """

    reward_terms: Mapping[Role, RewardTerms]
    terminated: bool
    truncated: bool


class SessionEngine:
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
        self.town = town if isinstance(town, Town) else load_town(town)
        self.template = load_template(storyboard) if isinstance(storyboard, str | Path) else storyboard
        self.config = config or EnvConfig()
        self.max_cycles = max_cycles
        self.limits = SpaceLimits.for_town(self.town)
        self._network = TownNetwork(self.town)
        self._decoders = {role: ActionDecoder(role, self.limits) for role in AGENT_ROLES}
        self._seeds = np.random.default_rng()
        self._session: LiveSession | None = None
        self._observations: LazyObservations | None = None

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
            ValueError: `scenario` is no `Scenario`.
            StoryboardError: the template does not fit the town.
        """
        if scenario is None:
            if seed is not None:
                self._seeds = np.random.default_rng(seed)
            session_seed = seed if seed is not None else int(self._seeds.integers(2**31))
            scenario = draw_scenario(self.town, self.template, session_seed)
        elif not isinstance(scenario, Scenario):
            raise ValueError(f"option 'scenario' is a {type(scenario).__name__}; it must be a Scenario")
        self._session = LiveSession(self.town, self._network, scenario, self.config, self.limits)
        self._observations = None
        return self.observations

    def step(self, actions: Mapping[str, Mapping[str, Any]]) -> StepOutcome:
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
        for agent, role in _AGENTS.items():
            if agent not in actions:
                raise ValueError(f"the action of {agent} is missing; it is needed from {', '.join(_AGENTS)}")
            decoded[role] = self._decoders[role](actions[agent])
        self._observations = None
        terms = session.step(decoded)
        terminated = session.task.done
        truncated = self._out_of_time(session) and not terminated
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

    def mask(self, role: Role) -> dict[str, Mask | tuple[Mask, ...] | None]:
        """Returns the mask of a role's action space at the present decision."""
        return self.session.masks.mask(role)

    def info(self, role: Role, terms: RewardTerms | None = None) -> dict[str, Any]:
        """Returns the info dictionary of a role; the caller owns everything in it.

        Args:
            role: the role.
            terms: reward terms of the last decision; None for a session that has just begun.
        """
        session = self.session
        return {
            "action_mask": self.mask(role),
            "reward_terms": dict(terms or {}),
            "refused": list(session.refused[role]),
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
