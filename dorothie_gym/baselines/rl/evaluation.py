"""Greedy play of trained models: evaluation over seeded episodes, and the Co-Wizard in rollouts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.analysis.intervals import wilson_interval
from dorothie_gym.baselines.rl.checkpoint import Model, load_model
from dorothie_gym.baselines.rl.environments import masks_of
from dorothie_gym.baselines.rl.settings import NAVIGATION
from dorothie_gym.baselines.rl.vector_env import MakeEnv
from dorothie_gym.errors import SettingsError
from dorothie_gym.policies.navigation import NavigationPolicy
from dorothie_gym.policies.navigation.observation_vector import MAX_SECONDS, Vector
from dorothie_gym.spaces import SpaceLimits

FIRST_SEED: Final = 1_000_000
"""Seed of the first episode of an evaluation; training uses smaller seeds."""

PARALLEL_EPISODES: Final = 8
"""Number of episodes played in parallel: networks are faster on batches."""


Action: TypeAlias = Any
"""Action of an environment: a number or a vector."""

Act: TypeAlias = Callable[[Vector, NDArray[np.bool_] | None], Sequence[Action]]
"""Function from observations (n, ...) and masks (n, m), if environments have them, to actions."""


@dataclass(frozen=True, kw_only=True)
class EpisodeStatistics:
    """Statistics of episodes.

    Attributes:
        success: share of episodes that succeeded.
        low: lower end of its interval of 95 % (Wilson 1927).
        high: upper end.
        reward: mean sum of rewards.
        length: mean number of steps.
        episodes: number of episodes.
    """

    success: float
    low: float
    high: float
    reward: float
    length: float
    episodes: int


def evaluate_policy(make: MakeEnv, act: Act, episodes: int, seed: int = FIRST_SEED) -> EpisodeStatistics:
    """Plays episodes with consecutive seeds.

    Args:
        make: makes an environment.
        act: policy.
        episodes: number of episodes.
        seed: seed of the first episode.
    """
    envs = [make() for _ in range(min(PARALLEL_EPISODES, episodes))]
    successes, rewards, lengths = np.zeros(episodes), np.zeros(episodes), np.zeros(episodes)
    playing = dict(enumerate(range(len(envs))))  # environment: episode
    observations = {k: env.reset(seed=seed + k)[0] for k, env in enumerate(envs)}
    following = len(envs)
    while playing:
        masks = [masks_of(envs[k]) for k in playing]
        known = [mask for mask in masks if mask is not None]
        stacked = np.stack(known) if len(known) == len(masks) else None
        actions = act(np.stack([observations[k] for k in playing]), stacked)
        for (k, episode), action in zip(list(playing.items()), actions, strict=True):
            observations[k], reward, terminated, truncated, info = envs[k].step(action)
            rewards[episode] += float(reward)
            lengths[episode] += 1
            if terminated or truncated:
                successes[episode] = bool(info.get("is_success", False))
                del playing[k]
                if following < episodes:
                    playing[k] = following
                    observations[k] = envs[k].reset(seed=seed + following)[0]
                    following += 1
    for env in envs:
        env.close()
    low, high = wilson_interval(int(successes.sum()), episodes)
    return EpisodeStatistics(
        success=float(successes.mean()), low=low, high=high, reward=float(rewards.mean()),
        length=float(lengths.mean()), episodes=episodes,
    )  # fmt: skip


def greedy_policy(model: Model, *, masked: bool) -> Act:
    """Returns the greedy policy of a model; `masked` models respect the masks."""

    def act(observations: Vector, masks: NDArray[np.bool_] | None) -> Sequence[Action]:
        keywords = {"action_masks": masks} if masked and masks is not None else {}
        actions: Sequence[Action] = model.predict(observations, deterministic=True, **keywords)[0]
        return actions

    return act


# --- Models of `train-rl` as Co-Wizards ------------------------------------------------------------------------------


def make_player(path: Path, limits: SpaceLimits) -> NavigationPolicy:
    """Returns a Co-Wizard that drives by the greedy policy of a model.

    Args:
        path: folder of the model, or a file in it.
        limits: sizes of the spaces.

    Raises:
        ModelFileError: the files are missing or damaged.
        SettingsError: the model was trained in another environment than `Navigation-v0`.
    """
    model, settings = load_model(path)
    if settings.env != NAVIGATION:
        raise SettingsError(
            f"{path}: was trained in {settings.env}; only models trained in {NAVIGATION} can play the co_wizard"
        )
    seconds = settings.env_settings.get("max_seconds", MAX_SECONDS)
    return NavigationPolicy(GreedyDriver(model, masked=settings.masked), limits, max_seconds=seconds)


class GreedyDriver:
    """Greedy policy of a model for single observations of `Navigation-v0`."""

    def __init__(self, model: Model, *, masked: bool) -> None:
        self._model, self._masked = model, masked

    def __call__(self, observation: Vector, mask: NDArray[np.bool_]) -> int:
        """Returns an action of `Navigation-v0`; masked algorithms respect the mask (18,)."""
        keywords = {"action_masks": mask} if self._masked else {}
        return int(self._model.predict(observation, deterministic=True, **keywords)[0])
