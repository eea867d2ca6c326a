import json
import os
import signal
import subprocess
import sys
import time

import pytest
from typer.testing import CliRunner

from dorothie_gym.cli import app

runner = CliRunner()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["train", "gpt"], "there is no model 'gpt'; choose from toto, toto-belief"),
        (["train", "bert"], "there is no model 'bert': it is called 'text', which says what it is"),
        (["train", "detector-boxes"], "it is called 'objects-boxes'"),
        (["table", "--models", "toto,E.T."], "there is no model 'E.T.': it is called 'toto-episodic'"),
        (["train", "hubert"], "no audio"),
        (["table", "--models", "toto,gpt"], "there is no model 'gpt'"),
        (["train", "text", "--device", "cpu"], "--device is for segformer and detr only"),
        (["train", "segformer", "--inputs", "true"], "--inputs is for detr only"),
        (["train", "segformer", "--config", "huge"], "there is no config 'huge'; choose from small, paper"),
        (["train", "segformer", "--device", "abacus"], "the device 'abacus' cannot be used"),
        (["train", "detr", "--inputs", "guessed"], "there are no inputs 'guessed'; choose from predicted, true"),
        (["train", "text", "--detector", "here"], "--detector is for models of detections and queries only"),
        (["train", "segformer", "--detector", "here"], "--detector is for models of detections and queries only"),
        (["train", "toto-detections"], "run first: dorothie-gym train detr"),
        (["train", "objects-queries"], "run first: dorothie-gym train detr"),
        (["table", "--models", "toto,toto-episodic-detections"], "run first: dorothie-gym train detr"),
        (["train", "co-wizard", "--config", "paper"], "--config and --encoder are not for co-wizard"),
        (["train", "co-wizard", "--encoder", "minilm"], "--config and --encoder are not for co-wizard"),
        (["train", "participant", "--strict"], "--config and --encoder are not for participant"),
        (["train", "segformer", "--strict"], "--hubert, --strict and --encoder are not for segformer"),
        (["train", "detr", "--encoder", "hashing"], "--hubert, --strict and --encoder are not for detr"),
        (["train", "detr"], "run first: dorothie-gym train segformer"),
    ],
)
def test_unknown_and_untrainable_models_are_reported(arguments, message, tmp_path):
    result = runner.invoke(app, [*arguments, "--corpus", str(tmp_path), "--out", str(tmp_path / "runs")])
    assert result.exit_code == 2
    assert message in " ".join(result.stderr.split())


def test_folder_without_sessions_is_reported(tmp_path):
    result = runner.invoke(app, ["train", "text", "--corpus", str(tmp_path), "--out", str(tmp_path / "runs")])
    assert result.exit_code == 2
    assert str(tmp_path) in result.stderr.replace("\n", "")


def test_trainings_of_a_former_version_are_named_where_their_row_is_called_otherwise(tmp_path):
    (tmp_path / "runs" / "bert").mkdir(parents=True)
    for model, named in (("text", True), ("map", False)):
        result = runner.invoke(app, ["train", model, "--corpus", str(tmp_path), "--out", str(tmp_path / "runs")])
        assert ("whose row is called text now" in " ".join(result.stderr.split())) is named


@pytest.fixture(scope="module")
def corpus(tmp_path_factory):
    from dorothie_gym.evaluation.rollout import generate_corpus

    folder = tmp_path_factory.mktemp("corpus")
    generate_corpus(folder, sessions=16, seed=2, workers=1)  # as many as all folds need
    return folder


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_table_is_computed_once_and_then_read(corpus, tmp_path):
    command = ["table", "--models", "objects,cloning", "--seeds", "2", "--encoder", "hashing", "--json"]
    places = ["--corpus", str(corpus), "--out", str(tmp_path)]
    first = json.loads(runner.invoke(app, [*command, *places], catch_exceptions=False).stdout)
    again = json.loads(runner.invoke(app, [*command, *places], catch_exceptions=False).stdout)
    assert {"Objects Only", "Behaviour Cloning", "majority", "random"} <= set(first["models"])
    figure = first["models"]["Objects Only"]["seen"]["nfd_joint_accuracy"]
    assert figure["seeds"] == 2 and 0 <= figure["mean"] <= 1
    assert again["models"] == first["models"] and again["wall_seconds"] < first["wall_seconds"]
    assert {"table.md", "table.tex", "table.json", "predictions.parquet"} <= {path.name for path in tmp_path.iterdir()}


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_killed_training_resumes_to_the_same_bytes(corpus, tmp_path):
    def command(out):
        options = ["--corpus", str(corpus), "--seeds", "1", "--encoder", "hashing", "--json"]
        return [sys.executable, "-m", "dorothie_gym.cli", "train", "map", *options, "--out", str(tmp_path / out)]

    folder = "map/small/seed-0"
    subprocess.run(command("whole"), check=True, capture_output=True)
    process = subprocess.Popen(command("killed"), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    last = tmp_path / "killed" / folder / "last.safetensors"
    while not last.exists():
        assert process.poll() is None
        time.sleep(0.01)
    time.sleep(0.3)
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    assert not (tmp_path / "killed" / folder / "result.json").exists(), "it was killed too late to test anything"
    subprocess.run(command("killed"), check=True, capture_output=True)
    for name in ("best.safetensors", "last.safetensors"):
        whole, killed = (tmp_path / out / folder / name for out in ("whole", "killed"))
        assert whole.read_bytes() == killed.read_bytes()


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_vision_models_are_trained_one_on_the_other_and_then_read(corpus, tmp_path):
    pytest.importorskip("transformers")
    places = ["--corpus", str(corpus), "--out", str(tmp_path), "--epochs", "1", "--device", "cpu", "--json"]
    seen = json.loads(runner.invoke(app, ["train", "segformer", *places], catch_exceptions=False).stdout)["runs"][0]
    assert 0.0 < seen["test"]["unseen"]["miou"] < 1.0 and seen["paper"]["miou"] == 0.656
    found = json.loads(runner.invoke(app, ["train", "detr", *places], catch_exceptions=False).stdout)["runs"][0]
    assert 0.0 <= found["test"]["seen"]["ap50"] <= 1.0 and found["inputs"] == "predicted"
    again = json.loads(runner.invoke(app, ["train", "segformer", *places], catch_exceptions=False).stdout)["runs"][0]
    assert again == seen
    printed = runner.invoke(app, ["train", "segformer", *places[:-1]], catch_exceptions=False).stdout
    assert "mIoU" in printed and "65.6 %" in printed
