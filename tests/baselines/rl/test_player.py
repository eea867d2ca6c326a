from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("stable_baselines3", reason="needs the extra 'baselines'")
pytest.importorskip("sb3_contrib", reason="needs the extra 'baselines'")

from dorothie_gym.baselines.rl import Training, TrainingSettings
from dorothie_gym.engine.config import EnvConfig
from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.errors import ModelFileError, SettingsError
from dorothie_gym.ontology import Role
from dorothie_gym.policies import ALL_SCRIPTED, find_player
from dorothie_gym.recording import Session
from dorothie_gym.rollout.closed_loop import RolloutSettings, parse_towns, roll_out


def train(folder: Path, algorithm: str = "ppo", **changes: Any) -> None:
    settings = TrainingSettings(
        **{
            "algorithm": algorithm, "env": "dorothie_gym/Navigation-v0", "steps": 64, "environments": 2,
            "evaluate_every": 64, "episodes": 1, "network": (8,),
            "env_settings": {"max_seconds": 10.0, "traffic": "none"},
            "parameters": {"n_steps": 16, "batch_size": 32, "n_epochs": 1}, **changes,
        }
    )  # fmt: skip
    Training(settings, folder).run()


@pytest.mark.parametrize("algorithm", ["ppo", "maskable_ppo"])
def test_trained_model_plays_the_co_wizard(algorithm: str, tmp_path: Path) -> None:
    train(tmp_path / "run", algorithm)
    player = find_player(str(tmp_path / "run" / "best"), Role.CO_WIZARD)
    assert player.training["steps"] == 64 and player.training["seconds"] > 0.0
    settings = RolloutSettings(
        cast={**ALL_SCRIPTED, Role.CO_WIZARD: player}, towns=parse_towns("brookside"), sessions=1, seed=2,
        config=EnvConfig(max_seconds=30.0),
    )  # fmt: skip
    first, second = (roll_out(settings, tmp_path / name, workers=1) for name in ("one", "two"))
    assert first.errored == 0 and first.rows[0].record == second.rows[0].record
    session = Session.load(next((tmp_path / "one").rglob("session.json")).parent)
    decisions = [decision.actions.get(Role.CO_WIZARD, {}) for decision in session.decisions or ()]
    assert any("physical" in decision for decision in decisions), "it drives"
    assert any("move" in decision for decision in decisions), "it talks"


def test_other_roles_and_damaged_models_are_refused(tmp_path: Path) -> None:
    limits = DuoWizardEnv("brookside").limits
    train(tmp_path)
    with pytest.raises(ValueError, match="co_wizard"):
        find_player(str(tmp_path), Role.PARTICIPANT).make(Role.PARTICIPANT, limits)
    description = json.loads((tmp_path / "model.json").read_text())
    assert description["kind"] == "dorothie_gym-rl"
    (tmp_path / "model.safetensors").write_bytes(b"nothing")
    with pytest.raises(ModelFileError, match="model.safetensors"):
        find_player(str(tmp_path), Role.CO_WIZARD).make(Role.CO_WIZARD, limits)


def test_model_of_another_environment_is_refused(tmp_path: Path) -> None:
    train(tmp_path, env="dorothie_gym/CoWizard-v0", env_settings={"max_cycles": 20})
    with pytest.raises(SettingsError, match="CoWizard-v0"):
        find_player(str(tmp_path), Role.CO_WIZARD).make(Role.CO_WIZARD, DuoWizardEnv("brookside").limits)


def test_kinds_of_models_are_known_without_torch() -> None:
    script = (
        "import sys, dorothie_gym.baselines.loaders; from dorothie_gym.policies import loadable_kinds;"
        "sys.exit('torch' in sys.modules or 'dorothie_gym-rl' not in loadable_kinds())"
    )
    assert subprocess.run([sys.executable, "-c", script], timeout=120, check=False).returncode == 0
