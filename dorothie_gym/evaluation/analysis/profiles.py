"""Profiles of moves and slots per transaction and per exchange (figures 3 to 5 of the paper)."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from dorothie_gym.evaluation.analysis.exception_attribution import Handled, handling
from dorothie_gym.ontology.dialogue_acts import DialogueMove, MoveGroup
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import Slot

if TYPE_CHECKING:
    from dorothie_gym.evaluation.analysis.units import SaidUnit, Units

    pass


SLOTS: Final = (Slot.ACTION, Slot.STREET, Slot.LANDMARK, Slot.STATUS, Slot.OBJECT)

CLASSES: Final = {
    "Instruct": (DialogueMove.INSTRUCT,),
    "Explain": (DialogueMove.EXPLAIN,),
    "Ask": MoveGroup.ASK.moves,
    "Communicate": MoveGroup.COMMUNICATE.moves,
    "Inform": MoveGroup.INFORM.moves,
}
"""Classes of moves by which exchanges are compared (spec of the ontology, decision tree)."""


@dataclass
class Profile:
    """Counts of moves and slots in units.

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
        """Returns the mean number of a speaker's acts with one of the moves in a unit; 0 without units."""
        return sum(self.moves[speaker, move] for move in moves) / max(self.units, 1)

    def mean_slot(self, speaker: Role, slot: Slot) -> float:
        """Returns the mean number of a slot's values that a speaker mentions in a unit; 0 without units."""
        return self.slots[speaker, slot] / max(self.units, 1)


@dataclass
class Profiles:
    """Profiles of a corpus: of its transactions, and of its exchanges by the kind of exception that they handle."""

    transactions: Profile = field(default_factory=Profile)
    exchanges: dict[Handled, Profile] = field(default_factory=lambda: {kind: Profile() for kind in Handled})

    def add(self, units: Units) -> None:
        """Counts the units of a session."""
        for transaction in units.transactions:
            self.transactions.add(transaction)
        kinds = handling(units)
        for exchange in units.exchanges:
            self.exchanges[kinds[exchange.id]].add(exchange)


def counted(count: int, noun: str) -> str:
    """Returns a number with its noun, in the plural if needed."""
    return f"{count:,} {noun}{'' if count == 1 else 's'}"
