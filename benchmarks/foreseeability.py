"""Shares of moves and navigation actions that are foreseen without words, or from words and the last move alone.

The models are scikit-learn's with its defaults, fitted to the fold `train` and scored on `val` and `test`; no setting
is chosen:

- `history`: `HistGradientBoostingClassifier` on the last moves with their speakers, the last physical actions with
  their angles, and the ages of both; no words, slots or places.
- `state`: the same classifier on the features of the row `trees` of `dorothie-gym train`, with slots and the car.
- `moves`: the same classifier on the last moves with their speakers alone.
- `words`: `LogisticRegression` on TF-IDF weights of the last utterances and on the last move.
"""

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Final

import numpy as np
import typer
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table
from scipy import sparse
from sklearn.ensemble import HistGradientBoostingClassifier
from sklearn.linear_model import LogisticRegression
from threadpoolctl import threadpool_limits

from dorothie_gym.archive import Task
from dorothie_gym.cli.output import reporting_errors
from dorothie_gym.evaluation.teacher_forced.features import BatchSpec, Columns, PointTable, build, gather, points
from dorothie_gym.evaluation.teacher_forced.shallow_models import BoostedTrees, WordRegression

MOVES, ACTIONS = 6, 4
"""Number of moves and of physical actions in the history."""

NEVER: Final = 1e4
"""Age of an event that has not happened [s]."""


def history(columns: Columns, table: PointTable) -> NDArray[np.float64]:
    """Returns moves, actions and times (n, 26): the information of a listener without words.

    Columns: the last moves, newest first, each with its speaker, and their ages [s]; the last actions, their angles
    [degrees] and ages [s]; the time [s]; the number of earlier acts of the point's own utterance.
    """
    spec = BatchSpec(moves=MOVES, utterances=0, actions=ACTIONS, window=0, window_objects=0, objects=0)
    batch = gather(columns, table, np.arange(len(table)), spec)
    moves, actions = batch.move_mask, batch.action_mask
    now = batch.time[:, None]
    own = moves & (now - batch.move_time < 0.05)
    return np.column_stack(
        [
            _newest_first(2 * batch.move + batch.move_speaker, moves, -1),
            _newest_first(now - batch.move_time, moves, NEVER),
            _newest_first(batch.action, actions, -1),
            _newest_first(batch.action_angle, actions, 0.0),
            _newest_first(now - batch.action_time, actions, NEVER),
            batch.time,
            own.sum(axis=1),
        ]
    )


def _newest_first(values: NDArray[Any], mask: NDArray[np.bool_], filler: float) -> NDArray[np.float64]:
    """Returns sequences that end with padding with their entries reversed, and the filler in place of padding."""
    place = mask.sum(axis=1)[:, None] - 1 - np.arange(mask.shape[1])
    newest = np.take_along_axis(values, np.maximum(place, 0), axis=1)
    return np.where(place >= 0, newest, filler).astype(np.float64)


def _last_move(columns: Columns, table: PointTable) -> sparse.csr_matrix:
    """Returns the last move and its speaker, one-hot (n, 31)."""
    spec = BatchSpec(moves=1, utterances=0, actions=0, window=0, window_objects=0, objects=0)
    batch = gather(columns, table, np.arange(len(table)), spec)
    last = np.where(batch.move_mask, 1 + 2 * batch.move + batch.move_speaker, 0)[:, 0]
    return sparse.csr_matrix(np.eye(31)[last])


def _moves(columns: Columns, tables: Sequence[PointTable]) -> list[Any]:
    return [history(columns, table)[:, :MOVES] for table in tables]


def _histories(columns: Columns, tables: Sequence[PointTable]) -> list[Any]:
    return [history(columns, table) for table in tables]


def _states(columns: Columns, tables: Sequence[PointTable]) -> list[Any]:
    model = BoostedTrees()
    return [model.features(columns, gather(columns, table, np.arange(len(table)), model.spec)) for table in tables]


def _words(columns: Columns, tables: Sequence[PointTable]) -> list[Any]:
    model = WordRegression()
    return [
        sparse.hstack(
            [
                model.features(columns, gather(columns, table, np.arange(len(table)), model.spec)),
                _last_move(columns, table),
            ]
        ).tocsr()
        for table in tables
    ]


MODELS: Final[Mapping[str, Callable[[Columns, Sequence[PointTable]], list[Any]]]] = {
    "history": _histories,
    "moves": _moves,
    "state": _states,
    "words": _words,
}
"""Features of each model for several tables; `words` takes its vocabulary from the first one."""

TASKS: Final[Mapping[str, tuple[Task, ...]]] = {
    "history": tuple(Task),
    "moves": (Task.UFN, Task.RFN),
    "state": tuple(Task),
    "words": (Task.UFN, Task.RFN),
}
"""Tasks of each model."""

UNSEEN: Final = 1e-4
"""Smallest probability of a class that is counted, also of one that was not learned."""

LIMITS: Final = {("history", Task.UFN): 0.52, ("history", Task.NFD): 0.65, ("words", Task.UFN): 0.80}
"""Largest shares that are accepted."""


def _foreseen(columns: Columns, task: Task, name: str) -> dict[str, float]:
    """Returns accuracy and bits per point of a model at a task, the share of the commonest class, and counts."""
    tables = [points(columns, task, fold) for fold in ("train", "val", "test")]
    learned, *unseen = MODELS[name](columns, tables)
    labels, *truths = (each.label_action if task is Task.NFD else each.label_move for each in tables)
    # the regression does not converge in its default of 100 iterations
    words = name == "words"
    model = LogisticRegression(max_iter=1000) if words else HistGradientBoostingClassifier(random_state=0)
    model.fit(learned, labels)
    truth = np.concatenate(truths)
    shares = np.concatenate([model.predict_proba(inputs) for inputs in unseen if inputs.shape[0]])
    found = model.classes_[shares.argmax(axis=1)]
    of_truth = (shares * (model.classes_ == truth[:, None])).sum(axis=1)
    return {
        "accuracy": float(np.mean(found == truth)),
        "bits": float(-np.log2(np.maximum(of_truth, UNSEEN)).mean()),
        "majority": float(np.mean(truth == np.bincount(labels).argmax())),
        "points": len(truth),
        "training_points": len(labels),
    }


def main(
    corpus: Annotated[Path, typer.Argument(help="folder of the corpus, with folds")],
    as_json: Annotated[bool, typer.Option("--json", help="print JSON")] = False,
) -> None:
    """Prints the share of points that each model foresees and its bits per point, beside the commonest class."""
    with reporting_errors(), threadpool_limits(1):
        columns = build(corpus)
        found = {name: {task.value: _foreseen(columns, task, name) for task in tasks} for name, tasks in TASKS.items()}
    if as_json:
        print(json.dumps(found))
        return
    table = Table("model", "task", "foreseen", "at most", "bits", "commonest", "points")
    for name, tasks in found.items():
        for task, shares in tasks.items():
            limit = LIMITS.get((name, Task(task)))
            table.add_row(
                name,
                task,
                f"{100 * shares['accuracy']:.1f} %",
                "" if limit is None else f"{100 * limit:.0f} %",
                f"{shares['bits']:.2f}",
                f"{100 * shares['majority']:.1f} %",
                f"{shares['points']:,}",
            )
    Console().print(table)


if __name__ == "__main__":
    typer.run(main)
