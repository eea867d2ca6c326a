"""Exact comparison of observations, actions and infos."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np


def first_unequal(one: object, other: object, path: str = "") -> str | None:
    """Returns the path of the first part in which two nested values differ; None where they are equal to the bit.

    Mappings are compared by their keys, lists and tuples element by element, arrays and numbers by type, shape and
    bytes (so that NaN equals NaN), everything else by `==`.
    """
    if isinstance(one, Mapping) and isinstance(other, Mapping):
        for key in dict.fromkeys([*one, *other]):
            where = f"{path}.{key}" if path else str(key)
            if key not in one or key not in other:
                return where
            if (found := first_unequal(one[key], other[key], where)) is not None:
                return found
        return None
    if isinstance(one, np.ndarray | np.generic) or isinstance(other, np.ndarray | np.generic):
        left, right = np.asarray(one), np.asarray(other)
        same = left.dtype == right.dtype and left.shape == right.shape and left.tobytes() == right.tobytes()
        return None if same else path
    if isinstance(one, Sequence) and isinstance(other, Sequence) and not isinstance(one, str | bytes):
        if len(one) != len(other):
            return path
        parts = (first_unequal(a, b, f"{path}[{k}]") for k, (a, b) in enumerate(zip(one, other, strict=True)))
        return next((found for found in parts if found is not None), None)
    return None if one == other else path
