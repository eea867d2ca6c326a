"""The label vector: one place for each value of each slot, in SDN's order.

SDN puts Status before Landmark in the vector, although Landmark has the smaller slot id.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping
from types import MappingProxyType

from dorothie_gym.ontology.errors import OntologyError
from dorothie_gym.ontology.slots import SLOT_VALUES, Slot, SlotValue

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
