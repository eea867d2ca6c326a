"""Rectangles around the lanes of a town, by which points far from a lane need not be projected onto it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from dorothie_gym.policies.town_tables import kept_with_town

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town

_ROUNDING: Final = 1e-3
"""Distance within which a point counts as inside, for rounding [m]."""


def may_be_near(town: Town, lane: int, x: float, y: float, distance: float) -> bool:
    """Returns whether a point can be within a distance of the centre line of a lane.

    Args:
        town: the map.
        lane: id of the lane.
        x: position [m].
        y: position [m].
        distance: the distance [m].
    """
    left, right, low, high = _bounds(town, lane)
    reach = distance + _ROUNDING
    return left - reach <= x <= right + reach and low - reach <= y <= high + reach


@kept_with_town
def _bounds(town: Town, lane: int) -> tuple[float, float, float, float]:
    """Returns the smallest and the largest x, and the smallest and the largest y, of a lane [m]."""
    x, y = town.lanes[lane].points[:, 0], town.lanes[lane].points[:, 1]
    return float(x.min()), float(x.max()), float(y.min()), float(y.max())
