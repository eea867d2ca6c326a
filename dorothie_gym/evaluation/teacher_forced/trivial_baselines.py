"""Trivial baselines, which ignore the input: majority and random."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.archive.visibility import Task
from dorothie_gym.evaluation.teacher_forced.predictions import (
    ActionPredictions,
    ActPredictions,
    Predictions,
    TaskPredictions,
    act_labels,
    action_labels,
)
from dorothie_gym.ontology.actions import NAVIGATION_ACTIONS
from dorothie_gym.ontology.dialogue_acts import LABELS, DialogueMove

if TYPE_CHECKING:
    from dorothie_gym.archive.prediction_points import DecisionPoint, InferencePoint
    from dorothie_gym.evaluation.teacher_forced.labels import CorpusLabels, TaskLabels


class FloorModel(ABC):
    """Model that predicts from the labels of its training points only."""

    def __init__(self) -> None:
        self._acts: ActPredictions | None = None
        self._actions: ActionPredictions | None = None

    def fit_acts(self, points: Sequence[InferencePoint] | ActPredictions) -> None:
        """Learns dialogue acts (UfN, RfN) from points or their labels; raises `ValueError` when there are none."""
        if not len(points):
            raise ValueError("there are no points to learn dialogue acts from")
        self._acts = act_labels(points)

    def fit_actions(self, points: Sequence[DecisionPoint] | ActionPredictions) -> None:
        """Learns navigation actions (NfD) from points or their labels; raises `ValueError` when there are none."""
        if not len(points):
            raise ValueError("there are no points to learn navigation actions from")
        self._actions = action_labels(points)

    @abstractmethod
    def predict_acts(self, count: int) -> ActPredictions:
        """Returns acts for `count` points; raises `ValueError` before `fit_acts`."""

    @abstractmethod
    def predict_actions(self, count: int) -> ActionPredictions:
        """Returns actions for `count` points; raises `ValueError` before `fit_actions`."""

    def _known_acts(self) -> ActPredictions:
        if self._acts is None:
            raise ValueError("the model is not fitted to dialogue acts: call fit_acts first")
        return self._acts

    def _known_actions(self) -> ActionPredictions:
        if self._actions is None:
            raise ValueError("the model is not fitted to navigation actions: call fit_actions first")
        return self._actions


class MajorityModel(FloorModel):
    """Predicts the most frequent move, action and integer angle of that action, and slots of more than half the points.

    Ties are broken by the smallest id (angle). Unknown angles are left out.
    """

    def predict_acts(self, count: int) -> ActPredictions:
        """Returns the same act for each point."""
        known = self._known_acts()
        move = np.bincount(known.moves, minlength=len(DialogueMove)).argmax()
        slots = known.slots.mean(axis=0) > 0.5  # (69,)
        return ActPredictions(
            moves=np.full(count, move, dtype=np.int64),
            slots=np.tile(slots, (count, 1)).reshape(-1, len(LABELS)),
        )

    def predict_actions(self, count: int) -> ActionPredictions:
        """Returns the same action and angle for each point."""
        known = self._known_actions()
        action = np.bincount(known.actions, minlength=len(NAVIGATION_ACTIONS)).argmax()
        angle = _mode(np.rint(known.angles[(known.actions == action) & ~np.isnan(known.angles)]))
        return ActionPredictions(
            actions=np.full(count, action, dtype=np.int64), angles=np.full(count, angle, dtype=np.float64)
        )


class RandomModel(FloorModel):
    """Predicts for each point the label of a random training point: chance at the true frequencies.

    An unknown angle is predicted as 0.

    Args:
        seed: seed of the draws; equal seeds give equal predictions.
    """

    def __init__(self, seed: int = 0) -> None:
        super().__init__()
        self._seed = seed

    def predict_acts(self, count: int) -> ActPredictions:
        """Returns an act for each point."""
        known = self._known_acts()
        drawn = self._draw(count, len(known))
        return ActPredictions(moves=known.moves[drawn], slots=known.slots[drawn])

    def predict_actions(self, count: int) -> ActionPredictions:
        """Returns an action and its angle for each point."""
        known = self._known_actions()
        drawn = self._draw(count, len(known))
        return ActionPredictions(actions=known.actions[drawn], angles=np.nan_to_num(known.angles[drawn], nan=0.0))

    def _draw(self, count: int, choices: int) -> NDArray[np.int64]:
        return np.random.default_rng(self._seed).integers(choices, size=count)


FLOORS: Final[Mapping[str, Callable[[int], FloorModel]]] = MappingProxyType(
    {"majority": lambda seed: MajorityModel(), "random": RandomModel}
)
"""Constructor of each trivial baseline from a seed."""


def make_floor(name: str, seed: int = 0) -> FloorModel:
    """Returns a new model; raises `ValueError` with the known names if the name is unknown."""
    if name not in FLOORS:
        raise ValueError(f"model {name!r} is unknown; choose one of {', '.join(FLOORS)}")
    return FLOORS[name](seed)


def predict_floor(name: str, train: CorpusLabels, test: CorpusLabels, seed: int = 0) -> tuple[TaskPredictions, ...]:
    """Returns the predictions of a trivial baseline for each task, fitted on other labels.

    A task without training points has every point left out, with that reason.

    Raises:
        ValueError: the name is unknown.
    """
    return tuple(_predict(make_floor(name, seed), name, seed, train.tasks[task], test.tasks[task]) for task in Task)


def _predict(floor: FloorModel, name: str, seed: int, train: TaskLabels, test: TaskLabels) -> TaskPredictions:
    count = len(test) if len(train) else 0
    predicted: Predictions = train.labels.take(np.zeros(0, dtype=np.int64))
    if count and isinstance(train.labels, ActionPredictions):
        floor.fit_actions(train.labels)
        predicted = floor.predict_actions(count)
    elif count and isinstance(train.labels, ActPredictions):
        floor.fit_acts(train.labels)
        predicted = floor.predict_acts(count)
    keys = zip(test.sessions[count:].tolist(), test.events[count:].tolist(), strict=True)
    return TaskPredictions(
        model=name,
        seed=seed,
        task=test.task,
        sessions=test.sessions[:count],
        events=test.events[:count],
        predicted=predicted,
        left_out={key: "the sessions to learn from have no point of the task" for key in keys},
        source=name,
    )


def _mode(values: NDArray[np.float64]) -> float:
    if len(values) == 0:
        return 0.0
    distinct, counts = np.unique(values, return_counts=True)
    return float(distinct[counts.argmax()])
