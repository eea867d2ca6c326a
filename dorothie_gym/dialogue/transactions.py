"""Transaction units: everything that is said about one goal (paper, section 4.1 and appendix B.3).

The rule, over utterances and arrivals only, so that it can be applied while a session runs and again to its recording:

1. An act aims at a landmark if it names one that is a goal, and commands, asks or checks, or speaks of a status. Of
   several in one utterance, one that is not spoken of as over or as for later counts, the last of those.
2. Who aims at a landmark continues its transaction, or begins one. Talk of what is to be done later (Pending) or is
   over (Complete, Abandoned) is of that transaction too, and leaves open the one that is going on.
3. What aims at nothing belongs where the exchange that it is in belongs, else to what is going on.
4. A transaction is over when its landmark is reached or given up. A command, or the question where to go, then begins
   another, which has no landmark until one is named.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from dorothie_gym.dialogue.conversation import Utterance
from dorothie_gym.dialogue.exchanges import Exchange, ExchangeTracker
from dorothie_gym.ontology import DialogueAct, DialogueMove, GoalStatus, LandmarkName, Slot

_AIMING = frozenset(
    {DialogueMove.INSTRUCT, DialogueMove.CHECK, DialogueMove.QUERY_W, DialogueMove.QUERY_YN, DialogueMove.REPLY_W}
)
_NO_GOALS = frozenset({LandmarkName.UNKNOWN, LandmarkName.QUERIED})
_OVER = frozenset({GoalStatus.COMPLETE, GoalStatus.ABANDONED})
_ASIDE = _OVER | {GoalStatus.PENDING}


@dataclass
class Transaction:
    """What is said about one goal.

    Attributes:
        id: counts from 0 in order of beginning.
        landmark: the goal, None until it is named.
        over: whether the goal was reached or given up.
    """

    id: int
    landmark: LandmarkName | None = None
    over: bool = False


class TransactionTracker:
    """Assigns each utterance to a transaction, as utterances are delivered."""

    def __init__(self, goals: Iterable[LandmarkName]) -> None:
        """Starts in silence.

        Args:
            goals: landmarks of the subgoals, those that may be added later included.
        """
        self.transactions: list[Transaction] = []
        self._goals = set(goals) - _NO_GOALS
        self._current: Transaction | None = None
        self._by_exchange: dict[int, Transaction] = {}

    def update(self, utterance: Utterance, exchanges: tuple[int | None, ...]) -> int:
        """Places a delivered utterance.

        Args:
            utterance: heard to its end; utterances come in the order of delivery.
            exchanges: id of the exchange of each of its acts, None for one that is in none.

        Returns:
            The id of its transaction.
        """
        aim = self._aim(utterance.acts)
        placed = tuple(exchange for exchange in exchanges if exchange is not None)
        if aim is None:
            transaction = self._unaimed(utterance.acts, placed)
        else:
            transaction = self._aimed(*aim)
        for exchange in placed:
            self._by_exchange.setdefault(exchange, transaction)
        return transaction.id

    def note(self, landmark: LandmarkName, status: GoalStatus) -> None:
        """Takes in that a subgoal changed: its landmark is a goal from now on, or is over."""
        if landmark in _NO_GOALS:
            return
        self._goals.add(landmark)
        found = self._of(landmark)
        if found is not None and status in _OVER:
            found.over = True
        elif found is None and status is GoalStatus.COMPLETE and self._is_anonymous(self._current):
            assert self._current is not None
            self._current.landmark, self._current.over = landmark, True

    def _aim(self, acts: tuple[DialogueAct, ...]) -> tuple[LandmarkName, GoalStatus | None] | None:
        """The goal that an utterance aims at, and what it says of its status."""
        found: tuple[LandmarkName, GoalStatus | None] | None = None
        for act in acts:
            named = [value for value in act.values(Slot.LANDMARK) if isinstance(value, LandmarkName)]
            named = [name for name in named if name not in _NO_GOALS]
            statuses = [value for value in act.values(Slot.STATUS) if isinstance(value, GoalStatus)]
            if not named or not (statuses or self._may_aim(act.move)):
                continue
            goals = [name for name in named if name in self._goals]
            # "Not this one but that one" names two: the one that nothing was said about yet is the new one.
            fresh = [name for name in goals if self._of(name) is None]
            if goals:
                status = next((status for status in statuses if status not in _ASIDE), None)
                if status is None and statuses and len(goals) == 1:
                    status = statuses[0]
                if found is None or status not in _ASIDE or found[1] in _ASIDE:
                    found = (fresh or goals)[-1], status
        return found

    def _may_aim(self, move: DialogueMove) -> bool:
        if move is DialogueMove.REPLY_W:
            return self._current is None or self._current.over or self._is_anonymous(self._current)
        return move in _AIMING

    def _aimed(self, landmark: LandmarkName, status: GoalStatus | None) -> Transaction:
        transaction = self._of(landmark)
        current = self._current
        if transaction is None and self._is_anonymous(current) and status not in _ASIDE:
            assert current is not None
            transaction = current
            transaction.landmark = landmark
        elif transaction is None:
            transaction = self._begin(landmark)
        transaction.over = status in _OVER
        if current is None or current.over or status not in _ASIDE:
            self._current = transaction
        return transaction

    def _unaimed(self, acts: tuple[DialogueAct, ...], exchanges: tuple[int, ...]) -> Transaction:
        known = next((self._by_exchange[k] for k in exchanges if k in self._by_exchange), None)
        current = self._current
        if current is not None and current.over and any(_begins(act) for act in acts):
            self._current = current = self._begin(None)
        elif known is not None:
            return known
        if current is None:
            self._current = current = self._begin(None)
        return current

    def _of(self, landmark: LandmarkName) -> Transaction | None:
        return next((each for each in self.transactions if each.landmark is landmark), None)

    def _begin(self, landmark: LandmarkName | None) -> Transaction:
        self.transactions.append(Transaction(len(self.transactions), landmark))
        return self.transactions[-1]

    @staticmethod
    def _is_anonymous(transaction: Transaction | None) -> bool:
        return transaction is not None and transaction.landmark is None and not transaction.over


def _begins(act: DialogueAct) -> bool:
    """Whether an act asks for, or commands, something further."""
    asks = act.move is DialogueMove.QUERY_W and LandmarkName.QUERIED in act.slots
    return asks or act.move is DialogueMove.INSTRUCT


class Annotator:
    """Numbers the exchange units and transaction units of a conversation (paper, section 4.1).

    Attributes:
        exchanges: all so far, by number.
        transactions: all so far, by number.
    """

    def __init__(self, goals: Iterable[LandmarkName]) -> None:
        """Starts in silence.

        Args:
            goals: landmarks of the subgoals, those that may be added later included.
        """
        self._exchanges, self._transactions = ExchangeTracker(), TransactionTracker(goals)
        self.exchanges: list[Exchange] = self._exchanges.exchanges
        self.transactions: list[Transaction] = self._transactions.transactions

    def update(self, utterance: Utterance) -> tuple[tuple[int | None, ...], int]:
        """Places a delivered utterance.

        Args:
            utterance: heard to its end; utterances come in the order of delivery.

        Returns:
            The exchange of each act, None for irrelevant talk outside of any, and the transaction.
        """
        exchanges = self._exchanges.update(utterance)
        return exchanges, self._transactions.update(utterance, exchanges)

    def note(self, landmark: LandmarkName, status: GoalStatus) -> None:
        """Takes in that a subgoal changed, see `TransactionTracker.note`."""
        self._transactions.note(landmark, status)

    def tick(self, now: float) -> None:
        """Abandons the exchanges that have waited too long at `now` [s]."""
        self._exchanges.tick(now)
