"""Marks of an annotator: spans of utterances with moves and slots, and the exchanges and transactions of the spans."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Final, TypeAlias

from dorothie_gym.errors import AnnotationError
from dorothie_gym.evaluation.analysis.exception_attribution import Handled
from dorothie_gym.evaluation.analysis.segmentation_agreement import SegmentedSession, UnitSpan
from dorothie_gym.evaluation.analysis.span_agreement import LabelledSpan
from dorothie_gym.lab.annotation.source_text import SourceLine, SourceText, UtteranceId
from dorothie_gym.ontology.dialogue_acts import DialogueAct, DialogueMove, DialogueUnit, UnitEnd
from dorothie_gym.ontology.slots import LandmarkName, SlotValue

MAX_UNIT: Final = 10_000_000
"""Bound of the numbers of exchanges and transactions."""


@dataclass(frozen=True, kw_only=True)
class SpanMark:
    """Marks of a span.

    Attributes:
        words: number of its words, at least 1.
        move: dialogue move; None if it is not decided.
        slots: slot values.
        exchange: number of its exchange; None if there is none.
        transaction: number of its transaction; None if there is none.
        suggested: whether the marks come from the classifier and the annotator has not accepted them yet.
    """

    words: int
    move: DialogueMove | None = None
    slots: frozenset[SlotValue] = frozenset()
    exchange: int | None = None
    transaction: int | None = None
    suggested: bool = False

    @property
    def act(self) -> DialogueAct | None:
        """Move and slots that the annotator has chosen; None if undecided."""
        return None if self.move is None or self.suggested else DialogueAct(self.move, self.slots)


@dataclass(frozen=True, kw_only=True)
class ExchangeMark:
    """Marks of an exchange.

    Attributes:
        exception: kind of exception that it handles; None if it is not decided.
        end: fulfilled or abandoned; None if it is not decided.
    """

    exception: Handled | None = None
    end: UnitEnd | None = None

    def __post_init__(self) -> None:
        _check_end(self.end, DialogueUnit.EXCHANGE)


@dataclass(frozen=True, kw_only=True)
class TransactionMark:
    """Marks of a transaction.

    Attributes:
        goal: landmark of its subgoal; None if it is not decided.
        end: completed, interrupted or abandoned; None if it is not decided.
    """

    goal: LandmarkName | None = None
    end: UnitEnd | None = None

    def __post_init__(self) -> None:
        _check_end(self.end, DialogueUnit.TRANSACTION)


def _check_end(end: UnitEnd | None, unit: DialogueUnit) -> None:
    if end is not None and end not in unit.ends:
        raise AnnotationError(f"{unit.value}: its end is {end.value!r}; it must be one of {', '.join(unit.ends)}")


Spans: TypeAlias = tuple[SpanMark, ...]
"""Marks of an utterance: spans that together are its words."""


@dataclass(frozen=True, kw_only=True)
class Change:
    """New marks of utterances, exchanges and transactions, which replace the previous ones.

    Attributes:
        utterances: spans by utterance.
        exchanges: marks of exchanges, by number.
        transactions: marks of transactions, by number.
    """

    utterances: Mapping[UtteranceId, Spans] = field(default_factory=dict)
    exchanges: Mapping[int, ExchangeMark] = field(default_factory=dict)
    transactions: Mapping[int, TransactionMark] = field(default_factory=dict)

    def __bool__(self) -> bool:
        return bool(self.utterances or self.exchanges or self.transactions)


@dataclass(frozen=True, kw_only=True)
class Annotation:
    """All marks of an annotator in a session.

    Attributes:
        utterances: spans of every utterance of the session.
        exchanges: marks of exchanges that have any; others are undecided.
        transactions: the same for transactions.
    """

    utterances: Mapping[UtteranceId, Spans]
    exchanges: Mapping[int, ExchangeMark] = field(default_factory=dict)
    transactions: Mapping[int, TransactionMark] = field(default_factory=dict)

    @classmethod
    def empty(cls, text: SourceText) -> Annotation:
        """Returns the annotation in which every utterance is one undecided span."""
        return cls(utterances={line.id: (SpanMark(words=len(line.words)),) for line in text.lines})

    def after(self, change: Change) -> Annotation:
        """Returns the annotation with a change; marks of units without spans are dropped."""
        utterances = {**self.utterances, **change.utterances}
        spans = [span for each in utterances.values() for span in each]
        exchanges = {span.exchange for span in spans}
        transactions = {span.transaction for span in spans}
        nothing = ExchangeMark(), TransactionMark()
        return Annotation(
            utterances=MappingProxyType(utterances),
            exchanges=MappingProxyType(
                {
                    number: mark
                    for number, mark in sorted({**self.exchanges, **change.exchanges}.items())
                    if number in exchanges and mark != nothing[0]
                }
            ),
            transactions=MappingProxyType(
                {
                    number: mark
                    for number, mark in sorted({**self.transactions, **change.transactions}.items())
                    if number in transactions and mark != nothing[1]
                }
            ),
        )

    def difference(self, before: Annotation) -> Change:
        """Returns the change that makes this annotation of an earlier one."""
        exchanges = self.exchanges.keys() | before.exchanges.keys()
        transactions = self.transactions.keys() | before.transactions.keys()
        return Change(
            utterances={id: spans for id, spans in self.utterances.items() if before.utterances.get(id) != spans},
            exchanges={
                number: self.exchanges.get(number, ExchangeMark())
                for number in sorted(exchanges)
                if self.exchanges.get(number) != before.exchanges.get(number)
            },
            transactions={
                number: self.transactions.get(number, TransactionMark())
                for number in sorted(transactions)
                if self.transactions.get(number) != before.transactions.get(number)
            },
        )

    def spans(self, text: SourceText) -> Iterator[tuple[SourceLine, int, SpanMark]]:
        """Yields utterance, number of the first word in it, and marks of every span, in order."""
        for line in text.lines:
            first = 0
            for span in self.utterances[line.id]:
                yield line, first, span
                first += span.words

    def labels(self, text: SourceText) -> list[tuple[LabelledSpan, ...]]:
        """Returns the labelled spans of every utterance, in order; see `span_agreement`."""
        return [tuple(LabelledSpan(span.words, span.act) for span in self.utterances[line.id]) for line in text.lines]

    def exchange_spans(self, text: SourceText) -> SegmentedSession:
        """Returns the spans of the session with their exchanges; see `segmentation_agreement`."""
        return [UnitSpan(span.words, span.exchange, span.act is not None) for _, _, span in self.spans(text)]

    def transaction_spans(self, text: SourceText) -> SegmentedSession:
        """Returns the spans of the session with their transactions; see `segmentation_agreement`."""
        return [UnitSpan(span.words, span.transaction, span.act is not None) for _, _, span in self.spans(text)]

    def undecided(self, text: SourceText) -> Iterator[str]:
        """Yields the place of every span for which the annotator has not chosen a move."""
        for line, first, span in self.spans(text):
            if span.act is None:
                yield f"{line.id}, span {line.text(first, span.words)!r}"


def check_change(change: Change, text: SourceText) -> None:
    """Raises `AnnotationError` if a change does not match the text of its session; the message names the place."""
    for id, spans in change.utterances.items():
        line = text.by_id.get(id)
        if line is None:
            raise AnnotationError(f"{id}: session {text.session} has no such utterance")
        words = sum(span.words for span in spans)
        if not spans or min(span.words for span in spans) < 1 or words != len(line.words):
            raise AnnotationError(f"{id}: its spans have {words} words, and the utterance has {len(line.words)}")
        if any(span.suggested and span.move is None for span in spans):
            raise AnnotationError(f"{id}: a suggested span has no move")
        units = [number for span in spans for number in (span.exchange, span.transaction) if number is not None]
        _check_numbers(units, str(id))
    _check_numbers(change.exchanges, "exchanges")
    _check_numbers(change.transactions, "transactions")


def _check_numbers(numbers: object, where: str) -> None:
    assert isinstance(numbers, Mapping | list)
    for number in numbers:
        if not 0 <= number < MAX_UNIT:
            raise AnnotationError(f"{where}: number {number} of a unit is not in 0..{MAX_UNIT - 1}")


def accepted(span: SpanMark) -> SpanMark:
    """Returns a span whose suggested marks are accepted."""
    return replace(span, suggested=False)
