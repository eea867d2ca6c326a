"""Places for landmarks that the plan names, each reached from the street beside it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from dorothie_gym.world.town.model import Lane, Site
from dorothie_gym.world.town.yaml_town.geometry import Point
from dorothie_gym.world.town.yaml_town.nodes import Entry

FARTHEST_SITE = 25.0
"""A landmark stands at most this far from the lane at its kerb [m]."""
_SPACING = 1.0
"""Distance between the places on lanes that are compared [m]."""
_STOP_ROOM = 1.0
"""A waypoint is this far from the ends of its lane, at least [m]."""


def place_sites(places: Sequence[tuple[Point, Entry]], lanes: Sequence[Lane]) -> tuple[Site, ...]:
    """Finds the nearest lane at a kerb for each place.

    Raises:
        TownError: a place is too far from every street, on a road, or nearest to a junction.
    """
    points, owner = [], []
    for lane in lanes:
        stations = np.linspace(0.0, lane.length, max(2, int(lane.length / _SPACING) + 2))
        points.append(np.column_stack([np.interp(stations, lane.stations, lane.points[:, k]) for k in (0, 1)]))
        owner.append(np.full(len(stations), lane.id))
    tree, owners = cKDTree(np.concatenate(points)), np.concatenate(owner)
    outermost: dict[tuple[int, bool], int] = {}
    for lane in lanes:
        side = lane.road_id, lane.lane_id > 0
        outermost[side] = max(outermost.get(side, 0), abs(lane.lane_id))
    sites: list[Site] = []
    for place, entry in places:
        lane = lanes[int(owners[tree.query(place)[1]])]
        station, aside = lane.project(np.array(place))
        kerb = abs(lane.lane_id) == outermost[lane.road_id, lane.lane_id > 0] and not lane.in_junction
        _check(entry, lane, station, aside, kerb=kerb)
        x, y = lane.position(station)
        sites.append(
            Site(
                id=len(sites),
                lane=lane.id,
                station=station,
                position=(float(place[0]), float(place[1])),
                waypoint=(float(x), float(y)),
                street=lane.street,
            )
        )
    return tuple(sites)


def _check(entry: Entry, lane: Lane, station: float, aside: float, *, kerb: bool) -> None:
    if abs(aside) > FARTHEST_SITE:
        entry.fail(f"it is {abs(aside):.1f} m from the nearest street; {FARTHEST_SITE:g} m are possible: move it")
    if abs(aside) < lane.width_at(station) / 2.0 + 0.5:
        entry.fail("it stands on the road; move it aside")
    if not kerb or aside < 0.0 or not _STOP_ROOM <= station <= lane.length - _STOP_ROOM:
        what = "a junction" if lane.in_junction or kerb and aside > 0.0 else "a median"
        entry.fail(f"the nearest place to stop for it would be {what}; move it to the side of a street")
