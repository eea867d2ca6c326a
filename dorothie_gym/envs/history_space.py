"""Observation and action spaces of the three tasks: the history at a point, and predictions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Final

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from dorothie_gym.archive.prediction_points import WAY_LENGTH, PointView, history_angle
from dorothie_gym.archive.recorded_perception import ObjectKind, last_perceived
from dorothie_gym.archive.visibility import Task
from dorothie_gym.errors import short_repr
from dorothie_gym.ontology.actions import NAVIGATION_ACTIONS, U_TURN_ANGLE, PhysicalAction
from dorothie_gym.ontology.dialogue_acts import LABELS, DialogueMove
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import StreetName
from dorothie_gym.ontology.spellings import parse_landmark, parse_street
from dorothie_gym.session.spaces.actions import NO_MOVE, ActionMapping
from dorothie_gym.session.spaces.fields import (
    TEXT_CHARACTERS,
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
from dorothie_gym.session.spaces.observations import MAX_UTTERANCE, LandmarkColumn, Observation
from dorothie_gym.sim.config import FRAME_RATE
from dorothie_gym.support.action_values import as_array

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.session.recording.events import MoveRecord
    from dorothie_gym.session.recording.session import Session

HISTORY_LENGTH: Final = 16
"""Number of latest moves and physical actions in an observation."""

SPEAKERS: Final = (Role.PARTICIPANT, Role.CO_WIZARD)
"""Possible speakers; `move_speakers` holds 1 + the index in this tuple, 0 for no move."""


class HistoryObjectColumn(Column):
    """Columns of `objects` in the history space, in the order of `dorothie_gym.archive.OBJECT_VALUES`."""

    DISTANCE = 0, "m", "distance from the car; for a traffic light, from its stop line"
    BEARING = 1, "deg", "bearing relative to the heading of the car, positive left"
    AHEAD = 2, "m", "longitudinal offset from the car"
    ASIDE = 3, "m", "lateral offset from the car, positive left"
    HEADING = 4, "deg", "heading relative to the car, positive left; 0 for a traffic light"
    SPEED = 5, "m/s", "speed; 0 for a traffic light"
    LENGTH = 6, "m", "length; 0 for a traffic light"
    WIDTH = 7, "m", "width; 0 for a traffic light"


class TrackColumn(Column):
    """Columns of `way`, the recent trajectory of the car."""

    X = 0, "m", "x of the position"
    Y = 1, "m", "y of the position"
    HEADING = 2, "rad", "heading, clockwise"
    SPEED = 3, "m/s", "speed"


def history_fields(task: Task, limits: SpaceLimits) -> tuple[FieldSpec, ...]:
    """Returns the specifications of the observation fields of a task; histories are sorted newest first."""
    utterance = (text("utterance", MAX_UTTERANCE, meaning="words whose dialogue act is to be inferred"),)
    return (
        *(utterance if task is Task.UFN else ()),
        real("time", 1, low=0.0, unit="s", meaning="time of the point since the start of the session"),
        choices("moves", NO_MOVE + 1, HISTORY_LENGTH, meaning=f"ids of the last dialogue moves; {NO_MOVE} for none"),
        choices(
            "move_speakers",
            len(SPEAKERS) + 1,
            HISTORY_LENGTH,
            meaning="1 + index of each speaker in `SPEAKERS`; 0 for none",
        ),
        flags("move_slots", HISTORY_LENGTH, len(LABELS), meaning="label vector of each move, in the order of `LABELS`"),
        real("move_times", HISTORY_LENGTH, low=0.0, unit="s", meaning="end of the utterance of each move"),
        text("participant_text", MAX_UTTERANCE, meaning="last utterance of the participant"),
        text("co_wizard_text", MAX_UTTERANCE, meaning="last utterance of the Co-Wizard"),
        choices(
            "actions", len(PhysicalAction) + 1, HISTORY_LENGTH, meaning="ids of the last physical actions; 0 for none"
        ),
        real(
            "action_angles",
            HISTORY_LENGTH,
            low=U_TURN_ANGLE,
            high=180.0,
            unit="deg",
            meaning="angle of each action, positive left",
        ),
        real("action_times", HISTORY_LENGTH, low=0.0, unit="s", meaning="time of each action"),
        real("pose", 3, unit="m, m, rad", meaning="x, y and heading (clockwise) of the car"),
        real("speed", 1, unit="m/s", meaning="speed of the car"),
        real("way", WAY_LENGTH, columns=TrackColumn, unit="mixed", meaning="recent trajectory of the car, every 0.4 s"),
        choice("way_length", WAY_LENGTH + 1, meaning="number of used rows of `way`"),
        choices(
            "object_kinds",
            len(ObjectKind) + 1,
            limits.objects,
            meaning="1 + `ObjectKind` of each perceived object, nearest first; 0 for none",
        ),
        real(
            "objects",
            limits.objects,
            columns=HistoryObjectColumn,
            unit="mixed",
            meaning="perceived objects, in the order of `object_kinds`",
        ),
        choices("street_names", len(StreetName), limits.streets, meaning="id of the `StreetName` of each street"),
        real(
            "landmarks",
            limits.landmarks,
            columns=LandmarkColumn,
            unit="mixed",
            meaning="landmarks that are not hidden",
        ),
    )


def history_space(task: Task, limits: SpaceLimits) -> spaces.Dict:
    """Returns the observation space of a task, built from `history_fields`."""
    return dict_space(history_fields(task, limits))


def encode_view(view: PointView, limits: SpaceLimits) -> Observation:
    """Returns the observation of a view in `history_space` of its task, without the fields of `encode_objects`."""
    moves, actions = view.moves[: -HISTORY_LENGTH - 1 : -1], view.actions[: -HISTORY_LENGTH - 1 : -1]  # newest first
    car = view.car
    observation: Observation = {
        "time": np.array([view.time]),
        "moves": _padded([int(move.act.move) for move in moves], NO_MOVE),
        "move_speakers": _padded([_speaker(move) for move in moves], 0),
        "move_slots": _slots(moves),
        "move_times": _padded([move.frame / FRAME_RATE for move in moves], 0.0),
        "participant_text": _last_text(view.moves, Role.PARTICIPANT),
        "co_wizard_text": _last_text(view.moves, Role.CO_WIZARD),
        "actions": _padded([int(action.action) for action in actions], 0),
        "action_angles": _padded([history_angle(action) for action in actions], 0.0),
        "action_times": _padded([action.frame / FRAME_RATE for action in actions], 0.0),
        "pose": np.array([car.x, car.y, car.heading] if car else [0.0, 0.0, 0.0]),
        "speed": np.nan_to_num([car.speed if car else 0.0]),  # NaN: not in the recording
        "way": _way(view),
        "way_length": np.int64(len(view.way)),
        "street_names": _streets(view, limits),
        "landmarks": _landmarks(view, limits),
    }
    if view.task is Task.UFN:
        observation["utterance"] = clean_text(view.utterance)
    return observation


def encode_objects(session: Session, frame: int, town: Town | None, limits: SpaceLimits) -> Observation:
    """Returns the fields `object_kinds` and `objects`: objects perceived at the last snapshot before a frame.

    Args:
        session: the session so far.
        frame: frame of the point.
        town: town of the session, if known; provides the positions of traffic lights.
        limits: sizes of the tables; the nearest objects are kept.
    """
    kinds, values = last_perceived(session, frame, town)
    numbers, table = np.zeros(limits.objects, dtype=np.int64), np.zeros((limits.objects, len(HistoryObjectColumn)))
    count = min(len(kinds), limits.objects)
    numbers[:count], table[:count] = 1 + kinds[:count], values[:count]
    return {"object_kinds": numbers, "objects": table}


def act_fields() -> tuple[FieldSpec, ...]:
    """Returns the specifications of the action fields of UfN and RfN."""
    return (
        choice("move", len(DialogueMove), meaning="id of the `DialogueMove`"),
        flags("slots", len(LABELS), meaning="label vector of the slot values, in the order of `LABELS`"),
    )


def decision_fields() -> tuple[FieldSpec, ...]:
    """Returns the specifications of the action fields of NfD."""
    return (
        choice("action", len(NAVIGATION_ACTIONS), meaning="class of `PhysicalAction.nfd_class`"),
        choice("angle", 360, start=-180, unit="deg", meaning="angle of the action, positive left"),
    )


def act_space() -> spaces.Dict:
    """Returns the action space of UfN and RfN, built from `act_fields`."""
    return dict_space(act_fields())


def decision_space() -> spaces.Dict:
    """Returns the action space of NfD, built from `decision_fields`."""
    return dict_space(decision_fields())


def check_action(action: object, space: spaces.Dict) -> ActionMapping:
    """Returns the action if it is in the space; raises `ValueError` with the name of an invalid field otherwise."""
    if not isinstance(action, Mapping):
        raise ValueError(f"action: a dict with the fields {', '.join(space)} is expected, not {type(action).__name__}")
    if extra := [name for name in action if name not in space.spaces]:
        raise ValueError(f"action: there is no field {short_repr(extra[0])}; the fields are {', '.join(space)}")
    for name, part in space.items():
        if name not in action:
            raise ValueError(f"action: field {name!r} is missing")
        value = action[name]
        if isinstance(part, spaces.MultiBinary):
            value = as_array(f"action: field {name!r}", value)
            allowed = value.dtype.kind in "iubf" and part.contains(value)
        else:
            number = value if isinstance(value, int | np.integer) else as_array(f"action: field {name!r}", value)
            allowed = part.contains(number)
        if not allowed:
            raise ValueError(f"action: field {name!r} is {short_repr(action[name])}; it must be in {part}")
    return action


def clean_text(words: str) -> str:
    """Returns words that are valid in a `Text` space: other characters become "?", and long text is truncated."""
    return "".join(character if character in TEXT_CHARACTERS else "?" for character in words)[:MAX_UTTERANCE]


def _way(view: PointView) -> NDArray[np.float64]:
    table = np.zeros((WAY_LENGTH, len(TrackColumn)))
    states = [(state.x, state.y, state.heading, state.speed) for state in reversed(view.way)]
    table[: len(states)] = np.nan_to_num(np.array(states).reshape(-1, len(TrackColumn)))
    return table


def _padded(values: Sequence[float], filler: float) -> NDArray[np.float64] | NDArray[np.int64]:
    if isinstance(filler, float):
        times = np.full(HISTORY_LENGTH, filler)
        times[: len(values)] = values
        return times
    ids = np.full(HISTORY_LENGTH, filler, dtype=np.int64)
    ids[: len(values)] = values
    return ids


def _speaker(move: MoveRecord) -> int:
    return 1 + SPEAKERS.index(move.speaker) if move.speaker in SPEAKERS else 0


def _slots(moves: Sequence[MoveRecord]) -> NDArray[np.int8]:
    table = np.zeros((HISTORY_LENGTH, len(LABELS)), dtype=np.int8)
    for row, move in enumerate(moves):
        table[row] = move.act.vector
    return table


def _last_text(moves: Sequence[MoveRecord], speaker: Role) -> str:
    return next((clean_text(move.text) for move in reversed(moves) if move.speaker is speaker), "")


def _streets(view: PointView, limits: SpaceLimits) -> NDArray[np.int64]:
    row = np.zeros(limits.streets, dtype=np.int64)
    names = view.street_names[: limits.streets]
    row[: len(names)] = [parse_street(name).value for name in names]
    return row


def _landmarks(view: PointView, limits: SpaceLimits) -> NDArray[np.float64]:
    table = np.zeros((limits.landmarks, len(LandmarkColumn)))
    for row, landmark in zip(table, view.landmarks, strict=False):
        row[LandmarkColumn.NAME] = parse_landmark(landmark["name"]).value
        row[LandmarkColumn.X], row[LandmarkColumn.Y] = landmark["x"], landmark["y"]
        row[LandmarkColumn.LANE], row[LandmarkColumn.STATION] = landmark["lane"], landmark["station"]
        row[LandmarkColumn.STREET] = landmark["street"]
    return table
