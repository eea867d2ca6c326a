"""Compilation of batches of navigation environments ahead of their use, see `session.warm_up`."""

from __future__ import annotations

import numpy as np

from dorothie_gym.envs.navigation.compiled_decision import act_share, guide_share
from dorothie_gym.envs.navigation_vector_env import NavigationVectorEnv
from dorothie_gym.session.warm_up import TOWN, Progress, reporting
from dorothie_gym.support.compilation.dispatcher import CompiledFunction


def is_warm() -> bool:
    """Returns whether batches need no compilation."""
    halves = act_share, guide_share
    return all(not isinstance(half, CompiledFunction) or half.is_cached() for half in halves)


def warm_up(progress: Progress | None = None) -> None:
    """Compiles the functions of batches that are not yet in the cache; `progress` as in `engine.warm_up.warm_up`."""
    with reporting(progress):
        env = NavigationVectorEnv(1, TOWN, threads=1)
        env.reset(seed=0)
        env.step(np.zeros(1, dtype=np.int64))
        env.close()
