"""Exceptions that the Ad-Wizard causes: kinds, sensors, props and weather parameters."""

from __future__ import annotations

import math
from enum import StrEnum
from typing import Self

from dorothie_gym.ontology.vocabulary import LabelledInt, OntologyError


class ExceptionKind(LabelledInt):
    """A kind of unexpected change. MESSAGE, a text to the participant alone, is neither environmental nor task."""

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
        """Whether the exception changes the world, or what the car perceives of it."""
        return ExceptionKind.WEATHER <= self <= ExceptionKind.SENSOR_FAULT

    @property
    def is_plan_level(self) -> bool:
        """Whether the exception may force another route: a prop put, moved or taken away."""
        return self in (ExceptionKind.PLACE_PROP, ExceptionKind.MOVE_PROP, ExceptionKind.DELETE_PROP)

    @property
    def is_task(self) -> bool:
        """Whether the exception changes the participant's goals."""
        return self in (ExceptionKind.TASK_TRIGGER, ExceptionKind.TASK_DELETE, ExceptionKind.TASK_CHANGE)


class Sensor(StrEnum):
    """What a sensor fault takes away: sharpness of the view, the position, the whole view."""

    BLUR = "blur"
    GPS = "gps"
    VIEW = "view"


class PropKind(StrEnum):
    """A kind of prop, with the size of its bounding box; values are the last part of CARLA's blueprint names.

    Attributes:
        length: size along the prop's own heading [m].
        width: size across its heading [m].
        height: size upwards [m].
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
    # A type 3 barricade (MUTCD 2009, 6F.68) of 8 feet. It faces along its heading, so it blocks with its width.
    STREET_BARRIER = "streetbarrier", 0.60, 2.44, 1.52
    # The 28-inch cone of city streets.
    TRAFFIC_CONE = "trafficcone", 0.36, 0.36, 0.71
    # A 30-inch sign whose lower edge is 7 feet above the ground (MUTCD 2009, 2A.18).
    TRAFFIC_SIGN = "trafficsign", 0.10, 0.76, 2.89

    # The defaults are never used by a member: they let type checkers accept the look-up by name, `Enum("tree")`.
    def __new__(cls, value: str, length: float = 0.0, width: float = 0.0, height: float = 0.0) -> Self:
        """Makes a member from its name and its size."""
        member = str.__new__(cls, value)
        member._value_ = value
        member.length = length
        member.width = width
        member.height = height
        return member

    @property
    def blueprint(self) -> str:
        """The name that CARLA's blueprint library would have for the prop."""
        return f"static.prop.{self.value}"


class WeatherParameter(StrEnum):
    """One parameter of the weather.

    Ranges as in CARLA's documentation of `carla.WeatherParameters`; clear noon is CARLA's preset of that name
    (LibCarla `rpc/WeatherParameters.cpp`; early 0.9 releases had other numbers).

    Attributes:
        low: smallest value.
        high: largest value.
        clear_noon: value in clear weather at noon.
        unit: "%" of the strongest, "degrees", "m" or "1".
    """

    low: float
    high: float
    clear_noon: float
    unit: str

    CLOUDINESS = "cloudiness", 0.0, 100.0, 5.0, "%"
    PRECIPITATION = "precipitation", 0.0, 100.0, 0.0, "%"
    PRECIPITATION_DEPOSITS = "precipitation_deposits", 0.0, 100.0, 0.0, "%"
    WIND_INTENSITY = "wind_intensity", 0.0, 100.0, 10.0, "%"
    # CARLA's preset has -1, which leaves the azimuth as it is; 0 is the default of the parameter.
    SUN_AZIMUTH_ANGLE = "sun_azimuth_angle", 0.0, 360.0, 0.0, "degrees"
    SUN_ALTITUDE_ANGLE = "sun_altitude_angle", -90.0, 90.0, 45.0, "degrees"
    FOG_DENSITY = "fog_density", 0.0, 100.0, 2.0, "%"
    # Where the fog starts. CARLA sets no upper end; fog that starts beyond 100 m hides nothing that a town shows.
    FOG_DISTANCE = "fog_distance", 0.0, 100.0, 0.75, "m"
    # CARLA sets no upper end; from 5 on the fog stays too close to the ground to hide anything.
    FOG_FALLOFF = "fog_falloff", 0.0, 5.0, 0.1, "1"
    WETNESS = "wetness", 0.0, 100.0, 0.0, "%"

    # The defaults are never used by a member: they let type checkers accept the look-up by name, `Enum("wetness")`.
    def __new__(cls, value: str, low: float = 0.0, high: float = 0.0, clear_noon: float = 0.0, unit: str = "") -> Self:
        """Makes a member from its name and its numbers."""
        member = str.__new__(cls, value)
        member._value_ = value
        member.low = low
        member.high = high
        member.clear_noon = clear_noon
        member.unit = unit
        return member

    def check(self, value: float) -> None:
        """Does nothing if `value` lies in [low, high].

        Raises:
            OntologyError: it does not, or it is not a finite number.
        """
        if not (math.isfinite(value) and self.low <= value <= self.high):
            raise OntologyError(
                f"{self}: {value!r} is out of range, expected {self.low:g} to {self.high:g} {self.unit}"
            )
