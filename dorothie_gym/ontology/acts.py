"""The dialogue act: a move and the slot values it carries."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Self

from dorothie_gym.ontology.errors import OntologyError
from dorothie_gym.ontology.labels import VECTOR_SLOTS, encode_slots, in_label_order
from dorothie_gym.ontology.moves import DialogueMove
from dorothie_gym.ontology.slots import Slot, SlotValue


@dataclass(frozen=True)
class DialogueAct:
    """What one span of an utterance does and what it is about.

    Attributes:
        move: the dialogue move.
        slots: the values it carries; a slot may have none, one or several.

    Raises:
        OntologyError: `move` is no DialogueMove, or `slots` is no frozenset of slot values.
    """

    move: DialogueMove
    slots: frozenset[SlotValue] = frozenset()

    def __post_init__(self) -> None:
        if not isinstance(self.move, DialogueMove):
            raise OntologyError(f"DialogueAct.move: {self.move!r} is no DialogueMove")
        if not isinstance(self.slots, frozenset):
            raise OntologyError(f"DialogueAct.slots: expected a frozenset, got {self.slots!r}; see DialogueAct.of")
        in_label_order(self.slots)

    @classmethod
    def of(cls, move: DialogueMove, *values: SlotValue) -> Self:
        """Returns the act of `move` that carries `values`."""
        return cls(move, frozenset(values))

    @property
    def ordered(self) -> tuple[SlotValue, ...]:
        """All values, in the order of the label vector."""
        return in_label_order(self.slots)

    @cached_property
    def vector(self) -> tuple[int, ...]:
        """The label vector (69,) of the values."""
        return encode_slots(self.slots)

    def values(self, slot: Slot) -> tuple[SlotValue, ...]:
        """Returns the values of `slot`, by id."""
        return tuple(value for value in self.ordered if value.slot is slot)

    def slot_labels(self) -> dict[str, list[str]]:
        """Returns {slot: [values]} in SDN's spelling, slots in vector order; `parse_act` reads it back."""
        labels = {slot.label: [value.label for value in self.values(slot)] for slot in VECTOR_SLOTS}
        return {slot: values for slot, values in labels.items() if values}

    def __str__(self) -> str:
        slots = ", ".join(f"{slot}={'+'.join(values)}" for slot, values in self.slot_labels().items())
        return f"{self.move.label}({slots})"
