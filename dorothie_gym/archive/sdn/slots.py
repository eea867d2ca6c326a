"""Slots of SDN's dialogue moves: texts, numbers, assets and objects, in lists or alone."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from dorothie_gym.archive.sdn.files import JsonObject, plain, whole_of
from dorothie_gym.archive.sdn.landmark_names import landmark_name
from dorothie_gym.errors import OntologyError
from dorothie_gym.ontology.labelled_enums import normalise
from dorothie_gym.ontology.slots import SLOT_VALUES, Slot, SlotValue
from dorothie_gym.ontology.spellings import parse_slot, parse_slot_value
from dorothie_gym.session.recording.validation import ReadReport

_ACT: Final = "act"
_OWN_VALUE: Final = ("asset", "name", "val", "value")
"""Fields of an object that contain the value of its slot."""

_BETWEEN: Final = re.compile(r"[,;|/]")

MAX_OBJECT_DEPTH: Final = 4
"""Deepest nesting of objects in a slot value that is read."""

LEFT_OUT: Final = "slots_left_out"
"""Field of an act with the slot values outside the ontology."""


@dataclass
class SlotReader:
    """Reads the slots of one act.

    Attributes:
        report: receives the values outside the ontology.
        found: labels of the known values, by label of their slot.
        left: other values, by name of their slot.
    """

    report: ReadReport
    found: dict[str, list[str]] = field(default_factory=lambda: defaultdict(list))
    left: dict[str, list[object]] = field(default_factory=lambda: defaultdict(list))

    def read(self, slots: object) -> None:
        """Reads the slots of a release act: an object with the values of each slot, or a list of such objects."""
        for item in slots if isinstance(slots, list) else [slots]:
            if isinstance(item, Mapping):
                self._object(None, item, MAX_OBJECT_DEPTH)
            elif not _is_blank(item):
                self._leave(None, item)

    def read_pair(self, types: object, values: object) -> None:
        """Reads slots of the sample layout: one type and value, or lists of both."""
        names = types if isinstance(types, list) else [types]
        if len(names) == 1:
            self._slot(names[0], values, MAX_OBJECT_DEPTH)
        elif isinstance(values, Mapping):
            self._object(None, values, MAX_OBJECT_DEPTH)
            for name in names:
                self._note_without_value(name)
        else:
            given = values if isinstance(values, list) else [values]
            for k, name in enumerate(names):
                self._slot(name, given[k] if k < len(given) else None, MAX_OBJECT_DEPTH)
            for value in given[len(names) :]:
                self._leave(None, value)

    def _slot(self, name: object, value: object, depth: int) -> None:
        """Reads the values of a slot, given by its name in the file."""
        slot = _slot_of(name)
        if slot is None and not isinstance(value, Mapping):
            for item in value if isinstance(value, list) else [value]:
                if not _is_blank(item):
                    self._leave(name, item)
            return
        for item in value if isinstance(value, list) else [value]:
            if isinstance(item, Mapping):
                self._object(slot, item, depth - 1, name)
            elif slot is not None and not _is_blank(item):
                self._value(slot, item)
        self._note_without_value(name)

    def _object(self, slot: Slot | None, values: JsonObject, depth: int, name: object = None) -> None:
        """Reads an object in the place of a slot value, such as {"act": "JTurn"} or {"asset": "null.house"}."""
        if depth <= 0:
            self._leave(name, values)
            return
        own = [key for key in _OWN_VALUE if not _is_blank(values.get(key))]
        if "slot_val" in values and "slot_type" not in values:
            own.append("slot_val")
        if own and slot is not None:
            value: object = values[own[0]]
            if slot is Slot.LANDMARK:
                value = next((values[key] for key in own if _known(slot, values[key])), value)
            self._slot(slot.label, value, depth)
        for key, value in values.items():
            if key == "slot_type":
                self._nested(value, values.get("slot_val"), depth)
            elif key == _ACT and not isinstance(value, Mapping):
                self._slot(Slot.ACTION.label, value, depth)
            elif _slot_of(key) is not None:
                self._slot(key, value, depth)
            elif key in own and slot is not None:
                continue
            elif (key != "slot_val" or "slot_type" not in values) and not _is_blank(value):
                if slot is None:
                    self._slot(key, value, depth - 1)
                else:
                    self._leave(f"{slot.label}.{key}", value)

    def _nested(self, types: object, values: object, depth: int) -> None:
        """Reads the slot that an object names in `slot_type` and `slot_val`."""
        names = types if isinstance(types, list) else [types]
        given = values if isinstance(values, list) and len(names) > 1 else [values]
        for k, name in enumerate(names):
            self._slot(name, given[k] if k < len(given) else None, depth - 1)

    def _value(self, slot: Slot, value: object) -> None:
        known = _known(slot, value)
        if known is None and isinstance(value, str):
            parts = [_known(slot, part) for part in _BETWEEN.split(value.strip("[]()")) if not _is_blank(part)]
            if len(parts) > 1 and None not in parts:
                self.found[slot.label] += [part.label for part in parts if part is not None]
                return
        if known is None:
            self._leave(slot.label, value)
        else:
            self.found[slot.label].append(known.label)

    def _note_without_value(self, name: object) -> None:
        """Reads a slot without a known value as one whose value is unknown, so that the slot itself is kept."""
        slot = _slot_of(name)
        if slot is None or slot.label in self.found:
            return
        unknown = SLOT_VALUES[slot][0].label
        self.found[slot.label].append(unknown)
        if slot.label not in self.left:
            self.report.repair(f"slot {slot.label} without a value was read as {unknown}")

    def _leave(self, name: object, value: object) -> None:
        shown = "(no slot)" if _is_blank(name) else str(plain(str(name)))[:40]
        self.report.keep(f"slot value {shown}={str(plain(value))[:40]} (left out)")
        self.left[shown].append(plain(value))


def _slot_of(name: object) -> Slot | None:
    """Returns the slot for a name in a file; None for Null and for unknown names."""
    try:
        slot = parse_slot(name) if isinstance(name, str) else Slot.NULL
    except OntologyError:
        return None
    return None if slot is Slot.NULL else slot


def _known(slot: Slot, value: object) -> SlotValue | None:
    """Returns the slot value of a text, or of its number in SDN; None for others."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        number = whole_of(value)
        known = SLOT_VALUES[slot]
        return known[number] if number is not None and 0 <= number < len(known) else None
    if not isinstance(value, str):
        return None
    try:
        return parse_slot_value(slot, value)
    except OntologyError:
        pass
    try:
        return landmark_name(value) if slot is Slot.LANDMARK else parse_slot_value(slot, value.rpartition(".")[2])
    except OntologyError:
        return None


def _is_blank(value: object) -> bool:
    return value is None or value in ([], {}) or (isinstance(value, str) and normalise(value) in ("", "null", "none"))
