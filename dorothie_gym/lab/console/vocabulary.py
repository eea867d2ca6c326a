"""Vocabularies that browsers show: labels of moves, slots, actions, landmarks, weather, props and sensors."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from dorothie_gym.ontology.dialogue_acts import DialogueMove, path_to
from dorothie_gym.ontology.slots import SLOT_VALUES, GoalStatus, LandmarkName, Slot
from dorothie_gym.ontology.world_exceptions import PropKind, Sensor, WeatherParameter
from dorothie_gym.tasks.catalogue import catalogue


@lru_cache(maxsize=1)
def vocabulary() -> dict[str, Any]:
    """Returns all vocabularies in JSON types."""
    special = (LandmarkName.UNKNOWN, LandmarkName.QUERIED)
    return {
        "moves": [[move.label, path_to(move)[-1][1].label] for move in DialogueMove],
        "slots": {
            slot.label: [value.label for value in values]
            for slot, values in SLOT_VALUES.items()
            if slot is not Slot.NULL
        },
        "landmarks": [name.label for name in LandmarkName if name not in special],
        "several": [name.label for name, kind in catalogue().items() if kind.repeatable],
        "statuses": [status.label for status in GoalStatus if status not in (GoalStatus.UNKNOWN, GoalStatus.QUERIED)],
        "weather": [[each.value, each.low, each.high, each.unit] for each in WeatherParameter],
        "props": [prop.value for prop in PropKind],
        "sensors": [sensor.value for sensor in Sensor],
    }
