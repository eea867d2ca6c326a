"""The weather parameters, with CARLA's names and ranges."""

from __future__ import annotations

import math
from enum import StrEnum
from typing import Self

from dorothie_gym.ontology.errors import OntologyError


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
