"""`DuoWizard-v0`: a participant, a Co-Wizard and an Ad-Wizard in a town (paper, section 3)."""

from __future__ import annotations

from collections.abc import Mapping
from copy import deepcopy
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray
from pettingzoo import AECEnv, ParallelEnv
from pettingzoo.utils.conversions import parallel_to_aec

from dorothie_gym.engine.config import EnvConfig
from dorothie_gym.engine.scenario import Scenario, draw_scenario
from dorothie_gym.engine.session_engine import Stage
from dorothie_gym.maps import Town, load_town
from dorothie_gym.ontology import AGENT_ROLES, Role
from dorothie_gym.recording import Event, SessionHeader
from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.spaces import ActionDecoder, SpaceLimits, action_space, observation_space
from dorothie_gym.tasks import StoryboardTemplate, load_template

_AGENTS = {str(role): role for role in AGENT_ROLES}


class DuoWizardEnv(ParallelEnv[str, dict[str, Any], dict[str, Any]]):
    """Three agents talk while a car drives through a town.

    ## Description
    A participant has errands to run (a storyboard) and knows where everything is, but cannot drive. The Co-Wizard
    drives by discrete actions and talks, but does not know the errands, nor where some of the places are. The
    Ad-Wizard throws unexpected situations at them: weather, roadblocks, sensor faults, changes of the task.

    ## Agents
    `participant`, `co_wizard`, `ad_wizard`; all act at once, twice a second of simulated time.

    ## Observation Space
    A `Dict` of fixed-shape arrays and texts for each role: see `dorothie_gym.spaces.observation_space`. Utterances of
    the others are observed in the decision after their last word. The Co-Wizard does not see
    hidden landmarks, the task, or arrivals; the participant does not see the Ad-Wizard's options.

    ## Action Space
    A `Dict` for each role: see `ParticipantAction`, `CoWizardAction` and `AdWizardAction` in `dorothie_gym.spaces`,
    which encode and decode it. `info["action_mask"]` mirrors it. A well-formed action that cannot be carried out is
    refused, told in `info["refused"]` and counted; a malformed one raises `ValueError` naming the field.

    ## Rewards
    Weighted terms (`RewardWeights`): subgoals reached, success, collisions of the car's own making, time, and each
    role's own talk and refusals. The Ad-Wizard gets the opposite of the shared terms. The terms are in
    `info["reward_terms"]`. `info["infractions"]` counts which rules of the road the car has broken so far.

    ## Episode End
    Terminates when the destination, the last live subgoal, is reached: the car stands within 2 m of the waypoint of
    its landmark. Truncates after `EnvConfig.max_seconds` or `max_cycles` decisions.

    ## Arguments
    - `town`: name of a town, path of an `.xodr` or `.yaml` file, or a `Town`.
    - `storyboard`: name of a template, path of a `.json` file, or a `StoryboardTemplate`; None draws one each reset.
    - `config`: `EnvConfig`.
    - `render_mode`: None, `"rgb_array"` or `"human"`.
    - `max_cycles`: decisions until truncation, instead of `config.max_seconds`.

    `reset(options={"scenario": Scenario})` plays a given scenario, whose seed is then the session's; other options
    are ignored.

    ## Version History
    - v0: first version.
    """

    metadata: ClassVar[dict[str, Any]] = {
        "name": "duo_wizard_v0",
        "render_modes": ["human", "rgb_array"],
        "render_fps": 2,
        "is_parallelizable": True,
    }

    def __init__(
        self,
        town: str | Path | Town = "brookside",
        storyboard: str | Path | StoryboardTemplate | None = None,
        *,
        config: EnvConfig | None = None,
        render_mode: str | None = None,
        max_cycles: int | None = None,
    ) -> None:
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise ValueError(f"render_mode {render_mode!r} is none of {self.metadata['render_modes']}")
        if max_cycles is not None and max_cycles < 1:
            raise ValueError(f"max_cycles is {max_cycles}; it must be at least 1")
        self.config = config or EnvConfig()
        self.render_mode = render_mode
        self.town = town if isinstance(town, Town) else load_town(town)
        self.template = load_template(storyboard) if isinstance(storyboard, str | Path) else storyboard
        self.max_cycles = max_cycles
        self.limits = SpaceLimits.for_town(self.town)
        self.possible_agents = [str(role) for role in AGENT_ROLES]
        self.agents: list[str] = []
        self.observation_spaces = {
            str(role): deepcopy(observation_space(role, self.limits, self.config.observe_acts)) for role in AGENT_ROLES
        }
        self.action_spaces = {str(role): deepcopy(action_space(role, self.limits)) for role in AGENT_ROLES}
        self._decoders = {role: ActionDecoder(role, self.limits) for role in AGENT_ROLES}
        self._network = TownNetwork(self.town)
        self._seeds = np.random.default_rng()
        self._stage: Stage | None = None
        self._cycles = 0
        self._painter: Any = None

    # --- PettingZoo -------------------------------------------------------------------------------------------------

    def observation_space(self, agent: str) -> spaces.Dict:
        """The observation space of an agent, always the same object."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> spaces.Dict:
        """The action space of an agent, always the same object."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[dict[str, dict[str, Any]], dict[str, dict[str, Any]]]:
        """Begins a session.

        Args:
            seed: what everything is drawn from; without one, the next of a series that the last seed began.
            options: `scenario` plays a given `Scenario`; other options are ignored.

        Returns:
            Observations and infos by agent.
        """
        scenario = (options or {}).get("scenario")
        if scenario is None:
            if seed is not None:
                self._seeds = np.random.default_rng(seed)
            session = seed if seed is not None else int(self._seeds.integers(2**31))
            scenario = draw_scenario(self.town, self.template, session)
        elif not isinstance(scenario, Scenario):
            raise ValueError(f"option 'scenario' is a {type(scenario).__name__}; it must be a Scenario")
        self._stage = Stage(self.town, self._network, scenario, self.config, self.limits)
        self._cycles = 0
        self.agents = list(self.possible_agents)
        observations = self._stage.observations()
        infos = self._infos({role: {} for role in AGENT_ROLES})
        if self.render_mode == "human":
            self.render()
        return observations, infos

    def step(
        self, actions: Mapping[str, Mapping[str, Any]]
    ) -> tuple[
        dict[str, dict[str, Any]], dict[str, float], dict[str, bool], dict[str, bool], dict[str, dict[str, Any]]
    ]:
        """Plays one decision: actions of all agents, then the physics until the next one.

        Args:
            actions: an action for each live agent.

        Returns:
            Observations, rewards, terminations, truncations and infos by agent.

        Raises:
            ValueError: an action is missing or malformed; the message names the agent and the field.
            RuntimeError: called before `reset`.
        """
        stage = self.stage
        if not self.agents:
            return {}, {}, {}, {}, {}
        decoded = {}
        for agent, role in _AGENTS.items():
            if agent not in actions:
                raise ValueError(f"the action of {agent} is missing; it is needed from {', '.join(self.agents)}")
            decoded[role] = self._decoders[role](actions[agent])
        terms = stage.play(decoded)
        self._cycles += 1
        out_of_time = (
            self._cycles >= self.max_cycles
            if self.max_cycles is not None
            else stage.world.time >= self.config.max_seconds - 1e-9
        )
        terminated, truncated = stage.task.done, out_of_time and not stage.task.done
        if terminated or truncated:
            stage.end("arrived" if terminated else "out of time")
        observations = stage.observations()
        infos = self._infos(terms)
        rewards = {agent: float(sum(terms[role].values())) for agent, role in _AGENTS.items()}
        terminations = dict.fromkeys(self.agents, terminated)
        truncations = dict.fromkeys(self.agents, truncated)
        if terminated or truncated:
            self.agents = []
        if self.render_mode == "human":
            self.render()
        return observations, rewards, terminations, truncations, infos

    def render(self) -> NDArray[np.uint8] | None:
        """Draws the aerial view: an array (800, 1280, 3), or in a window in human mode (then returns None)."""
        if self.render_mode is None:
            raise RuntimeError("render() needs render_mode='rgb_array' or 'human' when the environment is made")
        from dorothie_gym.engine.session_scene import Painter

        if self._painter is None:
            self._painter = Painter(human=self.render_mode == "human")
        frame: NDArray[np.uint8] | None = self._painter.paint(self.stage)
        return frame

    def close(self) -> None:
        """Closes the window, if there is one."""
        if self._painter is not None:
            self._painter.close()
            self._painter = None

    def state(self) -> NDArray[np.float64]:
        """The true state in numbers: time, pose, speed, reached subgoals."""
        stage = self.stage
        reached = [float(stage.task.reached(i)) for i in range(len(stage.task.storyboard.subgoals))]
        padded = np.zeros(self.limits.subgoals)
        padded[: len(reached)] = reached[: self.limits.subgoals]
        car = stage.world.car
        return np.concatenate(([stage.world.time, *car.position, car.heading, car.speed], padded))

    # --- what recorders and tools read ------------------------------------------------------------------------------

    @property
    def stage(self) -> Stage:
        """The session being played; raises `RuntimeError` before the first reset."""
        if self._stage is None:
            raise RuntimeError("call reset() first")
        return self._stage

    @property
    def scenario(self) -> Scenario:
        """What the session began with."""
        return self.stage.scenario

    @property
    def last_events(self) -> tuple[Event, ...]:
        """What happened in the last decision."""
        return tuple(self.stage.events)

    @property
    def last_frames(self) -> NDArray[np.float64]:
        """Trajectory of the last decision (n, 9), see `dorothie_gym.sim.config.FRAME_COLUMNS`."""
        return self.stage.world.frames

    def session_header(self) -> SessionHeader:
        """What is known of the session before it begins."""
        return self.stage.header()

    def summary(self) -> dict[str, Any]:
        """How the session stands, in JSON types."""
        return self.stage.summary()

    def _infos(self, terms: Mapping[Role, Mapping[str, float]]) -> dict[str, dict[str, Any]]:
        """What else an agent is told; everything in it is the taker's own."""
        stage = self.stage
        infractions = stage.infractions
        return {
            agent: {
                "action_mask": stage.masks.mask(role),
                "reward_terms": dict(terms[role]),
                "refused": list(stage.refused[role]),
                "infractions": dict(infractions),
            }
            for agent, role in _AGENTS.items()
        }


def parallel_env(**arguments: Any) -> DuoWizardEnv:
    """The environment, arguments as `DuoWizardEnv`'s."""
    return DuoWizardEnv(**arguments)


def env(**arguments: Any) -> AECEnv[str, dict[str, Any], dict[str, Any]]:
    """The environment in PettingZoo's turn-based form, arguments as `DuoWizardEnv`'s."""
    return parallel_to_aec(parallel_env(**arguments))


raw_env = parallel_env

__all__ = ["DuoWizardEnv", "env", "parallel_env", "raw_env"]
