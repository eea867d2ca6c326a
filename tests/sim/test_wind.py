from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dorothie_gym.ontology import WeatherParameter
from dorothie_gym.sim.weather import GALE, Wind, drift_angle
from tests.sim.driving import long_lane, network, world_at

TIMES = st.floats(0.0, 900.0)


@given(TIMES, st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_more_intensity_is_more_wind(time: float, a: float, b: float) -> None:
    wind = Wind(np.random.default_rng(0))
    low, high = sorted((a, b))
    assert 0.0 <= wind.speed(low, time) <= wind.speed(high, time) <= 2.0 * GALE


@given(st.floats(0.0, GALE), st.floats(0.0, GALE), st.floats(0.1, 25.0))
def test_drift_grows_with_the_wind_in_its_direction(a: float, b: float, speed: float) -> None:
    low, high = sorted((a, b))
    assert 0.0 <= drift_angle(low, math.pi / 2, speed) <= drift_angle(high, math.pi / 2, speed) < 0.02
    assert drift_angle(high, -math.pi / 2, speed) == pytest.approx(-drift_angle(high, math.pi / 2, speed))


def test_side_force_of_a_gale_matches_the_textbook() -> None:
    # rho / 2 * A * C * V * w = 0.6 * 2.2 * 1.2 * 28.3 m/s * 20 m/s = 896 N, over 120 kN/rad
    assert drift_angle(20.0, math.pi / 2, 20.0) == pytest.approx(896 / 1.2e5, rel=1e-3)


def test_gusts_vary_about_the_mean() -> None:
    speeds = [
        Wind(np.random.default_rng(seed)).speed(0.5, time) for seed in range(20) for time in np.arange(0, 60, 0.7)
    ]
    assert np.mean(speeds) == pytest.approx(GALE / 2, rel=0.05)
    assert np.std(speeds) == pytest.approx(0.25 * GALE / 2, rel=0.1)


def test_a_standing_car_and_a_calm_day_have_no_drift() -> None:
    wind = Wind(np.random.default_rng(1))
    assert wind.drift(0.0, 3.0, heading=0.0, speed=10.0) == 0.0
    assert wind.drift(1.0, 3.0, heading=0.0, speed=0.0) == 0.0


def path_offsets(intensity: float) -> np.ndarray:
    world = world_at("brookside", long_lane(network("brookside").town), 2.0)
    world.weather.set(WeatherParameter.WIND_INTENSITY, intensity)
    world.wind.heading = float(world.car.heading) + math.pi / 2  # blows to the right
    offsets = []
    for _ in range(40):
        world.step(5)
        offsets.append(world.planner.offset)
    return np.array(offsets)


def test_wind_pushes_the_car_and_the_car_steers_against_it() -> None:
    calm, gale = path_offsets(WeatherParameter.WIND_INTENSITY.clear_noon), path_offsets(100.0)
    assert (gale - calm).max() > 0.01
    assert np.abs(gale).max() < 0.15
