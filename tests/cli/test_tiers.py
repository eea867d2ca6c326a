"""Options of tiers that exclude each other, or need what is not there, are refused before anything is compiled."""

from __future__ import annotations

from typing import Any

import pytest
from typer.testing import CliRunner

from dorothie_gym.cli.app import app
from dorothie_gym.support import optional_modules


@pytest.fixture(autouse=True)
def nothing_is_compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(**_: object) -> None:
        raise AssertionError("compiles before its options are checked")

    for command in ("rollout", "run", "reference_times"):
        monkeypatch.setattr(f"dorothie_gym.cli.{command}.compile_first", fail)


def refused(*arguments: str) -> str:
    done: Any = CliRunner().invoke(app, arguments)
    assert done.exit_code == 2 and not done.stdout, (done.output, done.exception)
    (line,) = done.stderr.splitlines()
    return str(line)


@pytest.mark.parametrize("command", ["rollout", "run"])
def test_a_spoken_tier_without_speech_says_what_to_do(command: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(optional_modules, "PACKAGES", ("no_such_package",))
    line = refused(command, "--tier", "strangers")
    assert "no_such_package" in line and "[speech]" in line and "--word-errors" in line
    line = refused(command, "--tier", "ears", "--speech")
    assert "[speech]" in line and "--word-errors" not in line


@pytest.mark.parametrize("command", ["rollout", "run"])
def test_speech_and_word_errors_exclude_each_other_in_a_tier(command: str) -> None:
    assert "leave it out with --speech" in refused(command, "--tier", "ears", "--speech", "--word-errors", "0.1")


@pytest.mark.parametrize(
    ("option", "value"),
    [("--co-wizard", "silent"), ("--word-errors", "0.1"), ("--speech", ""), ("--perception", "camera")],
)
def test_the_oracle_is_refused_with_parts_that_are_not_its_own(option: str, value: str) -> None:
    line = refused("rollout", "--tier", "rough", "--oracle", option, *([value] if value else []))
    assert line.endswith(f"leave out {option}")
    assert "give it with --tier" in refused("rollout", "--oracle")


@pytest.mark.parametrize("command", ["rollout", "run", "reference-times"])
def test_an_unknown_tier_is_refused(command: str) -> None:
    out = ["--out", "references.json"] if command == "reference-times" else []
    assert "did you mean 'rough'" in refused(command, "--tier", "tough", *out)


def test_a_tier_of_talk_names_its_oracle_and_has_no_reference_times() -> None:
    line = refused("rollout", "--tier", "ask-first", "--oracle", "--co-wizard", "silent")
    assert "talk-oracle" in line and line.endswith("leave out --co-wizard")
    assert "no reference times" in refused("reference-times", "--tier", "admit-it", "--out", "references.json")
