"""Open-loop metrics of the three tasks (paper, section 5, Evaluation).

Every metric compares predictions with the labels of points and returns one number; NaN where it is undefined.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, ClassVar, Final, Generic, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.archive.prediction_points import ANGLE_TOLERANCE, DecisionPoint, InferencePoint
from dorothie_gym.archive.visibility import Task
from dorothie_gym.evaluation.teacher_forced.predictions import (
    ActionPredictions,
    ActPredictions,
    Predictions,
    act_labels,
    action_labels,
)
from dorothie_gym.ontology.dialogue_acts import SLOT_SPANS, VECTOR_SLOTS

PointT = TypeVar("PointT", InferencePoint, DecisionPoint)
PredictionsT = TypeVar("PredictionsT", ActPredictions, ActionPredictions)


class Metric(ABC, Generic[PredictionsT, PointT]):
    """Metric of predictions.

    Attributes:
        name: name of the metric in tables.
    """

    name: ClassVar[str]

    @abstractmethod
    def compute(self, predicted: PredictionsT, points: Sequence[PointT] | PredictionsT) -> float:
        """Returns a number in [0, 1], or NaN if undefined.

        Args:
            predicted: predictions of a model for the points.
            points: the points, or their labels in the form of a prediction (`act_labels`, `action_labels`).

        Raises:
            ValueError: the numbers of predictions and points differ.
        """


ActMetric = Metric[ActPredictions, InferencePoint]
ActionMetric = Metric[ActionPredictions, DecisionPoint]


@dataclass(frozen=True, kw_only=True)
class MoveAccuracy(ActMetric):
    """Share of points whose move is correct."""

    name: ClassVar[str] = "move accuracy"

    def compute(self, predicted: ActPredictions, points: Sequence[InferencePoint] | ActPredictions) -> float:
        """Returns a share in [0, 1]; NaN when `points` is empty."""
        _check_lengths(predicted, points)
        return _share(predicted.moves == act_labels(points).moves)


@dataclass(frozen=True, kw_only=True)
class SlotF1(ActMetric):
    """F1 over (slot, value) pairs; a point without slots and without a prediction counts in none.

    Attributes:
        average: "micro" counts pairs over all points; "macro" is the mean of the F1 of each of the 69 labels that
            occurs; "type" is micro over the five slots, regardless of their values.
    """

    name: ClassVar[str] = "slot F1"
    average: Literal["micro", "macro", "type"] = "micro"

    def compute(self, predicted: ActPredictions, points: Sequence[InferencePoint] | ActPredictions) -> float:
        """Returns F1 in [0, 1]; NaN when no slot occurs and none is predicted ("macro": when none occurs)."""
        _check_lengths(predicted, points)
        truth, guess = act_labels(points).slots, predicted.slots  # (n, 69) each
        if self.average == "type":
            truth, guess = _slot_types(truth), _slot_types(guess)  # (n, 5) each
        hits, wrong = (truth & guess).sum(axis=0), (truth ^ guess).sum(axis=0)  # per label
        if self.average != "macro":
            return _f1(int(hits.sum()), int(wrong.sum()))
        scores = [_f1(int(hits[label]), int(wrong[label])) for label in np.flatnonzero(truth.any(axis=0))]
        return float(np.mean(scores)) if scores else math.nan


@dataclass(frozen=True, kw_only=True)
class SlotScorePaper(ActMetric):
    """Share of points whose 69 bits all match, which appears to be the paper's slot score (spec/metrics.md)."""

    name: ClassVar[str] = "slot score, paper protocol"

    def compute(self, predicted: ActPredictions, points: Sequence[InferencePoint] | ActPredictions) -> float:
        """Returns a share in [0, 1]; NaN when `points` is empty."""
        _check_lengths(predicted, points)
        return _share((predicted.slots == act_labels(points).slots).all(axis=1))


@dataclass(frozen=True, kw_only=True)
class ActionAccuracy(ActionMetric):
    """Share of points whose navigation action is correct."""

    name: ClassVar[str] = "action accuracy"

    def compute(self, predicted: ActionPredictions, points: Sequence[DecisionPoint] | ActionPredictions) -> float:
        """Returns a share in [0, 1]; NaN when `points` is empty."""
        _check_lengths(predicted, points)
        return _share(predicted.actions == action_labels(points).actions)


@dataclass(frozen=True, kw_only=True)
class ArgumentAccuracy(ActionMetric):
    """Share of points whose angle is correct, on the circle; points with an unknown angle are ignored.

    Attributes:
        tolerance: errors below it are accepted [degrees].
        wrap: whether the error is taken on the circle, where 179 and -179 differ by 2; the published code does not.
    """

    name: ClassVar[str] = "argument accuracy"
    tolerance: float = ANGLE_TOLERANCE
    wrap: bool = True

    def compute(self, predicted: ActionPredictions, points: Sequence[DecisionPoint] | ActionPredictions) -> float:
        """Returns a share in [0, 1]; NaN when no point has a known angle."""
        _check_lengths(predicted, points)
        known, right = _angles(predicted, points, self.tolerance, self.wrap)
        return _share(right[known])


@dataclass(frozen=True, kw_only=True)
class ArgumentAccuracyPaper(ArgumentAccuracy):
    """Argument accuracy as published: the error of the angle is not taken on the circle."""

    name: ClassVar[str] = "argument accuracy, paper protocol"
    wrap: bool = False


@dataclass(frozen=True, kw_only=True)
class JointAccuracy(ActionMetric):
    """Share of points whose action and angle are both correct; points with an unknown angle are ignored.

    Attributes:
        tolerance: errors of the angle below it are accepted [degrees].
    """

    name: ClassVar[str] = "joint accuracy"
    wrap: ClassVar[bool] = True
    tolerance: float = ANGLE_TOLERANCE

    def compute(self, predicted: ActionPredictions, points: Sequence[DecisionPoint] | ActionPredictions) -> float:
        """Returns a share in [0, 1]; NaN when no point has a known angle."""
        _check_lengths(predicted, points)
        known, right = _angles(predicted, points, self.tolerance, self.wrap)
        return _share((right & (predicted.actions == action_labels(points).actions))[known])


@dataclass(frozen=True, kw_only=True)
class JointAccuracyPaper(JointAccuracy):
    """Joint accuracy as published: the error of the angle is not taken on the circle."""

    name: ClassVar[str] = "joint accuracy, paper protocol"
    wrap: ClassVar[bool] = False


def confusion_matrix(truth: NDArray[np.int64], guess: NDArray[np.int64], classes: int) -> NDArray[np.int64]:
    """Returns counts (classes, classes): rows are labels, columns predictions."""
    matrix = np.zeros((classes, classes), dtype=np.int64)
    np.add.at(matrix, (truth, guess), 1)
    return matrix


def per_class_accuracy(confusion: NDArray[np.int64]) -> NDArray[np.float64]:
    """Returns the share of each class's points that is right (classes,); NaN for a class that does not occur."""
    counts = confusion.sum(axis=1).astype(np.float64)
    counts[counts == 0] = np.nan
    shares: NDArray[np.float64] = np.diagonal(confusion) / counts
    return shares


def wrap_degrees(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Returns the angles in [-180, 180)."""
    wrapped: NDArray[np.float64] = (angles + 180.0) % 360.0 - 180.0
    return wrapped


def _angles(
    predicted: ActionPredictions, points: Sequence[DecisionPoint] | ActionPredictions, tolerance: float, wrap: bool
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Returns the masks of known angles (n,) and of correct angles (n,)."""
    error = predicted.angles - action_labels(points).angles
    error = wrap_degrees(error) if wrap else error
    return ~np.isnan(error), np.abs(error) < tolerance


def _slot_types(slots: NDArray[np.bool_]) -> NDArray[np.bool_]:
    return np.stack([slots[:, SLOT_SPANS[slot]].any(axis=1) for slot in VECTOR_SLOTS], axis=1)


def _f1(hits: int, wrong: int) -> float:
    """Returns F1 from the number of correct pairs and of missing or superfluous pairs."""
    return 2 * hits / (2 * hits + wrong) if hits + wrong else math.nan


def _share(right: NDArray[np.bool_]) -> float:
    return float(np.mean(right)) if len(right) else math.nan


def _check_lengths(predicted: Predictions, points: Sequence[object] | Predictions) -> None:
    if len(predicted) != len(points):
        raise ValueError(f"there are {len(predicted)} predictions for {len(points)} points; give one for each")


# --- tasks and columns -----------------------------------------------------------------------------------------------

PAPER_SUFFIX: Final = "_paper"
"""Ending of the key of a metric that follows the protocol of the paper's code."""

ACT_METRICS: Final[Mapping[str, ActMetric]] = MappingProxyType(
    {
        "move_accuracy": MoveAccuracy(),
        "slot_f1": SlotF1(),
        "slot_f1_macro": SlotF1(average="macro"),
        "slot_f1_type": SlotF1(average="type"),
        "move_accuracy_paper": MoveAccuracy(),
        "slot_f1_paper": SlotScorePaper(),
    }
)
"""Metrics of UfN and RfN. The paper's protocol for moves is the same; its slot score is not F1."""

ACTION_METRICS: Final[Mapping[str, ActionMetric]] = MappingProxyType(
    {
        "action_accuracy": ActionAccuracy(),
        "argument_accuracy": ArgumentAccuracy(),
        "joint_accuracy": JointAccuracy(),
        "action_accuracy_paper": ActionAccuracy(),
        "argument_accuracy_paper": ArgumentAccuracyPaper(),
        "joint_accuracy_paper": JointAccuracyPaper(),
    }
)
"""Metrics of NfD. The paper's protocol for actions is the same."""

COLUMNS: Final = (
    "ufn_move_accuracy",
    "ufn_slot_f1",
    "rfn_move_accuracy",
    "rfn_slot_f1",
    "nfd_action_accuracy",
    "nfd_joint_accuracy",
)
"""The six columns of the paper's table, in its order."""

SHOWN: Final = (
    "ufn_move_accuracy", "ufn_slot_f1", "ufn_slot_f1_paper", "rfn_move_accuracy", "rfn_slot_f1", "rfn_slot_f1_paper",
    "nfd_action_accuracy", "nfd_joint_accuracy", "nfd_joint_accuracy_paper",
)  # fmt: skip
"""Columns of the results table: those of the paper, and its own protocol where that differs."""

TASK_NAMES: Final[Mapping[Task, str]] = MappingProxyType({Task.UFN: "UfN", Task.RFN: "RfN", Task.NFD: "NfD"})
"""Names of the tasks in the paper."""


def metrics_of(task: Task) -> Mapping[str, Metric[Any, Any]]:
    """Returns the metrics of a task by their keys, which lack the task's name: `move_accuracy`, ..."""
    return ACTION_METRICS if task is Task.NFD else ACT_METRICS


def keys_of(task: Task) -> tuple[str, ...]:
    """Returns the keys of a task's metrics with the task's name: `ufn_move_accuracy`, ..."""
    return tuple(f"{task.value}_{key}" for key in metrics_of(task))


def title_of(key: str) -> str:
    """Returns the title of the metric of a key with the task's name: "UfN slot F1 (macro)"."""
    return f"{task_of(key)} {metric_title(key.partition('_')[2])}"


def task_of(key: str) -> str:
    """Returns the name of the task of a key: "UfN"."""
    return TASK_NAMES[Task(key.partition("_")[0])]


def metric_title(name: str) -> str:
    """Returns the title of a metric key without the name of the task: "slot F1 (macro)"."""
    base = name.removesuffix(PAPER_SUFFIX)
    words = _SHORT.get(base) or base.replace("_", " ")
    return f"{words} (paper)" if name.endswith(PAPER_SUFFIX) else words


def shown_title(key: str) -> str:
    """Returns the heading of a column of our table, without the task: "slot F1", "slots (paper)"."""
    return _HEADINGS[key.partition("_")[2]]


def has_paper_figure(key: str) -> bool:
    """Returns whether a column of our table is computed as the paper's figures are."""
    return key in SHOWN and key + PAPER_SUFFIX not in SHOWN


_SHORT: Final = {"slot_f1": "slot F1", "slot_f1_macro": "slot F1 (macro)", "slot_f1_type": "slot F1 (by slot type)"}
_HEADINGS: Final = {
    "move_accuracy": "move acc.",
    "slot_f1": "slot F1",
    "slot_f1_paper": "slots (paper)",
    "action_accuracy": "action acc.",
    "joint_accuracy": "joint acc.",
    "joint_accuracy_paper": "joint (paper)",
}
