"""Predictions of a model for a list of points, as arrays and as a Parquet file."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.archive.visibility import Task
from dorothie_gym.errors import PredictionError
from dorothie_gym.ontology.actions import NAVIGATION_ACTIONS
from dorothie_gym.ontology.dialogue_acts import LABELS, DialogueMove
from dorothie_gym.support.files import replacing
from dorothie_gym.support.libraries import pa, pq

if TYPE_CHECKING:
    from dorothie_gym.archive.prediction_points import DecisionPoint, InferencePoint
    from dorothie_gym.ontology.slots import SlotValue


@dataclass(frozen=True, eq=False)
class ActPredictions:
    """Dialogue acts of n points (UfN, RfN).

    Attributes:
        moves: (n,) ids of moves.
        slots: (n, 69) bool, in the order of `LABELS`.

    Raises:
        ValueError: another shape or a value out of range; the message names the field.
    """

    moves: NDArray[np.int64]
    slots: NDArray[np.bool_]

    def __post_init__(self) -> None:
        """Checks shapes and ranges."""
        _check_classes("moves", self.moves, len(DialogueMove))
        if self.slots.shape != (len(self.moves), len(LABELS)):
            raise ValueError(f"slots have shape {self.slots.shape}; it must be {(len(self.moves), len(LABELS))}")

    def __len__(self) -> int:
        return len(self.moves)

    def take(self, rows: NDArray[np.int64] | NDArray[np.bool_]) -> ActPredictions:
        """Returns the predictions of the given rows, which are numbers or a mask (n,)."""
        return ActPredictions(moves=self.moves[rows], slots=self.slots[rows])


@dataclass(frozen=True, eq=False)
class ActionPredictions:
    """Navigation actions of n points (NfD).

    Attributes:
        actions: (n,) classes, see `PhysicalAction.nfd_class`.
        angles: (n,) arguments [degrees, positive left].

    Raises:
        ValueError: another shape or a value out of range; the message names the field.
    """

    actions: NDArray[np.int64]
    angles: NDArray[np.float64]

    def __post_init__(self) -> None:
        """Checks shapes and ranges."""
        _check_classes("actions", self.actions, len(NAVIGATION_ACTIONS))
        if self.angles.shape != self.actions.shape:
            raise ValueError(f"angles have shape {self.angles.shape}; it must be {self.actions.shape}")

    def __len__(self) -> int:
        return len(self.actions)

    def take(self, rows: NDArray[np.int64] | NDArray[np.bool_]) -> ActionPredictions:
        """Returns the predictions of the given rows, which are numbers or a mask (n,)."""
        return ActionPredictions(actions=self.actions[rows], angles=self.angles[rows])


Predictions: TypeAlias = ActPredictions | ActionPredictions


def act_labels(points: Sequence[InferencePoint] | ActPredictions) -> ActPredictions:
    """Returns the labels of the points, in the form of a prediction; labels in that form are returned unchanged."""
    if isinstance(points, ActPredictions):
        return points
    return ActPredictions(
        moves=np.array([int(point.act.move) for point in points], dtype=np.int64),
        slots=np.array([point.act.vector for point in points], dtype=np.bool_).reshape(-1, len(LABELS)),
    )


def action_labels(points: Sequence[DecisionPoint] | ActionPredictions) -> ActionPredictions:
    """Returns the labels of the points, in the form of a prediction; an unknown angle is NaN."""
    if isinstance(points, ActionPredictions):
        return points
    return ActionPredictions(
        actions=np.array([point.action.nfd_class for point in points], dtype=np.int64),
        angles=np.array([point.angle for point in points], dtype=np.float64),
    )


def joined_acts(pieces: Sequence[ActPredictions]) -> ActPredictions:
    """Returns the pieces in one, in their order."""
    none = act_labels(())
    return ActPredictions(
        moves=np.concatenate([none.moves, *(piece.moves for piece in pieces)]),
        slots=np.concatenate([none.slots, *(piece.slots for piece in pieces)]),
    )


def joined_actions(pieces: Sequence[ActionPredictions]) -> ActionPredictions:
    """Returns the pieces in one, in their order."""
    none = action_labels(())
    return ActionPredictions(
        actions=np.concatenate([none.actions, *(piece.actions for piece in pieces)]),
        angles=np.concatenate([none.angles, *(piece.angles for piece in pieces)]),
    )


def _check_classes(name: str, classes: NDArray[np.int64], count: int) -> None:
    if classes.ndim != 1 or (len(classes) and not (classes.min() >= 0 and classes.max() < count)):
        raise ValueError(f"{name} must be one row of classes in 0..{count - 1}, got shape {classes.shape}")


# --- file ------------------------------------------------------------------------------------------------------------

VERSION: Final = 1
"""Version of the columns, stated in every row."""

ABOUT: Final = b"dorothie_gym.about"
"""Key of the metadata of the file; its value is a JSON object with the provenance of the predictions."""


@dataclass(frozen=True, eq=False, kw_only=True)
class TaskPredictions:
    """Predictions of one model, trained with one seed, for the points of one task.

    Attributes:
        model: name of the model, as the table shows it.
        seed: seed of the training.
        task: the task.
        sessions: (n,) names of the sessions.
        events: (n,) numbers of the points' events within their sessions.
        predicted: the predictions (n).
        left_out: reason for each point that the model cannot predict, by session and event.
        source: origin of the predictions, for messages.
    """

    model: str
    seed: int
    task: Task
    sessions: NDArray[np.str_]
    events: NDArray[np.int64]
    predicted: Predictions
    left_out: Mapping[tuple[str, int], str] = field(default_factory=dict)
    source: str = "predictions"

    def __post_init__(self) -> None:
        """Checks that there are as many predictions as points, and of the task's kind."""
        if not len(self.sessions) == len(self.events) == len(self.predicted):
            raise PredictionError(
                f"{self.source}: there are {len(self.sessions)} sessions, {len(self.events)} events and "
                f"{len(self.predicted)} predictions; give one of each for a point"
            )
        if isinstance(self.predicted, ActionPredictions) != (self.task is Task.NFD):
            raise PredictionError(f"{self.source}: {type(self.predicted).__name__} are no predictions of {self.task}")


def slot_text(value: SlotValue) -> str:
    """Returns the text of a slot value in a file: "Landmark=KFC"."""
    return f"{value.slot.label}={value.label}"


SLOT_TEXTS: Final = tuple(slot_text(value) for value in LABELS)
"""Text of each of the 69 labels in a file, in the order of `LABELS`."""


def file_schema() -> pa.Schema:
    """Returns the columns that `write_predictions` writes."""
    return pa.schema(
        [
            ("version", pa.int32()),
            ("model", pa.string()),
            ("seed", pa.int64()),
            ("task", pa.string()),
            ("session", pa.string()),
            ("event", pa.int64()),
            ("move", pa.string()),
            ("slots", pa.list_(pa.string())),
            ("action", pa.string()),
            ("angle", pa.float64()),
            ("skipped", pa.string()),
        ]
    )


def write_predictions(
    path: Path | str, predictions: Iterable[TaskPredictions], *, about: Mapping[str, object] | None = None
) -> Path:
    """Writes a file of predictions in one step; an older file is replaced.

    Args:
        path: the file.
        predictions: predictions of any models, seeds and tasks.
        about: provenance (encoder, configuration, hash of the corpus, ...) in JSON types; stored as metadata.

    Returns:
        Its path.

    Raises:
        OSError: it cannot be written.
    """
    schema = file_schema()
    if about is not None:
        schema = schema.with_metadata({ABOUT: json.dumps(about, sort_keys=True, allow_nan=False).encode()})
    target = Path(path)
    with replacing(target) as part, pq.ParquetWriter(part, schema, compression="zstd") as writer:
        for given in predictions:
            writer.write_table(pa.Table.from_pydict(_columns(given), schema=schema))
    return target


def _columns(given: TaskPredictions) -> dict[str, list[object]]:
    n, left_out = len(given.events), list(given.left_out.items())
    rows = n + len(left_out)
    return {
        "version": [VERSION] * rows,
        "model": [given.model] * rows,
        "seed": [given.seed] * rows,
        "task": [given.task.value] * rows,
        "session": [*given.sessions.tolist(), *(session for (session, _), _ in left_out)],
        "event": [*given.events.tolist(), *(event for (_, event), _ in left_out)],
        **{name: [*values, *[None] * len(left_out)] for name, values in _answers(given.predicted).items()},
        "skipped": [*[None] * n, *(reason for _, reason in left_out)],
    }


def _answers(predicted: Predictions) -> dict[str, Sequence[object]]:
    empty: list[None] = [None] * len(predicted)
    if isinstance(predicted, ActPredictions):
        moves = [DialogueMove(move).label for move in predicted.moves.tolist()]
        slots = [[SLOT_TEXTS[place] for place in np.flatnonzero(row)] for row in predicted.slots]
        return {"move": moves, "slots": slots, "action": empty, "angle": empty}
    actions = [NAVIGATION_ACTIONS[action].label for action in predicted.actions.tolist()]
    return {"move": empty, "slots": empty, "action": actions, "angle": predicted.angles.tolist()}
