"""Logs of annotators: what is marked survives, can be undone, and damage is named."""

from __future__ import annotations

import json
import random
from pathlib import Path

import pytest

from dorothie_gym.errors import AnnotationError, SessionError
from dorothie_gym.lab.annotation.log import AnnotationLog, annotators_of, check_name, log_path, read_annotation
from dorothie_gym.lab.annotation.marks import Annotation, Change, ExchangeMark
from dorothie_gym.ontology import DialogueMove, LandmarkName, UnitEnd
from dorothie_gym.session.recording import Session
from tests.lab.annotation.builders import FIRST, OKAY, random_change, recorded, span
from tests.power_failure import Disk, disk, needs_linux

__all__ = ["disk"]

M = DialogueMove


HEAD = '{"annotation_log":"1.0","annotator":"anna","session":"s","text":"","pre_annotation":false}'


def edit(speaker: str, utterance: int, words: int) -> str:
    row = {"speaker": speaker, "utterance": utterance, "spans": [{"words": words}]}
    return json.dumps({"edit": 1, "action": "mark", "change": {"utterances": [row]}})


def marked(folder: Path) -> AnnotationLog:
    _, text = recorded(folder)
    log = AnnotationLog(text, folder, "anna")
    log.mark(Change(utterances={FIRST: (span(4, M.INSTRUCT, LandmarkName.KFC),)}), "move Instruct")
    log.mark(Change(utterances={OKAY: (span(1, M.ACKNOWLEDGE), span(2, M.EXPLAIN))}), "split")
    return log


def test_marks_are_restored_with_undo_and_redo(tmp_path: Path) -> None:
    log = marked(tmp_path / "s")
    log.undo()
    again = AnnotationLog(log.text, tmp_path / "s", "anna")
    assert again.annotation == log.annotation and again.edits == 3
    assert (again.can_undo, again.can_redo) == ("move Instruct", "split")
    assert again.redo() and again.annotation.utterances[OKAY][1].move is M.EXPLAIN
    assert again.undo() and again.undo() and not again.undo()
    assert again.annotation == Annotation.empty(log.text)


@needs_linux
def test_edit_survives_a_power_failure(tmp_path: Path, disk: Disk) -> None:
    log = marked(tmp_path / "s")
    for step in (lambda: None, log.undo, log.redo, log.undo):
        step()
        content = disk.content(log.path)
        assert content == log.path.read_bytes() and content.count(b"\n") == 1 + log.edits
    kept = tmp_path / "kept" / "annotations" / log.path.name
    kept.parent.mkdir(parents=True)
    kept.write_bytes(content)
    assert AnnotationLog(log.text, tmp_path / "kept", "anna").annotation == log.annotation


def test_the_session_is_never_changed(tmp_path: Path) -> None:
    session, _ = recorded(tmp_path / "s")
    before = {path.name: path.read_bytes() for path in (tmp_path / "s").iterdir()}
    log = AnnotationLog(marked(tmp_path / "t").text, tmp_path / "s", "anna")
    log.mark(Change(utterances={FIRST: (span(4, M.CHECK),)}))
    assert {path.name: path.read_bytes() for path in (tmp_path / "s").iterdir() if path.is_file()} == before
    assert Session.load(tmp_path / "s").digest == session.digest


@pytest.mark.parametrize("seed", range(6))
def test_any_sequence_of_edits_is_restored(seed: int, tmp_path: Path) -> None:
    rng = random.Random(seed)
    _, text = recorded(tmp_path / "s")
    log, states, at = AnnotationLog(text, tmp_path / "s", "anna"), [Annotation.empty(text)], 0
    for _ in range(40):
        action = rng.choice(["mark", "mark", "undo", "redo", "reload"])
        if action == "mark":
            before = log.annotation
            log.mark(random_change(text, rng))
            if log.annotation != before:
                states, at = [*states[: at + 1], log.annotation], at + 1
        elif action == "undo":
            at -= log.undo()
        elif action == "redo":
            at += log.redo()
        else:
            log = AnnotationLog(text, tmp_path / "s", "anna")
        assert log.annotation == states[at]
    assert read_annotation(text, tmp_path / "s", "anna") == states[at]


def test_a_torn_last_line_is_the_edit_that_was_not_acknowledged(tmp_path: Path) -> None:
    log = marked(tmp_path / "s")
    whole = log.path.read_bytes()
    for cut in range(1, len(whole.splitlines()[-1])):
        log.path.write_bytes(whole[:-cut])
        again = AnnotationLog(log.text, tmp_path / "s", "anna")
        assert again.edits == 1 and len(again.annotation.utterances[OKAY]) == 1
    again.mark(Change(utterances={OKAY: (span(3, M.CONFIRM),)}))
    assert AnnotationLog(log.text, tmp_path / "s", "anna").annotation.utterances[OKAY][0].move is M.CONFIRM
    assert log.path.read_bytes().count(b"\n") == 3


@pytest.mark.parametrize(
    ("line", "text", "wanted"),
    [
        (2, "{", "line 2"),
        (2, edit("car", 0, 4), "'car' is unknown"),
        (2, edit("participant", 0, 3), "its spans have 3 words, and the utterance has 4"),
        (2, edit("participant", 9, 3), "no such utterance"),
        (3, '{"edit":7,"action":"mark","change":{}}', "edit 7 follows edit 1"),
        (2, '{"edit":1,"action":"undo","change":{}}', "nothing to undo"),
        (3, '{"edit":2,"action":"mark","change":{},"more":1}', "unknown field"),
        (1, HEAD.replace("1.0", "9.0"), "9.0"),
        (1, HEAD, "another text"),
        (2, "\udc80", "line 2"),
    ],
)
def test_damage_is_one_error_that_names_the_line(line: int, text: str, wanted: str, tmp_path: Path) -> None:
    log = marked(tmp_path / "s")
    lines = log.path.read_text().splitlines()
    lines[line - 1] = text
    log.path.write_bytes(("\n".join(lines) + "\n").encode("utf-8", "surrogateescape"))
    with pytest.raises(SessionError) as refused:
        AnnotationLog(log.text, tmp_path / "s", "anna")
    assert wanted in str(refused.value) and "anna.jsonl" in str(refused.value)


def test_two_programs_do_not_overwrite_each_other(tmp_path: Path) -> None:
    log = marked(tmp_path / "s")
    other = AnnotationLog(log.text, tmp_path / "s", "anna")
    other.mark(Change(utterances={FIRST: (span(4, M.CHECK),)}))
    with pytest.raises(AnnotationError, match="changed by another program"):
        log.mark(Change(utterances={FIRST: (span(4, M.ALIGN),)}))
    assert AnnotationLog(log.text, tmp_path / "s", "anna").annotation == other.annotation


def test_marks_that_do_not_fit_are_refused_and_not_written(tmp_path: Path) -> None:
    log = marked(tmp_path / "s")
    before = log.path.read_bytes()
    for change in (
        Change(utterances={FIRST: (span(3, M.CHECK),)}),
        Change(utterances={FIRST: ()}),
        Change(utterances={FIRST: (span(0, M.CHECK), span(4, M.CHECK))}),
        Change(utterances={FIRST: (span(4, None, suggested=True),)}),
        Change(utterances={FIRST: (span(4, M.CHECK, exchange=-1),)}),
        Change(exchanges={10**9: ExchangeMark(end=UnitEnd.ABANDONED)}),
    ):
        with pytest.raises(AnnotationError):
            log.mark(change)
    assert log.path.read_bytes() == before


def test_marks_of_a_unit_go_with_its_last_span_and_come_back(tmp_path: Path) -> None:
    log = marked(tmp_path / "s")
    log.mark(
        Change(utterances={FIRST: (span(4, M.CHECK, exchange=3),)}, exchanges={3: ExchangeMark(end=UnitEnd.ABANDONED)})
    )
    log.mark(Change(utterances={FIRST: (span(4, M.CHECK),)}))
    assert not log.annotation.exchanges
    log.undo()
    assert log.annotation.exchanges[3].end is UnitEnd.ABANDONED


def test_a_look_writes_nothing(tmp_path: Path) -> None:
    _, text = recorded(tmp_path / "s")
    log = AnnotationLog(text, tmp_path / "s", "anna", Annotation.empty(text), pre_annotation=True)
    assert not log.undo() and not log_path(tmp_path / "s", "anna").parent.exists()
    log.mark(Change(utterances={FIRST: (span(4),)}))
    assert not log.path.exists(), "the same marks are no edit"
    log.mark(Change(utterances={FIRST: (span(4, M.CHECK),)}))
    assert json.loads(log.path.read_text().splitlines()[0])["pre_annotation"] is True
    assert annotators_of(tmp_path / "s") == ("anna",)


@pytest.mark.parametrize("name", ["", "a/b", "..", ".a", "adjudicated", "Recorded", "ä", "a" * 41, "a\n"])
def test_names_that_are_no_files_are_refused(name: str) -> None:
    with pytest.raises(AnnotationError, match="annotator"):
        check_name(name)
