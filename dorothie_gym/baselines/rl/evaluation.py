"""Evaluation of models over seeded episodes, by greedy play."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, Final, TypeAlias

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from numpy.typing import NDArray

from dorothie_gym.baselines.rl.environments import EnvFactory, each_town, has_batch, make_batch, masks_of
from dorothie_gym.evaluation.analysis.intervals import wilson_interval
from dorothie_gym.policies.navigation.observation_fields import Vector

if TYPE_CHECKING:
    from dorothie_gym.baselines.rl.checkpoint import Model
    from dorothie_gym.baselines.rl.settings import TrainingSettings
    from dorothie_gym.baselines.rl.vector_env import MakeEnv

FIRST_SEED: Final = 1_000_000
"""Seed of the first episode of an evaluation; training uses smaller seeds."""

PARALLEL_EPISODES: Final = 8
"""Number of episodes that single environments play in parallel: networks are faster on batches."""

BATCHED_EPISODES: Final = 128
"""Maximum number of episodes that a batch plays in parallel."""


Action: TypeAlias = Any
"""Action of an environment: a number or a vector."""

Act: TypeAlias = Callable[[Vector, NDArray[np.bool_] | None], Sequence[Action]]
"""Function from observations (n, ...) and masks (n, m), if environments have them, to actions."""

MakeBatch: TypeAlias = Callable[[int], VectorEnv[Any, Any, Any]]
"""Function from a number of environments to a batch of them."""


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


@dataclass(frozen=True)
class Episodes:
    """Outcomes of episodes.

    Attributes:
        successes: whether each succeeded (episodes,).
        rewards: sum of its rewards (episodes,).
        lengths: its number of steps (episodes,).
    """

    successes: NDArray[np.bool_]
    rewards: NDArray[np.float64]
    lengths: NDArray[np.int64]

    @classmethod
    def of(cls, count: int) -> Episodes:
        """Returns episodes without outcomes."""
        return cls(np.zeros(count, dtype=np.bool_), np.zeros(count), np.zeros(count, dtype=np.int64))

    @classmethod
    def joined(cls, parts: Sequence[Episodes]) -> Episodes:
        """Returns the episodes of several evaluations, concatenated."""
        return cls(
            np.concatenate([part.successes for part in parts]),
            np.concatenate([part.rewards for part in parts]),
            np.concatenate([part.lengths for part in parts]),
        )

    @property
    def statistics(self) -> EpisodeStatistics:
        """Means over the episodes."""
        low, high = wilson_interval(int(self.successes.sum()), len(self.successes))
        return EpisodeStatistics(
            success=float(self.successes.mean()),
            low=low,
            high=high,
            reward=float(self.rewards.mean()),
            length=float(self.lengths.mean()),
            episodes=len(self.successes),
        )


def evaluate_settings(settings: TrainingSettings, act: Act, episodes: int, seed: int = FIRST_SEED) -> EpisodeStatistics:
    """Plays episodes of the environment of a training, with consecutive seeds; with several towns, this many in each.

    Args:
        settings: settings of the training.
        act: policy.
        episodes: number of episodes.
        seed: seed of the first episode.
    """
    parts = []
    for arguments in each_town(settings.env_settings):
        if has_batch(settings.env):
            make_vector = partial(make_batch, settings.env, arguments, mode=AutoresetMode.DISABLED)
            parts.append(play_batch(make_vector, act, episodes, seed))
        else:
            parts.append(play_singles(EnvFactory(settings.env, arguments), act, episodes, seed))
    return Episodes.joined(parts).statistics


def evaluate_policy(make: MakeEnv, act: Act, episodes: int, seed: int = FIRST_SEED) -> EpisodeStatistics:
    """Plays episodes with consecutive seeds.

    Args:
        make: makes an environment.
        act: policy.
        episodes: number of episodes.
        seed: seed of the first episode.
    """
    return play_singles(make, act, episodes, seed).statistics


def play_singles(make: MakeEnv, act: Act, episodes: int, seed: int) -> Episodes:
    """Plays the episodes of `evaluate_policy` in single environments."""
    envs = [make() for _ in range(min(PARALLEL_EPISODES, episodes))]
    outcomes = Episodes.of(episodes)
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
            outcomes.rewards[episode] += float(reward)
            outcomes.lengths[episode] += 1
            if terminated or truncated:
                outcomes.successes[episode] = bool(info.get("is_success", False))
                del playing[k]
                if following < episodes:
                    playing[k] = following
                    observations[k] = envs[k].reset(seed=seed + following)[0]
                    following += 1
    for env in envs:
        env.close()
    return outcomes


def play_batch(make: MakeBatch, act: Act, episodes: int, seed: int) -> Episodes:
    """Plays the episodes of `evaluate_policy` in a batch.

    Args:
        make: makes a batch of a number of environments in the autoreset mode `DISABLED`.
        act: policy.
        episodes: number of episodes.
        seed: seed of the first episode.
    """
    envs = make(min(BATCHED_EPISODES, episodes))
    outcomes = Episodes.of(episodes)
    playing = np.arange(envs.num_envs)  # episode of each environment; those after the last one do not count
    seeds: Any = (seed + playing).tolist()  # one for each environment, which gymnasium's annotation leaves out
    observations, _ = envs.reset(seed=seeds)
    while (counting := playing < episodes).any():
        masks = envs.action_masks() if hasattr(envs, "action_masks") else None
        observations, rewards, terminated, truncated, infos = envs.step(np.asarray(act(observations, masks)))
        outcomes.rewards[playing[counting]] += rewards[counting]
        outcomes.lengths[playing[counting]] += 1
        over = terminated | truncated
        if over.any():
            ended = over & counting
            outcomes.successes[playing[ended]] = infos["is_success"][ended]
            playing[over] = playing.max() + 1 + np.arange(over.sum())
            seeds = (seed + playing).tolist()
            observations, _ = envs.reset(seed=seeds, options={"reset_mask": over})
    envs.close()
    return outcomes


def greedy_policy(model: Model, *, masked: bool) -> Act:
    """Returns the greedy policy of a model; `masked` models respect the masks."""

    def act(observations: Vector, masks: NDArray[np.bool_] | None) -> Sequence[Action]:
        keywords = {"action_masks": masks} if masked and masks is not None else {}
        actions: Sequence[Action] = model.predict(observations, deterministic=True, **keywords)[0]
        return actions

    return act
