"""Sensors of the car that need no picture: inertial unit, GNSS, lane invasion, collisions."""

from __future__ import annotations

import enum
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.ontology.spellings import parse_object_class
from dorothie_gym.session.spaces.fields import Column, FieldSpec, flags, real
from dorothie_gym.sim.config import FRAME_RATE
from dorothie_gym.sim.sensing.inertial import AXES, Motion, read_inertial_unit, read_receiver
from dorothie_gym.sim.traffic_rules import WorldEventKind
from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.support.compilation.records import plain

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array
    from dorothie_gym.maps.town import Town
    from dorothie_gym.session.config import EnvConfig
    from dorothie_gym.session.sensor_config import SensorConfig
    from dorothie_gym.sim.traffic_rules import WorldEvent
    from dorothie_gym.sim.world import World


class LaneMarking(enum.IntEnum):
    """Kind of a line along a lane, outside junctions; entries of `lane_invasion`."""

    LANE = 0
    """Between lanes of one direction."""
    CENTRE = 1
    """Between the two directions."""
    MEDIAN = 2
    """At a median."""
    EDGE = 3
    """At the edge of the road."""


class CollisionColumn(Column):
    """Columns of `collision`: collisions since the previous decision, the first ones first."""

    KIND = 0, "1", "id of the `ObjectClass` of the other body, never 0"
    SPEED = 1, "m/s", "speed of the car before the collision"
    OWN_FAULT = 2, "1", "1 if the car drove towards the other body"
    TIME = 3, "s", "time of the collision since the start of the session"


class GnssColumn(enum.IntEnum):
    """Entries of `gnss`."""

    LATITUDE = 0
    LONGITUDE = 1
    AGE = 2


COLLISIONS: Final = 4
"""Rows of `collision`."""

_WHEELBASE = 0.6
"""Distance of the axles as a share of the length of the car."""


class CrossedLines(Protocol):
    """Lines of a town along its lanes (`pictures.maps.lane_lines`)."""

    def crossed(self, paths: Array, height: float) -> NDArray[np.int8]:
        """Returns the kinds of lines that paths (wheels, n, 2) [m] cross at a height [m], as flags (4,)."""


def car_sensor_fields(sensors: SensorConfig, frames: int) -> tuple[FieldSpec, ...]:
    """Returns the specifications of the fields that sensors without pictures add to the Co-Wizard's observation.

    Args:
        sensors: settings.
        frames: physics frames of a decision, of which each has a row of inertial readings.
    """
    fields: list[FieldSpec] = []
    if sensors.imu:
        fields += [
            real(
                "accelerometer",
                frames,
                AXES,
                unit="m/s^2",
                meaning="specific force ahead, to the right and up at each frame (30 Hz) since the previous decision",
            ),
            real("gyroscope", frames, AXES, unit="rad/s", meaning="rates of roll, pitch and yaw at the same frames"),
            real("compass", 1, low=0.0, high=2.0 * np.pi, unit="rad", meaning="direction, clockwise from north"),
        ]
    if sensors.gnss:
        meaning = "latitude and longitude of the last fix, and the time since that fix"
        fields.append(real("gnss", len(GnssColumn), unit="deg, deg, s", meaning=meaning))
    if sensors.lane_invasion:
        meaning = "1 for each `LaneMarking` that a wheel has crossed since the previous decision"
        fields.append(flags("lane_invasion", len(LaneMarking), meaning=meaning))
    if sensors.collision:
        meaning = "collisions since the previous decision"
        fields.append(real("collision", COLLISIONS, columns=CollisionColumn, unit="mixed", meaning=meaning))
    return tuple(fields)


class CarSensors:
    """Readings of the sensors of a session, updated at each decision whether they are observed or not."""

    def __init__(self, world: World, config: EnvConfig, lines: Callable[[Town], CrossedLines]) -> None:
        """Takes the first readings.

        Args:
            world: world of the session.
            config: settings.
            lines: finds the lines of a town.
        """
        self._world, self._sensors, self._frames, self._lines = world, config.sensors, config.frames, lines
        self._before = Motion.of(world)
        self._readings: dict[str, NDArray[np.generic]] = {}
        self.update(())

    @property
    def readings(self) -> Mapping[str, NDArray[np.generic]]:
        """Readings by name of the field; they are never written to."""
        return self._readings

    def update(self, events: Sequence[WorldEvent]) -> None:
        """Reads the sensors after a step of the world, with its events."""
        world, sensors, readings = self._world, self._sensors, dict[str, NDArray[np.generic]]()
        before = self._before
        if sensors.imu:
            inertial, self._before = read_inertial_unit(world, before, self._frames)
            readings["accelerometer"], readings["gyroscope"] = inertial.accelerometer, inertial.gyroscope
            readings["compass"] = np.array([inertial.compass])
        else:
            self._before = Motion.of(world)
        if sensors.gnss:
            readings["gnss"] = np.array(read_receiver(world))
        if sensors.lane_invasion:
            readings["lane_invasion"] = self._crossed(before)
        if sensors.collision:
            readings["collision"] = _collisions(events)
        self._readings = readings

    def _crossed(self, before: Motion) -> NDArray[np.int8]:
        """Returns the flags of the lines that the wheels have crossed since a motion."""
        car = plain(self._world.actors.arrays.vehicles)[0]
        track = np.concatenate((np.array([before[:3]]), self._world.frames[:, 1:4]))
        ahead, aside = 0.5 * _WHEELBASE * float(car["length"]), 0.5 * float(car["width"])
        cos, sin = pn.cos(track[:, 2]), pn.sin(track[:, 2])
        wheels = [
            np.stack((track[:, 0] + f * cos - r * sin, track[:, 1] + f * sin + r * cos), axis=-1)
            for f in (ahead, -ahead)
            for r in (aside, -aside)
        ]
        return self._lines(self._world.town).crossed(np.stack(wheels), float(car["height"]))


def _collisions(events: Sequence[WorldEvent]) -> Array:
    """Returns the collisions among events as rows of `CollisionColumn`."""
    table = np.zeros((COLLISIONS, len(CollisionColumn)))
    found = [event for event in events if event.kind is WorldEventKind.COLLISION]
    for row, event in zip(table, found, strict=False):
        kind, speed = parse_object_class(str(event.data["other"])), float(str(event.data["speed"]))
        row[:] = kind.value, speed, bool(event.data["own_fault"]), event.frame / FRAME_RATE
    return table
