"""Observation spaces of the roles and the columns of their tables.

Tables have a fixed number of rows; unused rows are all zeros (column 0 is positive in used rows). Lengths are in
metres, speeds in m/s, headings in radians clockwise, turn angles in degrees positive left, unless stated otherwise.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from functools import lru_cache
from typing import Any, TypeAlias

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from dorothie_gym.ontology.actions import PhysicalAction
from dorothie_gym.ontology.dialogue_acts import LABELS, DialogueAct, DialogueMove, decode_slots
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import LandmarkName, ObjectClass, StreetName
from dorothie_gym.ontology.world_exceptions import Sensor, WeatherParameter
from dorothie_gym.session.spaces.actions import NO_MOVE
from dorothie_gym.session.spaces.fields import (
    MESSAGE_LENGTH,
    STORY_LENGTH,
    UTTERANCE_LENGTH,
    Column,
    FieldSpec,
    SpaceLimits,
    choice,
    choices,
    dict_space,
    flags,
    real,
    text,
)
from dorothie_gym.sim.sensing.visibility import CLEAR_SIGHT
from dorothie_gym.sim.state.codes import Motion
from dorothie_gym.tasks.storyboard import TaskMessages

Observation: TypeAlias = dict[str, Any]
"""Observation dict of one role: values by field name, as specified by `observation_fields`."""

ObservationMapping: TypeAlias = Mapping[str, Any]
"""Read-only observation dict, as accepted by policies."""

MESSAGE_KINDS = tuple(field.name for field in fields(TaskMessages))
"""Kinds of changes of a task that a storyboard gives messages for: "trigger", "delete", "change"."""

MAX_UTTERANCE = 4 * (UTTERANCE_LENGTH + 1)
"""Largest length of an utterance of several spans [characters]."""


class ObjectColumn(Column):
    """Columns of `objects`: objects in sight, nearest first."""

    KIND = 0, "1", "id of an `ObjectClass`, never 0"
    X = 1, "m", "x of the position"
    Y = 2, "m", "y of the position"
    DISTANCE = 3, "m", "distance from the car"
    BEARING = 4, "rad", "bearing relative to the heading of the car"
    LENGTH = 5, "m", "length of the object"
    WIDTH = 6, "m", "width of the object"
    SPEED = 7, "m/s", "speed of the object"


class LandmarkColumn(Column):
    """Columns of `landmarks`."""

    NAME = 0, "1", "id of a `LandmarkName`, never 0"
    X = 1, "m", "x of the landmark"
    Y = 2, "m", "y of the landmark"
    LANE = 3, "1", "id of the lane that gives access"
    STATION = 4, "m", "distance of the waypoint along the lane"
    STREET = 5, "1", "index of the street"


class SubgoalColumn(Column):
    """Columns of `subgoals`, the subgoals of the storyboard; the last three are 0 except for the Ad-Wizard."""

    LIVE = 0, "1", "1 if the subgoal is part of the task"
    LANDMARK = 1, "1", "row in `landmarks`"
    STATUS = 2, "1", "id of a `GoalStatus`"
    REACHED = 3, "1", "1 if the subgoal is reached"
    ALLOWED = 4, "1", "1 if a stop at the landmark would complete the subgoal now"
    AFTER = 5, "1", "bit mask of the subgoals to be reached before"
    CAN_TRIGGER = 6, "1", "1 if the Ad-Wizard may trigger the subgoal"
    CAN_DELETE = 7, "1", "1 if the Ad-Wizard may delete the subgoal"
    CAN_CHANGE = 8, "1", "1 if the Ad-Wizard may change the subgoal"


class ExitColumn(Column):
    """Columns of `exits`, the turn options at the next junction of the current path, from right to left."""

    PRESENT = 0, "1", "1 in used rows"
    ANGLE = 1, "deg", "turn angle, positive left"
    DISTANCE = 2, "m", "distance to the junction along the path"
    LANE = 3, "1", "id of the lane after the junction"
    STREET = 4, "1", "index of the street of that lane; -1 for none"
    JUNCTION = 5, "1", "index in `Town.junctions`"


class GuessColumn(Column):
    """Columns of `guesses`: estimated position of each hidden landmark, from the dialogue and marked positions."""

    PRESENT = 0, "1", "1 in used rows"
    X = 1, "m", "x of the mean"
    Y = 2, "m", "y of the mean"
    VARIANCE_X = 3, "m^2", "variance of x"
    VARIANCE_Y = 4, "m^2", "variance of y"
    COVARIANCE_XY = 5, "m^2", "covariance of x and y"


class PropColumn(Column):
    """Columns of `props` (Ad-Wizard)."""

    KIND = 0, "1", "1 + index of the `PropKind`"
    X = 1, "m", "x of the prop"
    Y = 2, "m", "y of the prop"
    HEADING = 3, "rad", "heading, clockwise"


@lru_cache(maxsize=64)
def observation_fields(role: Role, limits: SpaceLimits, observe_acts: bool = True) -> tuple[FieldSpec, ...]:
    """Returns the specifications of the observation fields of a role.

    The Participant observes true positions and all landmarks, the Co-Wizard estimated positions and the landmarks that
    are not hidden, the Ad-Wizard all data. For the Co-Wizard, exit distances, the first waypoint and object positions
    follow from the estimated pose; distances and bearings of objects are as perceived.

    Args:
        role: one of the three agents.
        limits: sizes of the tables.
        observe_acts: whether dialogue acts of utterances are observed in addition to their text.

    Raises:
        ValueError: if the role has no observations.
    """
    landmarks = {
        Role.PARTICIPANT: "all landmarks",
        Role.CO_WIZARD: "landmarks that are not hidden",
        Role.AD_WIZARD: "all landmarks",
    }
    if role not in landmarks:
        raise ValueError(f"{role} has no observations")
    estimated = role is Role.CO_WIZARD
    common = (
        real("time", 1, low=0.0, unit="s", meaning="time since the start of the session"),
        real("speed", 1, unit="m/s", meaning="speed of the car"),
        real("weather", len(WeatherParameter), unit="mixed", meaning="values in the order of `WeatherParameter`"),
        choices("street_names", len(StreetName), limits.streets, meaning="id of the `StreetName` of each street"),
        real(
            "pose",
            3,
            unit="m, m, rad",
            meaning=f"{'estimated' if estimated else 'true'} x, y and heading (clockwise) of the car",
        ),
        choice(
            "lane", limits.lanes, meaning=f"id of the lane of the car{', from the estimated pose' if estimated else ''}"
        ),
        real("station", 1, unit="m", meaning="distance of the car along its lane"),
        real("landmarks", limits.landmarks, columns=LandmarkColumn, unit="mixed", meaning=landmarks[role]),
    )
    return (*common, *_OWN_FIELDS[role](limits, observe_acts))


def _participant_fields(limits: SpaceLimits, observe_acts: bool) -> tuple[FieldSpec, ...]:
    return (
        _sight(),
        _objects(limits),
        _lights(),
        _subgoals(limits),
        _story(),
        text("tasks", STORY_LENGTH, meaning="descriptions of the live subgoals with their reasons, a line each"),
        text("message", MESSAGE_LENGTH, meaning="message of the Ad-Wizard"),
        _speaking(),
        _other_speaking(),
        *_utterance(Role.CO_WIZARD, limits, observe_acts),
    )


def _co_wizard_fields(limits: SpaceLimits, observe_acts: bool) -> tuple[FieldSpec, ...]:
    return (
        _sight(),
        real("pose_covariance", 3, 3, unit="m, m, rad", meaning="covariance of the estimated x, y and heading"),
        real("cruise_speed", 1, unit="km/h", meaning="speed set by the Co-Wizard"),
        _lights(),
        _motion(),
        choice("hazard", len(ObjectClass), meaning="id of the `ObjectClass` of the hazard ahead; 0 for none"),
        real("hazard_distance", 1, unit="m", meaning="distance to the hazard"),
        choice("manoeuvre", len(PhysicalAction) + 1, meaning="id of the `PhysicalAction` in preparation; 0 for none"),
        real("manoeuvre_angle", 1, unit="deg", meaning="turn angle of the manoeuvre, positive left"),
        _waypoints(limits),
        real("exits", limits.exits, columns=ExitColumn, unit="mixed", meaning="turn options at the next junction"),
        _objects(limits),
        real(
            "guesses",
            len(LandmarkName),
            columns=GuessColumn,
            unit="mixed",
            meaning="estimated positions of hidden landmarks, one row per `LandmarkName`",
        ),
        _speaking(),
        _other_speaking(),
        *_utterance(Role.PARTICIPANT, limits, observe_acts),
    )


def _ad_wizard_fields(limits: SpaceLimits, observe_acts: bool) -> tuple[FieldSpec, ...]:
    return (
        _motion(),
        flags("hidden", limits.landmarks, meaning="1 for landmarks hidden from the Co-Wizard"),
        _subgoals(limits),
        _story(),
        text("tasks", STORY_LENGTH, meaning="descriptions of all subgoals with their reasons, a line each"),
        text(
            "changes", STORY_LENGTH, meaning="description of each subgoal after a change, a line each; empty for none"
        ),
        *(
            text(
                f"{kind}_messages",
                STORY_LENGTH,
                meaning=f"message that the storyboard gives to {kind} each subgoal with, a line each; empty for none",
            )
            for kind in MESSAGE_KINDS
        ),
        _waypoints(limits),
        choices("path_lanes", limits.lanes + 1, limits.plan, meaning="1 + id of the lanes of the path; 0 for none"),
        real("props", limits.props, columns=PropColumn, unit="mixed", meaning="props on the road"),
        flags("sensors", len(Sensor), meaning="1 for each faulty `Sensor`"),
        *_utterance(Role.PARTICIPANT, limits, observe_acts),
        *_utterance(Role.CO_WIZARD, limits, observe_acts),
    )


_OWN_FIELDS = {
    Role.PARTICIPANT: _participant_fields,
    Role.CO_WIZARD: _co_wizard_fields,
    Role.AD_WIZARD: _ad_wizard_fields,
}


@lru_cache(maxsize=64)
def observation_space(role: Role, limits: SpaceLimits, observe_acts: bool = True) -> spaces.Dict:
    """Returns the observation space of a role, built from `observation_fields`; arguments and errors as there."""
    return dict_space(observation_fields(role, limits, observe_acts))


def camera_perception_fields(limits: SpaceLimits) -> tuple[FieldSpec, ...]:
    """Returns the specifications of the additional fields of participant and Co-Wizard with perception by the camera.

    The Co-Wizard's `landmarks` then also contain, after those that are not hidden, the hidden ones that have been in
    view.
    """
    return (flags("landmarks_in_view", limits.landmarks, meaning="1 for landmarks that the picture shows"),)


def _sight() -> FieldSpec:
    meaning = "range within which all objects are seen, as weather, light, head lights and the camera leave it"
    return real("sight", 1, low=0.0, high=CLEAR_SIGHT, unit="m", meaning=meaning)


def _objects(limits: SpaceLimits) -> FieldSpec:
    return real("objects", limits.objects, columns=ObjectColumn, unit="mixed", meaning="objects in sight")


def _subgoals(limits: SpaceLimits) -> FieldSpec:
    return real("subgoals", limits.subgoals, columns=SubgoalColumn, meaning="subgoals of the storyboard")


def _waypoints(limits: SpaceLimits) -> FieldSpec:
    return real("waypoints", limits.waypoints, 2, unit="m", meaning="x and y of points of the planned path")


def _motion() -> FieldSpec:
    return choice("motion", len(Motion), meaning="id of the `Motion` of the car")


def _lights() -> FieldSpec:
    return choice("lights", 2, meaning="1 if the headlights are on")


def _story() -> FieldSpec:
    return text("story", STORY_LENGTH, meaning="story of the storyboard")


def _speaking() -> FieldSpec:
    return real("speaking", 1, low=0.0, unit="s", meaning="remaining duration of the own utterance")


def _other_speaking() -> FieldSpec:
    return flags("other_speaking", 1, meaning="1 while the other speaker, participant or Co-Wizard, is heard talking")


def _utterance(speaker: Role, limits: SpaceLimits, observe_acts: bool) -> tuple[FieldSpec, ...]:
    name = {Role.PARTICIPANT: "participant", Role.CO_WIZARD: "Co-Wizard"}[speaker]
    words = text(
        f"{speaker}_text", MAX_UTTERANCE, meaning=f"utterance of the {name} that ended since the last decision"
    )
    if not observe_acts:
        return (words,)
    return (
        words,
        choices(
            f"{speaker}_moves",
            NO_MOVE + 1,
            limits.spans,
            meaning=f"id of the `DialogueMove` of each span; {NO_MOVE} for none",
        ),
        flags(
            f"{speaker}_slots", limits.spans, len(LABELS), meaning="label vector of each span, in the order of `LABELS`"
        ),
    )


def heard_acts(observation: ObservationMapping, speaker: Role) -> tuple[DialogueAct, ...] | None:
    """Returns the acts of the utterance that ended since the last decision; None if acts are not observed."""
    moves: NDArray[np.int64] | None = observation.get(f"{speaker}_moves")
    if moves is None:
        return None
    slots = observation[f"{speaker}_slots"]
    return tuple(
        DialogueAct(move=DialogueMove(move), slots=decode_slots(row))
        for move, row in zip(moves.tolist(), slots, strict=True)
        if move != NO_MOVE
    )
