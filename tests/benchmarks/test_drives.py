"""Driving tests are played, and judged by what the car did and said."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from benchmarks.drives import measure, play, read_tests
from dorothie_gym.errors import SettingsError

NEEDS = {"junctions": 1, "lights": 0, "landmark": None, "street": None}


def record(
    text: str, *plan: dict[str, Any], reply: str = "confirm", about: str | None = None, **needs: Any
) -> dict[str, Any]:
    return {
        "id": "t1",
        "split": "dev",
        "kind": "plan",
        "needs": {**NEEDS, **needs},
        "says": [{"at": "start", "text": text}],
        "expected": {"plan": list(plan), "reply": reply, "about": about},
    }


def played(tmp_path: Path, row: dict[str, Any]) -> tuple[str | None, str | None]:
    path = tmp_path / "drives.jsonl"
    path.write_text(json.dumps(row) + "\n", encoding="utf-8")
    (test,) = read_tests(path, "dev")
    result = play(test, "brookside")
    assert result is not None
    return result.drive, result.reply


def test_turn_as_expected_passes_and_another_fails(tmp_path: Path) -> None:
    left, right = ({"action": "turn", "direction": side} for side in ("left", "right"))
    assert played(tmp_path, record("take the next left", left)) == (None, None)
    drive, reply = played(tmp_path, record("take the next left", right))
    assert drive is not None
    assert reply is None


def test_stop_elsewhere_fails(tmp_path: Path) -> None:
    at = {"action": "stop", "condition": {"relation": "at", "place": {"landmark": "{landmark}"}}}
    drive, _ = played(tmp_path, record("stop at the {landmark}", at, landmark="any"))
    assert drive is None
    drive, _ = played(tmp_path, record("stop right now, not at the {landmark}", at, landmark="any"))
    assert drive is not None


def test_reply_has_to_be_of_the_kind_and_about_the_topic(tmp_path: Path) -> None:
    question = "how fast are we going?"
    assert played(tmp_path, record(question, reply="answer", about="speed"))[1] is None
    assert played(tmp_path, record(question, reply="answer", about="weather"))[1] is not None


def test_speed_that_was_not_asked_for_is_not_reached(tmp_path: Path) -> None:
    assert played(tmp_path, record("drive at twenty", {"action": "speed", "speed": 20}))[0] is None
    drive, _ = played(tmp_path, record("drive at twenty", {"action": "speed", "speed": 40}))
    assert drive is None or "stays" in drive  # the car drives at 40 before
    drive, _ = played(tmp_path, record("drive at twenty", {"action": "speed", "speed": 60}))
    assert drive is not None


def test_figures_count_kinds_and_name_failures(tmp_path: Path) -> None:
    path = tmp_path / "drives.jsonl"
    rows = [record("take the next left", {"action": "turn", "direction": side}) for side in ("left", "right")]
    path.write_text("".join(json.dumps(row) + "\n" for row in rows), encoding="utf-8")
    figures = measure(records=path, towns=("brookside",), progress=lambda part, share: None)
    assert figures["tests"] == 2 and figures["as_expected"] == 0.5 and figures["kinds"] == {"plan": [1, 2]}
    assert [failure["id"] for failure in figures["failures"]] == ["t1"]


@pytest.mark.parametrize("line", ["no json", "{}", '{"split": "dev", "expected": 3}'])
def test_malformed_line_is_named(tmp_path: Path, line: str) -> None:
    path = tmp_path / "drives.jsonl"
    path.write_text(line + "\n", encoding="utf-8")
    with pytest.raises(SettingsError, match=r"drives\.jsonl, line 1"):
        read_tests(path, "dev")


def test_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match="cannot be read"):
        read_tests(tmp_path / "none.jsonl", "dev")


@pytest.mark.parametrize("asked", [{"split": "train"}, {"only": "nothing"}])
def test_no_test_at_all_is_an_error(asked: dict[str, Any]) -> None:
    with pytest.raises(SettingsError, match=f"no driving test .*{next(iter(asked.values()))}"):
        measure(progress=lambda name, share: None, **asked)
