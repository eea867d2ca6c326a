"""Conversion of actions and observations of dict spaces from and to flat vectors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final, TypeAlias

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from dorothie_gym.session.spaces.fields import UNBOUNDED, AnySpace
from dorothie_gym.session.spaces.observations import Observation

Flat: TypeAlias = NDArray[np.int64]
FlatMask: TypeAlias = NDArray[np.bool_]

Unflattened: TypeAlias = Observation | NDArray[np.generic]
"""Observation of an environment, before it is flattened."""

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
        fields = self.fields(values)
        return fields.get(_WHOLE, fields)

    def fields(self, values: Flat) -> dict[str, object]:
        """Returns the fields of the action of a `Dict` space for a flat vector (n,)."""
        fields: dict[str, object] = dict(self._rest)
        begin = 0
        for name, sizes in self.sizes.items():
            fields[name] = _value(self._parts[name], values[begin : begin + len(sizes)])
            begin += len(sizes)
        return fields

    def vector(self, action: Mapping[str, Any]) -> Flat:
        """Returns the flat vector (n,) of an action with fields, which `action` converts back."""
        parts = [np.ravel(action[name]) - _lowest(self._parts[name]) for name in self.sizes]
        return np.concatenate(parts).astype(np.int64)

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


ONE_HOT: Final = 64
"""Most values of a `Discrete` field that `BoxObservations` encodes with one number per value."""

SOFT: Final = 30.0
"""Value of an unbounded field that `BoxObservations` maps to 0.5, in the unit of the field."""


class BoxObservations:
    """Conversion of observations to one vector in [-1, 1], fields in the order of the space; texts are omitted.

    A field with bounds is scaled by them. An unbounded one becomes x / (abs(x) + 30). A `Discrete` of up to 64 values
    is one-hot, and larger ids are scaled.

    Attributes:
        size: length of the vector.
    """

    def __init__(self, space: AnySpace) -> None:
        """Analyses a space; raises `ValueError` if a field holds neither numbers nor text."""
        self._parts = {name: part for name, part in _parts(space).items() if not isinstance(part, spaces.Text)}
        self._bounds = {name: _bounds(name, part) for name, part in self._parts.items()}
        self.size = sum(_one_hot_size(part) or len(self._bounds[name][0]) for name, part in self._parts.items())

    def vector(self, observation: Unflattened) -> NDArray[np.float32]:
        """Returns the vector of an observation (n,) float32 in [-1, 1]."""
        fields = observation if isinstance(observation, dict) else {_WHOLE: observation}
        parts = [self._scaled(name, part, fields[name]) for name, part in self._parts.items()]
        return np.concatenate(parts, dtype=np.float32, casting="unsafe")

    def _scaled(self, name: str, part: AnySpace, value: object) -> NDArray[np.float64]:
        values = np.ravel(np.asarray(value, dtype=np.float64))
        if isinstance(part, spaces.Discrete) and _one_hot_size(part):
            hot = np.zeros(int(part.n))
            hot[int(values[0]) - int(part.start)] = 1.0
            return hot
        low, high = (bound.astype(np.float64) for bound in self._bounds[name])
        bounded = (low > -UNBOUNDED) & (high < UNBOUNDED)
        span = np.where(bounded & (high > low), high - low, 1.0)
        inside = 2.0 * (np.clip(values, low, high) - np.where(bounded, low, 0.0)) / span - 1.0
        scaled: NDArray[np.float64] = np.where(bounded, inside, values / (np.abs(values) + SOFT))
        return scaled


def _one_hot_size(part: AnySpace) -> int:
    """Returns the number of values of a field that is one-hot; 0 for other fields."""
    return int(part.n) if isinstance(part, spaces.Discrete) and part.n <= ONE_HOT else 0


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
    whole = entries.reshape(part.shape or ())
    return (whole + part.start if isinstance(part, spaces.MultiDiscrete) else whole).astype(part.dtype)


def _lowest(part: AnySpace) -> object:
    """Returns the smallest values of a discrete field, which are the choice 0."""
    if isinstance(part, spaces.MultiDiscrete):
        return np.ravel(part.start)
    return part.start if isinstance(part, spaces.Discrete) else 0


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
