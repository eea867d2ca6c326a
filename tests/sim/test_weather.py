from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dorothie_gym.errors import OntologyError
from dorothie_gym.ontology import WeatherParameter
from dorothie_gym.sim.ego.limits import MAX_BRAKING
from dorothie_gym.sim.ego.obstacles import SIDE_MARGIN
from dorothie_gym.sim.sensing.perception import (
    MOST_SIGMAS,
    Perception,
    detection_probability,
    position_error,
    switch_lamps,
)
from dorothie_gym.sim.sensing.visibility import CLEAR_SIGHT, DENSEST_FOG, SHORTEST_SIGHT, Visibility
from dorothie_gym.sim.state.records import EyeRecord
from dorothie_gym.sim.weather import WET_LOSS, Weather
from dorothie_gym.support.compilation.records import empty_records

P = WeatherParameter
SHARES = st.floats(0.0, 1.0)
DISTANCES = st.floats(0.5, CLEAR_SIGHT)
SKIES = st.fixed_dictionaries({parameter: SHARES for parameter in P})

# what more of a parameter does to sight: less of it, more of it, nothing
DIMMING = (P.FOG_DENSITY, P.PRECIPITATION, P.CLOUDINESS)
CLEARING = (P.SUN_ALTITUDE_ANGLE, P.FOG_DISTANCE, P.FOG_FALLOFF)
IDLE = (P.WIND_INTENSITY, P.SUN_AZIMUTH_ANGLE, P.WETNESS, P.PRECIPITATION_DEPOSITS)
WETTING = (P.WETNESS, P.PRECIPITATION_DEPOSITS, P.PRECIPITATION)


@pytest.fixture(scope="module", autouse=True)
def compiled_before() -> None:
    """Compiles what the examples of properties call, which hypothesis times."""
    view = Weather().visibility(lights=True)
    detection_probability(view, 2 * view.sight)
    switch_lamps(empty_records(EyeRecord, 1)[0], True)


def weather_of(shares: dict[WeatherParameter, float]) -> Weather:
    weather = Weather()
    for parameter, share in shares.items():
        weather.set_share(parameter, share)
    return weather


def clear_but(parameter: WeatherParameter, value: float) -> Weather:
    weather = Weather()
    weather.set(parameter, value)
    return weather


@pytest.mark.parametrize("lights", [False, True])
def test_clear_noon_has_no_effect(lights: bool) -> None:
    weather = Weather()
    view = weather.visibility(lights=lights)
    assert weather.friction == 1.0
    assert weather.sight(lights=lights) == CLEAR_SIGHT
    assert view.is_clear
    for distance in (1.0, 20.0, 60.0, CLEAR_SIGHT):
        assert view.gain(distance) == 1.0
        assert detection_probability(view, distance) == 1.0
        assert position_error(view, distance) == (0.0, 0.0)


@given(SKIES, st.sampled_from(DIMMING + CLEARING + IDLE), SHARES, SHARES, st.booleans(), DISTANCES)
def test_each_parameter_acts_one_way_on_sight_and_detection(
    sky: dict[WeatherParameter, float], parameter: WeatherParameter, a: float, b: float, lights: bool, distance: float
) -> None:
    low, high = sorted((a, b))
    less, more = (weather_of({**sky, parameter: share}).visibility(lights=lights) for share in (low, high))
    if parameter in CLEARING:
        less, more = more, less
    if parameter in IDLE:
        assert less == more
    assert less.sight >= more.sight
    assert less.gain(distance) >= more.gain(distance)
    assert detection_probability(less, distance) >= detection_probability(more, distance)
    assert position_error(less, distance)[0] <= position_error(more, distance)[0]
    assert position_error(less, distance)[1] <= position_error(more, distance)[1]


@given(SKIES, st.booleans(), st.floats(0.0, 1.0), DISTANCES, DISTANCES)
def test_sight_is_bounded_and_detection_falls_with_distance(
    sky: dict[WeatherParameter, float], lights: bool, clarity: float, a: float, b: float
) -> None:
    view = weather_of(sky).visibility(lights=lights, clarity=clarity)
    near, far = sorted((a, b))
    assert SHORTEST_SIGHT <= view.sight <= CLEAR_SIGHT
    assert 0.0 <= view.gain(near) <= 1.0
    assert view.gain(far) <= view.gain(near)
    assert 0.0 <= detection_probability(view, far) <= detection_probability(view, near) <= 1.0
    assert position_error(view, far)[0] >= position_error(view, near)[0] >= 0.0
    assert detection_probability(view, view.sight) == 1.0


@given(SKIES, DISTANCES)
def test_headlights_never_reduce_sight(sky: dict[WeatherParameter, float], distance: float) -> None:
    weather = weather_of(sky)
    on, off = weather.visibility(lights=True), weather.visibility(lights=False)
    assert on.sight >= off.sight
    assert on.gain(distance) >= off.gain(distance)


@given(SKIES, st.booleans(), st.sampled_from([1.0, 0.25, 0.0]))
def test_switched_headlights_show_what_the_weather_allows(
    sky: dict[WeatherParameter, float], on: bool, clarity: float
) -> None:
    weather, perception = weather_of(sky), Perception(np.random.default_rng(0))
    switched, opened = empty_records(EyeRecord, 1), empty_records(EyeRecord, 1)
    perception.open(switched, weather.visibility(lights=not on, clarity=clarity))
    switch_lamps(switched[0], on)
    perception.open(opened, weather.visibility(lights=on, clarity=clarity))
    assert switched.tolist() == opened.tolist()


@given(SKIES, st.booleans())
def test_sight_ends_where_the_signal_does(sky: dict[WeatherParameter, float], lights: bool) -> None:
    view = weather_of(sky).visibility(lights=lights)
    if SHORTEST_SIGHT < view.sight < CLEAR_SIGHT:
        assert view.signal(view.sight) >= 1.0 > view.signal(view.sight + 1e-6)


def test_headlights_help_in_the_dark_only() -> None:
    night = clear_but(P.SUN_ALTITUDE_ANGLE, -90.0)
    assert 20.0 < night.sight(lights=False) < 25.0
    assert 35.0 < night.sight(lights=True) < 45.0
    assert clear_but(P.FOG_DENSITY, 50.0).sight(lights=True) == clear_but(P.FOG_DENSITY, 50.0).sight(lights=False)


def test_thickest_fog_leaves_five_percent_of_the_contrast_at_its_optical_range() -> None:
    weather = clear_but(P.FOG_DENSITY, 100.0)
    weather.set(P.FOG_FALLOFF, 0.0)
    weather.set(P.FOG_DISTANCE, 0.0)
    assert weather.visibility(lights=False).transmission(DENSEST_FOG) == pytest.approx(0.05)


def test_fog_start_distance_leaves_nearer_bodies_clear() -> None:
    weather = clear_but(P.FOG_DENSITY, 100.0)
    weather.set(P.FOG_DISTANCE, 30.0)
    view = weather.visibility(lights=False)
    assert view.gain(29.9) == 1.0
    assert view.gain(40.0) < 0.5


def test_visibility_in_rain_matches_measurements_of_drivers() -> None:
    # one inch an hour: 2000 ft at 40 mph (Ivey et al. 1975), where 5 % of the contrast are left
    view = clear_but(P.PRECIPITATION, 25.4).visibility(lights=False)
    assert view.transmission(2000 * 0.3048) == pytest.approx(0.05, rel=1e-6)


def test_illuminance_at_dusk_matches_the_almanac() -> None:
    lux = [clear_but(P.SUN_ALTITUDE_ANGLE, a).visibility(lights=False).light for a in (0.0, -6.0, -18.0)]
    assert lux == pytest.approx([502.0, 5.0, 2.0], rel=0.01)  # with 2 lx of the street's lamps


@given(SKIES, st.sampled_from(WETTING), SHARES, SHARES)
def test_water_reduces_grip_and_lengthens_braking(
    sky: dict[WeatherParameter, float], parameter: WeatherParameter, a: float, b: float
) -> None:
    low, high = sorted((a, b))
    drier, wetter = (weather_of({**sky, parameter: share}) for share in (low, high))
    assert 1.0 - WET_LOSS <= wetter.friction <= drier.friction <= 1.0
    assert wetter.braking_distance(10.0, MAX_BRAKING) >= drier.braking_distance(10.0, MAX_BRAKING)


@pytest.mark.parametrize("parameter", [parameter for parameter in P if parameter not in WETTING])
def test_dry_weather_keeps_the_grip(parameter: WeatherParameter) -> None:
    for share in (0.0, 1.0):
        assert weather_of({parameter: share}).friction == 1.0


def test_a_wet_road_brakes_as_measured() -> None:
    wet = clear_but(P.WETNESS, 100.0)
    assert wet.friction == pytest.approx(0.7, abs=0.01)
    assert Weather().braking_distance(50 / 3.6, MAX_BRAKING) == pytest.approx(12.06, abs=0.01)
    assert wet.braking_distance(50 / 3.6, MAX_BRAKING) == pytest.approx(12.06 / 0.702, abs=0.05)


def test_blur_halves_the_sight_of_a_clear_day() -> None:
    assert Weather().visibility(lights=False, clarity=0.25).sight == pytest.approx(CLEAR_SIGHT / 2)
    assert Weather().visibility(lights=False, clarity=0.0).sight == SHORTEST_SIGHT


@given(SKIES, st.booleans())
def test_position_errors_within_sight_are_bounded(sky: dict[WeatherParameter, float], lights: bool) -> None:
    view = weather_of(sky).visibility(lights=lights)
    sight = min(view.sight, 40.0)
    away, aside = position_error(view, sight)
    assert MOST_SIGMAS * away < 0.1 * sight
    assert MOST_SIGMAS * aside <= SIDE_MARGIN


def test_values_out_of_range_are_refused() -> None:
    with pytest.raises(OntologyError, match="fog_density"):
        Weather().set(P.FOG_DENSITY, 101.0)


def test_a_change_of_weather_shows_at_once() -> None:
    weather = Weather()
    before = weather.sight(lights=False)
    weather.set(P.FOG_DENSITY, 100.0)
    assert weather.sight(lights=False) < before
    weather.set(P.FOG_DENSITY, P.FOG_DENSITY.clear_noon)
    assert weather.sight(lights=False) == before


def test_clear_air_loses_nothing() -> None:
    assert Visibility().is_clear
    assert math.isinf(Visibility().light)
