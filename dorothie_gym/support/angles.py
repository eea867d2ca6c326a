"""Angles on the circle."""

from __future__ import annotations

import math
from typing import overload

import numpy as np
from numpy.typing import NDArray


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
