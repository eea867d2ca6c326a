"""Scores of predictions: every metric of one model and seed, by part of the corpus and by handled exception."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.archive.visibility import Task
from dorothie_gym.errors import PredictionError
from dorothie_gym.evaluation.analysis.exception_attribution import Handled
from dorothie_gym.evaluation.teacher_forced.labels import ALL, CorpusLabels, TaskLabels, Unscored
from dorothie_gym.evaluation.teacher_forced.metrics import confusion_matrix, metrics_of
from dorothie_gym.evaluation.teacher_forced.predictions import ActPredictions, Predictions, TaskPredictions
from dorothie_gym.ontology.actions import NAVIGATION_ACTIONS
from dorothie_gym.ontology.dialogue_acts import DialogueMove

if TYPE_CHECKING:
    from dorothie_gym.archive.prediction_points import Point

NEARBY_POINTS: Final = 3
"""Number of nearby points that a message names."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Scores:
    """Scores of points.

    Attributes:
        points: number of scored points of each predicted task.
        metrics: every metric by key (`ufn_move_accuracy`, ...); NaN if undefined.
        confusion: (classes, classes) counts of each task predicted; rows are labels, columns predictions.
    """

    points: Mapping[Task, int]
    metrics: Mapping[str, float]
    confusion: Mapping[Task, NDArray[np.int64]]


@dataclass(frozen=True, eq=False, kw_only=True)
class RunScore:
    """Scores of one model, trained with one seed.

    Attributes:
        model: name of the model.
        seed: seed of the training.
        parts: scores of each part of the corpus, and of `ALL`.
        handled: scores by part and by the exception that the exchange of the point handles.
        left_out: points without prediction, with reasons.
        ignored: number of rows of sessions outside the split.
    """

    model: str
    seed: int
    parts: Mapping[str, Scores]
    handled: Mapping[tuple[str, Handled], Scores]
    left_out: tuple[Unscored, ...]
    ignored: int


def class_labels(task: Task) -> tuple[str, ...]:
    """Returns the names of the classes of a task's confusion matrix: moves, or navigation actions."""
    return tuple(kind.label for kind in (NAVIGATION_ACTIONS if task is Task.NFD else DialogueMove))


def score_runs(labels: CorpusLabels, predictions: Iterable[TaskPredictions]) -> tuple[RunScore, ...]:
    """Scores predictions, separately for each model and seed.

    Raises:
        PredictionError: a session is unknown, an event is not a point of the task, a point of the split has no row or
            two, or a model, seed and task is given twice; the message names it and says what to do.
    """
    runs: dict[tuple[str, int], list[_Aligned]] = {}
    for given in predictions:
        pieces = runs.setdefault((given.model, given.seed), [])
        if any(piece.task is given.task for piece in pieces):
            raise PredictionError(f"{_where(given)}: is given twice; leave one out, or give them other seeds")
        pieces.append(_align(labels, given))
    return tuple(_score_run(labels, model, seed, pieces) for (model, seed), pieces in runs.items())


@dataclass(frozen=True, eq=False, kw_only=True)
class _Aligned:
    """Predictions of one task, in the order of the labels.

    Attributes:
        labels: the labels of the points predicted (n), in the form of a prediction.
        predicted: the predictions (n).
        parts, handled: (n,) as in the labels.
    """

    task: Task
    labels: Predictions
    predicted: Predictions
    parts: NDArray[np.str_]
    handled: NDArray[np.str_]
    left_out: tuple[Unscored, ...]
    ignored: int


def _align(labels: CorpusLabels, given: TaskPredictions) -> _Aligned:
    truth = labels.tasks[given.task]
    rows = truth.rows()
    place: dict[int, int | None] = {}  # by row of the label: row of the prediction, None where it is left out
    answers: dict[tuple[str, int], int | None] = dict.fromkeys(given.left_out)
    answers |= {key: k for k, key in enumerate(zip(given.sessions.tolist(), given.events.tolist(), strict=True))}
    if len(answers) < len(given.events) + len(given.left_out):
        raise PredictionError(f"{_where(given)}: a point has two rows; leave one of them out")
    for key, answer in answers.items():
        if key in rows:
            place[rows[key]] = answer
        else:
            _check_other(labels, truth, given, key)
    left_out = tuple(
        Unscored(session=key[0], event=key[1], task=given.task, reason=reason)
        for key, reason in given.left_out.items()
        if key in rows
    )
    _check_complete(truth, given, [row for row in range(len(truth)) if row not in place])
    there = np.array([row for row in sorted(place) if place[row] is not None], dtype=np.int64)
    return _Aligned(
        task=given.task,
        labels=truth.labels.take(there),
        predicted=given.predicted.take(np.array([place[row] for row in there.tolist()], dtype=np.int64)),
        parts=truth.parts[there],
        handled=truth.handled[there],
        left_out=left_out,
        ignored=len(answers) - len(place),
    )


def _where(given: TaskPredictions) -> str:
    return f"{given.source}: model {given.model}, seed {given.seed}, {given.task.value}"


def _check_other(labels: CorpusLabels, truth: TaskLabels, given: TaskPredictions, key: tuple[str, int]) -> None:
    """Accepts a row of a session outside the split; raises if the session or the point does not exist."""
    session, event = key
    where = f"{_where(given)}, session {session}"
    if session in labels.others or session in labels.unreadable:
        return
    if session not in labels.part_of:
        some = ", ".join(sorted(labels.part_of)[:NEARBY_POINTS])
        raise PredictionError(
            f"{where}: {labels.root} has no such session; a session is named by its folder, like {some}"
        )
    events = truth.events[truth.sessions == session]
    near = sorted(events[np.argsort(np.abs(events - event), kind="stable")[:NEARBY_POINTS]].tolist())
    points = f"its nearest points are events {', '.join(map(str, near))}" if near else "it has no point of the task"
    raise PredictionError(
        f"{where}, event {event}: is no point of {given.task.value}; leave the row out, or correct the event's number, "
        f"counted from 0 in the session: {points}"
    )


def _check_complete(truth: TaskLabels, given: TaskPredictions, missing: Sequence[int]) -> None:
    if not missing:
        return
    row = missing[0]
    raise PredictionError(
        f"{_where(given)}: {len(missing)} of {len(truth)} points have no row, the first is session "
        f"{truth.sessions[row]}, event {truth.events[row]}; predict them, or write rows whose column 'skipped' says "
        "why not"
    )


def _score_run(labels: CorpusLabels, model: str, seed: int, pieces: Sequence[_Aligned]) -> RunScore:
    parts = dict.fromkeys((*labels.parts, ALL))
    return RunScore(
        model=model,
        seed=seed,
        parts={part: _scores(pieces, part) for part in parts},
        handled={(part, kind): _scores(pieces, part, kind) for part in parts for kind in Handled},
        left_out=tuple(skipped for piece in pieces for skipped in piece.left_out),
        ignored=sum(piece.ignored for piece in pieces),
    )


def _scores(pieces: Sequence[_Aligned], part: str, kind: Handled | None = None) -> Scores:
    points: dict[Task, int] = {}
    metrics: dict[str, float] = {}
    confusion: dict[Task, NDArray[np.int64]] = {}
    for piece in pieces:
        mask = np.ones(len(piece.parts), dtype=np.bool_) if part == ALL else piece.parts == part
        if kind is not None:
            mask &= piece.handled == kind.value
        predicted, truth = piece.predicted.take(mask), piece.labels.take(mask)
        points[piece.task] = len(predicted)
        metrics |= score_task(piece.task, predicted, truth)
        confusion[piece.task] = confusion_matrix(_classes(truth), _classes(predicted), len(class_labels(piece.task)))
    return Scores(points=points, metrics=metrics, confusion=confusion)


def score_task(task: Task, predicted: Predictions, labels: Sequence[Point] | Predictions) -> dict[str, float]:
    """Returns every metric of a task by its key with the task's name; NaN if undefined.

    Args:
        task: the task.
        predicted: the predictions.
        labels: the points, or their labels in the form of a prediction.
    """
    return {f"{task.value}_{key}": metric.compute(predicted, labels) for key, metric in metrics_of(task).items()}


def _classes(predicted: Predictions) -> NDArray[np.int64]:
    return predicted.moves if isinstance(predicted, ActPredictions) else predicted.actions
