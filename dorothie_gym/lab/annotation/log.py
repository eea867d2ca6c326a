"""Log of an annotator's marks: an append-only file next to the session, from which marks, undo and redo are restored.

The first line names the annotator and identifies the text. Every later line is an edit with the new marks of the
changed elements; an undo is an edit that restores earlier marks. A line is on the disk before the edit is acknowledged,
so that neither the death of the program nor a power failure loses it.
"""

from __future__ import annotations

import enum
import os
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import msgspec
from msgspec import Meta, Struct

from dorothie_gym.errors import AnnotationError, SessionError, one_line
from dorothie_gym.lab.annotation.log_file import Extent, appending, check_place
from dorothie_gym.lab.annotation.marks import Annotation, Change, check_change
from dorothie_gym.lab.annotation.rows import ChangeRows, change_of, rows_of
from dorothie_gym.session.recording.files import ANNOTATIONS_FOLDER, decode_text, read_bytes
from dorothie_gym.session.recording.header import parse_version
from dorothie_gym.support.files import make_folder, sync
from dorothie_gym.support.schemas import decoder

if TYPE_CHECKING:
    from dorothie_gym.lab.annotation.source_text import SourceText

ADJUDICATED: Final = "adjudicated"
"""Name of the log of the final version."""

RECORDED: Final = "recorded"
"""Name for the labels of the session itself; no annotator can have it."""

LOG_VERSION: Final = "1.0"

_NAME: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,39}")


class Action(enum.StrEnum):
    """Kinds of lines of a log."""

    START = "start"
    """Marks of the classifier, with which the annotator began."""
    MARK = "mark"
    UNDO = "undo"
    REDO = "redo"


class LogHead(Struct, forbid_unknown_fields=True, frozen=True):
    """First line of a log.

    Attributes:
        annotation_log: version of the format, "major.minor".
        annotator: name of the annotator.
        session: name of the session.
        text: `SourceText.digest` of the session.
        pre_annotation: whether the annotator began with marks of the classifier.
    """

    annotation_log: str
    annotator: str
    session: str
    text: str
    pre_annotation: bool


class LogLine(Struct, forbid_unknown_fields=True, frozen=True, omit_defaults=True):
    """Edit.

    Attributes:
        edit: number of the edit, from 1; 0 for the start.
        action: kind of the edit.
        change: new marks of the changed elements.
        label: description of the edit.
        by: adjudicator, in the final version.
        source: annotator whose marks were copied, in the final version.
    """

    edit: Annotated[int, Meta(ge=0, lt=2**53)]
    action: Action
    change: ChangeRows
    label: Annotated[str, Meta(max_length=80)] = ""
    by: Annotated[str, Meta(max_length=40)] = ""
    source: Annotated[str, Meta(max_length=40)] = ""


class StaleError(AnnotationError):
    """The marks were changed elsewhere, such as in another window or by another program."""


@dataclass(frozen=True, kw_only=True)
class Edit:
    """Edit requested by a person.

    Attributes:
        action: mark, undo or redo.
        change: the new marks, of a mark.
        label: description of the edit.
        by: adjudicator, in the final version.
        source: annotator whose marks are copied, in the final version.
    """

    action: Action = Action.MARK
    change: Change = field(default_factory=Change)
    label: str = ""
    by: str = ""
    source: str = ""


def check_name(name: str) -> str:
    """Returns the name of an annotator; raises `AnnotationError` if it cannot be the name of a file or is reserved."""
    if not _NAME.fullmatch(name):
        raise AnnotationError(
            f"annotator {name!r}: a name has at most 40 letters, digits, '_', '-' and '.', and begins with a letter or "
            "digit"
        )
    if name.lower() in (ADJUDICATED, RECORDED):
        raise AnnotationError(f"annotator {name!r}: the name is reserved; choose another one")
    return name


def log_path(folder: Path, name: str) -> Path:
    """Returns the log of an annotator of the session in a folder."""
    return folder / ANNOTATIONS_FOLDER / f"{name}.jsonl"


def annotators_of(folder: Path) -> tuple[str, ...]:
    """Returns the names of the annotators of the session in a folder, without the final version."""
    found = (path.stem for path in (folder / ANNOTATIONS_FOLDER).glob("*.jsonl") if _NAME.fullmatch(path.stem))
    return tuple(sorted(name for name in found if name.lower() not in (ADJUDICATED, RECORDED)))


@dataclass(frozen=True)
class _Done:
    """Edit that can be undone or redone: its description, and the change that undoes or redoes it."""

    label: str
    back: Change


class AnnotationLog:
    """Marks of an annotator in a session, with their log.

    Nothing is written before the first edit.

    Attributes:
        text: text of the session.
        path: the file.
        annotator: name of the annotator.
        annotation: the current marks.
        edits: number of edits so far.
        lines: all edits, in order.

    Args:
        text: text of the session.
        folder: folder of the session.
        annotator: name of the annotator, or `ADJUDICATED`.
        start: marks of a new log; those of an existing log count.
        pre_annotation: whether `start` holds marks of the classifier.

    Raises:
        SessionError: the log is damaged, or of another session; the message names file and line.
        AnnotationError: the log or its folder is a link.
        OSError: the log cannot be read.
    """

    def __init__(
        self,
        text: SourceText,
        folder: Path,
        annotator: str,
        start: Annotation | None = None,
        *,
        pre_annotation: bool = False,
    ) -> None:
        self.text, self.path, self.annotator = text, log_path(folder, annotator), annotator
        self.edits, self.lines = 0, list[LogLine]()
        self._undo, self._redo = list[_Done](), list[_Done]()
        self._size = self._torn = 0
        self._extent = Extent()
        self.annotation = Annotation.empty(text)
        self.pre_annotated = pre_annotation
        check_place(self.path)
        if self.path.exists():
            self._read()
        if not self.lines:  # there is no log, or a program died while it wrote the start of one
            self._torn, self._size, self._extent = self._torn + self._size, 0, Extent()
            self.pre_annotated = pre_annotation
        if not self.lines and start is not None:
            first = start.difference(self.annotation)
            self.annotation = start
            if first:
                self.lines = [LogLine(edit=0, action=Action.START, change=rows_of(first))]

    # --- edits --------------------------------------------------------------------------------------------------------

    @property
    def can_undo(self) -> str | None:
        """Description of the edit that `undo` would undo; None if there is nothing."""
        return self._undo[-1].label if self._undo else None

    @property
    def can_redo(self) -> str | None:
        """Description of the edit that `redo` would repeat; None if there is nothing."""
        return self._redo[-1].label if self._redo else None

    def mark(self, change: Change, label: str = "", *, by: str = "", source: str = "") -> None:
        """Applies new marks and appends them to the log.

        Args:
            change: the new marks.
            label: description of the edit.
            by: adjudicator, in the final version.
            source: annotator whose marks are copied, in the final version.

        Raises:
            AnnotationError: the change does not match the text, or the log is full or a link.
            StaleError: another program has written to the log.
            OSError: the log cannot be written; then no part of the edit is kept.
        """
        check_change(change, self.text)
        done = self.annotation.after(change).difference(self.annotation)
        if done:
            self._append(Action.MARK, done, label, by, source)

    def undo(self) -> bool:
        """Undoes the last edit; returns whether there was one. Errors as `mark`."""
        if not self._undo:
            return False
        self._append(Action.UNDO, self._undo[-1].back, self._undo[-1].label)
        return True

    def redo(self) -> bool:
        """Redoes the last undone edit; returns whether there was one. Errors as `mark`."""
        if not self._redo:
            return False
        self._append(Action.REDO, self._redo[-1].back, self._redo[-1].label)
        return True

    def edit(self, edit: Edit) -> None:
        """Applies an edit; raises `AnnotationError` if there is nothing to undo or redo, and otherwise as `mark`."""
        if edit.action is Action.MARK:
            self.mark(edit.change, edit.label, by=edit.by, source=edit.source)
        elif not (self.undo() if edit.action is Action.UNDO else self.redo()):
            raise AnnotationError(f"there is nothing to {edit.action.value}")

    def ends_with(self, edit: Edit) -> bool:
        """Returns whether an edit is the last one of the log, which is requested again if its answer was lost."""
        last = self.lines[-1] if self.lines else None
        if last is None or last.action is not edit.action:
            return False
        if edit.action is not Action.MARK:
            return True
        if (last.label, last.by, last.source) != (edit.label[:80], edit.by, edit.source):
            return False
        check_change(edit.change, self.text)
        before = self.annotation.after(self._undo[-1].back)
        return rows_of(before.after(edit.change).difference(before)) == last.change

    def _append(self, action: Action, change: Change, label: str, by: str = "", source: str = "") -> None:
        line = LogLine(
            edit=self.edits + 1, action=action, change=rows_of(change), label=label[:80], by=by, source=source
        )
        self._write(line)
        self._take(line, change)

    def _take(self, line: LogLine, change: Change) -> None:
        """Makes an edit part of the state."""
        after = self.annotation.after(change)
        back = _Done(line.label, self.annotation.difference(after))
        if line.action is Action.MARK:
            self._undo.append(back)
            self._redo.clear()
        elif line.action is Action.UNDO:
            self._undo.pop()
            self._redo.append(back)
        elif line.action is Action.REDO:
            self._redo.pop()
            self._undo.append(back)
        self.annotation, self.edits = after, line.edit
        self.lines.append(line)

    def _write(self, line: LogLine) -> None:
        rows: list[Struct] = [line]
        if not self._size:
            head = LogHead(LOG_VERSION, self.annotator, self.text.session, self.text.digest, self.pre_annotated)
            rows = [head, *self.lines, line]
            make_folder(self.path.parent)
        content = b"".join(msgspec.json.encode(row) + b"\n" for row in rows)
        extent = self._extent_with(content)
        with appending(self.path, self._size) as file:
            if file.tell() != self._size + self._torn:
                raise StaleError(f"{self.path}: was changed by another program; load the annotation again")
            if self._torn:  # a program died while it wrote; that edit was not acknowledged
                file.truncate(self._size)
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        if not self._size:
            sync(self.path.parent)
        self._size, self._torn = self._size + len(content), 0
        self._extent = extent

    def _extent_with(self, content: bytes) -> Extent:
        """Returns the extent of the log with further lines; raises `AnnotationError` if it could not be read back."""
        extent = self._extent.plus(Extent.of(content))
        if extent.excess:
            raise AnnotationError(
                f"{self.path}: is full ({extent.excess}); export the annotation, and import it under another name"
            )
        for line in content.split(b"\n")[0 if self._size else 1 : -1]:
            try:
                decoder(LogLine).decode(line)
            except msgspec.ValidationError as error:
                raise AnnotationError(f"{self.path}: cannot hold the edit: {one_line(error)}") from None
        return extent

    # --- reading ------------------------------------------------------------------------------------------------------

    def _read(self) -> None:
        content = read_bytes(self.path)
        *lines, torn = content.split(b"\n")
        self._extent = Extent.of(content[: len(content) - len(torn)])
        if self._extent.excess:
            raise SessionError(f"{self.path}: has more than {self._extent.excess}, which no log has; it is not read")
        self._size, self._torn = len(content) - len(torn), len(torn)
        for number, line in enumerate(lines, start=1):
            where = f"{self.path}, line {number}"
            decode_text(line, where)
            try:
                if number == 1:
                    self._take_head(decoder(LogHead).decode(line))
                else:
                    self._take_line(decoder(LogLine).decode(line))
            except (msgspec.DecodeError, AnnotationError, RecursionError) as error:
                raise SessionError(f"{where}: {one_line(error)}; the log is damaged") from None

    def _take_head(self, head: LogHead) -> None:
        parse_version(head.annotation_log, str(self.path), LOG_VERSION)
        if head.text != self.text.digest:
            raise AnnotationError(f"belongs to another text than that of session {self.text.session}")
        self.pre_annotated = head.pre_annotation

    def _take_line(self, line: LogLine) -> None:
        change = change_of(line.change)
        check_change(change, self.text)
        if line.edit != self.edits + (line.action is not Action.START):
            raise AnnotationError(f"edit {line.edit} follows edit {self.edits}")
        if (line.action is Action.UNDO and not self._undo) or (line.action is Action.REDO and not self._redo):
            raise AnnotationError(f"there is nothing to {line.action.value}")
        self._take(line, change)


def read_annotation(text: SourceText, folder: Path, name: str) -> Annotation:
    """Returns the marks of an annotator, or of the final version (`ADJUDICATED`).

    Raises:
        AnnotationError: there is no such log, or it is a link.
        SessionError: the log is damaged, or of another session.
    """
    if not log_path(folder, name).is_file():
        known = ", ".join(annotators_of(folder)) or "nobody has annotated it"
        raise AnnotationError(f"{folder}: has no annotation by {name!r} ({known})")
    return AnnotationLog(text, folder, name).annotation
