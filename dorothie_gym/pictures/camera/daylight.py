"""Light and air of a picture: effects of the weather parameters on sun, sky, clouds, fog, rain and wet roads.

Colours are RGB in 0..255 as displays show them; light multiplies them. Extinctions are those of the simulator's
perception (`sim/sensing/visibility.py`), so that contrast in the picture falls off as the perceived signal does.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dorothie_gym.maps.model import Array
from dorothie_gym.ontology.world_exceptions import WeatherParameter
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation.records import by_reference

if TYPE_CHECKING:
    from dorothie_gym.sim.weather import Weather

_CLEAR_HORIZON, _CLEAR_ZENITH = (196, 212, 226), (84, 136, 204)
_WARM_HORIZON, _WARM_ZENITH = (242, 178, 118), (88, 104, 158)  # sunrise and sunset
_GREY_HORIZON, _GREY_ZENITH = (188, 192, 196), (150, 156, 164)  # overcast
_NIGHT_HORIZON, _NIGHT_ZENITH = (24, 28, 42), (7, 9, 18)
_FOG = (178, 184, 190)
_BRIGHT_CLOUD, _DARK_CLOUD = (244, 246, 248), (172, 176, 182)
_DISC, _WARM_DISC = (255, 236, 200), (255, 170, 90)
_NOON_TINT, _WARM_TINT, _SHADE_TINT = (1.0, 0.98, 0.94), (1.12, 0.88, 0.70), (0.96, 1.0, 1.06)

_SUNSHINE = 0.78  # factor of direct light of a clear sky
_AMBIENT, _OVERCAST_AMBIENT = 0.50, 0.70  # factors of the light of the sky
_NIGHT_AMBIENT = 0.07
_HAZE = 2.0  # share of the sun's direct light that fog takes, per share of the thickest fog
_TWILIGHT = -6.0, 8.0  # altitudes of the sun between which night becomes day [degrees]
_LAMPS_ON, _LAMPS_OFF = 0.0, 8.0  # altitudes between which street lamps fade [degrees]


@by_reference
class Daylight(NamedTuple):
    """Light and air.

    Attributes:
        sun: (3,) unit vector towards the sun.
        sunshine: (3,) factors of direct light on a surface that faces the sun.
        ambient: (3,) factors of the light of the sky.
        horizon: (3,) colour.
        zenith: (3,) colour.
        cloud: (3,) colour.
        disc: (3,) colour of the sun, zeros behind clouds and below the horizon.
        air: (3,) colour of fog and of rain in the air.
        clouds: share of the sky that clouds cover.
        sky_fog: share of the sky that fog hides.
        fog: extinction [1/m].
        fog_start: where the fog begins [m].
        rain: extinction [1/m].
        rainfall: strength of the rain in [0, 1].
        wetness: wetness of the road in [0, 1].
        lamps: strength of street lamps, lit windows and signs in [0, 1].
        head_lights: strength of the car's headlights in [0, 1].
        beams: strength of the headlights of other vehicles in [0, 1].
    """

    sun: Array
    sunshine: Array
    ambient: Array
    horizon: Array
    zenith: Array
    cloud: Array
    disc: Array
    air: Array
    clouds: float
    sky_fog: float
    fog: float
    fog_start: float
    rain: float
    rainfall: float
    wetness: float
    lamps: float
    head_lights: float
    beams: float


def daylight_of(weather: Weather, *, head_lights: bool) -> Daylight:
    """Returns the light and air of a weather.

    Args:
        weather: the ten parameters.
        head_lights: whether the car's headlights are on.
    """
    value = weather.values
    altitude = value[WeatherParameter.SUN_ALTITUDE_ANGLE]
    rainfall = value[WeatherParameter.PRECIPITATION] / 100.0
    clouds = max(value[WeatherParameter.CLOUDINESS] / 100.0, min(1.0, 1.5 * rainfall))
    day = _share(altitude, *_TWILIGHT)
    warm = (1.0 - _share(altitude, 0.0, 22.0)) * _share(altitude, -8.0, 0.0)
    bright = day * (1.0 - 0.3 * rainfall)
    horizon = _between(_sky(_CLEAR_HORIZON, _WARM_HORIZON, _GREY_HORIZON, warm, clouds), _NIGHT_HORIZON, 1.0 - bright)
    zenith = _between(_sky(_CLEAR_ZENITH, _WARM_ZENITH, _GREY_ZENITH, warm, clouds), _NIGHT_ZENITH, 1.0 - bright)
    fogginess = weather.above_clear(WeatherParameter.FOG_DENSITY)
    haze = min(1.0, _HAZE * fogginess)  # blocks the sun's direct light, and scatters a part of it
    sunshine = _SUNSHINE * (1.0 - 0.9 * clouds * clouds) * _share(altitude, -1.0, 5.0) * (1.0 - haze)
    tint = _between(_NOON_TINT, _WARM_TINT, warm) if sunshine > 0.02 else np.array(_SHADE_TINT)
    daily = (_AMBIENT + (_OVERCAST_AMBIENT - _AMBIENT) * max(clouds, haze)) * (1.0 - 0.35 * rainfall)
    visibility = weather.visibility(lights=False)
    air = np.array(_FOG) * (0.1 + 0.9 * day) if visibility.fog > 0.0 else horizon
    seen = (1.0 - clouds) if altitude > -1.0 else 0.0
    return Daylight(
        sun=_direction(altitude, value[WeatherParameter.SUN_AZIMUTH_ANGLE]),
        sunshine=sunshine * tint,
        ambient=(_NIGHT_AMBIENT + (daily - _NIGHT_AMBIENT) * day) * (0.5 + 0.5 * tint),
        horizon=horizon,
        zenith=zenith,
        cloud=_between(_BRIGHT_CLOUD, _DARK_CLOUD, clouds) * (0.06 + 0.94 * day) * (1.0 - 0.3 * rainfall),
        disc=_between(_DISC, _WARM_DISC, warm) * seen,
        air=air,
        clouds=min(0.92, 0.15 + 0.77 * clouds),
        sky_fog=min(1.0, 2.2 * fogginess),
        fog=visibility.fog,
        fog_start=visibility.fog_start,
        rain=visibility.rain,
        rainfall=rainfall,
        wetness=max(
            value[WeatherParameter.WETNESS] / 100.0, value[WeatherParameter.PRECIPITATION_DEPOSITS] / 100.0, rainfall
        ),
        lamps=1.0 - _share(altitude, _LAMPS_ON, _LAMPS_OFF),
        head_lights=(0.15 + 0.85 * (1.0 - day)) if head_lights else 0.0,
        beams=1.0 - day,
    )


def _share(value: float, low: float, high: float) -> float:
    return min(1.0, max(0.0, (value - low) / (high - low)))


def _between(first: tuple[float, ...] | Array, second: tuple[float, ...] | Array, share: float) -> Array:
    return np.asarray(first, dtype=np.float64) * (1.0 - share) + np.asarray(second, dtype=np.float64) * share


def _sky(
    clear: tuple[float, ...], warm: tuple[float, ...], grey: tuple[float, ...], warmth: float, clouds: float
) -> Array:
    return _between(_between(clear, warm, warmth), grey, clouds)


def _direction(altitude: float, azimuth: float) -> Array:
    a, z = math.radians(altitude), math.radians(azimuth)
    return np.array([pm.cos(a) * pm.cos(z), pm.cos(a) * pm.sin(z), pm.sin(a)])
