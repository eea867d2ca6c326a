"""Extraction of the columns of one session."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.archive.prediction_points import (
    SPEAKERS,
    SessionHistory,
    at_tenths,
    history_angle,
    is_decision,
    label_angle,
    unpointed_events,
)
from dorothie_gym.archive.recorded_perception import OBJECT_VALUES, light_switches, perceived
from dorothie_gym.evaluation.analysis.exception_attribution import Handled, handling_of_events
from dorothie_gym.evaluation.analysis.units import Units
from dorothie_gym.evaluation.teacher_forced.features.columns import NO_TEXT, TownGraph
from dorothie_gym.maps.lane_graph import FEATURES
from dorothie_gym.maps.model import NO_JUNCTION
from dorothie_gym.ontology.dialogue_acts import LABELS
from dorothie_gym.ontology.slots import GoalStatus
from dorothie_gym.session.recording.events import ActionRecord, EventType, UtteranceRecord
from dorothie_gym.session.recording.header import NO_LANE, SessionHeader
from dorothie_gym.session.recording.trajectory import FRAMES_PER_TENTH, TENTHS, Trajectory

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.session.recording.session import Session

HEADING_STEP: Final = 1e-3
"""Headings are rounded to this [degrees], so that they do not depend on the unit in a file."""

HANDLINGS: Final = (Handled.NONE, Handled.TASK, Handled.ENVIRONMENTAL)
"""Meaning of the numbers in columns `handling`."""


@dataclass(frozen=True, eq=False, kw_only=True)
class SessionColumns:
    """Columns of one session by "group.field", with indices within the session.

    Attributes:
        arrays: by "group.field".
        texts: distinct texts.
        town: name of the town.
        seed: seed of the session, -1 if there is none.
        unpointed: flagged events that are not points, (event, reason) each.
        signature: hash of the above, independent of the layout of the session.
    """

    arrays: dict[str, NDArray[np.generic]]
    texts: tuple[str, ...]
    town: str
    seed: int
    unpointed: tuple[tuple[int, str], ...]
    signature: str


def extract(session: Session, town: Town | None) -> SessionColumns:
    """Returns the columns of a session; `town` is None if it is unknown."""
    session = at_tenths(session)
    texts = TextPool()
    handled = {event: HANDLINGS.index(kind) for event, kind in handling_of_events(Units(session)).items()}
    rows = session.trajectory
    pose = poses(rows)
    looks = tuple(perceived(session.scene, pose, rows["frame"], light_switches(session), town))
    arrays = {
        **place_columns(session.header, texts),  # first: numbers of texts then do not depend on later utterances
        **utterance_columns(SessionHistory(session).utterances, texts, handled),
        **action_columns(session.physical_actions, handled),
        **frame_columns(rows, pose, _speeds(rows), looks, known=town is not None),
        **_goals(session),
        "sessions.has_objects": np.array([len(session.scene.actors) > 0]),
    }
    unpointed = unpointed_events(session)
    content = hashlib.sha256(repr((session.header.town, list(texts.numbers), unpointed)).encode())
    for name in sorted(arrays):
        content.update(f"{name} {arrays[name].dtype} {arrays[name].shape}".encode() + arrays[name].tobytes())
    seed = session.header.seed
    return SessionColumns(
        arrays=arrays,
        texts=tuple(texts.numbers),
        town=session.header.town,
        seed=-1 if seed is None else seed,
        unpointed=unpointed,
        signature=content.hexdigest(),
    )


class TextPool:
    """Numbers of distinct texts, in the order in which they first occur.

    Args:
        texts: distinct texts that have the first numbers.
    """

    def __init__(self, texts: Sequence[str] = ()) -> None:
        self.numbers: dict[str, int] = {text: number for number, text in enumerate(texts)}

    def number(self, text: str | None) -> int:
        """Returns the number of a text, a new one if the text is new; `NO_TEXT` for None."""
        return NO_TEXT if text is None else self.numbers.setdefault(text, len(self.numbers))


def utterance_columns(
    spoken: Sequence[UtteranceRecord], texts: TextPool, handled: Mapping[int, int]
) -> dict[str, NDArray[np.generic]]:
    """Returns the columns of moves and utterances.

    Args:
        spoken: utterances of participant and Co-Wizard, by the frame at which they ended.
        texts: numbers of texts, extended by those of the utterances.
        handled: value of the columns `handling` by number of the event.
    """
    over = [utterance.frame // FRAMES_PER_TENTH for utterance in spoken]
    for utterance in spoken:
        for text in (utterance.text, utterance.moves[0].recognised, *(move.span for move in utterance.moves)):
            texts.number(text)
    moves = [(row, move) for row, utterance in enumerate(spoken) for move in utterance.moves]
    return {
        "utterances.tenth": _ints(over),
        "utterances.speaker": _ints([SPEAKERS.index(utterance.speaker) for utterance in spoken]),
        "utterances.text": _ints([texts.number(utterance.text) for utterance in spoken]),
        "utterances.recognised_text": _ints([texts.number(utterance.moves[0].recognised) for utterance in spoken]),
        "moves.tenth": _ints([over[row] for row, _ in moves]),
        "moves.point_tenth": _ints([move.frame // FRAMES_PER_TENTH for _, move in moves]),
        "moves.event": _ints([move.index for _, move in moves]),
        "moves.speaker": _ints([SPEAKERS.index(move.speaker) for _, move in moves]),
        "moves.utterance": _ints([row for row, _ in moves]),
        "moves.move": _ints([int(move.act.move) for _, move in moves]),
        "moves.slots": np.array([move.act.vector for _, move in moves], dtype=np.bool_).reshape(-1, len(LABELS)),
        "moves.span_text": _ints([texts.number(move.span) for _, move in moves]),
        "moves.flagged": np.array([move.flagged for _, move in moves], dtype=np.bool_),
        "moves.handling": _ints([handled[move.index] for _, move in moves]),
    }


def action_columns(actions: Sequence[ActionRecord], handled: Mapping[int, int]) -> dict[str, NDArray[np.generic]]:
    """Returns the columns of physical actions; `handled` is as in `utterance_columns`."""
    return {
        "actions.tenth": _ints([act.frame // FRAMES_PER_TENTH for act in actions]),
        "actions.event": _ints([act.index for act in actions]),
        "actions.action": _ints([act.action.value - 1 for act in actions]),
        "actions.angle": np.array([history_angle(act) for act in actions], dtype=np.float32),
        "actions.up": _ints([0 if act.up is None else (1 if act.up else -1) for act in actions]),
        "actions.label_angle": np.array([label_angle(act) for act in actions], dtype=np.float32),
        "actions.flagged": np.array([is_decision(act) for act in actions], dtype=np.bool_),
        "actions.handling": _ints([handled[act.index] for act in actions]),
    }


def poses(rows: Trajectory) -> NDArray[np.float64]:
    """Returns x, y [m] and heading [degrees, clockwise, in [-180, 180)] of rows of a trajectory (n, 3)."""
    degrees = np.rint(np.degrees(rows["heading"]) / HEADING_STEP) * HEADING_STEP
    return np.stack([rows["x"], rows["y"], (degrees + 180.0) % 360.0 - 180.0], axis=1)


def _speeds(rows: Trajectory) -> NDArray[np.float64]:
    """Returns the speed over the tenth before each row (n,) [m/s]; 0 for the first."""
    speed = np.zeros(len(rows))
    if len(rows) > 1:
        way = np.hypot(np.diff(rows["x"]), np.diff(rows["y"]))
        speed[1:] = way / (np.diff(rows["frame"] // FRAMES_PER_TENTH) / TENTHS)
    return speed


def frame_columns(
    rows: Trajectory,
    pose: NDArray[np.float64],
    speed: NDArray[np.float64],
    looks: Sequence[tuple[int, NDArray[np.int64], NDArray[np.float64]]],
    *,
    known: bool,
) -> dict[str, NDArray[np.generic]]:
    """Returns the columns of frames, looks and objects.

    Args:
        rows: trajectory at tenths of a second (n,).
        pose: (n, 3) as `poses` returns them.
        speed: (n,) [m/s].
        looks: frame, kinds and values of each look, as `perceived` yields them.
        known: whether the lanes of the town are known.
    """
    tenths = rows["frame"] // FRAMES_PER_TENTH
    look_tenths = np.array([frame // FRAMES_PER_TENTH for frame, _, _ in looks], dtype=np.int64)
    kinds = [kind for _, kind, _ in looks]
    values = [value for _, _, value in looks]
    return {
        "frames.tenth": tenths.astype(np.int32),
        "frames.pose": pose.astype(np.float32),
        "frames.speed": speed.astype(np.float32),
        "frames.lane": (rows["lane"] if known else np.full(len(rows), NO_LANE)).astype(np.int32),
        "frames.look": (np.searchsorted(look_tenths, tenths, side="right") - 1).astype(np.int32),
        "looks.tenth": look_tenths.astype(np.int32),
        "looks.start": np.concatenate(([0], np.cumsum([len(kind) for kind in kinds]))).astype(np.int64)[:-1],
        "objects.kind": np.concatenate([*kinds, np.empty(0, dtype=np.int64)]).astype(np.int32),
        "objects.values": np.concatenate(values or [np.empty((0, len(OBJECT_VALUES)))]).astype(np.float32),
    }


def place_columns(header: SessionHeader, texts: TextPool) -> dict[str, NDArray[np.generic]]:
    """Returns the columns of streets, and of the landmarks that the Co-Wizard knows."""
    known = [row for row in header.landmarks if not row["hidden"]]
    return {
        "landmarks.place": _pairs([(row["x"], row["y"]) for row in known]),
        "landmarks.lane": _ints([row["lane"] for row in known]),
        "landmarks.street": _ints([row["street"] for row in known]),
        "landmarks.text": _ints([texts.number(row["name"]) for row in known]),
        "streets.text": _ints([texts.number(name) for name in header.street_names]),
    }


def _goals(session: Session) -> dict[str, NDArray[np.generic]]:
    """Subgoals that were completed, and where they were."""
    header, tenths, places = session.header, [], []
    for event in session.of_type(EventType.SUBGOAL):
        number = event.data.get("subgoal")
        if event.data.get("status") == GoalStatus.COMPLETE.label and isinstance(number, int):
            if 0 <= number < len(header.subgoals):
                landmark = header.landmarks[header.subgoals[number]["landmark"]]
                tenths.append(event.frame // FRAMES_PER_TENTH)
                places.append((landmark["x"], landmark["y"]))
    return goal_columns(tenths, places)


def goal_columns(tenths: Sequence[int], places: Sequence[tuple[float, float]]) -> dict[str, NDArray[np.generic]]:
    """Returns the columns of goals that were reached at tenths (n,), at places x, y (n, 2) [m]."""
    return {"goals.tenth": _ints(tenths), "goals.place": _pairs(places)}


def _ints(values: Sequence[int]) -> NDArray[np.int32]:
    return np.array(values, dtype=np.int32).reshape(-1)


def _pairs(values: Sequence[tuple[float, float]]) -> NDArray[np.float32]:
    return np.array(values, dtype=np.float32).reshape(-1, 2)


# --- The lane graph of a town as arrays ------------------------------------------------------------------------------


def town_graph(name: str, town: Town | None) -> TownGraph:
    """Returns the graph of a town; without lanes if unknown."""
    if town is None:
        empty = np.empty(0, dtype=np.int32)
        return TownGraph(
            name=name, lanes=np.empty((0, len(FEATURES)), dtype=np.float32), road=empty, junction=empty, street=empty,
            edges=empty.reshape(2, 0), edge_types=empty, member_start=np.zeros(1, dtype=np.int32), members=empty,
        )  # fmt: skip
    graph = town.to_graph()
    members = [graph.members(street) for street in range(graph.num_streets)]
    inside = graph.junction_ids != NO_JUNCTION
    junction = np.zeros(len(graph), dtype=np.int32)
    junction[inside] = 1 + np.unique(graph.junction_ids[inside], return_inverse=True)[1]
    return TownGraph(
        name=name,
        lanes=graph.features.astype(np.float32),
        road=np.unique(graph.road_ids, return_inverse=True)[1].astype(np.int32),
        junction=junction,
        street=graph.street.astype(np.int32),
        edges=np.ascontiguousarray(graph.edges.T, dtype=np.int32),
        edge_types=graph.edge_types.astype(np.int32),
        member_start=np.concatenate(([0], np.cumsum([len(lanes) for lanes in members]))).astype(np.int32),
        members=np.concatenate([*members, np.empty(0)]).astype(np.int32),
    )
