from __future__ import annotations

import numpy as np
import pytest

from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.ontology import ObjectClass, Role
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.spaces import ExitColumn, ObjectColumn, noop
from dorothie_gym.sim.config import WorldConfig
from dorothie_gym.sim.state.codes import Motion


@pytest.fixture(scope="module")
def env() -> DuoWizardEnv:
    env = DuoWizardEnv("brookside", config=EnvConfig(world=WorldConfig(vehicles=12, pedestrians=6)))
    env.reset(seed=8)
    return env


def test_objects_are_sorted_by_distance_and_within_sight(env: DuoWizardEnv) -> None:
    seen = 0
    for _ in range(40):
        observations, *_ = env.step({agent: noop(Role(agent), env.limits) for agent in env.agents})
        objects = observations["co_wizard"]["objects"]
        rows = objects[objects[:, ObjectColumn.KIND] > 0]
        assert (np.diff(rows[:, ObjectColumn.DISTANCE]) >= 0).all()
        assert (rows[:, ObjectColumn.DISTANCE] <= 80.0).all()
        assert set(rows[:, ObjectColumn.KIND]) <= {ObjectClass.VEHICLES.value, ObjectClass.PEDESTRIAN.value}
        assert (np.abs(rows[:, ObjectColumn.BEARING]) <= np.pi).all()
        assert not objects[len(rows) :].any()
        seen += len(rows)
    assert seen > 0


def test_exits_are_observed_before_first_turn() -> None:
    env = DuoWizardEnv("brookside", config=EnvConfig(world=WorldConfig(vehicles=0, pedestrians=0)))
    observations, _ = env.reset(seed=8)
    for _ in range(80):
        observations, *_ = env.step({agent: noop(Role(agent), env.limits) for agent in env.agents})
    view = observations["co_wizard"]
    exits = view["exits"][view["exits"][:, ExitColumn.PRESENT] > 0]
    assert view["motion"] == Motion.WAITING
    assert len(exits) >= 2
    assert (exits[:, ExitColumn.DISTANCE] < 6.0).all()
    assert (np.diff(exits[:, ExitColumn.ANGLE]) > 0).all()
