from __future__ import annotations

import json

import pytest

from dorothie_gym.bench import importing
from dorothie_gym.bench.importing import ENVIRONMENT, PACKAGE, STEP, STOCK, measure

TAKEN = {STOCK: 0.5, PACKAGE: 0.1, ENVIRONMENT: 1.2, STEP: 1.5}


def test_the_figures_agree_with_each_other(monkeypatch: pytest.MonkeyPatch) -> None:
    """The processes take seconds each, so that here their times are given."""
    names = {code: name for name, code in importing._CODE.items()}
    run: list[str] = []

    def seconds(code: str) -> float:
        run.append(names[code])
        return TAKEN[names[code]]

    monkeypatch.setattr(importing, "_seconds", seconds)
    figures = measure(repeats=2)
    assert json.loads(json.dumps(figures)) == figures
    assert figures["seconds"] == {"package": 0.1, "first_environment": 1.2, "first_step": 1.5}
    assert figures["highway_env_seconds"] == 0.5 and figures["ratio"] == 2.4
    assert run[:2] == [STOCK, STEP], "one run of each fills the caches"
    assert run[2:] == [STOCK, PACKAGE, ENVIRONMENT, STEP] * 2


def test_a_fresh_process_is_timed() -> None:
    assert 0.0 < importing._seconds("pass") < importing._seconds(importing._CODE[PACKAGE])
