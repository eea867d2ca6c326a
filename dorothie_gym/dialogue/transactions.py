"""Transaction units: all utterances on one goal (paper, section 4.1 and appendix B.3), and the unit annotator.

The rules use utterances and arrivals only, so that a live session and its recording are annotated alike:

1. An act targets a landmark if the landmark is a goal and the act commands, asks, checks, or mentions a status. Among
   several targets in one utterance, the last one without a finished or pending status counts.
2. An act with a target continues the transaction of that landmark, or starts one. This includes pending goals (Pending)
   and finished goals (Complete, Abandoned), which do not replace the current transaction. Where several goals bear the
   name of the landmark, such as two houses, a name after the end of the last one refers to the next of them.
3. An act without a target belongs to the transaction of its exchange, otherwise to the current transaction.
4. A transaction ends when its landmark is reached or abandoned. The next command, or question for the next goal, starts
   another transaction, whose landmark is None until one is named.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeGuard

from dorothie_gym.dialogue.exchanges import Exchange, ExchangeTracker
from dorothie_gym.ontology.dialogue_acts import DialogueAct, DialogueMove
from dorothie_gym.ontology.slots import GoalStatus, LandmarkName, Slot

if TYPE_CHECKING:
    from dorothie_gym.dialogue.conversation import Utterance

_AIMING = frozenset(
    {DialogueMove.INSTRUCT, DialogueMove.CHECK, DialogueMove.QUERY_W, DialogueMove.QUERY_YN, DialogueMove.REPLY_W}
)
_NO_GOALS = frozenset({LandmarkName.UNKNOWN, LandmarkName.QUERIED})
_OVER = frozenset({GoalStatus.COMPLETE, GoalStatus.ABANDONED})
_ASIDE = _OVER | {GoalStatus.PENDING}


@dataclass
class Transaction:
    """Transaction unit: the dialogue on one goal.

    Attributes:
        id: index in order of start, from 0.
        landmark: the goal, None until named.
        over: whether the goal was reached or abandoned.
    """

    id: int
    landmark: LandmarkName | None = None
    over: bool = False


class TransactionTracker:
    """Assigns delivered utterances to transactions."""

    def __init__(self, goals: Iterable[LandmarkName]) -> None:
        """Creates an empty tracker.

        Args:
            goals: landmarks of the subgoals, including those that may be added later.
        """
        self.transactions: list[Transaction] = []
        self._goals = Counter(goal for goal in goals if goal not in _NO_GOALS)
        self._current: Transaction | None = None
        self._by_exchange: dict[int, Transaction] = {}

    def update(self, utterance: Utterance, exchanges: tuple[int | None, ...]) -> int:
        """Assigns a delivered utterance to a transaction.

        Args:
            utterance: delivered utterance; calls follow the order of delivery.
            exchanges: exchange id of each act, None for acts outside all exchanges.

        Returns:
            Id of the transaction.
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
        """Processes a change of a subgoal: adds its landmark to the goals, or ends its transaction."""
        if landmark in _NO_GOALS:
            return
        self._goals[landmark] = max(self._goals[landmark], 1)
        found = self._of(landmark)
        if found is not None and status in _OVER:
            found.over = True
        elif found is None and status is GoalStatus.COMPLETE and self._is_anonymous(self._current):
            self._current.landmark, self._current.over = landmark, True

    def _aim(self, acts: tuple[DialogueAct, ...]) -> tuple[LandmarkName, GoalStatus | None] | None:
        """Returns the goal that an utterance targets and the mentioned status; None without a target."""
        found: tuple[LandmarkName, GoalStatus | None] | None = None
        for act in acts:
            named = [value for value in act.values(Slot.LANDMARK) if isinstance(value, LandmarkName)]
            named = [name for name in named if name not in _NO_GOALS]
            statuses = [value for value in act.values(Slot.STATUS) if isinstance(value, GoalStatus)]
            if not named or not (statuses or self._may_aim(act.move)):
                continue
            goals = [name for name in named if name in self._goals]
            # "Not this one but that one" names two goals: the one without a transaction is the new one.
            fresh = [name for name in goals if self._of(name) is None or self._is_next_of_its_name(name)]
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
        again = status not in _OVER and self._is_next_of_its_name(landmark)
        transaction = None if again else self._of(landmark)
        current = self._current
        if transaction is None and self._is_anonymous(current) and status not in _ASIDE:
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
        """Returns the latest transaction of a landmark."""
        return next((each for each in reversed(self.transactions) if each.landmark is landmark), None)

    def _is_next_of_its_name(self, landmark: LandmarkName) -> bool:
        """Returns whether the goals with a name discussed so far have ended, and there is another one."""
        known = [each for each in self.transactions if each.landmark is landmark]
        return bool(known) and all(each.over for each in known) and len(known) < self._goals[landmark]

    def _begin(self, landmark: LandmarkName | None) -> Transaction:
        self.transactions.append(Transaction(len(self.transactions), landmark))
        return self.transactions[-1]

    @staticmethod
    def _is_anonymous(transaction: Transaction | None) -> TypeGuard[Transaction]:
        return transaction is not None and transaction.landmark is None and not transaction.over


def _begins(act: DialogueAct) -> bool:
    """Returns whether an act asks for the next goal or gives a command."""
    asks = act.move is DialogueMove.QUERY_W and LandmarkName.QUERIED in act.slots
    return asks or act.move is DialogueMove.INSTRUCT


class Annotator:
    """Annotates a conversation with exchange and transaction units (paper, section 4.1).

    Live sessions and recordings are annotated by the same rules.

    Attributes:
        exchanges: exchanges so far, by id.
        transactions: transactions so far, by id.
    """

    def __init__(self, goals: Iterable[LandmarkName]) -> None:
        """Creates an annotator without units.

        Args:
            goals: landmarks of the subgoals, including those that may be added later.
        """
        self._exchanges, self._transactions = ExchangeTracker(), TransactionTracker(goals)
        self.exchanges: list[Exchange] = self._exchanges.exchanges
        self.transactions: list[Transaction] = self._transactions.transactions

    def update(self, utterance: Utterance) -> tuple[tuple[int | None, ...], int]:
        """Annotates a delivered utterance.

        Args:
            utterance: delivered utterance; calls follow the order of delivery.

        Returns:
            Exchange id of each act (None for irrelevant talk outside all exchanges), and the transaction id.
        """
        exchanges = self._exchanges.update(utterance)
        return exchanges, self._transactions.update(utterance, exchanges)

    def note(self, landmark: LandmarkName, status: GoalStatus) -> None:
        """Processes a change of a subgoal, see `TransactionTracker.note`."""
        self._transactions.note(landmark, status)

    def tick(self, now: float) -> None:
        """Closes exchanges without a timely answer at `now` [s]."""
        self._exchanges.tick(now)
