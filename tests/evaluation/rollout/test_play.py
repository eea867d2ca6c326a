from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.errors import SessionError
from dorothie_gym.evaluation.rollout import play_session
from dorothie_gym.ontology import AGENT_ROLES, Role
from dorothie_gym.policies import Policy, make_policy
from dorothie_gym.policies.decision_random import policy_seed
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.recording import Session

SECONDS = 6.0


@pytest.fixture(scope="module")
def env() -> DuoWizardEnv:
    return DuoWizardEnv("brookside", config=EnvConfig(max_seconds=SECONDS))


def players(env: DuoWizardEnv, name: str = "scripted") -> dict[Role, Policy[Any]]:
    return {role: make_policy(name, role, env.limits) for role in AGENT_ROLES}


def test_a_session_is_played_to_its_end(env: DuoWizardEnv) -> None:
    times: list[float] = []
    summary = play_session(env, players(env), seed=1, on_step=lambda env: times.append(env.session.world.time))
    assert times == pytest.approx([k / 2 for k in range(round(SECONDS * 2) + 1)])
    assert summary == env.summary()
    assert summary["seconds"] == SECONDS and summary["reason"] == "out of time"


def test_a_session_is_recorded_whole(env: DuoWizardEnv, tmp_path: Path) -> None:
    summary = play_session(env, players(env), seed=1, folder=tmp_path / "one")
    session = Session.load(tmp_path / "one")
    assert session.complete and session.summary == summary
    assert session.header.seed == 1
    assert len(session.trajectory) == round(SECONDS * 30) + 1 or len(session.trajectory) == round(SECONDS * 30)


@pytest.mark.parametrize("name", ["scripted", "random"])
def test_equal_seeds_play_equal_sessions(env: DuoWizardEnv, tmp_path: Path, name: str) -> None:
    for folder in ("one", "two"):
        play_session(env, players(env, name), seed=5, folder=tmp_path / folder)
    files = sorted(path.name for path in (tmp_path / "one").iterdir())
    assert files and all((tmp_path / "one" / f).read_bytes() == (tmp_path / "two" / f).read_bytes() for f in files)


def test_an_interrupted_session_is_kept_up_to_its_last_decision(env: DuoWizardEnv, tmp_path: Path) -> None:
    def interrupt(env: DuoWizardEnv) -> None:
        if env.session.world.time >= 4.0:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        play_session(env, players(env), seed=1, folder=tmp_path / "cut", on_step=interrupt)
    session = Session.load(tmp_path / "cut")
    assert not session.complete and session.summary is None
    assert session.duration == pytest.approx(4.0)


def test_a_session_does_not_replace_another(env: DuoWizardEnv, tmp_path: Path) -> None:
    play_session(env, players(env, "silent"), seed=1, folder=tmp_path)
    with pytest.raises(SessionError, match="holds a session already"):
        play_session(env, players(env, "silent"), seed=2, folder=tmp_path)


def test_every_role_needs_a_policy(env: DuoWizardEnv) -> None:
    policies = players(env, "silent")
    del policies[Role.AD_WIZARD]
    with pytest.raises(ValueError, match="policies has none for ad_wizard"):
        play_session(env, policies, seed=1)


def test_roles_draw_from_different_seeds() -> None:
    seeds = [policy_seed(seed, role) for seed in range(20) for role in AGENT_ROLES]
    assert len(set(seeds)) == len(seeds)
    assert seeds == [policy_seed(seed, role) for seed in range(20) for role in AGENT_ROLES]
