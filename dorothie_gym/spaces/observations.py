"""What each role can observe: the spaces, and the columns of their tables.

Tables have a fixed number of rows; a row that is not used is all zeros (its first column tells). Lengths in metres,
speeds in m/s unless a name says km/h, headings in radians clockwise, turn angles in degrees positive left.
"""

from __future__ import annotations

import enum
from collections.abc import Mapping
from functools import lru_cache
from typing import Any, TypeAlias

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from dorothie_gym.ontology import (
    LABELS,
    DialogueAct,
    DialogueMove,
    LandmarkName,
    ObjectClass,
    PhysicalAction,
    Role,
    Sensor,
    StreetName,
    WeatherParameter,
    decode_slots,
)
from dorothie_gym.spaces.actions import NO_MOVE
from dorothie_gym.spaces.limits import (
    MESSAGE_LENGTH,
    REACH,
    STORY_LENGTH,
    TEXT_CHARACTERS,
    UTTERANCE_LENGTH,
    SpaceLimits,
)

Observation: TypeAlias = dict[str, Any]

MAX_UTTERANCE = 4 * (UTTERANCE_LENGTH + 1)
"""Characters of an utterance of several spans."""


class ObjectColumn(enum.IntEnum):
    """Columns of `objects`: what is in sight, nearest first. `kind` is the id of an `ObjectClass`, never 0."""

    KIND = 0
    X = 1
    Y = 2
    DISTANCE = 3
    BEARING = 4
    LENGTH = 5
    WIDTH = 6
    SPEED = 7


class LandmarkColumn(enum.IntEnum):
    """Columns of `landmarks`. `name` is the id of a `LandmarkName`, never 0; x and y of where it stands."""

    NAME = 0
    X = 1
    Y = 2
    LANE = 3
    STATION = 4
    STREET = 5


class SubgoalColumn(enum.IntEnum):
    """Columns of `subgoals`, the storyboard's tasks.

    `landmark` is a row of `landmarks`; `status` the id of a `GoalStatus`; `after` a bit mask of subgoals to be reached
    before; `allowed` whether it counts now; the last three, what the Ad-Wizard may do with it, are 0 for others.
    """

    LIVE = 0
    LANDMARK = 1
    STATUS = 2
    REACHED = 3
    ALLOWED = 4
    AFTER = 5
    CAN_TRIGGER = 6
    CAN_DELETE = 7
    CAN_CHANGE = 8


class ExitColumn(enum.IntEnum):
    """Columns of `exits`, the turn options at the next junction of the present path, from right to left.

    `lane` is the lane after the junction, `street` its street (-1: none), `junction` an index in `Town.junctions`.
    """

    PRESENT = 0
    ANGLE = 1
    DISTANCE = 2
    LANE = 3
    STREET = 4
    JUNCTION = 5


class GuessColumn(enum.IntEnum):
    """Columns of `guesses`, one row a `LandmarkName`: where a hidden landmark is believed to be, and how surely.

    Mean and covariance of the estimate that what was said and what was marked add up to [m, m^2].
    """

    PRESENT = 0
    X = 1
    Y = 2
    VARIANCE_X = 3
    VARIANCE_Y = 4
    COVARIANCE_XY = 5


class PropColumn(enum.IntEnum):
    """Columns of `props` (Ad-Wizard). `kind` is 1 + the place of the `PropKind` in its enum."""

    KIND = 0
    X = 1
    Y = 2
    HEADING = 3


class Motion(enum.IntEnum):
    """What the car is about."""

    DRIVING = 0
    STOPPED = 1
    """By the action Stop, until Start or another manoeuvre."""
    WAITING = 2
    """At the end of its lane, for a turn."""
    HAZARD = 3
    """Braking or standing for what is ahead."""


@lru_cache(maxsize=64)
def observation_space(role: Role, limits: SpaceLimits, observe_acts: bool = True) -> spaces.Dict:
    """The observation space of a role.

    Every role sees `time` [s], `speed`, `weather` (the ten parameters in the ontology's order), `street_names` (id of
    the `StreetName` of each street of the town) and what others say.

    Participant: true `pose` (x, y, heading), `lane` and `station`, `objects` in sight, ALL `landmarks`, `subgoals`
    with `story` and `tasks` in words, `message` of the Ad-Wizard.
    Co-Wizard: `pose` as estimated and its `pose_covariance` (of x, y, heading), `lane` and `station` matched to the
    estimate, `cruise_speed` [km/h], `lights`, `motion`, `hazard` (an `ObjectClass` id) and `hazard_distance`,
    `manoeuvre` in preparation and its `manoeuvre_angle`, planned `waypoints`, `exits`, `objects` perceived, the
    `landmarks` that are not hidden, `guesses` of hidden ones. Distances of exits, the first of the waypoints and the
    places of objects follow from the estimated pose; distances and bearings of objects are as they are seen.
    Ad-Wizard: everything: true pose, `landmarks` and which are `hidden`, `subgoals`, the car's `waypoints` and
    `path_lanes` (lane id + 1), `props`, `sensors` that are faulty.
    """
    common: dict[str, spaces.Space[Any]] = {
        "time": _box(1, low=0.0),
        "speed": _box(1),
        "weather": _box(len(WeatherParameter)),
        "street_names": spaces.MultiDiscrete([len(StreetName)] * limits.streets),
        "pose": _box(3),
        "lane": spaces.Discrete(limits.lanes),
        "station": _box(1),
        "landmarks": _box(limits.landmarks, len(LandmarkColumn)),
    }
    if role is Role.PARTICIPANT:
        own: dict[str, spaces.Space[Any]] = {
            "objects": _box(limits.objects, len(ObjectColumn)),
            "lights": spaces.Discrete(2),
            "subgoals": _box(limits.subgoals, len(SubgoalColumn)),
            "story": _text(STORY_LENGTH),
            "tasks": _text(STORY_LENGTH),
            "message": _text(MESSAGE_LENGTH),
            "speaking": _box(1, low=0.0),
            **_heard(Role.CO_WIZARD, limits, observe_acts),
        }
    elif role is Role.CO_WIZARD:
        own = {
            "pose_covariance": _box(3, 3),
            "cruise_speed": _box(1),
            "lights": spaces.Discrete(2),
            "motion": spaces.Discrete(len(Motion)),
            "hazard": spaces.Discrete(len(ObjectClass)),
            "hazard_distance": _box(1),
            "manoeuvre": spaces.Discrete(len(PhysicalAction) + 1),
            "manoeuvre_angle": _box(1),
            "waypoints": _box(limits.waypoints, 2),
            "exits": _box(limits.exits, len(ExitColumn)),
            "objects": _box(limits.objects, len(ObjectColumn)),
            "guesses": _box(len(LandmarkName), len(GuessColumn)),
            "speaking": _box(1, low=0.0),
            **_heard(Role.PARTICIPANT, limits, observe_acts),
        }
    elif role is Role.AD_WIZARD:
        own = {
            "motion": spaces.Discrete(len(Motion)),
            "hidden": spaces.MultiBinary(limits.landmarks),
            "subgoals": _box(limits.subgoals, len(SubgoalColumn)),
            "story": _text(STORY_LENGTH),
            "waypoints": _box(limits.waypoints, 2),
            "path_lanes": spaces.MultiDiscrete([limits.lanes + 1] * limits.plan),
            "props": _box(limits.props, len(PropColumn)),
            "sensors": spaces.MultiBinary(len(Sensor)),
            **_heard(Role.PARTICIPANT, limits, observe_acts),
            **_heard(Role.CO_WIZARD, limits, observe_acts),
        }
    else:
        raise ValueError(f"{role} observes nothing")
    return spaces.Dict({**common, **own})


def _box(*shape: int, low: float = -REACH) -> spaces.Box:
    return spaces.Box(low, REACH, shape, dtype=np.float64)


def _text(length: int) -> spaces.Text:
    return spaces.Text(length, min_length=0, charset=TEXT_CHARACTERS)


def _heard(speaker: Role, limits: SpaceLimits, observe_acts: bool) -> dict[str, spaces.Space[Any]]:
    fields: dict[str, spaces.Space[Any]] = {f"{speaker}_text": _text(MAX_UTTERANCE)}
    if observe_acts:
        fields[f"{speaker}_moves"] = spaces.MultiDiscrete([NO_MOVE + 1] * limits.spans)
        fields[f"{speaker}_slots"] = spaces.MultiBinary([limits.spans, len(LABELS)])
    return fields


def heard_acts(observation: Mapping[str, Any], speaker: Role) -> tuple[DialogueAct, ...] | None:
    """Acts of the utterance that ended since the last decision; None where acts are not observed."""
    moves: NDArray[np.int64] | None = observation.get(f"{speaker}_moves")
    if moves is None:
        return None
    slots = observation[f"{speaker}_slots"]
    return tuple(
        DialogueAct(move=DialogueMove(int(move)), slots=decode_slots(row))
        for move, row in zip(moves, slots, strict=True)
        if move != NO_MOVE
    )
