import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from benchmarks.commands import app
from benchmarks.report import understanding_report
from benchmarks.understanding import measure, read_sentences
from dorothie_gym.errors import SettingsError

LEFT = {"action": "turn", "direction": "left", "condition": {"relation": "at", "place": {"landmark": "KFC"}}}


def row(text: str, move: str, slots: dict[str, list[str]], plan: list[object], **changes: object) -> dict[str, object]:
    acts = [{"text": text, "move": move, "slots": slots}]
    return {
        "id": "x1",
        "split": "dev",
        "kind": "turn",
        "before": "",
        "text": text,
        "acts": acts,
        "plan": plan,
        **changes,
    }


def write(folder: Path, *rows: dict[str, object]) -> Path:
    (folder / "sentences.jsonl").write_text("\n".join(map(json.dumps, rows)) + "\n", encoding="utf-8")
    return folder


def test_moves_slots_and_plans_are_compared_with_their_labels(tmp_path: Path) -> None:
    slots = {"Action": ["JTurn"], "Landmark": ["KFC"]}
    folder = write(
        tmp_path,
        row("left at the KFC please", "Instruct", slots, [LEFT]),
        row("left at the KFC", "Explain", {"Action": ["Stop"]}, [{"action": "stop"}], kind="stop"),
        row("never read", "Explain", {}, [], split="test"),
    )
    figures = measure(folder=folder, split="dev")
    kinds = figures["written"]["kinds"]
    assert figures["sentences"] == 2
    assert kinds["turn"]["first_move_and_slots"] == kinds["turn"]["plan"] == kinds["turn"]["steps_f1"] == 1.0
    assert kinds["stop"]["first_move"] == kinds["stop"]["plan"] == kinds["stop"]["slots_f1"] == 0.0
    assert figures["written"]["all"]["first_move"] == 0.5
    assert figures["written"]["all"]["slots_precision"] == 0.5
    assert figures["written"]["all"]["slots_recall"] == pytest.approx(2 / 3, abs=1e-3)
    assert 0.0 < figures["milliseconds"] < 1000.0
    report = understanding_report(figures)
    assert [(line.label, line.value) for line in report.rows] == [("stop", 0.0), ("turn", 100.0)]


@pytest.mark.parametrize(
    ("change", "named"),
    [({"plan": [{"action": "fly"}]}, "there is no StepAction 'fly'"), ({"acts": 3}, "`acts` must be a list")],
)
def test_a_malformed_label_is_refused_with_its_line(tmp_path: Path, change: dict[str, object], named: str) -> None:
    folder = write(tmp_path, row("go", "Instruct", {}, []), {**row("go", "Instruct", {}, []), **change})
    with pytest.raises(SettingsError, match="line 2") as raised:
        read_sentences(folder)
    assert named in str(raised.value)


def test_a_folder_without_sentences_is_named(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match="no sentences of the split test"):
        measure(folder=write(tmp_path, row("go", "Instruct", {}, [])), split="test")


def test_an_unknown_split_is_refused() -> None:
    done = CliRunner().invoke(app, ["understanding", "--split", "train"])
    assert done.exit_code == 2
