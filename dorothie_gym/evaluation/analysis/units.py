"""Exchanges and transactions of a recording, derived from its utterances and arrivals.

Numbers stored with the acts are used for sessions that people have annotated only.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from dorothie_gym.dialogue.conversation import Span, Utterance
from dorothie_gym.dialogue.exchanges import EXPECTATIONS, Exchange
from dorothie_gym.dialogue.transactions import Annotator
from dorothie_gym.errors import OntologyError
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.spellings import parse_goal_status, parse_landmark
from dorothie_gym.session.recording.events import EXCHANGE_UNIT, Event, EventType, MoveRecord, UtteranceRecord
from dorothie_gym.sim.config import FRAME_RATE

if TYPE_CHECKING:
    from dorothie_gym.ontology.slots import GoalStatus, LandmarkName, SlotValue
    from dorothie_gym.session.recording.session import Session

SPEAKERS = (Role.PARTICIPANT, Role.CO_WIZARD)


@dataclass(frozen=True, kw_only=True)
class SaidUnit:
    """Exchange or transaction: its number and its acts, in order."""

    id: int
    moves: tuple[MoveRecord, ...]

    @cached_property
    def start(self) -> float:
        """Start of its first utterance [s]."""
        return min(move.start for move in self.moves)

    @cached_property
    def end(self) -> float:
        """End of its last utterance [s]."""
        return max(move.end for move in self.moves)

    @cached_property
    def values(self) -> frozenset[SlotValue]:
        """Slot values that its acts name."""
        return frozenset(value for move in self.moves for value in move.act.slots)


class Units:
    """Exchanges and transactions of a session.

    Attributes:
        session: the session.
        utterances: utterances of participant and Co-Wizard, in the order of their ends.
        states: final state of each exchange, by number; empty for sessions that people have annotated.
        marked_exceptions: kind of exception that an exchange handles ("environmental", "task" or "none"), by number,
            where people have marked it.
    """

    def __init__(self, session: Session) -> None:
        """Derives the units.

        Args:
            session: a session of any layout.
        """
        self.session = session
        self.utterances: tuple[UtteranceRecord, ...] = tuple(
            utterance for utterance in session.utterances() if utterance.speaker in SPEAKERS
        )
        self.states: dict[int, Exchange] = {}
        self._exchange: dict[int, int] = {}
        self._transaction: dict[int, int] = {}
        self._place()
        self.marked_exceptions: dict[int, str] = self._marked() if session.header.is_annotated else {}

    def exchange_of(self, move: MoveRecord) -> int | None:
        """Returns the number of an act's exchange; None if people annotated none."""
        return self._exchange.get(move.index)

    def transaction_of(self, move: MoveRecord) -> int | None:
        """Returns the number of an act's transaction; None if people annotated none."""
        return self._transaction.get(move.index)

    @cached_property
    def exchanges(self) -> tuple[SaidUnit, ...]:
        """The exchanges, by number."""
        return _units(self.utterances, self._exchange)

    @cached_property
    def transactions(self) -> tuple[SaidUnit, ...]:
        """The transactions, by number."""
        return _units(self.utterances, self._transaction)

    def _place(self) -> None:
        moves = [move for utterance in self.utterances for move in utterance.moves]
        people = self.session.header.is_annotated
        if people and any(move.exchange is not None for move in moves):
            self._exchange = {move.index: move.exchange for move in moves if move.exchange is not None}
        if people and any(move.transaction is not None for move in moves):
            self._transaction = {move.index: move.transaction for move in moves if move.transaction is not None}
        annotator = Annotator(goals_of(self.session))
        period = 1.0 / self.session.header.decision_frequency
        place_exchanges, place_transactions = not self._exchange, not self._transaction
        for item in _in_order(self.session, self.utterances):
            if isinstance(item, Event):
                changed = subgoal_of(item)
                if changed is not None:
                    annotator.note(*changed)
                continue
            utterance = _spoken(item)
            # As in a session: exchanges expire at the decisions before the one at which this utterance is heard.
            annotator.tick(item.moves[0].frame / FRAME_RATE - period)
            ids, transaction = annotator.update(utterance)
            for move, exchange in zip(item.moves, ids, strict=True):
                if place_exchanges and exchange is not None:
                    self._exchange[move.index] = exchange
                if place_transactions:
                    self._transaction[move.index] = transaction
        annotator.tick(float("inf"))
        if place_exchanges:
            self.states = {exchange.id: exchange for exchange in annotator.exchanges}

    def _marked(self) -> dict[int, str]:
        found = {}
        for utterance in self.utterances:
            for move in utterance.moves:
                unit = self.session.events[move.index].data.get(EXCHANGE_UNIT)
                kind = unit.get("exception") if isinstance(unit, Mapping) else None
                if isinstance(kind, str) and move.index in self._exchange:
                    found[self._exchange[move.index]] = kind
        return found


def is_initiating(move: MoveRecord) -> bool:
    """Returns whether an act is an initiating move."""
    return move.act.move in EXPECTATIONS


def goals_of(session: Session) -> tuple[LandmarkName, ...]:
    """Returns the landmarks of the subgoals in a session's header; names outside of the ontology are skipped."""
    rows = session.header.landmarks
    names = [
        rows[subgoal["landmark"]]["name"] for subgoal in session.header.subgoals if subgoal["landmark"] < len(rows)
    ]
    return tuple(name for name in map(_landmark, names) if name is not None)


def subgoal_of(event: Event) -> tuple[LandmarkName, GoalStatus] | None:
    """Returns landmark and status of a subgoal event; None for other events and for unknown names."""
    if event.type is not EventType.SUBGOAL:
        return None
    landmark = _landmark(str(event.data.get("landmark")))
    try:
        status = parse_goal_status(str(event.data.get("status")))
    except OntologyError:
        return None
    return None if landmark is None else (landmark, status)


def _landmark(name: str) -> LandmarkName | None:
    try:
        return parse_landmark(name)
    except OntologyError:
        return None


def _in_order(session: Session, utterances: tuple[UtteranceRecord, ...]) -> Iterator[Event | UtteranceRecord]:
    """Yields utterances in the order of their ends, and the changes of subgoals between them."""
    first = {utterance.moves[0].index: utterance for utterance in utterances}
    for index, event in enumerate(session.events):
        if index in first:
            yield first[index]
        elif event.type is EventType.SUBGOAL:
            yield event


def _spoken(record: UtteranceRecord) -> Utterance:
    spans = tuple(Span(move.span.strip() or "-", move.act) for move in record.moves)
    return Utterance(record.speaker, spans, record.start, max(record.start, record.end))


def _units(utterances: tuple[UtteranceRecord, ...], numbers: dict[int, int]) -> tuple[SaidUnit, ...]:
    groups: dict[int, list[MoveRecord]] = {}
    for utterance in utterances:
        for move in utterance.moves:
            if move.index in numbers:
                groups.setdefault(numbers[move.index], []).append(move)
    return tuple(SaidUnit(id=k, moves=tuple(groups[k])) for k in sorted(groups))
