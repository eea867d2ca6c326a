"""The functions of `portable_math` for arrays, with numpy's names and broadcasting.

The module is imported as `pn`. Results are arrays of float64, and numbers for numbers. numpy's own functions choose
vector routines by the processor.
"""

from __future__ import annotations

from typing import Any, Final, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dorothie_gym.support import portable_math
from dorothie_gym.support.compilation import compiled

Array = NDArray[np.float64]
Numbers = NDArray[np.floating[Any]]

_SIN: Final = 0
_COS: Final = 1
_TAN: Final = 2
_ARCTAN2: Final = 3
_EXP: Final = 4
_LOG: Final = 5
_HYPOT: Final = 6


@overload
def sin(x: Numbers) -> Array: ...
@overload
def sin(x: float) -> float: ...
def sin(x: float | Numbers) -> float | Array:
    """Returns the sines of angles [rad]."""
    return _of_one(_SIN, x)


@overload
def cos(x: Numbers) -> Array: ...
@overload
def cos(x: float) -> float: ...
def cos(x: float | Numbers) -> float | Array:
    """Returns the cosines of angles [rad]."""
    return _of_one(_COS, x)


@overload
def tan(x: Numbers) -> Array: ...
@overload
def tan(x: float) -> float: ...
def tan(x: float | Numbers) -> float | Array:
    """Returns the tangents of angles [rad]."""
    return _of_one(_TAN, x)


@overload
def exp(x: Numbers) -> Array: ...
@overload
def exp(x: float) -> float: ...
def exp(x: float | Numbers) -> float | Array:
    """Returns e to powers."""
    return _of_one(_EXP, x)


@overload
def log(x: Numbers) -> Array: ...
@overload
def log(x: float) -> float: ...
def log(x: float | Numbers) -> float | Array:
    """Returns natural logarithms."""
    return _of_one(_LOG, x)


@overload
def arctan2(y: Numbers, x: float | Numbers) -> Array: ...
@overload
def arctan2(y: float, x: Numbers) -> Array: ...
@overload
def arctan2(y: float, x: float) -> float: ...
def arctan2(y: float | Numbers, x: float | Numbers) -> float | Array:
    """Returns the directions of vectors (x, y) in [-pi, pi] [rad]."""
    return _of_two(_ARCTAN2, y, x)


@overload
def hypot(x: Numbers, y: float | Numbers) -> Array: ...
@overload
def hypot(x: float, y: Numbers) -> Array: ...
@overload
def hypot(x: float, y: float) -> float: ...
def hypot(x: float | Numbers, y: float | Numbers) -> float | Array:
    """Returns the lengths of vectors (x, y)."""
    return _of_two(_HYPOT, x, y)


def dot(first: Array, second: Array) -> Array:
    """Returns the inner products (...) of vectors (..., k) and (..., k)."""
    return np.asarray((first * second).sum(axis=-1))


def matmul(first: Array, second: Array) -> Array:
    """Returns the product (n, m) of small matrices (n, k) and (k, m); BLAS chooses its routine by the processor."""
    return np.asarray((first[:, :, None] * second[None, :, :]).sum(axis=1))


def inverse(matrix: Array) -> Array:
    """Returns the inverse of a matrix (2, 2).

    Raises:
        numpy.linalg.LinAlgError: there is none.
    """
    (a, b), (c, d) = matrix.tolist()
    determinant = a * d - b * c
    if determinant == 0.0:
        raise np.linalg.LinAlgError("a singular matrix has no inverse")
    return np.asarray(np.array([[d, -b], [-c, a]], dtype=matrix.dtype) / determinant)


def _of_one(function: int, x: ArrayLike) -> float | Array:
    numbers = np.asarray(x, dtype=np.float64)
    flat = np.ascontiguousarray(numbers).reshape(-1)
    found = np.empty(len(flat))
    _compute(function, flat, flat, found)
    return found.reshape(numbers.shape) if numbers.ndim else float(found[0])


def _of_two(function: int, x: ArrayLike, y: ArrayLike) -> float | Array:
    first, second = np.broadcast_arrays(np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64))
    found = np.empty(first.size)
    _compute(function, np.ascontiguousarray(first).reshape(-1), np.ascontiguousarray(second).reshape(-1), found)
    return found.reshape(first.shape) if first.ndim else float(found[0])


@compiled
def _compute(function: int, x: Array, y: Array, found: Array) -> None:
    """Writes the values of a function at x (n,), or at x and y, to `found` (n,)."""
    for k in range(len(x)):
        if function == _SIN:
            found[k] = portable_math.sin(x[k])
        elif function == _COS:
            found[k] = portable_math.cos(x[k])
        elif function == _TAN:
            found[k] = portable_math.tan(x[k])
        elif function == _ARCTAN2:
            found[k] = portable_math.atan2(x[k], y[k])
        elif function == _EXP:
            found[k] = portable_math.exp(x[k])
        elif function == _LOG:
            found[k] = portable_math.log(x[k])
        else:
            found[k] = portable_math.hypot(x[k], y[k])
