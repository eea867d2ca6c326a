"""Folders of `dorothie-gym train` play the Co-Wizard."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from dorothie_gym.baselines.benchmark_co_wizard.inference import BenchmarkModel
from dorothie_gym.baselines.dataset import Dataset
from dorothie_gym.baselines.experiment import Experiment, run_experiment
from dorothie_gym.evaluation.closed_loop import RolloutSettings, roll_out
from dorothie_gym.ontology import Role
from dorothie_gym.policies import ALL_SCRIPTED, find_player
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.recording import Session
from dorothie_gym.session.spaces import SpaceLimits
from tests.evaluation.teacher_forced.corpora import corpus

MODELS = ("toto", "reader", "toto-trained-text")


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Small models, trained on a few points."""
    root = tmp_path_factory.mktemp("trained")
    sessions = corpus(root / "corpus")
    material = Dataset.load(sessions, "hashing")
    jobs = [
        Experiment(corpus=sessions, encoder="hashing", model=name, size="small", seed=0, out=root) for name in MODELS
    ]
    for job in jobs:
        run_experiment(job, material)
    return {job.model: job.folder for job in jobs}


def settings(folder: Path, seconds: float, observe_acts: bool = True) -> RolloutSettings:
    return RolloutSettings(
        cast={**ALL_SCRIPTED, Role.CO_WIZARD: find_player(str(folder), Role.CO_WIZARD)},
        towns=("brookside",),
        sessions=2,
        seed=3,
        config=EnvConfig(max_seconds=seconds, observe_acts=observe_acts),
    )


@pytest.mark.long
def test_two_rollouts_with_one_worker_or_two_give_the_same_bytes(folders: dict[str, Path], tmp_path: Path) -> None:
    plan = settings(folders["reader"], 30.0)
    result = roll_out(plan, tmp_path / "one")
    assert result.errored == 0
    roll_out(plan, tmp_path / "two", workers=2)
    assert (tmp_path / "one" / "rollout.json").read_bytes() == (tmp_path / "two" / "rollout.json").read_bytes()
    session = Session.load(tmp_path / "one" / plan.plans()[0].path)
    assert session.moves(Role.CO_WIZARD), "it talks"
    assert session.physical_actions, "and drives"


@pytest.mark.parametrize("model", ["toto", "toto-trained-text", "reader"])
def test_every_kind_of_model_plays_whether_acts_are_observed_or_not(
    model: str, folders: dict[str, Path], tmp_path: Path
) -> None:
    for observed in (True, False):
        result = roll_out(settings(folders[model], 8.0, observed), tmp_path / str(observed))
        assert [row.error for row in result.rows if row.error] == []


def test_hash_covers_the_weights_and_training_cost_is_reported(folders: dict[str, Path], tmp_path: Path) -> None:
    player = find_player(str(folders["toto"]), Role.CO_WIZARD)
    told = json.loads((folders["toto"] / "result.json").read_text())
    assert player.training == {"steps": told["points"] * told["epochs"], "seconds": told["seconds"]}
    other = shutil.copytree(folders["toto"], tmp_path / "other")
    with (other / "best.safetensors").open("ab") as file:
        file.write(b"more")
    with pytest.raises(ValueError, match=r"best\.safetensors: is missing, or differs from the trained weights"):
        find_player(str(other), Role.CO_WIZARD).make(Role.CO_WIZARD, SpaceLimits())


def test_models_play_the_co_wizard_only(folders: dict[str, Path]) -> None:
    player = find_player(str(folders["toto"]), Role.PARTICIPANT)
    with pytest.raises(ValueError, match="play the Co-Wizard, not the participant"):
        player.make(Role.PARTICIPANT, SpaceLimits())


def test_another_encoder_than_the_model_was_trained_with_is_refused(folders: dict[str, Path], tmp_path: Path) -> None:
    other = shutil.copytree(folders["toto"], tmp_path / "other")
    page = json.loads((other / "model.json").read_text())
    (other / "model.json").write_text(json.dumps({**page, "encoder_id": "hashing-0"}))
    with pytest.raises(ValueError, match="was trained with the encoder hashing-0"):
        BenchmarkModel.load(other)


def test_a_model_of_a_version_with_other_names_plays(folders: dict[str, Path], tmp_path: Path) -> None:
    other = shutil.copytree(folders["toto-trained-text"], tmp_path / "other")
    page = json.loads((other / "model.json").read_text())
    (other / "model.json").write_text(json.dumps({**page, "row": "toto-bert"}))
    assert BenchmarkModel.load(other).row.command == page["row"] == "toto-trained-text"
    assert roll_out(settings(other, 8.0), tmp_path / "sessions").errored == 0


def test_model_card_of_another_version_is_refused(folders: dict[str, Path], tmp_path: Path) -> None:
    other = shutil.copytree(folders["toto"], tmp_path / "other")
    (other / "model.json").write_text('{"kind": "benchmark"}')
    with pytest.raises(ValueError, match="describes no model of this version"):
        BenchmarkModel.load(other)


def test_making_files_playable_does_not_import_torch() -> None:
    script = "import sys, dorothie_gym.baselines.loaders; sys.exit('torch' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", script], check=False).returncode == 0
