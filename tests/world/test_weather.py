from __future__ import annotations

import pytest

from dorothie_gym.ontology import WeatherParameter
from dorothie_gym.world.weather import CLEAR_SIGHT, SHORTEST_SIGHT, Weather

SHARES = [0.0, 0.25, 0.5, 0.75, 1.0]


@pytest.mark.parametrize("parameter", [WeatherParameter.FOG_DENSITY, WeatherParameter.PRECIPITATION])
def test_fog_and_rain_take_sight(parameter: WeatherParameter) -> None:
    weather, sights = Weather(), []
    for share in SHARES:
        weather.set_share(parameter, share)
        sights.append(weather.sight(lights=False))
    assert sights == sorted(sights, reverse=True)
    assert sights[0] > sights[-1] >= SHORTEST_SIGHT


@pytest.mark.parametrize("parameter", [WeatherParameter.WETNESS, WeatherParameter.PRECIPITATION_DEPOSITS])
def test_wet_roads_are_slippery(parameter: WeatherParameter) -> None:
    weather, grips = Weather(), []
    for share in SHARES:
        weather.set_share(parameter, share)
        grips.append(weather.friction)
    assert grips == sorted(grips, reverse=True)
    assert grips[0] == 1.0
    assert grips[-1] == pytest.approx(0.7)


def test_lights_help_in_the_dark_only() -> None:
    weather = Weather()
    assert weather.sight(lights=True) == weather.sight(lights=False) == CLEAR_SIGHT
    weather.set_share(WeatherParameter.SUN_ALTITUDE_ANGLE, 0.0)
    assert weather.is_dark
    assert weather.sight(lights=False) < weather.sight(lights=True) < CLEAR_SIGHT
