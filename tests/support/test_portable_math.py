"""The portable functions agree with the C library, with each other in Python and compiled code, and at the edges."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation import compiled

RNG = np.random.default_rng(0)
ANGLES = np.concatenate((RNG.uniform(-7.0, 7.0, 2000), RNG.uniform(-1e6, 1e6, 2000), RNG.normal(0.0, 1e-3, 500)))
SHARES = RNG.uniform(-1.0, 1.0, 2000)
NUMBERS = np.concatenate((RNG.normal(0.0, 1.0, 2000), RNG.normal(0.0, 50.0, 2000)))
POSITIVE = np.concatenate((np.exp(RNG.uniform(-700.0, 700.0, 2000)), RNG.uniform(0.3, 3.0, 2000)))

ONE: dict[str, tuple[NDArray[np.float64], float]] = {
    "sin": (ANGLES, 2), "cos": (ANGLES, 2), "tan": (ANGLES, 4), "atan": (NUMBERS, 3), "asin": (SHARES, 4),
    "acos": (SHARES, 4), "exp": (NUMBERS, 2), "expm1": (NUMBERS, 5), "log": (POSITIVE, 2),
    "log1p": (np.abs(NUMBERS), 4), "log10": (POSITIVE, 4),
}  # fmt: skip
"""Functions of one number: arguments, and the largest difference from the C library [units in the last place]."""


@pytest.mark.parametrize("name", ONE)
def test_functions_agree_with_the_c_library(name: str) -> None:
    numbers, tolerance = ONE[name]
    ours: Callable[[float], float] = getattr(pm, name)
    for x in numbers.tolist():
        expected = getattr(math, name)(x)
        assert abs(ours(x) - expected) <= tolerance * math.ulp(expected), x


def test_directions_and_lengths_agree_with_the_c_library() -> None:
    for y, x in RNG.normal(0.0, 10.0, (4000, 2)).tolist():
        assert abs(pm.atan2(y, x) - math.atan2(y, x)) <= 3 * math.ulp(math.atan2(y, x)), (y, x)
        assert abs(pm.hypot(x, y) - math.hypot(x, y)) <= 2 * math.ulp(math.hypot(x, y)), (y, x)
        assert pm.dist((x, y, 1.0), (0.0, 0.0, 1.0)) == pm.hypot(x, y)


@compiled
def _together(x: float) -> tuple[float, float]:
    return pm.sincos(x)


def test_sine_and_cosine_together_equal_those_alone() -> None:
    for x in (*ANGLES.tolist(), 0.0, -0.0, 3e7, -3e7, math.inf, -math.inf, math.nan):
        alone = (pm.sin(x), pm.cos(x))
        assert repr(pm.sincos(x)) == repr(alone), x
        assert repr(tuple(float(each) for each in _together(x))) == repr(alone), x


def test_signed_zeros_and_infinities_have_the_directions_of_the_standard() -> None:
    edges = (0.0, -0.0, 1.0, -1.0, math.inf, -math.inf, math.nan)
    for y in edges:
        for x in edges:
            assert repr(pm.atan2(y, x)) == repr(math.atan2(y, x)), (y, x)


def test_arguments_outside_of_the_domain_give_nan_or_infinity() -> None:
    nan = [pm.sin(math.inf), pm.cos(math.nan), pm.asin(1.1), pm.acos(-1.1), pm.log(-1.0), pm.exp(math.nan)]
    assert all(math.isnan(value) for value in nan)
    assert (pm.log(0.0), pm.log(math.inf), pm.exp(1000.0), pm.exp(-1000.0)) == (-math.inf, math.inf, math.inf, 0.0)
    assert (pm.sin(0.0), pm.cos(0.0), pm.exp(0.0), pm.log(1.0), pm.expm1(0.0), pm.log1p(0.0)) == (0, 1, 1, 0, 0, 0)


def test_large_angles_stay_on_the_circle() -> None:
    for angle in (1e7, -3.3e12, 1e300):
        assert pm.sin(angle) ** 2 + pm.cos(angle) ** 2 == pytest.approx(1.0)
    assert pm.sin(1e7) == pytest.approx(math.sin(1e7), abs=1e-8)


def test_powers_are_those_of_positive_bases() -> None:
    for base, exponent in zip(POSITIVE[2000:].tolist(), RNG.uniform(-5.0, 5.0, 2000).tolist(), strict=True):
        assert pm.power(base, exponent) == pytest.approx(base**exponent, rel=1e-14)
    assert (pm.power(0.0, 2.0), pm.power(0.0, 0.0), pm.power(1.0, 3.7), pm.power(5.0, 0.0)) == (0.0, 1.0, 1.0, 1.0)


@compiled
def _compute_all(x: NDArray[np.float64], found: NDArray[np.float64]) -> None:
    for k in range(len(x)):
        found[k, 0], found[k, 1], found[k, 2] = pm.sin(x[k]), pm.cos(x[k]), pm.tan(x[k])
        found[k, 3], found[k, 4], found[k, 5] = pm.atan2(x[k], 0.7), pm.exp(x[k]), pm.expm1(x[k])
        found[k, 6], found[k, 7], found[k, 8] = pm.log(abs(x[k])), pm.log1p(abs(x[k])), pm.hypot(x[k], 1.5)
        found[k, 9], found[k, 10] = pm.asin(x[k] % 1.0), pm.power(abs(x[k]), 0.3)


def test_compiled_code_and_python_have_equal_bits() -> None:
    numbers = np.concatenate((NUMBERS, ANGLES[2000:4000], [0.0, -0.0, np.inf, np.nan, 1e9]))
    found = np.empty((len(numbers), 11))
    _compute_all(numbers, found)
    for x, row in zip(numbers.tolist(), found, strict=True):
        expected = [
            pm.sin(x), pm.cos(x), pm.tan(x), pm.atan2(x, 0.7), pm.exp(x), pm.expm1(x), pm.log(abs(x)),
            pm.log1p(abs(x)), pm.hypot(x, 1.5), pm.asin(x % 1.0), pm.power(abs(x), 0.3),
        ]  # fmt: skip
        assert np.array_equal(row, expected, equal_nan=True), x


# --- Arrays -----------------------------------------------------------------------------------------------------------


def test_arrays_have_the_values_of_numbers_and_their_shape() -> None:
    grid = NUMBERS[:12].reshape(3, 4)
    for name in ("sin", "cos", "tan", "exp", "log"):
        found = getattr(pn, name)(np.abs(grid))
        assert found.shape == (3, 4) and found[1, 2] == getattr(pm, name)(abs(grid[1, 2])), name
    assert pn.arctan2(grid, grid[:, :1])[2, 3] == pm.atan2(grid[2, 3], grid[2, 0])
    assert pn.hypot(2.0, grid.T)[3, 1] == pm.hypot(2.0, grid[1, 3])
    assert pn.sin(np.zeros((0, 2))).shape == (0, 2) and pn.cos(0.5) == pm.cos(0.5) and isinstance(pn.cos(0.5), float)


def test_small_matrices_are_multiplied_and_inverted() -> None:
    first, second = RNG.normal(size=(5, 2)), RNG.normal(size=(2, 2))
    assert pn.matmul(first, second) == pytest.approx(first @ second)
    assert pn.matmul(second, pn.inverse(second)) == pytest.approx(np.eye(2))
    assert pn.dot(first, second[0]) == pytest.approx(first @ second[0])
    with pytest.raises(np.linalg.LinAlgError):
        pn.inverse(np.ones((2, 2)))
