import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dorothie_gym.ontology import OntologyError, WeatherParameter

parameters = st.sampled_from(WeatherParameter)


def test_names_are_those_of_carla() -> None:
    names = (
        "cloudiness precipitation precipitation_deposits wind_intensity sun_azimuth_angle "
        "sun_altitude_angle fog_density fog_distance fog_falloff wetness"
    )
    assert [str(parameter) for parameter in WeatherParameter] == names.split()


@pytest.mark.parametrize("parameter", WeatherParameter)
def test_clear_noon_lies_in_the_range(parameter: WeatherParameter) -> None:
    assert parameter.low < parameter.high
    parameter.check(parameter.clear_noon)


def test_clear_noon_is_dry_and_has_the_sun_up() -> None:
    assert WeatherParameter.PRECIPITATION.clear_noon == WeatherParameter.WETNESS.clear_noon == 0
    assert WeatherParameter.SUN_ALTITUDE_ANGLE.clear_noon > 0


@given(parameters, st.floats(0, 1))
def test_every_value_in_the_range_is_taken(parameter: WeatherParameter, share: float) -> None:
    parameter.check(parameter.low + share * (parameter.high - parameter.low))


@given(parameters, st.floats(min_value=1e-6) | st.just(math.nan), st.booleans())
def test_every_value_beyond_the_range_is_refused(parameter: WeatherParameter, excess: float, above: bool) -> None:
    value = parameter.high + excess if above else parameter.low - excess
    with pytest.raises(OntologyError, match=f"{parameter}.*{parameter.low:g} to {parameter.high:g}"):
        parameter.check(value)
