"""What a model predicts for a list of points, as arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.ontology import LABELS, NAVIGATION_ACTIONS, DialogueMove
from dorothie_gym.sessions import DecisionPoint, InferencePoint


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
        """Returns those at some rows: their numbers, or a mask (n,)."""
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
        """Returns those at some rows: their numbers, or a mask (n,)."""
        return ActionPredictions(actions=self.actions[rows], angles=self.angles[rows])


Predictions: TypeAlias = ActPredictions | ActionPredictions


def act_labels(points: Sequence[InferencePoint] | ActPredictions) -> ActPredictions:
    """Returns the labels of the points, in the form of a prediction; what is in that form already stays as it is."""
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
    if classes.ndim != 1 or (len(classes) and not (0 <= classes.min() and classes.max() < count)):
        raise ValueError(f"{name} must be one row of classes in 0..{count - 1}, got shape {classes.shape}")
