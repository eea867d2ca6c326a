"""View of a role in the words of a prompt: range of sight with its cause, and the nearest objects."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from dorothie_gym.ontology.world_exceptions import Sensor
from dorothie_gym.policies.observation_parser import read_objects
from dorothie_gym.policies.view_range import FAR_SIGHT, Limit, camera_fault, limit_of, sight
from dorothie_gym.session.spaces.observations import ObjectColumn

if TYPE_CHECKING:
    from dorothie_gym.policies.observation_parser import SeenObject
    from dorothie_gym.session.spaces.observations import ObservationMapping

SHOWN_OBJECTS: Final = 6
"""Number of objects in sight that a prompt shows."""

AHEAD_WITHIN: Final = 20.0
"""Bearing up to which an object is ahead [degrees]."""

BEHIND_BEYOND: Final = 120.0
"""Bearing from which an object is behind [degrees]."""

_SIGHT_STEP: Final = 10
_CAUSES: Final = {Limit.FOG: "fog", Limit.RAIN: "rain", Limit.NIGHT: "darkness"}
_CAMERA: Final = {
    Sensor.VIEW: "the camera of the car shows no picture",
    Sensor.BLUR: "the camera of the car shows less than the weather explains",
}


def sight_lines(observation: ObservationMapping) -> list[str]:
    """Returns the line of a view that is not far; none for a far one.

    Args:
        observation: observation of the participant or the Co-Wizard.
    """
    seen, fault = sight(observation), camera_fault(observation)
    if fault is None and seen >= FAR_SIGHT:
        return []
    limit = limit_of(observation)
    cause = _CAMERA[fault] if fault is not None else "" if limit is None else _CAUSES[limit]
    metres = max(_SIGHT_STEP * round(seen / _SIGHT_STEP), _SIGHT_STEP)
    return [f"Sight: about {metres} m" + (f"; {cause}" if cause else "")]


def object_lines(observation: ObservationMapping) -> list[str]:
    """Returns the nearest objects in sight with distance and direction, a line each."""
    bearings = [row[ObjectColumn.BEARING] for row in observation["objects"].tolist() if row[ObjectColumn.KIND]]
    lines = []
    for thing, bearing in list(zip(read_objects(observation), bearings, strict=True))[:SHOWN_OBJECTS]:
        lines.append(f"- {object_name(thing)}, {thing.distance:.0f} m away, {_where(math.degrees(bearing))}")
    return lines


def object_name(thing: SeenObject) -> str:
    """Returns the name of an object: its class, or its kind if it is a prop."""
    return thing.kind.label if thing.prop is None else thing.prop.name.lower().replace("_", " ")


def _where(bearing: float) -> str:
    """Returns the direction of a bearing, clockwise from the heading of the car [degrees]."""
    if abs(bearing) <= AHEAD_WITHIN:
        return "ahead"
    if abs(bearing) >= BEHIND_BEYOND:
        return "behind"
    return "to the right" if bearing > 0.0 else "to the left"
