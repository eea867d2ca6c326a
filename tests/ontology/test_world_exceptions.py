import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dorothie_gym.errors import OntologyError
from dorothie_gym.ontology import ExceptionKind, PropKind, Sensor, WeatherParameter


def test_ids_are_those_of_the_contract() -> None:
    assert [int(kind) for kind in ExceptionKind] == list(range(12))
    assert int(ExceptionKind.MESSAGE) == 11


def test_environmental_and_task_kinds_cover_all_but_none_and_message() -> None:
    neither = [kind for kind in ExceptionKind if not kind.is_environmental and not kind.is_task]
    assert neither == [ExceptionKind.NONE, ExceptionKind.MESSAGE]
    assert not any(kind.is_environmental and kind.is_task for kind in ExceptionKind)


def test_plan_level_exceptions_are_environmental() -> None:
    assert {kind.label for kind in ExceptionKind if kind.is_plan_level} == {"PlaceProp", "MoveProp", "DeleteProp"}
    assert all(kind.is_environmental for kind in ExceptionKind if kind.is_plan_level)


def test_sensors() -> None:
    assert [sensor.value for sensor in Sensor] == ["blur", "gps", "view"]


def test_names_are_those_of_the_original_tool() -> None:
    assert {kind.value for kind in PropKind} == {
        "tree",
        "constructioncone",
        "dumpster",
        "streetbarrier",
        "trafficcone",
        "trafficsign",
    }


@pytest.mark.parametrize("kind", PropKind)
def test_sizes_are_those_of_street_furniture(kind: PropKind) -> None:
    assert 0.05 < kind.length < 4 and 0.05 < kind.width < 4 and 0.3 < kind.height < 10


def test_barrier_blocks_with_its_width() -> None:
    assert PropKind.STREET_BARRIER.width > 2 > PropKind.STREET_BARRIER.length


def test_kind_is_found_by_name() -> None:
    assert PropKind("trafficcone") is PropKind.TRAFFIC_CONE
    assert PropKind.TRAFFIC_CONE.blueprint == "static.prop.trafficcone"


parameters = st.sampled_from(WeatherParameter)


def test_names_are_those_of_carla() -> None:
    names = (
        "cloudiness precipitation precipitation_deposits wind_intensity sun_azimuth_angle "
        "sun_altitude_angle fog_density fog_distance fog_falloff wetness"
    )
    assert [str(parameter) for parameter in WeatherParameter] == names.split()


@pytest.mark.parametrize("parameter", WeatherParameter)
def test_clear_noon_is_in_range(parameter: WeatherParameter) -> None:
    assert parameter.low < parameter.high
    parameter.check(parameter.clear_noon)


def test_clear_noon_is_dry_and_has_the_sun_up() -> None:
    assert WeatherParameter.PRECIPITATION.clear_noon == WeatherParameter.WETNESS.clear_noon == 0
    assert WeatherParameter.SUN_ALTITUDE_ANGLE.clear_noon > 0


@given(parameters, st.floats(0, 1))
def test_values_in_range_are_accepted(parameter: WeatherParameter, share: float) -> None:
    parameter.check(parameter.low + share * (parameter.high - parameter.low))


@given(parameters, st.floats(min_value=1e-6) | st.just(math.nan), st.booleans())
def test_values_out_of_range_raise_error(parameter: WeatherParameter, excess: float, above: bool) -> None:
    value = parameter.high + excess if above else parameter.low - excess
    with pytest.raises(OntologyError, match=f"{parameter}.*{parameter.low:g} to {parameter.high:g}"):
        parameter.check(value)
