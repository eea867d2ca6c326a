from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from dorothie_gym.errors import RolloutError
from dorothie_gym.evaluation.closed_loop import MetException, RolloutResult, RolloutRow, RolloutSettings, read_result
from dorothie_gym.ontology import ExceptionKind
from tests.evaluation.closed_loop.drives import record

WEATHER = MetException(kind=ExceptionKind.WEATHER, met=1.0, seconds=4.0)
PROP = MetException(kind=ExceptionKind.PLACE_PROP, met=1.0)


def result(**changes: Any) -> RolloutResult:
    rows = (
        RolloutRow(number=0, town="midtown", seed=1, record=record(exceptions=(WEATHER, PROP))),
        RolloutRow(number=1, town="brookside", seed=2, record=record(success=False)),
        RolloutRow(number=2, town="midtown", seed=3, error="RuntimeError: faint"),
    )
    return RolloutResult(settings=RolloutSettings(sessions=3, **changes).to_json(), rows=rows)


def test_table_counts_what_ended_in_an_error() -> None:
    page = result().to_json()
    assert (page["sessions"], page["errored"], page["decisions"], page["seeds"]) == (3, 1, 400, [1, 2, 3])
    assert page["success"]["mean"] == pytest.approx(1 / 3, abs=1e-6) and page["complete"]
    assert page["seconds"] == {"mean": 100.0, "low": 100.0, "high": 100.0}


def test_towns_have_tables_of_their_own() -> None:
    towns = result().to_json()["per_town"]
    assert list(towns) == ["midtown", "brookside"]
    assert (towns["midtown"]["sessions"], towns["midtown"]["errored"]) == (2, 1)
    assert towns["midtown"]["success"]["mean"] == 0.5 and towns["brookside"]["success"]["mean"] == 0.0


def test_exceptions_have_the_sessions_in_which_they_happened_and_their_own_recovery() -> None:
    kinds = result().to_json()["per_exception"]
    assert list(kinds) == ["weather", "place_prop", "none"]
    assert kinds["weather"]["exceptions_recovered"]["mean"] == 1.0
    assert kinds["place_prop"]["exceptions_recovered"]["mean"] == 0.0
    assert kinds["none"]["sessions"] == 1 and kinds["none"]["success"]["mean"] == 0.0


def test_result_survives_its_file(tmp_path: Path) -> None:
    page = json.dumps(result().to_json(), allow_nan=False)
    (tmp_path / "rollout.json").write_text(page)
    assert read_result(tmp_path) == read_result(tmp_path / "rollout.json") == result()
    assert json.dumps(read_result(tmp_path).to_json()) == page


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('{"version": ', "not JSON"),
        ("[]", "Expected `object`, got `array`; give a rollout.json"),
        ('{"version": "1.0"}', "missing required field `settings`"),
        ('{"version": "2.0"}', "is of version 2.0"),
    ],
)
def test_other_files_are_rejected(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "rollout.json").write_text(text)
    with pytest.raises(RolloutError, match=message):
        read_result(tmp_path)
    with pytest.raises(RolloutError, match="does not exist"):
        read_result(tmp_path / "nowhere")
