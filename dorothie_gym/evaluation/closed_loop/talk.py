"""What the dialogue of a session cost: exchanges, utterances, repairs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Final

from dorothie_gym.dialogue.exchanges import ExchangeState
from dorothie_gym.ontology import DialogueMove
from dorothie_gym.sessions import Session
from dorothie_gym.sessions.statistics.units import Units

CLARIFICATIONS: Final = frozenset({DialogueMove.CONFUSE, DialogueMove.CLARIFY, DialogueMove.CHECK})
"""Moves that repair or make sure (spec: metrics)."""


@dataclass(frozen=True, kw_only=True)
class TalkRecord:
    """Counts of a session's dialogue.

    Attributes:
        utterances: of participant and Co-Wizard.
        exchanges: found anew by the rule (`dialogue.ExchangeTracker`).
        abandoned: of these, those that were given up without an answer.
        clarifications: moves of `CLARIFICATIONS`.
    """

    utterances: int = 0
    exchanges: int = 0
    abandoned: int = 0
    clarifications: int = 0

    def to_json(self) -> dict[str, Any]:
        """Returns the fields."""
        return asdict(self)

    @classmethod
    def from_json(cls, row: Mapping[str, Any]) -> TalkRecord:
        """Reads what `to_json` returned."""
        return cls(**row)


def talk_of(session: Session) -> TalkRecord:
    """Returns the counts of a session."""
    units = Units(session)
    return TalkRecord(
        utterances=len(units.utterances),
        exchanges=len(units.exchanges),
        abandoned=sum(exchange.state is ExchangeState.ABANDONED for exchange in units.states.values()),
        clarifications=sum(
            move.act.move in CLARIFICATIONS for utterance in units.utterances for move in utterance.moves
        ),
    )
