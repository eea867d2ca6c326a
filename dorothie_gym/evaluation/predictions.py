"""What a model predicts for a list of points, as arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

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


def act_labels(points: Sequence[InferencePoint]) -> ActPredictions:
    """Returns the labels of the points, in the form of a prediction."""
    return ActPredictions(
        moves=np.array([int(point.act.move) for point in points], dtype=np.int64),
        slots=np.array([point.act.vector for point in points], dtype=np.bool_).reshape(-1, len(LABELS)),
    )


def action_labels(points: Sequence[DecisionPoint]) -> ActionPredictions:
    """Returns the labels of the points, in the form of a prediction; an unknown angle is NaN."""
    return ActionPredictions(
        actions=np.array([point.action.nfd_class for point in points], dtype=np.int64),
        angles=np.array([point.angle for point in points], dtype=np.float64),
    )


def _check_classes(name: str, classes: NDArray[np.int64], count: int) -> None:
    if classes.ndim != 1 or (len(classes) and not (0 <= classes.min() and classes.max() < count)):
        raise ValueError(f"{name} must be one row of classes in 0..{count - 1}, got shape {classes.shape}")
