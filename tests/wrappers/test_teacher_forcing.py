from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import check_env

from dorothie_gym import EnvConfig, TeacherForcing, flatten
from dorothie_gym.archive import PointView, Task, task_points
from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.envs.nfd_v0 import NfDEnv
from dorothie_gym.envs.rfn_v0 import RfNEnv
from dorothie_gym.envs.teacher_forced import TeacherForcedEnv
from dorothie_gym.envs.ufn_v0 import UfNEnv
from dorothie_gym.errors import SessionError
from dorothie_gym.evaluation.rollout import play_session
from dorothie_gym.ontology import AGENT_ROLES, Role
from dorothie_gym.policies import make_policy
from dorothie_gym.session.recording import Session

SEED = 3


def duo(seconds: float = 45.0) -> DuoWizardEnv:
    return DuoWizardEnv("brookside", config=EnvConfig(max_seconds=seconds))


def play(env: TeacherForcing, *, truth: bool = True) -> tuple[list[PointView], list[Any], list[float]]:
    """Plays an episode with the true labels, or with random actions."""
    observation, _ = env.reset(seed=SEED)
    env.action_space.seed(0)
    views, observations, rewards, done = [], [observation], [], False
    while not done:
        assert env._point is not None
        views.append(env._point.view)
        action = env.rules.label(env._point) if truth else env.action_space.sample()
        observation, reward, done, _, _ = env.step(action)
        observations.append(observation)
        rewards.append(reward)
    return views, observations, rewards


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Session:
    """Returns the recording of the session that the tests play live."""
    env = duo()
    folder: Path = tmp_path_factory.mktemp("recorded") / "session"
    play_session(
        env, {role: make_policy("scripted", role, env.limits) for role in AGENT_ROLES}, seed=SEED, folder=folder
    )
    return Session.load(folder)


@pytest.mark.parametrize("task", list(Task))
def test_live_points_equal_recorded_ones(task: Task, recorded: Session) -> None:
    views, _, rewards = play(TeacherForcing(duo(), task))
    assert views == [replace(point.view, session=views[0].session) for point in task_points(recorded, task)]
    assert set(rewards) == {1.0}, "the truth earns everything"


@pytest.mark.parametrize(("task", "env_class"), [(Task.UFN, UfNEnv), (Task.RFN, RfNEnv), (Task.NFD, NfDEnv)])
def test_live_observations_equal_recorded_ones(
    task: Task, env_class: type[TeacherForcedEnv], recorded: Session
) -> None:
    _, live, _ = play(TeacherForcing(duo(), task))
    env = env_class([recorded])
    observation, _ = env.reset()
    observations, done = [observation], False
    while not done:
        observation, _, done, _, _ = env.step(env.action_space.sample())
        observations.append(observation)
    np.testing.assert_equal(live, observations)
    assert any(one["object_kinds"].any() for one in live)


@pytest.mark.parametrize("task", list(Task))
def test_predictions_do_not_change_the_session(task: Task) -> None:
    _, one, _ = play(TeacherForcing(duo(), task))
    _, other, rewards = play(TeacherForcing(duo(), task), truth=False)
    np.testing.assert_equal(one, other)
    assert np.mean(rewards) < 1.0


def test_environment_passes_gymnasium_checks() -> None:
    check_env(TeacherForcing(duo(10.0), "nfd"), skip_render_check=True)  # its warnings are errors here


def test_live_environment_can_be_flattened() -> None:
    env = flatten(TeacherForcing(duo(20.0), "nfd"))
    observation, _ = env.reset(seed=SEED)
    assert env.observation_space.contains(observation)
    observation, reward, *_ = env.step(env.action_space.sample())
    assert env.observation_space.contains(observation) and 0.0 <= reward <= 1.0


def test_each_episode_is_a_new_session() -> None:
    env = TeacherForcing(duo(20.0), Task.NFD)
    with pytest.raises(ResetNeeded):
        env.step(env.action_space.sample())
    seeds = {env.reset(seed=7)[1]["seed"], *(env.reset()[1]["seed"] for _ in range(2))}
    assert len(seeds) == 3 and 7 in seeds
    assert env.reset(seed=7)[1]["session"].startswith("brookside-")


def test_silent_policies_raise_one_error() -> None:
    silent = dict.fromkeys(AGENT_ROLES, "silent")
    with pytest.raises(SessionError, match="task ufn: 20 sessions had no point; give policies that talk"):
        TeacherForcing(duo(1.0), "ufn", policies=silent).reset(seed=0)


def test_error_names_invalid_argument() -> None:
    env = duo(1.0)
    with pytest.raises(ValueError, match="task is 'xyz'; it must be one of ufn, rfn, nfd"):
        TeacherForcing(env, "xyz")
    with pytest.raises(ValueError, match="policies has 'driver'; the roles are"):
        TeacherForcing(env, "ufn", policies={"driver": "scripted"})
    with pytest.raises(ValueError, match="policies has one of participant for co_wizard"):
        TeacherForcing(env, "ufn", policies={Role.CO_WIZARD: make_policy("scripted", Role.PARTICIPANT, env.limits)})
