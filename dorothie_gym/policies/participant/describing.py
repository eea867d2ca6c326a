"""Where a place is that the car does not have on its map: its street, what is close to it, what stands there."""

from __future__ import annotations

import numpy as np

from dorothie_gym.dialogue import Wording
from dorothie_gym.ontology import DialogueMove, LandmarkName, ObjectClass, SlotValue, StreetName
from dorothie_gym.policies.participant.mind import ParticipantMind, View
from dorothie_gym.policies.scenery import SeenLandmark
from dorothie_gym.policies.speech import Remark, remark

GUIDES_AT_ONCE = 0.12
"""Chance that the way to a place that the car does not know is told from where it has been described."""

TELLS_LOOKS = 0.5
"""Chance that a place is described by what stands there, too."""

_FAMOUS = frozenset(LandmarkName) - {
    LandmarkName.HOUSE,
    LandmarkName.PERSON,
    LandmarkName.UNKNOWN,
    LandmarkName.QUERIED,
}

_FEATURES = (
    ObjectClass.BUILDING, ObjectClass.FENCE, ObjectClass.WALL, ObjectClass.POLE, ObjectClass.VEGETATION,
    ObjectClass.TRAFFIC_SIGN, ObjectClass.SIDE_WALK, ObjectClass.TERRAIN, ObjectClass.GROUND, ObjectClass.WATER,
    ObjectClass.BRIDGE, ObjectClass.GUARD_RAIL, ObjectClass.RAIL_TRACK, ObjectClass.OTHER, ObjectClass.ROAD_LINE,
)  # fmt: skip
"""What stands by houses and people."""


def describe(mind: ParticipantMind, view: View, move: DialogueMove, rng: np.random.Generator) -> None:
    """Says where the target is; at once, or when the car is close to it, the way is told turn by turn."""
    assert mind.goal is not None
    mind.guiding = bool(mind.goal.street is StreetName.UNKNOWN or mind.described or rng.random() < GUIDES_AT_ONCE)
    mind.described = True
    values: list[SlotValue] = [mind.goal.street] if mind.goal.street is not StreetName.UNKNOWN else []
    near = _near(mind.goal, view)
    if near is not None:
        values.append(near.name)
    looks = (_looks(mind.goal),) if rng.random() < TELLS_LOOKS else ()
    mind.voice = mind.voice.plan_first(remark(move, *values, wording=Wording(topic="where")), *looks)


def _looks(goal: SeenLandmark) -> Remark:
    """By what a place is known when one is there: the same for the same place."""
    thing = _FEATURES[int(abs(goal.x) * 7.0 + abs(goal.y) * 3.0) % len(_FEATURES)]
    return remark(DialogueMove.EXPLAIN, thing, wording=Wording(topic="looks"), joined=True)


def _near(goal: SeenLandmark, view: View) -> SeenLandmark | None:
    """A well-known place close to the target."""
    found = [
        (abs(other.x - goal.x) + abs(other.y - goal.y), other.row, other)
        for other in view.landmarks
        if other.name in _FAMOUS and other.name is not goal.name
    ]
    return min(found)[2] if found and min(found)[0] < 90.0 else None
