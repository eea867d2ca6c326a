"""Wrappers with flat observation and action spaces, for learners that take vectors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal, SupportsFloat, TypeAlias, overload

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from gymnasium.core import ActType, ObsType
from gymnasium.utils import RecordConstructorArgs
from numpy.typing import NDArray

from dorothie_gym.session.spaces.flat import BoxObservations, Flat, FlatActions, FlatMask, FlatObservations, Unflattened
from dorothie_gym.support.action_values import whole_numbers

if TYPE_CHECKING:
    from dorothie_gym.session.spaces.actions import StepInfo
    from dorothie_gym.session.spaces.fields import AnySpace

AnyEnv: TypeAlias = gym.Env[Any, Any]
"""Environment whose spaces are not known statically."""

FlatObservation: TypeAlias = dict[str, NDArray[np.float32] | NDArray[np.int8]]
"""Observation of `FlattenObservation`, by field."""


class FlattenAction(gym.Wrapper[ObsType, Flat, ObsType, Any], RecordConstructorArgs):
    """Wrapper that converts an action space of discrete fields to one `MultiDiscrete`.

    The entries are those of `FlatActions`. Texts are empty: the environment generates the words.

    Args:
        env: the environment.
        fields: names of the fields to keep, in any order; None keeps all except texts. The other fields have the values
            of the `noop_action` of the environment if it exists, otherwise 0 (or the smallest value).

    Raises:
        ValueError: if a name in `fields` is unknown, or if a field is neither a text nor discrete.
    """

    def __init__(self, env: AnyEnv, fields: Sequence[str] | None = None) -> None:
        RecordConstructorArgs.__init__(self, fields=fields)
        gym.Wrapper.__init__(self, env)
        resting = env.get_wrapper_attr("noop_action") if env.has_wrapper_attr("noop_action") else {}
        self._flat = FlatActions(env.action_space, fields, resting)
        self.sizes: dict[str, Flat] = self._flat.sizes
        self.action_space = spaces.MultiDiscrete(self._flat.nvec)
        self._mask: object = {}

    def reset(self, *, seed: int | None = None, options: StepInfo | None = None) -> tuple[ObsType, StepInfo]:
        """Resets the environment and stores the mask of the first action."""
        observation, info = self.env.reset(seed=seed, options=options)
        self._mask = info.get("action_mask", {})
        return observation, info

    def step(self, action: Flat) -> tuple[ObsType, SupportsFloat, bool, bool, StepInfo]:
        """Steps with a flat action and stores the mask of the next one."""
        observation, reward, terminated, truncated, info = self.env.step(self.unflatten(action))
        self._mask = info.get("action_mask", {})
        return observation, reward, terminated, truncated, info

    def unflatten(self, action: Flat) -> Any:
        """Returns the action of the environment for a flat one; raises `ValueError` if it is not in the space."""
        return self._flat.action(whole_numbers("action", action, self._flat.nvec))

    def action_masks(self) -> FlatMask:
        """Returns the permitted values of all entries, one bool per value (sum(nvec),).

        The interface of sb3-contrib. All values of fields without a mask are permitted.
        """
        return self._flat.mask(self._mask)


class FlattenObservation(gym.Wrapper[FlatObservation, ActType, Unflattened, ActType], RecordConstructorArgs):
    """Wrapper that converts an observation space to a `Dict` of two vectors.

    - `observation`: `Box` float32, all numeric fields in the order of the space; texts are omitted, ids are numbers.
      Bounds are finite (1e6 for unbounded fields). Values are not scaled; use running statistics for learning
      (stable-baselines3: `VecNormalize(env, norm_obs_keys=["observation"])`).
    - `action_mask`: `MultiBinary`, 1 for permitted values, as in `FlattenAction.action_masks`; only present if the
      environment is wrapped in `FlattenAction`.
    """

    def __init__(self, env: AnyEnv) -> None:
        RecordConstructorArgs.__init__(self)
        gym.Wrapper.__init__(self, env)
        self._flat = FlatObservations(env.observation_space)
        self._masked, actions = False, env.action_space
        found: dict[str, AnySpace] = {"observation": spaces.Box(self._flat.low, self._flat.high, dtype=np.float32)}
        if isinstance(actions, spaces.MultiDiscrete) and env.has_wrapper_attr("action_masks"):
            self._masked = True
            found["action_mask"] = spaces.MultiBinary(int(actions.nvec.sum()))
        self.observation_space: AnySpace = spaces.Dict(found)

    def reset(self, *, seed: int | None = None, options: StepInfo | None = None) -> tuple[FlatObservation, StepInfo]:
        """Resets the environment."""
        observation, info = self.env.reset(seed=seed, options=options)
        return self.flatten(observation), info

    def step(self, action: ActType) -> tuple[FlatObservation, SupportsFloat, bool, bool, StepInfo]:
        """Steps the environment."""
        observation, reward, terminated, truncated, info = self.env.step(action)
        return self.flatten(observation), reward, terminated, truncated, info

    def flatten(self, observation: Unflattened) -> FlatObservation:
        """Returns the flat observation for an observation of the environment."""
        flat: FlatObservation = {"observation": self._flat.vector(observation)}
        if self._masked:
            flat["action_mask"] = self.env.get_wrapper_attr("action_masks")().astype(np.int8)
        return flat


class BoxObservation(gym.Wrapper[NDArray[np.float32], ActType, Unflattened, ActType], RecordConstructorArgs):
    """Wrapper that converts an observation space to one `Box` in [-1, 1], see `BoxObservations`.

    A library that masks actions finds the mask in `action_masks()` of `FlattenAction` or `MacroActions`.
    """

    def __init__(self, env: AnyEnv) -> None:
        RecordConstructorArgs.__init__(self)
        gym.Wrapper.__init__(self, env)
        self._flat = BoxObservations(env.observation_space)
        self.observation_space: AnySpace = spaces.Box(-1.0, 1.0, (self._flat.size,), dtype=np.float32)

    def reset(
        self, *, seed: int | None = None, options: StepInfo | None = None
    ) -> tuple[NDArray[np.float32], StepInfo]:
        """Resets the environment."""
        observation, info = self.env.reset(seed=seed, options=options)
        return self._flat.vector(observation), info

    def step(self, action: ActType) -> tuple[NDArray[np.float32], SupportsFloat, bool, bool, StepInfo]:
        """Steps the environment."""
        observation, reward, terminated, truncated, info = self.env.step(action)
        return self._flat.vector(observation), reward, terminated, truncated, info

    def action_masks(self) -> FlatMask:
        """Returns the permitted values of the action, the interface of sb3-contrib."""
        mask: FlatMask = self.env.get_wrapper_attr("action_masks")()
        return mask


@overload
def flatten(
    env: AnyEnv, fields: Sequence[str] | None = None, *, box: Literal[False] = False
) -> FlattenObservation[NDArray[np.generic]]: ...
@overload
def flatten(
    env: AnyEnv, fields: Sequence[str] | None = None, *, box: Literal[True]
) -> BoxObservation[NDArray[np.generic]]: ...
def flatten(
    env: AnyEnv, fields: Sequence[str] | None = None, *, box: bool = False
) -> FlattenObservation[NDArray[np.generic]] | BoxObservation[NDArray[np.generic]]:
    """Flattens both spaces: `FlattenAction` with `fields`, then `FlattenObservation`, or `BoxObservation` with `box`.

    Action spaces that are flat already (`Box`, the `Discrete` of `MacroActions`) are kept.

    Args:
        env: the environment.
        fields: names of the action fields to keep; None keeps all except texts.
        box: whether observations become one normalised `Box`; the mask is then in `action_masks()` only.
    """
    masked = isinstance(env.action_space, spaces.Discrete) and env.has_wrapper_attr("action_masks")
    flat = env if masked or isinstance(env.action_space, spaces.Box) else FlattenAction(env, fields)
    return BoxObservation(flat) if box else FlattenObservation(flat)
