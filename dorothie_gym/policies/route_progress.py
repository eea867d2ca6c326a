"""Route to a place and the progress on it: remaining distance, next junction or manoeuvre, and leaving the route."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np

from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.errors import PolicyStateError
from dorothie_gym.maps.model import Exit, IntArray, LinkType
from dorothie_gym.maps.route_arrays import LegRecord, place_records
from dorothie_gym.maps.routing import LaneEntry, Leg, Place, Route, router
from dorothie_gym.maps.routing_graph import LANE_ENTRIES
from dorothie_gym.ontology.slots import StreetName
from dorothie_gym.policies.observation_parser import street_of
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.route_legs import (
    PASSED,
    distance_left,
    find_crossing,
    find_leg,
    find_manoeuvre,
    needs_switch,
)
from dorothie_gym.policies.route_tables import default_successor, entry_station, is_choice, route_tables
from dorothie_gym.policies.town_tables import kept_with_town
from dorothie_gym.sim.ego.limits import PLANNED_BRAKING
from dorothie_gym.support.compilation.records import RecordArray
from dorothie_gym.support.portable_math import wrap_degrees

if TYPE_CHECKING:
    from dorothie_gym.maps.town import LightColour, Town
    from dorothie_gym.session.spaces.observations import ObservationMapping

ASTRAY = 3
"""Number of decisions off the route after which it has been left."""

U_TURN_SPEED_SQUARED = 12.0
"""Square of the speed at which the scripted agents expect U-turns [m^2/s^2]; the local planner's is 3.5^2 = 12.25."""

LIGHT_SIGHT = 60.0
"""Distance within which a traffic light explains a standstill [m]."""

LAG = 0.56
"""Delay of the brakes, measured at 3 to 11 m/s [s]."""

SAME_ROADBLOCK = 10.0
"""Roadblocks closer together than this on a lane count as one [m]; cells of the router are about 10 m long."""

CELL_BEHIND = 8.0
"""Distance from a roadblock to a place in the following cell of the router [m]."""

CANONICAL = {Direction.LEFT: 90.0, Direction.RIGHT: -90.0, Direction.STRAIGHT: 0.0, Direction.BACK: 180.0}
"""Angle of each direction at a crossroads [degrees, positive left]."""

_DIRECTIONS = {
    LinkType.LEFT: Direction.LEFT,
    LinkType.RIGHT: Direction.RIGHT,
    LinkType.STRAIGHT: Direction.STRAIGHT,
    LinkType.U_TURN: Direction.BACK,
}


@dataclass(frozen=True, kw_only=True)
class Choice:
    """Next junction with a choice: the lane before it, the distance to its end [m], and the exits."""

    lane: int
    distance: float
    exits: tuple[Exit, ...]

    @property
    def junction(self) -> int:
        """Id of the junction."""
        return max(way.junction_id for way in self.exits)


@dataclass(frozen=True, kw_only=True)
class RouteJunction:
    """Junction on a route: the lane before it, the exit to take, and the distance [m]."""

    lane: int
    exit: Exit
    distance: float

    @property
    def direction(self) -> Direction:
        """Direction of the exit."""
        return direction_of(self.exit)


def stopping_distance(speed: float) -> float:
    """Returns the distance driven after a Stop command at a speed [m/s], in metres."""
    return LAG * speed + speed * speed / (2 * PLANNED_BRAKING)


def direction_of(way: Exit) -> Direction:
    """Returns the direction of an exit in spoken form."""
    return _DIRECTIONS[way.type]


def default_lane_distance(town: Town, here: Place, place: Place, distance: float) -> float | None:
    """Returns the distance to a place along the default lanes [m]; None if it is not on them within a distance.

    Args:
        town: the map.
        here: place of the car.
        place: place to find.
        distance: largest distance searched [m].
    """
    lane, station = here
    for passed, begin in _lanes_ahead(town, lane, station, distance):
        if passed == place[0]:
            return begin + place[1]
    return None


def default_lane_place(town: Town, here: Place, distance: float) -> Place:
    """Returns the place at a distance ahead [m] on the default lanes, or the end of the last lane before a junction."""
    lane, station = here
    lanes, left = lanes_ahead(town, lane, station, distance), station + distance
    for passed, following in itertools.pairwise(lanes):
        if left <= town.lanes[passed].length:
            return passed, left
        left -= town.lanes[passed].length - entry_station(town, passed, following)
    return lanes[-1], min(left, town.lanes[lanes[-1]].length)


def lanes_ahead(town: Town, lane: int, station: float, distance: float) -> tuple[int, ...]:
    """Returns a lane and those that follow by default within `distance` [m]."""
    return tuple(passed for passed, _ in _lanes_ahead(town, lane, station, distance))


def _lanes_ahead(town: Town, lane: int, station: float, distance: float) -> list[tuple[int, float]]:
    """Returns the lanes of `lanes_ahead`, with the distance to the start of each [m], negative behind the car."""
    found, seen, begin = [(lane, -station)], {lane}, -station
    ahead = town.lanes[lane].length - station
    following = default_successor(town, lane)
    while ahead < distance and following is not None and following not in seen:
        entry = entry_station(town, lane, following)
        begin += town.lanes[lane].length - entry
        found.append((following, begin))
        seen.add(following)
        ahead += town.lanes[following].length - entry
        lane, following = following, default_successor(town, following)
    return found


def light_ahead(town: Town, lane: int, station: float, time: float) -> LightColour | None:
    """Returns the colour of the next traffic light on the default lanes; None if none is near."""
    for passed, begin in _lanes_ahead(town, lane, station, LIGHT_SIGHT):
        if begin + town.lanes[passed].length > LIGHT_SIGHT:
            return None
        colour = town.light(passed, time)
        if colour is not None:
            return colour
    return None


def next_choice(town: Town, lane: int, station: float) -> Choice | None:
    """Returns the next junction with a choice on the default lanes; None if there is none."""
    seen, ahead = {lane}, town.lanes[lane].length - station
    while not is_choice(town, lane):
        following = default_successor(town, lane)
        if following is None or following in seen:
            return None
        ahead += town.lanes[following].length - entry_station(town, lane, following)
        lane = following
        seen.add(lane)
    return Choice(lane=lane, distance=max(ahead, 0.0), exits=town.exits(lane))


@kept_with_town
def lanes_beside(town: Town, lane: int) -> tuple[int, ...]:
    """Returns the adjacent lanes of the same direction, the nearest first."""
    found: list[int] = []
    for side in (town.traffic.to_middle, town.traffic.to_kerb):
        beside = town.neighbour(lane, side)
        while beside is not None and beside not in found and beside != lane:
            found.append(beside)
            beside = town.neighbour(beside, side)
    return tuple(found)


def find_exit(
    town: Town, choice: Choice, direction: Direction | None, streets: frozenset[int] = frozenset()
) -> Exit | None:
    """Returns the exit meant by a direction and perhaps a street, if necessary from an adjacent lane.

    Args:
        town: the map.
        choice: the junction.
        direction: the direction; None if only a street was named.
        streets: indices of the streets of that name; empty if none was named.
    """
    for lane in (choice.lane, *lanes_beside(town, choice.lane)):
        exits = [way for way in town.exits(lane) if direction is None or direction_of(way) is direction]
        onto = [way for way in exits if town.lanes[way.lane].street in streets]
        if direction is None:
            exits = []
        if onto or exits:
            canonical = CANONICAL[direction] if direction is not None else 0.0
            return min(onto or exits, key=lambda way: (abs(wrap_degrees(way.angle - canonical)), way.connector))
    return None


@dataclass(frozen=True, kw_only=True)
class RouteProgress:
    """Route to a goal and the progress on it.

    Attributes:
        goal: lane and station of the goal.
        blocked: places that the route was planned to avoid.
        manoeuvre_cost: extra cost of each lane change and U-turn in planning [m].
        route: the route; None if there is none.
        leg: index of the leg that the car is on.
        astray: number of decisions for which the car has been off the route.
    """

    goal: Place
    blocked: tuple[Place, ...] = ()
    manoeuvre_cost: float = 0.0
    route: Route | None = None
    leg: int = 0
    astray: int = 0

    @classmethod
    def plan(
        cls, town: Town, start: Place, goal: Place, blocked: tuple[Place, ...] = (), manoeuvre_cost: float = 0.0
    ) -> RouteProgress:
        """Plans a route; where the blocked places leave none, one that ignores them."""
        route = router(town).route(start, goal, blocked, manoeuvre_cost)
        if route is None and blocked:
            route = router(town).route(start, goal, (), manoeuvre_cost)
        return cls(goal=goal, blocked=blocked, manoeuvre_cost=manoeuvre_cost, route=route)

    def replanned(self, town: Town, start: Place, blocked: tuple[Place, ...] | None = None) -> RouteProgress:
        """Plans a route from `start` to the same goal."""
        return RouteProgress.plan(
            town, start, self.goal, self.blocked if blocked is None else blocked, self.manoeuvre_cost
        )

    @property
    def legs(self) -> tuple[Leg, ...]:
        """Remaining legs of the route, the current one first."""
        return self.route.legs[self.leg :] if self.route is not None else ()

    def followed(self, town: Town, lane: int, station: float) -> RouteProgress:
        """Advances the current leg to the place of the car; `astray` counts up if the car is off the route."""
        leg = find_leg(route_tables(town), *self._legs, lane, station) if self.has_way else -1
        return replace(self, astray=self.astray + 1) if leg < 0 else replace(self, leg=leg, astray=0)

    def lost(self, station: float) -> bool:
        """Returns whether the route has been left or the goal passed, so that a new route is needed."""
        return self.astray >= ASTRAY or self.left(station) < -PASSED

    def left(self, station: float) -> float:
        """Returns the distance to the goal along the route [m]; negative just past the goal."""
        return self._at(station).left()

    def _at(self, station: float) -> _WayAhead:
        """Returns the contents of the route ahead of a station; they are computed once for all callers."""
        found: _WayAhead | None = self.__dict__.get(_AHEAD)
        if found is None or not found.is_of(self, station):
            found = self.__dict__[_AHEAD] = _WayAhead(self.route, self.leg, station)
        return found

    @property
    def has_way(self) -> bool:
        """Returns whether there is a route, with legs ahead."""
        return self.route is not None and self.leg < len(self.route.legs)

    @property
    def _legs(self) -> tuple[RecordArray[LegRecord], int, int]:
        """Arguments of the compiled functions: legs as records, their number, and the current one."""
        return self._planned.records, len(self._planned.legs), self.leg

    @property
    def _planned(self) -> Route:
        if self.route is None:
            raise PolicyStateError("there is no route to the goal, and so no leg of it")
        return self.route

    def way_in(self) -> Place | None:
        """Returns the place of the last lane change of the route; None if it has none."""
        for before, leg in reversed(list(itertools.pairwise(self.route.legs if self.route is not None else ()))):
            if leg.entry in (LaneEntry.CHANGE_LEFT, LaneEntry.CHANGE_RIGHT):
                return before.lane, (before.start + before.end) / 2
        return None

    def next_crossing(self, town: Town, station: float) -> RouteJunction | None:
        """Returns the next junction with a choice on the route; None if there is none."""
        return self._at(station).crossing(town)

    def crossings(self, town: Town, station: float) -> Iterator[RouteJunction]:
        """Yields the junctions with a choice on the route, the next first."""
        if not self.has_way:
            return
        first = self.leg
        while True:
            found = _next_junction(town, self._planned, self.leg, station, first)
            if found is None:
                return
            before, junction = found
            first = before + 1
            yield junction

    def next_manoeuvre(self, station: float) -> tuple[LaneEntry, float] | None:
        """Returns the next lane change or U-turn on the route and its distance [m]; None without one."""
        return self._at(station).manoeuvre()

    def turns_round_on(self, lane: int) -> bool:
        """Returns whether the next U-turn of the route begins on a lane."""
        for before, leg in itertools.pairwise(self.legs):
            if leg.entry is LaneEntry.U_TURN:
                return before.lane == lane
        return False

    def run_up(self) -> tuple[float, int] | None:
        """Returns distance and number of lane changes from the next U-turn to the goal [m]; None without a U-turn."""
        for k, leg in enumerate(self.legs):
            if k and leg.entry is LaneEntry.U_TURN:
                after = self.legs[k:]
                changes = sum(one.entry in (LaneEntry.CHANGE_LEFT, LaneEntry.CHANGE_RIGHT) for one in after)
                return sum(one.end - one.start for one in after), changes
        return None

    def needs_switch(self, town: Town, lane: int, station: float, crossing: RouteJunction) -> bool:
        """Returns whether a lane change before a junction must be commanded apart from the turn.

        Without it the car would reach another junction, run into an obstacle on its lane, or cross the junction in its
        own lane and end up next to a goal right after the junction.
        """
        tables = route_tables(town)
        wanted = int(tables.rows[crossing.lane]) + town.exits(crossing.lane).index(crossing.exit)
        behind = self.left(station) - crossing.distance
        return needs_switch(tables, lane, station, wanted, behind, place_records(self.blocked), len(self.blocked))

    def turns_round_first(self, town: Town, station: float) -> bool:
        """Returns whether the route turns round before its next junction with a choice."""
        return self.changes_before(self.next_crossing(town, station))

    def changes_before(self, crossing: RouteJunction | None) -> bool:
        """Returns whether the route turns round before the given junction (or before the goal, where None)."""
        for leg in self.legs[1:]:
            if leg.entry is LaneEntry.U_TURN:
                return True
            if crossing is not None and leg.lane == crossing.exit.connector:
                return False
        return False


def _next_junction(town: Town, route: Route, leg: int, station: float, first: int) -> tuple[int, RouteJunction] | None:
    """Returns the next junction with a choice behind the leg `first` at the earliest, and the leg before it."""
    tables = route_tables(town)
    before, row, distance = find_crossing(tables, route.records, len(route.legs), leg, station, first)
    if before < 0:
        return None
    lane = route.legs[before].lane
    return before, RouteJunction(lane=lane, exit=town.exits(lane)[row - int(tables.rows[lane])], distance=distance)


_AHEAD: Final = "_ahead"
"""Attribute of `RouteProgress` for its `_WayAhead`; none of its fields, since it follows from them."""


class _WayAhead:
    """Contents of a route ahead of a station, computed at the first request.

    Args:
        route: the route; None if there is none.
        leg: the current leg.
        station: place of the car on it [m].
    """

    def __init__(self, route: Route | None, leg: int, station: float) -> None:
        self._route, self._leg, self._station = route, leg, station
        self._has_way = route is not None and leg < len(route.legs)
        self._left: float | None = None
        self._manoeuvre: tuple[tuple[LaneEntry, float] | None] | None = None
        self._crossing: tuple[Town, RouteJunction | None] | None = None

    def is_of(self, progress: RouteProgress, station: float) -> bool:
        """Returns whether this is what a progress has ahead of a station."""
        return self._station == station and self._leg == progress.leg and self._route is progress.route

    def left(self) -> float:
        """Returns the distance to the goal [m]."""
        if not self._has_way or self._route is None:
            return math.inf
        if self._left is None:
            self._left = distance_left(self._route.records, len(self._route.legs), self._leg, self._station)
        return self._left

    def manoeuvre(self) -> tuple[LaneEntry, float] | None:
        """Returns the next lane change or U-turn and its distance [m]."""
        if not self._has_way or self._route is None:
            return None
        if self._manoeuvre is None:
            entry, distance = find_manoeuvre(self._route.records, len(self._route.legs), self._leg, self._station)
            self._manoeuvre = (None if entry < 0 else (LANE_ENTRIES[entry], distance),)
        return self._manoeuvre[0]

    def crossing(self, town: Town) -> RouteJunction | None:
        """Returns the next junction with a choice."""
        if not self._has_way or self._route is None:
            return None
        if self._crossing is None or self._crossing[0] is not town:
            found = _next_junction(town, self._route, self._leg, self._station, self._leg)
            self._crossing = town, None if found is None else found[1]
        return self._crossing[1]


def first_new_street(
    observation: ObservationMapping, town: Town, lane: int, progress: RouteProgress | None
) -> StreetName | None:
    """Returns the first named street of a route other than that of the current lane; None if there is none.

    Args:
        observation: observation with the names of the streets.
        town: the map.
        lane: the current lane.
        progress: the route, or None.
    """
    here = street_of(observation, town, lane)
    names = (street_of(observation, town, leg.lane) for leg in (progress.legs[1:] if progress is not None else ()))
    return next((name for name in names if name not in (here, StreetName.UNKNOWN)), None)


def streets_named(street_names: Sequence[int] | IntArray, name: StreetName) -> frozenset[int]:
    """Returns the indices of the streets with a name."""
    return _streets_named(tuple(np.asarray(street_names).tolist()), name.value)


@lru_cache(maxsize=1024)
def _streets_named(street_names: tuple[int, ...], name: int) -> frozenset[int]:
    return frozenset(k for k, value in enumerate(street_names) if value == name)
