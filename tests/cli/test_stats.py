from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from dorothie_gym.cli import app
from dorothie_gym.ontology import ActionValue, LandmarkName
from dorothie_gym.session.recording import Event
from tests.evaluation.analysis.builders import M, car, human
from tests.session.recording.builders import write

KEYS = [
    "sessions", "control_hours", "audio_hours", "utterances", "words", "vocabulary", "transactions", "exchanges",
    "moves", "slot_values", "physical_actions", "folds", "distinct_utterance_ratio", "anchors", "diversity",
]  # fmt: skip


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")


def stats(*arguments: object, code: int = 0) -> Any:
    result = CliRunner().invoke(app, ["stats", *map(str, arguments)])
    assert result.exit_code == code, result.output
    return result


def refused(*arguments: object) -> str:
    result = stats(*arguments, code=2)
    assert isinstance(result.exception, SystemExit) and result.stdout == ""
    assert result.stderr.startswith("Error: ") and result.stderr.count("\n") == 1
    return str(result.stderr)


def conversation(*, exchange: int | None = 0, instruct: bool = True) -> list[Event]:
    """One exchange in one transaction, as it would be recorded."""
    stored = {"exchange": exchange, "transaction": 0}
    move = M.INSTRUCT if instruct else M.EXPLAIN
    return [
        *human(1.0, "the KFC please", move, LandmarkName.KFC, **stored),
        *car(4.0, "heading there", M.ACKNOWLEDGE, **{**stored, "exchange": 0}),
        *human(6.0, "left", M.INSTRUCT, ActionValue.J_TURN, exchange=1, transaction=0),
    ]


def corpus() -> Path:
    for k, fold in enumerate(("train", "train", "val/seen", "test/unseen")):
        write(Path("corpus") / fold / f"seed_{k}", conversation(), seed=k)
    return Path("corpus")


def test_figures_of_talk_are_whole_on_a_narrow_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "60")
    shown = stats(corpus(), "--talk").stdout
    assert "…" not in shown
    assert "sessions that mention somebody or something" in shown and " %" in shown


@pytest.mark.parametrize("option", [(), ("--phenomena",), ("--behaviour",), ("--speech",), ("--check",)])
def test_no_figure_is_cut_at_80_columns(option: tuple[str, ...], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setenv("TTY_COMPATIBLE", "1")
    monkeypatch.setenv("NO_COLOR", "1")
    monkeypatch.setenv("TERM", "dumb")
    shown = CliRunner().invoke(app, ["stats", str(corpus()), *option]).stdout
    assert len(shown.splitlines()) > 3 or option == ("--check",)
    assert "…" not in shown and max(map(len, shown.splitlines())) <= 80


def test_corpus_is_shown_beside_that_of_the_paper() -> None:
    shown = stats(corpus()).stdout
    assert "8,415" in shown and "18.70" in shown and "vocabulary" in shown
    assert [line.split() for line in shown.splitlines() if line.startswith("test/unseen")] == [
        ["test/unseen", "1", "15"]
    ]


def test_json_has_the_keys_of_the_table_and_nothing_else_on_standard_output() -> None:
    table = json.loads(stats(corpus(), "--json").stdout)
    assert list(table) == KEYS
    assert (table["sessions"], table["utterances"], table["exchanges"], table["transactions"]) == (4, 12, 8, 4)
    assert table["folds"] == {"train": 2, "val/seen": 1, "test/unseen": 1}
    assert table["diversity"]["perplexity"] > 1.0


def test_one_session_is_accepted_as_corpus() -> None:
    table = json.loads(stats(write(Path("one"), conversation()), "--json").stdout)
    assert table["sessions"] == 1 and table["folds"] == {} and table["diversity"]["perplexity"] is None


def test_picture_is_drawn_with_or_without_a_name() -> None:
    stats(corpus(), "--picture", "here.png")
    stats(corpus_again := Path("corpus"), "--json", "--picture")
    stats("--picture", corpus_again)
    for name in ("here.png", "statistics.png"):
        assert Path(name).read_bytes().startswith(b"\x89PNG")


def test_every_phenomenon_is_in_the_table() -> None:
    found = json.loads(stats(corpus(), "--phenomena", "--json").stdout)
    assert found["sessions"] == 4 and [row["number"] for row in found["phenomena"]] == list(range(1, 25))
    goal = found["phenomena"][0]
    assert (goal["sessions"], goal["occurs"], goal["share"], goal["forms"]) == (4, 4, 1.0, {"goal": 4})
    assert goal["example"]["text"] == "the KFC please"
    assert "goal-level instruction" in stats("corpus", "--phenomena").stdout


def test_claims_of_the_paper_are_tested_one_by_one() -> None:
    found = json.loads(stats(corpus(), "--behaviour", "--json").stdout)
    assert found["sessions"] == 4
    rows = {row["name"]: row for row in found["behaviour"]}
    instructs = rows["human_mostly_instructs"]
    # every move of the participants is an Instruct in all four sessions, so that every drawn corpus says the same
    assert (instructs["difference"], instructs["low"], instructs["high"], instructs["holds"]) == (1.0, 1.0, 1.0, True)
    assert rows["task_car_informs"]["difference"] is None and rows["task_car_informs"]["holds"] is False
    shown = stats("corpus", "--behaviour").stdout
    assert "participant: mostly Instruct" in shown and "+1.000 to +1.000  holds" in shown and "does not hold" in shown


def test_consistent_annotation_passes() -> None:
    assert "4 of 4 sessions" in stats(corpus(), "--check").stdout


def test_annotation_fault_is_named_and_fails() -> None:
    corpus()
    write(Path("corpus/train/bad"), conversation(exchange=None), seed=9)
    shown = stats("corpus", "--check", code=1).stdout
    assert "train/bad: " in shown and "begins no exchange" in shown and "4 of 5 sessions" in shown
    found = json.loads(stats("corpus", "--check", "--json", code=1).stdout)
    assert found["consistent"] == 4 and list(found["faults"]) == ["train/bad"]


def test_kappa_of_two_annotations() -> None:
    one, other = write(Path("a"), conversation()), write(Path("b"), conversation(instruct=False))
    found = json.loads(stats("--kappa", one, other, "--json").stdout)
    # Moves agree in 2 of 3; by chance (2/3)(1/3) + (1/3)(1/3) = 1/3; so (2/3 - 1/3) / (1 - 1/3) = 1/2.
    assert found == {"moves": pytest.approx(0.5), "slots": pytest.approx(1.0), "pieces": 3, "utterances": 3}
    assert "0.50" in stats("--kappa", one, other).stdout


def test_kappa_of_different_sessions_is_refused() -> None:
    one, other = write(Path("a"), conversation()), write(Path("b"), conversation(), seed=8)
    assert "a and b are not the same session: seed is 7 in the one, 8 in the other" in refused("--kappa", one, other)


def test_invalid_arguments_are_reported_in_one_line() -> None:
    corpus()
    assert "dorothie-gym stats DIR" in refused()
    assert "--phenomena and --check" in refused("corpus", "--phenomena", "--check")
    assert "nowhere" in refused("nowhere")
    assert "omit the folder" in refused("corpus", "--kappa", "a", "b")
    assert ".png" in refused("corpus", "--picture", "figure.pdf")
