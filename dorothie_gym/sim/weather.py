"""Weather and light: the ten parameters, and their effects on grip, sight and side wind.

Cloudiness and the sun's altitude dim the light, fog and precipitation dim the air (`visibility`), water on the road
takes grip, wind pushes the car (`wind`). The sun's azimuth only turns shadows. On a clear noon there is no effect.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from dorothie_gym.ontology.world_exceptions import WeatherParameter
from dorothie_gym.sim.sensing.visibility import (
    CLOUDBURST,
    HEAD_LIGHTS,
    STREET_LIGHT,
    Visibility,
    daylight,
    fog_extinction,
    rain_extinction,
)
from dorothie_gym.support import portable_math as pm

WET_LOSS = 0.3
"""Share of the dry road's grip that a wet road lacks: measured coefficients are 0.8 to 1.0 dry and 0.7 to 0.8 wet
(Wallman and Astrom, VTI meddelande 911A, 2001), and thin films take up to 30 or 40 % (Do et al. 2014). No term for
speed: below 90 km/h a car does not yet hydroplane (Horne and Dreher, NASA TN D-2056, 1963)."""

FILM_SCALE = 0.1
"""Film of water that takes 1 - 1/e of that [mm]: most of it is lost between 0.025 and 0.23 mm (Kulakowski and Harwood,
ASTM STP 1031, 1990)."""

WET_FILM = 0.5
"""Film of water on a road of wetness 100 % [mm]."""

PUDDLES = 5.0
"""Depth of the puddles of precipitation deposits 100 % [mm]."""

_TEXTURE, _DRAINAGE, _SLOPE = 0.5, 5.0, 0.02
"""Depth of the road's texture [mm], length of the water's path to the kerb [m] and crossfall, for the film of rain."""


class Weather:
    """The ten weather parameters and their effects."""

    def __init__(self) -> None:
        self._values: dict[WeatherParameter, float] = {p: float(p.clear_noon) for p in WeatherParameter}
        self._views: dict[tuple[bool, float], Visibility] = {}

    @property
    def values(self) -> Mapping[WeatherParameter, float]:
        """The ten values, for reading: the same object until one of them changes."""
        return self._values

    def set(self, parameter: WeatherParameter, value: float) -> None:
        """Sets a parameter.

        Raises:
            OntologyError: the value is out of the parameter's range.
        """
        parameter.check(value)
        self._values = {**self._values, parameter: value}
        self._views.clear()

    def set_share(self, parameter: WeatherParameter, share: float) -> float:
        """Sets a parameter to a share of its range; returns its value."""
        value = parameter.low + share * (parameter.high - parameter.low)
        self.set(parameter, value)
        return value

    # --- Sight --------------------------------------------------------------------------------------------------------

    def visibility(self, *, lights: bool, clarity: float = 1.0) -> Visibility:
        """Returns the visibility in this weather.

        Args:
            lights: whether the car's headlights are on.
            clarity: share of the signal that the view itself leaves.
        """
        found = self._views.get((lights, clarity))
        if found is None:
            found = self._views[(lights, clarity)] = self._visibility(lights, clarity)
        return found

    def sight(self, *, lights: bool) -> float:
        """Returns the range of perception [m]: shorter with fog, rain and darkness, longer in the dark with lights."""
        return self.visibility(lights=lights).sight

    def _visibility(self, lights: bool, clarity: float) -> Visibility:
        value = self._values
        altitude = value[WeatherParameter.SUN_ALTITUDE_ANGLE]
        return Visibility(
            fog=fog_extinction(self.above_clear(WeatherParameter.FOG_DENSITY), value[WeatherParameter.FOG_FALLOFF]),
            fog_start=value[WeatherParameter.FOG_DISTANCE],
            rain=rain_extinction(CLOUDBURST * self.above_clear(WeatherParameter.PRECIPITATION)),
            light=STREET_LIGHT + daylight(altitude, value[WeatherParameter.CLOUDINESS] / 100.0),
            lamps=HEAD_LIGHTS if lights else 0.0,
            clarity=clarity,
        )

    def above_clear(self, parameter: WeatherParameter) -> float:
        """Returns a parameter's excess over a clear noon, as a share of the largest possible, in [0, 1]."""
        clear = parameter.clear_noon
        return max(self._values[parameter] - clear, 0.0) / (parameter.high - clear)

    # --- Grip ---------------------------------------------------------------------------------------------------------

    @property
    def water_film(self) -> float:
        """Film of water on the road [mm]: wetness, puddles, and rain that falls faster than it runs off."""
        wet = self.above_clear(WeatherParameter.WETNESS)
        puddles = self.above_clear(WeatherParameter.PRECIPITATION_DEPOSITS)
        rain = CLOUDBURST * self.above_clear(WeatherParameter.PRECIPITATION)
        return WET_FILM * wet + PUDDLES * puddles + _running_film(rain)

    @property
    def friction(self) -> float:
        """Share of the dry road's grip, in (1 - WET_LOSS, 1]: 1 - WET_LOSS (1 - exp(-film / FILM_SCALE))."""
        return 1.0 + WET_LOSS * pm.expm1(-self.water_film / FILM_SCALE)

    def braking_distance(self, speed: float, deceleration: float) -> float:
        """Returns the braking distance [m] from a speed [m/s] with a deceleration given for a dry road [m/s^2]."""
        return speed * speed / (2 * deceleration * self.friction)


def _running_film(rate: float) -> float:
    """Returns the water that runs off the road in rain of a rate [mm/h], above the road's texture [mm].

    Gallaway et al. (FHWA-RD-79-31, 1979): 0.01485 t^0.11 L^0.43 i^0.59 / S^0.42 - t.
    """
    surface = 0.01485 * pm.power(_TEXTURE, 0.11) * pm.power(_DRAINAGE, 0.43) / pm.power(_SLOPE, 0.42)
    depth = surface * pm.power(rate, 0.59)
    return float(max(depth - _TEXTURE, 0.0))


# --- Side wind --------------------------------------------------------------------------------------------------------

GALE = 20.0
"""Mean speed of the wind at intensity 100 % [m/s]: Beaufort 8."""

AIR_DENSITY = 1.2
"""[kg/m^3]."""

FRONTAL_AREA = 2.2
"""Of a passenger car, which its coefficients refer to [m^2]."""

SIDE_FORCE = 1.2
"""Coefficient of the side force in wind from straight across."""

CORNERING_STIFFNESS = 1.2e5
"""Of all four tyres together [N/rad]."""

GUSTINESS = 0.25
"""Standard deviation of the wind over its mean: turbulence intensity of built-up country (EN 1991-1-4)."""

PERIODS = (3.1, 7.3, 17.9)
"""Of the sines that make up gusts [s], in no simple ratio to each other."""


class Wind:
    """Wind of one direction with gusts, a function of time and the seed only.

    Attributes:
        heading: where it blows to [rad].
        phases: phases of the gusts [rad].
    """

    def __init__(self, rng: np.random.Generator) -> None:
        self.heading = float(rng.uniform(-math.pi, math.pi))
        self.phases = tuple(float(phase) for phase in rng.uniform(0.0, 2 * math.pi, len(PERIODS)))

    def speed(self, strength: float, time: float) -> float:
        """Returns the speed of the wind [m/s], never below 0.

        Args:
            strength: in [0, 1]; 0 means no wind of relevance.
            time: [s].
        """
        if strength <= 0.0:
            return 0.0
        swing = sum(
            pm.sin(2 * math.pi * time / period + phase) for period, phase in zip(PERIODS, self.phases, strict=True)
        )
        return GALE * strength * max(1.0 + GUSTINESS * math.sqrt(2.0 / len(PERIODS)) * swing, 0.0)

    def drift(self, strength: float, time: float, *, heading: float, speed: float) -> float:
        """Returns the angle of a car's course to its heading, positive right [rad]; 0 without wind or at standstill.

        Args:
            strength: strength of the wind in [0, 1].
            time: [s].
            heading: heading of the car [rad].
            speed: speed of the car [m/s].
        """
        if strength <= 0.0 or speed <= 0.0:
            return 0.0
        return drift_angle(self.speed(strength, time), self.heading - heading, speed)


def drift_angle(wind: float, angle: float, speed: float) -> float:
    """Returns the angle of a car's course to its heading, positive right [rad].

    Args:
        wind: speed of the wind [m/s].
        angle: from the car's heading to where the wind blows to, positive right [rad].
        speed: speed of the car [m/s].
    """
    across, along = wind * pm.sin(angle), wind * pm.cos(angle) - speed
    force = AIR_DENSITY / 2 * FRONTAL_AREA * SIDE_FORCE * pm.hypot(across, along) * across
    return force / CORNERING_STIFFNESS
