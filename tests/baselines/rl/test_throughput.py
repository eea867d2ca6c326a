from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

pytest.importorskip("stable_baselines3", reason="needs the extra 'baselines'")

from dorothie_gym.baselines.rl.throughput import SHARES, measure
from dorothie_gym.bench.report import rl_report
from dorothie_gym.cli.app import app
from dorothie_gym.errors import SettingsError
from dorothie_gym.policies.navigation.instructor import Instructor


def test_shares_of_the_time_sum_to_one() -> None:
    instruct = Instructor.instruct
    figures = measure(environments=2, workers=0, steps=512)
    assert Instructor.instruct is instruct  # the patch is removed
    assert set(figures["shares"]) == set(SHARES)
    assert sum(figures["shares"].values()) == pytest.approx(1.0, abs=0.01)
    assert min(figures["shares"].values()) > 0.0
    assert figures["workers_steps_per_second"] is None
    report = rl_report(figures)
    assert "environment steps per second" in report.headline and len(report.rows) == 1
    json.dumps(figures, allow_nan=False)


def test_off_policy_algorithm_is_refused() -> None:
    with pytest.raises(SettingsError, match="algorithm"):
        measure(algorithm="dqn")
    result = CliRunner().invoke(app, ["bench", "rl", "--algorithm", "dqn"])
    assert result.exit_code == 2 and "algorithm is 'dqn'" in " ".join(result.stderr.split())
