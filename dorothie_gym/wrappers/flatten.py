"""Flat spaces for learners that take vectors: stable-baselines3, sb3-contrib and their like."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeAlias

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from gymnasium.utils import RecordConstructorArgs
from numpy.typing import NDArray

from dorothie_gym.wrappers.flat_spaces import Flat, FlatActions, FlatObservations, Mask

Info: TypeAlias = dict[str, Any]


class FlattenAction(gym.Wrapper[Any, Flat, Any, Any], RecordConstructorArgs):
    """Turns an action space of discrete fields into one `MultiDiscrete`.

    The entries are those of `FlatActions`. Texts are left out and stay empty: the environment words what is said.

    Args:
        env: the environment.
        fields: those to keep, in any order; None keeps all but texts. The others are as in the environment's
            `noop_action`, if it has one, otherwise 0 (the least value where 0 is none).

    Raises:
        ValueError: a name in `fields` is no field, or a field is neither a text nor discrete.
    """

    def __init__(self, env: gym.Env[Any, Any], fields: Sequence[str] | None = None) -> None:
        RecordConstructorArgs.__init__(self, fields=fields)
        gym.Wrapper.__init__(self, env)
        resting = env.get_wrapper_attr("noop_action") if env.has_wrapper_attr("noop_action") else {}
        self._flat = FlatActions(env.action_space, fields, resting)
        self.sizes: dict[str, Flat] = self._flat.sizes
        self.action_space = spaces.MultiDiscrete(self._flat.nvec)
        self._mask: Any = {}

    def reset(self, *, seed: int | None = None, options: Info | None = None) -> tuple[Any, Info]:
        """Resets the environment and notes the mask of the first action."""
        observation, info = self.env.reset(seed=seed, options=options)
        self._mask = info.get("action_mask", {})
        return observation, info

    def step(self, action: Flat) -> tuple[Any, Any, bool, bool, Info]:
        """Takes a flat action, and notes the mask of the next."""
        observation, reward, terminated, truncated, info = self.env.step(self.unflatten(action))
        self._mask = info.get("action_mask", {})
        return observation, reward, terminated, truncated, info

    def unflatten(self, action: Flat) -> Any:
        """The environment's action for a flat one."""
        values = np.asarray(action, dtype=np.int64)
        if values.shape != self.action_space.shape:
            raise ValueError(f"the action has shape {values.shape}; it must be {self.action_space.shape}")
        return self._flat.action(values)

    def action_masks(self) -> Mask:
        """Which values the entries may take now: one bool for each value of each entry, in a row.

        sb3-contrib's algorithms ask for it. Fields without a mask may take every value.
        """
        return self._flat.mask(self._mask)


class FlattenObservation(gym.Wrapper[dict[str, NDArray[Any]], Any, Any, Any], RecordConstructorArgs):
    """Turns an observation space into a `Dict` of two vectors.

    - `observation`: `Box` float32, the numbers of all fields in the space's order; texts are dropped, ids stay
      numbers. Bounds are finite (1e6 where there is no other). Quantities are not scaled: learners do better with
      running averages (stable-baselines3: `VecNormalize(env, norm_obs_keys=["observation"])`).
    - `action_mask`: `MultiBinary`, 1 for what the actions may be now, as in `FlattenAction.action_masks`; left out
      where the environment has no `FlattenAction` around it.
    """

    def __init__(self, env: gym.Env[Any, Any]) -> None:
        RecordConstructorArgs.__init__(self)
        gym.Wrapper.__init__(self, env)
        self._flat = FlatObservations(env.observation_space)
        self._masked = isinstance(env.action_space, spaces.MultiDiscrete) and env.has_wrapper_attr("action_masks")
        found: dict[str, spaces.Space[Any]] = {
            "observation": spaces.Box(self._flat.low, self._flat.high, dtype=np.float32)
        }
        if self._masked:
            assert isinstance(env.action_space, spaces.MultiDiscrete)
            found["action_mask"] = spaces.MultiBinary(int(env.action_space.nvec.sum()))
        self.observation_space: spaces.Space[Any] = spaces.Dict(found)

    def reset(self, *, seed: int | None = None, options: Info | None = None) -> tuple[dict[str, NDArray[Any]], Info]:
        """Resets the environment."""
        observation, info = self.env.reset(seed=seed, options=options)
        return self.flatten(observation), info

    def step(self, action: Any) -> tuple[dict[str, NDArray[Any]], Any, bool, bool, Info]:
        """Steps the environment."""
        observation, reward, terminated, truncated, info = self.env.step(action)
        return self.flatten(observation), reward, terminated, truncated, info

    def flatten(self, observation: Any) -> dict[str, NDArray[Any]]:
        """The flat observation for one of the environment's."""
        flat: dict[str, NDArray[Any]] = {"observation": self._flat.vector(observation)}
        if self._masked:
            flat["action_mask"] = self.env.get_wrapper_attr("action_masks")().astype(np.int8)
        return flat


def flatten(env: gym.Env[Any, Any], fields: Sequence[str] | None = None) -> FlattenObservation:
    """Makes both spaces flat: `FlattenAction` with these `fields`, then `FlattenObservation`.

    Continuous actions stay as they are: they are flat.
    """
    if isinstance(env.action_space, spaces.Box):
        return FlattenObservation(env)
    return FlattenObservation(FlattenAction(env, fields))
