"""Exceptions of the Ad-Wizard in words, for the terminal and for pictures."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from dorothie_gym.ontology.spellings import parse_landmark
from dorothie_gym.tasks.catalogue import map_label


def exception_words(data: Mapping[str, Any]) -> str:
    """Returns an exception from the data of its event, such as "place prop: cones on the road".

    Recordings of other programs may lack details; the kind is then returned alone.
    """
    kind = str(data.get("kind", "exception"))
    try:
        detail = _DETAILS.get(kind, _landmark)(data)
    except (KeyError, TypeError, ValueError):
        return kind.replace("_", " ")
    return f"{kind.replace('_', ' ')}: {detail}"


def _landmark(data: Mapping[str, Any]) -> str:
    return map_label(parse_landmark(str(data["landmark"])))


_DETAILS: Mapping[str, Callable[[Mapping[str, Any]], str]] = {
    "weather": lambda data: f"{data['parameter']} becomes {data['value']:g}",
    "spawn_vehicles": lambda data: f"{data['count']} appear",
    "spawn_pedestrians": lambda data: f"{data['count']} appear",
    "place_prop": lambda data: f"{data['prop']} on the road",
    "move_prop": lambda data: f"{data['prop']} stands elsewhere",
    "delete_prop": lambda data: f"{data['prop']} is gone",
    "sensor_fault": lambda data: f"{data['sensor']} {'begins' if data['on'] else 'is over'}",
}
