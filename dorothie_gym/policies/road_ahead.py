"""Road ahead of the car, as directions refer to it: junctions, lights and places in the order in which they are met."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.maps.model import Exit
from dorothie_gym.maps.town import Town
from dorothie_gym.policies.lane_bounds import may_be_near
from dorothie_gym.policies.route_progress import Choice, direction_of, find_exit, lanes_beside
from dorothie_gym.policies.route_tables import entry_station
from dorothie_gym.policies.town_tables import kept_with_town
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.portable_math import wrap_degrees

if TYPE_CHECKING:
    from dorothie_gym.maps.routing import Place

HORIZON: Final = 900.0
"""Distance within which directions are looked for on the road ahead [m]."""

BESIDE_ROAD: Final = 40.0
"""Largest distance from the lane of a place beside the road [m]."""

CORNER: Final = 8.0
"""Distance beyond the end of a lane, at a corner, up to which a place is still beside it [m]."""


class Crossing(NamedTuple):
    """Junction on the road ahead.

    Attributes:
        lane: lane before it.
        distance: distance to the end of that lane [m].
        junction: id of the junction.
        lights: whether it has traffic lights for the car.
        exits: exits of that lane and of the lanes beside it.
    """

    lane: int
    distance: float
    junction: int
    lights: bool
    exits: tuple[Exit, ...]

    def leads(self, direction: Direction) -> bool:
        """Returns whether there is an exit in a direction."""
        return any(direction_of(way) is direction for way in self.exits)


class Stretch(NamedTuple):
    """Lane of the road ahead, and the distance to its beginning [m]; negative for the lane of the car."""

    lane: int
    begin: float


@dataclass(frozen=True)
class RoadAhead:
    """Road that the car takes if it turns nowhere, or that its route takes.

    Attributes:
        town: the map.
        stretches: lanes in order, junctions included.
        crossings: junctions with several exits, in order.
        end: distance to the end of the last lane [m].
    """

    town: Town
    stretches: tuple[Stretch, ...]
    crossings: tuple[Crossing, ...]
    end: float

    @classmethod
    def straight_on(cls, town: Town, here: Place, horizon: float = HORIZON) -> RoadAhead:
        """Returns the road straight across all junctions, as far as there is a way straight on.

        Args:
            town: the map.
            here: place of the car.
            horizon: length of the road [m].
        """
        return cls._along(town, here, tuple(_straight_lanes(town, here[0], horizon + here[1])))

    @classmethod
    def by_route(cls, town: Town, here: Place, lanes: tuple[int, ...]) -> RoadAhead:
        """Returns the road along the lanes of a route, which begins with the lane of the car."""
        return cls._along(town, here, lanes)

    def leads_onto(self, crossing: Crossing, streets: frozenset[int]) -> bool:
        """Returns whether a junction leads from another street onto one of some streets, given by their indices."""
        here = self.town.lanes[crossing.lane].street
        return here not in streets and any(self.town.lanes[way.lane].street in streets for way in crossing.exits)

    @classmethod
    def _along(cls, town: Town, here: Place, lanes: tuple[int, ...]) -> RoadAhead:
        stretches: list[Stretch] = []
        crossings: list[Crossing] = []
        begin = -here[1]
        for place, lane in enumerate(lanes):
            changes = place > 0 and lane in lanes_beside(town, lanes[place - 1])
            if changes and town.merge(lanes[place - 1]) is not None:
                begin -= entry_station(town, lanes[place - 1], lane)
            elif changes:  # the stations of lanes side by side are much the same
                begin -= town.lanes[lanes[place - 1]].length
            stretches.append(Stretch(lane, begin))
            begin += town.lanes[lane].length
            following = lanes[place + 1] if place + 1 < len(lanes) else None
            if following is None or following not in lanes_beside(town, lane):
                crossings += _crossing_at(town, lane, begin)
        return cls(town, tuple(stretches), tuple(crossings), begin)

    def distance_to(self, x: float, y: float) -> float | None:
        """Returns the distance at which the car passes a point beside the road [m]; None if it does not pass it.

        Args:
            x: position [m].
            y: position [m].
        """
        best, found = math.inf, None
        for stretch in self.stretches:
            lane = self.town.lanes[stretch.lane]
            if lane.in_junction or not may_be_near(self.town, stretch.lane, x, y, BESIDE_ROAD):
                continue
            station, _ = lane.project(np.array([x, y]))
            foot, heading = lane.position(station), lane.heading_at(station)
            off = pm.hypot(foot[0] - x, foot[1] - y)
            beyond = abs((x - foot[0]) * pm.cos(heading) + (y - foot[1]) * pm.sin(heading))
            if beyond <= CORNER and off <= BESIDE_ROAD and off < best - 1.0:
                best, found = off, stretch.begin + station
        return found

    def place_at(self, distance: float) -> Place:
        """Returns the place at a distance ahead [m]; the end of the road beyond it."""
        for stretch in self.stretches:
            length = self.town.lanes[stretch.lane].length
            if distance <= stretch.begin + length:
                return stretch.lane, max(distance - stretch.begin, 0.0)
        last = self.stretches[-1].lane
        return last, self.town.lanes[last].length

    def distance_of(self, place: Place) -> float | None:
        """Returns the distance to a place on the road or on a lane beside it [m]; None for other places."""
        lane, station = place
        for stretch in self.stretches:
            if stretch.lane == lane or lane in lanes_beside(self.town, stretch.lane):
                return stretch.begin + station
        return None

    def junction_lanes(self, crossing: Crossing) -> float:
        """Returns the distance to the first place behind a junction [m]."""
        behind = False
        for stretch in self.stretches:
            if behind and not self.town.lanes[stretch.lane].in_junction:
                return stretch.begin
            behind = behind or stretch.lane == crossing.lane
        return crossing.distance


def _straight_lanes(town: Town, lane: int, reach: float) -> Iterator[int]:
    seen: set[int] = set()
    while lane not in seen and reach > 0.0:
        yield lane
        seen.add(lane)
        reach -= town.lanes[lane].length
        way = _onward(town, lane)
        if way is None:
            side = town.merge(lane)
            beside = None if side is None else town.neighbour(lane, side)
            if beside is None:
                return
            lane = beside
            continue
        beside = _turned_from(town, lane)
        if beside is not None:
            yield beside
        lane = way.connector


@kept_with_town
def _onward(town: Town, lane: int) -> Exit | None:
    """Returns how a road goes on behind a lane: straight across a junction, or as the only way leads."""
    exits = town.exits(lane)
    if not exits:
        return None
    straight = find_exit(town, Choice(lane=lane, distance=0.0, exits=exits), Direction.STRAIGHT)
    if straight is not None:
        return straight
    return exits[0] if len(exits) == 1 and not _parts(town, lane) else None


@kept_with_town
def _turned_from(town: Town, lane: int) -> int | None:
    """Returns the lane beside a lane from which the road goes on; None where it does so from the lane itself."""
    way = _onward(town, lane)
    if way in town.exits(lane):
        return None
    return next((other for other in lanes_beside(town, lane) if way in town.exits(other)), None)


@kept_with_town
def _parts(town: Town, lane: int) -> bool:
    """Returns whether the lanes beside a lane lead to another road behind the junction than the lane itself."""
    roads = {town.lanes[way.lane].road_id for one in (lane, *lanes_beside(town, lane)) for way in town.exits(one)}
    return len(roads) > 1


def _crossing_at(town: Town, lane: int, distance: float) -> tuple[Crossing, ...]:
    return tuple(crossing._replace(distance=max(distance, 0.0)) for crossing in _crossing_behind(town, lane))


@kept_with_town
def _crossing_behind(town: Town, lane: int) -> tuple[Crossing, ...]:
    """Returns the junction at the end of a lane, at the distance 0; none if it has one way only."""
    exits = tuple(way for one in (lane, *lanes_beside(town, lane)) for way in town.exits(one))
    junction = max((way.junction_id for way in exits), default=-1)
    if junction < 0 or town.lanes[lane].in_junction or not _parts(town, lane):
        return ()
    lights = town.light(lane, 0.0) is not None
    return (Crossing(lane, 0.0, junction, lights, exits),)


def turned(town: Town, before: int, after: Place) -> float:
    """Returns by how much the direction has changed between the end of a lane and a place [degrees], positive left."""
    lane, station = after
    change = town.lanes[before].headings[-1] - town.lanes[lane].heading_at(station)
    return wrap_degrees(math.degrees(float(change)))
