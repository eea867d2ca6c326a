"""Exits of the lanes of a town in arrays, for compiled guidance."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps.model import IntArray
from dorothie_gym.maps.routing_graph import NONE, RoutingLane, routing_graph
from dorothie_gym.policies.town_tables import kept_with_town
from dorothie_gym.support.compilation.records import Int32, RecordArray, argument, by_reference, filled_records
from dorothie_gym.support.copying import shared

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town


class ExitRecord:
    """An exit from the end of a lane, see `maps.Exit`."""

    connector: Int32
    lane: Int32
    angle: Int32
    junction: Int32


@by_reference
@shared
class RouteTables(NamedTuple):
    """Lanes and exits of a town.

    Attributes:
        lanes: lanes of the routing graph.
        exits: exits of all lanes, lane by lane in the order of `Town.exits`.
        rows: (lanes + 1,) first exit of each lane, and the number of exits.
        choice: (lanes,) whether a lane ends at a junction with more than one exit.
        ahead: (lanes,) lane before the next junction with a choice on the default lanes, or -1.
        street: (lanes,) index of the street of each lane, or -1.
    """

    lanes: RecordArray[RoutingLane]
    exits: RecordArray[ExitRecord]
    rows: IntArray
    choice: NDArray[np.bool_]
    ahead: NDArray[np.int32]
    street: NDArray[np.int32]


@lru_cache(maxsize=16)
def route_tables(town: Town) -> RouteTables:
    """Returns the tables of a town; built once for each town."""
    exits = [town.exits(lane.id) for lane in town.lanes]
    rows = [(way.connector, way.lane, way.angle, way.junction_id) for ways in exits for way in ways]
    return RouteTables(
        lanes=routing_graph(town).lanes,
        exits=argument(filled_records(ExitRecord, rows)),
        rows=np.concatenate(([0], np.cumsum([len(ways) for ways in exits]))),
        choice=np.array([is_choice(town, lane.id) for lane in town.lanes]),
        ahead=np.array([_lane_before_choice(town, lane.id) for lane in town.lanes], dtype=np.int32),
        street=np.array([lane.street for lane in town.lanes], dtype=np.int32),
    )


@kept_with_town
def is_choice(town: Town, lane: int) -> bool:
    """Returns whether a lane ends at a junction with more than one exit."""
    exits = town.exits(lane)
    return len(exits) > 1 and any(way.junction_id >= 0 for way in exits)


@kept_with_town
def default_successor(town: Town, lane: int) -> int | None:
    """Returns the lane that follows by default; None at a junction with a choice and where the map ends.

    A lane that ends is followed by the lane beside it to which the car changes, see `entry_station`.
    """
    exits = town.exits(lane)
    if not exits:
        side = town.merge(lane)
        return None if side is None else town.neighbour(lane, side)
    if is_choice(town, lane):
        return None
    return min(exits, key=lambda way: (abs(way.angle), way.connector)).connector


@kept_with_town
def entry_station(town: Town, lane: int, following: int) -> float:
    """Returns the station of the lane that follows by default which is at the end of a lane [m]; 0 for a successor."""
    return 0.0 if town.merge(lane) is None else town.lanes[following].project(town.lanes[lane].points[-1])[0]


def _lane_before_choice(town: Town, lane: int) -> int:
    seen = {lane}
    while not is_choice(town, lane):
        following = default_successor(town, lane)
        if following is None or following in seen:
            return NONE
        lane = following
        seen.add(lane)
    return lane
