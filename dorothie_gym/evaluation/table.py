"""The table of the three tasks: a model, some sessions to learn from, others to be tested on."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from dorothie_gym.evaluation.metrics import (
    ActionAccuracy,
    ArgumentAccuracy,
    JointAccuracy,
    JointAccuracyPaper,
    MoveAccuracy,
    SlotF1,
    SlotScorePaper,
    confusion_matrix,
    per_class_accuracy,
)
from dorothie_gym.evaluation.models import TaskModel, make_model
from dorothie_gym.evaluation.predictions import act_labels, action_labels
from dorothie_gym.ontology import NAVIGATION_ACTIONS, DialogueMove
from dorothie_gym.sessions import (
    DecisionPoint,
    InferencePoint,
    Session,
    SessionError,
    Task,
    load_readable,
    nfd_points,
    rfn_points,
    split_by_name,
    ufn_points,
)

SPLIT = "first half of the sessions by name trains, the second half tests"


def parse_tasks(text: str) -> tuple[Task, ...]:
    """Returns the tasks that a comma-separated text names, "all" for every one; raises `ValueError` otherwise."""
    names = [name.strip().lower() for name in text.split(",")]
    if names == ["all"]:
        return tuple(Task)
    for name in names:
        if name not in {task.value for task in Task}:
            raise ValueError(f"task {name!r} is unknown; choose from {', '.join(task.value for task in Task)}, or all")
    return tuple(task for task in Task if task.value in names)


def evaluate_folder(
    path: Path | str, tasks: Sequence[Task] = tuple(Task), model: str = "majority", seed: int = 0
) -> dict[str, Any]:
    """Evaluates a model on the sessions in a folder, split as `SPLIT` says.

    Returns:
        The table of `evaluate_tasks`, and `split`, `sessions_unreadable` ({name: reason}).

    Raises:
        SessionError: there are not two readable sessions in the folder.
        ValueError: the model is unknown.
    """
    sessions, unreadable = load_readable(path)
    if len(sessions) < 2:
        reasons = "; ".join(unreadable.values())
        raise SessionError(
            f"{path}: holds {len(sessions)} readable session(s); a split needs at least 2"
            + (f" ({reasons})" if reasons else "")
        )
    train, test = split_by_name(sessions)
    table = evaluate_tasks(train, test, tasks, model, seed)
    return {**table, "split": SPLIT, "sessions_unreadable": unreadable}


def evaluate_tasks(
    sessions_train: Sequence[Session],
    sessions_test: Sequence[Session],
    tasks: Sequence[Task] = tuple(Task),
    model: str = "majority",
    seed: int = 0,
) -> dict[str, Any]:
    """Fits a model on some sessions and scores it on others.

    Returns:
        JSON types; None where a number is undefined. `model`, `seed`, `sessions_train`, `sessions_test` and
        `sessions_incomplete` (names of tested sessions that were cut off); for each task T `T_points` (scored),
        `T_skipped` (points that could not be scored, whole or in part: nothing to learn from, or an angle that the
        recording does not know), `T_per_class` ({label: accuracy}), `T_confusion` (rows are labels); for UfN and RfN
        `T_move_accuracy`, `T_slot_f1` (micro), `T_slot_f1_macro`, `T_slot_f1_type`, `T_slot_score_paper`; for NfD
        `nfd_action_accuracy`, `nfd_argument_accuracy`, `nfd_joint_accuracy` and the last two with `_paper`.

    Raises:
        ValueError: the model is unknown.
    """
    table: dict[str, Any] = {
        "model": model,
        "seed": seed,
        "sessions_train": len(sessions_train),
        "sessions_test": len(sessions_test),
        "sessions_incomplete": [session.name for session in sessions_test if not session.complete],
    }
    for task in tasks:
        fresh = make_model(model, seed)
        if task is Task.NFD:
            train_decisions = [point for session in sessions_train for point in nfd_points(session)]
            test_decisions = [point for session in sessions_test for point in nfd_points(session)]
            scores = _evaluate_actions(fresh, train_decisions, test_decisions)
        else:
            points = ufn_points if task is Task.UFN else rfn_points
            train = [point for session in sessions_train for point in points(session)]
            test = [point for session in sessions_test for point in points(session)]
            scores = _evaluate_acts(fresh, train, test)
        table.update({f"{task.value}_{key}": value for key, value in scores.items()})
    return table


def _evaluate_acts(model: TaskModel, train: Sequence[InferencePoint], test: Sequence[InferencePoint]) -> dict[str, Any]:
    skipped = 0 if train else len(test)
    points = test if train else ()
    if train:
        model.fit_acts(train)
        predicted = model.predict_acts([point.view for point in points])
    else:
        predicted = act_labels(())
    metrics = {
        "move_accuracy": MoveAccuracy(),
        "slot_f1": SlotF1(),
        "slot_f1_macro": SlotF1(average="macro"),
        "slot_f1_type": SlotF1(average="type"),
        "slot_score_paper": SlotScorePaper(),
    }
    return {
        **{key: _defined(metric.compute(predicted, points)) for key, metric in metrics.items()},
        **_by_class(act_labels(points).moves, predicted.moves, [move.label for move in DialogueMove]),
        "points": len(points),
        "skipped": skipped,
    }


def _evaluate_actions(
    model: TaskModel, train: Sequence[DecisionPoint], test: Sequence[DecisionPoint]
) -> dict[str, Any]:
    skipped = sum(math.isnan(point.angle) for point in test) if train else len(test)
    points = test if train else ()
    if train:
        model.fit_actions(train)
        predicted = model.predict_actions([point.view for point in points])
    else:
        predicted = action_labels(())
    metrics: Mapping[str, ActionAccuracy | ArgumentAccuracy | JointAccuracy] = {
        "action_accuracy": ActionAccuracy(),
        "argument_accuracy": ArgumentAccuracy(),
        "joint_accuracy": JointAccuracy(),
        "argument_accuracy_paper": ArgumentAccuracy(wrap=False),
        "joint_accuracy_paper": JointAccuracyPaper(),
    }
    return {
        **{key: _defined(metric.compute(predicted, points)) for key, metric in metrics.items()},
        **_by_class(action_labels(points).actions, predicted.actions, [action.label for action in NAVIGATION_ACTIONS]),
        "points": len(points),
        "skipped": skipped,
    }


def _by_class(truth: np.ndarray[Any, Any], guess: np.ndarray[Any, Any], labels: Sequence[str]) -> dict[str, Any]:
    confusion = confusion_matrix(truth, guess, len(labels))
    shares = per_class_accuracy(confusion)
    return {
        "per_class": {label: float(share) for label, share in zip(labels, shares, strict=True) if not np.isnan(share)},
        "confusion": confusion.tolist(),
    }


def _defined(value: float) -> float | None:
    return None if math.isnan(value) else value
