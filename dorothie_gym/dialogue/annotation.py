"""Exchange and transaction of every act, as utterances are heard: alike in a session and in its recording."""

from __future__ import annotations

from collections.abc import Iterable

from dorothie_gym.dialogue.exchanges import Exchange, ExchangeTracker
from dorothie_gym.dialogue.transactions import Transaction, TransactionTracker
from dorothie_gym.dialogue.utterances import Utterance
from dorothie_gym.ontology import GoalStatus, LandmarkName


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
