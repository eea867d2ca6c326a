"""Table 2 of the paper for any sessions."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, Final

from dorothie_gym.ontology import Role
from dorothie_gym.sessions.folds import FOLDS, Fold
from dorothie_gym.sessions.session import Session
from dorothie_gym.sessions.statistics.actions import effective_actions
from dorothie_gym.sessions.statistics.units import Units
from dorothie_gym.sessions.statistics.words import plain, words_of

PAPER: Final[Mapping[str, float]] = MappingProxyType(
    {
        "sessions": 183,
        "control_hours": 18.7,
        "audio_hours": 2.9,
        "utterances": 8415,
        "words": 50398,
        "vocabulary": 1373,
        "transactions": 578,
        "exchanges": 4089,
        "moves": 11623,
        "slot_values": 8618,
        "physical_actions": 9448,
    }
)
"""Table 2 of the paper."""

PAPER_FOLDS: Final[Mapping[Fold, int]] = MappingProxyType(
    dict(zip(FOLDS, (123, 14, 6, 25, 15), strict=True)),
)
"""Sessions of each fold of the paper's corpus (table 2)."""


@dataclass
class Counts:
    """What is counted over sessions, one added after the other.

    Attributes:
        sessions: number of sessions.
        control_seconds: their length [s].
        audio_seconds: how long the participants spoke [s].
        transactions: units found by the rule of `dialogue.transactions`.
        exchanges: units found by the rule of `dialogue.exchanges`.
        moves: dialogue moves of participants and Co-Wizards.
        slot_values: values that these moves carry.
        physical_actions: of the Co-Wizards, that changed something.
        words: how often each word occurs.
        texts: how often each utterance occurs, without case and punctuation.
        folds: sessions by fold; those outside of folds are not in it.
    """

    sessions: int = 0
    control_seconds: float = 0.0
    audio_seconds: float = 0.0
    transactions: int = 0
    exchanges: int = 0
    moves: int = 0
    slot_values: int = 0
    physical_actions: int = 0
    words: Counter[str] = field(default_factory=Counter)
    texts: Counter[str] = field(default_factory=Counter)
    folds: Counter[Fold] = field(default_factory=Counter)

    def add(self, session: Session, units: Units, fold: Fold | None) -> None:
        """Counts a session."""
        self.sessions += 1
        self.control_seconds += session.duration
        self.transactions += len(units.transactions)
        self.exchanges += len(units.exchanges)
        self.physical_actions += sum(1 for _ in effective_actions(session))
        for utterance in units.utterances:
            self.texts[plain(utterance.text)] += 1
            self.words.update(words_of(utterance.text))
            self.moves += len(utterance.moves)
            self.slot_values += sum(len(move.act.slots) for move in utterance.moves)
        self.audio_seconds += _spoken_seconds(
            (utterance.start, utterance.end) for utterance in units.utterances if utterance.speaker is Role.PARTICIPANT
        )
        if fold is not None:
            self.folds[fold] += 1

    @property
    def utterances(self) -> int:
        """Number of utterances of participants and Co-Wizards."""
        return self.texts.total()

    def to_json(self) -> dict[str, Any]:
        """Returns the figures of the table; the ratio is None where nobody spoke."""
        return {
            "sessions": self.sessions,
            "control_hours": self.control_seconds / 3600,
            "audio_hours": self.audio_seconds / 3600,
            "utterances": self.utterances,
            "words": self.words.total(),
            "vocabulary": len(self.words),
            "transactions": self.transactions,
            "exchanges": self.exchanges,
            "moves": self.moves,
            "slot_values": self.slot_values,
            "physical_actions": self.physical_actions,
            "folds": {fold.value: self.folds[fold] for fold in Fold if self.folds[fold]},
            "distinct_utterance_ratio": len(self.texts) / self.utterances if self.utterances else None,
        }


def _spoken_seconds(stretches: Iterable[tuple[float, float]]) -> float:
    """Seconds in which somebody spoke: what overlaps counts once."""
    total, until = 0.0, 0.0
    for start, end in sorted(stretches):
        total += max(0.0, end - max(start, until))
        until = max(until, end)
    return total
