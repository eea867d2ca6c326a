"""Workplace of annotators: sessions, seats, and logs."""

from __future__ import annotations

import enum
import hashlib
import secrets
import threading
from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from dorothie_gym.errors import AnnotationError
from dorothie_gym.lab.annotation.comparison import adopted, consensus, disagreements
from dorothie_gym.lab.annotation.corpus_agreement import pair_agreement
from dorothie_gym.lab.annotation.log import (
    ADJUDICATED,
    AnnotationLog,
    Edit,
    LogLine,
    StaleError,
    annotators_of,
    log_path,
    read_annotation,
)
from dorothie_gym.lab.annotation.marks import Annotation, Change
from dorothie_gym.lab.annotation.pre_annotation import pre_annotation
from dorothie_gym.lab.annotation.rows import change_of, rows_of, to_json
from dorothie_gym.lab.annotation.session_page import SessionPage
from dorothie_gym.lab.annotation.source_text import SourceText, UtteranceId

if TYPE_CHECKING:
    from dorothie_gym.archive.corpus import CorpusEntry

MOST_OPEN: Final = 4
"""Maximum number of sessions that are kept in memory."""


class SeatKind(enum.StrEnum):
    """Kinds of seats."""

    ANNOTATOR = "annotator"
    """Sees and changes its own marks only."""
    ADJUDICATOR = "adjudicator"
    """Sees the marks of all annotators, and decides on the final version."""


@dataclass(frozen=True)
class Seat:
    """Seat of a person; the link with its token leads there.

    Attributes:
        name: name of the person.
        kind: task of the person.
        token: secret of the link, 128 bits; empty for a link that an earlier server gave.
        known_digest: SHA-256 of the secret of such a link.
    """

    name: str
    kind: SeatKind
    token: str = field(default_factory=lambda: secrets.token_urlsafe(16))
    known_digest: str = ""

    @property
    def digest(self) -> str:
        """SHA-256 of the secret of the link, in hexadecimal digits."""
        return self.known_digest or digest_of(self.token)

    @property
    def log(self) -> str:
        """Name of the log that the person writes."""
        return ADJUDICATED if self.kind is SeatKind.ADJUDICATOR else self.name


def digest_of(token: str) -> str:
    """Returns the SHA-256 of a secret in hexadecimal digits; it has 128 random bits, so no slower hash is needed."""
    return hashlib.sha256(token.encode("utf-8", "surrogatepass")).hexdigest()


class OpenSession:
    """Session in memory, with the logs of the seats.

    Args:
        entry: the session.
        maps: folder with maps of towns that are not shipped.
        pre_annotate: whether new logs begin with marks of the classifier.
    """

    def __init__(self, entry: CorpusEntry, maps: Path | None, *, pre_annotate: bool) -> None:
        self.folder, self._pre_annotate = entry.path, pre_annotate
        session = entry.load()
        self.text = SourceText.of(session)
        self.page = SessionPage(session, self.text, entry.path, maps)
        self._logs: dict[str, AnnotationLog] = {}

    def log(self, seat: Seat) -> AnnotationLog:
        """Returns the log of a seat, which is read from the file on first use."""
        if seat.log not in self._logs:
            log = AnnotationLog(self.text, self.folder, seat.log)
            if not log.lines and (start := self._start(seat)) is not None:
                suggested = seat.kind is SeatKind.ANNOTATOR
                log = AnnotationLog(self.text, self.folder, seat.log, start, pre_annotation=suggested)
            self._logs[seat.log] = log
        return self._logs[seat.log]

    def _start(self, seat: Seat) -> Annotation | None:
        """Returns the marks with which a new log begins; None for an empty one."""
        if seat.kind is SeatKind.ADJUDICATOR:
            return consensus(self.text, self.annotations()) if annotators_of(self.folder) else None
        return pre_annotation(self.page.session, self.text) if self._pre_annotate else None

    def forget(self, seat: Seat) -> None:
        """Discards the log of a seat, so that it is read again on the next use."""
        self._logs.pop(seat.log, None)

    def annotations(self) -> dict[str, Annotation]:
        """Returns the marks of all annotators as they are in their files."""
        return {name: read_annotation(self.text, self.folder, name) for name in annotators_of(self.folder)}


class Workplace:
    """Sessions and seats of a server. Methods may be called from several threads; one works at a time.

    Args:
        entries: the sessions.
        seats: the seats.
        maps: folder with maps of towns that are not shipped.
        pre_annotate: whether annotators begin with marks of the classifier.
    """

    def __init__(
        self,
        entries: Sequence[CorpusEntry],
        seats: Sequence[Seat],
        *,
        maps: Path | None = None,
        pre_annotate: bool = True,
    ) -> None:
        self.entries = tuple(entries)
        self.seats = {seat.digest: seat for seat in seats}
        self._maps, self._pre_annotate = maps, pre_annotate
        self._open: OrderedDict[int, OpenSession] = OrderedDict()
        self._lock = threading.RLock()

    def open(self, number: int) -> OpenSession:
        """Returns a session.

        Raises:
            AnnotationError: there is no session of this number.
            SessionError: it cannot be read, or has no utterances.
        """
        with self._lock:
            if not 0 <= number < len(self.entries):
                raise AnnotationError(
                    f"there is no session {number}; sessions have the numbers 0..{len(self.entries) - 1}"
                )
            if number not in self._open:
                entry = self.entries[number]
                self._open[number] = OpenSession(entry, self._maps, pre_annotate=self._pre_annotate)
            self._open.move_to_end(number)
            while len(self._open) > MOST_OPEN:
                self._open.popitem(last=False)
            return self._open[number]

    def greeting(self, seat: Seat) -> dict[str, Any]:
        """Returns the person of a seat, and the sessions with whether the person has begun each of them."""
        return {
            "name": seat.name,
            "kind": seat.kind.value,
            "sessions": [[entry.name, log_path(entry.path, seat.log).exists()] for entry in self.entries],
        }

    # --- marks --------------------------------------------------------------------------------------------------------

    def marks(self, seat: Seat, number: int) -> dict[str, Any]:
        """Returns the marks of a seat in a session, read from the file again."""
        with self._lock:
            session = self.open(number)
            session.forget(seat)
            return _state(session.log(seat))

    def edit(self, seat: Seat, number: int, base: int, edit: Edit, *, again: bool = False) -> dict[str, Any]:
        """Applies an edit: new marks, undo, or redo.

        Args:
            seat: seat of the editor.
            number: the session.
            base: number of the edit that the browser has seen last.
            edit: the edit.
            again: whether the browser has sent it before without an answer; it is then applied only once.

        Raises:
            StaleError: there were later edits.
            AnnotationError: the change does not match the session, or there is nothing to undo or redo.
            OSError: the log cannot be written.
        """
        with self._lock:
            session = self.open(number)
            log = session.log(seat)
            if seat.kind is SeatKind.ADJUDICATOR:
                edit = replace(edit, by=seat.name)
            if again and base == log.edits - 1 and log.ends_with(edit):
                done = change_of(log.lines[-1].change)
            elif base != log.edits:
                raise StaleError("these marks were changed elsewhere; they are loaded again")
            else:
                before = log.annotation
                try:
                    log.edit(edit)
                except OSError:
                    session.forget(seat)  # the content of the file counts
                    raise
                done = log.annotation.difference(before)
            # The suggestions with which a log begins are fixed only now: a restarted server may have others.
            return _state(log, None if base == 0 else done)

    # --- adjudication -------------------------------------------------------------------------------------------------

    def versions(self, number: int) -> dict[str, Any]:
        """Returns the marks of all annotators of a session, their disagreements, and the agreement of each two."""
        with self._lock:
            session = self.open(number)
            found = session.annotations()
            text = session.text
            return {
                "annotators": {
                    name: to_json(rows_of(each.difference(Annotation(utterances={})))) for name, each in found.items()
                },
                "disagreements": [
                    {"speaker": each.id.speaker.value, "utterance": each.id.number, "layers": list(each.layers)}
                    for each in disagreements(text, found)
                ]
                if found
                else [],
                "agreement": [
                    {"annotators": list(names), **pair.to_json()} for names, pair in pair_agreement(text, found).items()
                ],
            }

    def adopt(
        self, seat: Seat, number: int, base: int, id: UtteranceId, annotator: str, *, again: bool = False
    ) -> dict[str, Any]:
        """Copies the marks of an annotator for an utterance into the final version. Errors as `edit`."""
        with self._lock:
            session = self.open(number)
            if annotator not in annotators_of(session.folder):
                raise AnnotationError(f"{annotator!r} has not annotated the session")
            source = read_annotation(session.text, session.folder, annotator)
            if id not in session.text.by_id:
                raise AnnotationError(f"{id}: session {session.text.session} has no such utterance")
            change = adopted(session.text, source, id)
            edit = Edit(change=change, label=f"take over from {annotator}", source=annotator)
            return self.edit(seat, number, base, edit, again=again)

    def history(self, number: int, seat: Seat) -> list[dict[str, Any]]:
        """Returns the edits of the final version, the latest first."""
        with self._lock:
            lines = self.open(number).log(seat).lines
            return [_history_row(line) for line in reversed(lines[-500:])]


def _state(log: AnnotationLog, change: Change | None = None) -> dict[str, Any]:
    """Returns the state of a log: all marks, or those that an edit has changed."""
    shown = log.annotation.difference(Annotation(utterances={})) if change is None else change
    spans = [span for each in log.annotation.utterances.values() for span in each]
    return {
        "edit": log.edits,
        "undo": log.can_undo,
        "redo": log.can_redo,
        "pre_annotated": log.pre_annotated,
        "done": sum(span.act is not None for span in spans),
        "spans": len(spans),
        "whole": change is None,
        "change": to_json(rows_of(shown)),
    }


def _history_row(line: LogLine) -> dict[str, Any]:
    return {
        "edit": line.edit,
        "action": line.action.value,
        "label": line.label,
        "by": line.by,
        "source": line.source,
        "utterances": [[row.speaker, row.utterance] for row in line.change.utterances][:20],
    }
