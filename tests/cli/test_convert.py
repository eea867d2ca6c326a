from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner

from dorothie_gym.archive import Corpus, Fold
from dorothie_gym.archive.sdn import read_sdn
from dorothie_gym.cli import app
from dorothie_gym.session.recording import Session
from tests.archive.sdn.builders import csv, drive, hub, release, sample
from tests.session.recording.builders import write
from tests.session.recording.dialogues import talk


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")


def converted(*arguments: object, code: int = 0) -> Any:
    result = CliRunner().invoke(app, ["convert", *map(str, arguments)])
    assert result.exit_code == code, result.output
    return result


def refused(*arguments: object) -> str:
    result = converted(*arguments, code=2)
    assert isinstance(result.exception, SystemExit) and result.stdout == ""
    assert result.stderr.startswith("Error: ") and result.stderr.count("\n") == 1
    return str(result.stderr)


def test_session_is_converted_to_sdn_and_back() -> None:
    write(Path("one"), talk())
    converted("one", "there", "--to", "sdn")
    assert (Path("there") / "annotated_log.json").is_file()
    converted("there", "back", "--to", "native")
    one, back = Session.load("one"), Session.load("back")
    assert back.header == one.header and back.summary == one.summary and back.complete
    assert [e.data for e in back.events] == [e.data for e in one.events]
    assert back.check() == ()


def test_corpus_keeps_its_folds_and_gets_the_names_of_the_release() -> None:
    for k, fold in enumerate(("train", "train", "val/seen", "test/unseen")):
        write(Path("corpus") / fold / f"seed_{k}", talk(), seed=k)
    converted("corpus", "sdn", "--to", "sdn")
    found = sorted(path.parent.relative_to("sdn").as_posix() for path in Path("sdn").rglob("config.json"))
    assert found == ["test/unseen/log_3", "train/log_0", "train/log_1", "val/seen/log_2"]
    converted("sdn", "native", "--to", "native")
    assert Corpus.load("native").folds == {Fold.TRAIN: 2, Fold.VAL_SEEN: 1, Fold.TEST_UNSEEN: 1}


def test_sessions_of_one_seed_do_not_collide() -> None:
    for name in "ab":
        write(Path("corpus") / name, talk())
    rows = json.loads(converted("corpus", "sdn", "--to", "sdn", "--json").stdout)["sessions"]
    assert len({row["out"] for row in rows}) == 2


def test_all_layouts_of_a_folder_are_converted() -> None:
    release(Path("sdn/train/log_1"), trajectory__csv=csv(drive(90.0)))
    release(Path("sdn/train/log_2"), trajectory__csv=csv(drive(90.0)))
    release(Path("sdn/val/seen/log_3"), trajectory__csv=None)
    sample(Path("sdn/test/seen/one"))
    hub(Path("sdn/test/log_4"))
    result = json.loads(converted("sdn", "out", "--to", "native", "--json").stdout)
    reports = [row["report"] for row in result["sessions"]]
    assert sorted(report["layout"] for report in reports) == ["hub", "release", "release", "release", "sample"]
    agreed = {"positive": "right", "agreement": 1.0, "turns": 2}
    assert all(report["facts"]["turn_angles"] == agreed for report in reports)
    assert Session.load("out/val/seen/log_3").physical_actions[1].angle == -90.0
    assert set(result["sessions"][0]) == {"path", "out", "complete", "events", "frames", "report", "faults"}


def test_report_is_printed_in_words() -> None:
    release(Path("log_1"))
    told = converted("log_1", "out", "--to", "native").stdout
    for part in (
        "release, ",
        "300 frames -> out",
        "kept, not understood: ad_wizardlog.csv: type 'camera_shake'",
        "turn angles: positive left, agreement 1.0, turns 1",
        "lane switch values: 2 1, 3 1",
        "1 of 1 sessions written",
    ):
        assert part in told


def test_sessions_become_tables() -> None:
    for k, fold in enumerate(("train", "test/unseen")):
        write(Path("corpus") / fold / f"seed_{k}", talk(), seed=k)
    told = json.loads(converted("corpus", "tables", "--to", "tables", "--json").stdout)
    utterances, decisions = (pq.read_table(path).to_pylist() for path in told["tables"])
    assert len(utterances) == 14 and {row["fold"] for row in utterances} == {"train", "test/unseen"}
    assert utterances[0]["text"] == "To the KFC please." and utterances[0]["landmark"] == ["KFC"]
    assert len(decisions) == 10 and decisions[1]["angle"] == 88.0
    assert "2 sessions: tables/utterances.parquet" in converted("corpus", "tables", "--to", "tables").stdout


def test_unreadable_sessions_are_named_and_the_rest_is_converted() -> None:
    release(Path("sdn/log_1"))
    release(Path("sdn/log_2"), annotated_log__json='[{"frame": 3')
    result = converted("sdn", "out", "--to", "native", code=2)
    assert "log_2: not converted: sdn/log_2/annotated_log.json, line 1, item 0: not JSON" in result.stdout
    assert "1 of 2 sessions could not be converted" in result.stderr and result.stderr.count("\n") == 1
    assert [path.name for path in Path("out").iterdir()] == ["log_1"]
    again = json.loads(converted("sdn", "out2", "--to", "native", "--json", code=2).stdout)
    assert [sorted(row) for row in again["sessions"]][1] == ["error", "path"]


def test_invalid_arguments_are_reported_in_one_line() -> None:
    release(Path("log_1"))
    Path("empty").mkdir()
    Path("file").touch()
    assert "nowhere: there is no such folder" in refused("nowhere", "out", "--to", "sdn")
    assert "holds no session" in refused("empty", "out", "--to", "sdn")
    assert "log_1/out: lies within log_1" in refused("log_1", "log_1/out", "--to", "native")
    assert "log_1: lies within log_1" in refused("log_1", "log_1", "--to", "native")
    assert "file: is a file" in refused("log_1", "file", "--to", "native")
    assert "maps: there is no such folder" in refused("log_1", "out", "--to", "native", "--maps", "maps")
    converted("log_1", "out", "--to", "native")
    assert "out: exists already" in refused("log_1", "out", "--to", "native")
    release(Path("bad"), annotated_log__json="[")
    assert "bad/annotated_log.json" in refused("bad", "out3", "--to", "native", "--json")
    assert not Path("out3").exists()


def test_unknown_layouts_are_refused() -> None:
    result = CliRunner().invoke(app, ["convert", "a", "b", "--to", "xml"])
    assert result.exit_code == 2 and "sdn" in result.stderr


def test_incomplete_session_stays_incomplete() -> None:
    folder = write(Path("one"), talk())
    page = json.loads((folder / "session.json").read_text())
    (folder / "session.json").write_text(json.dumps({**page, "outcome": None, "counts": None}))
    assert "not recorded to its end" in converted("one", "sdn", "--to", "sdn").stdout
    assert not read_sdn("sdn").complete
    converted("sdn", "back", "--to", "native")
    assert not Session.load("back").complete
