"""What the car has to brake for: bodies on its path, people on crosswalks, junctions, traffic that it gives way to."""

from __future__ import annotations

import functools
import math

import numpy as np

from dorothie_gym.ontology import ObjectClass, PhysicalAction
from dorothie_gym.world.actors import Actors
from dorothie_gym.world.car.hazards import HEIGHT_MARGIN, Body, Hazard, bodies_ahead
from dorothie_gym.world.car.path import U_TURN_REACH
from dorothie_gym.world.car.planner import BEGUN, BRAKING, LocalPlanner
from dorothie_gym.world.car.vehicle import Car
from dorothie_gym.world.junctions import CRITICAL_GAP, HARDEST_BRAKING, JunctionControl, Wait
from dorothie_gym.world.network.network import TownNetwork
from dorothie_gym.world.network.road import TownRoad
from dorothie_gym.world.town.model import Array, Town
from dorothie_gym.world.traffic import room_at_start

CAR = 0
"""Key of the car among bodies and at junctions."""

TURN_ROUND_SPEED = 4.0
"""Whoever comes towards a car that turns round is taken to be at least this fast soon [m/s]."""

ASKING = 11.5
"""The car asks for a junction this far before it would have to brake for it [m]."""

UPSTREAM = 50.0
"""How far before a lane's start vehicles that come towards it are looked for [m]."""

STANDING = 0.1
"""Slower than this the car stands [m/s]."""


class Lookout:
    """Finds the hazard that limits the car's speed, and asks junctions for it."""

    def __init__(
        self, road: TownRoad, car: Car, planner: LocalPlanner, junctions: JunctionControl, actors: Actors
    ) -> None:
        self._road, self._car, self._planner, self._junctions, self._actors = road, car, planner, junctions, actors
        self._network: TownNetwork = road.network
        self._town: Town = road.network.town
        self._is_connector = np.array([lane.in_junction for lane in self._town.lanes])  # (lanes,)
        self._time = 0.0

    def look(self, bodies: list[Body], sight: float, time: float) -> Hazard | None:
        """The nearest thing on the path that the car has to brake for; the planner learns of roadblocks.

        Args:
            bodies: all that is perceived.
            sight: how far people on crosswalks are seen [m].
            time: simulated time [s].
        """
        self._time = time
        planner, car = self._planner, self._car
        block = bodies_ahead(
            planner.path, planner.s, [body for body in bodies if body.kind is ObjectClass.STATIC],
            length=car.LENGTH, width=car.WIDTH,
        )  # fmt: skip
        planner.roadblock = block.gap + car.LENGTH / 2 if block is not None else math.inf
        found = bodies_ahead(
            planner.path, planner.s, bodies, length=car.LENGTH, width=car.WIDTH, speed=float(car.speed)
        )
        blocked = found is not None and found.safe_speed() <= 0.0
        gap = self._gap_to_traffic(bodies, blocked=blocked)
        crosswalk = self._crosswalk_ahead(sight)
        junction = None if crosswalk is not None and crosswalk.safe_speed() <= 0.0 else self._junction_ahead()
        hazards = [h for h in (found, crosswalk, junction, gap) if h is not None]
        return min(hazards, key=Hazard.safe_speed, default=None)

    def _crosswalk_ahead(self, sight: float) -> Hazard | None:
        """The next crosswalk on the path with people on it, whom the car sees and for whom it can still stop."""
        path, planner, speed = self._planner.path, self._planner, float(self._car.speed)
        reach = speed**2 / (2 * BRAKING) + ASKING + self._car.LENGTH / 2
        first, last = path.index_at(planner.s), path.index_at(planner.s + reach)
        for k in range(first, last + 1):
            lane = int(path.lanes[k])
            if path.manoeuvre[k] or (k > first and path.lanes[k - 1] == lane):
                continue
            for span in self._actors.crosswalks.spans(lane):
                gap = float(path.s[k]) + span.start - float(path.stations[k]) - planner.s - self._car.LENGTH / 2
                if gap < 0.0 or gap > reach or speed**2 > 2 * HARDEST_BRAKING * max(gap, 0.1):
                    continue
                walker = self._actors.crosswalks.holds(span)
                if walker is not None and math.hypot(*(walker.position - self._car.position)) < sight:
                    return Hazard(kind=ObjectClass.PEDESTRIAN, gap=gap, key=walker.key, line=True)
        return None

    def _junction_ahead(self) -> Hazard | None:
        """The line before a junction that the car may not enter yet."""
        path, planner, speed = self._planner.path, self._planner, float(self._car.speed)
        if planner.held and speed < STANDING:
            return None  # asks for nothing that it does not use
        asking = speed**2 / (2 * BRAKING) + ASKING
        first = path.index_at(planner.s)
        lanes = path.lanes[
            first : path.index_at(planner.s + max(asking, CRITICAL_GAP * speed) + self._car.LENGTH / 2) + 1
        ]
        entries = np.flatnonzero((lanes[1:] != lanes[:-1]) & self._is_connector[lanes[1:]])
        if not len(entries):
            return None
        k = int(entries[0])
        entered = first + k + 1  # the first point of the path that is on the connector, not quite at its start
        line = float(path.s[entered] - path.stations[entered]) - planner.s - self._car.LENGTH / 2
        if line < -self._car.LENGTH / 2:
            return None  # over the line already
        lane, connector = int(lanes[k]), int(lanes[k + 1])
        self._junctions.announce(CAR, lane, connector, self._time, distance=line, speed=speed)
        if line > asking:
            return None
        wait = self._junctions.request(CAR, self._time, room=self._has_room)
        return None if wait is None else Hazard(kind=self._holder(wait, lane), gap=line, key=-2, line=True)

    def _has_room(self, others: int) -> bool:
        """Whether there is room behind the junction ahead for the car and so many others."""
        after = next((lane for lane in self._planner.lanes_ahead[1:] if not self._town.lanes[lane].in_junction), None)
        if after is None:
            return True
        return room_at_start(self._road, self._network.lane_of(after), exclude=self._car, others=others)

    def _holder(self, wait: Wait, lane: int) -> ObjectClass:
        """What holds the car before a junction, as a driver would say."""
        if wait is Wait.LIGHT:
            return ObjectClass.TRAFFIC_LIGHT
        if self._junctions.obeys_sign(lane) and wait not in (Wait.NO_ROOM, Wait.CLOSED):
            return ObjectClass.TRAFFIC_SIGN
        return ObjectClass.VEHICLES

    def _gap_to_traffic(self, bodies: list[Body], *, blocked: bool) -> Hazard | None:
        """Before a lane switch or U-turn: the place where it begins, while others are in its way.

        Args:
            bodies: all that is perceived.
            blocked: whether the car stands behind something: it may be waiting for the junction, which stays open then.
        """
        planner, path = self._planner, self._planner.path
        action, _ = planner.manoeuvre
        k = path.index_at(planner.s)
        turning = action is PhysicalAction.U_TURN
        if path.manoeuvre[k] and (planner.s > BEGUN or float(self._car.speed) > STANDING):
            if turning and not blocked:
                self._close_junction(path.points[k])
            return None
        if not path.manoeuvre[k:].any():
            return None
        start = k + int(np.argmax(path.manoeuvre[k:]))
        ahead = float(path.s[start]) - planner.s
        if ahead > 15.0:
            return None
        target = int(path.lanes[start])
        meeting, _ = self._town.lanes[target].project(np.asarray(path.points[start]))
        for body in bodies:
            if body.kind is not ObjectClass.VEHICLES:
                continue
            station = self._place_towards(target, body)
            if station is None:
                continue
            if turning:  # it takes the car's length of time to get round, in which who stands now may have come up
                behind = 8.0 + 5.0 * max(body.speed, TURN_ROUND_SPEED)
            else:
                behind = 8.0 + 3.0 * max(body.speed - float(self._car.speed), 0.0)
            if -behind < station - meeting < 9.0:
                return Hazard(kind=ObjectClass.VEHICLES, gap=max(ahead, 0.0) + 2.0, key=body.key)
        # asked for last: those who wait before the junction have to go first
        if turning and not blocked and not self._close_junction(path.points[start]):
            return Hazard(kind=ObjectClass.VEHICLES, gap=max(ahead, 0.0) + 2.0, key=-2)
        return None

    def _close_junction(self, start: Array) -> bool:
        """Keeps others out of junctions into which a U-turn reaches that begins at a place [m]; tells if it is free."""
        free = True
        for junction, (x, y), radius in self._mouths:
            if math.hypot(x - start[0], y - start[1]) < radius + U_TURN_REACH:
                free &= self._junctions.close(CAR, junction, self._time)
        return free

    @functools.cached_property
    def _mouths(self) -> list[tuple[int, tuple[float, float], float]]:
        """Junctions: id, a middle [m], and the radius in which their connectors lie [m]."""
        found = []
        for junction in self._town.junctions:
            points = np.concatenate([self._town.lanes[lane].points[:, :2] for lane in junction.connectors])
            middle = (points.min(axis=0) + points.max(axis=0)) / 2
            radius = float(np.hypot(*(points - middle).T).max())
            found.append((junction.id, (float(middle[0]), float(middle[1])), radius))
        return found

    def _place_towards(self, target: int, body: Body) -> float | None:
        """Where a body is along a lane, negative where it comes towards its start, or None if it does not [m]."""
        position = np.array([body.x, body.y])
        for lane_id, offset in self._upstream(target):
            lane = self._town.lanes[lane_id]
            station, lateral = lane.project(position)
            if abs(lateral) > 2.0 or abs(lane.height_at(station) - body.height) > HEIGHT_MARGIN:
                continue
            if math.cos(lane.heading_at(station) - body.heading) < 0.5:
                continue
            if not lane.in_junction or self._junctions.holds(body.key) == lane_id:
                return station + offset
        return None

    @functools.lru_cache(maxsize=256)  # noqa: B019 - a world lives as long as its session
    def _upstream(self, target: int) -> tuple[tuple[int, float], ...]:
        """A lane, and those that lead to it within sight of a turning car, with where they begin [m]."""
        found = [(target, 0.0)]
        for lane, offset in found:
            for before in self._town.predecessors(lane):
                start = offset - self._town.lanes[before].length
                if offset > -UPSTREAM and all(before != known for known, _ in found):
                    found.append((before, start))
        return tuple(found)
