"""Every site stays reachable from every place of the car, whatever the Ad-Wizard does."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.ontology import AGENT_ROLES, ExceptionKind, PropKind, Role, Sensor
from dorothie_gym.policies import make_policy
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.exception_executor import ExceptionExecutor
from dorothie_gym.session.scenario import draw_scenario
from dorothie_gym.session.spaces import AdWizardAction
from dorothie_gym.session.spaces.actions import LanePosition
from dorothie_gym.sim.config import WorldConfig
from dorothie_gym.sim.world import World
from dorothie_gym.tasks import TaskState
from tests.session.brute_force import brute_force
from tests.sim.driving import network, world_at

TOWNS = ("brookside", "midtown", "northgate")

KINDS = (
    ExceptionKind.PLACE_PROP, ExceptionKind.PLACE_PROP, ExceptionKind.PLACE_PROP, ExceptionKind.MOVE_PROP,
    ExceptionKind.MOVE_PROP, ExceptionKind.DELETE_PROP, ExceptionKind.SPAWN_VEHICLES,
    ExceptionKind.SPAWN_PEDESTRIANS, ExceptionKind.SENSOR_FAULT, ExceptionKind.TASK_TRIGGER,
    ExceptionKind.TASK_DELETE, ExceptionKind.TASK_CHANGE,
)  # fmt: skip


def random_action(world: World, rng: np.random.Generator) -> AdWizardAction:
    """Returns an exception anywhere in the town, half of the time near the car."""
    lanes = world.town.lanes
    streets = [lane.id for lane in lanes if not lane.in_junction]
    if rng.random() < 0.5:
        x, y = world.car.position
        near = [k for k in streets if np.hypot(lanes[k].points[:, 0] - x, lanes[k].points[:, 1] - y).min() < 120.0]
        streets = near or streets
    lane = int(rng.choice(streets))
    least = min(30.0, lanes[lane].length)
    return AdWizardAction(
        exception=KINDS[int(rng.integers(len(KINDS)))],
        prop=tuple(PropKind)[int(rng.integers(len(PropKind)))],
        item=int(rng.integers(max(len(world.actors.props), 1))),
        count=int(rng.integers(6)),
        extent=int(rng.integers(80)),
        sensor=tuple(Sensor)[int(rng.integers(len(Sensor)))],
        on=True,
        place=LanePosition(lane=lane, metres=round(rng.uniform(least, lanes[lane].length))),
    )


def props(world: World) -> list[tuple[int, float]]:
    return [(prop.lane_id, prop.station) for prop in world.actors.props]


def unreachable(world: World) -> set[int]:
    """Returns the sites that the car cannot reach from its place, by exhaustive search."""
    car = world.planner.lane, world.planner.station
    return {site.id for site in world.town.sites} - brute_force(world.town).sites(car, props(world))


def car_anywhere(name: str, rng: np.random.Generator) -> World:
    town = network(name).town
    lane = town.lanes[int(rng.choice([lane.id for lane in town.lanes if not lane.in_junction]))]
    return world_at(name, lane.id, float(rng.uniform(0.0, lane.length - 1.0)), WorldConfig(vehicles=2, pedestrians=0))


def play_standing(name: str, seed: int, actions: int) -> int:
    """Lets the Ad-Wizard place props around a car that stands at a random place; returns the number of props."""
    rng = np.random.default_rng([seed, TOWNS.index(name)])
    world = car_anywhere(name, rng)
    adversary = ExceptionExecutor(world, TaskState(draw_scenario(world.town, None, seed).storyboard), 16)
    put = 0
    for _ in range(actions):
        action = random_action(world, rng)
        outcome = adversary.execute(action)
        if isinstance(outcome, dict) and action.exception.is_plan_level:
            put += 1
            assert unreachable(world) == set(), f"{name}, seed {seed}: {action}"
            for lane, station in props(world):  # it is not trapped where it would stop before a prop either
                stand = lane, station - 16.0
                if any(other == lane and stand[1] - 16.0 < at < station for other, at in props(world)):
                    continue  # no car can stop there
                assert len(brute_force(world.town).sites(stand, props(world))) == len(world.town.sites)
    return put


def play_driving(name: str, seed: int, seconds: float) -> tuple[int, int]:
    """Plays a session with the scripted roles; returns the numbers of props placed and of executed exceptions."""
    rng = np.random.default_rng([seed, TOWNS.index(name), 7])
    config = EnvConfig(max_seconds=seconds, world=WorldConfig(vehicles=3, pedestrians=2))
    env = DuoWizardEnv(name, config=config)
    observations, _ = env.reset(seed=seed)
    policies: dict[Role, Any] = {role: make_policy("scripted", role, env.limits) for role in AGENT_ROLES[:2]}
    states = {role: policy.initial_state(seed, env.town) for role, policy in policies.items()}
    assert Role.AD_WIZARD not in policies
    put = 0
    while env.agents:
        actions: dict[str, Any] = {}
        for role, policy in policies.items():
            actions[str(role)], states[role] = policy.step(observations[str(role)], states[role])
        action = random_action(env.session.world, rng)
        actions[str(Role.AD_WIZARD)] = action.encode(env.limits)
        observations, *_ = env.step(actions)
        done = any(event.type.value == "Exception" for event in env.last_events)
        put += done and action.exception.is_plan_level
        if env.session.world.actors.props:
            assert unreachable(env.session.world) == set(), f"{name}, seed {seed}, {env.session.world.time} s: {action}"
    return put, env.summary()["exceptions"]


def play_session_at_random(seed: int, seconds: float) -> tuple[int, int]:
    """Plays random actions within the masks for all roles; the Ad-Wizard acts near the car half of the time.

    Returns:
        Number of executed exceptions, and number of decisions at which there were props in the town.
    """
    rng = np.random.default_rng([seed, 11])
    name = TOWNS[seed % len(TOWNS)]
    crowd = WorldConfig(vehicles=int(rng.integers(12)), pedestrians=int(rng.integers(8)))
    env = DuoWizardEnv(name, config=EnvConfig(max_seconds=seconds, world=crowd))
    scripted = {role: make_policy("scripted", role, env.limits) for role in AGENT_ROLES[: 2 * (seed % 2)]}
    states = {role: policy.initial_state(seed, env.town) for role, policy in scripted.items()}
    for k, agent in enumerate(env.possible_agents):
        env.action_space(agent).seed(seed + k)
    observations, infos = env.reset(seed=seed)
    blocked = 0
    while env.agents:
        actions = {agent: env.action_space(agent).sample(mask=infos[agent]["action_mask"]) for agent in env.agents}
        for role, policy in scripted.items():
            actions[str(role)], states[role] = policy.step(observations[str(role)], states[role])
        if rng.random() < 0.5:
            actions[str(Role.AD_WIZARD)] = random_action(env.session.world, rng).encode(env.limits)
        observations, _, _, _, infos = env.step(actions)
        world = env.session.world
        assert np.isfinite(world.frames).all()
        if world.actors.props:
            blocked += 1
            assert unreachable(world) == set(), f"{name}, seed {seed}, {world.time} s"
    return env.summary()["exceptions"], blocked


@pytest.mark.long
@pytest.mark.parametrize("seed", [0, 2, 4, 7, 8, 20])
def test_session_with_random_actions_stays_solvable(seed: int) -> None:
    exceptions, blocked = play_session_at_random(seed, 10.0)
    assert exceptions >= 2
    assert blocked > 0


@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_hundred_sessions_with_random_actions_stay_solvable() -> None:
    played = [play_session_at_random(seed, 30.0) for seed in range(1000, 1100)]
    assert sum(blocked > 0 for _, blocked in played) >= 60


@pytest.mark.parametrize("name", ["brookside", "midtown"])
def test_standing_car_can_reach_every_site_despite_props(name: str) -> None:
    assert sum(play_standing(name, seed, 40) for seed in range(2)) >= 4


def test_driving_car_can_reach_every_site_despite_props() -> None:
    assert play_driving("brookside", 0, 10.0)[1] >= 3


@pytest.mark.slow
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("name", TOWNS)
def test_many_sessions_with_standing_cars_stay_solvable(name: str) -> None:
    put = [play_standing(name, seed, 60) for seed in range(100, 160)]
    assert sum(put) >= 120


@pytest.mark.slow
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("name", TOWNS)
def test_many_sessions_with_driving_cars_stay_solvable(name: str) -> None:
    put = [play_driving(name, seed, 20.0)[0] for seed in range(200, 220)]
    assert sum(put) >= 20
