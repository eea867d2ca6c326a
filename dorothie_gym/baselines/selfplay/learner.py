"""A network that learns for one role or for all: MaskablePPO, fed from outside."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import torch
from gymnasium import spaces
from numpy.typing import NDArray
from stable_baselines3.common.logger import Logger, configure
from stable_baselines3.common.vec_env import DummyVecEnv

from dorothie_gym.baselines.rl.behaviour_cloning import CloningResult, Demonstrations, ReportProgress, clone, hold_actor
from dorothie_gym.baselines.rl.checkpoint import make_model
from dorothie_gym.baselines.rl.settings import TrainingSettings
from dorothie_gym.baselines.selfplay.role_interface import Mask, Vector
from dorothie_gym.baselines.selfplay.role_layout import RoleLayout, pad_masks, pad_vectors

Rows = NDArray[np.int64]


class Spaces(gym.Env[Vector, np.int64]):
    """Nothing but the spaces of a network: it is fed from outside and asks no environment."""

    def __init__(self, size: int, actions: int) -> None:
        self.observation_space = spaces.Box(-1.0, 1.0, (size,), dtype=np.float32)
        self.action_space = spaces.Discrete(actions)


def make_network(settings: TrainingSettings, size: int, actions: int, rows: int = 1) -> Any:
    """Returns a MaskablePPO for vectors (size,), a number of actions, and a number of rows per update.

    Batches get smaller where the rows of a rollout cannot be shared out among them evenly.
    """
    parameters = dict(settings.parameters)
    if {"n_steps", "batch_size"} <= set(parameters):
        parameters["batch_size"] = math.gcd(parameters["n_steps"] * rows, parameters["batch_size"])
    vector = DummyVecEnv([partial(Spaces, size, actions)] * rows)
    return make_model(replace(settings, parameters=parameters), vector)


class Learner:
    """MaskablePPO for the players of some rows.

    Attributes:
        name: of the role, or "all".
        roles: those that it plays, as places in `AGENT_ROLES`.
        players: of each row the environment and the role (n, 2).
        size: numbers that the network takes in.
        actions: of the network.
        model: of sb3-contrib.
        cloned: whether it began with what others did; then its actor waits for its critic.
    """

    def __init__(
        self,
        name: str,
        settings: TrainingSettings,
        table: RoleLayout,
        places: Mapping[int, Sequence[int]],
        log: Path | None,
    ) -> None:
        """Prepares an untrained learner.

        Args:
            name: of the role, or "all".
            settings: of the network and of MaskablePPO.
            table: sizes of what the roles take in.
            places: the environments that it learns in, by role; the network is shared where there are several roles.
            log: folder for TensorBoard, or None.
        """
        self.name, self.roles = name, tuple(places)
        self._table, self.padded = table, len(places) > 1
        self._envs = {role: np.array(envs) for role, envs in places.items()}
        self.players: Rows = np.array([(env, role) for role, envs in places.items() for env in envs])
        self.size = table.padded_size if self.padded else table.sizes[self.roles[0]]
        self.actions = table.padded_actions if self.padded else table.actions[self.roles[0]]
        self.model = make_network(settings, self.size, self.actions, len(self.players))
        self.model.set_logger(Logger(None, []) if log is None else configure(str(log), ["tensorboard"]))
        self.cloned = False
        self._vectors: Vector
        self._masks: Mask
        self._chosen: tuple[torch.Tensor, torch.Tensor, torch.Tensor]

    def act(self, rows: Vector) -> NDArray[np.int64]:
        """Chooses an action for each of `players` (n,) in rows of the table, and keeps what it learns from later."""
        self._vectors = self._own(rows)
        self._masks = np.concatenate(
            [self._table.masks(rows[envs], role, padded=self.padded) for role, envs in self._envs.items()]
        )
        self.model.policy.set_training_mode(False)
        with torch.no_grad():
            self._chosen = self.model.policy(torch.from_numpy(self._vectors), action_masks=self._masks)
        actions: NDArray[np.int64] = self._chosen[0].numpy()
        return actions

    def look_beyond(self, rewards: NDArray[np.float32], ends: Vector, cut: NDArray[np.bool_]) -> None:
        """Adds what would still have come to the rewards of sessions that time has cut off.

        Args:
            rewards: of all environments and roles (N, 3); is changed.
            ends: the last row of each environment.
            cut: which environments were cut off (N,).
        """
        envs, roles = self.players[cut[self.players[:, 0]]].T
        beyond = self.values(ends).numpy()[cut[self.players[:, 0]]]
        rewards[envs, roles] += self.model.gamma * beyond

    def learn_from(self, rewards: NDArray[np.float32], starts: NDArray[np.bool_]) -> None:
        """Stores the last choice with its result.

        Args:
            rewards: of all environments and roles (N, 3).
            starts: whether the choice was the first of a session (N,).
        """
        actions, values, likely = self._chosen
        envs, roles = self.players.T
        self.model.rollout_buffer.add(
            self._vectors, actions.numpy().reshape(-1, 1), rewards[envs, roles], starts[envs], values, likely,
            action_masks=self._masks,
        )  # fmt: skip

    def values(self, rows: Vector) -> torch.Tensor:
        """Returns the estimated values for each of `players` (n,)."""
        with torch.no_grad():
            found: torch.Tensor = self.model.policy.predict_values(torch.from_numpy(self._own(rows))).flatten()
        return found

    def update(self, rows: Vector, starts: NDArray[np.bool_], steps: int, total: int) -> None:
        """Learns from what was kept, and forgets it.

        Args:
            rows: what comes next in all environments.
            starts: whether that is the first of a session (N,).
            steps: done so far; `total` in the end.
            total: see `steps`.
        """
        model = self.model
        if self.cloned:
            hold_actor(model.policy, steps)
        model.rollout_buffer.compute_returns_and_advantage(self.values(rows), starts[self.players[:, 0]])
        model.num_timesteps = steps
        model._update_current_progress_remaining(steps, total)
        model.train()
        model.rollout_buffer.reset()

    def clone(
        self,
        shown: Mapping[int, Demonstrations],
        held_out: Mapping[int, Demonstrations],
        seed: int,
        tell: ReportProgress,
    ) -> CloningResult:
        """Learns what others did in its roles: lessons by role, some to learn from and some that are held out."""
        return clone(self.model, self._merged(shown), self._merged(held_out), seed, tell)

    def _merged(self, lessons: Mapping[int, Demonstrations]) -> Demonstrations:
        if not self.padded:
            return lessons[self.roles[0]]
        own = [lessons[role] for role in self.roles]
        vectors = [
            pad_vectors(part.observations.numpy(), role, self.size) for role, part in zip(self.roles, own, strict=True)
        ]
        masks = [pad_masks(part.masks.numpy(), self.actions) for part in own]
        return Demonstrations(
            torch.from_numpy(np.concatenate(vectors)), torch.from_numpy(np.concatenate(masks)),
            torch.cat([part.actions for part in own]),
        )  # fmt: skip

    def _own(self, rows: Vector) -> Vector:
        parts = [self._table.vectors(rows[envs], role, padded=self.padded) for role, envs in self._envs.items()]
        return np.concatenate(parts)


def draw(model: Any, vectors: Vector, masks: Mask, rng: np.random.Generator) -> NDArray[np.int64]:
    """Draws actions (n,) from what a network takes for good, for vectors (n, m) and masks (n, k)."""
    model.policy.set_training_mode(False)
    with torch.no_grad():
        distribution = model.policy.get_distribution(torch.from_numpy(vectors), action_masks=masks)
    shares = np.where(masks, distribution.distribution.probs.double().numpy(), 0.0)
    limits = np.cumsum(shares, axis=1)
    points = rng.random(len(vectors)) * limits[:, -1]
    chosen: NDArray[np.int64] = (limits <= points[:, None]).sum(axis=1)
    return chosen
