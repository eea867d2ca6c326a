"""During a GPS fault, the Co-Wizard's observations follow the estimated pose and do not reveal the true one."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.ontology import Role, Sensor
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.spaces import ExitColumn, ObjectColumn, noop
from dorothie_gym.sim.config import WorldConfig

KINDS = ObjectColumn.KIND


def drifted_env(shift: tuple[float, float, float] = (0.0, 0.0, 0.0), vehicles: int = 8) -> DuoWizardEnv:
    """Returns a session whose pose estimate is off by distances ahead and to the right [m] and by an angle [rad]."""
    env = DuoWizardEnv("brookside", config=EnvConfig(world=WorldConfig(vehicles=vehicles, pedestrians=4)))
    env.reset(seed=0)  # begins more than 100 m before a junction
    for _ in range(6):
        env.step({agent: noop(Role(agent), env.limits) for agent in env.agents})
    world = env.session.world
    world.set_fault(Sensor.GPS, True)
    x, y, heading = (float(v) for v in (*world.car.position, world.car.heading))
    ahead, right, turn = shift
    c, s = math.cos(heading), math.sin(heading)
    world.actors.arrays.localizer[0].estimate[:3] = x + ahead * c - right * s, y + ahead * s + right * c, heading + turn
    return env


def seen(env: DuoWizardEnv) -> dict[str, Any]:
    return env.session.observations((Role.CO_WIZARD,))[Role.CO_WIZARD]


def test_exact_estimate_gives_true_places() -> None:
    env = drifted_env()
    view, truth = seen(env), env.session.observations((Role.AD_WIZARD,))[Role.AD_WIZARD]
    # the planner's place is that of the frame before
    np.testing.assert_allclose(view["waypoints"], truth["waypoints"], atol=0.35)
    watched = env.session.observations((Role.PARTICIPANT,))[Role.PARTICIPANT]
    np.testing.assert_allclose(view["objects"], watched["objects"], atol=1e-6)
    _, distance = env.session.world.planner.exits()
    assert view["exits"][0, ExitColumn.DISTANCE] == pytest.approx(distance, abs=0.35)


@pytest.mark.parametrize("ahead", [-4.0, 5.0])
def test_waypoints_and_exits_follow_the_estimated_place(ahead: float) -> None:
    straight, drifted = seen(drifted_env()), seen(drifted_env((ahead, 0.0, 0.0)))
    assert drifted["exits"][0, ExitColumn.DISTANCE] == pytest.approx(
        straight["exits"][0, ExitColumn.DISTANCE] - ahead, abs=0.1
    )
    # the first waypoint is 5 m from the estimated place, not from the true one
    for view in (straight, drifted):
        assert math.hypot(*(view["waypoints"][0] - view["pose"][:2])) == pytest.approx(5.0, abs=0.2)


def test_objects_are_seen_around_the_estimated_pose() -> None:
    shift = (3.0, -2.0, 0.1)
    env = drifted_env(shift, vehicles=40)
    view, world = seen(env), env.session.world
    rows = view["objects"][view["objects"][:, KINDS] > 0]
    assert len(rows)
    for row, body in zip(rows, world.perceived(), strict=False):
        away = math.hypot(row[ObjectColumn.X] - view["pose"][0], row[ObjectColumn.Y] - view["pose"][1])
        assert away == pytest.approx(row[ObjectColumn.DISTANCE])
        assert row[ObjectColumn.DISTANCE] == pytest.approx(
            math.hypot(*(np.array([body.x, body.y]) - world.car.position))
        )
        bearing = math.atan2(row[ObjectColumn.Y] - view["pose"][1], row[ObjectColumn.X] - view["pose"][0])
        turned = (bearing - view["pose"][2] - row[ObjectColumn.BEARING] + math.pi) % (2 * math.pi) - math.pi
        assert turned == pytest.approx(0.0, abs=1e-9)
        assert math.hypot(row[ObjectColumn.X] - body.x, row[ObjectColumn.Y] - body.y) > 1.0


@pytest.mark.parametrize("shift", [(6.0, 0.0, 0.0), (-6.0, 0.0, 0.0), (4.0, 3.0, 0.2)])
def test_observation_contains_no_true_place(shift: tuple[float, float, float]) -> None:
    """No observed point lies at the place that the true pose gives."""
    env = drifted_env(shift)
    view, truth = seen(env), env.session.observations((Role.AD_WIZARD,))[Role.AD_WIZARD]
    assert np.hypot(*(view["waypoints"] - truth["waypoints"]).T).max() > 1.0
    assert np.hypot(*(view["waypoints"][:5] - truth["waypoints"][:5]).T).min() > 1.0
    assert abs(view["station"][0] - truth["station"][0]) > 1.0


def test_waypoints_are_extended_straight_before_path_start() -> None:
    env = drifted_env()
    world = env.session.world
    start = world.planner.path.position_at(0.0)
    heading = world.planner.path.heading_at(0.0)
    world.actors.arrays.localizer[0].estimate[:2] = start[0] - 20 * math.cos(heading), start[1] - 20 * math.sin(heading)
    first = seen(env)["waypoints"][0]
    assert math.hypot(first[0] - start[0], first[1] - start[1]) == pytest.approx(15.0, abs=0.2)


def test_pose_drifts_without_gps_and_recovers() -> None:
    env = DuoWizardEnv("brookside", config=EnvConfig(world=WorldConfig(vehicles=0, pedestrians=0)))
    env.reset(seed=8)
    world = env.session.world
    world.set_fault(Sensor.GPS, True)
    for _ in range(60):
        world.step(15)
    assert Sensor.GPS not in world.faults
    lost = np.trace(world.localizer.covariance[:2, :2])
    for _ in range(10):
        world.step(15)
    assert np.trace(world.localizer.covariance[:2, :2]) < lost / 2
    assert math.hypot(*(world.localizer.pose[:2] - world.car.position)) < 1.0


@pytest.mark.parametrize("frames", [1, 7, 15, 100])
def test_fault_ends_within_thirty_seconds_at_any_decision_frequency(frames: int) -> None:
    env = DuoWizardEnv("brookside", config=EnvConfig(world=WorldConfig(vehicles=0, pedestrians=0)))
    env.reset(seed=8)
    world = env.session.world
    world.set_fault(Sensor.GPS, True)
    while world.frame < 900:
        assert Sensor.GPS in world.faults
        world.step(frames)
    assert Sensor.GPS not in world.faults
