"""Labels of sessions as annotations, and annotations as labels of sessions."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from dorothie_gym.errors import AnnotationError, OntologyError, SessionError, short_repr
from dorothie_gym.evaluation.analysis.exception_attribution import Handled
from dorothie_gym.lab.annotation.marks import Annotation, Change, ExchangeMark, SpanMark, TransactionMark, check_change
from dorothie_gym.lab.annotation.source_text import SourceLine, SourceText, UtteranceId
from dorothie_gym.ontology.dialogue_acts import DialogueAct, UnitEnd
from dorothie_gym.ontology.spellings import parse_landmark
from dorothie_gym.session.recording.events import EXCHANGE_UNIT, TRANSACTION_UNIT, Event, UtteranceRecord
from dorothie_gym.session.recording.header import ANNOTATION_FIELD

if TYPE_CHECKING:
    from dorothie_gym.session.recording.session import Session

_OF_A_SPAN: Final = ("audio", "meaning", "fluent", "sdn_act")
"""Optional fields of a dialogue move that belong to its span; another span does not inherit them."""

_LABELS: Final = ("span", "move", "slots", "exchange", "transaction", EXCHANGE_UNIT, TRANSACTION_UNIT)


# --- From a session ---------------------------------------------------------------------------------------------------


def recorded_annotation(session: Session, text: SourceText) -> Annotation:
    """Returns the labels of a session as an annotation.

    Acts of one utterance that have no spans of their own, as in some layouts of SDN, get equal shares of its words, in
    their order.

    Raises:
        SessionError: the spans of an utterance are not its words, or it has more acts than words.
        AnnotationError: the number of a unit is out of range, or its marks are malformed.
    """
    own = SourceText.of(session)
    text.check_same(own)
    records = {UtteranceId(each.speaker, each.number): each for each in session.utterances()}
    utterances = {}
    exchanges, transactions = dict[int, ExchangeMark](), dict[int, TransactionMark]()
    for line, mine in zip(own.lines, text.lines, strict=True):
        record = records[line.id]
        utterances[mine.id] = tuple(
            SpanMark(
                words=words,
                move=move.act.move,
                slots=move.act.slots,
                exchange=move.exchange,
                transaction=move.transaction,
            )
            for words, move in zip(_word_counts(record, line, session.name), record.moves, strict=True)
        )
        for move in record.moves:
            data, where = session.events[move.index].data, f"session {session.name}, event {move.index}"
            if move.exchange is not None and EXCHANGE_UNIT in data:
                exchanges[move.exchange] = _exchange_mark(data[EXCHANGE_UNIT], where)
            if move.transaction is not None and TRANSACTION_UNIT in data:
                transactions[move.transaction] = _transaction_mark(data[TRANSACTION_UNIT], where)
    change = Change(utterances=utterances, exchanges=exchanges, transactions=transactions)
    check_change(change, text)
    return Annotation.empty(text).after(change)


def _word_counts(record: UtteranceRecord, line: SourceLine, session: str) -> list[int]:
    """Returns the number of words of each span of an utterance."""
    total, acts = len(line.words), len(record.moves)
    if acts == 1:
        return [total]
    spans = [move.span.split() for move in record.moves]
    if tuple(itertools.chain.from_iterable(spans)) == line.words and all(spans):
        return [len(words) for words in spans]
    if all(move.span == record.text for move in record.moves) and acts <= total:
        return [(k + 1) * total // acts - k * total // acts for k in range(acts)]
    raise SessionError(f"session {session}, {line.id}: the spans together are not the words of the utterance")


def _exchange_mark(value: object, where: str) -> ExchangeMark:
    fields = _fields(value, f"{where}: field {EXCHANGE_UNIT!r}")
    exception, end = fields.get("exception"), _end(fields.get("end"), where)
    if exception is not None and exception not in set(Handled):
        raise AnnotationError(f"{where}: the exception of an exchange is {short_repr(exception)}")
    return ExchangeMark(exception=None if exception is None else Handled(str(exception)), end=end)


def _transaction_mark(value: object, where: str) -> TransactionMark:
    fields = _fields(value, f"{where}: field {TRANSACTION_UNIT!r}")
    goal = fields.get("goal")
    try:
        landmark = None if goal is None else parse_landmark(str(goal))
    except OntologyError as error:
        raise AnnotationError(f"{where}: {error}") from None
    return TransactionMark(goal=landmark, end=_end(fields.get("end"), where))


def _fields(value: object, where: str) -> Mapping[str, object]:
    if not isinstance(value, Mapping):
        raise AnnotationError(f"{where} is {short_repr(value)}; it must be an object")
    return value


def _end(value: object, where: str) -> UnitEnd | None:
    if value is not None and value not in set(UnitEnd):
        raise AnnotationError(f"{where}: the end of a unit is {short_repr(value)}")
    return None if value is None else UnitEnd(str(value))


# --- Into a session ---------------------------------------------------------------------------------------------------


def relabelled(session: Session, text: SourceText, annotation: Annotation, annotator: str) -> Session:
    """Returns a session with the labels of an annotation in place of its own.

    Everything else is kept, except data of spans or acts that no longer exist: audio, meaning and fluent words
    of a span with other words. Decisions of the roles are left out: a replay would give the previous labels. The header
    names the annotator, so that statistics use the stored exchanges and transactions instead of deriving them.

    Args:
        session: the session.
        text: its text.
        annotation: marks of all its utterances.
        annotator: name of the annotator.

    Raises:
        AnnotationError: a span has no move yet; names the first one.
    """
    missing = next(annotation.undecided(text), None)
    if missing is not None:
        raise AnnotationError(f"session {session.name}, annotation by {annotator}: {missing} has no move yet")
    return with_labels(session, text, annotation, {**session.header.extra, ANNOTATION_FIELD: {"annotator": annotator}})


def with_labels(
    session: Session, text: SourceText, annotation: Annotation, header_extra: Mapping[str, object]
) -> Session:
    """Returns a session with the moves, slots and units of an annotation, suggested ones included.

    Args:
        session: the session.
        text: its text.
        annotation: marks, with a move for every span.
        header_extra: `extra` of the header of the result.
    """
    replaced: dict[int, list[Event]] = {}
    begun: set[tuple[str, int]] = set()
    records = {UtteranceId(each.speaker, each.number): each for each in session.utterances()}
    for line in text.lines:
        record = records[line.id]
        for k, event in enumerate(_events(session, record, line, annotation, begun)):
            place = record.moves[min(k, len(record.moves) - 1)].index
            replaced.setdefault(place, []).append(event)
        for move in record.moves:
            replaced.setdefault(move.index, [])
    events = [kept for index, event in enumerate(session.events) for kept in replaced.get(index, [event])]
    audio = {str(event.data["audio"]) for event in events if "audio" in event.data}
    return replace(
        session,
        header=replace(session.header, extra=dict(header_extra)),
        events=tuple(events),
        summary=_counts(session, annotation),
        audio={name: path for name, path in session.audio.items() if name in audio},
        decisions=None,
    )


def _events(
    session: Session, record: UtteranceRecord, line: SourceLine, annotation: Annotation, begun: set[tuple[str, int]]
) -> Iterator[Event]:
    """Yields the dialogue moves of an utterance; `begun` holds the units whose first act has been written."""
    old = [session.events[move.index] for move in record.moves]
    by_span = {move.span: event for move, event in zip(record.moves, old, strict=True)}
    first = 0
    spans = annotation.utterances[line.id]
    for k, span in enumerate(spans):
        words = record.text if len(spans) == 1 else line.text(first, span.words)
        first += span.words
        same = by_span.get(words)
        base = old[min(k, len(old) - 1)] if same is None else same
        left_out = _LABELS if same is not None else (*_LABELS, *_OF_A_SPAN)
        assert span.move is not None
        act = DialogueAct(span.move, span.slots)
        data = {name: value for name, value in base.data.items() if name not in left_out}
        data |= {
            "span": words,
            "move": act.move.label,
            "slots": act.slot_labels(),
            "exchange": span.exchange,
        }
        if span.transaction is not None:
            data["transaction"] = span.transaction
        data.update(_unit_marks(span, annotation, begun))
        yield replace(base, flagged=any(event.flagged for event in old), data=data)


def _unit_marks(span: SpanMark, annotation: Annotation, begun: set[tuple[str, int]]) -> Iterator[tuple[str, object]]:
    """Yields the marks of the units that begin with a span."""
    if span.exchange is not None and (EXCHANGE_UNIT, span.exchange) not in begun:
        begun.add((EXCHANGE_UNIT, span.exchange))
        exchange = annotation.exchanges.get(span.exchange)
        if exchange is not None:
            yield EXCHANGE_UNIT, {"exception": exchange.exception, "end": exchange.end}
    if span.transaction is not None and (TRANSACTION_UNIT, span.transaction) not in begun:
        begun.add((TRANSACTION_UNIT, span.transaction))
        transaction = annotation.transactions.get(span.transaction)
        if transaction is not None:
            goal = None if transaction.goal is None else transaction.goal.label
            yield TRANSACTION_UNIT, {"goal": goal, "end": transaction.end}


def _counts(session: Session, annotation: Annotation) -> Mapping[str, object] | None:
    """Returns the outcome of a session with the numbers of acts and units of an annotation."""
    if session.summary is None:
        return None
    spans = [span for each in annotation.utterances.values() for span in each]
    counts = {
        "acts": len(spans),
        "exchanges": len({span.exchange for span in spans} - {None}),
        "transactions": len({span.transaction for span in spans} - {None}),
    }
    return {**session.summary, **{name: count for name, count in counts.items() if name in session.summary}}
