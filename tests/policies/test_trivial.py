from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.evaluation.rollout import play_session
from dorothie_gym.maps import load_town
from dorothie_gym.ontology import AGENT_ROLES, PhysicalAction, Role
from dorothie_gym.policies import LaneFollowPolicy, make_policy
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.spaces import ExitColumn, SpaceLimits, decode_action
from dorothie_gym.sim.state.codes import Motion


def decide(motion: Motion, *angles: float) -> Any:
    exits = np.zeros((6, len(ExitColumn)), dtype=np.float32)
    for row, angle in enumerate(angles):
        exits[row, [ExitColumn.PRESENT, ExitColumn.ANGLE]] = 1.0, angle
    policy = LaneFollowPolicy()
    action, _ = policy.step({"motion": int(motion), "exits": exits}, policy.initial_state(0, load_town("brookside")))
    return decode_action(Role.CO_WIZARD, action, SpaceLimits())


def test_moving_car_is_left_alone() -> None:
    for motion in (Motion.DRIVING, Motion.HAZARD):
        assert decide(motion, -90.0, 0.0).physical is None


@pytest.mark.parametrize(("angles", "chosen"), [((-90.0, 2.0, 88.0), 2), ((-85.0, 95.0), -85), ((-20.0, 10.0), 10)])
def test_straightest_exit_is_taken(angles: tuple[float, ...], chosen: int) -> None:
    physical = decide(Motion.WAITING, *angles).physical
    assert physical.action is PhysicalAction.J_TURN
    assert (physical.angle + 180) % 360 - 180 == chosen


def test_stopped_car_starts_and_dead_end_leads_to_u_turn() -> None:
    assert decide(Motion.STOPPED).physical.action is PhysicalAction.START
    assert decide(Motion.WAITING).physical.action is PhysicalAction.U_TURN


def test_lane_follow_drives_through_town_silently() -> None:
    env = DuoWizardEnv("brookside", config=EnvConfig(max_seconds=60.0))
    policies = {role: make_policy("silent", role, env.limits) for role in AGENT_ROLES}
    lanes: set[int] = set()
    policies[Role.CO_WIZARD] = LaneFollowPolicy(env.limits)
    play_session(env, policies, seed=3, on_step=lambda env: lanes.add(env.session.world.planner.lane))
    summary = env.summary()
    assert summary["utterances"] == 0 and summary["refusals"] == 0
    assert len(lanes) >= 5
