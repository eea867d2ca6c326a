"""The sight distance of an agent: its limits, failures of the camera, and a suitable speed.

No role observes the fault of a camera. A car knows how far its camera should see in the weather and light that it
measures; from the difference, it infers that the picture is blurred, or that there is none.
"""

from __future__ import annotations

import enum
import math
from functools import lru_cache
from typing import TYPE_CHECKING, Final

from dorothie_gym.ontology.world_exceptions import Sensor, WeatherParameter
from dorothie_gym.policies.observation_parser import is_dark, is_foggy, is_rainy, scalar
from dorothie_gym.sim.sensing.visibility import SHORTEST_SIGHT
from dorothie_gym.sim.weather import Weather

if TYPE_CHECKING:
    from dorothie_gym.session.spaces.observations import ObservationMapping

FAR_SIGHT: Final = 60.0
"""Minimum range of sight that is far enough for an agent [m]: it can stop in time from 45 km/h."""

DENSE: Final = 30.0
"""Range of sight below which fog is dense [m]."""

LOSS: Final = 0.85
"""Share of the sight in the current weather below which the camera is at fault."""

REACTION: Final = 2.5
"""Time until a driver brakes [s] (AASHTO, Green Book, stopping sight distance)."""

DECELERATION: Final = 3.4
"""Comfortable deceleration [m/s^2] (AASHTO, Green Book, stopping sight distance)."""


class Limit(enum.StrEnum):
    """Cause of a limited view."""

    FOG = "fog"
    RAIN = "rain"
    NIGHT = "night"
    CAMERA = "camera"


def sight(observation: ObservationMapping) -> float:
    """Returns the range of sight [m]."""
    return scalar(observation, "sight")


def sight_in_weather(observation: ObservationMapping) -> float:
    """Returns the range of sight that weather, light and headlights leave a sound camera [m]."""
    return _sight_of(tuple(observation["weather"].tolist()), bool(observation["lights"]))


def camera_fault(observation: ObservationMapping) -> Sensor | None:
    """Returns the car's inference about its camera: no picture, a blurred one, or (None) no fault."""
    seen, expected = sight(observation), sight_in_weather(observation)
    if seen >= LOSS * expected:
        return None
    return Sensor.VIEW if seen <= SHORTEST_SIGHT else Sensor.BLUR


def limit_of(observation: ObservationMapping) -> Limit | None:
    """Returns the cause of a limited view; None if the view is not limited."""
    if camera_fault(observation) is not None:
        return Limit.CAMERA
    if is_foggy(observation):
        return Limit.FOG
    if is_rainy(observation):
        return Limit.RAIN
    return Limit.NIGHT if is_dark(observation) else None


def suitable_speed(distance: float) -> int:
    """Returns the speed at which a car stops within a range of sight [m], in steps of 5 km/h, at least 15.

    The stopping sight distance is v t + v^2 / (2 a) (AASHTO, Green Book).
    """
    lag = DECELERATION * REACTION
    speed = math.sqrt(lag * lag + 2.0 * DECELERATION * distance) - lag
    return max(15, 5 * round(3.6 * speed / 5.0))


@lru_cache(maxsize=512)
def _sight_of(values: tuple[float, ...], lights: bool) -> float:
    weather = Weather()
    for parameter, value in zip(WeatherParameter, values, strict=True):
        weather.set(parameter, value)
    return weather.sight(lights=lights)
