"""Exchange units: from an initiating act to the fulfilment or abandonment of what it expects (paper, section 4)."""

from __future__ import annotations

import enum
import itertools
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from dorothie_gym.dialogue.conversation import Utterance
from dorothie_gym.ontology import ActionValue, DialogueAct, DialogueMove, Role, SlotValue

PATIENCE = 10.0
"""An exchange that nobody answers for this long is abandoned [s] (spec of the dialogue, phenomenon 21)."""

RECENT = 50
"""Exchanges that began after another one until nothing belongs to that any more: far more than patience allows."""

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
"""For each initiating move, the responses that fulfil it. Confuse answers any of them and fulfils none."""

_ASKING = frozenset({DialogueMove.CHECK, DialogueMove.QUERY_YN, DialogueMove.QUERY_W})

_INSERTED: Mapping[DialogueMove, frozenset[DialogueMove]] = MappingProxyType(
    {
        DialogueMove.INSTRUCT: frozenset({DialogueMove.CHECK, DialogueMove.EXPLAIN}),
        **{move: frozenset({DialogueMove.INSTRUCT, DialogueMove.EXPLAIN}) for move in _ASKING},
    }
)
"""For an open move, the initiating moves by which the other side goes on with it instead of beginning something new:
it checks or objects to what it is told to do, or answers a question by telling what to do or how things are."""

_GROUNDING = frozenset({DialogueMove.ACKNOWLEDGE, DialogueMove.CONFIRM})
"""Who takes something up by naming it again speaks of what named it."""

_UNKNOWN = ActionValue.UNKNOWN.label
"""In every slot the label of what a speaker does not know."""

_OPEN_LABELS = frozenset({_UNKNOWN, ActionValue.QUERIED.label})
"""Values that name nothing."""

_REPAIRS = frozenset({DialogueMove.CLARIFY, DialogueMove.CONFIRM, DialogueMove.REPLY_W})
"""What the initiator says after a Confuse to get the exchange going again."""


class ExchangeState(enum.StrEnum):
    """Where an exchange stands."""

    OPEN = "open"
    FULFILLED = "fulfilled"
    ABANDONED = "abandoned"


@dataclass
class Exchange:
    """One exchange unit.

    Attributes:
        id: counts from 0 in order of beginning.
        initiator: who opened it.
        move: the latest initiating move; of an unprompted exchange, the response it consists of.
        start: start of its first utterance [s].
        end: end of its last utterance [s].
        state: open, fulfilled or abandoned.
        unprompted: whether it began with a response that nothing had asked for, the first words of all.
        acts: number of acts in it.
        confused: whether the other side has not understood and the initiator has to repair.
        asked_back: whether the other side has checked, or objected to, what it was told: the initiator has to answer.
        act: the latest initiating act, of which `move` is the move.
        taken_up: whether the other side has said something in it.
        named: what was named in it, and by whom.
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
        """Returns whether `move` by `speaker` answers, or goes on with, this exchange."""
        if self.unprompted:
            return False
        if speaker is self.initiator:
            answers = self.asked_back and move in EXPECTATIONS[DialogueMove.CHECK]
            return answers or (self.confused and move in _REPAIRS)
        return move is DialogueMove.CONFUSE or move in EXPECTATIONS[self.move]

    def is_told(self, move: DialogueMove) -> bool:
        """Returns whether `move` by the other side tells what the initiator says is not known."""
        puzzles = self.act is not None and any(value.label == _UNKNOWN for value in self.act.slots)
        return puzzles and self.move is DialogueMove.EXPLAIN and move is DialogueMove.EXPLAIN

    def names(self, speaker: Role, values: Iterable[SlotValue]) -> bool:
        """Returns whether `speaker` has named one of the values in it."""
        return any((speaker, value) in self.named for value in values)


class ExchangeTracker:
    """Assigns each act to an exchange, as utterances are delivered.

    Initiating acts of one utterance share an exchange (a reason and the command it leads to are one initiative), and an
    Explain behind a response in the same breath elaborates on that response. Who is told to do something and asks back,
    or who is asked, or told that something is not known, and answers by a command or an explanation, goes on with the
    exchange that is open; so does who then explains or names the same once more, and who says the same again before
    there is an answer. Who acknowledges or confirms something by its name speaks of the latest exchange in which the
    other side has named it. Overlapping exchanges are allowed: what begins while the other still speaks is a new one.
    """

    def __init__(self, patience: float = PATIENCE) -> None:
        """Starts without exchanges.

        Args:
            patience: time without an answer after which an exchange is abandoned [s], positive.

        Raises:
            ValueError: if `patience` is not positive.
        """
        if patience <= 0:
            raise ValueError(f"patience must be positive, not {patience}")
        self.patience = patience
        self.exchanges: list[Exchange] = []
        self._waiting: dict[int, Exchange] = {}  # those that are open, by their ids

    def update(self, utterance: Utterance) -> tuple[int | None, ...]:
        """Places every act of a delivered utterance.

        Args:
            utterance: heard to its end; utterances come in the order of delivery.

        Returns:
            The id of an exchange for each act, in order; None for irrelevant talk outside of any.
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
        """Abandons the exchanges that have waited too long at `now` [s]; an Explain owed no answer and is fulfilled."""
        for exchange in list(self._waiting.values()):
            if now - exchange.end > self.patience:
                optional = exchange.move is DialogueMove.EXPLAIN and not exchange.confused
                self._close(exchange, ExchangeState.FULFILLED if optional else ExchangeState.ABANDONED)

    def open(self) -> list[Exchange]:
        """Returns the exchanges that still wait for an answer, oldest first."""
        return sorted(self._waiting.values(), key=lambda exchange: exchange.id)

    def _recent(self) -> Iterator[Exchange]:
        """Yields the exchanges that something may still belong to, latest first."""
        return itertools.islice(reversed(self.exchanges), RECENT)

    def _initiate(self, utterance: Utterance, act: DialogueAct, opened: Exchange | None) -> Exchange:
        move = act.move
        if opened is not None:
            # An Explain behind a question does not replace what the question expects.
            if move is not DialogueMove.EXPLAIN:
                opened.move, opened.act = move, act
            return opened
        found = self._say_again(utterance, act) or self._insert(utterance, act)
        if found is None:
            found = self._begin(utterance, move)
            found.act = act
        return found

    def _say_again(self, utterance: Utterance, act: DialogueAct) -> Exchange | None:
        """Returns the open exchange whose initiating act, which nobody has answered, an act says again."""
        last = self.exchanges[-1] if self.exchanges else None
        if last is None or last.state is not ExchangeState.OPEN or last.taken_up:
            return None
        same = last.initiator is utterance.speaker and last.act == act
        return last if same and utterance.start - last.end <= self.patience else None

    def _insert(self, utterance: Utterance, act: DialogueAct) -> Exchange | None:
        """Returns the open exchange that an initiating move goes on with, if there is one."""
        for exchange in self._recent():
            waited = utterance.start - exchange.end
            if exchange.state is not ExchangeState.OPEN or exchange.unprompted or not 0.0 <= waited <= self.patience:
                continue
            own = exchange.initiator is utterance.speaker
            if own and (exchange.asked_back or exchange.confused):
                if act.move is DialogueMove.EXPLAIN or exchange.names(utterance.speaker, _names(act)):
                    exchange.asked_back = exchange.confused = False
                    return exchange
            elif not own and (act.move in _INSERTED.get(exchange.move, ()) or exchange.is_told(act.move)):
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
        if last is not None:  # late, but there is nothing else that it could be about
            return last
        exchange = self._begin(utterance, move)
        exchange.unprompted = True
        self._close(exchange, ExchangeState.FULFILLED)
        return exchange

    def _named(self, utterance: Utterance, act: DialogueAct) -> Exchange | None:
        """Returns the latest exchange, answered or not, whose initiator named what an act takes up by its name."""
        values = _names(act) if act.move in _GROUNDING else frozenset()
        for exchange in self._recent() if values else ():
            in_time = utterance.start - exchange.end <= self.patience
            if in_time and exchange.initiator is not utterance.speaker and exchange.names(exchange.initiator, values):
                return exchange if exchange.accepts(utterance.speaker, act.move) else None
        return None

    def _awaiting(self, utterance: Utterance, move: DialogueMove) -> Exchange | None:
        """Returns the latest exchange that `move` fits and that was still alive when the utterance began."""
        for exchange in self._recent():
            # `tick` may have given an exchange up while its answer was already in the air: the start decides.
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
    """What an act names."""
    return frozenset(value for value in act.slots if value.label not in _OPEN_LABELS)
