"""Wrapper with identical spaces for all roles, as required by SuperSuit and by parameter sharing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray
from pettingzoo import ParallelEnv

from dorothie_gym.ontology.roles import Role
from dorothie_gym.session.spaces.actions import ActionDict, StepInfo, noop
from dorothie_gym.session.spaces.flat import Flat, FlatActions, FlatObservations

if TYPE_CHECKING:
    from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
    from dorothie_gym.session.spaces.observations import Observation

FlatVector: TypeAlias = NDArray[np.float32]


class IdenticalSpaces(ParallelEnv[str, FlatVector, Flat]):
    """`DuoWizardEnv` with one observation space and one action space for all three roles.

    Observations are flat vectors (`FlatObservations`), zero-padded to the longest. The last three entries encode the
    role (one-hot), for policies with shared parameters. Actions are flat vectors (`FlatActions`); the number of values
    of an entry is the maximum over the roles. Values that a role does not have count as 0, and surplus entries are
    ignored. `info["action_mask"]` is flat, with one entry per value.

    The infos of the last step say in `TimeLimit.truncated` whether the session was cut short. SuperSuit merges both
    kinds of end, and stable-baselines3 reads this key to add the value of the last observation to the reward.

    Args:
        env: the environment.
        fields: action fields to keep, by role; the other fields do nothing. All fields except texts are kept for None
            and for roles without an entry.
        only_masks: whether infos contain only the mask; TorchRL accepts arrays only.

    Raises:
        ValueError: if `fields` contains an unknown role or field.
    """

    def __init__(
        self, env: DuoWizardEnv, fields: Mapping[str, Sequence[str]] | None = None, *, only_masks: bool = False
    ) -> None:
        for name in fields or {}:
            if name not in env.possible_agents:
                raise ValueError(f"fields: {name!r} is none of {', '.join(env.possible_agents)}")
        self.env, self._only_masks = env, only_masks
        self.metadata = {**env.metadata}
        self.render_mode = env.render_mode
        self.possible_agents = list(env.possible_agents)
        self._actions = {
            agent: FlatActions(env.action_space(agent), (fields or {}).get(agent), noop(Role(agent), env.limits))
            for agent in self.possible_agents
        }
        self._observations = {agent: FlatObservations(env.observation_space(agent)) for agent in self.possible_agents}
        entries = max(len(flat.nvec) for flat in self._actions.values())
        self.nvec: Flat = np.ones(entries, dtype=np.int64)
        for flat in self._actions.values():
            self.nvec[: len(flat.nvec)] = np.maximum(self.nvec[: len(flat.nvec)], flat.nvec)
        self._length = max(len(flat.low) for flat in self._observations.values())
        low, high = self._bounds()
        self.observation_spaces: dict[str, spaces.Box] = {
            agent: spaces.Box(low.copy(), high.copy(), dtype=np.float32) for agent in self.possible_agents
        }
        self.action_spaces: dict[str, spaces.MultiDiscrete] = {
            agent: spaces.MultiDiscrete(self.nvec) for agent in self.possible_agents
        }

    def _bounds(self) -> tuple[FlatVector, FlatVector]:
        """Returns bounds that cover all roles."""
        roles = len(self.possible_agents)
        low, high = (np.zeros(self._length + roles, dtype=np.float32) for _ in range(2))
        high[-roles:] = 1.0
        for flat in self._observations.values():
            size = len(flat.low)
            low[:size], high[:size] = np.minimum(low[:size], flat.low), np.maximum(high[:size], flat.high)
        return low, high

    @property
    def agents(self) -> list[str]:
        """Roles that are active."""
        return list(self.env.agents)

    @property
    def unwrapped(self) -> DuoWizardEnv:
        """The wrapped environment."""
        return self.env

    def observation_space(self, agent: str) -> spaces.Box:
        """Returns the observation space, equal for all agents."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> spaces.MultiDiscrete:
        """Returns the action space, equal for all agents."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: Mapping[str, object] | None = None
    ) -> tuple[dict[str, FlatVector], dict[str, StepInfo]]:
        """Starts a session, see `DuoWizardEnv.reset`."""
        observations, infos = self.env.reset(seed=seed, options=options)
        return self._flatten(observations), self._pad(infos)

    def step(
        self, actions: Mapping[str, Flat]
    ) -> tuple[dict[str, FlatVector], dict[str, float], dict[str, bool], dict[str, bool], dict[str, StepInfo]]:
        """Steps one decision, see `DuoWizardEnv.step`.

        Raises:
            ValueError: if an action is missing or has a wrong shape.
        """
        taken = {agent: self.unflatten(agent, action) for agent, action in actions.items()}
        observations, rewards, terminations, truncations, infos = self.env.step(taken)
        padded = self._pad(infos)
        for agent, info in padded.items():
            if not self._only_masks and (terminations[agent] or truncations[agent]):
                info["TimeLimit.truncated"] = not terminations[agent]
        return self._flatten(observations), rewards, terminations, truncations, padded

    def unflatten(self, agent: str, action: Flat) -> ActionDict:
        """Returns the action of the role for a flat one; raises `ValueError` for a wrong shape."""
        values = np.asarray(action, dtype=np.int64)
        if values.shape != self.nvec.shape:
            raise ValueError(f"action of {agent}: the shape is {values.shape}; it must be {self.nvec.shape}")
        own = self._actions[agent].nvec
        mine = values[: len(own)]
        return self._actions[agent].fields(np.where((mine >= 0) & (mine < own), mine, 0))

    def render(self) -> NDArray[np.uint8] | None:
        """Draws the aerial view, see `DuoWizardEnv.render`."""
        return self.env.render()

    def close(self) -> None:
        """Closes the window, if open."""
        self.env.close()

    @property
    def state_space(self) -> spaces.Box:
        """Space of `state()`, see `DuoWizardEnv.state_space`."""
        return self.env.state_space

    def state(self) -> NDArray[np.float64]:
        """Returns the true state as a vector, see `DuoWizardEnv.state`."""
        return self.env.state()

    def _flatten(self, observations: Mapping[str, Observation]) -> dict[str, FlatVector]:
        flat = {}
        for agent, observation in observations.items():
            row = np.zeros(self._length + len(self.possible_agents), dtype=np.float32)
            values = self._observations[agent].vector(observation)
            row[: len(values)] = values
            row[self._length + self.possible_agents.index(agent)] = 1.0
            flat[agent] = row
        return flat

    def _pad(self, infos: dict[str, StepInfo]) -> dict[str, StepInfo]:
        starts = np.concatenate(([0], np.cumsum(self.nvec)))
        for agent, info in infos.items():
            own, flat = self._actions[agent].mask(info["action_mask"]), self._actions[agent].nvec
            mask = np.zeros(starts[-1], dtype=np.int8)
            mask[starts[len(flat) : -1]] = 1  # surplus entries: only 0 is permitted
            begin = 0
            for start, size in zip(starts, flat, strict=False):
                mask[start : start + size] = own[begin : begin + size]
                begin += size
            info["action_mask"] = mask
        if self._only_masks:
            return {agent: {"action_mask": info["action_mask"]} for agent, info in infos.items()}
        return infos
