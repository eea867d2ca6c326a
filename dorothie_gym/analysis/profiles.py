"""Figures 3 to 5 of the paper: moves and slots per transaction by speaker, and per exchange by kind of exception."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import Final

from dorothie_gym.analysis.exception_attribution import Handled, handling
from dorothie_gym.analysis.units import SPEAKERS, SaidUnit, Units
from dorothie_gym.ontology import DialogueMove, MoveGroup, Role, Slot

SLOTS: Final = (Slot.ACTION, Slot.STREET, Slot.LANDMARK, Slot.STATUS, Slot.OBJECT)

CLASSES: Final = {
    "Instruct": (DialogueMove.INSTRUCT,),
    "Explain": (DialogueMove.EXPLAIN,),
    "Ask": MoveGroup.ASK.moves,
    "Communicate": MoveGroup.COMMUNICATE.moves,
    "Inform": MoveGroup.INFORM.moves,
}
"""Classes of moves that exchanges are told apart by (spec of the ontology, decision tree)."""


@dataclass
class Profile:
    """How much of each move and slot units have.

    Attributes:
        units: number of units.
        moves: acts of each speaker by move.
        slots: slot values of each speaker by slot.
    """

    units: int = 0
    moves: Counter[tuple[Role, DialogueMove]] = field(default_factory=Counter)
    slots: Counter[tuple[Role, Slot]] = field(default_factory=Counter)

    def add(self, unit: SaidUnit) -> None:
        """Counts a unit."""
        self.units += 1
        for move in unit.moves:
            self.moves[move.speaker, move.act.move] += 1
            for value in move.act.slots:
                self.slots[move.speaker, value.slot] += 1

    def mean_move(self, speaker: Role, *moves: DialogueMove) -> float:
        """Mean number of acts of a speaker with one of the moves in a unit; 0 without units."""
        return sum(self.moves[speaker, move] for move in moves) / max(self.units, 1)

    def mean_slot(self, speaker: Role, slot: Slot) -> float:
        """Mean number of values of a slot that a speaker mentions in a unit; 0 without units."""
        return self.slots[speaker, slot] / max(self.units, 1)


@dataclass
class Profiles:
    """The profiles of a corpus: of its transactions, and of its exchanges by what they handle."""

    transactions: Profile = field(default_factory=Profile)
    exchanges: dict[Handled, Profile] = field(default_factory=lambda: {kind: Profile() for kind in Handled})

    def add(self, units: Units) -> None:
        """Counts the units of a session."""
        for transaction in units.transactions:
            self.transactions.add(transaction)
        kinds = handling(units)
        for exchange in units.exchanges:
            self.exchanges[kinds[exchange.id]].add(exchange)


__all__ = ["CLASSES", "SLOTS", "SPEAKERS", "Profile", "Profiles"]
