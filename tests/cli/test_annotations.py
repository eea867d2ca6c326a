"""`annotate`, `annotations` and `agreement` on the command line."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import urllib.error
import urllib.request
from pathlib import Path
from typing import Any

import pytest
from click.testing import Result
from typer.testing import CliRunner

from dorothie_gym.archive import Corpus, Task
from dorothie_gym.cli import app
from dorothie_gym.evaluation.teacher_forced import labels_of
from dorothie_gym.lab.annotation.log import read_annotation
from dorothie_gym.lab.annotation.marks import Change
from dorothie_gym.lab.annotation.session_labels import recorded_annotation
from dorothie_gym.lab.annotation.source_text import SourceText
from dorothie_gym.ontology import ActionValue, DialogueMove
from dorothie_gym.session.recording import Session
from tests.archive.sdn.builders import sample
from tests.lab.annotation.builders import OKAY, annotate, recorded, span
from tests.session.recording.builders import write


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def call(*arguments: object, code: int = 0) -> Result:
    result = CliRunner().invoke(app, [str(each) for each in arguments])
    assert result.exit_code == code, result.output
    return result


def refused(*arguments: object) -> str:
    result = call(*arguments, code=2)
    assert result.stdout == "" and result.stderr.startswith("Error: ") and result.stderr.count("\n") == 1
    return str(result.stderr)


def corpus() -> None:
    """Two sessions that Anna and Ben have annotated; they differ in one move of seven in the first session."""
    for name in ("train/s", "val/seen/t"):
        one, text = recorded(Path("corpus") / name)
        first = recorded_annotation(one, text)
        annotate(Path("corpus") / name, text, "anna", first)
        change = {OKAY: (span(1, DialogueMove.ACKNOWLEDGE), span(2, DialogueMove.CONFIRM, ActionValue.J_TURN))}
        annotate(
            Path("corpus") / name, text, "ben", first.after(Change(utterances=change)) if "s" in name[-1] else first
        )
    write(Path("corpus/train/silent"))


def test_agreement_of_a_corpus() -> None:
    pytest.importorskip("krippendorff", reason="needs the extra agreement")
    corpus()
    found = json.loads(call("agreement", "corpus", "--json").stdout)
    (pair,) = found["pairs"]
    # 13 of 14 agree; by chance Instruct, Acknowledge, Explain 4, 4, 4 and 4, 4, 3 of 14, ReplyY 2: 48/196.
    assert pair["moves"]["kappa"] == pytest.approx((13 / 14 - 48 / 196) / (1 - 48 / 196))
    assert pair["spans"] == {"agreement": 1.0, "equal": 14} and pair["slots"]["kappa"] == 1.0
    assert pair["sessions"] == found["sessions"] == 2 and 0.9 < found["alpha"]["moves"] < 1.0
    text = call("agreement", "corpus").stdout
    assert "anna, ben" in text and "0.91" in text and "0.77" in text and "alpha of 2 annotators" in text


def test_agreement_is_shown_whole_at_80_columns(monkeypatch: pytest.MonkeyPatch) -> None:
    corpus()
    monkeypatch.setenv("COLUMNS", "80")
    shown = call("agreement", "corpus").stdout.partition("Krippendorff")[0]
    assert "…" not in shown and max(map(len, shown.splitlines())) <= 80
    rows = [line.split() for line in shown.splitlines() if line.startswith("anna, ben")]
    assert [len(row) - 2 for row in rows] == [6, 2], "labels and units of the pair"


def test_agreement_without_two_annotators_is_refused() -> None:
    recorded(Path("corpus/s"))
    assert "nothing to compare" in refused("agreement", "corpus")
    assert "nobody has annotated it" in refused("agreement", "corpus", "--annotator", "anna")


def test_a_copy_of_the_corpus_has_the_labels_of_an_annotator() -> None:
    corpus()
    done = json.loads(call("annotations", "export", "corpus", "out", "--annotator", "ben", "--json").stdout)
    assert done["written"] == ["out/train/s", "out/val/seen/t"] and done["sessions"] == 3
    copied = Corpus.load("out")
    assert [entry.fold for entry in copied.entries] == ["train", "val/seen"]
    labels = [str(move.act) for move in copied.entries[0].load().moves() if move.utterance == 1]
    assert labels == ["Acknowledge()", "Confirm(Action=JTurn)"]
    counted = json.loads(call("stats", "out", "--json").stdout)
    assert counted["moves"] == 14 and counted["exchanges"] == 1 + 1, "those of the annotation, not of the rules"


@pytest.mark.parametrize("to", ["jsonl", "elan", "native", "sdn"])
def test_every_format_is_exported_and_imported(to: str) -> None:
    corpus()
    call("annotations", "export", "corpus", "out", "--annotator", "anna", "--to", to)
    call("annotations", "import", "corpus", "out", "--annotator", "copy")
    found = json.loads(call("agreement", "corpus", "--annotator", "anna", "--annotator", "copy", "--json").stdout)
    assert found["sessions"] == 2 and found["pairs"][0]["moves"]["kappa"] == 1.0


def test_one_file_is_imported_into_one_session() -> None:
    corpus()
    call("annotations", "export", "corpus/train/s", "out", "--annotator", "ben", "--to", "elan")
    call("annotations", "import", "corpus/train/s", "out/s.eaf", "--annotator", "carl")
    session = Session.load("corpus/train/s")
    text = SourceText.of(session)
    assert read_annotation(text, Path("corpus/train/s"), "carl") == read_annotation(text, Path("corpus/train/s"), "ben")
    assert "exists already" in refused("annotations", "import", "corpus/train/s", "out/s.eaf", "--annotator", "carl")


def test_sdn_sessions_are_annotated_beside_their_files() -> None:
    sample(Path("sdn/one"))
    call("annotations", "export", "sdn", "out", "--annotator", "x", code=2)
    before = {path.name for path in Path("sdn/one").iterdir()}
    call("annotations", "import", "sdn/one", "sdn/one", "--annotator", "theirs")
    found = json.loads(call("agreement", "sdn", "--annotator", "theirs", "--annotator", "recorded", "--json").stdout)
    assert found["pairs"][0]["spans"]["agreement"] == 1.0
    assert {path.name for path in Path("sdn/one").iterdir()} == before | {"annotations"}


def test_mistakes_are_reported_in_one_line() -> None:
    corpus()
    assert "annotators are anna, ben" in refused("annotations", "export", "corpus", "out", "--annotator", "x")
    assert "--to is 'csv'" in refused("annotations", "export", "corpus", "out", "--to", "csv")
    assert "lies within" in refused("annotations", "export", "corpus", "corpus/out", "--annotator", "anna")
    assert "holds no annotation of a session" in refused(
        "annotations", "import", "corpus", "nowhere", "--annotator", "x"
    )
    assert "the name is reserved" in refused("annotations", "import", "corpus", "corpus", "--annotator", "recorded")
    assert "nobody speaks in it" in refused("annotate", "corpus/train/silent")
    assert "there is no such folder" in refused("annotate", "nowhere")
    assert "begins with a letter" in refused("annotate", "corpus", "--annotator", "../x")
    assert "two people have the same name" in refused("annotate", "corpus", "--annotator", "a", "--adjudicator", "A")


@pytest.mark.long
def test_annotate_prints_a_link_for_each_person_and_ends_at_a_signal(tmp_path: Path) -> None:
    pytest.importorskip("uvicorn", reason="needs the extra console")
    corpus()
    command = [sys.executable, "-m", "dorothie_gym.cli", "annotate", "corpus", "--port", "0", "--json"]
    command += ["--annotator", "anna", "--annotator", "ben", "--adjudicator", "carol"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=os.environ, cwd=tmp_path) as server:
        try:
            assert server.stdout is not None
            found: dict[str, Any] = json.loads(server.stdout.readline())
            assert list(found["links"]) == ["anna", "ben", "carol"] and found["sessions"] == 3
            page, token = found["links"]["anna"].split("#")
            assert page.startswith("http://127.0.0.1:")
            request = urllib.request.Request(
                page.replace("/annotate", "/api/seat"), headers={"Authorization": f"Bearer {token}"}
            )
            with urllib.request.urlopen(request, timeout=30) as answer:
                seat = json.load(answer)
            assert seat["name"] == "anna" and seat["sessions"] == [["s", True], ["silent", False], ["t", True]]
        finally:
            server.send_signal(signal.SIGTERM)
        server.wait(20)


def _serve(folder: Path, *more: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "dorothie_gym.cli", "annotate", "corpus", "--port", "0", "--json", *more]
    return subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=os.environ, cwd=folder)


def _status(address: str, token: str) -> int:
    request = urllib.request.Request(address.replace("/annotate", "/api/seat"))
    request.add_header("Authorization", f"Bearer {token}")
    try:
        with urllib.request.urlopen(request, timeout=30) as answer:
            return int(answer.status)
    except urllib.error.HTTPError as error:
        with error:
            return error.code


@pytest.mark.long
def test_links_live_on_after_a_kill_until_new_ones_are_asked_for(tmp_path: Path) -> None:
    pytest.importorskip("uvicorn", reason="needs the extra console")
    corpus()
    tokens: dict[str, str] = {}
    people = ("--annotator", "anna", "--adjudicator", "carol")
    for options, new in (
        (people, ["anna", "carol"]),
        ((*people, "--annotator", "ben"), ["ben"]),
        (people, []),
        ((*people, "--new-links"), ["anna", "carol"]),
    ):
        old = dict(tokens)
        with _serve(tmp_path, *options) as server:
            try:
                assert server.stdout is not None
                found = json.loads(server.stdout.readline())
                assert sorted(name for name, link in found["links"].items() if link) == new
                tokens |= {name: link.split("#")[1] for name, link in found["links"].items() if link}
                for name in found["links"]:
                    assert _status(found["address"], tokens[name]) == 200
                if "--new-links" in options:
                    assert [_status(found["address"], token) for token in old.values()] == [401] * 3
                elif "ben" in tokens and "ben" not in found["links"]:
                    assert _status(found["address"], tokens["ben"]) == 401, "Ben does not take part this time"
            finally:
                server.kill()
    kept = (tmp_path / "corpus" / "annotations" / "links.json").read_text(encoding="utf-8")
    assert not any(token in kept for token in tokens.values())


@pytest.mark.long
def test_a_killed_server_loses_no_acknowledged_mark(tmp_path: Path) -> None:
    pytest.importorskip("uvicorn", reason="needs the extra console")
    one, text = recorded(Path("one"))
    command = [
        sys.executable,
        "-m",
        "dorothie_gym.cli",
        "annotate",
        "one",
        "--port",
        "0",
        "--json",
        "--no-pre-annotation",
    ]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=os.environ, cwd=tmp_path) as server:
        try:
            assert server.stdout is not None
            page, token = json.loads(server.stdout.readline())["links"]["annotator"].split("#")
            moves = [move.label for move in DialogueMove]
            for k, move in enumerate(moves):
                row = {"speaker": "participant", "utterance": 0, "spans": [{"words": 4, "move": move}]}
                request = urllib.request.Request(
                    page.replace("/annotate", "/api/sessions/0/mark"),
                    data=json.dumps({"base": k, "change": {"utterances": [row]}}).encode(),
                    headers={"Authorization": f"Bearer {token}"},
                )
                with urllib.request.urlopen(request, timeout=30) as answer:
                    assert json.load(answer)["edit"] == k + 1
        finally:
            server.kill()
    found = read_annotation(text, Path("one"), "annotator")
    assert found.utterances[text.lines[0].id][0].move is DialogueMove(len(moves) - 1)
    assert one.complete


def test_models_are_trained_and_scored_on_the_labels_of_a_copy() -> None:
    corpus()
    call("annotations", "export", "corpus", "out", "--annotator", "ben")
    before, after = (
        labels_of(f"{root}/train/s", "all").tasks[Task.RFN].labels.moves.tolist() for root in ("corpus", "out")
    )
    assert len(before) == len(after) and before != after
    assert DialogueMove.CONFIRM in after and DialogueMove.CONFIRM not in before


def test_the_example_of_the_page_runs(capsys: pytest.CaptureFixture[str]) -> None:
    corpus()
    shutil.rmtree("corpus/train/silent")
    page = (Path(__file__).parents[2] / "docs" / "annotation-tool.md").read_text(encoding="utf-8")
    exec(compile(page.split("```python\n")[1].split("```")[0], "annotation-tool.md", "exec"), {})
    assert capsys.readouterr().out == "s Instruct(Landmark=KFC)\nt Instruct(Landmark=KFC)\n"
