"""Flat observation and action spaces for learners that take vectors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, SupportsFloat, TypeAlias

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from gymnasium.core import ActType, ObsType
from gymnasium.utils import RecordConstructorArgs
from numpy.typing import NDArray

from dorothie_gym.action_values import whole_numbers
from dorothie_gym.spaces import AnySpace, Observation, StepInfo
from dorothie_gym.spaces.limits import UNBOUNDED

Flat: TypeAlias = NDArray[np.int64]
FlatMask: TypeAlias = NDArray[np.bool_]

_WHOLE = ""
"""Name of the only field of a space other than `Dict`."""


class FlatActions:
    """Conversion of actions with discrete fields from and to a flat vector of choices.

    The entries follow the fields in the order of the space (alphabetical): one for a `Discrete`, one per element of a
    `MultiDiscrete`, one of two values per element of a `MultiBinary`. Texts are omitted.

    Attributes:
        sizes: numbers of values of the entries, by field.
        nvec: numbers of values of all entries (n,) int64.
    """

    def __init__(
        self, space: AnySpace, fields: Sequence[str] | None = None, rest: Mapping[str, object] | None = None
    ) -> None:
        """Analyses a space.

        Args:
            space: action space.
            fields: names of the fields to keep; None keeps all except texts.
            rest: values of the other fields; by default 0 (or the smallest value) and the empty text.

        Raises:
            ValueError: if a name in `fields` is unknown, or if a field is neither a text nor discrete.
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

    def action(self, values: Flat) -> object:
        """Returns the action of the space for a flat vector (n,)."""
        fields: dict[str, object] = dict(self._rest)
        begin = 0
        for name, sizes in self.sizes.items():
            fields[name] = _value(self._parts[name], values[begin : begin + len(sizes)])
            begin += len(sizes)
        return fields.get(_WHOLE, fields)

    def mask(self, mask: object) -> FlatMask:
        """Returns the permitted values of all entries, one bool per value (sum(nvec),), from `info["action_mask"]`."""
        masks = mask if isinstance(mask, Mapping) else {_WHOLE: mask}
        return np.concatenate([_mask(masks.get(name), sizes) for name, sizes in self.sizes.items()])


class FlatObservations:
    """Conversion of observations to flat vectors, fields in the order of the space; texts are omitted, ids are numbers.

    Attributes:
        low: finite lower bounds (n,) float32, -1e6 for unbounded fields.
        high: finite upper bounds (n,) float32.
    """

    def __init__(self, space: AnySpace) -> None:
        """Analyses a space; raises `ValueError` if a field holds neither numbers nor text."""
        self._numeric = {name: part for name, part in _parts(space).items() if not isinstance(part, spaces.Text)}
        bounds = [_bounds(name, part) for name, part in self._numeric.items()]
        self.low = np.concatenate([low for low, _ in bounds])
        self.high = np.concatenate([high for _, high in bounds])

    def vector(self, observation: Unflattened) -> NDArray[np.float32]:
        """Returns the flat vector of an observation (n,) float32."""
        fields = observation if isinstance(observation, dict) else {_WHOLE: observation}
        parts = [np.ravel(fields[name]) for name in self._numeric]
        row = np.concatenate(parts, dtype=np.float32, casting="unsafe")
        clipped: NDArray[np.float32] = np.clip(row, self.low, self.high)
        return clipped

    def vectors(self, stacked: Mapping[str, NDArray[Any]]) -> NDArray[np.float32]:
        """Returns the flat vectors of observations by field with a leading axis (m, ...), as (m, n) float32."""
        parts = [stacked[name].reshape(len(stacked[name]), -1) for name in self._numeric]
        rows = np.concatenate(parts, axis=1, dtype=np.float32, casting="unsafe")
        clipped: NDArray[np.float32] = np.clip(rows, self.low, self.high)
        return clipped


def _parts(space: AnySpace) -> dict[str, AnySpace]:
    return dict(space.spaces) if isinstance(space, spaces.Dict) else {_WHOLE: space}


def _sizes(name: str, part: AnySpace) -> Flat:
    if isinstance(part, spaces.Discrete):
        return np.array([part.n], dtype=np.int64)
    if isinstance(part, spaces.MultiDiscrete):
        return np.ravel(part.nvec).astype(np.int64)
    if isinstance(part, spaces.MultiBinary):
        return np.full(int(np.prod(part.shape)), 2, dtype=np.int64)
    raise ValueError(f"the action space's field {name!r} is {part}; only discrete fields and texts can be flattened")


def _rest(part: AnySpace) -> object:
    if isinstance(part, spaces.Text):
        return ""
    if isinstance(part, spaces.Discrete):
        return np.int64(0) if part.contains(np.int64(0)) else part.start
    return np.zeros(part.shape or (), dtype=part.dtype)


def _value(part: AnySpace, entries: Flat) -> object:
    if isinstance(part, spaces.Discrete):
        return np.int64(entries[0] + part.start)
    assert part.shape is not None
    whole = entries.reshape(part.shape)
    return (whole + part.start if isinstance(part, spaces.MultiDiscrete) else whole).astype(part.dtype)


def _mask(mask: object, sizes: Flat) -> FlatMask:
    """Returns the mask of one field, given as an array, a nested tuple of arrays, or None for no restriction."""
    if mask is None:
        return np.ones(int(sizes.sum()), dtype=np.bool_)
    if isinstance(mask, tuple):
        return np.concatenate([_mask(part, sizes[:0]) for part in mask])
    return np.asarray(mask).astype(np.bool_)


def _bounds(name: str, part: AnySpace) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
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
    return np.clip(low, -UNBOUNDED, UNBOUNDED).astype(np.float32), np.clip(high, -UNBOUNDED, UNBOUNDED).astype(
        np.float32
    )


AnyEnv: TypeAlias = gym.Env[Any, Any]
"""Environment whose spaces are not known statically."""

FlatObservation: TypeAlias = dict[str, NDArray[np.float32] | NDArray[np.int8]]
"""Observation of `FlattenObservation`, by field."""

Unflattened: TypeAlias = Observation | NDArray[np.generic]
"""Observation of the wrapped environment."""


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
        self._masked = isinstance(env.action_space, spaces.MultiDiscrete) and env.has_wrapper_attr("action_masks")
        found: dict[str, AnySpace] = {"observation": spaces.Box(self._flat.low, self._flat.high, dtype=np.float32)}
        if self._masked:
            assert isinstance(env.action_space, spaces.MultiDiscrete)
            found["action_mask"] = spaces.MultiBinary(int(env.action_space.nvec.sum()))
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


def flatten(env: AnyEnv, fields: Sequence[str] | None = None) -> FlattenObservation[NDArray[np.generic]]:
    """Flattens both spaces: `FlattenAction` with `fields`, then `FlattenObservation`.

    Continuous action spaces are flat already and are kept.
    """
    if isinstance(env.action_space, spaces.Box):
        return FlattenObservation(env)
    return FlattenObservation(FlattenAction(env, fields))
