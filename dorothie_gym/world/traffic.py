"""Background traffic: stock IDM vehicles that keep to the town's lanes and wait their turn at junctions."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np
from highway_env.utils import not_zero
from highway_env.vehicle.behavior import IDMVehicle
from highway_env.vehicle.kinematics import Vehicle

from dorothie_gym.world.crosswalks import Crosswalks
from dorothie_gym.world.junctions import CRITICAL_GAP, HARDEST_BRAKING, JunctionControl
from dorothie_gym.world.network.ahead import LEVEL
from dorothie_gym.world.network.network import LaneIndex
from dorothie_gym.world.network.road import TownRoad
from dorothie_gym.world.town.lights import LightColour
from dorothie_gym.world.town.model import Lane, Town

ROUTE_AHEAD = 70.0
"""Length of route that a vehicle keeps planned [m]."""

CURVE_ACCELERATION = 2.5
"""Lateral acceleration in curves [m/s^2]."""

CURVE_BRAKING = 2.0
"""Deceleration towards a curve [m/s^2]."""

STOP_BRAKING = 3.0
"""Deceleration towards a junction [m/s^2]."""

ASKING = 9.5
"""A vehicle asks for a junction this far before it would have to brake for it [m]."""

LINE_GAP = 1.0
"""Room that is left before a line [m]."""

ROOM_BEHIND = 9.0
"""Free lane that a vehicle wants behind a junction before it enters [m]."""

ROOM_SIGHT = 60.0
"""How far from the start of the lane behind a junction others count who may come to a stand on it [m]."""

ROOM_EACH = 10.0
"""Lane that a vehicle takes up in a queue: its length and the distance that stock's IDM keeps [m]."""

SLOW = 4.0
"""Slower than this a vehicle behind a junction may be in the way: a car that turns round does 3.5 [m/s]."""

CROSSING_SIGHT = 40.0
"""How far a car is seen that turns round [m]."""

CROSSING_MARGIN = 0.5
"""Room that is left beside it [m]."""

STUCK_SPEED = 0.3
"""Slower than this a vehicle counts as standing [m/s]."""


def curve_speed(lane: Lane) -> float:
    """Speed at which the tightest bend of a lane is driven, at most its limit [m/s]."""
    bend = np.abs(np.diff(lane.headings) / np.diff(lane.stations))
    tightest = float(np.convolve(bend, np.full(3, 1 / 3), mode="same").max()) if len(bend) >= 3 else float(bend.max())
    return min(lane.speed_limit, math.sqrt(CURVE_ACCELERATION / max(tightest, 1e-4)))


class CurveSpeeds:
    """Curve speeds of all lanes of a town [m/s]."""

    def __init__(self, town: Town) -> None:
        self._speeds = [curve_speed(lane) for lane in town.lanes]

    def __getitem__(self, lane: int) -> float:
        return self._speeds[lane]


class TrafficVehicle(IDMVehicle):
    """highway-env's IDM vehicle with a planned route, slow in curves, asking before it crosses a junction.

    Attributes:
        key: tells it apart; keys of bodies in the world are unique.
        height: of the road under it [m].
        crossing: the car while it turns round, across lanes where others do not expect it.
        aside: how far to the right of its lane's middle it keeps [m].
        standing: how long it has been standing [s].
        stuck: the same less the time for which the next light was not green [s].
    """

    # set by stock's initialisers, which carry no types
    speed: float
    target_lane_index: LaneIndex

    def __init__(
        self,
        road: TownRoad,
        lane_id: int,
        station: float,
        *,
        key: int,
        speed: float,
        desired_speed: float,
        junctions: JunctionControl,
        crosswalks: Crosswalks | None = None,
        curve_speeds: CurveSpeeds,
        rng: np.random.Generator,
    ) -> None:
        lane = road.network.town.lanes[lane_id]
        self.height = lane.height_at(station)
        self.key = key
        self._network, self._junctions, self._curve_speeds, self._rng = road.network, junctions, curve_speeds, rng
        self._crosswalks = crosswalks or Crosswalks(road.network.town)
        self._desired = desired_speed
        self._front: Any | None = None
        self._front_gap = math.inf
        self.crossing: Any | None = None
        self.aside = 0.0
        self.standing = self.stuck = 0.0
        self.crash_age = 0.0
        self._line_lane = -1  # at whose end the next junction begins
        super().__init__(
            road,
            lane.position(station),
            lane.heading_at(station),
            speed,
            target_lane_index=road.network.index_of(lane_id),
            target_speed=desired_speed,
            route=[road.network.index_of(lane_id)],
        )
        self._extend_route()

    def on_state_update(self) -> None:
        """Matches the vehicle to the closest lane of its height."""
        self.lane_index = self._network.get_closest_lane_index(self.position, self.heading, height=self.height)
        self.lane = self._network.get_lane(self.lane_index)
        self.height = self.lane.height_at(self.lane.local_coordinates(self.position)[0])

    def step(self, dt: float) -> None:
        """Moves on by `dt` [s] and counts how long it has been standing."""
        super().step(dt)
        if self.speed < STUCK_SPEED:
            self.standing += dt
            self.stuck += dt * self._may_go()
        else:
            self.standing = self.stuck = 0.0
        self.crash_age = self.crash_age + dt if self.crashed else 0.0

    def act(self, action: dict[str, float] | str | None = None) -> None:
        """Steers along its lane and keeps its distance: IDM, MOBIL, curves, junctions."""
        if self.crashed:
            Vehicle.act(self, {"acceleration": -max(self.speed, 0.0), "steering": 0.0})
            return
        self.follow_road()
        if self.enable_lane_change and not self.lane.town_lane.in_junction:
            before = self.target_lane_index
            self.change_lane_policy()
            if self.target_lane_index != before:
                self.route = [self.target_lane_index]
        self._extend_route()
        station = self._network.get_lane(self.target_lane_index).local_coordinates(self.position)[0]
        self.target_speed = self._speed_ahead(station)
        (self._front, self._front_gap), _ = self.road.neighbours(self, self.lane_index)
        acceleration = self.acceleration(self, self._front)
        if self.lane_index != self.target_lane_index:
            (self._front, self._front_gap), _ = self.road.neighbours(self, self.target_lane_index)
            acceleration = min(acceleration, self.acceleration(self, self._front))
        self._front = None
        crosswalk = self._crosswalk_gap(station)
        if crosswalk < math.inf:
            acceleration = min(acceleration, self._brake_to(crosswalk))
        acceleration = min(acceleration, self._junction_acceleration(station, waits=crosswalk < math.inf))
        if self.crossing is not None:
            acceleration = min(acceleration, self._crossing_acceleration(self.crossing))
        Vehicle.act(
            self,
            {
                "acceleration": min(max(acceleration, -self.ACC_MAX), self.ACC_MAX),
                "steering": self.steering_control(self.target_lane_index),
            },
        )

    def steering_control(self, target_lane_index: LaneIndex) -> float:
        """Stock's steering angle towards a lane [rad], computed on plain numbers, which is several times faster."""
        lane = self._network.get_lane(target_lane_index)
        station, lateral = lane.local_coordinates(self.position)
        lateral -= self.aside
        ahead = lane.heading_at(station + self.speed * self.TAU_PURSUIT)
        speed = not_zero(self.speed)
        back = math.asin(min(max(-self.KP_LATERAL * lateral / speed, -1.0), 1.0))
        wanted = ahead + min(max(back, -math.pi / 4), math.pi / 4)
        error = (wanted - self.heading + math.pi) % (2 * math.pi) - math.pi
        rate = self.LENGTH / 2 / speed * self.KP_HEADING * error
        slip = math.asin(min(max(rate, -1.0), 1.0))
        steering = math.atan(2 * math.tan(slip))
        return float(min(max(steering, -self.MAX_STEERING_ANGLE), self.MAX_STEERING_ANGLE))

    def acceleration(
        self, ego_vehicle: Any, front_vehicle: Any | None = None, rear_vehicle: Any | None = None
    ) -> float:
        """Stock's acceleration by the Intelligent Driver Model [m/s^2], computed on plain numbers."""
        if ego_vehicle is None or not isinstance(ego_vehicle, Vehicle):
            return 0.0
        target = getattr(ego_vehicle, "target_speed", 0.0)
        if ego_vehicle.lane is not None and ego_vehicle.lane.speed_limit is not None:
            target = min(max(target, 0.0), ego_vehicle.lane.speed_limit)
        speed = float(ego_vehicle.speed)
        acceleration = self.COMFORT_ACC_MAX * (1.0 - (max(speed, 0.0) / abs(not_zero(target))) ** self.DELTA)
        if front_vehicle is not None:
            gap = not_zero(ego_vehicle.lane_distance_to(front_vehicle))
            acceleration -= self.COMFORT_ACC_MAX * (self.desired_gap(ego_vehicle, front_vehicle) / gap) ** 2
        return float(acceleration)

    def desired_gap(self, ego_vehicle: Any, front_vehicle: Any = None, projected: bool = True) -> float:
        """Stock's distance that is wanted to a vehicle in front [m], computed on plain numbers."""
        speed, other = float(ego_vehicle.speed), float(front_vehicle.speed)
        closing = speed - (other * math.cos(front_vehicle.heading - ego_vehicle.heading) if projected else other)
        braking = 2.0 * math.sqrt(-self.COMFORT_ACC_MAX * self.COMFORT_ACC_MIN)
        return float(self.DISTANCE_WANTED + speed * self.TIME_WANTED + speed * closing / braking)

    def clip_actions(self) -> None:
        """As stock, but brakes stop a vehicle and do not reverse it."""
        super().clip_actions()
        if self.action["acceleration"] < 0.0 and self.speed <= 0.05:
            self.action["acceleration"] = 0.0
            self.speed = 0.0

    def lane_distance_to(self, other: Any, lane: Any = None) -> float:
        """Distance to another vehicle [m]; to the one in front, as found along the lanes."""
        if other is not None and other is self._front:
            return self._front_gap
        return float(super().lane_distance_to(other, lane))

    def follow_road(self) -> None:
        """Goes on to the next lane of the route at the end of the present one."""
        lane = self._network.get_lane(self.target_lane_index)
        if lane.local_coordinates(self.position)[0] > lane.length - 0.5 and len(self.route) > 1:
            self.route.pop(0)
            self.target_lane_index = self.route[0]

    @property
    def lane_id(self) -> int:
        """Lane that it is on."""
        return int(self.lane.town_lane.id)

    def _extend_route(self) -> None:
        length = sum(self._network.get_lane(index).length for index in self.route[1:])
        while length < ROUTE_AHEAD:
            onward = self._onward(self.route[-1])
            if not onward:
                return
            self.route.append(onward[int(self._rng.integers(len(onward)))] if len(onward) > 1 else onward[0])
            length += self._network.get_lane(self.route[-1]).length

    def _onward(self, lane: LaneIndex) -> list[LaneIndex]:
        """Ways on from a lane."""
        found: list[LaneIndex] = self._network.successors(lane)
        return found

    def _speed_ahead(self, station: float) -> float:
        """Desired speed, less where a bend ahead asks for it [m/s]."""
        speed, distance = self._desired, -station
        for index in self.route:
            lane = self._network.get_lane(index)
            bend = self._curve_speeds[lane.town_lane.id]
            speed = min(speed, math.sqrt(bend**2 + 2 * CURVE_BRAKING * max(distance, 0.0)))
            distance += lane.length
            if distance > ROUTE_AHEAD:
                break
        return max(speed, 0.5)

    def _crosswalk_gap(self, station: float) -> float:
        """Way to the next crosswalk with people on it, for whom the vehicle can still stop [m]; inf without."""
        distance = -station - self.LENGTH / 2  # from its front
        reach = self.speed**2 / (2 * STOP_BRAKING) + ASKING
        for index in self.route:
            if distance > reach:
                break
            lane = self._network.get_lane(index).town_lane
            for span in self._crosswalks.spans(lane.id):
                gap = distance + span.start - LINE_GAP
                if gap < -LINE_GAP or gap > reach or self.speed**2 > 2 * HARDEST_BRAKING * max(gap, 0.1):
                    continue  # it is on it already, or cannot stop any more: people do not step out before such
                if self._crosswalks.holds(span) is not None:
                    return float(gap)
            distance += lane.length
        return math.inf

    def _junction_acceleration(self, station: float, *, waits: bool) -> float:
        """Acceleration that stops the vehicle before a junction it may not enter [m/s^2]; inf where it may.

        Args:
            station: where it is on its lane [m].
            waits: whether it gives way to people; then it does not ask to be let into a junction yet.
        """
        now = self.road.time
        self._junctions.note(self.key, self.lane_id, self.speed, now)
        self._line_lane = -1
        distance = -station - self.LENGTH / 2  # from its front
        before = -1
        for k, index in enumerate(self.route):
            lane = self._network.get_lane(index).town_lane
            if lane.in_junction and k > 0:
                self._line_lane = before
                stopping = self.speed**2 / (2 * STOP_BRAKING) + ASKING
                if distance > max(stopping, CRITICAL_GAP * self.speed):
                    return math.inf
                self._junctions.announce(self.key, before, lane.id, now, distance=distance, speed=self.speed)
                if distance > stopping or (waits and distance > 0.0):
                    return math.inf
                wait = self._junctions.request(self.key, now, room=functools.partial(self._room_after, k))
                return math.inf if wait is None else self._brake_to(distance - LINE_GAP)
            distance += lane.length
            before = lane.id
        return math.inf

    def _may_go(self) -> bool:
        """Whether no light holds the vehicle up."""
        if self._line_lane < 0:
            return True
        return self._network.town.light(self._line_lane, self.road.time) in (None, LightColour.GREEN)

    def _crossing_acceleration(self, other: Any) -> float:
        """Acceleration that stops the vehicle before the way of one that turns round [m/s^2]; inf where it is clear."""
        dx, dy = other.position - self.position
        if dx * dx + dy * dy > CROSSING_SIGHT**2 or abs(other.height - self.height) > LEVEL:
            return math.inf
        gap, start = math.inf, 0.0
        own = self._network.get_lane(self.target_lane_index).local_coordinates(self.position)[0]
        for index in self.route[:3]:
            lane = self._network.get_lane(index)
            for place in other.sweep:
                station, lateral = lane.local_coordinates(place)
                if abs(lateral) < (self.WIDTH + other.WIDTH) / 2 + CROSSING_MARGIN and 0.0 <= station <= lane.length:
                    gap = min(gap, start + station - own)
            start += lane.length
        gap -= self.LENGTH / 2 + other.LENGTH / 2
        # whoever is in its way already had better go on
        return self._brake_to(gap) if -1.0 < gap < math.inf else math.inf

    def _brake_to(self, distance: float) -> float:
        if distance <= 0.3:
            return -self.ACC_MAX if self.speed > 0 else 0.0
        needed = self.speed**2 / (2 * distance)
        if needed < 0.6 * STOP_BRAKING:
            return math.inf if self.speed > 2.0 else 0.5 * min(distance, 1.0)
        return -needed

    def _room_after(self, k: int, others: int) -> bool:
        """Whether the lane behind the junction has room for this vehicle and so many others that will be there."""
        after = next((i for i in self.route[k:] if not self._network.get_lane(i).town_lane.in_junction), None)
        return after is None or room_at_start(self.road, self._network.get_lane(after), exclude=self, others=others)


def room_at_start(road: TownRoad, lane: Any, exclude: Any, others: int = 0) -> bool:
    """Whether a lane has room at its start for one more vehicle, should those on it come to a stand.

    Args:
        road: with all that may stand there.
        lane: the network's.
        exclude: who asks.
        others: who is about to come on the lane before it.

    Returns:
        Whether it fits behind the first that is slow, with all those between; and before the end of the lane, with all
        those who are on it, where a junction is there at which they may have to wait.
    """
    start = lane.position(0.0, 0.0)
    slow, moving = math.inf, []
    for other in [*road.vehicles, *road.objects]:
        if other is exclude:
            continue
        dx, dy = other.position[0] - start[0], other.position[1] - start[1]
        if dx * dx + dy * dy > ROOM_SIGHT**2:
            continue
        station, lateral = lane.local_coordinates(other.position)
        if not (abs(lateral) < lane.width / 2 and -1.0 < station < lane.length + other.LENGTH / 2):
            continue
        if other.speed > SLOW:
            moving.append(station)
        else:
            slow = min(slow, station - other.LENGTH / 2)
    before = others + sum(station < slow for station in moving)
    if slow < ROOM_BEHIND + ROOM_EACH * before:
        return False
    town = road.network.town
    if not before or not any(town.lanes[link.target].in_junction for link in town.successors(lane.town_lane.id)):
        return True
    return bool(lane.length > ROOM_EACH * (before + 0.5))
