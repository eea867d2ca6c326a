"""What agents tell from how far they see."""

from __future__ import annotations

import numpy as np
import pytest

from dorothie_gym.ontology import Role, Sensor, WeatherParameter
from dorothie_gym.policies.view_range import Limit, camera_fault, limit_of, sight_in_weather, suitable_speed
from dorothie_gym.sim.sensing.visibility import CLEAR_SIGHT, SHORTEST_SIGHT
from dorothie_gym.sim.weather import Weather
from tests.policies.walk import play

W = WeatherParameter
CLARITY = {None: 1.0, Sensor.BLUR: 0.25, Sensor.VIEW: 0.0}


def observed(fault: Sensor | None = None, *, lights: bool = False, **values: float):
    """What is observed in some weather, with a fault of the camera."""
    weather = Weather()
    for name, value in values.items():
        weather.set(W(name), value)
    distance = weather.visibility(lights=lights, clarity=CLARITY[fault]).sight
    row = np.array([weather.values[parameter] for parameter in W])
    return {"weather": row, "lights": np.int64(lights), "sight": np.array([distance])}


@pytest.mark.parametrize("values", [{}, {"fog_density": 40.0}, {"precipitation": 80.0}, {"sun_altitude_angle": -3.0}])
@pytest.mark.parametrize("fault", [None, Sensor.BLUR, Sensor.VIEW])
def test_fault_of_the_camera_is_inferred_from_what_the_weather_does_not_explain(values, fault):
    seen = observed(fault, **values)
    assert camera_fault(seen) is fault
    assert (limit_of(seen) is Limit.CAMERA) is (fault is not None)


def test_sight_in_the_dark_counts_the_head_lights():
    dark, lit = observed(sun_altitude_angle=-30.0), observed(sun_altitude_angle=-30.0, lights=True)
    assert sight_in_weather(dark) < sight_in_weather(lit) < CLEAR_SIGHT
    assert camera_fault(dark) is None and camera_fault(lit) is None


def test_speed_grows_with_the_sight():
    speeds = [suitable_speed(distance) for distance in np.linspace(SHORTEST_SIGHT, CLEAR_SIGHT, 30)]
    assert speeds == sorted(speeds)
    assert len(set(speeds)) >= 6
    assert all(speed % 5 == 0 for speed in speeds)


def test_both_roles_observe_the_sight_of_the_world():
    played = play(3, decisions=40)
    for role in (Role.PARTICIPANT, Role.CO_WIZARD):
        assert float(played.observations[-1][role]["sight"][0]) == pytest.approx(CLEAR_SIGHT)
