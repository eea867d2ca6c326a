"""`Town-v0` many times over, against highway-env's own vehicles and observations, and Gymnasium's conventions."""

from __future__ import annotations

import os
import subprocess
import sys
from types import SimpleNamespace
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from highway_env.envs.common.action import ContinuousAction, DiscreteMetaAction
from highway_env.envs.common.observation import KinematicObservation
from highway_env.vehicle.controller import MDPVehicle
from highway_env.vehicle.kinematics import Vehicle

from dorothie_gym.sim.batch.town_vector_env import TownVectorEnv
from dorothie_gym.sim.randomness import choose
from dorothie_gym.sim.road import TownRoad
from dorothie_gym.sim.state.codes import Kind
from dorothie_gym.sim.town_env import TownEnv

LONELY = {"vehicles": 0, "duration": 1e6}
IDLE, FASTER = 1, 3


class Lot:
    """The random numbers of a vehicle in the arrays, drawn as stock draws."""

    def __init__(self, random: int) -> None:
        self.random = np.zeros(1, dtype=[("random", "i8")]).view(np.recarray)
        self.random.random = random

    def choice(self, count: int) -> int:
        return choose(self.random[0], count)


def stock_road(env: TownVectorEnv, number: int = 0) -> TownRoad:
    return TownRoad(env._network, np_random=Lot(int(env.world(number).vehicles.random[0])))  # type: ignore[arg-type]  # a substitute for the random generator


def same_place(row: Any, stock: Vehicle) -> None:
    found = [row.x, row.y, row.heading, row.speed]
    assert found == pytest.approx([*stock.position, stock.heading, stock.speed], abs=1e-9)


def stock_reward(env: TownVectorEnv, stock: Vehicle) -> float:
    return sum(TownEnv._rewards(SimpleNamespace(vehicle=stock, config=env.config), None).values())  # type: ignore[arg-type]  # a substitute for the environment


# --- the ego is highway-env's -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("town", ["brookside", "northgate"])
@pytest.mark.parametrize("policy_frequency", [1, 5])
def test_lone_egos_drive_as_highway_envs_for_300_substeps(town: str, policy_frequency: int) -> None:
    env = TownVectorEnv(6, {**LONELY, "town": town, "policy_frequency": policy_frequency})
    env.reset(seed=7)
    stock_actions = DiscreteMetaAction.ACTIONS_ALL
    roads = [stock_road(env, k) for k in range(6)]
    for k, road in enumerate(roads):
        start = env.world(k).vehicles[0]
        road.vehicles.append(
            MDPVehicle(road, [start.x, start.y], start.heading, target_speeds=env.config["action"]["target_speeds"])
        )
    rng, changes, rewarded = np.random.default_rng(1), 0, 0
    for _ in range(20 * policy_frequency):
        actions = rng.choice(5, size=6, p=[0.15, 0.25, 0.15, 0.35, 0.1])
        _, rewards, *_ = env.step(actions)
        for k, road in enumerate(roads):
            (stock,) = road.vehicles
            before = stock.target_lane_index
            stock.act(stock_actions[int(actions[k])])
            for _ in range(15 // policy_frequency):
                road.act()
                road.step(1 / 15)
            changes += stock.target_lane_index != before
            same_place(env.world(k).vehicles[0], stock)
            if int(env.world(k).vehicles.lane[0]) == env._network.lane_id(stock.lane_index):
                assert rewards[k] == pytest.approx(stock_reward(env, stock), abs=1e-9)
                rewarded += 1
    assert rewarded > 110 * policy_frequency  # stock does not tell a bridge from the road below
    assert changes > 8


@pytest.mark.parametrize("config", [{}, {"speed_range": [-1.0, 3.0]}, {"lateral": False}, {"clip": False}])
def test_continuous_actions_drive_as_highway_envs_also_in_reverse(config: dict[str, Any]) -> None:
    env = TownVectorEnv(4, {**LONELY, "action": {"type": "ContinuousAction", **config}})
    env.reset(seed=3)
    actions, stocks = [], []
    for k in range(4):
        road, start = stock_road(env, k), env.world(k).vehicles[0]
        stocks.append(Vehicle(road, [start.x, start.y], start.heading))
        road.vehicles.append(stocks[-1])
        actions.append(ContinuousAction(SimpleNamespace(vehicle=stocks[-1]), **config))
    env.action_space.seed(2)
    for _ in range(12):
        chosen = env.action_space.sample() * np.float32(1.0 if config.get("clip", True) else 1.2)
        chosen[:, 0] = np.abs(chosen[:, 0]) * [1.0, -1.0, 1.0, -1.0]
        env.step(chosen)
        for k in range(4):
            actions[k].act(chosen[k])
            for _ in range(15):
                stocks[k].road.act()
                stocks[k].road.step(1 / 15)
            same_place(env.world(k).vehicles[0], stocks[k])
    assert stocks[1].speed < -0.9 and stocks[0].speed > 2.9


# --- observations are highway-env's -----------------------------------------------------------------------------------

OBSERVATIONS: list[dict[str, Any]] = [
    {},
    {"vehicles_count": 3, "see_behind": True, "absolute": True},
    {"vehicles_count": 25, "see_behind": True, "clip": False},
    {"features": ["presence", "heading", "sin_h", "x", "cos_h", "vy", "y", "vx"], "normalize": False},
    {"features": ["x", "cos_h"], "features_range": {"x": [-50, 100], "cos_h": [0, 2]}, "see_behind": True},
    {"vehicles_count": 6, "order": "shuffled"},
]


def stock_observation(env: TownVectorEnv, number: int, config: dict[str, Any], lanes: int) -> np.ndarray:
    road = stock_road(env, number)
    for row in env.world(number).vehicles:
        if row.kind != Kind.EMPTY:
            road.vehicles.append(Vehicle(road, [row.x, row.y], row.heading, row.speed))
    shuffle = SimpleNamespace(shuffle=lambda rows: None)
    stub = SimpleNamespace(road=road, vehicle=road.vehicles[0], PERCEPTION_DISTANCE=200.0, np_random=shuffle)
    observation = KinematicObservation(stub, **config)
    if observation.normalize and not observation.features_range:
        # stock takes the range of y from the road on which the episode began
        observation.features_range = {"x": [-200, 200], "y": [-4 * lanes, 4 * lanes], "vx": [-80, 80], "vy": [-80, 80]}
    return observation.observe()


@pytest.mark.parametrize("config", OBSERVATIONS)
def test_observations_are_highway_envs(config: dict[str, Any]) -> None:
    env = TownVectorEnv(4, {"vehicles": 15, "observation": {"type": "Kinematics", **config}, "duration": 1e6})
    observations, _ = env.reset(seed=5)
    lanes = []
    for k in range(4):
        road = env._network.index_of(int(env.world(k).vehicles[0].lane))
        lanes.append(len(env._network.all_side_lanes(road)))
    env.action_space.seed(1)
    others = 0
    for _ in range(15):
        for k in np.flatnonzero(~env._over):
            expected = stock_observation(env, k, config, lanes[k])
            found = observations[k]
            if config.get("order") == "shuffled":
                expected, found = expected[np.lexsort(expected.T)], found[np.lexsort(found.T)]
            assert found == pytest.approx(expected, abs=1e-6, rel=1e-6)
            others += int((found[1:] != 0.0).any(axis=1).sum())
        assert env.observation_space.contains(observations)
        observations = env.step(np.where(env.action_space.sample() > 2, FASTER, IDLE))[0]
        for k in np.flatnonzero(env._elapsed == 0.0):
            road = env._network.index_of(int(env.world(k).vehicles[0].lane))
            lanes[k] = len(env._network.all_side_lanes(road))
    assert others > 20


def test_others_are_shuffled_by_the_environments_own_generator() -> None:
    config = {"vehicles": 15, "observation": {"type": "Kinematics", "order": "shuffled", "see_behind": True}}
    one, other = TownVectorEnv(2, config), TownVectorEnv(2, config)
    first, again = one.reset(seed=5)[0], other.reset(seed=5)[0]
    assert (first == again).all()
    idle = np.full(2, IDLE)
    assert (one.step(idle)[0] == other.step(idle)[0]).all()


# --- episodes are those of the plain environment ----------------------------------------------------------------------

EPISODES: list[dict[str, Any]] = [
    {"vehicles": 12, "pedestrians": 8, "town": "northgate"},
    {"vehicles": 25, "pedestrians": 20, "observation": {"type": "Kinematics", "vehicles_count": 9, "see_behind": True}},
    {"vehicles": 9, "pedestrians": 9, "observation": {"type": "Kinematics", "include_obstacles": False}},
    {"vehicles": 12, "action": {"type": "ContinuousAction"}},
]


@pytest.mark.parametrize("config", EPISODES)
def test_episodes_are_those_of_plain_environments(config: dict[str, Any]) -> None:
    many = TownVectorEnv(4, config)
    observations, infos = many.reset(seed=20)
    many.action_space.seed(3)
    plains = [TownEnv(config) for _ in range(4)]
    for k, plain in enumerate(plains):
        expected, info = plain.reset(seed=20 + k)
        assert observations[k] == pytest.approx(expected, abs=1e-6)
        assert plain.road.arrays.pedestrians.tobytes() == many.world(k).pedestrians.tobytes()
        assert plain.road.arrays.vehicles[1:].tobytes() == many.world(k).vehicles[1:].tobytes()
        plain.road.np_random = Lot(int(many.world(k).vehicles.random[0]))
    going, crashes = set(range(4)), 0
    for _ in range(12):
        actions = many.action_space.sample()
        observations, rewards, terminated, truncated, infos = many.step(actions)
        for k in sorted(going):
            expected, reward, over, late, info = plains[k].step(actions[k])
            assert observations[k] == pytest.approx(expected, abs=1e-5)
            assert rewards[k] == pytest.approx(reward, abs=1e-6)
            assert (bool(terminated[k]), bool(truncated[k])) == (over, late)
            assert infos["rewards"]["progress"][k] == pytest.approx(info["rewards"]["progress"], abs=1e-6)
            if over:
                going.remove(k)
                crashes += 1
    assert len(going) + crashes == 4 and going


# --- Gymnasium's conventions ------------------------------------------------------------------------------------------


def test_make_vec_builds_the_compiled_environment() -> None:
    env = gym.make_vec("dorothie_gym/Town-v0", num_envs=3, config={"vehicles": 2})
    assert isinstance(env, TownVectorEnv) and env.num_envs == 3
    plain = TownEnv({"vehicles": 2})
    assert env.single_observation_space == plain.observation_space
    assert env.single_action_space == plain.action_space
    assert env.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    env.close()


def shapes(infos: dict[str, Any]) -> dict[str, Any]:
    return {k: shapes(v) if isinstance(v, dict) else (np.asarray(v).shape, v.dtype) for k, v in infos.items()}


def test_infos_are_those_of_plain_environments_side_by_side() -> None:
    many = gym.make_vec("dorothie_gym/Town-v0", num_envs=2, config={"vehicles": 2})
    plain = gym.make_vec("dorothie_gym/Town-v0", num_envs=2, config={"vehicles": 2}, vectorization_mode="sync")
    (observations, infos), (expected, expected_infos) = many.reset(seed=1), plain.reset(seed=1)
    assert shapes(infos) == shapes(expected_infos)
    assert (observations.shape, observations.dtype) == (expected.shape, expected.dtype)
    actions = np.array([FASTER, IDLE])
    found, wanted = many.step(actions), plain.step(actions)
    assert [(a.shape, a.dtype) for a in found[:4]] == [(a.shape, a.dtype) for a in wanted[:4]]
    assert shapes(found[4]) == shapes(wanted[4])
    assert found[4]["action"].tolist() == [FASTER, IDLE]
    assert found[1] == pytest.approx(found[4]["rewards"]["progress"] + found[4]["rewards"]["collision"])


def test_a_crash_ends_an_episode_and_the_next_step_begins_another() -> None:
    env, undisturbed = TownVectorEnv(2), TownVectorEnv(2)
    env.reset(seed=4)
    undisturbed.reset(seed=4)
    faster = np.full(2, FASTER)
    env.world(1).vehicles.crashed[0] = True
    last, rewards, terminated, truncated, infos = env.step(faster)
    same = undisturbed.step(faster)
    assert terminated.tolist() == [False, True] and not truncated.any()
    assert rewards[1] == infos["rewards"]["collision"][1] == -1.0 and infos["crashed"].tolist() == [False, True]
    first, rewards, terminated, truncated, infos = env.step(faster)
    assert rewards[1] == 0.0 and not terminated.any() and not truncated.any() and not infos["crashed"].any()
    assert infos["speed"][1] == 0.0 and infos["action"][1] == 0 and (first[1] != last[1]).any()
    assert (last[0] == same[0][0]).all() and (first[0] == undisturbed.step(faster)[0][0]).all()
    assert env.step(faster)[4]["speed"][1] > 2.0


def test_episode_truncates_after_its_duration() -> None:
    env = TownVectorEnv(2, {"vehicles": 0, "duration": 2.0, "policy_frequency": 2})
    env.reset(seed=1)
    idle = np.full(2, IDLE)
    assert [env.step(idle)[3].tolist() for _ in range(6)] == [[False] * 2] * 3 + [[True] * 2] + [[False] * 2] * 2


def test_an_episode_may_begin_in_the_step_that_ends_another() -> None:
    env = TownVectorEnv(2, autoreset_mode="SameStep")
    env.reset(seed=4)
    env.world(1).vehicles.crashed[0] = True
    observations, rewards, terminated, _, infos = env.step(np.full(2, FASTER))
    assert terminated.tolist() == [False, True] and rewards[1] == -1.0
    assert infos["_final_obs"].tolist() == [False, True] and infos["final_obs"][0] is None
    assert (infos["final_obs"][1] != observations[1]).any()
    assert infos["final_info"]["crashed"].tolist() == [False, True] and not infos["crashed"].any()
    assert infos["speed"][1] == 0.0
    assert env.step(np.full(2, FASTER))[4]["speed"][1] > 2.0


def test_resets_may_be_left_to_the_caller() -> None:
    env = TownVectorEnv(2, autoreset_mode=AutoresetMode.DISABLED)
    env.reset(seed=4)
    env.world(1).vehicles.crashed[0] = True
    last = env.step(np.full(2, FASTER))[0]
    with pytest.raises(ValueError, match="reset_mask"):
        env.step(np.full(2, FASTER))
    before = env.world(0).tobytes()
    observations, infos = env.reset(options={"reset_mask": np.array([False, True])})
    assert infos["_speed"].tolist() == [False, True] and env.world(0).tobytes() == before
    assert (observations[0] == last[0]).all() and (observations[1] != last[1]).any()
    env.step(np.full(2, FASTER))


# --- seeds and threads ------------------------------------------------------------------------------------------------


def play(env: TownVectorEnv, seed: int | list[int], steps: int = 8) -> list[Any]:
    """Everything that environments give, with actions of their own."""
    seen = [env.reset(seed=seed)[0]]
    seeds = seed if isinstance(seed, list) else [seed + i for i in range(env.num_envs)]
    actors = [np.random.default_rng(s) for s in seeds]
    for _ in range(steps):
        results = env.step(np.array([actor.integers(5) for actor in actors]))
        seen += [*results[:4], results[4]["speed"]]
    return seen


def test_a_seed_gives_the_same_episodes_at_every_place_and_with_all_threads() -> None:
    config = {"vehicles": 8, "duration": 4.0}
    alone = [play(TownVectorEnv(1, config), seed) for seed in (10, 11, 12, 13, 14)]
    for threads in (1, 2, 3):
        together = play(TownVectorEnv(5, config, threads=threads), 10)
        mixed = play(TownVectorEnv(5, config, threads=threads), [13, 10, 14, 12, 11])
        for rows, order in ((together, range(5)), (mixed, (3, 0, 4, 2, 1))):
            for k, which in enumerate(order):
                assert all((row[k] == own[0]).all() for row, own in zip(rows, alone[which], strict=True))


HASH = """
import hashlib
import numpy as np
from dorothie_gym.sim.batch.town_vector_env import TownVectorEnv
env = TownVectorEnv(2, {"vehicles": 3, "policy_frequency": 5}, threads=1)
digest = hashlib.sha256(env.reset(seed=1)[0].tobytes())
for action in (3, 2, 0, 1):
    digest.update(env.step(np.array([action, 3]))[0].tobytes())
print(digest.hexdigest(), hashlib.sha256(env.world(0).tobytes() + env.world(1).tobytes()).hexdigest())
"""


@pytest.mark.long
def test_the_bytes_are_the_same_in_plain_python() -> None:
    runs = [
        subprocess.run(
            [sys.executable, "-c", HASH],
            env={**os.environ, "NUMBA_DISABLE_JIT": disabled},
            capture_output=True,
            text=True,
        )
        for disabled in "01"
    ]
    assert runs[0].returncode == runs[1].returncode == 0, runs[0].stderr + runs[1].stderr
    assert runs[0].stdout == runs[1].stdout


# --- mistakes ---------------------------------------------------------------------------------------------------------


def test_pictures_are_left_to_plain_environments() -> None:
    with pytest.raises(ValueError, match="sync"):
        gym.make_vec("dorothie_gym/Town-v0", num_envs=2, render_mode="rgb_array")


@pytest.mark.parametrize("actions", [np.zeros(3, dtype=int), np.array([0, 5]), np.array([0.0, 1.0]), np.array([0, -1])])
def test_actions_that_do_not_exist_are_refused(actions: np.ndarray) -> None:
    env = TownVectorEnv(2, LONELY)
    env.reset(seed=1)
    with pytest.raises(ValueError, match="actions must"):
        env.step(actions)


def test_environments_are_reset_before_they_are_stepped() -> None:
    with pytest.raises(ValueError, match="reset the environments"):
        TownVectorEnv(2, LONELY).step(np.zeros(2, dtype=int))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"seed": [1]}, "1 seeds for 2"),
        ({"options": {"reset_mask": [True, False]}}, "reset_mask"),
        ({"options": {"config": {}}}, "sync"),
    ],
)
def test_a_reset_that_cannot_be_is_refused(arguments: dict[str, Any], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        TownVectorEnv(2, LONELY).reset(**arguments)


def test_the_action_spaces_numbers_are_left_to_their_owner() -> None:
    env = TownVectorEnv(2, LONELY)
    env.action_space.seed(1)
    first = env.action_space.sample()
    env.action_space.seed(1)
    env.reset(seed=1)
    assert (env.action_space.sample() == first).all()
