"""Flat observation and action spaces for learners that take vectors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from gymnasium.utils import RecordConstructorArgs
from numpy.typing import NDArray

from dorothie_gym.spaces.limits import REACH

Flat: TypeAlias = NDArray[np.int64]
FlatMask: TypeAlias = NDArray[np.bool_]

_WHOLE = ""
"""Name of the only field of a space that is no `Dict`."""


class FlatActions:
    """Actions of discrete fields as entries in a row, each from 0 on.

    The entries are those of the fields in the space's order (alphabetical): one of a `Discrete`, one for each element
    of a `MultiDiscrete`, one of two values for each element of a `MultiBinary`. Texts are left out.

    Attributes:
        sizes: of the entries, by field.
        nvec: of all entries (n,).
    """

    def __init__(
        self, space: spaces.Space[Any], fields: Sequence[str] | None = None, rest: Mapping[str, Any] | None = None
    ) -> None:
        """Looks at a space.

        Args:
            space: of the actions.
            fields: those to keep; None keeps all but texts.
            rest: what the others are; where it does not say, 0 (the least value where 0 is none) or an empty text.

        Raises:
            ValueError: a name in `fields` is no field, or a field is neither a text nor discrete.
        """
        parts = _parts(space)
        unknown = [name for name in fields or () if name not in parts or isinstance(parts[name], spaces.Text)]
        if unknown:
            known = [name for name, part in parts.items() if not isinstance(part, spaces.Text)]
            raise ValueError(f"fields: {unknown[0]!r} is none of {', '.join(known)}")
        chosen = [
            name
            for name, part in parts.items()
            if (not isinstance(part, spaces.Text) if fields is None else name in fields)
        ]
        self.sizes: dict[str, Flat] = {name: _sizes(name, parts[name]) for name in chosen}
        if not self.sizes:
            raise ValueError("fields: none are left; keep at least one")
        self.nvec: Flat = np.concatenate(list(self.sizes.values()))
        self._parts = parts
        given = rest or {}
        self._rest = {name: given.get(name, _rest(part)) for name, part in parts.items() if name not in self.sizes}

    def action(self, values: Flat) -> Any:
        """The action of the space for entries (n,)."""
        fields: dict[str, Any] = dict(self._rest)
        begin = 0
        for name, sizes in self.sizes.items():
            fields[name] = _value(self._parts[name], values[begin : begin + len(sizes)])
            begin += len(sizes)
        return fields[_WHOLE] if _WHOLE in fields else fields

    def mask(self, mask: Any) -> FlatMask:
        """Which values the entries may take, one bool for each in a row, from `info["action_mask"]`."""
        masks = mask if isinstance(mask, Mapping) else {_WHOLE: mask}
        return np.concatenate([_mask(masks.get(name), sizes) for name, sizes in self.sizes.items()])


class FlatObservations:
    """Observations as numbers in a row, fields in the space's order; texts are dropped, ids stay numbers.

    Attributes:
        low: lower bounds (n,), finite (-1e6 where there is no other).
        high: upper bounds (n,).
    """

    def __init__(self, space: spaces.Space[Any]) -> None:
        """Looks at a space; raises `ValueError` where a field holds neither numbers nor text."""
        self._numeric = {name: part for name, part in _parts(space).items() if not isinstance(part, spaces.Text)}
        bounds = [_bounds(name, part) for name, part in self._numeric.items()]
        self.low = np.concatenate([low for low, _ in bounds])
        self.high = np.concatenate([high for _, high in bounds])

    def vector(self, observation: Any) -> NDArray[np.float32]:
        """The numbers of an observation (n,)."""
        fields = {_WHOLE: observation} if _WHOLE in self._numeric else observation
        parts = [np.ravel(fields[name]) for name in self._numeric]
        row = np.concatenate(parts, dtype=np.float32, casting="unsafe")
        clipped: NDArray[np.float32] = np.clip(row, self.low, self.high)
        return clipped


def _parts(space: spaces.Space[Any]) -> dict[str, spaces.Space[Any]]:
    return dict(space.spaces) if isinstance(space, spaces.Dict) else {_WHOLE: space}


def _sizes(name: str, part: spaces.Space[Any]) -> Flat:
    if isinstance(part, spaces.Discrete):
        return np.array([part.n], dtype=np.int64)
    if isinstance(part, spaces.MultiDiscrete):
        return np.ravel(part.nvec).astype(np.int64)
    if isinstance(part, spaces.MultiBinary):
        return np.full(int(np.prod(part.shape)), 2, dtype=np.int64)
    raise ValueError(f"the action space's field {name!r} is {part}; only discrete fields and texts can be flattened")


def _rest(part: spaces.Space[Any]) -> Any:
    if isinstance(part, spaces.Text):
        return ""
    if isinstance(part, spaces.Discrete):
        return np.int64(0) if part.contains(np.int64(0)) else part.start
    return np.zeros(part.shape or (), dtype=part.dtype)


def _value(part: spaces.Space[Any], entries: Flat) -> Any:
    if isinstance(part, spaces.Discrete):
        return np.int64(entries[0] + part.start)
    assert part.shape is not None
    whole = entries.reshape(part.shape)
    return (whole + part.start if isinstance(part, spaces.MultiDiscrete) else whole).astype(part.dtype)


def _mask(mask: Any, sizes: Flat) -> FlatMask:
    """Mask of one field: an array for one entry, a (nested) tuple of arrays for several, None for no mask."""
    if mask is None:
        return np.ones(int(sizes.sum()), dtype=np.bool_)
    if isinstance(mask, tuple):
        return np.concatenate([_mask(part, sizes[:0]) for part in mask])
    return np.asarray(mask).astype(np.bool_)


def _bounds(name: str, part: spaces.Space[Any]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    if isinstance(part, spaces.Box):
        low, high = np.ravel(part.low), np.ravel(part.high)
    elif isinstance(part, spaces.Discrete):
        low, high = np.array([part.start]), np.array([part.start + part.n - 1])
    elif isinstance(part, spaces.MultiDiscrete):
        low = np.ravel(part.start)
        high = low + np.ravel(part.nvec) - 1
    elif isinstance(part, spaces.MultiBinary):
        count = int(np.prod(part.shape))
        low, high = np.zeros(count), np.ones(count)
    else:
        raise ValueError(f"the observation space's field {name!r} is {part}, which holds no numbers")
    return np.clip(low, -REACH, REACH).astype(np.float32), np.clip(high, -REACH, REACH).astype(np.float32)


StepInfo: TypeAlias = dict[str, Any]


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

    def reset(self, *, seed: int | None = None, options: StepInfo | None = None) -> tuple[Any, StepInfo]:
        """Resets the environment and notes the mask of the first action."""
        observation, info = self.env.reset(seed=seed, options=options)
        self._mask = info.get("action_mask", {})
        return observation, info

    def step(self, action: Flat) -> tuple[Any, Any, bool, bool, StepInfo]:
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

    def action_masks(self) -> FlatMask:
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

    def reset(
        self, *, seed: int | None = None, options: StepInfo | None = None
    ) -> tuple[dict[str, NDArray[Any]], StepInfo]:
        """Resets the environment."""
        observation, info = self.env.reset(seed=seed, options=options)
        return self.flatten(observation), info

    def step(self, action: Any) -> tuple[dict[str, NDArray[Any]], Any, bool, bool, StepInfo]:
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
