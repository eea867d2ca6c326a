"""The whole table: every model trained with every seed on a corpus, tested, and scored."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from dorothie_gym.baselines.material import TEST
from dorothie_gym.baselines.rows import ROWS, Row
from dorothie_gym.baselines.runs import PREDICTIONS_FILE, RESULT_FILE, Job
from dorothie_gym.benchmark import (
    FLOORS,
    ResultsTable,
    TaskPredictions,
    evaluate_predictions,
    labels_of,
    predict_floor,
    read_predictions,
)
from dorothie_gym.recording import Corpus

PREDICTIONS: Final = PREDICTIONS_FILE
"""Name of the file with the predictions of all models and seeds."""


def table_jobs(
    corpus: Path, out: Path, *, encoder: str = "auto", size: str = "small", seeds: int = 5, rows: Sequence[Row] = ROWS
) -> list[Job]:
    """Returns the trainings of a table, seed by seed, so that there is a whole table as soon as may be."""
    return [
        Job(corpus=corpus, encoder=encoder, model=row.command, size=size, seed=seed, out=out)
        for seed in range(seeds)
        for row in rows
        if not row.missing
    ]


def gather_table(jobs: Sequence[Job], *, floors: bool = True) -> tuple[ResultsTable, tuple[TaskPredictions, ...]]:
    """Scores what finished trainings predicted, and the floors beside them.

    Args:
        jobs: trainings of one corpus, all done.
        floors: whether the floors get rows, drawn with the same seeds.

    Returns:
        The table, and the predictions behind it.

    Raises:
        ValueError: there is no job.
        PredictionError: a file of predictions does not fit the corpus.
        SessionError: the corpus cannot be read.
    """
    if not jobs:
        raise ValueError("there is nothing to put into the table: choose a model")
    corpus = Corpus.load(jobs[0].corpus)
    labels = labels_of(corpus, TEST)
    predicted = list(read_predictions(*(job.folder / PREDICTIONS_FILE for job in jobs)))
    if floors:
        training = labels_of(corpus, "train")
        seeds = sorted({job.seed for job in jobs})
        predicted += [part for name in FLOORS for seed in seeds for part in predict_floor(name, training, labels, seed)]
    about: dict[str, Any] = {}
    for job in jobs:
        told = json.loads((job.folder / RESULT_FILE).read_text(encoding="utf-8"))
        about.setdefault(job.row.name, {})[str(job.seed)] = told
    chosen = {job.model for job in jobs}
    whole = chosen >= {row.command for row in ROWS if not row.missing}
    missing = {row.name: row.missing for row in ROWS if row.missing} if whole else {}
    return evaluate_predictions(predicted, labels, missing=missing, about=about), tuple(predicted)
