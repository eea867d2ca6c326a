"""All roles with the same two spaces, for libraries that ask for it: SuperSuit, and learners that share parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray
from pettingzoo import ParallelEnv

from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.ontology import Role
from dorothie_gym.spaces import noop
from dorothie_gym.wrappers.flatten import Flat, FlatActions, FlatObservations

FlatVector: TypeAlias = NDArray[np.float32]


class IdenticalSpaces(ParallelEnv[str, FlatVector, Flat]):
    """`DuoWizardEnv` with one observation space and one action space for all three roles.

    Observations are flat vectors (`FlatObservations`), filled up with zeros to the longest. The last three numbers tell
    the role, one-hot: what shares parameters has to know who it is. Actions are entries in a row (`FlatActions`); each
    has as many values as the role with most has there. A value that a role does not have counts as 0, and entries
    beyond its own are ignored. `info["action_mask"]` is flat and has a place for each value of each entry.

    Args:
        env: the environment.
        fields: which fields of its action a role keeps, by role; the others do nothing. None, or a role that is left
            out, keeps all but texts.
        only_masks: whether infos hold the mask and nothing else: TorchRL takes arrays only.

    Raises:
        ValueError: `fields` names a role or a field that does not exist.
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
            agent: FlatActions(
                env.action_space(agent), (fields or {}).get(agent), noop(Role(agent), env.limits)
            )
            for agent in self.possible_agents
        }  # fmt: skip
        self._observations = {agent: FlatObservations(env.observation_space(agent)) for agent in self.possible_agents}
        entries = max(len(flat.nvec) for flat in self._actions.values())
        self.nvec: Flat = np.ones(entries, dtype=np.int64)
        for flat in self._actions.values():
            self.nvec[: len(flat.nvec)] = np.maximum(self.nvec[: len(flat.nvec)], flat.nvec)
        self._length = max(len(flat.low) for flat in self._observations.values())
        low, high = self._bounds()
        self.observation_spaces = {
            agent: spaces.Box(low.copy(), high.copy(), dtype=np.float32) for agent in self.possible_agents
        }
        self.action_spaces = {agent: spaces.MultiDiscrete(self.nvec) for agent in self.possible_agents}

    def _bounds(self) -> tuple[FlatVector, FlatVector]:
        """Bounds that hold for all roles."""
        roles = len(self.possible_agents)
        low, high = (np.zeros(self._length + roles, dtype=np.float32) for _ in range(2))
        high[-roles:] = 1.0
        for flat in self._observations.values():
            size = len(flat.low)
            low[:size], high[:size] = np.minimum(low[:size], flat.low), np.maximum(high[:size], flat.high)
        return low, high

    @property
    def agents(self) -> list[str]:
        """Roles that still play."""
        return list(self.env.agents)

    @property
    def unwrapped(self) -> DuoWizardEnv:
        """The environment inside."""
        return self.env

    def observation_space(self, agent: str) -> spaces.Box:
        """The observation space, equal for all agents."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> spaces.MultiDiscrete:
        """The action space, equal for all agents."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, FlatVector], dict[str, dict[str, Any]]]:
        """Begins a session, see `DuoWizardEnv.reset`."""
        observations, infos = self.env.reset(seed=seed, options=options)
        return self._flatten(observations), self._pad(infos)

    def step(
        self, actions: Mapping[str, Flat]
    ) -> tuple[dict[str, FlatVector], dict[str, float], dict[str, bool], dict[str, bool], dict[str, dict[str, Any]]]:
        """Plays one decision, see `DuoWizardEnv.step`.

        Raises:
            ValueError: an action is missing, or of another shape.
        """
        taken = {agent: self.unflatten(agent, action) for agent, action in actions.items()}
        observations, rewards, terminations, truncations, infos = self.env.step(taken)
        return self._flatten(observations), rewards, terminations, truncations, self._pad(infos)

    def unflatten(self, agent: str, action: Flat) -> dict[str, Any]:
        """The role's own action for a flat one."""
        values = np.asarray(action, dtype=np.int64)
        if values.shape != self.nvec.shape:
            raise ValueError(f"action of {agent}: the shape is {values.shape}; it must be {self.nvec.shape}")
        own = self._actions[agent].nvec
        mine = values[: len(own)]
        taken: dict[str, Any] = self._actions[agent].action(np.where((mine >= 0) & (mine < own), mine, 0))
        return taken

    def render(self) -> Any:
        """Draws the aerial view, see `DuoWizardEnv.render`."""
        return self.env.render()

    def close(self) -> None:
        """Closes the window, if there is one."""
        self.env.close()

    def state(self) -> NDArray[np.float64]:
        """The true state in numbers, see `DuoWizardEnv.state`."""
        return self.env.state()

    def _flatten(self, observations: Mapping[str, Any]) -> dict[str, FlatVector]:
        flat = {}
        for agent, observation in observations.items():
            row = np.zeros(self._length + len(self.possible_agents), dtype=np.float32)
            values = self._observations[agent].vector(observation)
            row[: len(values)] = values
            row[self._length + self.possible_agents.index(agent)] = 1.0
            flat[agent] = row
        return flat

    def _pad(self, infos: dict[str, dict[str, Any]]) -> dict[str, dict[str, Any]]:
        starts = np.concatenate(([0], np.cumsum(self.nvec)))
        for agent, info in infos.items():
            own, flat = self._actions[agent].mask(info["action_mask"]), self._actions[agent].nvec
            mask = np.zeros(starts[-1], dtype=np.int8)
            mask[starts[len(flat) : -1]] = 1  # entries that the role does not have: 0 only
            begin = 0
            for start, size in zip(starts, flat, strict=False):
                mask[start : start + size] = own[begin : begin + size]
                begin += size
            info["action_mask"] = mask
        if self._only_masks:
            return {agent: {"action_mask": info["action_mask"]} for agent, info in infos.items()}
        return infos
