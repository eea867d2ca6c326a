"""Trains a small dialogue model on the three tasks, writes its predictions, and evaluates them.

The model is logistic regression on the words of the current and the last two utterances and on the last three moves. It
shows the complete path from a corpus to scores: columns, points, batches, `predictions.parquet`, evaluation. Without
`--corpus`, the default corpus of 20 sessions is used, which is generated once (30 s to 2 minutes); training and
evaluation then take about 20 seconds.

    python examples/dialogue_model.py --out predictions.parquet
    dorothie-gym evaluate predictions.parquet        # the same scores in detail
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from scipy.sparse import csr_matrix, hstack
from sklearn.feature_extraction.text import HashingVectorizer
from sklearn.linear_model import LogisticRegression

from dorothie_gym.archive import Task
from dorothie_gym.evaluation import teacher_forced
from dorothie_gym.evaluation.rollout import default_corpus
from dorothie_gym.evaluation.teacher_forced.features import BatchSpec, Columns, PointTable, build, gather, points
from dorothie_gym.ontology import DialogueMove


def features(columns: Columns, table: PointTable) -> csr_matrix:
    """Returns a row per point: hashed words of the last utterances, and the last moves as one-hot vectors."""
    batch = gather(columns, table, np.arange(len(table)), BatchSpec(moves=3, utterances=2))
    words = HashingVectorizer(n_features=1024, ngram_range=(1, 2), alternate_sign=False)
    blocks = [
        words.transform([columns.texts[k] if k >= 0 else "" for k in indices])  # -1 means no text
        for indices in (batch.current_text, *batch.utterance_text.T)
    ]
    for column, mask in zip(batch.move.T, batch.move_mask.T, strict=True):
        one_hot = np.eye(len(DialogueMove))[np.maximum(column, 0)]
        blocks.append(csr_matrix(one_hot * mask[:, None]))
    return hstack(blocks).tocsr()


def predict(columns: Columns, task: Task) -> teacher_forced.TaskPredictions:
    """Fits the fold "train" and predicts the points of the fold "test"."""
    train, test = points(columns, task, "train"), points(columns, task, "test")
    labels = train.label_action if task is Task.NFD else train.label_move
    model = LogisticRegression(max_iter=200).fit(features(columns, train), labels)
    classes = model.predict(features(columns, test)).astype(np.int64)
    predicted: teacher_forced.ActionPredictions | teacher_forced.ActPredictions
    if task is Task.NFD:  # the median angle of each action
        angles = np.array([np.nanmedian(train.label_angle[labels == k]) for k in range(labels.max() + 1)])
        predicted = teacher_forced.ActionPredictions(actions=classes, angles=np.nan_to_num(angles[classes]))
    else:  # slots that most points have; better slots need a better model
        slots = np.tile(train.label_slots.mean(axis=0) > 0.5, (len(test), 1))
        predicted = teacher_forced.ActPredictions(moves=classes, slots=slots)
    sessions = np.array(columns.sessions.names)[test.session]
    events = test.event.astype(np.int64)
    return teacher_forced.TaskPredictions(
        model="mine", seed=0, task=task, sessions=sessions, events=events, predicted=predicted
    )


def main() -> None:
    """Writes the predictions of all tasks and prints three metrics."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--corpus", type=Path, help="folder made by `dorothie-gym generate`")
    parser.add_argument("--out", type=Path, default=Path("predictions.parquet"))
    options = parser.parse_args()

    corpus = options.corpus or default_corpus()
    columns = build(corpus)
    teacher_forced.write_predictions(options.out, [predict(columns, task) for task in Task])
    for part, metrics in teacher_forced.evaluate_files([options.out], corpus).to_json()["models"]["mine"].items():
        for key in ("ufn_move_accuracy", "rfn_move_accuracy", "nfd_action_accuracy"):
            print(f"{part:8}{key:24}{metrics[key]['mean']:.3f}")


if __name__ == "__main__":
    main()
