"""Agreement of two annotations of one session (Cohen 1960; the paper, appendix B.3), and consistency of one."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from dorothie_gym.errors import SessionError
from dorothie_gym.evaluation.analysis.diversity import plain, words_of
from dorothie_gym.evaluation.analysis.span_agreement import Agreement, LabelledSpan, LabelledUtterance, agreement_of
from dorothie_gym.evaluation.analysis.units import Units, is_initiating
from dorothie_gym.ontology.dialogue_acts import DialogueMove

if TYPE_CHECKING:
    from dorothie_gym.session.recording.events import MoveRecord, UtteranceRecord
    from dorothie_gym.session.recording.session import Session


def agreement(first: Session, second: Session) -> Agreement:
    """Returns the agreement of two annotations of one session.

    Utterances are aligned by their numbers, words ignore case and punctuation; `span_agreement` defines the figures.

    Raises:
        SessionError: they are not of the same session, or a span does not match the words of its utterance; the
            message names the place.
    """
    pairs = _aligned(first, second)
    return agreement_of([_labelled(a, first.name) for a, _ in pairs], [_labelled(b, second.name) for _, b in pairs])


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


def _labelled(utterance: UtteranceRecord, name: str) -> LabelledUtterance:
    """Returns the labelled spans of an utterance; a text without words counts as one word."""
    if len(utterance.moves) == 1:
        return [LabelledSpan(max(1, len(words_of(utterance.text))), utterance.moves[0].act)]
    spans = [words_of(move.span) for move in utterance.moves]
    if sum(spans, ()) != words_of(utterance.text):
        raise SessionError(
            f"session {name}, utterance {utterance.number}: the spans together are not the words of the utterance"
        )
    acts = (move.act for move in utterance.moves)
    return [LabelledSpan(len(words), act) for words, act in zip(spans, acts, strict=True) if words]


# --- Consistency -----------------------------------------------------------------------------------------------------


def inconsistencies(session: Session, units: Units | None = None) -> tuple[str, ...]:
    """Returns one sentence for each fault of the annotation, starting with its place; empty if it is consistent.

    An exchange starts with an initiating move, every response has an exchange, and exchanges and transactions equal, in
    number and act by act, those that the rules derive. The last is not required of sessions that people have
    annotated.

    Args:
        session: a session of any layout.
        units: the units that the rules derive, if already known.
    """
    again = Units(session) if units is None else units
    moves = [move for utterance in again.utterances for move in utterance.moves]
    faults = [*_starts(moves), *_responses(moves)]
    if not session.header.is_annotated:
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
