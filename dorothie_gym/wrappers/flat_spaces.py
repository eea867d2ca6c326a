"""Flat spaces: fields in a row, as learners take them, and the way back."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from dorothie_gym.spaces.limits import REACH

Flat: TypeAlias = NDArray[np.int64]
Mask: TypeAlias = NDArray[np.bool_]

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

    def mask(self, mask: Any) -> Mask:
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


def _mask(mask: Any, sizes: Flat) -> Mask:
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
