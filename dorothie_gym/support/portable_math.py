"""Elementary functions with equal results on every processor and with every C library.

`math` and numpy leave sin, exp and the like to the C library and to vector routines, whose last bits differ between
processors (fused multiply-add, AVX2, AVX-512) and between versions of the library. The functions that a session depends
on are computed here instead, from additions, multiplications, divisions and square roots, which IEEE 754 rounds
exactly.

The module is imported as `pm`. Its functions run in compiled code and, called from Python, as Python, with equal
results. Errors are below 1.5 units in the last place, unless stated otherwise. Arguments outside of a function's domain
give NaN or an infinity, not an error as in `math`. `portable_arrays`, imported as `pn`, has functions for arrays.

Each function reduces its argument to a small interval and sums the Taylor series there; the reductions are those of
Cody and Waite (1980) for the trigonometric functions and exp, and the series of artanh for the logarithm.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, overload

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.support.compilation.dispatcher import portable

__all__ = [
    "acos",
    "asin",
    "atan",
    "atan2",
    "cos",
    "dist",
    "exp",
    "expm1",
    "hypot",
    "log",
    "log1p",
    "log10",
    "power",
    "sin",
    "sincos",
    "tan",
]

_PI: Final = 3.141592653589793
_TWO_PI: Final = 2.0 * _PI

# pi / 2 in three parts, of which the first two have 33 bits: their products with numbers below 2^20 are exact.
_QUARTER_1: Final = 1.5707963267341256
_QUARTER_2: Final = 6.077100506303966e-11
_QUARTER_3: Final = 2.0222662487959506e-21
_QUARTERS_PER_RADIAN: Final = 2.0 / _PI

# log(2) in two parts, of which the first has 32 bits after the point.
_LOG_2_1: Final = 0.6931471803691238
_LOG_2_2: Final = 1.9082149292705877e-10
_LOG_10: Final = 2.302585092994046

_ROUND: Final = 6755399441055744.0
"""1.5 * 2^52: its addition and subtraction round a number below 2^51 to an integer."""

LARGEST_ANGLE: Final = 1e6
"""Larger angles [rad] are first reduced by the double next to 2 pi: equal everywhere, but less exact."""

# atan(k / 16) for k = 0..16, and the remainders of the doubles.
_ATAN: Final = (
    0.0, 0.06241880999595735, 0.12435499454676144, 0.18534794999569476, 0.24497866312686414, 0.3028848683749714,
    0.35877067027057225, 0.4124104415973873, 0.4636476090008061, 0.5123894603107377, 0.5585993153435624,
    0.6022873461349642, 0.6435011087932844, 0.6823165548747481, 0.7188299996216245, 0.7531512809621944,
    0.7853981633974483,
)  # fmt: skip
_ATAN_REST: Final = (
    0.0, -1.5490756308295046e-18, -3.1253241424539383e-18, 4.180692268843079e-18, 1.0698755618734451e-17,
    -1.1010827903001369e-17, -2.4623815582638635e-17, -1.587652227770689e-17, 2.2698777452961687e-17,
    -2.5462781472855804e-17, -5.4556305485916264e-18, 2.950430737228402e-17, 1.5834785051444286e-17,
    6.943223671560008e-18, -2.1478388444456983e-17, -2.4256934659182068e-17, 3.061616997868383e-17,
)  # fmt: skip
_HALF_PI_REST: Final = 6.123233995736766e-17


# --- Trigonometric functions ------------------------------------------------------------------------------------------


@portable
def _sine_near_zero(x: float, rest: float) -> float:
    """Returns sin(x + rest) for an angle in [-pi/4, pi/4] [rad] and a rest far below its last place."""
    z = x * x
    series = -1 / 6 + z * (
        1 / 120
        + z * (-1 / 5040 + z * (1 / 362880 + z * (-1 / 39916800 + z * (1 / 6227020800 - z * (1 / 1307674368000)))))
    )
    return x + (x * z * series + rest * (1.0 - 0.5 * z))


@portable
def _cosine_near_zero(x: float, rest: float) -> float:
    """Returns cos(x + rest) for an angle in [-pi/4, pi/4] [rad] and a rest far below its last place."""
    z = x * x
    series = 1 / 24 + z * (
        -1 / 720
        + z * (1 / 40320 + z * (-1 / 3628800 + z * (1 / 479001600 + z * (-1 / 87178291200 + z * (1 / 20922789888000)))))
    )
    half = 0.5 * z
    rough = 1.0 - half
    return rough + (((1.0 - rough) - half) + (z * z * series - x * rest))


@portable
def _reduce(x: float) -> tuple[float, float, float]:
    """Returns the nearest number of quarter turns of an angle [rad], and the rest in two parts, the larger first."""
    if not abs(x) <= LARGEST_ANGLE:
        x = math.nan if x - x != 0.0 else x % _TWO_PI
    turns = (x * _QUARTERS_PER_RADIAN + _ROUND) - _ROUND
    near = (x - turns * _QUARTER_1) - turns * _QUARTER_2  # a double, with `rest`
    rest = ((x - turns * _QUARTER_1) - near) - turns * _QUARTER_2
    reduced = near - turns * _QUARTER_3
    return turns, reduced, rest + ((near - reduced) - turns * _QUARTER_3)


@portable
def sincos(x: float) -> tuple[float, float]:
    """Returns the sine and the cosine of an angle [rad], equal to those of `sin` and `cos`."""
    turns, reduced, rest = _reduce(x)
    if turns != turns:
        return math.nan, math.nan
    quadrant = int(turns) & 3
    sine, cosine = _sine_near_zero(reduced, rest), _cosine_near_zero(reduced, rest)
    if quadrant & 1:
        sine, cosine = cosine, -sine
    return (-sine, -cosine) if quadrant & 2 else (sine, cosine)


@portable
def _wave(x: float, quarters: float) -> float:
    """Returns sin(x + quarters pi / 2)."""
    turns, reduced, rest = _reduce(x)
    if turns != turns:
        return math.nan
    quadrant = int(turns + quarters) & 3
    value = _cosine_near_zero(reduced, rest) if quadrant & 1 else _sine_near_zero(reduced, rest)
    return -value if quadrant & 2 else value


@portable
def sin(x: float) -> float:
    """Returns the sine of an angle [rad]."""
    return _wave(x, 0)


@portable
def cos(x: float) -> float:
    """Returns the cosine of an angle [rad]."""
    return _wave(x, 1)


@portable
def tan(x: float) -> float:
    """Returns the tangent of an angle [rad], within 3 units in the last place."""
    sine, cosine = sincos(x)
    return sine / cosine


@portable
def atan2(y: float, x: float) -> float:
    """Returns the direction of the vector (x, y) in [-pi, pi] [rad]; signed zeros count as in `math.atan2`."""
    if x != x or y != y:
        return math.nan
    across, along = abs(y), abs(x)
    small, large = (across, along) if across <= along else (along, across)
    if large == math.inf:
        small, large = (1.0 if small == math.inf else 0.0), 1.0
    slope = small / large if large > 0.0 else 0.0
    k = int(slope * 16.0 + 0.5)
    if k > 0:
        middle = k * 0.0625
        slope = (small - large * middle) / (large + small * middle)
    z = slope * slope
    series = -1 / 3 + z * (1 / 5 + z * (-1 / 7 + z * (1 / 9 + z * (-1 / 11 + z * (1 / 13)))))
    angle, rest = _ATAN[k], _ATAN_REST[k] + slope * z * series
    if across <= along:
        direction = angle + (slope + rest)
        if math.copysign(1.0, x) < 0.0:
            direction = _PI - (direction - 2.0 * _HALF_PI_REST)
    elif x < 0.0:
        direction = 0.5 * _PI + angle + (slope + (rest + _HALF_PI_REST))
    else:
        direction = (0.5 * _PI - angle) - (slope + (rest - _HALF_PI_REST))
    return math.copysign(direction, y)


@portable
def atan(x: float) -> float:
    """Returns the angle in [-pi/2, pi/2] with a tangent [rad]."""
    return atan2(x, 1.0)


@portable
def asin(x: float) -> float:
    """Returns the angle in [-pi/2, pi/2] with a sine in [-1, 1] [rad], within 3 units in the last place."""
    if not abs(x) <= 1.0:
        return math.nan
    return atan2(x, math.sqrt((1.0 - x) * (1.0 + x)))


@portable
def acos(x: float) -> float:
    """Returns the angle in [0, pi] with a cosine in [-1, 1] [rad], within 3 units in the last place."""
    if not abs(x) <= 1.0:
        return math.nan
    return atan2(math.sqrt((1.0 - x) * (1.0 + x)), x)


# --- Distances --------------------------------------------------------------------------------------------------------


@portable
def hypot(x: float, y: float) -> float:
    """Returns the length of the vector (x, y), for components whose squares neither overflow nor vanish."""
    return math.sqrt(x * x + y * y)


# --- Exponential function and logarithm -------------------------------------------------------------------------------


@portable
def _growth_near_zero(x: float) -> float:
    """Returns exp(x) - 1 - x for numbers in [-0.36, 0.36]."""
    series = 1 / 5040 + x * (
        1 / 40320
        + x * (1 / 362880 + x * (1 / 3628800 + x * (1 / 39916800 + x * (1 / 479001600 + x * (1 / 6227020800)))))
    )
    return x * x * (0.5 + x * (1 / 6 + x * (1 / 24 + x * (1 / 120 + x * (1 / 720 + x * series)))))


@portable
def exp(x: float) -> float:
    """Returns e to a power; infinity beyond 709.78."""
    if x != x:
        return x
    if x > 709.782712893384:
        return math.inf
    if x < -745.2:
        return 0.0
    doublings = (x * (1.0 / (_LOG_2_1 + _LOG_2_2)) + _ROUND) - _ROUND
    near, rest = x - doublings * _LOG_2_1, doublings * _LOG_2_2
    reduced = near - rest
    lost = (near - reduced) - rest
    value = 1.0 + (reduced + (_growth_near_zero(reduced) + lost))
    return math.ldexp(value, int(doublings))


@portable
def expm1(x: float) -> float:
    """Returns e to a power, less 1, also exact near 0; within 4 units in the last place."""
    return x + _growth_near_zero(x) if abs(x) < 0.35 else exp(x) - 1.0


@portable
def _log_near_one(f: float) -> float:
    """Returns log(1 + f) - f for numbers in [-0.3, 0.42], by the series of 2 artanh(f / (2 + f))."""
    s = f / (2.0 + f)
    z = s * s
    series = 2 / 13 + z * (2 / 15 + z * (2 / 17 + z * (2 / 19 + z * (2 / 21 + z * (2 / 23)))))
    series = z * (2 / 3 + z * (2 / 5 + z * (2 / 7 + z * (2 / 9 + z * (2 / 11 + z * series)))))
    half = 0.5 * f * f
    return s * (half + series) - half


@portable
def log(x: float) -> float:
    """Returns the natural logarithm; -infinity of 0."""
    if not x > 0.0:
        return -math.inf if x == 0.0 else math.nan
    if x == math.inf:
        return x
    fraction, doublings = math.frexp(x)
    if fraction < 0.7071067811865476:
        fraction, doublings = 2.0 * fraction, doublings - 1
    f = fraction - 1.0
    return doublings * _LOG_2_1 + (f + (_log_near_one(f) + doublings * _LOG_2_2))


@portable
def log1p(x: float) -> float:
    """Returns the natural logarithm of 1 + x, also exact near 0; within 3 units in the last place."""
    if -0.25 < x < 0.4:
        return x + _log_near_one(x)
    return log(1.0 + x)


@portable
def log10(x: float) -> float:
    """Returns the decimal logarithm, within 3 units in the last place."""
    return log(x) / _LOG_10


@portable
def power(base: float, exponent: float) -> float:
    """Returns a positive base (or 0) to a power.

    The relative error is up to 2^-52 times one plus the magnitude of the result's logarithm.
    """
    if base == 0.0:
        return 1.0 if exponent == 0.0 else 0.0 if exponent > 0.0 else math.inf
    return exp(exponent * log(base))


def dist(first: Sequence[float], second: Sequence[float]) -> float:
    """Returns the distance of two points of equal dimension, as `math.dist`; in Python only."""
    return math.sqrt(sum([(a - b) * (a - b) for a, b in zip(first, second, strict=True)]))


# --- Angles on the circle ---------------------------------------------------------------------------------------------


@overload
def wrap_degrees(angle: float) -> float: ...
@overload
def wrap_degrees(angle: NDArray[np.float64]) -> NDArray[np.float64]: ...
def wrap_degrees(angle: float | NDArray[np.float64]) -> float | NDArray[np.float64]:
    """Returns the equivalent angle, or array of angles, in [-180, 180) [degrees]."""
    return (angle + 180.0) % 360.0 - 180.0


@overload
def wrap_radians(angle: float) -> float: ...
@overload
def wrap_radians(angle: NDArray[np.float64]) -> NDArray[np.float64]: ...
def wrap_radians(angle: float | NDArray[np.float64]) -> float | NDArray[np.float64]:
    """Returns the equivalent angle, or array of angles, in [-pi, pi) [rad]."""
    return (angle + math.pi) % (2.0 * math.pi) - math.pi
