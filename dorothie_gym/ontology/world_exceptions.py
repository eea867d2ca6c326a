"""Exceptions caused by the Ad-Wizard: kinds, sensors, props and weather parameters."""

from __future__ import annotations

import math
from enum import StrEnum
from typing import Self

from dorothie_gym.errors import OntologyError
from dorothie_gym.ontology.labelled_enums import LabelledInt


class ExceptionKind(LabelledInt):
    """Kind of unexpected change. MESSAGE, a text to the participant only, is neither environmental nor task."""

    NONE = 0, "None"
    WEATHER = 1, "Weather"
    SPAWN_VEHICLES = 2, "SpawnVehicles"
    SPAWN_PEDESTRIANS = 3, "SpawnPedestrians"
    PLACE_PROP = 4, "PlaceProp"
    MOVE_PROP = 5, "MoveProp"
    DELETE_PROP = 6, "DeleteProp"
    SENSOR_FAULT = 7, "SensorFault"
    TASK_TRIGGER = 8, "TaskTrigger"
    TASK_DELETE = 9, "TaskDelete"
    TASK_CHANGE = 10, "TaskChange"
    MESSAGE = 11, "Message"

    @property
    def is_environmental(self) -> bool:
        """Returns whether the exception changes the world or the perception of the car."""
        return ExceptionKind.WEATHER <= self <= ExceptionKind.SENSOR_FAULT

    @property
    def is_plan_level(self) -> bool:
        """Returns whether the exception may force a new route: a prop is placed, moved or removed."""
        return self in (ExceptionKind.PLACE_PROP, ExceptionKind.MOVE_PROP, ExceptionKind.DELETE_PROP)

    @property
    def is_task(self) -> bool:
        """Returns whether the exception changes the goals of the participant."""
        return self in (ExceptionKind.TASK_TRIGGER, ExceptionKind.TASK_DELETE, ExceptionKind.TASK_CHANGE)


class Sensor(StrEnum):
    """Sensor that can fail: sharpness of the view, position, or the whole view."""

    BLUR = "blur"
    GPS = "gps"
    VIEW = "view"


class PropKind(StrEnum):
    """Kind of prop, with the size of its bounding box; values are the last part of the CARLA blueprint names.

    Attributes:
        length: size along the heading of the prop [m].
        width: size across the heading [m].
        height: vertical size [m].
    """

    length: float
    width: float
    height: float

    # A young street tree with its crown.
    TREE = "tree", 2.5, 2.5, 6.0
    # The 36-inch cone of American highway works.
    CONSTRUCTION_CONE = "constructioncone", 0.40, 0.40, 0.91
    # A container of 4 cubic yards: 4.5 x 6 x 4 feet.
    DUMPSTER = "dumpster", 1.37, 1.83, 1.22
    # A type 3 barricade (MUTCD 2009, 6F.68) of 8 feet. It faces along its heading: its width blocks the road.
    STREET_BARRIER = "streetbarrier", 0.60, 2.44, 1.52
    # The 28-inch cone of city streets.
    TRAFFIC_CONE = "trafficcone", 0.36, 0.36, 0.71
    # A 30-inch sign whose lower edge is 7 feet above the ground (MUTCD 2009, 2A.18).
    TRAFFIC_SIGN = "trafficsign", 0.10, 0.76, 2.89

    # No member uses the defaults: they let type checkers accept the look-up by name, `Enum("tree")`.
    def __new__(cls, value: str, length: float = 0.0, width: float = 0.0, height: float = 0.0) -> Self:
        """Creates a member from its name and its size."""
        member = str.__new__(cls, value)
        member._value_ = value
        member.length = length
        member.width = width
        member.height = height
        return member

    @property
    def blueprint(self) -> str:
        """Name of the prop in the style of the CARLA blueprint library."""
        return f"static.prop.{self.value}"


class WeatherParameter(StrEnum):
    """Weather parameter, with the name and range of CARLA.

    Ranges are those of the documentation of `carla.WeatherParameters`; clear noon is the CARLA preset of that name
    (LibCarla `rpc/WeatherParameters.cpp`; early 0.9 releases had other values).

    Attributes:
        low: smallest value.
        high: largest value.
        clear_noon: value in clear weather at noon.
        unit: "%" of the maximum, "degrees", "m" or "1".
    """

    low: float
    high: float
    clear_noon: float
    unit: str

    CLOUDINESS = "cloudiness", 0.0, 100.0, 5.0, "%"
    PRECIPITATION = "precipitation", 0.0, 100.0, 0.0, "%"
    PRECIPITATION_DEPOSITS = "precipitation_deposits", 0.0, 100.0, 0.0, "%"
    WIND_INTENSITY = "wind_intensity", 0.0, 100.0, 10.0, "%"
    # The CARLA preset has -1, which keeps the current azimuth; 0 is the default of the parameter.
    SUN_AZIMUTH_ANGLE = "sun_azimuth_angle", 0.0, 360.0, 0.0, "degrees"
    SUN_ALTITUDE_ANGLE = "sun_altitude_angle", -90.0, 90.0, 45.0, "degrees"
    FOG_DENSITY = "fog_density", 0.0, 100.0, 2.0, "%"
    # Distance at which fog starts. CARLA sets no upper limit; fog beyond 100 m hides nothing in a town.
    FOG_DISTANCE = "fog_distance", 0.0, 100.0, 0.75, "m"
    # CARLA sets no upper limit; from a value of 5, the fog is too close to the ground to hide anything.
    FOG_FALLOFF = "fog_falloff", 0.0, 5.0, 0.1, "1"
    WETNESS = "wetness", 0.0, 100.0, 0.0, "%"

    # No member uses the defaults: they let type checkers accept the look-up by name, `Enum("wetness")`.
    def __new__(cls, value: str, low: float = 0.0, high: float = 0.0, clear_noon: float = 0.0, unit: str = "") -> Self:
        """Creates a member from its name and its numbers."""
        member = str.__new__(cls, value)
        member._value_ = value
        member.low = low
        member.high = high
        member.clear_noon = clear_noon
        member.unit = unit
        return member

    def check(self, value: float) -> None:
        """Checks that `value` is in [low, high].

        Raises:
            OntologyError: if it is out of range or not finite.
        """
        if not (math.isfinite(value) and self.low <= value <= self.high):
            raise OntologyError(
                f"{self}: {value!r} is out of range, expected {self.low:g} to {self.high:g} {self.unit}"
            )
