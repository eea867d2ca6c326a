"""Turn lanes: lanes that end at a junction with a single exit, while the lanes beside them lead elsewhere.

A lane before a junction offers a choice where it has several exits. On roads with turn lanes, the lane decides, so that
"turn left" refers to such a junction as well.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

from dorothie_gym.maps.routing import LaneEntry, Place
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.route_progress import Choice, RouteJunction, RouteProgress, lanes_beside
from dorothie_gym.policies.route_tables import default_successor, entry_station, is_choice
from dorothie_gym.sim.network.network import side_by_side, ways_part

if TYPE_CHECKING:
    from dorothie_gym.maps.routing import Leg
    from dorothie_gym.maps.town import Town


@lru_cache(maxsize=16)
def turn_lanes(town: Town) -> frozenset[int]:
    """Returns the turn lanes of a town, those that lead straight on included."""
    return frozenset(lane.id for lane in town.lanes if _is_turn_lane(town, lane.id))


def _is_turn_lane(town: Town, lane: int) -> bool:
    exits = town.exits(lane)
    if len(exits) != 1 or exits[0].junction_id < 0 or town.lanes[lane].in_junction:
        return False
    return ways_part(town, side_by_side(town, lane))


def next_turn_lane(town: Town, lane: int, station: float) -> Choice | None:
    """Returns the next junction on the default lanes where it is reached on a turn lane; None elsewhere.

    Args:
        town: the map.
        lane: lane of the car.
        station: place of the car on it [m].
    """
    seen, ahead = {lane}, town.lanes[lane].length - station
    while not is_choice(town, lane):
        if lane in turn_lanes(town):
            return Choice(lane=lane, distance=max(ahead, 0.0), exits=town.exits(lane))
        following = default_successor(town, lane)
        if following is None or following in seen:
            return None
        ahead += town.lanes[following].length - entry_station(town, lane, following)
        lane = following
        seen.add(lane)
    return None


def next_turn(progress: RouteProgress, town: Town, station: float) -> RouteJunction | None:
    """Returns the next junction of a route with a choice or with turn lanes; None if there is none.

    Args:
        progress: the route.
        town: the map.
        station: place of the car on the current leg [m].
    """
    crossing, legs, distance = progress.next_crossing(town, station), progress.legs, 0.0
    for k, leg in enumerate(legs[:-1]):
        following = legs[k + 1]
        begin = leg.start if k else station
        if crossing is not None and leg.lane == crossing.lane and following.lane == crossing.exit.connector:
            return replace(crossing, distance=max(distance + leg.end - begin, crossing.distance))
        if following.entry in (LaneEntry.CHANGE_LEFT, LaneEntry.CHANGE_RIGHT):
            distance += way_before_change(town, leg, following, begin)
            continue
        distance += max(leg.end - begin, 0.0)
        if following.entry is LaneEntry.FOLLOW and leg.lane in turn_lanes(town):
            return RouteJunction(lane=leg.lane, exit=town.exits(leg.lane)[0], distance=distance)
    return crossing


def way_before_change(town: Town, leg: Leg, following: Leg, begin: float) -> float:
    """Returns the distance from a station of a leg to the end of the lane change after it [m].

    The stations of lanes side by side are almost equal, but for lanes that end: these often begin later.

    Args:
        town: the map.
        leg: leg before the change.
        following: leg after the change.
        begin: the station [m].
    """
    lane = town.lanes[leg.lane]
    if town.merge(lane.id) is not None:
        begin = town.lanes[following.lane].project(lane.position(begin))[0]
    return max(following.start - begin, 0.0)


def junction_meant(town: Town, here: Place, choice: Choice | None) -> Choice | None:
    """Returns the nearer of the next junction with a choice and the next one with turn lanes.

    Args:
        town: the map.
        here: place of the car.
        choice: the next junction with a choice.
    """
    turn_lane = next_turn_lane(town, *here)
    nearer = turn_lane is not None and (choice is None or turn_lane.distance < choice.distance)
    return turn_lane if nearer else choice


def leads_beside(town: Town, lane: int, wanted: int) -> bool:
    """Returns whether a lane leads, before any junction, to a given lane or one beside it.

    Args:
        town: the map.
        lane: lane of the car.
        wanted: the given lane.
    """
    beside = (wanted, *lanes_beside(town, wanted))
    seen: set[int] = set()
    following: int | None = lane
    while following is not None and following not in seen and not town.lanes[following].in_junction:
        if following in beside:
            return True
        seen.add(following)
        following = default_successor(town, following)
    return False
