"""Whether the annotation of a session holds together."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from dorothie_gym.ontology import DialogueMove
from dorothie_gym.sessions.header import NATIVE
from dorothie_gym.sessions.records import MoveRecord
from dorothie_gym.sessions.session import Session
from dorothie_gym.sessions.statistics.units import Units, is_initiating


def inconsistencies(session: Session, units: Units | None = None) -> tuple[str, ...]:
    """Returns a sentence for each fault of the annotation, beginning with its place; none is consistent.

    An exchange starts with an initiating move, every response has an exchange, and exchanges and transactions are, in
    number and act by act, those that the rules find anew. The last is asked of our own sessions only: people annotate
    by other rules.

    Args:
        session: any.
        units: what the rules find anew, if it is known already.
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
        yield f"{name}s: {counts[0]} are stored, {counts[1]} are found anew"
    if not counts[0]:
        return
    for move in moves:
        if stored[move.index] != found[move.index]:
            yield f"{_place(move)}: is stored in {name} {stored[move.index]}, found anew in {found[move.index]}"
            return  # what follows is mostly shifted by the same


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
            yield f"outcome: field {name!r} is {session.summary[name]}, and {count} are found anew"
