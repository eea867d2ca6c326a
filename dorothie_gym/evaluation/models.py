"""The two simplest models: what any other must beat."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Final

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.evaluation.predictions import ActionPredictions, ActPredictions, act_labels, action_labels
from dorothie_gym.ontology import LABELS, NAVIGATION_ACTIONS, DialogueMove
from dorothie_gym.sessions import DecisionPoint, InferencePoint, View


class TaskModel(ABC):
    """A model of one task: it learns from points, and predicts from views, which hold no labels."""

    @abstractmethod
    def fit_acts(self, points: Sequence[InferencePoint]) -> None:
        """Learns dialogue acts (UfN, RfN); raises `ValueError` when there is nothing to learn from."""

    @abstractmethod
    def predict_acts(self, views: Sequence[View]) -> ActPredictions:
        """Returns an act for each view; raises `ValueError` before `fit_acts`."""

    @abstractmethod
    def fit_actions(self, points: Sequence[DecisionPoint]) -> None:
        """Learns navigation actions (NfD); raises `ValueError` when there is nothing to learn from."""

    @abstractmethod
    def predict_actions(self, views: Sequence[View]) -> ActionPredictions:
        """Returns an action for each view; raises `ValueError` before `fit_actions`."""


class _LabelModel(TaskModel):
    """A model that keeps the labels it was shown."""

    def __init__(self) -> None:
        self._acts: ActPredictions | None = None
        self._actions: ActionPredictions | None = None

    def fit_acts(self, points: Sequence[InferencePoint]) -> None:
        if not points:
            raise ValueError("there are no points to learn dialogue acts from")
        self._acts = act_labels(points)

    def fit_actions(self, points: Sequence[DecisionPoint]) -> None:
        if not points:
            raise ValueError("there are no points to learn navigation actions from")
        self._actions = action_labels(points)

    def _known_acts(self) -> ActPredictions:
        if self._acts is None:
            raise ValueError("the model has learnt no dialogue acts: call fit_acts first")
        return self._acts

    def _known_actions(self) -> ActionPredictions:
        if self._actions is None:
            raise ValueError("the model has learnt no navigation actions: call fit_actions first")
        return self._actions


class MajorityModel(_LabelModel):
    """Always the commonest: move, action, the action's commonest whole angle; slots that over half the points have.

    Among equally common ones, the one with the smallest id (angle) is taken. Unknown angles do not count.
    """

    def predict_acts(self, views: Sequence[View]) -> ActPredictions:
        """Returns the same act for each view."""
        known = self._known_acts()
        move = np.bincount(known.moves, minlength=len(DialogueMove)).argmax()
        slots = known.slots.mean(axis=0) > 0.5  # (69,)
        return ActPredictions(
            moves=np.full(len(views), move, dtype=np.int64),
            slots=np.tile(slots, (len(views), 1)).reshape(-1, len(LABELS)),
        )

    def predict_actions(self, views: Sequence[View]) -> ActionPredictions:
        """Returns the same action and angle for each view."""
        known = self._known_actions()
        action = np.bincount(known.actions, minlength=len(NAVIGATION_ACTIONS)).argmax()
        angle = _mode(np.rint(known.angles[(known.actions == action) & ~np.isnan(known.angles)]))
        return ActionPredictions(
            actions=np.full(len(views), action, dtype=np.int64), angles=np.full(len(views), angle, dtype=np.float64)
        )


class RandomModel(_LabelModel):
    """For each view the label of a point drawn at random from those it learnt from: chance at the true frequencies.

    An unknown angle is predicted as 0.

    Args:
        seed: seed of the draws; equal seeds give equal predictions.
    """

    def __init__(self, seed: int = 0) -> None:
        super().__init__()
        self._seed = seed

    def predict_acts(self, views: Sequence[View]) -> ActPredictions:
        """Returns an act for each view."""
        known = self._known_acts()
        drawn = self._draw(len(views), len(known))
        return ActPredictions(moves=known.moves[drawn], slots=known.slots[drawn])

    def predict_actions(self, views: Sequence[View]) -> ActionPredictions:
        """Returns an action and its angle for each view."""
        known = self._known_actions()
        drawn = self._draw(len(views), len(known))
        return ActionPredictions(actions=known.actions[drawn], angles=np.nan_to_num(known.angles[drawn], nan=0.0))

    def _draw(self, count: int, choices: int) -> NDArray[np.int64]:
        return np.random.default_rng(self._seed).integers(choices, size=count)


MODELS: Final[Mapping[str, Callable[[int], TaskModel]]] = MappingProxyType(
    {"majority": lambda seed: MajorityModel(), "random": RandomModel}
)
"""How to make each model from a seed."""


def make_model(name: str, seed: int = 0) -> TaskModel:
    """Returns a new model; raises `ValueError` naming the known ones when there is none of that name."""
    if name not in MODELS:
        raise ValueError(f"model {name!r} is unknown; choose one of {', '.join(MODELS)}")
    return MODELS[name](seed)


def _mode(values: NDArray[np.float64]) -> float:
    if len(values) == 0:
        return 0.0
    distinct, counts = np.unique(values, return_counts=True)
    return float(distinct[counts.argmax()])
