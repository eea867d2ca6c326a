"""Dialogue moves, acts, units, and the label vector of slot values."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from types import MappingProxyType
from typing import Self

from dorothie_gym.ontology.slots import SLOT_VALUES, Slot, SlotValue
from dorothie_gym.ontology.vocabulary import LabelledInt, OntologyError


class DialogueMove(LabelledInt):
    """What a span of an utterance does to the talk; ids as in SDN (moves after Carletta et al. 1997)."""

    IRRELEVANT = 0, "Irrelevant"
    INSTRUCT = 1, "Instruct"
    EXPLAIN = 2, "Explain"
    ALIGN = 3, "Align"
    CHECK = 4, "Check"
    QUERY_YN = 5, "QueryYN"
    QUERY_W = 6, "QueryW"
    ACKNOWLEDGE = 7, "Acknowledge"
    CONFUSE = 8, "Confuse"
    CLARIFY = 9, "Clarify"
    CONFIRM = 10, "Confirm"
    REPLY_Y = 11, "ReplyY"
    REPLY_N = 12, "ReplyN"
    REPLY_U = 13, "ReplyU"
    REPLY_W = 14, "ReplyW"


VECTOR_SLOTS: tuple[Slot, ...] = (Slot.ACTION, Slot.STREET, Slot.STATUS, Slot.LANDMARK, Slot.OBJECT)
"""The slots in the order in which the vector holds them."""

LABELS: tuple[SlotValue, ...] = tuple(itertools.chain.from_iterable(SLOT_VALUES[slot] for slot in VECTOR_SLOTS))
"""The value that each of the 69 places of the vector stands for."""

LABEL_INDEX: Mapping[SlotValue, int] = MappingProxyType({value: index for index, value in enumerate(LABELS)})
"""The place of each value in the vector."""

SLOT_SPANS: Mapping[Slot, slice] = MappingProxyType(
    {slot: slice(LABEL_INDEX[SLOT_VALUES[slot][0]], LABEL_INDEX[SLOT_VALUES[slot][-1]] + 1) for slot in VECTOR_SLOTS}
)
"""The places of each slot's values in the vector; Null has none."""


def in_label_order(values: Iterable[SlotValue]) -> tuple[SlotValue, ...]:
    """Returns the distinct `values` in the order of the label vector.

    Raises:
        OntologyError: one of them is not a slot value.
    """
    given = tuple(values)
    for value in given:
        if not isinstance(value, SlotValue):
            raise OntologyError(f"slot value: {value!r} is none; give members of the slots' enums, as LandmarkName.KFC")
    return tuple(sorted(set(given), key=LABEL_INDEX.__getitem__))


def encode_slots(values: Iterable[SlotValue]) -> tuple[int, ...]:
    """Returns the label vector (69,) of 0 and 1 that marks `values`.

    Raises:
        OntologyError: one of the values is not a slot value.
    """
    vector = [0] * len(LABELS)
    for value in in_label_order(values):
        vector[LABEL_INDEX[value]] = 1
    return tuple(vector)


def decode_slots(vector: Iterable[int]) -> frozenset[SlotValue]:
    """Returns the values that a label vector (69,) of 0 and 1 marks; the inverse of `encode_slots`.

    Raises:
        OntologyError: the vector has another length, or an entry is neither 0 nor 1.
    """
    entries = tuple(vector)
    if len(entries) != len(LABELS):
        raise OntologyError(f"label vector: has {len(entries)} entries, expected {len(LABELS)}")
    for index, (entry, value) in enumerate(zip(entries, LABELS, strict=True)):
        if entry not in (0, 1):
            place = f"{index} ({value.slot.label}={value.label})"
            raise OntologyError(f"label vector: entry {place} is {entry!r}, expected 0 or 1")
    return frozenset(value for entry, value in zip(entries, LABELS, strict=True) if entry)


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


class UnitEnd(StrEnum):
    """How a dialogue unit ends."""

    COMPLETED = "completed"
    INTERRUPTED = "interrupted"
    FULFILLED = "fulfilled"
    ABANDONED = "abandoned"


class DialogueUnit(StrEnum):
    """A stretch of dialogue.

    A transaction is everything said about one subgoal; an exchange is what follows from one initiating utterance.
    Exchanges may overlap.
    """

    TRANSACTION = "transaction"
    EXCHANGE = "exchange"

    @property
    def ends(self) -> tuple[UnitEnd, ...]:
        """The ways in which the unit may end."""
        return _ENDS[self]


_ENDS: Mapping[DialogueUnit, tuple[UnitEnd, ...]] = MappingProxyType(
    {
        DialogueUnit.TRANSACTION: (UnitEnd.COMPLETED, UnitEnd.INTERRUPTED, UnitEnd.ABANDONED),
        DialogueUnit.EXCHANGE: (UnitEnd.FULFILLED, UnitEnd.ABANDONED),
    }
)
