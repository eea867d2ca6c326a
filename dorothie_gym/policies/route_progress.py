"""A way to a place while it is being driven: how far it is, what comes next, and when it has been left."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from dorothie_gym.dialogue import Direction
from dorothie_gym.maps import Town
from dorothie_gym.maps.model import Exit, LinkType, wrap_degrees
from dorothie_gym.maps.routing import Entry, Leg, Place, Route, router
from dorothie_gym.maps.traffic_lights import LightColour
from dorothie_gym.ontology import StreetName
from dorothie_gym.policies.observation_parser import street_of

PASSED = 3.0
"""A goal that lies further behind than this has been passed [m]."""

ASTRAY = 3
"""Who has been off the way for so many decisions has left it."""

SWITCH_ROOM = 16.0
"""Least room for a lane switch [m]."""

END_ROOM = 6.0
"""Who is nearer to the end of a lane than this waits there and does not turn round any more [m]."""

SAME_WAY = 25.0
"""An exit of the own lane this close in angle is taken instead of that of a lane beside [degrees]."""

RIGHT_BEHIND = 70.0
"""There may be no room to change lanes between a junction and a goal that is no further behind it [m]."""

LATE = 18.0
"""A lane change or U-turn that is this overdue will not come any more [m]."""

BRAKING = 3.0
"""Deceleration of the car's Stop [m/s^2]."""

U_TURN_SPEED_SQUARED = 12.0
"""Square of the speed at which the car turns round [m^2/s^2]."""

LIGHT_SIGHT = 60.0
"""A traffic light no farther than this is what holds up a car that stands before it [m]."""

LAG = 0.56
"""Time that the brakes seem to take until they bite, measured at 3 to 11 m/s [s]."""

NEAR_MISS = 150.0
"""A car that leaves the route within this distance of the goal may have missed it [m]."""

WAY_ROUND = 60.0
"""A new route that is longer by more than this shows that the goal was missed [m]."""

SAME_ROADBLOCK = 10.0
"""Roadblocks closer together than this on a lane count as one [m]; cells of the router are about 10 m long."""

CELL_BEHIND = 8.0
"""Distance from a roadblock to a place in the following cell of the router [m]."""

CANONICAL = {Direction.LEFT: 90.0, Direction.RIGHT: -90.0, Direction.STRAIGHT: 0.0, Direction.BACK: 180.0}
"""The angle that a direction means at a junction like a cross [degrees, positive left]."""

_DIRECTIONS = {
    LinkType.LEFT: Direction.LEFT,
    LinkType.RIGHT: Direction.RIGHT,
    LinkType.STRAIGHT: Direction.STRAIGHT,
    LinkType.U_TURN: Direction.BACK,
}


@dataclass(frozen=True, kw_only=True)
class Choice:
    """The next junction where one has to choose: the lane that leads there, how far its end is [m], and the exits."""

    lane: int
    distance: float
    exits: tuple[Exit, ...]

    @property
    def junction(self) -> int:
        """Id of the junction."""
        return max(way.junction_id for way in self.exits)


@dataclass(frozen=True, kw_only=True)
class RouteJunction:
    """A junction of a journey: the lane it is entered from, the exit to take, and how far it is [m]."""

    lane: int
    exit: Exit
    distance: float

    @property
    def direction(self) -> Direction:
        """Which way the exit leads."""
        return direction_of(self.exit)


def stopping_distance(speed: float) -> float:
    """How far the car goes on after Stop at a speed [m/s] [m]."""
    return LAG * speed + speed**2 / (2 * BRAKING)


def direction_of(way: Exit) -> Direction:
    """Which way an exit leads, as people say it."""
    return _DIRECTIONS[way.type]


def is_choice(town: Town, lane: int) -> bool:
    """Whether a lane ends at a junction with more than one way on."""
    exits = town.exits(lane)
    return len(exits) > 1 and any(way.junction_id >= 0 for way in exits)


def default_successor(town: Town, lane: int) -> int | None:
    """The lane that a car goes on in without being asked; None at a junction with a choice and where the map ends."""
    exits = town.exits(lane)
    if not exits or is_choice(town, lane):
        return None
    return min(exits, key=lambda way: (abs(way.angle), way.connector)).connector


def default_lane_distance(town: Town, here: Place, place: Place, distance: float) -> float | None:
    """Returns how far a place is along the lanes that a car takes by default [m]; None if it is not on them so near.

    Args:
        town: the map.
        here: where the car is.
        place: that is looked for.
        distance: so far it is looked for [m].
    """
    lane, station = here
    ahead = -station
    for passed in lanes_ahead(town, lane, station, distance):
        if passed == place[0]:
            return ahead + place[1]
        ahead += town.lanes[passed].length
    return None


def lanes_ahead(town: Town, lane: int, station: float, distance: float) -> tuple[int, ...]:
    """The lane itself and those that follow by default, as far as `distance` [m]."""
    found, ahead = [lane], town.lanes[lane].length - station
    following = default_successor(town, lane)
    while ahead < distance and following is not None and following not in found:
        found.append(following)
        ahead += town.lanes[following].length
        following = default_successor(town, following)
    return tuple(found)


def light_ahead(town: Town, lane: int, station: float, time: float) -> LightColour | None:
    """What the next traffic light on the way that the car takes by default shows; None if none is in sight."""
    ahead = -station
    for passed in lanes_ahead(town, lane, station, LIGHT_SIGHT):
        ahead += town.lanes[passed].length
        if ahead > LIGHT_SIGHT:
            return None
        colour = town.light(passed, time)
        if colour is not None:
            return colour
    return None


def next_choice(town: Town, lane: int, station: float) -> Choice | None:
    """The next junction with a choice on the way that the car takes by default; None if there is none."""
    seen, ahead = {lane}, town.lanes[lane].length - station
    while not is_choice(town, lane):
        following = default_successor(town, lane)
        if following is None or following in seen:
            return None
        lane = following
        seen.add(lane)
        ahead += town.lanes[lane].length
    return Choice(lane=lane, distance=max(ahead, 0.0), exits=town.exits(lane))


def lanes_beside(town: Town, lane: int) -> tuple[int, ...]:
    """Lanes of the same direction beside a lane, the nearest first."""
    found: list[int] = []
    for side in (LinkType.LANE_CHANGE_LEFT, LinkType.LANE_CHANGE_RIGHT):
        beside = town.neighbour(lane, side)
        while beside is not None and beside not in found and beside != lane:
            found.append(beside)
            beside = town.neighbour(beside, side)
    return tuple(found)


def find_exit(
    town: Town, choice: Choice, direction: Direction | None, streets: frozenset[int] = frozenset()
) -> Exit | None:
    """The exit that is meant by a direction and perhaps a street; exits of lanes beside count where the own have none.

    Args:
        town: the map.
        choice: the junction.
        direction: which way; None if only a street was named.
        streets: indices of the streets that bear the name; empty if none was named.
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
    """A route to a goal and how far it has been driven.

    Attributes:
        goal: lane and station of the goal.
        blocked: places that cannot be passed.
        route: legs of the way; None if there is none.
        leg: the leg that the car is on.
        astray: for how many decisions the car has not been on the route.
    """

    goal: Place
    blocked: tuple[Place, ...] = ()
    route: Route | None = None
    leg: int = 0
    astray: int = 0

    @classmethod
    def plan(cls, town: Town, start: Place, goal: Place, blocked: tuple[Place, ...] = ()) -> RouteProgress:
        """Plans a way; where the blocked places leave none, one that ignores them."""
        route = router(town).route(start, goal, blocked)
        if route is None and blocked:
            route = router(town).route(start, goal)
        return cls(goal=goal, blocked=blocked, route=route)

    def replanned(self, town: Town, start: Place, blocked: tuple[Place, ...] | None = None) -> RouteProgress:
        """A new way from `start` to the same goal."""
        return RouteProgress.plan(town, start, self.goal, self.blocked if blocked is None else blocked)

    @property
    def legs(self) -> tuple[Leg, ...]:
        """What is left of the route, the present leg first."""
        return self.route.legs[self.leg :] if self.route is not None else ()

    def followed(self, town: Town, lane: int, station: float) -> RouteProgress:
        """The same with the present leg brought up to where the car is; `astray` counts up if it is nowhere on it."""
        for ahead, leg in enumerate(self.legs):
            if leg.lane == lane and (ahead or not self._overdue(town, station)):
                return replace(self, leg=self.leg + ahead, astray=0)
        return replace(self, astray=self.astray + 1)

    def lost(self, station: float) -> bool:
        """Whether the way has been left, or its goal passed, so that a new one is wanted."""
        return self.astray >= ASTRAY or self.left(station) < -PASSED

    def _overdue(self, town: Town, station: float) -> bool:
        legs = self.legs
        if len(legs) == 1:
            return station > self.goal[1] + PASSED
        if legs[1].entry is Entry.FOLLOW:
            return False
        room = town.lanes[legs[0].lane].length - station
        if legs[1].entry is Entry.U_TURN:
            return station > legs[0].end + (LATE if room > END_ROOM else 0.0)
        return room < SWITCH_ROOM or station > legs[0].end + LATE

    def left(self, station: float) -> float:
        """How far the goal is along the route [m]; negative when it has just been passed."""
        legs = self.legs
        if not legs:
            return math.inf
        if len(legs) == 1:
            return self.goal[1] - station
        return max(legs[0].end - station, 0.0) + sum(leg.end - leg.start for leg in legs[1:])

    def way_in(self) -> Place | None:
        """Where the last lane change before the goal begins; None if the goal's own lane is driven up to it."""
        for before, leg in reversed(list(itertools.pairwise(self.route.legs if self.route is not None else ()))):
            if leg.entry in (Entry.CHANGE_LEFT, Entry.CHANGE_RIGHT):
                return before.lane, (before.start + before.end) / 2
        return None

    def next_crossing(self, town: Town, station: float) -> RouteJunction | None:
        """The next junction with a choice on the route; None if the rest needs no choice."""
        return next(self.crossings(town, station), None)

    def crossings(self, town: Town, station: float) -> Iterator[RouteJunction]:
        """Yields the junctions with a choice on the route, the next first."""
        legs = self.legs
        distance = 0.0
        for k, leg in enumerate(legs[:-1]):
            distance += max(leg.end - (station if k == 0 else leg.start), 0.0)
            following = legs[k + 1]
            if following.entry is Entry.FOLLOW and is_choice(town, leg.lane):
                way = next((way for way in town.exits(leg.lane) if way.connector == following.lane), None)
                if way is not None:
                    yield RouteJunction(lane=leg.lane, exit=way, distance=distance)

    def next_manoeuvre(self, station: float) -> tuple[Entry, float] | None:
        """The first lane change or U-turn on the route before the next junction, and how far it is [m]."""
        distance = 0.0
        for k, leg in enumerate(self.legs):
            if k and leg.entry is not Entry.FOLLOW:
                return leg.entry, distance
            distance += max(leg.end - (station if k == 0 else leg.start), 0.0)
        return None

    def turns_round_on(self, lane: int) -> bool:
        """Whether the next U-turn of the route begins on a lane."""
        for before, leg in itertools.pairwise(self.legs):
            if leg.entry is Entry.U_TURN:
                return before.lane == lane
        return False

    def run_up(self) -> tuple[float, int] | None:
        """How far the goal is behind the next U-turn [m], and how many lane changes lie between; None without one."""
        for k, leg in enumerate(self.legs):
            if k and leg.entry is Entry.U_TURN:
                after = self.legs[k:]
                changes = sum(one.entry in (Entry.CHANGE_LEFT, Entry.CHANGE_RIGHT) for one in after)
                return sum(one.end - one.start for one in after), changes
        return None

    def needs_switch(self, town: Town, lane: int, station: float, crossing: RouteJunction) -> bool:
        """Whether a lane change before a junction has to be made on its own, not on the way into the turn.

        By default the car would go on to another junction, run into what blocks its lane, or cross the junction in its
        own lane and come out beside a goal that is right behind it.
        """
        choice = next_choice(town, lane, station)
        obstructed = any(place[0] == lane and place[1] > station for place in self.blocked)
        if obstructed or choice is None or choice.junction != crossing.exit.junction_id:
            return True
        if self.left(station) - crossing.distance > RIGHT_BEHIND:
            return False
        wanted = crossing.exit
        return any(
            way.connector != wanted.connector and abs(wrap_degrees(way.angle - wanted.angle)) <= SAME_WAY
            for way in choice.exits
        )

    def turns_round_first(self, town: Town, station: float) -> bool:
        """Whether the route turns round before its next junction with a choice."""
        return self.changes_before(self.next_crossing(town, station))

    def changes_before(self, crossing: RouteJunction | None) -> bool:
        """Whether the route turns round before the given junction (or before the goal, where None)."""
        for leg in self.legs[1:]:
            if leg.entry is Entry.U_TURN:
                return True
            if crossing is not None and leg.lane == crossing.exit.connector:
                return False
        return False


@dataclass(frozen=True, kw_only=True)
class RouteState:
    """Route of an agent, and what it knows about places that the planner must not use.

    Attributes:
        progress: route to the goal and the progress on it; None without a place to go to.
        blocked: places behind roadblocks.
        avoided: places excluded because the car missed the goal after passing them.
        misses: number of times that the car has driven past the goal.
    """

    progress: RouteProgress | None = None
    blocked: tuple[Place, ...] = ()
    avoided: tuple[Place, ...] = ()
    misses: int = 0

    @property
    def closed(self) -> tuple[Place, ...]:
        """Places that the planner must not use."""
        return self.blocked + self.avoided

    def with_progress(self, progress: RouteProgress | None) -> RouteState:
        """Sets the route, or gives it up (None)."""
        return replace(self, progress=progress)

    def for_new_goal(self) -> RouteState:
        """Resets the misses of the previous goal; roadblocks stay known."""
        return replace(self, misses=0, avoided=())

    def replanned(self, town: Town, start: Place) -> RouteState:
        """Plans another route to the same goal."""
        assert self.progress is not None
        return replace(self, progress=self.progress.replanned(town, start, self.closed))

    def has_missed(self, before: float, station: float) -> bool:
        """Whether the goal, `before` metres ahead on the former route, now needs a long way round."""
        assert self.progress is not None
        return before < NEAR_MISS and self.progress.left(station) > before + WAY_ROUND

    def after_miss(self, town: Town, start: Place, former: RouteProgress) -> RouteState:
        """Counts a drive past the goal; from the second one on, avoids the last lane change of the former route."""
        counted = replace(self, misses=self.misses + 1)
        way_in = former.way_in()
        return counted.avoiding(town, start, way_in) if counted.misses > 1 and way_in is not None else counted

    def avoiding(self, town: Town, start: Place, place: Place) -> RouteState:
        """Excludes a place and plans another route."""
        return replace(self, avoided=(*self.avoided, place)).replanned(town, start)

    def knows_roadblock(self, place: Place) -> bool:
        """Whether a roadblock at a place is one of those known."""
        return any(lane == place[0] and abs(station - place[1]) < SAME_ROADBLOCK for lane, station in self.blocked)

    def with_roadblock(self, town: Town, place: Place) -> RouteState:
        """Adds a roadblock: its cell and the one behind it, because the car's own cell counts as free."""
        behind = place[0], min(place[1] + CELL_BEHIND, town.lanes[place[0]].length)
        return replace(self, blocked=(*self.blocked, place, behind))


def first_new_street(
    observation: Mapping[str, Any], town: Town, lane: int, journey: RouteProgress | None
) -> StreetName | None:
    """The first street with a name on a journey that is another than that of the present lane; None if there is none.

    Args:
        observation: with the names of the streets.
        town: the map.
        lane: the present lane.
        journey: None for no way at all.
    """
    here = street_of(observation, town, lane)
    names = (street_of(observation, town, leg.lane) for leg in (journey.legs[1:] if journey is not None else ()))
    return next((name for name in names if name not in (here, StreetName.UNKNOWN)), None)


def streets_named(street_names: Iterable[int], name: StreetName) -> frozenset[int]:
    """Indices of the streets that bear a name."""
    return frozenset(k for k, value in enumerate(street_names) if int(value) == name.value)
