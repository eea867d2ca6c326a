"""Exchange units: an initiating act up to the fulfilment or abandonment of its expectation (paper, section 4)."""

from __future__ import annotations

import enum
import itertools
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING

from dorothie_gym.ontology.dialogue_acts import DialogueAct, DialogueMove
from dorothie_gym.ontology.labelled_enums import check_complete
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import ActionValue, SlotValue

if TYPE_CHECKING:
    from dorothie_gym.dialogue.conversation import Utterance

ANSWER_TIMEOUT = 10.0
"""Time without an answer after which an exchange is abandoned [s] (dialogue spec, phenomenon 21)."""

SEARCHED_EXCHANGES = 50
"""Number of latest exchanges that are searched for a match; far more than can start within `ANSWER_TIMEOUT`."""

EXPECTATIONS: Mapping[DialogueMove, frozenset[DialogueMove]] = MappingProxyType(
    {
        DialogueMove.INSTRUCT: frozenset(
            {
                DialogueMove.ACKNOWLEDGE,
                DialogueMove.CONFIRM,
                DialogueMove.CLARIFY,
                DialogueMove.REPLY_Y,
                DialogueMove.REPLY_N,
                DialogueMove.REPLY_U,
            }
        ),
        DialogueMove.EXPLAIN: frozenset(
            {DialogueMove.ACKNOWLEDGE, DialogueMove.CONFIRM, DialogueMove.CLARIFY, DialogueMove.REPLY_Y}
        ),
        DialogueMove.ALIGN: frozenset({DialogueMove.ACKNOWLEDGE, DialogueMove.REPLY_Y, DialogueMove.REPLY_N}),
        DialogueMove.CHECK: frozenset(
            {
                DialogueMove.CONFIRM,
                DialogueMove.REPLY_Y,
                DialogueMove.REPLY_N,
                DialogueMove.REPLY_U,
                DialogueMove.CLARIFY,
            }
        ),
        DialogueMove.QUERY_YN: frozenset({DialogueMove.REPLY_Y, DialogueMove.REPLY_N, DialogueMove.REPLY_U}),
        DialogueMove.QUERY_W: frozenset({DialogueMove.REPLY_W, DialogueMove.REPLY_U}),
    }
)
"""Responses that fulfil each initiating move. Confuse is a response to all of them and fulfils none."""

check_complete(
    {*EXPECTATIONS, *itertools.chain(*EXPECTATIONS.values()), DialogueMove.CONFUSE, DialogueMove.IRRELEVANT},
    DialogueMove,
    "EXPECTATIONS",
    __name__,
)

_ASKING = frozenset({DialogueMove.CHECK, DialogueMove.QUERY_YN, DialogueMove.QUERY_W})

_INSERTED: Mapping[DialogueMove, frozenset[DialogueMove]] = MappingProxyType(
    {
        DialogueMove.INSTRUCT: frozenset({DialogueMove.CHECK, DialogueMove.EXPLAIN}),
        **{move: frozenset({DialogueMove.INSTRUCT, DialogueMove.EXPLAIN}) for move in _ASKING},
    }
)
"""Initiating moves by which the other side continues an open exchange instead of starting a new one: a check of or an
objection to a command, and a command or statement as the answer to a question."""

_GROUNDING = frozenset({DialogueMove.ACKNOWLEDGE, DialogueMove.CONFIRM})
"""Moves that refer to the exchange in which their slot values were named."""

_UNKNOWN = ActionValue.UNKNOWN.label
"""Label of the unknown value in every slot."""

_OPEN_LABELS = frozenset({_UNKNOWN, ActionValue.QUERIED.label})
"""Labels of values that are not names."""

_REPAIRS = frozenset({DialogueMove.CLARIFY, DialogueMove.CONFIRM, DialogueMove.REPLY_W})
"""Moves with which the initiator repairs an exchange after a Confuse."""


class ExchangeState(enum.StrEnum):
    """State of an exchange."""

    OPEN = "open"
    FULFILLED = "fulfilled"
    ABANDONED = "abandoned"


@dataclass
class Exchange:
    """Exchange unit.

    Attributes:
        id: index in order of start, from 0.
        initiator: role that opened the exchange.
        move: latest initiating move; for an unprompted exchange, its only response.
        start: start of the first utterance [s].
        end: end of the last utterance [s].
        state: open, fulfilled or abandoned.
        unprompted: whether the exchange consists of a response without any preceding initiative.
        acts: number of acts in the exchange.
        confused: whether the other side signalled non-understanding and a repair by the initiator is due.
        asked_back: whether the other side checked or objected to a command and an answer by the initiator is due.
        act: latest initiating act, with the move `move`.
        taken_up: whether the other side has contributed to the exchange.
        named: slot values named in the exchange, each with its speaker.
    """

    id: int
    initiator: Role
    move: DialogueMove
    start: float
    end: float
    state: ExchangeState = ExchangeState.OPEN
    unprompted: bool = False
    acts: int = field(default=0)
    confused: bool = False
    asked_back: bool = False
    act: DialogueAct | None = None
    taken_up: bool = False
    named: set[tuple[Role, SlotValue]] = field(default_factory=set)

    def accepts(self, speaker: Role, move: DialogueMove) -> bool:
        """Returns whether `move` by `speaker` answers or continues this exchange."""
        if self.unprompted:
            return False
        if speaker is self.initiator:
            answers = self.asked_back and move in EXPECTATIONS[DialogueMove.CHECK]
            return answers or (self.confused and move in _REPAIRS)
        return move is DialogueMove.CONFUSE or move in EXPECTATIONS[self.move]

    def is_informed_by(self, move: DialogueMove) -> bool:
        """Returns whether `move` by the other side supplies a value that the initiator declared unknown."""
        puzzles = self.act is not None and any(value.label == _UNKNOWN for value in self.act.slots)
        return puzzles and self.move is DialogueMove.EXPLAIN and move is DialogueMove.EXPLAIN

    def names(self, speaker: Role, values: Iterable[SlotValue]) -> bool:
        """Returns whether `speaker` has named one of the values in this exchange."""
        return any((speaker, value) in self.named for value in values)


class ExchangeTracker:
    """Assigns the acts of delivered utterances to exchanges.

    Rules:
        - Initiating acts of one utterance share an exchange: a reason and the command that follows are one initiative.
        - An Explain after a response in the same utterance elaborates on that response.
        - These acts continue the open exchange: a question about a command; a command or an explanation as the answer
          to a question or to a statement of missing knowledge; a further explanation or repetition of the same names by
          the initiator; and an initiating act repeated before any answer.
        - Acknowledge and Confirm with slot values refer to the latest exchange in which the other side named a value.
        - Exchanges may overlap: an initiative during speech of the other side opens a new exchange.
    """

    def __init__(self, patience: float = ANSWER_TIMEOUT) -> None:
        """Creates a tracker without exchanges.

        Args:
            patience: time without an answer after which an exchange is abandoned [s], positive.

        Raises:
            ValueError: if `patience` is not positive.
        """
        if patience <= 0:
            raise ValueError(f"patience must be positive, not {patience}")
        self.patience = patience
        self.exchanges: list[Exchange] = []
        self._waiting: dict[int, Exchange] = {}  # open exchanges by id

    def update(self, utterance: Utterance) -> tuple[int | None, ...]:
        """Assigns every act of a delivered utterance to an exchange.

        Args:
            utterance: delivered utterance; calls follow the order of delivery.

        Returns:
            Exchange id of each act, in order; None for irrelevant talk outside all exchanges.
        """
        opened: Exchange | None = None
        answered: Exchange | None = None
        ids: list[int | None] = []
        for act in utterance.acts:
            move = act.move
            if move is DialogueMove.EXPLAIN and answered is not None and opened is None:
                exchange = answered
            elif move in EXPECTATIONS:
                exchange = opened = self._initiate(utterance, act, opened)
            else:
                found = answered = self._respond(utterance, act)
                if found is None:
                    ids.append(None)
                    continue
                exchange = found
            exchange.acts += 1
            exchange.taken_up |= utterance.speaker is not exchange.initiator
            exchange.named.update((utterance.speaker, value) for value in _names(act))
            exchange.end = max(exchange.end, utterance.end)
            ids.append(exchange.id)
        return tuple(ids)

    def tick(self, now: float) -> None:
        """Closes exchanges without a timely answer at `now` [s]: abandoned, or fulfilled for an Explain."""
        for exchange in list(self._waiting.values()):
            if now - exchange.end > self.patience:
                optional = exchange.move is DialogueMove.EXPLAIN and not exchange.confused
                self._close(exchange, ExchangeState.FULFILLED if optional else ExchangeState.ABANDONED)

    def open(self) -> list[Exchange]:
        """Returns the exchanges without an answer, oldest first."""
        return sorted(self._waiting.values(), key=lambda exchange: exchange.id)

    def _recent(self) -> Iterator[Exchange]:
        """Yields the exchanges that are candidates for new acts, latest first."""
        return itertools.islice(reversed(self.exchanges), SEARCHED_EXCHANGES)

    def _initiate(self, utterance: Utterance, act: DialogueAct, opened: Exchange | None) -> Exchange:
        move = act.move
        if opened is not None:
            # An Explain after a question does not replace the expectation of the question.
            if move is not DialogueMove.EXPLAIN:
                opened.move, opened.act = move, act
            return opened
        found = self._say_again(utterance, act) or self._insert(utterance, act)
        if found is None:
            found = self._begin(utterance, move)
            found.act = act
        return found

    def _say_again(self, utterance: Utterance, act: DialogueAct) -> Exchange | None:
        """Returns the open, unanswered exchange whose initiating act equals `act`."""
        last = self.exchanges[-1] if self.exchanges else None
        if last is None or last.state is not ExchangeState.OPEN or last.taken_up:
            return None
        same = last.initiator is utterance.speaker and last.act == act
        return last if same and utterance.start - last.end <= self.patience else None

    def _insert(self, utterance: Utterance, act: DialogueAct) -> Exchange | None:
        """Returns the open exchange that an initiating act continues, or None."""
        for exchange in self._recent():
            waited = utterance.start - exchange.end
            if exchange.state is not ExchangeState.OPEN or exchange.unprompted or not 0.0 <= waited <= self.patience:
                continue
            own = exchange.initiator is utterance.speaker
            if own and (exchange.asked_back or exchange.confused):
                if act.move is DialogueMove.EXPLAIN or exchange.names(utterance.speaker, _names(act)):
                    exchange.asked_back = exchange.confused = False
                    return exchange
            elif not own and (act.move in _INSERTED.get(exchange.move, ()) or exchange.is_informed_by(act.move)):
                if exchange.move is not DialogueMove.INSTRUCT:
                    self._close(exchange, ExchangeState.FULFILLED)
                else:
                    exchange.asked_back = True
                return exchange
        return None

    def _respond(self, utterance: Utterance, act: DialogueAct) -> Exchange | None:
        move = act.move
        exchange = self._named(utterance, act) or self._awaiting(utterance, move)
        if exchange is not None:
            self._settle(exchange, utterance.speaker, move)
            return exchange
        last = self.exchanges[-1] if self.exchanges else None
        recent = last is not None and utterance.start - last.end <= self.patience
        if move is DialogueMove.IRRELEVANT:
            return last if recent else None
        if last is not None:  # late, but no other exchange exists
            return last
        exchange = self._begin(utterance, move)
        exchange.unprompted = True
        self._close(exchange, ExchangeState.FULFILLED)
        return exchange

    def _named(self, utterance: Utterance, act: DialogueAct) -> Exchange | None:
        """Returns the latest exchange, open or closed, whose initiator named a value of `act`."""
        values = _names(act) if act.move in _GROUNDING else frozenset()
        for exchange in self._recent() if values else ():
            in_time = utterance.start - exchange.end <= self.patience
            if in_time and exchange.initiator is not utterance.speaker and exchange.names(exchange.initiator, values):
                return exchange if exchange.accepts(utterance.speaker, act.move) else None
        return None

    def _awaiting(self, utterance: Utterance, move: DialogueMove) -> Exchange | None:
        """Returns the latest exchange that accepts `move` and had not timed out at the start of the utterance."""
        for exchange in self._recent():
            # `tick` may have abandoned the exchange while the answer was being spoken: the start time decides.
            in_time = utterance.start - exchange.end <= self.patience
            if exchange.state is not ExchangeState.FULFILLED and in_time and exchange.accepts(utterance.speaker, move):
                return exchange
        return None

    def _settle(self, exchange: Exchange, speaker: Role, move: DialogueMove) -> None:
        if move is DialogueMove.CONFUSE:
            exchange.confused = True
        elif speaker is exchange.initiator and exchange.confused:
            exchange.confused = False
        else:
            exchange.confused = False
            self._close(exchange, ExchangeState.FULFILLED)
            return
        exchange.state = ExchangeState.OPEN
        self._waiting[exchange.id] = exchange

    def _close(self, exchange: Exchange, state: ExchangeState) -> None:
        exchange.state = state
        self._waiting.pop(exchange.id, None)

    def _begin(self, utterance: Utterance, move: DialogueMove) -> Exchange:
        exchange = Exchange(len(self.exchanges), utterance.speaker, move, utterance.start, utterance.end)
        self.exchanges.append(exchange)
        self._waiting[exchange.id] = exchange
        return exchange


def _names(act: DialogueAct) -> frozenset[SlotValue]:
    """Returns the slot values that are names."""
    return frozenset(value for value in act.slots if value.label not in _OPEN_LABELS)
