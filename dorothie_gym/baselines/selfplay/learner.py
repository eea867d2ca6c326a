"""Network that learns for one role or for all: MaskablePPO on rollouts that the caller collects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial

import gymnasium as gym
import numpy as np
import torch
from gymnasium import spaces
from numpy.typing import NDArray
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.vec_env import DummyVecEnv

from dorothie_gym.baselines.rl.behaviour_cloning import CloningResult, Demonstrations, clone, freeze_actor
from dorothie_gym.baselines.rl.checkpoint import Model, make_model, with_fitting_batches
from dorothie_gym.baselines.rl.run import OnStage
from dorothie_gym.baselines.rl.settings import TrainingSettings
from dorothie_gym.baselines.selfplay.env import RoleLayout, pad_masks, pad_vectors
from dorothie_gym.baselines.selfplay.role_interface import Mask
from dorothie_gym.policies.navigation.observation_vector import Vector


class SpacesOnlyEnv(gym.Env[Vector, np.int64]):
    """Spaces of a network that is never stepped by stable-baselines3 itself."""

    def __init__(self, size: int, actions: int) -> None:
        self.observation_space = spaces.Box(-1.0, 1.0, (size,), dtype=np.float32)
        self.action_space = spaces.Discrete(actions)


def make_network(settings: TrainingSettings, size: int, actions: int, rows: int = 1) -> Model:
    """Returns a MaskablePPO for vectors (size,), a number of actions, and a number of rows per step."""
    vector = DummyVecEnv([partial(SpacesOnlyEnv, size, actions)] * rows)
    return make_model(with_fitting_batches(settings, rows), vector)


class Learner:
    """MaskablePPO for one or more roles in some environments.

    Attributes:
        name: name of the role, or "all".
        roles: roles that it plays, as indices in `AGENT_ROLES`.
        players: environment and role of each row that it learns from (n, 2).
        padded: whether it plays several roles, whose vectors and masks are then padded.
        size: length of the network's input.
        actions: number of the network's actions.
        model: the MaskablePPO.
        cloned: whether it starts from behaviour cloning; the actor is then frozen at first, see `freeze_actor`.
    """

    def __init__(
        self,
        name: str,
        settings: TrainingSettings,
        layout: RoleLayout,
        environments: Mapping[int, Sequence[int]],
        logger: Logger,
    ) -> None:
        """Prepares an untrained learner.

        Args:
            name: name of the role, or "all".
            settings: settings of the network and of MaskablePPO.
            layout: layout of the rows.
            environments: environments that it learns in, by role; several roles share the network.
            logger: logger of its learning.
        """
        self.name, self.roles = name, tuple(environments)
        self._layout, self.padded = layout, len(environments) > 1
        self._envs = {role: np.array(envs) for role, envs in environments.items()}
        self.players: NDArray[np.int64] = np.array(
            [(env, role) for role, envs in environments.items() for env in envs]
        )  # fmt: skip
        self.size = layout.padded_size if self.padded else layout.sizes[self.roles[0]]
        self.actions = layout.padded_actions if self.padded else layout.actions[self.roles[0]]
        self.model = make_network(settings, self.size, self.actions, len(self.players))
        self.model.set_logger(logger)
        self.cloned = False
        self._vectors: Vector
        self._masks: Mask
        self._chosen: tuple[torch.Tensor, torch.Tensor, torch.Tensor]

    def act(self, rows: Vector) -> NDArray[np.int64]:
        """Samples an action for each of `players` (n,) from rows of the layout; `store` needs the same choice."""
        self._vectors = self._inputs(rows)
        self._masks = np.concatenate(
            [self._layout.masks(rows[envs], role, padded=self.padded) for role, envs in self._envs.items()]
        )
        self.model.policy.set_training_mode(False)
        with torch.no_grad():
            self._chosen = self.model.policy(torch.from_numpy(self._vectors), action_masks=self._masks)
        actions: NDArray[np.int64] = self._chosen[0].numpy()
        return actions

    def bootstrap(self, rewards: NDArray[np.float32], ends: Vector, truncated: NDArray[np.bool_]) -> None:
        """Adds the estimated value of the last state to the rewards of truncated sessions.

        Args:
            rewards: rewards of all environments and roles (N, 3); changed in place.
            ends: last row of each environment.
            truncated: whether an environment was truncated (N,).
        """
        own = truncated[self.players[:, 0]]
        envs, roles = self.players[own].T
        rewards[envs, roles] += self.model.gamma * self.values(ends).numpy()[own]

    def store(self, rewards: NDArray[np.float32], starts: NDArray[np.bool_]) -> None:
        """Adds the last choice of `act` and its rewards to the rollout.

        Args:
            rewards: rewards of all environments and roles (N, 3).
            starts: whether the choice was the first of a session (N,).
        """
        actions, values, log_likelihoods = self._chosen
        envs, roles = self.players.T
        self.model.rollout_buffer.add(
            self._vectors, actions.numpy().reshape(-1, 1), rewards[envs, roles], starts[envs], values, log_likelihoods,
            action_masks=self._masks,
        )  # fmt: skip

    def values(self, rows: Vector) -> torch.Tensor:
        """Returns the estimated values for each of `players` (n,)."""
        with torch.no_grad():
            found: torch.Tensor = self.model.policy.predict_values(torch.from_numpy(self._inputs(rows))).flatten()
        return found

    def update(self, rows: Vector, starts: NDArray[np.bool_], steps: int, total: int) -> None:
        """Learns from the rollout, and clears it.

        Args:
            rows: rows after the rollout, of all environments.
            starts: whether these are the first of a session (N,).
            steps: number of steps done so far.
            total: number of steps of the whole training.
        """
        model = self.model
        if self.cloned:
            freeze_actor(model.policy, steps)
        model.rollout_buffer.compute_returns_and_advantage(self.values(rows), starts[self.players[:, 0]])
        model.num_timesteps = steps
        model._update_current_progress_remaining(steps, total)
        model.train()
        model.rollout_buffer.reset()

    def clone(
        self,
        training: Mapping[int, Demonstrations],
        held_out: Mapping[int, Demonstrations],
        seed: int,
        on_stage: OnStage,
    ) -> CloningResult:
        """Clones the decisions of its roles, see `behaviour_cloning.clone`; both mappings hold decisions by role."""
        return clone(self.model, self._merged(training), self._merged(held_out), seed, on_stage)

    def _merged(self, by_role: Mapping[int, Demonstrations]) -> Demonstrations:
        """Returns the decisions of its roles, padded if there are several."""
        if not self.padded:
            return by_role[self.roles[0]]
        own = [by_role[role] for role in self.roles]
        vectors = [
            pad_vectors(part.observations.numpy(), role, self.size) for role, part in zip(self.roles, own, strict=True)
        ]
        masks = [pad_masks(part.masks.numpy(), self.actions) for part in own]
        return Demonstrations(
            torch.from_numpy(np.concatenate(vectors)), torch.from_numpy(np.concatenate(masks)),
            torch.cat([part.actions for part in own]),
        )  # fmt: skip

    def _inputs(self, rows: Vector) -> Vector:
        """Returns the input vectors of `players` (n, size)."""
        parts = [self._layout.vectors(rows[envs], role, padded=self.padded) for role, envs in self._envs.items()]
        return np.concatenate(parts)


def sample_actions(model: Model, vectors: Vector, masks: Mask, rng: np.random.Generator) -> NDArray[np.int64]:
    """Samples actions (n,) from a network's distribution for vectors (n, m) and masks (n, k)."""
    model.policy.set_training_mode(False)
    with torch.no_grad():
        distribution = model.policy.get_distribution(torch.from_numpy(vectors), action_masks=masks)
    shares = np.where(masks, distribution.distribution.probs.double().numpy(), 0.0)
    limits = np.cumsum(shares, axis=1)
    points = rng.random(len(vectors)) * limits[:, -1]
    chosen: NDArray[np.int64] = (limits <= points[:, None]).sum(axis=1)
    return chosen
