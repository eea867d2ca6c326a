"""Places and sizes of logs: nothing is written outside of the session, and nothing that cannot be read back."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import msgspec
import pytest

from dorothie_gym.errors import AnnotationError, SessionError
from dorothie_gym.lab.annotation.log import AnnotationLog, LogLine, annotators_of, log_path, read_annotation
from dorothie_gym.lab.annotation.log_file import MAX_LINES, Extent
from dorothie_gym.lab.annotation.marks import Annotation, Change
from dorothie_gym.lab.annotation.source_text import SourceText
from dorothie_gym.ontology import DialogueMove, Role
from dorothie_gym.ontology.dialogue_acts import LABELS
from dorothie_gym.session.recording import Session
from dorothie_gym.support.input_files import MAX_SESSION_TEXT, MAX_VALUES
from tests.lab.annotation.builders import FIRST, OKAY, recorded, span
from tests.session.recording.builders import utterance, write
from tests.session.recording.dialogues import TO_KFC

CHECK = Change(utterances={FIRST: (span(4, DialogueMove.CHECK),)})
ALIGN = Change(utterances={FIRST: (span(4, DialogueMove.ALIGN),)})

CONTENTS = {"text": b"Dear diary,\nthis is private.\n", "one line": b"a secret without a line end", "nothing": b""}


@pytest.mark.parametrize("content", [*CONTENTS.values(), None], ids=[*CONTENTS, "no file"])
@pytest.mark.parametrize("which", ["log", "folder"])
def test_a_link_is_never_followed(which: str, content: bytes | None, tmp_path: Path) -> None:
    _, text = recorded(tmp_path / "s")
    outside, path = tmp_path / "outside", log_path(tmp_path / "s", "anna")
    target = outside / "file" if which == "log" else outside / "anna.jsonl"
    if content is not None:
        outside.mkdir()
        target.write_bytes(content)
    if which == "log":
        path.parent.mkdir()
        path.symlink_to(target)
    else:
        path.parent.symlink_to(outside)
    with pytest.raises(AnnotationError, match="is a link"):
        AnnotationLog(text, tmp_path / "s", "anna").mark(CHECK)
    assert outside.exists() == (content is not None)
    assert content is None or target.read_bytes() == content
    if which == "log" and content is not None:
        with pytest.raises(AnnotationError, match="is a link"):
            read_annotation(text, tmp_path / "s", "anna")


@pytest.mark.parametrize("hard", [False, True])
def test_a_link_that_is_put_there_later_is_not_followed_either(hard: bool, tmp_path: Path) -> None:
    _, text = recorded(tmp_path / "s")
    log = AnnotationLog(text, tmp_path / "s", "anna")
    log.mark(CHECK)
    moved = tmp_path / "moved.jsonl"
    log.path.rename(moved)
    before = moved.read_bytes()
    if hard:
        os.link(moved, log.path)
    else:
        log.path.symlink_to(moved)
    with pytest.raises(AnnotationError, match="hard link" if hard else "is a link"):
        log.mark(ALIGN)
    assert moved.read_bytes() == before


def test_a_log_that_is_linked_is_named_among_others(tmp_path: Path) -> None:
    _, text = recorded(tmp_path / "s")
    AnnotationLog(text, tmp_path / "s", "anna").mark(CHECK)
    (tmp_path / "s" / "annotations" / "ben.jsonl").symlink_to("anna.jsonl")
    assert annotators_of(tmp_path / "s") == ("anna", "ben")
    with pytest.raises(AnnotationError, match=r"ben\.jsonl: is a link"):
        read_annotation(text, tmp_path / "s", "ben")


# --- Sizes ------------------------------------------------------------------------------------------------------------


LONG_TEXT = 390
"""Words of the utterance of a log with many values; each is a span."""


def spoken(folder: Path, words: int) -> SourceText:
    """Text of a session of one utterance."""
    said = utterance(30, Role.PARTICIPANT, 0, (" ".join(["word"] * words), TO_KFC))
    return SourceText.of(Session.load(write(folder, said)))


def mark_all(log: AnnotationLog, changes: Sequence[Change], times: int = 1) -> None:
    """Marks several times, with as many bytes in words as a line may have."""
    for change in [*changes] * times:
        log.mark(change, "\U0001f697" * 80, by="\U0001f697" * 40, source="\U0001f697" * 40)


def fill(log: AnnotationLog, changes: Sequence[Change], until: Extent) -> None:
    """Lengthens a log by lines of the same changes over and over, up to an extent."""
    mark_all(log, changes)
    lines = log.path.read_bytes().splitlines(keepends=True)
    rows = [msgspec.json.decode(row, type=LogLine) for row in lines[-len(changes) :]]
    extent, edit = Extent.of(b"".join(lines)), log.edits
    while True:
        edit += 1
        row = msgspec.json.encode(msgspec.structs.replace(rows[(edit - log.edits - 1) % len(rows)], edit=edit)) + b"\n"
        extent = extent.plus(Extent.of(row))
        if extent.size > until.size or extent.lines > until.lines or extent.values > until.values:
            break
        lines.append(row)
    log.path.write_bytes(b"".join(lines))


@pytest.mark.long
@pytest.mark.parametrize(
    ("spare", "words", "limit"),
    [
        (Extent(lines=3), 4, f"{MAX_LINES} lines"),
        pytest.param(Extent(size=5000), 4, "64 MiB", marks=pytest.mark.slow),
        pytest.param(Extent(values=3000), LONG_TEXT, f"{MAX_VALUES} values", marks=pytest.mark.slow),
    ],
    ids=["lines", "bytes", "values"],
)
def test_a_log_is_never_written_past_what_is_read(spare: Extent, words: int, limit: str, tmp_path: Path) -> None:
    text = spoken(tmp_path / "s", words)
    if words == LONG_TEXT:
        changes = [Change(utterances={FIRST: (span(1),) * words}), Change(utterances={FIRST: (span(words),)})]
    else:
        rich = LABELS if spare.size else ()
        changes = [Change(utterances={FIRST: (span(words, move, *rich),)}) for move in list(DialogueMove)[:2]]
    most = Extent(size=MAX_SESSION_TEXT - spare.size, lines=MAX_LINES - spare.lines, values=MAX_VALUES - spare.values)
    fill(AnnotationLog(text, tmp_path / "s", "anna"), changes, most)
    log = AnnotationLog(text, tmp_path / "s", "anna")
    before = log.edits
    with pytest.raises(AnnotationError, match=f"is full .{limit}.*import it under another name"):
        mark_all(log, changes, times=20)
    again = AnnotationLog(text, tmp_path / "s", "anna")
    assert again.edits == log.edits > before and again.annotation == log.annotation
    assert read_annotation(text, tmp_path / "s", "anna") == log.annotation


def test_marks_that_a_log_cannot_hold_are_refused_and_not_written(tmp_path: Path) -> None:
    text = spoken(tmp_path / "s", 500)
    log = AnnotationLog(text, tmp_path / "s", "anna")
    with pytest.raises(AnnotationError, match="cannot hold the edit"):
        log.mark(Change(utterances={FIRST: (span(1, DialogueMove.CHECK),) * 500}))
    assert not log.path.exists() and log.annotation == Annotation.empty(text)
    log.mark(Change(utterances={FIRST: (span(1, DialogueMove.CHECK),) * 399 + (span(101),)}))
    assert len(read_annotation(text, tmp_path / "s", "anna").utterances[FIRST]) == 400


@pytest.mark.parametrize("cut", [0, 10, -1])
def test_a_log_whose_beginning_is_torn_begins_again_with_its_suggestions(cut: int, tmp_path: Path) -> None:
    _, text = recorded(tmp_path / "s")
    start = Annotation.empty(text).after(Change(utterances={OKAY: (span(3, DialogueMove.CHECK, suggested=True),)}))
    AnnotationLog(text, tmp_path / "s", "anna", start, pre_annotation=True).mark(CHECK)
    path = log_path(tmp_path / "s", "anna")
    head, first, _ = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(head[:cut] if cut >= 0 else head + first[:20])
    again = AnnotationLog(text, tmp_path / "s", "anna", start, pre_annotation=True)
    assert again.annotation == start and again.edits == 0
    again.mark(CHECK)
    assert AnnotationLog(text, tmp_path / "s", "anna").annotation.utterances[OKAY][0].suggested
    assert path.read_bytes().count(b"\n") == 3


def test_a_log_that_is_too_long_is_not_read(tmp_path: Path) -> None:
    _, text = recorded(tmp_path / "s")
    log = AnnotationLog(text, tmp_path / "s", "anna")
    log.mark(CHECK)
    with log.path.open("ab") as file:
        file.write(b"\n" * MAX_LINES)
    with pytest.raises(SessionError, match=f"more than {MAX_LINES} lines"):
        AnnotationLog(text, tmp_path / "s", "anna")
    log.path.write_bytes(log.path.read_bytes().rstrip(b"\n") + b"\n" + b"," * (MAX_VALUES + 1) + b"\n")
    with pytest.raises(SessionError, match=f"more than {MAX_VALUES} values"):
        AnnotationLog(text, tmp_path / "s", "anna")
