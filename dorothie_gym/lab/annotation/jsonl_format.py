"""Annotations as JSONL: a head, one line for each utterance with its words, and one for each marked unit."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

import msgspec
from msgspec import Struct

from dorothie_gym.errors import AnnotationError, SessionError, one_line
from dorothie_gym.lab.annotation.marks import Annotation, check_change
from dorothie_gym.lab.annotation.rows import (
    ChangeRows,
    ExchangeRow,
    SpanRow,
    TransactionRow,
    UtteranceRow,
    change_of,
    rows_of,
)
from dorothie_gym.session.recording.files import decode_text, read_lines
from dorothie_gym.session.recording.header import parse_version
from dorothie_gym.support.files import write_atomically
from dorothie_gym.support.schemas import decoder

if TYPE_CHECKING:
    from dorothie_gym.lab.annotation.source_text import SourceText

VERSION: Final = "1.0"
MAX_LINES: Final = 100_000


class Head(Struct, forbid_unknown_fields=True, frozen=True):
    """First line: version of the format, names of session and annotator."""

    annotation: str
    session: str
    annotator: str


class SpanLine(SpanRow, forbid_unknown_fields=True, frozen=True, omit_defaults=True, kw_only=True):
    """Span with its words, for readers of the file; they are not read back."""

    text: str = ""


class UtteranceLine(Struct, forbid_unknown_fields=True, frozen=True):
    """Utterance with its words and times [s]."""

    speaker: str
    utterance: int
    start: float
    end: float
    text: str
    spans: list[SpanLine]


def write_jsonl(path: Path, text: SourceText, annotation: Annotation, annotator: str) -> None:
    """Writes an annotation; raises `OSError` if the file cannot be written."""
    rows = rows_of(annotation.difference(Annotation(utterances={})))
    found = {(row.speaker, row.utterance): row for row in rows.utterances}
    lines: list[Struct] = [Head(VERSION, text.session, annotator)]
    for line in text.lines:
        row, first, spans = found[line.id.speaker.value, line.id.number], 0, []
        for span in row.spans:
            fields = {name: getattr(span, name) for name in span.__struct_fields__}
            spans.append(SpanLine(**fields, text=line.text(first, span.words)))
            first += span.words
        lines.append(UtteranceLine(row.speaker, row.utterance, line.start, line.end, " ".join(line.words), spans))
    lines += [*rows.exchanges, *rows.transactions]
    write_atomically(path, b"".join(msgspec.json.encode(line) + b"\n" for line in lines))


def read_jsonl(path: Path, text: SourceText) -> Annotation:
    """Returns the annotation of a file of `write_jsonl` for the session with a text.

    Raises:
        SessionError: a line is damaged; the message names file, line and field.
        AnnotationError: the annotation is of another session.
    """
    lines, torn = read_lines(path, MAX_LINES)
    if torn or not lines:
        raise SessionError(f"{path}: {'its last line is incomplete' if path.exists() else 'is missing'}")
    rows = ChangeRows()
    number = 0
    try:
        for number, line in enumerate(lines, start=1):
            decode_text(line.encode("utf-8", "surrogatepass"), f"{path}, line {number}")
            if number == 1:
                parse_version(decoder(Head).decode(line).annotation, str(path), VERSION)
            elif '"spans"' in line:
                rows.utterances.append(_utterance(decoder(UtteranceLine).decode(line), text))
            elif '"transaction"' in line:
                rows.transactions.append(decoder(TransactionRow).decode(line))
            else:
                rows.exchanges.append(decoder(ExchangeRow).decode(line))
        change = change_of(rows)
        check_change(change, text)
    except (msgspec.DecodeError, RecursionError) as error:
        raise SessionError(f"{path}, line {number}: {one_line(error)}") from None
    except AnnotationError as error:
        raise AnnotationError(f"{path}, line {number}: {error}") from None
    missing = [line.id for line in text.lines if line.id not in change.utterances]
    if missing:
        raise AnnotationError(f"{path}: {missing[0]} is missing; the file is of another session, or cut off")
    return Annotation.empty(text).after(change)


def _utterance(line: UtteranceLine, text: SourceText) -> UtteranceRow:
    """Returns the row of an utterance, whose words must be those of the session."""
    spans = [SpanRow(**{name: getattr(span, name) for name in SpanRow.__struct_fields__}) for span in line.spans]
    row = UtteranceRow(line.speaker, line.utterance, spans)
    words = {(known.id.speaker.value, known.id.number): " ".join(known.words) for known in text.lines}
    if words.get((line.speaker, line.utterance)) != line.text:
        raise AnnotationError(f"utterance {line.utterance} of {line.speaker} is not in session {text.session}")
    return row
