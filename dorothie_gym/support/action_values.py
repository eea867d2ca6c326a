"""Checks of the numbers in actions, with errors that name the field and show a short value."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.errors import short_repr


def as_array(name: str, value: object) -> NDArray[Any]:
    """Returns a value as a plain array.

    Raises:
        ValueError: NumPy cannot convert it to an array; the message names the field.
    """
    if type(value) is np.ndarray:
        return value
    if isinstance(value, np.ma.MaskedArray):
        raise ValueError(f"{name} is a masked array; it must be a plain one")
    try:
        return np.asarray(value)
    except Exception as error:  # of any type: NumPy calls methods of the value
        raise ValueError(f"{name} is {short_repr(value)}, which is no array ({type(error).__name__})") from None


def whole_number(name: str, value: object, low: int, high: int) -> int:
    """Returns a whole number in [low, high], given as an `int` or as an integer array of one element.

    Raises:
        ValueError: it is something else; the message names the field.
    """
    if isinstance(value, int | np.integer | np.ndarray) and not isinstance(value, bool):
        number = int(value) if isinstance(value, int | np.integer) else _only(as_array(name, value))
        if number is not None and low <= number <= high:
            return number
    raise ValueError(f"{name} is {short_repr(value)}; it must be a whole number in {low}..{high}")


def _only(array: NDArray[np.generic]) -> int | None:
    """Returns the only element of an integer array, or None."""
    return int(np.asarray(array).item()) if array.dtype.kind in "iu" and array.size == 1 else None


def whole_numbers(name: str, value: object, counts: NDArray[np.int64]) -> NDArray[np.int64]:
    """Returns whole numbers, each at least 0 and below its count; floats that are whole are taken.

    Args:
        name: name of the field.
        value: array (n,).
        counts: numbers of values (n,).

    Raises:
        ValueError: the shape, the type or a value is wrong; the message names the field.
    """
    array = as_array(name, value)
    if array.shape != counts.shape:
        raise ValueError(f"{name} has shape {array.shape}; it must be {counts.shape}")
    if array.dtype.kind not in "iubf":
        raise ValueError(f"{name} is {short_repr(value)}; it must hold whole numbers")
    if not np.all((array >= 0) & (array < counts)) or (
        array.dtype.kind == "f" and not np.all(array == np.floor(array))
    ):
        raise ValueError(
            f"{name} is {short_repr(value)}; its numbers must be whole, at least 0 and below {short_repr(counts)}"
        )
    return array.astype(np.int64)


def real_numbers(name: str, value: object, shape: Sequence[int], meaning: str) -> NDArray[np.float64]:
    """Returns finite numbers as float64 of a shape; `meaning` names them in messages.

    Raises:
        ValueError: the shape, the type or a value is wrong; the message names the field.
    """
    array = as_array(name, value)
    if array.dtype.kind in "iuf" and array.shape == tuple(shape):
        numbers = np.asarray(array, dtype=np.float64)
        if np.isfinite(numbers).all():
            return numbers
    raise ValueError(f"{name} is {short_repr(value)}; it must be {meaning}")
