"""`dorothie-gym train` on a corpus of a few hand-made sessions."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from dorothie_gym.cli import app
from tests.evaluation.teacher_forced.corpora import corpus


def train(folder: Path, *arguments: str) -> dict[str, object]:
    options = ["--corpus", str(folder / "corpus"), "--out", str(folder / "runs"), "--encoder", "hashing"]
    done = CliRunner().invoke(app, ["train", *arguments, *options, "--seeds", "1", "--json"], catch_exceptions=False)
    return dict(json.loads(done.stdout)["runs"][0])


@pytest.mark.parametrize("model", ["trees", "tfidf", "map"])
def test_a_training_reports_its_metrics_on_the_validation_folds(model: str, tmp_path: Path) -> None:
    corpus(tmp_path / "corpus")
    validation = train(tmp_path, model)["validation"]
    assert isinstance(validation, dict)
    assert {"ufn_move_accuracy", "rfn_slot_f1", "nfd_joint_accuracy"} <= set(validation)
    assert 0.0 <= validation["nfd_action_accuracy"] <= 1.0


def test_trainings_under_the_strict_rule_have_folders_of_their_own(tmp_path: Path) -> None:
    corpus(tmp_path / "corpus")
    folders = [str(train(tmp_path, "tfidf", *rule)["folder"]) for rule in ((), ("--strict",))]
    assert len(set(folders)) == 2 and all(Path(folder, "predictions.parquet").is_file() for folder in folders)
