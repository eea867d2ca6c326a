"""The world of a session: a town, the car, what drives, walks and stands there, weather and faults."""

from __future__ import annotations

import math

import numpy as np

from dorothie_gym.ontology import PhysicalAction, Sensor, WeatherParameter
from dorothie_gym.world.actors import Actors
from dorothie_gym.world.car.driver import Driver
from dorothie_gym.world.car.hazards import Body, Hazard
from dorothie_gym.world.car.planner import LocalPlanner
from dorothie_gym.world.car.vehicle import Car
from dorothie_gym.world.config import FRAME_COLUMNS, FRAME_RATE, WorldConfig
from dorothie_gym.world.junctions import JunctionControl
from dorothie_gym.world.localizer import FIX_EVERY, Localizer
from dorothie_gym.world.lookout import CAR, Lookout
from dorothie_gym.world.network.network import TownNetwork
from dorothie_gym.world.network.road import TownRoad
from dorothie_gym.world.perception import Perception
from dorothie_gym.world.reports import Pose, Reports, WorldEvent, WorldEventKind
from dorothie_gym.world.town.model import Array, Town
from dorothie_gym.world.visibility import CLEAR_SIGHT, Visibility
from dorothie_gym.world.weather import Weather
from dorothie_gym.world.wind import Wind

FAULT_SECONDS = 30.0
"""A sensor fault ends by itself after this long [s] (design)."""

CLARITY = {Sensor.BLUR: 0.25, Sensor.VIEW: 0.0}
"""Share of the signal that a fault of the view leaves: blur halves the sight."""

EXTEND_EVERY = 15
"""The path is lengthened this often [frames]."""

HARD = 3.5
"""Braking harder than this for something ahead is a hazard stop [m/s^2]."""


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
        self.weather = Weather()
        self.wind = Wind(np.random.default_rng(wind_seed))
        self._perception = Perception(np.random.default_rng(perceive_seed))
        self.actors = Actors(
            self.road, self.junctions, self.car,
            traffic_rng=np.random.default_rng(traffic_seed), walk_rng=np.random.default_rng(walk_seed),
        )  # fmt: skip
        self._lookout = Lookout(self.road, self.car, self.planner, self.junctions, self.actors)
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
        hazard = self._lookout.look(self.perceived(), self.sight, self.time)
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

    def seen(self) -> Array:
        """The same in numbers (n, 9): key, kind, x, y, heading, length, width, speed, height [m, rad, m/s]."""
        rows = [
            (body.key, body.kind.value, body.x, body.y, body.heading, body.length, body.width, body.speed, body.height)
            for body in self.perceived()
        ]
        return np.array(rows, dtype=np.float64).reshape(-1, 9)

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
