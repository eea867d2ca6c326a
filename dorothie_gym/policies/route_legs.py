"""Progress along the legs of a route, compiled: `RouteProgress` and the built-in instructor use it alike.

A route is an array of legs; its first `count` rows are in use, and the car is on the one with the index `leg`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from dorothie_gym.maps.routing_graph import FOLLOW, NONE, U_TURN
from dorothie_gym.support.compilation import compiled
from dorothie_gym.support.compilation.records import RecordArray

if TYPE_CHECKING:
    from dorothie_gym.maps.route_arrays import LegRecord, PlaceRecord
    from dorothie_gym.policies.route_tables import RouteTables

PASSED = 3.0
"""Distance behind the car at which a goal counts as passed [m]."""

SWITCH_ROOM = 16.0
"""Minimum distance to the end of a lane for a lane switch [m]."""

END_ROOM = 6.0
"""Distance to the end of a lane within which a car waits there and no longer turns round [m]."""

SAME_WAY = 25.0
"""Difference in angle within which an exit of the car's lane is taken instead of that of a neighbour [degrees]."""

RIGHT_BEHIND = 70.0
"""Distance from a junction to a goal within which there may be no room to change lanes [m]."""

MANOEUVRE_OVERDUE_DISTANCE = 18.0
"""Distance past its planned place at which a lane change or U-turn is given up [m]."""


@compiled
def find_leg(tables: RouteTables, legs: RecordArray[LegRecord], count: int, leg: int, lane: int, station: float) -> int:
    """Returns the leg that a car is on, the current one or one ahead; -1 if it is off the route.

    A car that has passed the end of a leg, where it had to change lanes, turn round or stop, is not on that leg.
    """
    for k in range(leg, count):
        if legs[k].lane == lane and not _is_overdue(tables, legs, count, k, station):
            return k
    return NONE


@compiled
def _is_overdue(tables: RouteTables, legs: RecordArray[LegRecord], count: int, leg: int, station: float) -> bool:
    """Returns whether the manoeuvre or the goal at the end of a leg has been passed."""
    if leg + 1 == count:
        return station > legs[leg].end + PASSED
    entry = legs[leg + 1].entry
    if entry == FOLLOW:
        return False
    lane = tables.lanes[legs[leg].lane]
    if lane.merge == entry:  # the car changes lanes by itself, at the latest at the end
        return False
    room = lane.length - station
    if entry == U_TURN:
        return station > legs[leg].end + (MANOEUVRE_OVERDUE_DISTANCE if room > END_ROOM else 0.0)
    return room < SWITCH_ROOM or station > legs[leg].end + MANOEUVRE_OVERDUE_DISTANCE


@compiled
def distance_left(legs: RecordArray[LegRecord], count: int, leg: int, station: float) -> float:
    """Returns the distance to the goal along the route [m]; negative just past the goal."""
    if leg + 1 == count:
        return float(legs[leg].end - station)
    rest = 0.0
    for k in range(leg + 1, count):
        rest += legs[k].end - legs[k].start
    return max(legs[leg].end - station, 0.0) + rest


@compiled
def find_crossing(
    tables: RouteTables, legs: RecordArray[LegRecord], count: int, leg: int, station: float, first: int
) -> tuple[int, int, float]:
    """Returns the next junction with a choice on the route.

    Args:
        tables: lanes and exits.
        legs: legs of the route.
        count: number of legs.
        leg: the current leg.
        station: place of the car on it [m].
        first: first leg whose end counts, to find more than one junction.

    Returns:
        The leg before it (-1: there is none), the row of its exit in `tables.exits`, and its distance [m].
    """
    distance = 0.0
    for k in range(leg, count - 1):
        distance += max(legs[k].end - (station if k == leg else legs[k].start), 0.0)
        lane, following = legs[k].lane, legs[k + 1]
        if k >= first and following.entry == FOLLOW and tables.choice[lane]:
            for row in range(tables.rows[lane], tables.rows[lane + 1]):
                if tables.exits[row].connector == following.lane:
                    return k, row, distance
    return NONE, NONE, 0.0


@compiled
def find_manoeuvre(legs: RecordArray[LegRecord], count: int, leg: int, station: float) -> tuple[int, float]:
    """Returns the next lane change or U-turn on the route (-1: there is none), and its distance [m]."""
    distance = 0.0
    for k in range(leg, count):
        if k > leg and legs[k].entry != FOLLOW:
            return int(legs[k].entry), distance
        distance += max(legs[k].end - (station if k == leg else legs[k].start), 0.0)
    return NONE, 0.0


@compiled
def needs_switch(
    tables: RouteTables,
    lane: int,
    station: float,
    wanted: int,
    behind: float,
    blocked: RecordArray[PlaceRecord],
    places: int,
) -> bool:
    """Returns whether a lane change before a junction must be commanded apart from the turn.

    Without it the car would reach another junction, run into an obstacle on its lane, or cross the junction in its own
    lane and end up next to a goal right after the junction.

    Args:
        tables: lanes and exits.
        lane: lane of the car.
        station: place of the car on it [m].
        wanted: row of the exit to take.
        behind: distance from the junction to the goal [m].
        blocked: places that the route avoids.
        places: number of these places.
    """
    for k in range(places):
        if blocked[k].lane == lane and blocked[k].station > station:
            return True
    ahead, way = tables.ahead[lane], tables.exits[wanted]
    if ahead < 0:
        return True
    junction = NONE
    for row in range(tables.rows[ahead], tables.rows[ahead + 1]):
        junction = max(junction, tables.exits[row].junction)
    if junction != way.junction:
        return True
    if behind > RIGHT_BEHIND:
        return False
    for row in range(tables.rows[ahead], tables.rows[ahead + 1]):
        other = tables.exits[row]
        turned = (other.angle - way.angle + 180.0) % 360.0 - 180.0
        if other.connector != way.connector and abs(turned) <= SAME_WAY:
            return True
    return False
