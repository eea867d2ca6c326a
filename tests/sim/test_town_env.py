from __future__ import annotations

import math
import warnings
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium import spaces
from gymnasium.utils.env_checker import check_env
from highway_env.envs.common.abstract import AbstractEnv
from highway_env.vehicle.behavior import IDMVehicle
from highway_env.vehicle.controller import MDPVehicle
from highway_env.vehicle.dynamics import BicycleVehicle
from highway_env.vehicle.kinematics import Vehicle

from dorothie_gym.sim.bodies import Pedestrian, TrafficVehicle
from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.sim.town_env import TownEnv


def drive(env: TownEnv, seed: int, steps: int) -> list[tuple[float, bool, bool]]:
    env.reset(seed=seed)
    faster, idle = (env.action_type.actions_indexes[name] for name in ("FASTER", "IDLE"))
    results = []
    for _ in range(steps):
        _, reward, terminated, truncated, _ = env.step(faster if env.vehicle.speed < 4.0 else idle)
        results.append((reward, terminated, truncated))
        if terminated or truncated:
            break
    return results


def test_town_env_is_an_environment_of_highway_env() -> None:
    env = gym.make("dorothie_gym/Town-v0", config={"vehicles": 6}, town="brookside").unwrapped
    assert isinstance(env, AbstractEnv)
    assert isinstance(env.road.network, TownNetwork)
    assert len(env.road.vehicles) == 7
    assert all(isinstance(vehicle, IDMVehicle) for vehicle in env.road.vehicles[1:])
    assert all(isinstance(vehicle, TrafficVehicle) for vehicle in env.road.vehicles[1:])
    assert env.road.objects == []


def test_progress_on_the_road_is_rewarded() -> None:
    env = TownEnv({"vehicles": 0}, town="brookside")
    results = drive(env, seed=1, steps=15)
    assert env.vehicle.on_road
    assert results[-1][0] > 0.9 * env.vehicle.speed / env.config["reward_speed"] > 0.3


def test_episode_truncates_after_its_duration() -> None:
    assert [row[2] for row in drive(TownEnv({"vehicles": 0, "duration": 3.0}, town="brookside"), seed=1, steps=9)] == [
        False,
        False,
        True,
    ]


def test_crash_terminates_and_is_penalised() -> None:
    env = TownEnv({"vehicles": 0}, town="brookside")
    env.reset(seed=1)
    env.vehicle.crashed = True
    _, reward, terminated, truncated, info = env.step(1)
    assert terminated and not truncated
    assert info["rewards"]["collision"] == -1.0
    assert reward == pytest.approx(sum(info["rewards"].values()))


FEATURES = [
    "presence", "x", "y", "vx", "vy", "heading", "cos_h", "sin_h", "cos_d", "sin_d", "long_off", "lat_off", "ang_off",
]  # fmt: skip
KINEMATICS = {"type": "Kinematics"}
GREY = {
    "type": "GrayscaleObservation",
    "observation_shape": (48, 32),
    "stack_size": 3,
    "weights": [0.3, 0.6, 0.1],
    "scaling": 2.0,
}
OBSERVATIONS: dict[str, tuple[dict[str, Any], Any]] = {
    "kinematics": ({"type": "Kinematics"}, (5, 5)),
    "all features": ({**KINEMATICS, "features": FEATURES, "observe_intentions": True, "see_behind": True}, (5, 13)),
    "absolute": ({"type": "Kinematics", "absolute": True, "normalize": False, "vehicles_count": 9}, (9, 5)),
    "shuffled": ({"type": "Kinematics", "order": "shuffled", "include_obstacles": False}, (5, 5)),
    "grid": ({"type": "OccupancyGrid"}, (4, 11, 11)),
    "grid along": ({"type": "OccupancyGrid", "align_to_vehicle_axes": True, "features": ["vx", "cos_h"]}, (2, 11, 11)),
    "grid image": ({"type": "OccupancyGrid", "as_image": True, "features": ["presence", "vx"]}, (2, 11, 11)),
    "lidar": ({"type": "LidarObservation", "cells": 24, "maximum_range": 40.0}, (24, 2)),
    "lidar in metres": ({"type": "LidarObservation", "normalize": False}, (16, 2)),
    "time to collision": ({"type": "TimeToCollision", "horizon": 8}, (3, 3, 8)),
    "picture": (GREY, (3, 48, 32)),
    "attributes": ({"type": "AttributesObservation", "attributes": ["ego"]}, {"ego": (4,)}),
    "goal": (
        {"type": "KinematicsGoal", "features": ["x", "y", "vx", "vy"], "scales": [100, 100, 5, 5]},
        {"achieved_goal": (4,), "desired_goal": (4,), "observation": (4,)},
    ),
    "several": (
        {"type": "TupleObservation", "observation_configs": [KINEMATICS, {"type": "LidarObservation"}, GREY]},
        ((5, 5), (16, 2), (3, 48, 32)),
    ),
    "one of many": ({"type": "MultiAgentObservation", "observation_config": {"type": "Kinematics"}}, ((5, 5),)),
}


def shapes(observation: Any) -> Any:
    if isinstance(observation, dict):
        return {name: part.shape for name, part in observation.items()}
    return tuple(part.shape for part in observation) if isinstance(observation, tuple) else observation.shape


def parts(space: Any) -> list[Any]:
    return (
        [space] if isinstance(space, spaces.Box) else list(space.values() if isinstance(space, spaces.Dict) else space)
    )


@pytest.mark.long
@pytest.mark.parametrize("name", OBSERVATIONS)
def test_all_observation_types_work(name: str) -> None:
    config, shape = OBSERVATIONS[name]
    env = TownEnv({"observation": config, "pedestrians": 6}, town="brookside")
    observation, _ = env.reset(seed=3)
    env.action_space.seed(3)
    for _ in range(20):
        assert shapes(observation) == shape
        assert env.observation_space.contains(observation)
        observation = env.step(env.action_space.sample())[0]
    for space in parts(env.observation_space):
        assert np.isfinite([space.low, space.high]).all()
    if name == "picture":
        assert len(np.unique(observation)) > 3
    env.close()


META, CONTINUOUS, DISCRETE = ({"type": kind} for kind in ("DiscreteMetaAction", "ContinuousAction", "DiscreteAction"))
ACTIONS: dict[str, tuple[dict[str, Any], type[Vehicle], Any]] = {
    "meta": (META, MDPVehicle, spaces.Discrete(5)),
    "meta, speeds": ({**META, "lateral": False, "target_speeds": [0, 5]}, MDPVehicle, spaces.Discrete(3)),
    "meta, lanes": ({**META, "longitudinal": False, "target_speeds": [0, 5]}, MDPVehicle, spaces.Discrete(3)),
    "continuous": (CONTINUOUS, Vehicle, spaces.Box(-1, 1, (2,), np.float32)),
    "throttle": ({**CONTINUOUS, "lateral": False, "speed_range": [0, 9]}, Vehicle, spaces.Box(-1, 1, (1,), np.float32)),
    "wheel": ({**CONTINUOUS, "longitudinal": False}, Vehicle, spaces.Box(-1, 1, (1,), np.float32)),
    "dynamical": ({**CONTINUOUS, "dynamical": True}, BicycleVehicle, spaces.Box(-1, 1, (2,), np.float32)),
    "discrete": (DISCRETE, Vehicle, spaces.Discrete(9)),
    "discrete throttle": ({**DISCRETE, "lateral": False, "actions_per_axis": 5}, Vehicle, spaces.Discrete(5)),
    "one of many": (
        {"type": "MultiAgentAction", "action_config": META},
        MDPVehicle,
        spaces.Tuple([spaces.Discrete(5)]),
    ),
}


@pytest.mark.parametrize("name", ACTIONS)
def test_all_action_types_work(name: str) -> None:
    config, kind, space = ACTIONS[name]
    env = TownEnv({"action": config, "vehicles": 6}, town="brookside")
    observation, _ = env.reset(seed=3)
    env.action_space.seed(3)
    assert env.action_space == space
    assert type(env.vehicle) is kind
    for _ in range(20):
        observation = env.step(env.action_space.sample())[0]
        assert env.observation_space.contains(observation)
        record = env.road.arrays.vehicles[0]
        assert (record.x, record.y, record.speed) == (*env.vehicle.position, env.vehicle.speed)
        assert record.heading == env.vehicle.heading


def test_observed_rows_are_the_rows_of_the_arrays() -> None:
    features = ["x", "y", "vx", "vy", "heading", "cos_h", "sin_h", "long_off", "lat_off"]
    kinematics = {
        "type": "Kinematics",
        "features": features,
        "absolute": True,
        "normalize": False,
        "vehicles_count": 40,
    }
    env = TownEnv(
        {"observation": {**kinematics, "see_behind": True, "include_obstacles": False}, "vehicles": 15},
        town="brookside",
    )
    observation, _ = env.reset(seed=8)
    near = 0
    for _ in range(12):
        records = env.road.arrays.vehicles
        rows = np.stack(
            [
                records.x, records.y, records.speed * records.cos, records.speed * records.sin, records.heading,
                records.cos, records.sin, records.own_station, records.own_lateral,
            ], axis=1,
        ).astype(np.float32)  # fmt: skip
        assert (observation[0] == rows[0]).all()
        seen = {row.tobytes() for row in observation if row.any()}
        distances = np.hypot(records.x - records.x[0], records.y - records.y[0])
        assert seen == {
            row.tobytes() for row, far in zip(rows, distances, strict=True) if far < env.PERCEPTION_DISTANCE
        }
        near = max(near, len(seen))
        observation = env.step(env.action_type.actions_indexes["FASTER"])[0]
    assert near > 8


def test_continuous_actions_work() -> None:
    env = TownEnv({"action": {"type": "ContinuousAction"}}, town="brookside")
    env.reset(seed=3)
    env.step(np.array([1.0, 0.0], dtype=np.float32))
    assert env.vehicle.speed > 1.0


def test_rendering_shows_the_town() -> None:
    env = TownEnv(render_mode="rgb_array", town="brookside")
    env.reset(seed=3)
    picture = env.render()
    assert picture is not None and picture.shape == (600, 600, 3)
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 3
    env.close()


def test_the_same_seed_drives_the_same() -> None:
    assert drive(TownEnv(town="brookside"), 5, 12) == drive(TownEnv(town="brookside"), 5, 12)


def test_the_town_may_change_with_a_reset(tmp_path: Any) -> None:
    env = TownEnv({"vehicles": 2}, town="brookside")
    before = env.road.network
    env.reset(seed=1)
    assert env.road.network is before
    with pytest.raises(Exception, match="nowhere"):
        env.reset(options={"config": {"town": "nowhere"}})


def test_the_same_seed_and_actions_give_the_same_bytes() -> None:
    def play(env: TownEnv) -> list[bytes]:
        found = [env.reset(seed=11)[0].tobytes()]
        for action in (3, 3, 1, 0, 4, 2, 3, 1) * 2:
            observation, reward, *_ = env.step(action)
            found += [observation.tobytes(), np.float64(reward).tobytes(), env.road.arrays.tobytes()]
        return found

    env = TownEnv({"pedestrians": 8}, town="brookside")
    first = play(env)
    env.reset(seed=12)
    assert play(env) == first == play(TownEnv({"pedestrians": 8}, town="brookside"))
    assert len(set(first)) > len(first) // 2


@pytest.mark.parametrize("seed", range(4))
def test_all_others_are_present_and_none_is_close_at_the_start(seed: int) -> None:
    env = TownEnv({"vehicles": 20, "pedestrians": 15}, town="brookside")
    env.reset(seed=seed)
    others = [*env.road.vehicles[1:], *env.road.objects]
    assert (len(env.road.vehicles), len(env.road.objects)) == (21, 15)
    assert all(isinstance(thing, Pedestrian) for thing in env.road.objects)
    assert min(math.dist(other.position, env.vehicle.position) for other in others) >= 25.0
    before = np.array([other.position for other in others])
    for _ in range(4):
        env.step(env.action_type.actions_indexes["IDLE"])
    moved = np.linalg.norm(np.array([other.position for other in others]) - before, axis=1)
    assert (moved[:20] > 1.0).mean() > 0.6 and (moved[20:] > 1.0).mean() > 0.6


def test_a_town_that_is_too_small_for_all_takes_as_many_as_fit() -> None:
    env = TownEnv({"vehicles": 150}, town="brookside")
    assert 20 < len(env.road.vehicles) < 151
    env.step(1)


@pytest.mark.parametrize(("simulation", "policy"), [(15, 1), (15, 5), (5, 5), (12.5, 2.5), (4, 0.5)])
def test_ego_drives_as_long_as_the_clock_says(simulation: float, policy: float) -> None:
    settings = {"vehicles": 0, "action": {"type": "ContinuousAction"}, "duration": 20.0}
    env = TownEnv({**settings, "simulation_frequency": simulation, "policy_frequency": policy}, town="brookside")
    env.reset(seed=0)
    env.vehicle.speed, (x, y) = 2.0, env.vehicle.position
    while env.time < 4.0:
        env.step(np.zeros(2, dtype=np.float32))
    assert math.hypot(env.vehicle.position[0] - x, env.vehicle.position[1] - y) == pytest.approx(2.0 * env.time)


@pytest.mark.parametrize(("simulation", "policy"), [(15, 4), (15, 20), (15, 0.1), (15, 0), (0, 1), (15, -5)])
def test_frequencies_that_would_lose_time_are_refused(simulation: float, policy: float) -> None:
    env = TownEnv({"vehicles": 0}, town="brookside")
    settings = {"simulation_frequency": simulation, "policy_frequency": policy}
    with pytest.raises(ValueError, match=f"simulation_frequency is {simulation} and policy_frequency {policy}"):
        TownEnv({"vehicles": 0, **settings}, town="brookside")
    with pytest.raises(ValueError, match=f"policy_frequency {policy}"):
        env.reset(options={"config": settings})


@pytest.mark.parametrize("frequency", ["15", None, math.nan, math.inf, 1e-320, 10**400, [15]])
def test_frequencies_that_are_no_numbers_are_refused(frequency: object) -> None:
    for name in ("simulation_frequency", "policy_frequency"):
        with pytest.raises(ValueError, match="both must be numbers from 0.001 to 10000"):
            TownEnv({"vehicles": 0, name: frequency}, town="brookside")


def test_touching_a_pedestrian_is_an_observed_crash() -> None:
    env = TownEnv(
        {"vehicles": 1, "pedestrians": 1, "action": {"type": "ContinuousAction"}, "policy_frequency": 5},
        town="brookside",
    )
    for thing in (lambda: env.road.vehicles[1], lambda: env.road.objects[0]):
        env.reset(seed=2)
        other = thing()
        env.vehicle.position = other.position - 8.0 * np.array([math.cos(0.3), math.sin(0.3)])
        env.vehicle.heading, env.vehicle.speed = 0.3, 12.0
        for _ in range(12):
            _, _, terminated, _, info = env.step(np.zeros(2, dtype=np.float32))
            if terminated:
                break
        assert terminated and other.crashed
        assert info["crashed"] and info["rewards"]["collision"] == -1.0


def test_gymnasiums_checker_passes_without_warnings() -> None:
    env = gym.make("dorothie_gym/Town-v0", disable_env_checker=True, town="brookside").unwrapped
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env, skip_render_check=True)


def test_stable_baselines_checker_passes_without_warnings() -> None:
    checker = pytest.importorskip("stable_baselines3.common.env_checker")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # highway-env's `Kinematics` is a table, which a policy of vectors flattens
        warnings.filterwarnings("ignore", message="Your observation  has an unconventional shape")
        checker.check_env(TownEnv(town="brookside"), warn=True)


def test_simplified_and_changed_copies_are_independent() -> None:
    env = TownEnv({"vehicles": 20, "town": "northgate"})
    env.reset(seed=3)
    env.step(3)
    state = env.road.arrays.tobytes()
    simple = env.simplify()
    assert 1 < len(simple.road.vehicles) < 21
    simple.step(1)
    assert (simple.road.arrays.vehicles.kind != 0).sum() == len(simple.road.vehicles)
    changed = env.change_vehicles("highway_env.vehicle.behavior.IDMVehicle")
    assert {type(vehicle) for vehicle in changed.road.vehicles} == {MDPVehicle, IDMVehicle}
    places = [vehicle.position.copy() for vehicle in changed.road.vehicles]
    changed.step(1)
    moved = [math.dist(v.position, place) for v, place in zip(changed.road.vehicles, places, strict=True)]
    assert max(moved[1:]) > 1.0
    assert len(changed.road.vehicles) == 21 == (changed.road.arrays.vehicles.kind != 0).sum()
    slow = env.set_vehicle_field(("target_speed", 2.0))
    assert all(vehicle.target_speed == 2.0 for vehicle in slow.road.vehicles)
    for other in (env.set_preferred_lane(1), env.set_route_at_intersection("random"), env.randomize_behavior()):
        other.step(1)
    assert env.road.arrays.tobytes() == state


def test_traces_are_drawn() -> None:
    env = TownEnv(
        {"show_trajectories": True, "vehicles": 5, "pedestrians": 3}, render_mode="rgb_array", town="brookside"
    )
    env.reset(seed=3)
    for _ in range(2):
        env.step(3)
    assert all(len(vehicle.history) == 30 for vehicle in env.road.vehicles)
    assert env.render().shape == (600, 600, 3)
    env.close()
