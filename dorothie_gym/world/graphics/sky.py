"""What the weather does to a picture, and what to call it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from dorothie_gym.ontology import WeatherParameter

_NIGHT = (126, 138, 184)
_OVERCAST = (226, 230, 236)
_FOG = (222, 226, 230)
_RAIN = (176, 194, 222)


def darkness(weather: Mapping[str, float]) -> float:
    """How dark it is in [0, 1]: none with the sun 12 degrees above the horizon, all with it 6 degrees below."""
    altitude = _value(weather, WeatherParameter.SUN_ALTITUDE_ANGLE)
    return float(np.clip((12.0 - altitude) / 18.0, 0.0, 1.0))


def weather_summary(weather: Mapping[str, float]) -> str:
    """The weather in a few words, such as "night, heavy rain, fog"."""
    dark = darkness(weather)
    parts = ["night" if dark > 0.85 else "dusk" if dark > 0.15 else "day"]
    rain = _value(weather, WeatherParameter.PRECIPITATION)
    fog = _value(weather, WeatherParameter.FOG_DENSITY)
    if rain > 60:
        parts.append("heavy rain")
    elif rain > 10:
        parts.append("rain")
    elif _value(weather, WeatherParameter.CLOUDINESS) > 60:
        parts.append("overcast")
    elif fog <= 15:
        parts.append("clear")
    if fog > 15:
        parts.append("dense fog" if fog > 60 else "fog")
    if rain <= 10 and _value(weather, WeatherParameter.WETNESS) > 30:
        parts.append("wet road")
    return ", ".join(parts)


def apply_weather(picture: Any, weather: Mapping[str, float], time: float) -> None:
    """Tints a picture in place, lightly enough that everything on it is still read.

    Args:
        picture: a `pygame.Surface`.
        weather: the parameters by name; those absent are as on a clear noon.
        time: what moves the rain [s].
    """
    import pygame

    dark = darkness(weather)
    grey = _value(weather, WeatherParameter.CLOUDINESS) / 100.0
    factor = [255.0 + (n - 255.0) * dark for n in _NIGHT]
    factor = [f * (255.0 + (c - 255.0) * grey) / 255.0 for f, c in zip(factor, _OVERCAST, strict=True)]
    tint = tuple(round(f) for f in factor)
    if tint != (255, 255, 255):
        picture.fill(tint, special_flags=pygame.BLEND_RGB_MULT)
    fog = np.clip(_value(weather, WeatherParameter.FOG_DENSITY) / 100.0 - 0.02, 0.0, 1.0)
    if fog > 0.01:
        veil = pygame.Surface(picture.get_size())
        veil.fill(tuple(round(c * (1.0 - 0.55 * dark)) for c in _FOG))
        veil.set_alpha(round(150 * fog))
        picture.blit(veil, (0, 0))
    rain = _value(weather, WeatherParameter.PRECIPITATION) / 100.0
    if rain > 0.05:
        _draw_rain(picture, rain, _value(weather, WeatherParameter.WIND_INTENSITY) / 100.0, time)


def _draw_rain(picture: Any, strength: float, wind: float, time: float) -> None:
    import pygame

    width, height = picture.get_size()
    rng = np.random.default_rng(round(time * 30.0) & 0xFFFFFFFF)
    layer = pygame.Surface((width, height), pygame.SRCALPHA, 32)
    drop = np.array([-4.0 - 10.0 * wind, 14.0])
    for start in rng.uniform((0.0, 0.0), (width, height), (round(width * height / 2600.0 * strength), 2)):
        pygame.draw.aaline(layer, (*_RAIN, 190), start.tolist(), (start + drop).tolist())
    picture.blit(layer, (0, 0))


def _value(weather: Mapping[str, float], parameter: WeatherParameter) -> float:
    return float(weather.get(parameter.value, parameter.clear_noon))
