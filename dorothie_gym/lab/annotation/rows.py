"""Marks as JSON: rows of logs, of the JSONL format, and of messages of browsers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Final, TypeAlias

import msgspec
from msgspec import Meta, Struct

from dorothie_gym.errors import AnnotationError, OntologyError
from dorothie_gym.evaluation.analysis.exception_attribution import Handled
from dorothie_gym.lab.annotation.marks import MAX_UNIT, Change, ExchangeMark, SpanMark, TransactionMark
from dorothie_gym.lab.annotation.source_text import SPEAKERS, UtteranceId
from dorothie_gym.ontology.dialogue_acts import DialogueAct, DialogueMove, UnitEnd
from dorothie_gym.ontology.spellings import parse_act, parse_landmark, parse_move

if TYPE_CHECKING:
    from dorothie_gym.ontology.slots import LandmarkName

MAX_SPANS: Final = 400
"""Maximum number of spans of an utterance: one for each word of the longest one."""

Label: TypeAlias = Annotated[str, Meta(max_length=40)]
"""Label of a vocabulary."""

UnitNumber: TypeAlias = Annotated[int, Meta(ge=0, lt=MAX_UNIT)]
"""Number of an exchange or transaction."""

_SPEAKERS: Final = {role.value: role for role in SPEAKERS}


class SpanRow(Struct, forbid_unknown_fields=True, frozen=True, omit_defaults=True):
    """Marks of a span: number of words, labels of move and slot values, numbers of its units."""

    words: Annotated[int, Meta(ge=1, le=1_000_000)]
    move: Label | None = None
    slots: dict[Label, Annotated[list[Label], Meta(max_length=80)]] = {}
    exchange: UnitNumber | None = None
    transaction: UnitNumber | None = None
    suggested: bool = False


class UtteranceRow(Struct, forbid_unknown_fields=True, frozen=True):
    """Spans of an utterance."""

    speaker: Label
    utterance: Annotated[int, Meta(ge=0, lt=2**53)]
    spans: Annotated[list[SpanRow], Meta(min_length=1, max_length=MAX_SPANS)]


class ExchangeRow(Struct, forbid_unknown_fields=True, frozen=True):
    """Marks of an exchange."""

    exchange: UnitNumber
    exception: Handled | None = None
    end: UnitEnd | None = None


class TransactionRow(Struct, forbid_unknown_fields=True, frozen=True):
    """Marks of a transaction."""

    transaction: UnitNumber
    goal: Label | None = None
    end: UnitEnd | None = None


class ChangeRows(Struct, forbid_unknown_fields=True, frozen=True, omit_defaults=True):
    """Change of marks."""

    utterances: Annotated[list[UtteranceRow], Meta(max_length=10_000)] = []
    exchanges: Annotated[list[ExchangeRow], Meta(max_length=10_000)] = []
    transactions: Annotated[list[TransactionRow], Meta(max_length=10_000)] = []


def change_of(rows: ChangeRows) -> Change:
    """Returns the change of rows; raises `AnnotationError` if a label is unknown or a row occurs twice."""
    utterances = {utterance_id(row.speaker, row.utterance): tuple(map(_span, row.spans)) for row in rows.utterances}
    exchanges = {row.exchange: ExchangeMark(exception=row.exception, end=row.end) for row in rows.exchanges}
    transactions = {
        row.transaction: TransactionMark(goal=None if row.goal is None else _goal(row.goal), end=row.end)
        for row in rows.transactions
    }
    made = len(utterances) + len(exchanges) + len(transactions)
    if made < len(rows.utterances) + len(rows.exchanges) + len(rows.transactions):
        raise AnnotationError("an utterance, exchange or transaction is given twice")
    return Change(utterances=utterances, exchanges=exchanges, transactions=transactions)


def rows_of(change: Change) -> ChangeRows:
    """Returns the rows of a change; the inverse of `change_of`."""
    return ChangeRows(
        utterances=[
            UtteranceRow(speaker=id.speaker.value, utterance=id.number, spans=[span_row(span) for span in spans])
            for id, spans in change.utterances.items()
        ],
        exchanges=[
            ExchangeRow(exchange=number, exception=mark.exception, end=mark.end)
            for number, mark in change.exchanges.items()
        ],
        transactions=[
            TransactionRow(transaction=number, goal=None if mark.goal is None else mark.goal.label, end=mark.end)
            for number, mark in change.transactions.items()
        ],
    )


def utterance_id(speaker: str, number: int) -> UtteranceId:
    """Returns the identity of an utterance; raises `AnnotationError` for an unknown speaker."""
    if speaker not in _SPEAKERS:
        raise AnnotationError(f"speaker: {speaker!r} is unknown; it must be {' or '.join(_SPEAKERS)}")
    return UtteranceId(_SPEAKERS[speaker], number)


def span_row(span: SpanMark) -> SpanRow:
    """Returns the row of a span."""
    return SpanRow(
        words=span.words,
        move=None if span.move is None else span.move.label,
        slots=DialogueAct(DialogueMove.IRRELEVANT, span.slots).slot_labels(),
        exchange=span.exchange,
        transaction=span.transaction,
        suggested=span.suggested,
    )


def read_label(move: str | None, slots: dict[str, list[str]]) -> tuple[DialogueMove | None, DialogueAct]:
    """Returns a move, and an act with the slots; raises `AnnotationError` for labels outside of the ontology."""
    try:
        return None if move is None else parse_move(move), parse_act(move or DialogueMove.IRRELEVANT.label, slots)
    except OntologyError as error:
        raise AnnotationError(str(error)) from None


def _span(row: SpanRow) -> SpanMark:
    move, act = read_label(row.move, row.slots)
    return SpanMark(
        words=row.words,
        move=move,
        slots=act.slots,
        exchange=row.exchange,
        transaction=row.transaction,
        suggested=row.suggested,
    )


def _goal(label: str) -> LandmarkName:
    try:
        return parse_landmark(label)
    except OntologyError as error:
        raise AnnotationError(str(error)) from None


def to_json(rows: Struct | Sequence[Struct]) -> object:
    """Returns rows in JSON types."""
    return msgspec.to_builtins(rows)
