from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

pytest.importorskip("torch", reason="needs the extra 'baselines'")

from benchmarks.commands import app
from dorothie_gym.evaluation.rollout import generate_corpus


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_training_speed_is_compared_with_the_published_loop(tmp_path: Path) -> None:
    generate_corpus(tmp_path, sessions=16, seed=2, workers=1)  # as many as all folds need
    options = ["--corpus", str(tmp_path), "--threads", "1", "--repeats", "1", "--batch", "8", "--json"]
    figures = json.loads(CliRunner().invoke(app, ["train", *options], catch_exceptions=False).stdout)
    assert 92e6 < figures["published_parameters"] < 95e6
    assert figures["points_per_second"] > 0 and 0 < figures["matrix_share"] < 1.5
    assert figures["flops_per_point"] > 2e9
