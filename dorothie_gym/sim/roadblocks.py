"""Check that a town remains passable with roadblocks in it.

The cells of the router are closed that a car cannot drive or turn round in because of a prop. What is left has to hold
for good, not only from where the car is now: wherever it may still come to, and wherever it may have to stop before a
prop, it must be able to reach every place that it could reach before.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from dorothie_gym.maps.model import LinkType
from dorothie_gym.maps.routing import CELL, Place, router
from dorothie_gym.maps.town import Town

STANDS_BEFORE = 17.0
"""Distance of a car that stops for a prop to the prop, between their middles [m]."""

TURNS_BEHIND = 16.0
"""Least distance behind a prop at which a U-turn onto its lane ends: `limits.U_TURN_REACH`, by which the car swings
ahead first, and half the length of a prop [m]."""

ONE_ROADBLOCK = 3.0
"""Largest distance along the road of props on lanes beside one another that form one roadblock [m]."""

APART = 22.0
"""Least distance along the road of other props [m]: a U-turn before the one swings out onto the other lane."""


def closed_by(place: Place) -> list[Place]:
    """Places that no car can use because of a prop: right before it, under it, and where none lands behind it."""
    lane, station = place
    return [(lane, station + float(on)) for on in np.arange(-STANDS_BEFORE, TURNS_BEHIND, CELL / 2)]


def crowds(town: Town, place: Place, others: Iterable[Place]) -> bool:
    """Returns whether a prop would leave too little room for a U-turn before a prop on a lane beside, or itself."""
    lane, station = place
    position = town.lanes[lane].position(station)
    beside = {
        near
        for side in (LinkType.LANE_CHANGE_LEFT, LinkType.LANE_CHANGE_RIGHT)
        if (near := town.neighbour(lane, side)) is not None
    }
    return any(
        ONE_ROADBLOCK < abs(town.lanes[other].project(position)[0] - at) < APART
        for other, at in others
        if other in beside
    )


def cuts_off(town: Town, car: Place, standing: Sequence[Place], added: Place) -> bool:
    """Returns whether one more prop would cut a way that the car needs, now or later.

    Args:
        town: the map.
        car: where the car is.
        standing: places of the props that are there.
        added: place of the new one.

    Returns:
        Whether there is a site that can be reached from the car's place now, and then could not any more: from there,
        from a place that the car can come to, or from where it would stand before one of the props.
    """
    search = router(town)
    props = [*standing, added]
    closed = [spot for place in props for spot in closed_by(place)]
    stands = [_stand(place) for place in props]
    on = search.onward(car)
    goals = [cell for site in town.sites if on[cell := search.cell(site.lane, site.station)]]
    safe = search.safe(goals, closed, stands)
    lost = search.safe(goals) & ~safe
    near = [at for lane, at in props if lane == car[0] and 0.0 < at - car[1] < STANDS_BEFORE + 2 * CELL]
    held = (car[0], max(min(near) - STANDS_BEFORE, car[1])) if near else None
    on = search.onward(car, closed, stands, held)
    if not on[goals].all() or (on & lost).any():
        return True
    return not all(search.leads_to(stand, safe, closed) for stand in stands)


def _stand(place: Place) -> Place:
    return place[0], max(place[1] - STANDS_BEFORE, 0.0)
