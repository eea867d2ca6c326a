"""Comparison of several annotations of a session: disagreements, consensus, and marks copied into a final version.

Annotators number exchanges and transactions as they like. Units are the same if they begin at the same word of the
session; the final version numbers each unit by that word.
"""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TypeAlias

from dorothie_gym.lab.annotation.marks import Annotation, Change, ExchangeMark, SpanMark, TransactionMark, accepted
from dorothie_gym.lab.annotation.source_text import SourceLine, SourceText, UtteranceId


class Layer(enum.StrEnum):
    """Layer of marks on which annotators may disagree."""

    SPANS = "spans"
    MOVES = "moves"
    SLOTS = "slots"
    EXCHANGES = "exchanges"
    TRANSACTIONS = "transactions"
    UNDECIDED = "undecided"
    """An annotator has not finished the utterance."""


@dataclass(frozen=True)
class Disagreement:
    """Utterance that annotators have marked differently, with the layers on which they differ."""

    id: UtteranceId
    layers: tuple[Layer, ...]


_Marks: TypeAlias = tuple[object, ...]
"""Marks of a layer of an utterance, for comparison."""


class UnitStarts:
    """First word in the session of each exchange and transaction of an annotation.

    Args:
        text: text of the session.
        annotation: the annotation.

    Attributes:
        exchanges: number of the first word, by number of the exchange.
        transactions: the same for transactions.
    """

    def __init__(self, text: SourceText, annotation: Annotation) -> None:
        self.exchanges: dict[int, int] = {}
        self.transactions: dict[int, int] = {}
        for line, first, span in annotation.spans(text):
            if span.exchange is not None:
                self.exchanges.setdefault(span.exchange, line.offset + first)
            if span.transaction is not None:
                self.transactions.setdefault(span.transaction, line.offset + first)

    def renumbered(self, span: SpanMark) -> SpanMark:
        """Returns a span whose units are numbered by their first words."""
        return replace(
            span,
            exchange=None if span.exchange is None else self.exchanges[span.exchange],
            transaction=None if span.transaction is None else self.transactions[span.transaction],
        )


def adopted(text: SourceText, source: Annotation, id: UtteranceId) -> Change:
    """Returns the change that copies the marks of an utterance into the final version.

    Units are numbered by their first words; the marks of the units that begin in the utterance are also copied.
    Suggestions count as accepted.
    """
    line, starts = text.by_id[id], UnitStarts(text, source)
    begin = range(line.offset, line.offset + len(line.words))
    return Change(
        utterances={id: tuple(accepted(starts.renumbered(span)) for span in source.utterances[id])},
        exchanges={
            start: source.exchanges.get(number, ExchangeMark())
            for number, start in starts.exchanges.items()
            if start in begin
        },
        transactions={
            start: source.transactions.get(number, TransactionMark())
            for number, start in starts.transactions.items()
            if start in begin
        },
    )


def disagreements(text: SourceText, annotations: Mapping[str, Annotation]) -> tuple[Disagreement, ...]:
    """Returns the utterances that annotators have marked differently or not finished, in order."""
    starts = [UnitStarts(text, annotation) for annotation in annotations.values()]
    found = []
    for line in text.lines:
        marks = [
            _layers(line, annotation, start) for annotation, start in zip(annotations.values(), starts, strict=True)
        ]
        layers = [layer for layer in Layer if len({each[layer] for each in marks}) > 1]
        spans = [span for annotation in annotations.values() for span in annotation.utterances[line.id]]
        if any(span.act is None for span in spans):
            layers = [Layer.UNDECIDED]
        if layers:
            found.append(Disagreement(line.id, tuple(layers)))
    return tuple(found)


def consensus(text: SourceText, annotations: Mapping[str, Annotation]) -> Annotation:
    """Returns the initial final version: marks on which all annotators agree; other utterances are undecided."""
    open_ids = {each.id for each in disagreements(text, annotations)}
    final, first = Annotation.empty(text), next(iter(annotations.values()))
    for line in text.lines:
        if line.id not in open_ids:
            final = final.after(adopted(text, first, line.id))
    return final


def _layers(line: SourceLine, annotation: Annotation, starts: UnitStarts) -> dict[Layer, _Marks]:
    """Returns the marks of an utterance, by layer; moves and slots by word, so that borders alone do not differ."""
    spans = [starts.renumbered(span) for span in annotation.utterances[line.id]]
    begin = range(line.offset, line.offset + len(line.words))
    exchanges = [annotation.exchanges.get(number) for number, start in starts.exchanges.items() if start in begin]
    transactions = [
        annotation.transactions.get(number) for number, start in starts.transactions.items() if start in begin
    ]
    return {
        Layer.SPANS: tuple(span.words for span in spans),
        Layer.MOVES: tuple(span.move for span in spans for _ in range(span.words)),
        Layer.SLOTS: tuple(span.slots for span in spans for _ in range(span.words)),
        Layer.EXCHANGES: (*(span.exchange for span in spans for _ in range(span.words)), *exchanges),
        Layer.TRANSACTIONS: (*(span.transaction for span in spans for _ in range(span.words)), *transactions),
        Layer.UNDECIDED: (),
    }
