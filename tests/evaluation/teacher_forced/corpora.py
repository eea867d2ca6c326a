"""Small corpora and predictions made in code."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from dorothie_gym.archive import Task
from dorothie_gym.evaluation.teacher_forced import ActionPredictions, ActPredictions, CorpusLabels, TaskPredictions
from dorothie_gym.ontology import LABELS, DialogueMove
from tests.session.recording.builders import write
from tests.session.recording.dialogues import talk

FOLDS = ("train", "val/seen", "val/unseen", "test/seen", "test/unseen")


def corpus(root: Path, folds: tuple[str, ...] = FOLDS) -> Path:
    """A corpus with a session in each fold, named after it: 4 UfN, 3 RfN and 5 NfD points each."""
    for fold in folds:
        (root / fold).mkdir(parents=True, exist_ok=True)
        write(root / fold / f"of-{fold.replace('/', '-')}", talk())
    return root


def oracle(labels: CorpusLabels, model: str = "oracle", seed: int = 0, shift: int = 0) -> list[TaskPredictions]:
    """Returns the labels as predictions; shifted: those of the point `shift` rows before, of the same task."""
    found = []
    for task, truth in labels.tasks.items():
        rows = np.roll(np.arange(len(truth)), shift)
        found.append(
            TaskPredictions(
                model=model,
                seed=seed,
                task=task,
                sessions=truth.sessions,
                events=truth.events,
                predicted=truth.labels.take(rows),
            )
        )
    return found


def wrong_moves(labels: CorpusLabels, model: str, seed: int, share: float) -> TaskPredictions:
    """UfN predictions of which the first `share` of the points has the right act, and the rest Irrelevant."""
    truth = labels.tasks[Task.UFN]
    assert isinstance(truth.labels, ActPredictions)
    right = np.arange(len(truth)) < share * len(truth)
    moves = np.where(right, truth.labels.moves, int(DialogueMove.IRRELEVANT))
    return TaskPredictions(
        model=model,
        seed=seed,
        task=Task.UFN,
        sessions=truth.sessions,
        events=truth.events,
        predicted=ActPredictions(moves=moves, slots=truth.labels.slots & right[:, None]),
    )


def no_acts(count: int) -> ActPredictions:
    return ActPredictions(moves=np.zeros(count, np.int64), slots=np.zeros((count, len(LABELS)), np.bool_))


def no_actions(count: int) -> ActionPredictions:
    return ActionPredictions(actions=np.zeros(count, np.int64), angles=np.zeros(count))
