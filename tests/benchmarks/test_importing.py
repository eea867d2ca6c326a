from __future__ import annotations

import json

import pytest

from benchmarks import importing
from benchmarks.importing import FIRST_ENV, FIRST_STEP, HIGHWAY_ENV, PACKAGE, measure

TAKEN = {HIGHWAY_ENV: 0.5, PACKAGE: 0.1, FIRST_ENV: 1.2, FIRST_STEP: 1.5}


def test_figures_are_consistent(monkeypatch: pytest.MonkeyPatch) -> None:
    """Durations are given, because real processes take seconds each."""
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
    assert run[:2] == [HIGHWAY_ENV, FIRST_STEP], "one run of each fills the caches"
    assert run[2:] == [HIGHWAY_ENV, PACKAGE, FIRST_ENV, FIRST_STEP] * 2


def test_new_process_is_timed() -> None:
    assert 0.0 < importing._seconds("pass") < importing._seconds(importing._CODE[PACKAGE])
