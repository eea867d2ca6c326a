"""Shallow models: boosted trees on the history without words, and logistic regression on words alone.

They show how far a task can be solved from the form of the dialogue alone; a model that understands the dialogue has to
exceed them.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, Generic, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.archive.visibility import Task
from dorothie_gym.errors import SessionError
from dorothie_gym.evaluation.teacher_forced.features.batch import Batch, BatchSpec, gather
from dorothie_gym.evaluation.teacher_forced.features.columns import CO_WIZARD, PARTICIPANT, Columns
from dorothie_gym.evaluation.teacher_forced.predictions import ActionPredictions, ActPredictions, Predictions
from dorothie_gym.ontology.actions import NAVIGATION_ACTIONS, ArgumentKind
from dorothie_gym.ontology.dialogue_acts import LABELS

if TYPE_CHECKING:
    from dorothie_gym.evaluation.teacher_forced.features.point_table import PointTable

Inputs = TypeVar("Inputs")
"""Features of n points."""

Classes: TypeAlias = NDArray[np.int64]

Classifier: TypeAlias = Any
"""Fitted classifier of scikit-learn, which has no type stubs."""

FEWEST_EXAMPLES: Final = 5
"""Slot values with fewer training points are never predicted."""

ANGLE_STEP: Final = 15.0
"""Angles are predicted as multiples of this [degrees]."""

THRESHOLDS: Final = (0.1, 0.2, 0.3, 0.4, 0.5)
"""Candidate thresholds on the probability of a slot value; the best one on the validation points is used."""

_TAKES_ARGUMENT: Final = np.array(
    [action.argument in (ArgumentKind.ANGLE, ArgumentKind.SIDE) for action in NAVIGATION_ACTIONS]
)


class ShallowModel(ABC, Generic[Inputs]):
    """Model of one task with features made by hand.

    Args:
        seed: seed of the random part of training.
        strict: whether RfN points hide the earlier acts of the Co-Wizard's own utterance.
    """

    spec: BatchSpec

    def __init__(self, seed: int = 0, *, strict: bool = False) -> None:
        self.seed = seed
        self._spec = replace(self.spec, strict=strict)
        self._kinds: Classifier = None
        self._angles: Classifier = None
        self._slots: Classifier = None
        self._values: Classes = np.zeros(0, dtype=np.int64)
        self._threshold = THRESHOLDS[-1]

    def fit(self, columns: Columns, train: PointTable, validation: PointTable) -> None:
        """Learns from training points; settings are chosen on the validation points.

        Raises:
            SessionError: there are no training points.
        """
        if not len(train):
            raise SessionError(f"there are no training points of the task {train.task.value}")
        with _one_thread():
            learned, checked = self._inputs(columns, train), self._inputs(columns, validation)
            if train.task is Task.NFD:
                self._kinds = self._fit(learned, _as_classes(train.label_action), checked, validation.label_action)
                self._fit_angles(learned, train, checked, validation)
            else:
                self._kinds = self._fit(learned, _as_classes(train.label_move), checked, validation.label_move)
                self._fit_slots(learned, train, checked, validation)

    def predict(self, columns: Columns, table: PointTable) -> Predictions:
        """Returns predictions for the points of a table of the fitted task."""
        with _one_thread():
            return self._predict(self._inputs(columns, table), table)

    def _predict(self, inputs: Inputs, table: PointTable) -> Predictions:
        kinds = _as_classes(self._kinds.predict(inputs))
        if table.task is not Task.NFD:
            return ActPredictions(moves=kinds, slots=self._slot_scores(inputs, len(table)) >= self._threshold)
        angles = np.zeros(len(table))
        turns = _TAKES_ARGUMENT[kinds]
        if self._angles is not None and turns.any():
            angles[turns] = self._angles.predict(_rows(inputs, turns)) * ANGLE_STEP
        return ActionPredictions(actions=kinds, angles=angles)

    def _inputs(self, columns: Columns, table: PointTable) -> Inputs:
        return self.features(columns, gather(columns, table, np.arange(len(table)), self._spec))

    def _fit_angles(self, learned: Inputs, train: PointTable, checked: Inputs, validation: PointTable) -> None:
        known, seen = (_TAKES_ARGUMENT[of.label_action] & ~np.isnan(of.label_angle) for of in (train, validation))
        if known.any():
            steps, wanted = (
                _as_classes(np.rint(of.label_angle[rows] / ANGLE_STEP))
                for of, rows in ((train, known), (validation, seen))
            )
            self._angles = self._fit(_rows(learned, known), steps, _rows(checked, seen), wanted)

    def _fit_slots(self, learned: Inputs, train: PointTable, checked: Inputs, validation: PointTable) -> None:
        counts = train.label_slots.sum(axis=0)
        self._values = np.flatnonzero((counts >= FEWEST_EXAMPLES) & (counts < len(train)))
        if len(self._values):
            self._slots = self._fit_values(learned, train.label_slots[:, self._values])
        scores = self._slot_scores(checked, len(validation))
        self._threshold = max(THRESHOLDS, key=lambda least: _micro_f1(scores >= least, validation.label_slots))

    def _slot_scores(self, inputs: Inputs, count: int) -> NDArray[np.float64]:
        """Returns the probability of each slot value (n, 69)."""
        scores = np.zeros((count, len(LABELS)))
        if count and len(self._values):
            scores[:, self._values] = self._probabilities(inputs)
        return scores

    def _fit(self, learned: Inputs, labels: Classes, checked: Inputs, wanted: NDArray[np.integer]) -> Classifier:
        """Returns the classifier with the best accuracy on the validation points."""
        if len(np.unique(labels)) == 1:
            return _Constant(int(labels[0]))
        return self._fit_classes(learned, labels, checked, _as_classes(wanted))

    @abstractmethod
    def features(self, columns: Columns, batch: Batch) -> Inputs:
        """Returns the features of B points."""

    @abstractmethod
    def _fit_classes(self, learned: Inputs, labels: Classes, checked: Inputs, wanted: Classes) -> Classifier:
        """Returns a classifier of several classes; its settings are chosen on the validation points."""

    @abstractmethod
    def _fit_values(self, learned: Inputs, labels: NDArray[np.bool_]) -> Classifier:
        """Returns a classifier of several flags (n, v), each of which has both values."""

    @abstractmethod
    def _probabilities(self, inputs: Inputs) -> NDArray[np.float64]:
        """Returns the probabilities of the flags (n, v)."""


@contextmanager
def _one_thread() -> Iterator[None]:
    """Limits scikit-learn to one thread: trainings run side by side, and waiting threads would slow each other down."""
    import sklearn.ensemble  # noqa: F401  # the limit holds for libraries that are loaded already
    from threadpoolctl import threadpool_limits

    with threadpool_limits(1):
        yield


class _Constant:
    """Classifier for a training set with a single class."""

    def __init__(self, value: int) -> None:
        self._value = value

    def predict(self, inputs: Any) -> Classes:
        """Returns the class for each point."""
        return np.full(inputs.shape[0], self._value, dtype=np.int64)


def _rows(inputs: Any, rows: NDArray[np.bool_]) -> Any:
    """Returns the given rows of a dense or sparse matrix."""
    return inputs[np.flatnonzero(rows)]


def _as_classes(values: NDArray[Any]) -> Classes:
    return np.asarray(values).astype(np.int64)


def _micro_f1(predicted: NDArray[np.bool_], labels: NDArray[np.bool_]) -> float:
    hits = int((predicted & labels).sum())
    return 2.0 * hits / max(int(predicted.sum()) + int(labels.sum()), 1)


# --- Boosted trees on the history -------------------------------------------------------------------------------------

_NO_AGE: Final = 1e4
"""Age of an event that has not happened [s]."""

_LAST_MOVES, _LAST_ACTIONS = 6, 4


class BoostedTrees(ShallowModel[NDArray[np.float64]]):
    """Gradient-boosted trees on moves, slots, actions and the state of the car; words are not among the inputs.

    Slot values come from one random forest for all values.
    """

    spec = BatchSpec(moves=8, utterances=0, actions=_LAST_ACTIONS, window=1, window_objects=0, objects=1)

    ITERATIONS: Final = 100
    """Maximum number of boosting iterations."""

    FOREST: Final = 100
    """Number of trees of the forest for slot values."""

    def features(self, columns: Columns, batch: Batch) -> NDArray[np.float64]:
        """Returns the features (B, n): recent moves, their slots, recent actions, ages [s], speed and distances [m]."""
        moves = np.where(batch.move_mask, 2 * batch.move + batch.move_speaker, -1)
        ages = np.where(batch.move_mask, batch.time[:, None] - batch.move_time, _NO_AGE)
        recent = _from_newest(moves, batch.move_mask, _LAST_MOVES, -1)
        parts = [
            recent,
            *(_youngest(ages, batch.move_mask & (batch.move_speaker == role)) for role in (PARTICIPANT, CO_WIZARD)),
            (batch.move_mask & (ages < 0.05)).sum(axis=1),  # earlier acts of the point's own utterance
        ]
        slots = batch.move_slots & batch.move_mask[:, :, None]
        newest = _from_newest(np.arange(slots.shape[1])[None].repeat(len(batch), 0), batch.move_mask, 1, 0)[:, 0]
        parts.append(slots[np.arange(len(batch)), newest])
        for role in (PARTICIPANT, CO_WIZARD):
            own = slots & (batch.move_speaker == role)[:, :, None]
            parts.append(own.any(axis=1))
        actions = batch.action_mask
        parts += [
            _from_newest(np.where(actions, batch.action, -1), actions, _LAST_ACTIONS, -1),
            _from_newest(batch.action_angle, actions, _LAST_ACTIONS, 0.0),
            _from_newest(batch.time[:, None] - batch.action_time, actions, _LAST_ACTIONS, _NO_AGE),
            batch.time,
            np.where(batch.window_mask.any(axis=1), batch.window_speed[:, 0], 0.0),
            np.where(batch.objects_mask[:, 0], batch.kind[:, 0], -1),
            np.where(batch.objects_mask[:, 0], batch.values[:, 0, 0], _NO_AGE),
        ]
        return np.column_stack([np.asarray(part, dtype=np.float64) for part in parts])

    def _fit_classes(
        self, learned: NDArray[np.float64], labels: Classes, checked: NDArray[np.float64], wanted: Classes
    ) -> Classifier:
        longest = self._boosted(self.ITERATIONS).fit(learned, labels)
        if not len(wanted):
            return longest
        accuracy = [np.mean(guess == wanted) for guess in longest.staged_predict(checked)]
        return self._boosted(int(np.argmax(accuracy)) + 1).fit(learned, labels)

    def _fit_values(self, learned: NDArray[np.float64], labels: NDArray[np.bool_]) -> Classifier:
        from sklearn.ensemble import RandomForestClassifier

        forest = RandomForestClassifier(self.FOREST, min_samples_leaf=2, random_state=self.seed)
        return forest.fit(learned, labels if labels.shape[1] > 1 else labels[:, 0])

    def _probabilities(self, inputs: NDArray[np.float64]) -> NDArray[np.float64]:
        found = self._slots.predict_proba(inputs)
        return np.column_stack([value[:, 1] for value in (found if isinstance(found, list) else [found])])

    def _boosted(self, iterations: int) -> Classifier:
        from sklearn.ensemble import HistGradientBoostingClassifier

        return HistGradientBoostingClassifier(
            max_iter=iterations,
            max_leaf_nodes=8,
            max_bins=32,
            max_features=0.3,
            early_stopping=False,
            random_state=self.seed,
        )


def _from_newest(values: NDArray[Any], mask: NDArray[np.bool_], count: int, filler: float) -> NDArray[Any]:
    """Returns the last entries of each sequence (B, count), newest first."""
    place = mask.sum(axis=1)[:, None] - 1 - np.arange(count)
    taken = np.take_along_axis(values, np.maximum(place, 0), axis=1)
    return np.where(place >= 0, taken, filler)


def _youngest(ages: NDArray[np.float64], mask: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Returns the smallest age among the marked entries of each row (B,)."""
    youngest: NDArray[np.float64] = np.where(mask, ages, _NO_AGE).min(axis=1)
    return youngest


# --- Logistic regression on words -------------------------------------------------------------------------------------


class WordRegression(ShallowModel[Any]):
    """Logistic regression on TF-IDF weights of the last words; neither moves nor actions are among the inputs.

    Each text field has its own vocabulary: the current utterance (UfN) or the earlier spans of the point's own
    utterance (RfN), the last utterance of each speaker, and the last six utterances together.
    """

    spec = BatchSpec(moves=8, utterances=6, actions=0, window=0, window_objects=0, objects=0)

    STRENGTHS: Final = (1.0, 10.0, 100.0)
    """Candidate inverse strengths of the regularisation; the best one on the validation points is used."""

    def __init__(self, seed: int = 0, *, strict: bool = False) -> None:
        super().__init__(seed, strict=strict)
        self._vectorizers: list[Classifier] = []

    def features(self, columns: Columns, batch: Batch) -> Any:
        """Returns the TF-IDF weights as a sparse matrix (B, n); the first call learns the vocabularies."""
        from scipy import sparse
        from sklearn.feature_extraction.text import TfidfVectorizer

        fields = _documents(columns, batch)
        if not self._vectorizers:
            self._vectorizers = [
                TfidfVectorizer(ngram_range=(1, 2), sublinear_tf=True, token_pattern=r"[^\s]+").fit([*texts, "none"])
                for texts in fields
            ]
        return sparse.hstack(
            [vectorizer.transform(texts) for vectorizer, texts in zip(self._vectorizers, fields, strict=True)]
        ).tocsr()

    def _fit_classes(self, learned: Any, labels: Classes, checked: Any, wanted: Classes) -> Classifier:
        fitted = [self._regression(strength).fit(learned, labels) for strength in self.STRENGTHS]
        if not len(wanted):
            return fitted[0]
        return max(fitted, key=lambda regression: float(regression.score(checked, wanted)))

    def _fit_values(self, learned: Any, labels: NDArray[np.bool_]) -> Classifier:
        return [self._regression(self.STRENGTHS[1]).fit(learned, flags) for flags in labels.T]

    def _probabilities(self, inputs: Any) -> NDArray[np.float64]:
        return np.column_stack([regression.predict_proba(inputs)[:, 1] for regression in self._slots])

    def _regression(self, strength: float) -> Classifier:
        from sklearn.linear_model import LogisticRegression

        return LogisticRegression(C=strength, max_iter=1000)


def _documents(columns: Columns, batch: Batch) -> tuple[list[str], ...]:
    """Returns the text fields of B points."""
    texts = (*columns.texts, "")  # -1 is the last
    own = batch.move_mask & (np.abs(batch.time[:, None] - batch.move_time) < 0.05)
    current = [
        texts[text] if text >= 0 else " ".join(texts[span] for span in spans[mask].tolist())
        for text, spans, mask in zip(batch.current_text.tolist(), batch.move_text, own, strict=True)
    ]
    last: list[list[str]] = []
    for role in (PARTICIPANT, CO_WIZARD):
        said = batch.utterance_mask & (batch.utterance_speaker == role)
        last.append(
            [texts[row[mask][-1]] if mask.any() else "" for row, mask in zip(batch.utterance_text, said, strict=True)]
        )
    together = [
        " ".join(
            f"{'P' if speaker == PARTICIPANT else 'C'}: {texts[text]}"
            for text, speaker in zip(row[mask], who[mask], strict=True)
        )
        for row, who, mask in zip(batch.utterance_text, batch.utterance_speaker, batch.utterance_mask, strict=True)
    ]
    return current, *last, together


SHALLOW: Final[Mapping[str, Callable[..., ShallowModel[Any]]]] = MappingProxyType(
    {"trees": BoostedTrees, "tfidf": WordRegression}
)
"""Constructors of the shallow models by name; arguments as in `ShallowModel`."""
