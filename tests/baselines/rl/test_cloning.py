from __future__ import annotations

import json
from pathlib import Path

import pytest

pytest.importorskip("stable_baselines3", reason="needs the extra 'baselines'")
pytest.importorskip("sb3_contrib", reason="needs the extra 'baselines'")

from dorothie_gym.baselines.rl import Training, TrainingSettings, tuned_settings
from dorothie_gym.baselines.rl.behaviour_cloning import clone, read_demonstrations
from dorothie_gym.baselines.rl.checkpoint import make_model
from dorothie_gym.baselines.rl.environments import make_env
from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.errors import SessionError, SettingsError
from dorothie_gym.evaluation.rollout import play_session
from dorothie_gym.ontology import AGENT_ROLES
from dorothie_gym.policies import make_policy
from dorothie_gym.session.config import EnvConfig

NAVIGATION = "dorothie_gym/Navigation-v0"
SMALL = {"n_steps": 16, "batch_size": 32, "n_epochs": 1}


def record(root: Path, *, training: int, held_out: int) -> Path:
    """Records sessions of the scripted roles in two folds; returns the folder of the corpus."""
    env = DuoWizardEnv("brookside", config=EnvConfig(max_seconds=300.0))
    policies = {role: make_policy("scripted", role, env.limits) for role in AGENT_ROLES}
    for number in range(training + held_out):
        fold = "train" if number < training else "val/seen"
        play_session(env, policies, seed=number + 8, folder=root / fold / f"{number:04}")
    return root


@pytest.mark.slow
def test_cloning_generalises_to_held_out_sessions(tmp_path: Path) -> None:
    corpus = record(tmp_path / "corpus", training=26, held_out=2)
    training, held_out = read_demonstrations(corpus, "train"), read_demonstrations(corpus, "val")
    assert training.observations.shape == (len(training), 161) and training.masks.shape == (len(training), 18)
    settings = tuned_settings("maskable_ppo", NAVIGATION, parameters=SMALL | {"batch_size": 16})
    cloned = clone(make_model(settings, make_env(NAVIGATION)), training, held_out, seed=0)
    assert cloned.losses[1] < 0.2 * cloned.losses[0]
    assert cloned.agreement > cloned.majority
    assert cloned.action_agreement > 0.25


@pytest.mark.long
def test_warm_start_is_evaluated_before_training(tmp_path: Path) -> None:
    small = record(tmp_path / "corpus", training=1, held_out=1)
    settings = TrainingSettings(
        algorithm="ppo", env=NAVIGATION, steps=32, environments=2, evaluate_every=32, episodes=1, network=(8,),
        parameters=SMALL, env_settings={"max_seconds": 10.0, "traffic": "none"}, warm_start=str(small),
    )  # fmt: skip
    run = Training(settings, tmp_path / "run").run()
    assert [row.steps for row in run.rows] == [0, 32]  # the first is that of the clone
    cloned = json.loads((tmp_path / "run" / "cloned.json").read_text())
    assert cloned["losses"][1] < cloned["losses"][0] and cloned["decisions"] > 200
    assert Training(settings, tmp_path / "run").cloned is None  # a resumed run is not cloned again


def test_warm_start_of_other_algorithms_and_environments_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match="warm_start.*dqn"):
        tuned_settings("dqn", NAVIGATION, warm_start=str(tmp_path))
    with pytest.raises(SettingsError, match="warm_start.*CoWizard"):
        tuned_settings("ppo", "dorothie_gym/CoWizard-v0", warm_start=str(tmp_path))
    with pytest.raises(SessionError, match="no session"):
        Training(tuned_settings("ppo", NAVIGATION, workers=0, warm_start=str(tmp_path)), tmp_path / "run")
