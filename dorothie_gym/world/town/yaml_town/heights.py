"""How high a street is along its course: flat at its ends, and smooth and monotone between the given heights."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dorothie_gym.world.town.model import Array

STEEPEST = 0.12
"""Largest slope of a street."""


@dataclass(frozen=True, kw_only=True, eq=False)
class HeightProfile:
    """Cubic pieces between given heights.

    Attributes:
        stations: distances along the street (n,) at which its height is given, rising [m].
        heights: heights there (n,) [m].
        slopes: slopes there (n,).
    """

    stations: Array
    heights: Array
    slopes: Array

    @property
    def is_flat(self) -> bool:
        """Whether the street has the same height everywhere."""
        return bool(np.ptp(self.heights) == 0.0)

    def at(self, station: Array) -> Array:
        """Height (n,) at distances (n,) along the street [m]."""
        if self.is_flat:
            return np.full(len(station), self.heights[0])
        k = np.clip(np.searchsorted(self.stations, station, side="right") - 1, 0, len(self.stations) - 2)
        span = self.stations[k + 1] - self.stations[k]
        t = np.clip((station - self.stations[k]) / span, 0.0, 1.0)
        # Cubic Hermite basis.
        result: Array = (
            (1.0 + 2.0 * t) * (1.0 - t) ** 2 * self.heights[k]
            + t * (1.0 - t) ** 2 * span * self.slopes[k]
            + t**2 * (3.0 - 2.0 * t) * self.heights[k + 1]
            - t**2 * (1.0 - t) * span * self.slopes[k + 1]
        )
        return result

    def steepest(self) -> float:
        """Largest slope, up or down."""
        if self.is_flat:
            return 0.0
        grid = np.linspace(self.stations[0], self.stations[-1], max(3, int(self.stations[-1] - self.stations[0])))
        return float(np.max(np.abs(np.diff(self.at(grid))) / np.diff(grid)))


def height_profile(stations: Sequence[float], heights: Sequence[float | None]) -> HeightProfile:
    """The profile through the given heights, flat at both ends and wherever it turns from rising to falling.

    Slopes between are the harmonic mean of those on either side, which keeps every piece monotone (Fritsch and Butland,
    "A method for constructing local monotone piecewise cubic interpolants", SIAM J. Sci. Stat. Comput. 5(2), 1984).

    Args:
        stations: distances along the street, rising [m].
        heights: heights there, or None where nothing is given; the first and the last are given [m].
    """
    given = [(s, height) for s, height in zip(stations, heights, strict=True) if height is not None]
    s, z = (np.array(column, dtype=float) for column in zip(*given, strict=True))
    steps = np.diff(s)
    secants = np.diff(z) / steps
    slopes = np.zeros(len(s))
    for k in range(1, len(s) - 1):
        before, after = secants[k - 1], secants[k]
        if before * after > 0.0:
            weight = (1.0 + steps[k] / (steps[k - 1] + steps[k])) / 3.0
            slopes[k] = before * after / (weight * after + (1.0 - weight) * before)
    return HeightProfile(stations=s, heights=z, slopes=slopes)
