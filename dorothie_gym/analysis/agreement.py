"""Agreement of two annotations of one session (Cohen 1960; the paper, appendix B.3), and consistency of one."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from dorothie_gym.analysis.diversity import plain, words_of
from dorothie_gym.analysis.units import Units, is_initiating
from dorothie_gym.errors import SessionError
from dorothie_gym.ontology import DialogueAct, DialogueMove, Slot
from dorothie_gym.recording.events import MoveRecord, UtteranceRecord
from dorothie_gym.recording.header import NATIVE
from dorothie_gym.recording.session import Session

_SLOTS = (Slot.ACTION, Slot.STREET, Slot.STATUS, Slot.LANDMARK, Slot.OBJECT)


@dataclass(frozen=True, kw_only=True)
class Agreement:
    """Agreement of two annotators.

    Attributes:
        moves: Cohen's kappa of the moves; None if both use a single move, so that chance explains the agreement.
        slots: Cohen's kappa of the values of each of the five slots in each piece; None likewise.
        pieces: compared stretches of words.
        utterances: number of utterances.
    """

    moves: float | None
    slots: float | None
    pieces: int
    utterances: int


def agreement(first: Session, second: Session) -> Agreement:
    """Returns the agreement of two annotations of one session.

    Utterances are aligned by their numbers. If annotators split an utterance differently, each stretch of words within
    one span of both is a piece. For slots, a piece counts once for each of the five slots; its label is the set of the
    slot's values there.

    Raises:
        SessionError: they are not of the same session, or a span does not match the words of its utterance; the
            message names the place.
    """
    pairs = _aligned(first, second)
    pieces = [piece for one, other in pairs for piece in _pieces(one, other, first.name, second.name)]
    moves = [(a.move.label, b.move.label) for a, b in pieces]
    slots = [(_label(a, slot), _label(b, slot)) for a, b in pieces for slot in _SLOTS]
    return Agreement(moves=kappa(moves), slots=kappa(slots), pieces=len(pieces), utterances=len(pairs))


def kappa(pairs: Sequence[tuple[str, str]]) -> float | None:
    """Returns Cohen's kappa of pairs of labels of two annotators; None with fewer than two different labels."""
    from sklearn.metrics import cohen_kappa_score

    if len({label for pair in pairs for label in pair}) < 2:
        return None
    return float(cohen_kappa_score(*zip(*pairs, strict=True)))


def _aligned(first: Session, second: Session) -> list[tuple[UtteranceRecord, UtteranceRecord]]:
    for name in ("town", "storyboard", "seed"):
        a, b = getattr(first.header, name), getattr(second.header, name)
        if a != b:
            raise SessionError(
                f"{first.name} and {second.name} are not the same session: "
                f"{name} is {a!r} in the one, {b!r} in the other"
            )
    one = {(utterance.number, utterance.speaker): utterance for utterance in first.utterances()}
    other = {(utterance.number, utterance.speaker): utterance for utterance in second.utterances()}
    for number, speaker in sorted(one.keys() ^ other.keys()):
        here, there = (first, second) if (number, speaker) in one else (second, first)
        raise SessionError(
            f"{first.name} and {second.name} are not the same session: utterance {number} of {speaker} is in "
            f"{here.name}, and not in {there.name}"
        )
    for key, utterance in one.items():
        if plain(utterance.text) != plain(other[key].text):
            raise SessionError(
                f"{first.name} and {second.name} are not the same session: utterance {key[0]} is "
                f"{utterance.text!r} in the one, {other[key].text!r} in the other"
            )
    if not one:
        raise SessionError(f"{first.name} and {second.name}: no utterances, so there is nothing to compare")
    return [(one[key], other[key]) for key in one]


def _pieces(one: UtteranceRecord, other: UtteranceRecord, *names: str) -> Iterator[tuple[DialogueAct, DialogueAct]]:
    """Returns the acts of both annotators for each stretch of words that neither of them splits."""
    a, b = _by_word(one, names[0]), _by_word(other, names[1])
    before: tuple[int, int] | None = None
    for span, span_there in zip(a, b, strict=True):
        if (span, span_there) != before:
            yield one.moves[span].act, other.moves[span_there].act
        before = span, span_there


def _by_word(utterance: UtteranceRecord, name: str) -> list[int]:
    """Returns the number of the span of each word of an utterance; a text without words counts as one word."""
    if len(utterance.moves) == 1:
        return [0] * max(1, len(words_of(utterance.text)))
    spans = [words_of(move.span) for move in utterance.moves]
    if sum(spans, ()) != words_of(utterance.text):
        raise SessionError(
            f"session {name}, utterance {utterance.number}: the spans together are not the words of the utterance"
        )
    return [k for k, words in enumerate(spans) for _ in words]


def _label(act: DialogueAct, slot: Slot) -> str:
    return "+".join(value.label for value in act.values(slot))


# --- Consistency -----------------------------------------------------------------------------------------------------


def inconsistencies(session: Session, units: Units | None = None) -> tuple[str, ...]:
    """Returns one sentence for each fault of the annotation, beginning with its place; empty if it is consistent.

    An exchange starts with an initiating move, every response has an exchange, and exchanges and transactions equal, in
    number and act by act, those that the rules derive. The last holds for sessions of this package only: people
    annotate by other rules.

    Args:
        session: any.
        units: the units that the rules derive, if already known.
    """
    again = Units(session) if units is None else units
    moves = [move for utterance in again.utterances for move in utterance.moves]
    faults = [*_starts(moves), *_responses(moves)]
    if session.header.source == NATIVE:
        exchanges = {move.index: move.exchange for move in moves}
        transactions = {move.index: move.transaction for move in moves}
        faults += _differences("exchange", moves, exchanges, {m.index: again.exchange_of(m) for m in moves})
        faults += _differences("transaction", moves, transactions, {m.index: again.transaction_of(m) for m in moves})
        faults += _outcome(session, again)
    return tuple(faults)


def _place(move: MoveRecord) -> str:
    return f"events[{move.index}] (utterance {move.utterance}, {move.act.move.label})"


def _starts(moves: list[MoveRecord]) -> Iterator[str]:
    begun: set[int] = set()
    for move in moves:
        if move.exchange is None or move.exchange in begun:
            continue
        begun.add(move.exchange)
        if not is_initiating(move):
            yield f"{_place(move)}: begins exchange {move.exchange}, which is not for a {move.act.move.label}"


def _responses(moves: list[MoveRecord]) -> Iterator[str]:
    for move in moves:
        if move.exchange is None and move.act.move is not DialogueMove.IRRELEVANT:
            what = "begins" if is_initiating(move) else "responds in"
            yield f"{_place(move)}: {what} no exchange"


def _differences(
    name: str, moves: list[MoveRecord], stored: Mapping[int, int | None], found: Mapping[int, int | None]
) -> Iterator[str]:
    counts = tuple(len({number for number in each.values() if number is not None}) for each in (stored, found))
    if counts[0] != counts[1]:
        yield f"{name}s: {counts[0]} are stored, {counts[1]} are derived by the rules"
    if not counts[0]:
        return
    for move in moves:
        if stored[move.index] != found[move.index]:
            yield f"{_place(move)}: is stored in {name} {stored[move.index]}, by the rules in {found[move.index]}"
            return  # later numbers are mostly shifted by the same amount


def _outcome(session: Session, units: Units) -> Iterator[str]:
    if session.summary is None:
        return
    found = {
        "utterances": len(units.utterances),
        "acts": sum(len(utterance.moves) for utterance in units.utterances),
        "exchanges": len(units.exchanges),
        "transactions": len(units.transactions),
    }
    for name, count in found.items():
        if name in session.summary and session.summary[name] != count:
            yield f"outcome: field {name!r} is {session.summary[name]}, and {count} are derived by the rules"
