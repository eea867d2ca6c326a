from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

pytest.importorskip("stable_baselines3", reason="needs the extra 'baselines'")

from benchmarks import navigation
from benchmarks.commands import app
from benchmarks.report import rl_report
from benchmarks.rl_training import SHARES, measure
from dorothie_gym.errors import SettingsError

KEYS = ("batch", "kernel", "single", "end_to_end", "stock")


@pytest.mark.slow
def test_speeds_and_shares_of_a_training_on_a_batch() -> None:
    figures = measure(environments=4, steps=512)
    assert set(figures["shares"]) == set(SHARES)
    assert sum(figures["shares"].values()) == pytest.approx(1.0, abs=0.01)
    assert min(figures["shares"].values()) > 0.0
    assert sum(figures["step_shares"].values()) == pytest.approx(1.0, abs=0.01)
    assert all(figures[f"{key}_steps_per_second"] > 0.0 for key in KEYS)
    report = rl_report(figures)
    assert "environment steps per second" in report.headline
    assert len(report.rows) == 5 + (figures["metadrive_steps_per_second"] is not None)
    json.dumps(figures, allow_nan=False)


def test_pictures_are_a_part_of_the_steps() -> None:
    figures = navigation.measure(observation="camera", environments=2, decisions=4, repeats=1)
    assert list(figures["step_shares"]) == ["physics", "actions", "guidance", "other", "pictures"]
    assert figures["step_shares"]["pictures"] > 0.2
    assert figures["bytes_per_environment"] > 1e6


def test_unknown_observation_is_refused() -> None:
    result = CliRunner().invoke(app, ["rl", "--observation", "radar"])
    assert result.exit_code == 2
    assert "observation is 'radar'; it must be one of vector, camera" in " ".join(result.stderr.split())


@pytest.mark.long
def test_other_environments_are_only_trained_on() -> None:
    figures = measure("dorothie_gym/CoWizard-v0", algorithm="a2c", environments=2, workers=0, steps=256)
    assert figures["batch_steps_per_second"] is None and figures["end_to_end_steps_per_second"] > 0.0
    assert len(rl_report(figures).rows) == 1


def test_off_policy_algorithm_is_refused() -> None:
    with pytest.raises(SettingsError, match="algorithm"):
        measure(algorithm="dqn")
    result = CliRunner().invoke(app, ["rl", "--algorithm", "dqn"])
    assert result.exit_code == 2 and "algorithm is 'dqn'" in " ".join(result.stderr.split())
