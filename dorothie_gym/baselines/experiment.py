"""Trainings of models on a corpus: one job, several jobs side by side, and the table of their results."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeAlias, TypedDict

import numpy as np
import torch

from dorothie_gym._version import __version__
from dorothie_gym.archive.corpus import Corpus
from dorothie_gym.archive.visibility import Task
from dorothie_gym.baselines.checkpoints import ModelCard, sha256_of
from dorothie_gym.baselines.dataset import Dataset
from dorothie_gym.baselines.learning_curves import draw_loss_curves
from dorothie_gym.baselines.model_entries import ROWS, SIZES, ModelEntry, find_row
from dorothie_gym.baselines.model_zoo import make_model, needs_pieces
from dorothie_gym.baselines.point_tensors import TASKS, TEST, TRAIN, VALIDATION, Predicted
from dorothie_gym.baselines.toto.texts import FrozenTexts
from dorothie_gym.baselines.trainer import BEST_FILE, Epoch, OnEpoch, TrainingSummary, predict, train
from dorothie_gym.errors import CheckpointError
from dorothie_gym.evaluation.rollout.processes import run_tasks
from dorothie_gym.evaluation.teacher_forced.labels import labels_of
from dorothie_gym.evaluation.teacher_forced.prediction_reader import read_predictions
from dorothie_gym.evaluation.teacher_forced.predictions import (
    ActionPredictions,
    ActPredictions,
    Predictions,
    TaskPredictions,
    write_predictions,
)
from dorothie_gym.evaluation.teacher_forced.scoring import score_task
from dorothie_gym.evaluation.teacher_forced.shallow_models import SHALLOW
from dorothie_gym.evaluation.teacher_forced.table import ResultsTable, evaluate_predictions
from dorothie_gym.evaluation.teacher_forced.trivial_baselines import FLOORS, predict_floor
from dorothie_gym.support.files import write_atomically
from dorothie_gym.support.input_files import MAX_MODEL_JSON, checked, raising, read_json

if TYPE_CHECKING:
    from dorothie_gym.baselines.toto.model import TOTO
    from dorothie_gym.evaluation.teacher_forced.features.columns import Columns
    from dorothie_gym.evaluation.teacher_forced.features.point_table import PointTable

PREDICTIONS_FILE: Final = "predictions.parquet"
RESULT_FILE: Final = "result.json"
CURVES_FILE: Final = "loss.png"


@dataclass(frozen=True, kw_only=True)
class Experiment:
    """Training of one model with one seed on one corpus.

    Attributes:
        corpus: folder of the corpus.
        encoder: name of the text encoder.
        model: command of the model's row.
        size: "small" or "paper".
        seed: seed of weights, order and dropout.
        out: parent of the folders of all trainings.
        strict: whether RfN points hide the earlier acts of the Co-Wizard's own utterance.
        detector: folder of the trained detector, for models of detections.
        hubert: folder with the weights of HuBERT, for models that hear by it.
    """

    corpus: Path
    encoder: str
    model: str
    size: str
    seed: int
    out: Path
    strict: bool = False
    detector: Path | None = None
    hubert: Path | None = None

    def __str__(self) -> str:
        return f"{self.model} ({self.size}), seed {self.seed}"

    @property
    def row(self) -> ModelEntry:
        """Entry of the model in the table."""
        return find_row(self.model)

    def material(self, every: Dataset, on_session: Callable[[], object] | None = None) -> Dataset:
        """Returns the dataset with the objects of this model; arguments and errors as in `Dataset.seeing`."""
        objects = self.row.objects
        return every.seeing(objects, on_session, self.detector if objects == "detections" else None)

    @property
    def folder(self) -> Path:
        """Folder of the training."""
        return self.out / self.model / (f"{self.size}-strict" if self.strict else self.size) / f"seed-{self.seed}"


def run_experiment(job: Experiment, material: Dataset, on_epoch: OnEpoch = lambda epoch: None) -> dict[str, object]:
    """Trains, tests and saves a model, or reads an earlier result; returns the result in JSON types.

    Raises:
        CheckpointError: its folder holds the training of another corpus, encoder or configuration.
        SessionError: the corpus lacks a fold.
        OSError: the folder cannot be written.
    """
    material = job.material(material)
    material.hubert = job.hubert
    about = {"model": job.row.name, "version": __version__, **material.about()}
    if job.row.sound is not None:
        about["sound"] = material.sounds(job.row.sound).id
    if job.row.kind in ("ppo", "cloning"):
        return _run_policy(job, about)
    if job.row.kind == "shallow":
        return _run_shallow(job, material, about)
    model = make_model(job.row, job.size, material, job.seed, strict=job.strict)
    examples = partial(material.examples, spec=model.spec, queries=job.row.queries, sound=job.row.sound)
    started = time.perf_counter(), time.process_time()
    trained = train(
        model,
        examples(TRAIN),
        examples(VALIDATION),
        folder=job.folder,
        seed=job.seed,
        about=about,
        on_epoch=on_epoch,
    )
    wall, cpu = time.perf_counter() - started[0], time.process_time() - started[1]
    kept = job.folder / RESULT_FILE
    if (job.folder / PREDICTIONS_FILE).is_file() and kept.is_file():
        done = _read_result(kept)
        with raising(lambda message: CheckpointError(f"{message}; delete it")):
            facts = checked(done, _TrainingPage, kept)
        _describe(job, model, material, steps=facts["points"] * facts["epochs"], seconds=facts["seconds"])
        return done
    predicted = predict(model, examples(TEST))
    rows = task_predictions(job, material.columns, material.tables(TEST), predicted)
    write_predictions(job.folder / PREDICTIONS_FILE, rows, about={**about, "config": model.config.to_json()})
    draw_loss_curves(trained.epochs, job.row.name, job.folder / CURVES_FILE)
    validation = validation_scores(predict(model, examples(VALIDATION)), material.tables(VALIDATION))
    result = {
        **about,
        **_training_facts(job, model, trained),
        "validation": validation,
        "seconds": round(wall, 3),
        "cpu_seconds": round(cpu, 3),
    }
    write_atomically(kept, json.dumps(result, indent=1) + "\n")
    steps = trained.points * len(trained.epochs)
    _describe(job, model, material, steps=steps, seconds=round(wall, 3))
    return result


class _TrainingPage(TypedDict):
    """Figures of a training in `RESULT_FILE`."""

    points: int
    epochs: int
    seconds: float


def _read_result(path: Path) -> dict[str, Any]:
    """Returns the result of an earlier run; raises `CheckpointError` if it is damaged."""
    with raising(lambda message: CheckpointError(f"{message}; delete it")):
        return checked(read_json(path, MAX_MODEL_JSON), dict[str, Any], path)


def _describe(job: Experiment, model: TOTO, material: Dataset, *, steps: int, seconds: float) -> None:
    """Writes the model card next to the weights."""
    pairs = material.byte_pairs(model.config.vocabulary) if needs_pieces(job.row, model.config) else None
    ModelCard(
        row=job.row.command,
        config=model.config.to_json(),
        corpus=material.columns.content,
        encoder=material.encoder.name,
        encoder_id=material.encoder.id,
        spread=model.texts.spread if isinstance(model.texts, FrozenTexts) else None,
        merges=None if pairs is None else pairs.merges,
        weights=BEST_FILE,
        weights_sha256=sha256_of(job.folder / BEST_FILE),
        steps=steps,
        seconds=seconds,
    ).write(job.folder)


def _run_policy(job: Experiment, about: dict[str, object]) -> dict[str, object]:
    """Trains and tests policies, or reads an earlier result."""
    # imported here: stable-baselines3 is slow to import
    from dorothie_gym.baselines.teacher_forced_policies import run_policy

    kept = job.folder / RESULT_FILE
    if (job.folder / PREDICTIONS_FILE).is_file() and kept.is_file():
        return _earlier_result(kept, about)
    started = time.perf_counter()
    predicted, facts = run_policy(job.corpus, job.row.kind, job.seed, job.folder, job.row.name, strict=job.strict)
    return _keep_result(job, about, predicted, {"tasks": facts}, started)


def _run_shallow(job: Experiment, material: Dataset, about: dict[str, object]) -> dict[str, object]:
    """Fits and tests the shallow models of all tasks, or reads an earlier result."""
    kept = job.folder / RESULT_FILE
    if (job.folder / PREDICTIONS_FILE).is_file() and kept.is_file():
        return _earlier_result(kept, about)
    job.folder.mkdir(parents=True, exist_ok=True)
    started, columns = time.perf_counter(), material.columns
    tables = [material.tables(fold) for fold in (TRAIN, VALIDATION, TEST)]
    found: list[TaskPredictions] = []
    validation: dict[str, float | None] = {}
    for learned, tuned, tested in zip(*tables, strict=True):
        model = SHALLOW[job.row.command](job.seed, strict=job.strict)
        model.fit(columns, learned, tuned)
        validation |= _scores(tuned, model.predict(columns, tuned))
        found.append(_predictions_of(job, columns, tested, model.predict(columns, tested)))
    return _keep_result(job, about, found, {"validation": validation}, started)


def _keep_result(
    job: Experiment,
    about: dict[str, object],
    predicted: Sequence[TaskPredictions],
    facts: Mapping[str, object],
    started: float,
) -> dict[str, object]:
    """Writes predictions and result of a training that began at a time of `time.perf_counter`; returns the result."""
    write_predictions(job.folder / PREDICTIONS_FILE, predicted, about=about)
    seconds = round(time.perf_counter() - started, 3)
    of = {"command": job.model, "size": job.size, "seed": job.seed, "folder": str(job.folder)}
    result = {**about, **of, **facts, "seconds": seconds}
    write_atomically(job.folder / RESULT_FILE, json.dumps(result, indent=1) + "\n")
    return result


def _earlier_result(path: Path, about: dict[str, object]) -> dict[str, object]:
    """Reads the result of an earlier run; raises `CheckpointError` if it is of another corpus."""
    done = _read_result(path)
    if done.get("corpus") != about["corpus"]:
        raise CheckpointError(f"{path}: was trained on another corpus; choose another folder or delete it")
    return done


def task_predictions(
    job: Experiment, columns: Columns, tables: tuple[PointTable, ...], predicted: Predicted
) -> tuple[TaskPredictions, ...]:
    """Returns the predictions by task, in the form in which they are scored."""
    return tuple(
        _predictions_of(job, columns, table, answers)
        for table, answers in zip(tables, _answers(tables, predicted), strict=True)
    )


def _answers(tables: Sequence[PointTable], predicted: Predicted) -> Iterator[Predictions]:
    """Yields the predictions of each task's points, which follow each other in `predicted`."""
    start = 0
    for task, table in zip(TASKS, tables, strict=True):
        rows = slice(start, start + len(table))
        start += len(table)
        if task is Task.NFD:
            angles = predicted.angle[rows].double().numpy()
            yield ActionPredictions(actions=predicted.action[rows].numpy(), angles=angles)
        else:
            yield ActPredictions(moves=predicted.move[rows].numpy(), slots=predicted.slots[rows].numpy())


def _predictions_of(job: Experiment, columns: Columns, table: PointTable, answers: Predictions) -> TaskPredictions:
    return TaskPredictions(
        model=job.row.name,
        seed=job.seed,
        task=table.task,
        sessions=np.array(columns.sessions.names)[table.session],
        events=table.event.astype(np.int64),
        predicted=answers,
        source=job.row.name,
    )


def validation_scores(predicted: Predicted, tables: Sequence[PointTable]) -> dict[str, float | None]:
    """Returns the metrics on the validation points by key; models are chosen by them, never by those of the test."""
    scores: dict[str, float | None] = {}
    for table, answers in zip(tables, _answers(tables, predicted), strict=True):
        scores |= _scores(table, answers)
    return scores


def _scores(table: PointTable, answers: Predictions) -> dict[str, float | None]:
    """Returns every metric of a task by its key; None if undefined."""
    labels: Predictions
    if table.task is Task.NFD:
        labels = ActionPredictions(
            actions=table.label_action.astype(np.int64), angles=table.label_angle.astype(np.float64)
        )
    else:
        labels = ActPredictions(moves=table.label_move.astype(np.int64), slots=table.label_slots)
    found = score_task(table.task, answers, labels)
    return {key: None if np.isnan(value) else round(float(value), 6) for key, value in found.items()}


def _training_facts(job: Experiment, model: torch.nn.Module, trained: TrainingSummary) -> dict[str, object]:
    last = trained.epochs[-1]
    return {
        "command": job.row.command,
        "size": job.size,
        "seed": job.seed,
        "parameters": sum(weights.numel() for weights in model.parameters()),
        "points": trained.points,
        "epochs": len(trained.epochs),
        "best_epoch": last.best,
        "validation_loss": last.lowest,
        "folder": str(job.folder),
    }


# --- Parallel training, one thread per process ------------------------------------------------------------------------

OnExperimentEpoch: TypeAlias = Callable[[Experiment, Epoch], None]
"""Callback after each epoch of each training in the calling process."""


def run_experiments(
    jobs: Sequence[Experiment],
    workers: int,
    on_epoch: OnExperimentEpoch = lambda job, epoch: None,
    on_session: Callable[[], object] = lambda: None,
) -> Iterator[tuple[Experiment, dict[str, object]]]:
    """Runs trainings on one corpus, one per worker at a time, and yields each with its result when it is complete.

    Models of the published sizes use all cores, or the GPU: they run one after another in this process.

    Args:
        jobs: the trainings.
        workers: number of processes; with 1, everything runs in this process.
        on_epoch: called after each epoch in this process.
        on_session: called after each session whose pictures were drawn, for models that see by the camera.

    Raises:
        CheckpointError: the folder of a training holds another one.
        ProcessError: a training failed in another process.
        EncoderError: the encoder is not available.
        SessionError: the corpus cannot be read.
        OSError: a folder cannot be written.
    """
    if not jobs:
        return
    alone = workers <= 1 or len(jobs) == 1 or any(_is_large(job) for job in jobs)
    threads = torch.get_num_threads()
    trainer = _ExperimentWorker(jobs[0].corpus, jobs[0].encoder)
    material = trainer.load()
    for job in jobs:
        _ = job.material(material, on_session).vectors  # other processes find them in the cache
    if not alone:
        yield from run_tasks(trainer.prepare, jobs, workers=min(workers, len(jobs)))
        return
    try:
        for job in jobs:
            torch.set_num_threads(threads if _is_large(job) else 1)
            yield job, run_experiment(job, material, partial(on_epoch, job))
    finally:
        torch.set_num_threads(threads)


@dataclass(frozen=True)
class _ExperimentWorker:
    """Arguments of a worker process."""

    corpus: Path
    encoder: str

    def load(self) -> Dataset:
        return Dataset.load(self.corpus, self.encoder)

    def prepare(self) -> Callable[[Experiment], tuple[Experiment, dict[str, object]]]:
        torch.set_num_threads(1)
        material = self.load()
        return lambda job: (job, run_experiment(job, material))


def _is_large(job: Experiment) -> bool:
    return torch.cuda.is_available() or SIZES[job.size]().width > SIZES["small"]().width


# --- Results table over models and seeds ------------------------------------------------------------------------------

PREDICTIONS: Final = PREDICTIONS_FILE
"""Name of the file with the predictions of all models and seeds."""


def table_experiments(
    corpus: Path,
    out: Path,
    *,
    encoder: str = "auto",
    size: str = "small",
    seeds: int = 5,
    rows: Sequence[ModelEntry] = ROWS,
    strict: bool = False,
    detector: Path | None = None,
    hubert: Path | None = None,
) -> list[Experiment]:
    """Returns the trainings of a table, seed by seed: the first complete table exists after one seed."""
    return [
        Experiment(
            corpus=corpus,
            encoder=encoder,
            model=row.command,
            size=size,
            seed=seed,
            out=out,
            strict=strict,
            detector=detector,
            hubert=hubert,
        )
        for seed in range(seeds)
        for row in rows
        if not row.missing
    ]


def gather_table(
    jobs: Sequence[Experiment], *, floors: bool = True
) -> tuple[ResultsTable, tuple[TaskPredictions, ...]]:
    """Scores the predictions of complete trainings, and of the trivial baselines.

    Args:
        jobs: complete trainings on one corpus.
        floors: whether the table has rows for the trivial baselines, with the same seeds.

    Returns:
        The table, and the predictions behind it.

    Raises:
        ValueError: there is no job.
        PredictionError: a file of predictions does not match the corpus.
        SessionError: the corpus cannot be read.
    """
    if not jobs:
        raise ValueError("the table has no rows: choose a model")
    corpus = Corpus.load(jobs[0].corpus)
    labels = labels_of(corpus, TEST)
    predicted = list(read_predictions(*(job.folder / PREDICTIONS_FILE for job in jobs)))
    if floors:
        training = labels_of(corpus, "train")
        seeds = sorted({job.seed for job in jobs})
        predicted += [part for name in FLOORS for seed in seeds for part in predict_floor(name, training, labels, seed)]
    about: dict[str, dict[str, object]] = {}
    for job in jobs:
        facts = _read_result(job.folder / RESULT_FILE)
        about.setdefault(job.row.name, {})[str(job.seed)] = facts
    chosen = {job.model for job in jobs}
    whole = chosen >= {row.command for row in ROWS if not row.missing}
    missing = {row.name: row.missing for row in ROWS if row.missing} if whole else {}
    return evaluate_predictions(predicted, labels, missing=missing, about=about), tuple(predicted)
