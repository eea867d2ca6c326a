"""Several cameras and the sensors of the car as fields of observations."""

from __future__ import annotations

import itertools
import math
import warnings
from copy import deepcopy
from dataclasses import replace
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from dorothie_gym import (
    CameraConfig,
    CameraMount,
    CameraOutput,
    DuoWizardEnv,
    DuoWizardVectorEnv,
    EnvConfig,
    LidarConfig,
    LidarOutput,
    RadarConfig,
    Role,
    SensorConfig,
    SensorMount,
    make_policy,
)
from dorothie_gym.maps.model import LANE_CHANGES
from dorothie_gym.ontology import ObjectClass, Sensor
from dorothie_gym.session.car_sensors import CarSensors, CollisionColumn, GnssColumn, LaneMarking
from dorothie_gym.session.providers import lines_of
from dorothie_gym.session.spaces.observations import ObservationMapping
from dorothie_gym.sim.config import FRAME_RATE, WorldConfig
from dorothie_gym.sim.sensing.inertial import ACCELEROMETER_NOISE, COMPASS_NOISE, EARTH_RADIUS, GRAVITY
from dorothie_gym.support.compilation.records import plain
from tests.session.random_play import played

with warnings.catch_warnings():
    warnings.simplefilter("ignore", DeprecationWarning)  # of PettingZoo's own environments
    from pettingzoo.test import parallel_api_test

SMALL = CameraConfig(width=48, height=32)
SIDES = {
    "left": replace(SMALL, mount=CameraMount(yaw=-90.0)),
    "rear": replace(SMALL, mount=CameraMount(yaw=180.0), outputs=(CameraOutput.RGB, CameraOutput.DEPTH)),
}
PLAIN = SensorConfig(imu=True, gnss=True, lane_invasion=True, collision=True)
LIDAR = LidarConfig(channels=8, columns=90, outputs=tuple(LidarOutput))
CONFIG = EnvConfig(
    camera=replace(SMALL, outputs=(CameraOutput.RGB, CameraOutput.OPTICAL_FLOW)),
    cameras=SIDES,
    sensors=replace(PLAIN, lidar=LIDAR, radar=RadarConfig(rows=2, columns=16)),
)
MEASURED = {
    "lidar", "lidar_semantic", "lidar_instance", "radar", "accelerometer", "gyroscope", "compass", "gnss",
    "lane_invasion", "collision",
}  # fmt: skip
PICTURED = {"camera", "optical_flow", "left_camera", "rear_camera", "rear_depth"}


def test_each_role_observes_its_cameras_and_sensors() -> None:
    env, without = DuoWizardEnv("brookside", config=CONFIG), DuoWizardEnv("brookside", config=EnvConfig())
    seen, expected = played(env), played(without)
    added = {agent: set(seen[agent]) - set(expected[agent]) for agent in seen}
    assert added == {"participant": PICTURED, "co_wizard": PICTURED | MEASURED, "ad_wizard": set()}
    for agent, observation in seen.items():
        assert env.observation_space(agent).contains(observation)
        for name, value in expected[agent].items():
            np.testing.assert_array_equal(observation[name], value)
    assert seen["co_wizard"]["lidar"].shape == (8, 90, 4) and seen["co_wizard"]["radar"].shape == (32, 4)
    assert seen["co_wizard"]["accelerometer"].shape == (15, 3)
    pictures = [seen["co_wizard"][name] for name in ("camera", "left_camera", "rear_camera")]
    assert all((one != other).mean() > 0.2 for one, other in itertools.pairwise(pictures))
    rear = env.session.observer.picture(env.session.decisions, "rear")
    assert rear is not None and env.session.observer.picture(env.session.decisions, "roof") is None
    np.testing.assert_array_equal(rear.depth, seen["participant"]["rear_depth"])
    for name in (*MEASURED, *PICTURED):
        seen["co_wizard"][name][...] = 0  # the caller's own
    again = env.session.observations()["co_wizard"]
    assert again["left_camera"].any() and again["lidar"].any() and again["accelerometer"].any()


def test_sensors_change_no_event() -> None:
    env, without = DuoWizardEnv("brookside", config=CONFIG), DuoWizardEnv("brookside", config=EnvConfig())
    for each in (env, without):
        each.reset(seed=5)
    for _ in range(12):
        actions = {agent: without.action_space(agent).sample() for agent in without.agents}
        for each in (env, without):
            each.step(deepcopy(actions))
        assert env.last_events == without.last_events
    assert env.session_header() == without.session_header()


def test_what_is_read_late_is_what_is_read_at_once() -> None:
    """Pictures are drawn when they are read; optical flow and sensors still cover the last decision."""
    env, lazy = (DuoWizardEnv("brookside", config=CONFIG) for _ in range(2))
    expected = played(env, 5)
    engine = lazy.engine
    engine.reset(seed=3)
    for agent in lazy.possible_agents:
        lazy.action_space(agent).seed(3)
    for _ in range(5):
        engine.step({agent: lazy.action_space(agent).sample() for agent in lazy.possible_agents})
    late = engine.observations["co_wizard"]
    for name in (*MEASURED, *PICTURED):
        np.testing.assert_array_equal(late[name], expected["co_wizard"][name], err_msg=name)


def test_copies_and_states_continue_with_equal_readings() -> None:
    env = DuoWizardEnv("brookside", config=CONFIG)
    played(env)
    state, copy = env.clone_state(), deepcopy(env)
    actions = {agent: env.action_space(agent).sample() for agent in env.agents}
    after = [each.step(deepcopy(actions))[0]["co_wizard"] for each in (env, copy)]
    env.restore_state(state)
    after.append(env.step(deepcopy(actions))[0]["co_wizard"])
    for name in (*MEASURED, *PICTURED):
        for other in after[1:]:
            np.testing.assert_array_equal(other[name], after[0][name], err_msg=name)


@pytest.mark.long
def test_environments_pass_the_checks_of_gymnasium_and_pettingzoo() -> None:
    config = replace(CONFIG, cameras={"left": SIDES["left"]})  # depths are infinite, against which Gymnasium warns
    parallel_api_test(DuoWizardEnv("brookside", config=config), num_cycles=4)
    pictured = PICTURED - {"rear_camera", "rear_depth"}
    for name, more in (("CoWizard", pictured | MEASURED), ("Participant", pictured), ("AdWizard", set())):
        env = gym.make(f"dorothie_gym/{name}-v0", config=config, town="brookside")
        assert isinstance(env.observation_space, gym.spaces.Dict)
        assert set(env.observation_space.spaces) & (PICTURED | MEASURED) == more
        check_env(env.unwrapped, skip_render_check=True)


def test_batches_have_the_fields_of_single_environments() -> None:
    batch, single = DuoWizardVectorEnv(2, town="brookside", config=CONFIG), DuoWizardEnv("brookside", config=CONFIG)
    observations, _ = batch.reset(seed=[3, 4])
    expected, _ = single.reset(seed=4)
    for agent in batch.possible_agents:
        single.action_space(agent).seed(0)
    for _ in range(3):
        actions = {agent: single.action_space(agent).sample() for agent in single.agents}
        observations, *_ = batch.step([deepcopy(actions) for _ in range(2)])
        expected, *_ = single.step(actions)
    for agent, names in (("participant", PICTURED), ("co_wizard", PICTURED | MEASURED), ("ad_wizard", set())):
        assert set(observations[agent]) & (PICTURED | MEASURED) == names
        assert batch.observation_spaces[agent].contains(observations[agent])
        for name in names:
            np.testing.assert_array_equal(observations[agent][name][1], expected[agent][name], err_msg=name)
    batch.close()


def test_settings_are_read_from_mappings() -> None:
    mapping = {"cameras": {"left": {"width": 48, "height": 32}}, "sensors": {"lidar": {"channels": 4, "columns": 16}}}
    env = DuoWizardEnv("brookside", config=mapping)
    assert env.engine.config == EnvConfig(
        cameras={"left": SMALL}, sensors=SensorConfig(lidar=LidarConfig(channels=4, columns=16))
    )


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"cameras": (SMALL,)}, r"EnvConfig\.cameras is a tuple; it must map names to "),
        ({"cameras": {"Left side": SMALL}}, r"has the name 'Left side'; it must be a lower-case word"),
        ({"cameras": {"lidar": SMALL}}, r"has the name 'lidar', with which the fields of the lidar begin"),
        ({"cameras": {"left": 3}}, r"EnvConfig\.cameras\['left'\] is a int; it must be a CameraConfig"),
        ({"sensors": LIDAR}, r"EnvConfig\.sensors is a LidarConfig; it must be a SensorConfig"),
    ],
)
def test_settings_that_no_car_has_are_refused(settings: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        EnvConfig(**settings)


@pytest.mark.parametrize(
    ("kind", "settings", "message"),
    [
        (LidarConfig, {"channels": 0}, r"LidarConfig\.channels is 0; it must be a whole number in 1\.\.256"),
        (LidarConfig, {"range": 900.0}, r"LidarConfig\.range is 900\.0; it must be in 1\.\.250 m"),
        (LidarConfig, {"upper_fov": -40.0}, r"LidarConfig\.lower_fov is -30\.0; it must be below upper_fov"),
        (LidarConfig, {"outputs": ("smell",)}, r"LidarConfig\.outputs contains 'smell'; it must be of points"),
        (RadarConfig, {"horizontal_fov": "wide"}, r"RadarConfig\.horizontal_fov is 'wide'"),
        (SensorConfig, {"imu": 1}, r"SensorConfig\.imu is 1; it must be True or False"),
        (SensorConfig, {"lidar": SMALL}, r"SensorConfig\.lidar is a CameraConfig; it must be a LidarConfig or None"),
        (SensorMount, {"yaw": 270.0}, r"SensorMount\.yaw is 270\.0; it must be in -180\.\.180 degrees"),
        (CameraMount, {"roll": math.nan}, r"CameraMount\.roll is nan"),
    ],
)
def test_settings_that_no_sensor_has_are_refused(kind: type, settings: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        kind(**settings)


def test_outputs_may_be_given_by_their_names() -> None:
    camera = replace(SMALL, outputs=("rgb", "depth"))  # type: ignore[arg-type]
    lidar = replace(LIDAR, outputs=("points", "semantic"))  # type: ignore[arg-type]
    env = DuoWizardEnv("brookside", config=EnvConfig(camera=camera, sensors=SensorConfig(lidar=lidar)))
    seen = env.reset(seed=3)[0]["co_wizard"]
    assert {"camera", "depth", "lidar", "lidar_semantic"} <= set(seen)
    assert env.observation_space("co_wizard").contains(seen)


# --- Sensors without pictures -----------------------------------------------------------------------------------------


def scripted(config: EnvConfig, seed: int, decisions: int) -> tuple[DuoWizardEnv, list[ObservationMapping]]:
    """Returns an environment and the Co-Wizard's observations of a session of scripted roles."""
    env = DuoWizardEnv("midtown", config=config)
    observations, _ = env.reset(seed=seed)
    policies = {agent: make_policy("scripted", Role(agent), env.limits) for agent in env.agents}
    states = {agent: policy.initial_state(seed, env.town) for agent, policy in policies.items()}
    seen = [observations["co_wizard"]]
    while len(seen) <= decisions and env.agents:
        actions = {}
        for agent in env.agents:
            actions[agent], states[agent] = policies[agent].step(observations[agent], states[agent])
        observations, *_ = env.step(actions)
        seen.append(observations["co_wizard"])
    return env, seen


@pytest.fixture(scope="module")
def drive() -> tuple[DuoWizardEnv, list[ObservationMapping]]:
    return scripted(EnvConfig(sensors=PLAIN, world=WorldConfig(vehicles=0, pedestrians=0)), 2, 160)


def test_the_inertial_unit_integrates_to_the_motion_of_the_car(
    drive: tuple[DuoWizardEnv, list[ObservationMapping]],
) -> None:
    _, seen = drive
    level, turned, sped = 0, 0.0, 0.0
    for before, after in itertools.pairwise(seen):
        force = after["accelerometer"]
        change = float(force[:, 0].sum()) / FRAME_RATE
        gained = float(after["speed"][0] - before["speed"][0])
        level += abs(change - gained) < 0.1 + 0.1 * abs(gained)
        turned += float(after["gyroscope"][:, 2].sum()) / FRAME_RATE
        sped = max(sped, abs(gained))
        assert np.abs(force[:, 2] - GRAVITY).max() < 8.0 * ACCELEROMETER_NOISE
    assert level > 0.9 * (len(seen) - 1) and sped > 1.0
    first, last = seen[0]["compass"][0], seen[-1]["compass"][0]
    drift = (turned - (last - first) + math.pi) % (2.0 * math.pi) - math.pi
    assert abs(drift) < math.radians(0.6) * 80.0 / 2.0  # the bias of the gyroscope
    assert abs(turned) > 1.0


def test_the_compass_points_north(drive: tuple[DuoWizardEnv, list[ObservationMapping]]) -> None:
    env, seen = drive
    heading = float(env.session.world.car.heading)
    north = math.atan2(math.cos(heading), math.sin(heading) * -1.0)  # east, north: y points south
    error = (seen[-1]["compass"][0] - north + math.pi) % (2.0 * math.pi) - math.pi
    assert 0.0 < abs(error) < 5.0 * COMPASS_NOISE


def test_the_receiver_gives_fixes_near_the_car_and_ages_without_gps() -> None:
    env = DuoWizardEnv("brookside", config=EnvConfig(sensors=PLAIN))
    observation = played(env, 3)["co_wizard"]
    world = env.session.world

    def off(gnss: Any) -> float:
        scale = math.radians(1.0) * EARTH_RADIUS
        x, y = world.car.position.tolist()
        return math.hypot(gnss[GnssColumn.LONGITUDE] * scale - x, gnss[GnssColumn.LATITUDE] * scale + y)

    assert observation["gnss"][GnssColumn.AGE] == 0.0
    assert 0.0 < off(observation["gnss"]) < 3.0
    assert world.set_fault(Sensor.GPS, True) is None
    idle = {agent: env.action_space(agent).sample() for agent in env.agents}
    for action in idle.values():
        action.update({name: np.int64(0) for name in ("physical", "exception") if name in action})
    ages = [env.step(deepcopy(idle))[0]["co_wizard"]["gnss"] for _ in range(3)]
    assert [row[GnssColumn.AGE] for row in ages] == [0.5, 1.0, 1.5]
    assert all((row[:2] == observation["gnss"][:2]).all() for row in ages)


def test_lines_that_the_wheels_cross_are_reported(drive: tuple[DuoWizardEnv, list[ObservationMapping]]) -> None:
    env, seen = drive
    crossed = np.array([observation["lane_invasion"] for observation in seen])
    assert not crossed[0].any()
    assert crossed.any(axis=1).mean() < 0.3  # it drives inside its lane
    world = env.session.world
    beside = next(
        link for link in world.town.links if link.type in LANE_CHANGES and world.town.lanes[link.source].length > 50.0
    )
    one, other = world.town.lanes[beside.source], world.town.lanes[beside.target]
    start, end = one.position(20.0), other.position(min(25.0, other.length))
    world.frames = np.zeros((2, 9))
    car = plain(world.actors.arrays.vehicles)[0]
    car["height"] = one.height_at(20.0)
    heading = one.heading_at(20.0)
    world.frames[:, 1:3], world.frames[:, 3] = (start, end), heading
    sensors = CarSensors(world, env.engine.config, lines_of)
    assert sensors.readings["lane_invasion"][LaneMarking.LANE] == 1


def test_collisions_are_reported_with_the_other_body() -> None:
    env = DuoWizardEnv("brookside", config=EnvConfig(sensors=PLAIN, world=WorldConfig(vehicles=12, pedestrians=0)))
    env.reset(seed=3)
    arrays = env.session.world.actors.arrays
    car, other = plain(arrays.vehicles)[0], plain(arrays.vehicles)[1]
    car["speed"] = 6.0
    for name in ("heading", "cos", "sin", "height"):
        other[name] = car[name]
    other["x"], other["y"] = car["x"] + 4.6 * car["cos"], car["y"] + 4.6 * car["sin"]
    other["speed"] = 0.0
    env.session.world.car.refresh()
    actions = {agent: env.action_space(agent).sample() for agent in env.agents}
    table = env.step(actions)[0]["co_wizard"]["collision"]
    assert table[0, CollisionColumn.KIND] == ObjectClass.VEHICLES.value
    assert table[0, CollisionColumn.SPEED] > 1.0 and 0.0 < table[0, CollisionColumn.TIME] <= 0.5
    assert not table[1:].any()
