"""What may be seen at a point as a dict of fixed-shape arrays, and predictions as actions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from dorothie_gym.maps import Town
from dorothie_gym.ontology import (
    LABELS,
    NAVIGATION_ACTIONS,
    U_TURN_ANGLE,
    DialogueMove,
    PhysicalAction,
    Role,
    StreetName,
    parse_landmark,
    parse_street,
)
from dorothie_gym.recording import (
    FRAME_RATE,
    OBJECT_VALUES,
    WAY_LENGTH,
    MoveRecord,
    ObjectKind,
    PointView,
    Session,
    Task,
    history_angle,
    last_perceived,
)
from dorothie_gym.spaces import NO_MOVE, LandmarkColumn, Observation, SpaceLimits
from dorothie_gym.spaces.limits import TEXT_CHARACTERS
from dorothie_gym.spaces.observations import MAX_UTTERANCE

HISTORY: Final = 16
"""Moves and physical actions of the history that are in an observation; the oldest are left out."""

SPEAKERS: Final = (Role.PARTICIPANT, Role.CO_WIZARD)
"""Who may have spoken; `move_speakers` holds 1 + the place in here, 0 where there is no move."""

REACH: Final = 1e6
"""No time [s], place [m] or speed [m/s] of a session is beyond this; the checker wants finite bounds."""


def history_space(task: Task, limits: SpaceLimits) -> spaces.Dict:
    """Returns the observation space of a task; see `TeacherForcedEnv` for its fields."""
    utterance: dict[str, spaces.Space[Any]] = {"utterance": _text()} if task is Task.UFN else {}
    return spaces.Dict(
        {
            **utterance,
            "time": _box(1, low=0.0),
            "moves": spaces.MultiDiscrete([NO_MOVE + 1] * HISTORY),
            "move_speakers": spaces.MultiDiscrete([len(SPEAKERS) + 1] * HISTORY),
            "move_slots": spaces.MultiBinary([HISTORY, len(LABELS)]),
            "move_times": _box(HISTORY, low=0.0),
            "participant_text": _text(),
            "co_wizard_text": _text(),
            "actions": spaces.MultiDiscrete([len(PhysicalAction) + 1] * HISTORY),
            "action_angles": spaces.Box(U_TURN_ANGLE, 180.0, (HISTORY,), dtype=np.float64),
            "action_times": _box(HISTORY, low=0.0),
            "pose": _box(3),
            "speed": _box(1),
            "way": _box(WAY_LENGTH, 4),
            "way_length": spaces.Discrete(WAY_LENGTH + 1),
            "object_kinds": spaces.MultiDiscrete([len(ObjectKind) + 1] * limits.objects),
            "objects": _box(limits.objects, len(OBJECT_VALUES)),
            "street_names": spaces.MultiDiscrete([len(StreetName)] * limits.streets),
            "landmarks": _box(limits.landmarks, len(LandmarkColumn)),
        }
    )


def encode_view(view: PointView, limits: SpaceLimits) -> Observation:
    """Returns the observation of a view, in `history_space` of its task but for what `encode_objects` adds."""
    moves, actions = view.moves[: -HISTORY - 1 : -1], view.actions[: -HISTORY - 1 : -1]  # newest first
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
        "speed": np.nan_to_num([car.speed if car else 0.0]),  # NaN: the recording does not know it
        "way": _way(view),
        "way_length": np.int64(len(view.way)),
        "street_names": _streets(view, limits),
        "landmarks": _landmarks(view, limits),
    }
    if view.task is Task.UFN:
        observation["utterance"] = clean_text(view.utterance)
    return observation


def encode_objects(session: Session, frame: int, town: Town | None, limits: SpaceLimits) -> Observation:
    """Returns the part of an observation that tells what was perceived around the car at the last look before a frame.

    Args:
        session: the session, as far as it has come.
        frame: of the point.
        town: the session's, where it is known: it tells where traffic lights are.
        limits: how many objects there are room for, the nearest.
    """
    kinds, values = last_perceived(session, frame, town)
    numbers, table = np.zeros(limits.objects, dtype=np.int64), np.zeros((limits.objects, len(OBJECT_VALUES)))
    count = min(len(kinds), limits.objects)
    numbers[:count], table[:count] = 1 + kinds[:count], values[:count]
    return {"object_kinds": numbers, "objects": table}


def act_space() -> spaces.Dict:
    """Returns the action space of UfN and RfN: a move, and the slot values in the order of `LABELS`."""
    return spaces.Dict({"move": spaces.Discrete(len(DialogueMove)), "slots": spaces.MultiBinary(len(LABELS))})


def decision_space() -> spaces.Dict:
    """Returns the action space of NfD: a class of `PhysicalAction.nfd_class`, an angle [degrees, positive left]."""
    return spaces.Dict({"action": spaces.Discrete(len(NAVIGATION_ACTIONS)), "angle": spaces.Discrete(360, start=-180)})


def check_action(action: object, space: spaces.Dict) -> Mapping[str, Any]:
    """Returns the action if it is in the space; raises `ValueError` naming the field otherwise."""
    if not isinstance(action, Mapping):
        raise ValueError(f"action: a dict with the fields {', '.join(space)} is expected, not {type(action).__name__}")
    if extra := [name for name in action if name not in space.spaces]:
        raise ValueError(f"action: there is no field {extra[0]!r}; the fields are {', '.join(space)}")
    for name, part in space.items():
        if name not in action:
            raise ValueError(f"action: field {name!r} is missing")
        value = action[name]
        if isinstance(part, spaces.MultiBinary):
            value = np.asarray(value)
        if not part.contains(value):
            raise ValueError(f"action: field {name!r} is {action[name]!r}; it must be in {part}")
    return action


def clean_text(text: str) -> str:
    """Returns the text as a `Text` space takes it: unknown characters become "?", and its end is cut off if long."""
    return "".join(character if character in TEXT_CHARACTERS else "?" for character in text)[:MAX_UTTERANCE]


def _way(view: PointView) -> NDArray[np.float64]:
    table = np.zeros((WAY_LENGTH, 4))
    states = [(state.x, state.y, state.heading, state.speed) for state in reversed(view.way)]
    table[: len(states)] = np.nan_to_num(np.array(states).reshape(-1, 4))
    return table


def _padded(values: Sequence[float], filler: float) -> NDArray[Any]:
    dtype = np.float64 if isinstance(filler, float) else np.int64
    row = np.full(HISTORY, filler, dtype=dtype)
    row[: len(values)] = values
    return row


def _speaker(move: MoveRecord) -> int:
    return 1 + SPEAKERS.index(move.speaker) if move.speaker in SPEAKERS else 0


def _slots(moves: Sequence[MoveRecord]) -> NDArray[np.int8]:
    table = np.zeros((HISTORY, len(LABELS)), dtype=np.int8)
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


def _box(*shape: int, low: float = -REACH) -> spaces.Box:
    return spaces.Box(low, REACH, shape, dtype=np.float64)


def _text() -> spaces.Text:
    return spaces.Text(MAX_UTTERANCE, min_length=0, charset=TEXT_CHARACTERS)
