"""`DuoWizard-v0`: a participant, a Co-Wizard and an Ad-Wizard in a town (paper, section 3).

The environment is PettingZoo's interface to a session: it hands the actions of the three agents to a `SessionEngine`
and returns what the roles observe. Users make it (`parallel_env(town="brookside")`); rollouts and the console play
the engine itself. The docstring of the class states the contract of a session.

First of the five files that explain the package (docs/architecture.md). Next: `session/session_engine.py`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import deepcopy
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray
from pettingzoo import AECEnv, ParallelEnv
from pettingzoo.utils.wrappers import OrderEnforcingWrapper

from dorothie_gym.envs.session_view import METADATA, SessionView, metadata_at
from dorothie_gym.envs.turn_based_duo_wizard import TurnBasedDuoWizard
from dorothie_gym.evaluation.tier_settings import tier_settings
from dorothie_gym.ontology.roles import AGENT_ROLES
from dorothie_gym.session.scenario import ResetOptions, Scenario, scenario_option
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.session.spaces.actions import ActionDict, ActionMapping, StepInfo, action_space
from dorothie_gym.session.spaces.fields import UNBOUNDED, SpaceLimits
from dorothie_gym.session.spaces.observations import Observation
from dorothie_gym.support.copying import Restorable, taken

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.session.config import EnvConfig
    from dorothie_gym.session.live_session import LiveSession
    from dorothie_gym.session.recording.events import Event
    from dorothie_gym.session.recording.header import SessionHeader
    from dorothie_gym.session.session_log import SessionSummary
    from dorothie_gym.tasks.storyboard import StoryboardTemplate

_METADATA: dict[str, object] = {"name": "duo_wizard_v0", **METADATA, "is_parallelizable": True}

_AGENTS = {str(role): role for role in AGENT_ROLES}


class DuoWizardEnv(Restorable, ParallelEnv[str, Observation, ActionDict]):
    """Dialogue of three agents while a car drives through a town.

    ## Description
    The participant has a list of tasks (a storyboard) and knows the whole map, but cannot drive. The Co-Wizard drives
    by discrete actions and talks, but knows neither the tasks nor the places of hidden landmarks. The Ad-Wizard
    creates unexpected situations: weather, roadblocks, sensor faults, changes of the task. `engine` is the
    `SessionEngine` that runs the session.

    ## Agents
    `participant`, `co_wizard`, `ad_wizard`; all act at the same time, twice per simulated second.

    ## Observation Space
    A `Dict` of fixed-shape arrays and texts for each role: see `dorothie_gym.session.spaces.observation_space`.
    Utterances of the others are observed at the decision after their last word. The Co-Wizard does not observe hidden
    landmarks, the task, or arrivals; the participant does not observe the options of the Ad-Wizard.

    ## Action Space
    A `Dict` for each role: see `ParticipantAction`, `CoWizardAction` and `AdWizardAction` in
    `dorothie_gym.session.spaces`, which encode and decode it. `info["action_mask"]` has the same fields. A well-formed
    action that cannot be carried out is refused, reported in `info["refused"]` and counted; a malformed one raises
    `ValueError` with the field.

    ## Rewards
    Weighted terms (`RewardWeights`): subgoals reached, success, collisions caused by the ego, time, and each role's
    own talk and refusals. The Ad-Wizard gets the shared terms with the opposite sign. `info["reward_terms"]` has the
    terms; `info["infractions"]` counts the traffic infractions of the ego so far.

    ## Episode End
    Terminates when the destination, the last live subgoal, is reached: the car stands within 2 m of the waypoint of
    its landmark. Truncates after `EnvConfig.max_seconds` or `max_cycles` decisions.

    ## Arguments
    - `town`: name of a town, path of an `.xodr` or `.yaml` file, or a `Town`. `"generated:SEED"` is a generated town;
      `"generated"` is another one for each seed of a session. None for `"millbrook"`, or the town of the tier.
    - `storyboard`: name of a template, path of a `.json` file, or a `StoryboardTemplate`; None draws one each reset.
    - `config`: `EnvConfig`, or a mapping of its fields.
    - `render_mode`: None, `"rgb_array"` or `"human"`.
    - `render_view`: picture of `render()`: `"map"`, `"camera"` (the windscreen) or `"both"`, with subtitles.
    - `max_cycles`: decisions until truncation, instead of `config.max_seconds`.
    - `tier`: name of a `Tier`, which gives town and settings that are not given themselves.

    `reset(options={"scenario": Scenario})` plays a given scenario, whose seed is then the session's; other options
    are ignored, as PettingZoo's API test expects.

    ## Version History
    - v0: first version.
    """

    metadata = _METADATA
    MUTABLE_ATTRIBUTES: ClassVar[Sequence[str]] = ("agents",)

    def __init__(
        self,
        town: str | Path | Town | None = None,
        storyboard: str | Path | StoryboardTemplate | None = None,
        *,
        config: EnvConfig | Mapping[str, object] | None = None,
        render_mode: str | None = None,
        max_cycles: int | None = None,
        render_view: str = "map",
        tier: str | None = None,
    ) -> None:
        usual = tier_settings(tier)
        self.engine = SessionEngine(
            usual.town if town is None else town,
            storyboard,
            config=usual.config if config is None else config,
            max_cycles=max_cycles,
        )
        rate = self.engine.config.decision_frequency
        self.metadata = {**_METADATA, **metadata_at(rate)}
        self.render_mode = render_mode
        self._view = SessionView(render_mode, frames_per_second=rate, render_view=render_view)
        self.possible_agents = [str(role) for role in AGENT_ROLES]
        self.agents: list[str] = []
        self.turns: TurnBasedDuoWizard | None = None
        self.observation_spaces: dict[str, spaces.Dict] = {
            str(role): deepcopy(self.engine.observation_space(role)) for role in AGENT_ROLES
        }
        self.action_spaces: dict[str, spaces.Dict] = {
            str(role): deepcopy(action_space(role, self.limits)) for role in AGENT_ROLES
        }

    # --- PettingZoo -------------------------------------------------------------------------------------------------

    def observation_space(self, agent: str) -> spaces.Dict:
        """Returns the observation space of an agent, always the same object."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> spaces.Dict:
        """Returns the action space of an agent, always the same object."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: ResetOptions | None = None
    ) -> tuple[dict[str, Observation], dict[str, StepInfo]]:
        """Begins a session.

        Args:
            seed: seed of the session; by default, the next number after the seed of the previous session.
            options: `scenario` plays a given `Scenario`; other options are ignored, as PettingZoo's API test expects.

        Returns:
            Observations and infos by agent.
        """
        observations = self.engine.reset(seed, scenario=scenario_option(options))
        self._view.begin(self.session)
        self.agents = list(self.possible_agents)
        if self.render_mode == "human":
            self.render()
        return observations.of(), {agent: self.engine.info(role) for agent, role in _AGENTS.items()}

    def step(
        self, actions: Mapping[str, ActionMapping]
    ) -> tuple[dict[str, Observation], dict[str, float], dict[str, bool], dict[str, bool], dict[str, StepInfo]]:
        """Plays one decision: the actions of all agents, then the physics until the next decision.

        Args:
            actions: an action for each live agent.

        Returns:
            Observations, rewards, terminations, truncations and infos by agent.

        Raises:
            ValueError: an action is missing or malformed; the message names the agent and the field.
            RuntimeError: called before `reset`.
        """
        if self.engine.over:
            return {}, {}, {}, {}, {}
        outcome = self.engine.step(actions)
        terms = outcome.reward_terms
        rewards = {agent: float(sum(terms[role].values())) for agent, role in _AGENTS.items()}
        infos = {agent: self.engine.info(role, terms[role]) for agent, role in _AGENTS.items()}
        terminations = dict.fromkeys(self.agents, outcome.terminated)
        truncations = dict.fromkeys(self.agents, outcome.truncated)
        if outcome.terminated or outcome.truncated:
            self.agents = []
        if self.render_mode == "human":
            self.render()
        return self.engine.observations.of(), rewards, terminations, truncations, infos

    def render(self) -> NDArray[np.uint8] | None:
        """Draws the session into an array: (800, 1280, 3), with a windscreen (720, 1280, 3); None in human mode."""
        return self._view.render(self.session)

    def close(self) -> None:
        """Closes the window, if there is one."""
        self._view.close()

    @cached_property
    def state_space(self) -> spaces.Box:
        """Space of `state()`, as PettingZoo's environments have it: (5 + subgoals,) float64."""
        high = np.ones(5 + self.limits.subgoals)
        high[:5] = UNBOUNDED
        low = -high
        low[0], low[5:] = 0.0, 0.0
        return spaces.Box(low, high, dtype=np.float64)

    def state(self) -> NDArray[np.float64]:
        """Returns the true state as numbers: time [s], pose [m, m, rad], speed [m/s], flags of reached subgoals."""
        session = self.session
        reached = [float(session.task.reached(i)) for i in range(len(session.task.storyboard.subgoals))]
        padded = np.zeros(self.limits.subgoals)
        padded[: len(reached)] = reached[: self.limits.subgoals]
        car = session.world.car
        return np.concatenate(([session.world.time, *car.position, car.heading, car.speed], padded))

    def mutable_values(self) -> dict[str, object]:
        """Returns the changing values of the environment, its engine, and the turn-based wrapper if there is one."""
        turns = {} if self.turns is None else self.turns.turn_values()
        return {**super().mutable_values(), "engine": self.engine.mutable_values(), "turns": turns}

    def apply_values(self, values: dict[str, object]) -> None:
        """Applies the values of the environment and of its engine."""
        engine, turns = taken(values, "engine", dict), taken(values, "turns", dict)
        super().apply_values(values)
        self.engine.apply_values(engine)
        if self.turns is not None:
            self.turns.apply_turn_values(turns)

    def compatibility(self) -> dict[str, object]:
        """Returns the kind of environment, whether its agents take turns, and engine values that must be equal."""
        form = "parallel" if self.turns is None else "turn-based"
        return {**self.engine.compatibility(), **super().compatibility(), "the form": form}

    # --- the engine inside ------------------------------------------------------------------------------------------

    @property
    def town(self) -> Town:
        """The map."""
        return self.engine.town

    @property
    def config(self) -> EnvConfig:
        """Settings of the sessions."""
        return self.engine.config

    @property
    def limits(self) -> SpaceLimits:
        """Sizes of the spaces."""
        return self.engine.limits

    @property
    def max_cycles(self) -> int | None:
        """Decisions until truncation; None where `config.max_seconds` limits the session."""
        return self.engine.max_cycles

    @max_cycles.setter
    def max_cycles(self, cycles: int | None) -> None:  # PettingZoo's API test sets it
        self.engine.max_cycles = cycles

    @property
    def session(self) -> LiveSession:
        """The session in progress; raises `RuntimeError` before the first reset."""
        return self.engine.session

    @property
    def scenario(self) -> Scenario:
        """Scenario of the session."""
        return self.engine.scenario

    @property
    def last_events(self) -> tuple[Event, ...]:
        """Events of the last decision."""
        return self.engine.last_events

    @property
    def last_frames(self) -> NDArray[np.float64]:
        """Trajectory of the last decision (n, 9), see `dorothie_gym.sim.config.FRAME_COLUMNS`."""
        return self.engine.last_frames

    def session_header(self) -> SessionHeader:
        """Returns the header of the session's record."""
        return self.engine.session_header()

    def summary(self) -> SessionSummary:
        """Returns the state of the session in JSON types."""
        return self.engine.summary()


parallel_env = raw_env = DuoWizardEnv


def env(**arguments: Any) -> AECEnv[str, Observation, ActionDict | None]:
    """Returns the environment in PettingZoo's turn-based form; arguments as in `DuoWizardEnv`."""
    return OrderEnforcingWrapper(TurnBasedDuoWizard(parallel_env(**arguments)))


__all__ = ["DuoWizardEnv", "TurnBasedDuoWizard", "env", "parallel_env", "raw_env"]
