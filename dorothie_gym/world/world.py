"""The world of a session: a town, the car, what drives, walks and stands there, weather and faults."""

from __future__ import annotations

import functools
import math

import numpy as np

from dorothie_gym.ontology import ObjectClass, PhysicalAction, Sensor, WeatherParameter
from dorothie_gym.world.actors import Actors
from dorothie_gym.world.car.driver import Driver
from dorothie_gym.world.car.hazards import HEIGHT_MARGIN, Body, Hazard, bodies_ahead
from dorothie_gym.world.car.path import U_TURN_REACH
from dorothie_gym.world.car.planner import BEGUN, BRAKING, LocalPlanner
from dorothie_gym.world.car.vehicle import Car
from dorothie_gym.world.config import FRAME_COLUMNS, FRAME_RATE, WorldConfig
from dorothie_gym.world.junctions import CRITICAL_GAP, HARDEST_BRAKING, JunctionControl, Wait
from dorothie_gym.world.localizer import FIX_EVERY, Localizer
from dorothie_gym.world.network.network import TownNetwork
from dorothie_gym.world.network.road import TownRoad
from dorothie_gym.world.perception import Perception
from dorothie_gym.world.reports import Pose, Reports, WorldEvent, WorldEventKind
from dorothie_gym.world.town.model import Array, Town
from dorothie_gym.world.traffic import room_at_start
from dorothie_gym.world.visibility import CLEAR_SIGHT, Visibility
from dorothie_gym.world.weather import Weather
from dorothie_gym.world.wind import Wind

CAR = 0
"""Key of the car among bodies and at junctions."""

FAULT_SECONDS = 30.0
"""A sensor fault ends by itself after this long [s] (design)."""

CLARITY = {Sensor.BLUR: 0.25, Sensor.VIEW: 0.0}
"""Share of the signal that a fault of the view leaves: blur halves the sight."""

TURN_ROUND_SPEED = 4.0
"""Whoever comes towards a car that turns round is taken to be at least this fast soon [m/s]."""

ASKING = 11.5
"""The car asks for a junction this far before it would have to brake for it [m]."""

UPSTREAM = 50.0
"""How far before a lane's start vehicles that come towards it are looked for [m]."""

EXTEND_EVERY = 15
"""The path is lengthened this often [frames]."""

HARD = 3.5
"""Braking harder than this for something ahead is a hazard stop [m/s^2]."""

STANDING = 0.1
"""Slower than this the car stands [m/s]."""


class World:
    """A town in which a car drives among others.

    Attributes:
        town: the map.
        car: the car.
        planner: its local planner.
        driver: what drives it.
        actors: traffic, pedestrians and props.
        weather: weather and light.
        wind: where the wind blows, and its gusts.
        lights: whether the car's head lights are on.
        faults: sensors that are faulty, and the frame at which each works again.
        hazard: what the car is braking or standing for, or None.
        frame: physics frames since the start.
        frames: trajectory of the last call of `step` (n, 9), see `FRAME_COLUMNS`.
        collisions: those of the car's own making.
        reports: what has happened to the car, and how often it broke which rule.
    """

    def __init__(
        self, town: Town, config: WorldConfig, *, seed: np.random.SeedSequence, departure: tuple[int, float],
        network: TownNetwork | None = None,
    ) -> None:  # fmt: skip
        """Builds the world.

        Args:
            town: the map.
            config: settings.
            seed: source of the generators of traffic, pedestrians, localisation, perception and wind, one each.
            departure: lane and distance along it [m] where the car stands.
            network: the town's network, if there is one already: it is never changed.
        """
        traffic_seed, walk_seed, locate_seed, perceive_seed, wind_seed = seed.spawn(5)
        self.town, self.config = town, config
        self.network = network or TownNetwork(town)
        lane, station = departure
        start = town.lanes[lane]
        self.road = TownRoad(self.network, np_random=np.random.default_rng(traffic_seed))
        self.car = Car(self.road, start.position(station), start.heading_at(station), start.height_at(station))
        self.road.vehicles.append(self.car)
        self.planner = LocalPlanner(town, lane, station)
        self.driver = Driver(self.planner, length=self.car.LENGTH, cruise=config.cruise_speed)
        self.junctions = JunctionControl(town)
        self._is_connector = np.array([lane.in_junction for lane in town.lanes])  # (lanes,)
        self.weather = Weather()
        self.wind = Wind(np.random.default_rng(wind_seed))
        self._perception = Perception(np.random.default_rng(perceive_seed))
        self.actors = Actors(
            self.road, self.junctions, self.car,
            traffic_rng=np.random.default_rng(traffic_seed), walk_rng=np.random.default_rng(walk_seed),
        )  # fmt: skip
        self.actors.populate(vehicles=config.vehicles, pedestrians=config.pedestrians)
        self.localizer = Localizer(
            float(self.car.position[0]), float(self.car.position[1]), float(self.car.heading),
            np.random.default_rng(locate_seed),
        )  # fmt: skip
        self.lights = False
        self.faults: dict[Sensor, int] = {}
        self.hazard: Hazard | None = None
        self._hazard_since = 0
        self._hazard_seen = 0
        self._stopped_until = 0
        self.frame = 0
        self.frames: Array = np.zeros((0, len(FRAME_COLUMNS)))
        self.collisions = 0
        self.reports = Reports(self.network, self._pose(), self.car.LENGTH)

    # --- time -------------------------------------------------------------------------------------------------------

    @property
    def time(self) -> float:
        """Simulated seconds since the start."""
        return self.frame / FRAME_RATE

    def step(self, frames: int) -> list[WorldEvent]:
        """Lets the world run for a number of physics frames; returns what happened to the car."""
        rows = np.empty((frames, len(FRAME_COLUMNS)))
        poses: list[Pose] = []
        before = (float(self.car.position[0]), float(self.car.position[1]), float(self.car.heading))
        for k in range(frames):
            if k % EXTEND_EVERY == 0:
                self.planner.extend(float(self.car.speed))
            self._substep()
            control = self.car.control
            rows[k] = (
                self.frame, self.car.position[0], self.car.position[1], self.car.heading, self.car.speed,
                control.throttle, control.steer, control.brake, self.planner.lane,
            )  # fmt: skip
            poses.append(self._pose())
        self.frames = rows
        self._localize(np.vstack((before, rows[:, 1:4])))
        self.actors.tidy()
        self.faults = {sensor: end for sensor, end in self.faults.items() if end > self.frame}
        return self.reports.close(poses, self.frame)

    def _substep(self) -> None:
        dt = 1.0 / FRAME_RATE
        car = self.car
        self.junctions.note(CAR, self.planner.lane, float(car.speed), self.time)
        hazard = self._look_ahead()
        friction = self.weather.friction
        car.friction, self.driver.sight = friction, self.sight
        car.drift = self.wind.drift(
            self.weather.above_clear(WeatherParameter.WIND_INTENSITY), self.time,
            heading=float(car.heading), speed=float(car.speed),
        )  # fmt: skip
        control = self.driver.control(
            float(car.position[0]), float(car.position[1]), float(car.heading), float(car.speed), hazard, dt, friction
        )
        if self.frame < self._stopped_until:
            control = type(control)(throttle=0.0, steer=control.steer, brake=1.0)
        self._note_hazard(hazard, control.brake)
        car.height, car.sweep = self.planner.height, self.planner.sweep()
        car.drive(control, dt)
        self.actors.act(dt)
        speed_before = float(car.speed)
        self.road.step(dt)
        self.frame += 1
        if car.crashed:
            self._collide(speed_before)

    def _localize(self, track: Array) -> None:
        """Takes in odometry of every frame, and a GPS fix of every so many.

        Args:
            track: poses (x, y, heading) before the frames and after each (frames + 1, 3).
        """
        began, first = 0, self.frame - len(track) + 1
        for k in range(1, len(track)):
            is_fix = (first + k) % FIX_EVERY == 0
            if is_fix or k == len(track) - 1:
                self.localizer.predict(track[began : k + 1], 1.0 / FRAME_RATE)
                began = k
            if is_fix and not self._is_faulty(Sensor.GPS, first + k):
                self.localizer.correct(float(track[k, 0]), float(track[k, 1]))

    # --- perception -------------------------------------------------------------------------------------------------

    @property
    def visibility(self) -> Visibility:
        """How well the car sees now, by weather, light and faults of the view."""
        clarity = min((CLARITY[sensor] for sensor in CLARITY if self._is_faulty(sensor, self.frame)), default=1.0)
        return self.weather.visibility(lights=self.lights, clarity=clarity)

    @property
    def sight(self) -> float:
        """How far the car perceives all bodies now [m]."""
        return self.visibility.sight

    def perceived(self) -> list[Body]:
        """Bodies that the car perceives, where it takes them to be, nearest first."""
        x, y = self.car.position
        bodies = self.actors.bodies(self.car.position, CLEAR_SIGHT)
        return self._perception.perceive(bodies, float(x), float(y), self.visibility, self.frame)

    def _look_ahead(self) -> Hazard | None:
        """The nearest thing on the path that the car has to brake for."""
        planner, car = self.planner, self.car
        bodies = self.perceived()
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
        crosswalk = self._crosswalk_ahead()
        junction = None if crosswalk is not None and crosswalk.safe_speed() <= 0.0 else self._junction_ahead()
        hazards = [h for h in (found, crosswalk, junction, gap) if h is not None]
        return min(hazards, key=Hazard.safe_speed, default=None)

    def _crosswalk_ahead(self) -> Hazard | None:
        """The next crosswalk on the path with people on it, whom the car sees and for whom it can still stop."""
        path, planner, speed = self.planner.path, self.planner, float(self.car.speed)
        reach = speed**2 / (2 * BRAKING) + ASKING + self.car.LENGTH / 2
        first, last = path.index_at(planner.s), path.index_at(planner.s + reach)
        for k in range(first, last + 1):
            lane = int(path.lanes[k])
            if path.manoeuvre[k] or (k > first and path.lanes[k - 1] == lane):
                continue
            for span in self.actors.crosswalks.spans(lane):
                gap = float(path.s[k]) + span.start - float(path.stations[k]) - planner.s - self.car.LENGTH / 2
                if gap < 0.0 or gap > reach or speed**2 > 2 * HARDEST_BRAKING * max(gap, 0.1):
                    continue
                walker = self.actors.crosswalks.holds(span)
                if walker is not None and math.hypot(*(walker.position - self.car.position)) < self.sight:
                    return Hazard(kind=ObjectClass.PEDESTRIAN, gap=gap, key=walker.key, line=True)
        return None

    def _junction_ahead(self) -> Hazard | None:
        """The line before a junction that the car may not enter yet."""
        path, planner, speed = self.planner.path, self.planner, float(self.car.speed)
        if planner.held and speed < STANDING:
            return None  # asks for nothing that it does not use
        asking = speed**2 / (2 * BRAKING) + ASKING
        first = path.index_at(planner.s)
        lanes = path.lanes[
            first : path.index_at(planner.s + max(asking, CRITICAL_GAP * speed) + self.car.LENGTH / 2) + 1
        ]
        entries = np.flatnonzero((lanes[1:] != lanes[:-1]) & self._is_connector[lanes[1:]])
        if not len(entries):
            return None
        k = int(entries[0])
        entered = first + k + 1  # the first point of the path that is on the connector, not quite at its start
        line = float(path.s[entered] - path.stations[entered]) - planner.s - self.car.LENGTH / 2
        if line < -self.car.LENGTH / 2:
            return None  # over the line already
        lane, connector = int(lanes[k]), int(lanes[k + 1])
        self.junctions.announce(CAR, lane, connector, self.time, distance=line, speed=speed)
        if line > asking:
            return None
        wait = self.junctions.request(CAR, self.time, room=self._has_room)
        return None if wait is None else Hazard(kind=self._holder(wait, lane), gap=line, key=-2, line=True)

    def _has_room(self, others: int) -> bool:
        """Whether there is room behind the junction ahead for the car and so many others."""
        after = next((lane for lane in self.planner.lanes_ahead[1:] if not self.town.lanes[lane].in_junction), None)
        if after is None:
            return True
        return room_at_start(self.road, self.network.lane_of(after), exclude=self.car, others=others)

    def _holder(self, wait: Wait, lane: int) -> ObjectClass:
        """What holds the car before a junction, as a driver would say."""
        if wait is Wait.LIGHT:
            return ObjectClass.TRAFFIC_LIGHT
        if self.junctions.obeys_sign(lane) and wait not in (Wait.NO_ROOM, Wait.CLOSED):
            return ObjectClass.TRAFFIC_SIGN
        return ObjectClass.VEHICLES

    def _gap_to_traffic(self, bodies: list[Body], *, blocked: bool) -> Hazard | None:
        """Before a lane switch or U-turn: the place where it begins, while others are in its way.

        Args:
            bodies: all that is perceived.
            blocked: whether the car stands behind something: it may be waiting for the junction, which stays open then.
        """
        planner, path = self.planner, self.planner.path
        action, _ = planner.manoeuvre
        k = path.index_at(planner.s)
        turning = action is PhysicalAction.U_TURN
        if path.manoeuvre[k] and (planner.s > BEGUN or float(self.car.speed) > STANDING):
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
        meeting, _ = self.town.lanes[target].project(np.asarray(path.points[start]))
        for body in bodies:
            if body.kind is not ObjectClass.VEHICLES:
                continue
            station = self._place_towards(target, body)
            if station is None:
                continue
            if turning:  # it takes the car's length of time to get round, in which who stands now may have come up
                behind = 8.0 + 5.0 * max(body.speed, TURN_ROUND_SPEED)
            else:
                behind = 8.0 + 3.0 * max(body.speed - float(self.car.speed), 0.0)
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
                free &= self.junctions.close(CAR, junction, self.time)
        return free

    @functools.cached_property
    def _mouths(self) -> list[tuple[int, tuple[float, float], float]]:
        """Junctions: id, a middle [m], and the radius in which their connectors lie [m]."""
        found = []
        for junction in self.town.junctions:
            points = np.concatenate([self.town.lanes[lane].points[:, :2] for lane in junction.connectors])
            middle = (points.min(axis=0) + points.max(axis=0)) / 2
            radius = float(np.hypot(*(points - middle).T).max())
            found.append((junction.id, (float(middle[0]), float(middle[1])), radius))
        return found

    def _place_towards(self, target: int, body: Body) -> float | None:
        """Where a body is along a lane, negative where it comes towards its start, or None if it does not [m]."""
        position = np.array([body.x, body.y])
        for lane_id, offset in self._upstream(target):
            lane = self.town.lanes[lane_id]
            station, lateral = lane.project(position)
            if abs(lateral) > 2.0 or abs(lane.height_at(station) - body.height) > HEIGHT_MARGIN:
                continue
            if math.cos(lane.heading_at(station) - body.heading) < 0.5:
                continue
            if not lane.in_junction or self.junctions.holds(body.key) == lane_id:
                return station + offset
        return None

    @functools.lru_cache(maxsize=256)  # noqa: B019 - a world lives as long as its session
    def _upstream(self, target: int) -> tuple[tuple[int, float], ...]:
        """A lane, and those that lead to it within sight of a turning car, with where they begin [m]."""
        found = [(target, 0.0)]
        for lane, offset in found:
            for before in self.town.predecessors(lane):
                start = offset - self.town.lanes[before].length
                if offset > -UPSTREAM and all(before != known for known, _ in found):
                    found.append((before, start))
        return tuple(found)

    def _note_hazard(self, hazard: Hazard | None, brake: float) -> None:
        """Logs when the car begins to stop for something, and when it goes on."""
        free = self.driver.allowed_speed(None)
        speed = float(self.car.speed)
        limiting = hazard is not None and hazard.safe_speed(self.weather.friction) < free - 0.5
        if self.hazard is None:
            if hazard is not None and limiting and not self.planner.held:
                if (speed < 1.0 and hazard.speed < 1.0) or brake * 8.0 > HARD:
                    self.hazard, self._hazard_since, self._hazard_seen = hazard, self.frame, self.frame
                    self.reports.add(
                        WorldEventKind.HAZARD_STOP, self.frame,
                        reason=hazard.kind.label, distance=round(max(hazard.gap, 0.0), 2),
                    )  # fmt: skip
            return
        if limiting and hazard is not None:
            self.hazard, self._hazard_seen = hazard, self.frame
        if self.frame - self._hazard_seen > FRAME_RATE // 2:
            seconds = (self.frame - self._hazard_since) / FRAME_RATE
            self.reports.add(
                WorldEventKind.HAZARD_END, self.frame, reason=self.hazard.kind.label, seconds=round(seconds, 2)
            )
            self.hazard = None

    # --- infractions ------------------------------------------------------------------------------------------------

    def _collide(self, speed: float) -> None:
        """Books collisions: whose fault they were, and who is towed away."""
        car = self.car
        for kind, other in self.actors.book(car.take_touched()):
            offset = np.asarray(other.position) - car.position
            forward = float(offset @ np.array([math.cos(car.heading), math.sin(car.heading)]))
            own = speed > 0.5 and forward > 0.0
            self.collisions += own
            self.reports.infraction(
                WorldEventKind.COLLISION, self.frame, lane=self.planner.lane, station=self.planner.station,
                x=car.position[0], y=car.position[1], key=other.key, other=kind,
                own_fault=own, speed=round(speed, 2),
            )  # fmt: skip
        car.speed = 0.0
        self._stopped_until = self.frame + round(self.config.collisions_stop * FRAME_RATE)

    def _pose(self) -> Pose:
        turning = self.planner.manoeuvre[0] is PhysicalAction.U_TURN and self.planner.in_manoeuvre
        x, y = self.car.position
        return Pose(float(x), float(y), float(self.car.heading), float(self.car.speed), self.car.height, turning)

    # --- faults -----------------------------------------------------------------------------------------------------

    def _is_faulty(self, sensor: Sensor, frame: int) -> bool:
        return self.faults.get(sensor, frame) > frame

    def set_fault(self, sensor: Sensor, on: bool) -> str | None:
        """Switches a sensor fault on or off; returns the reason if nothing changes."""
        if on == (sensor in self.faults):
            return f"the fault of {sensor} is {'on' if on else 'off'} already"
        if on:
            self.faults[sensor] = self.frame + round(FAULT_SECONDS * FRAME_RATE)
        else:
            del self.faults[sensor]
        return None
