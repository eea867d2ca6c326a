"""One model trained with one seed on one corpus: trained, tested, and kept in a folder of its own."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import torch

from dorothie_gym._version import __version__
from dorothie_gym.baselines.acting.description import Description, sha256_of
from dorothie_gym.baselines.inputs import TASKS
from dorothie_gym.baselines.material import TEST, TRAIN, VALIDATION, Material
from dorothie_gym.baselines.outputs import Predicted
from dorothie_gym.baselines.rows import Row, find_row, make_model, needs_pieces
from dorothie_gym.baselines.toto import TOTO, FrozenTexts
from dorothie_gym.baselines.training import BEST_FILE, Trained, predict, train
from dorothie_gym.baselines.training.curves import draw_curves
from dorothie_gym.baselines.training.trainer import OnEpoch
from dorothie_gym.benchmark import ActionPredictions, ActPredictions, TaskPredictions, write_predictions
from dorothie_gym.benchmark.features import Columns, PointTable
from dorothie_gym.errors import CheckpointError
from dorothie_gym.files import write_atomically
from dorothie_gym.recording import Task

PREDICTIONS_FILE: Final = "predictions.parquet"
RESULT_FILE: Final = "result.json"
CURVES_FILE: Final = "loss.png"


@dataclass(frozen=True, kw_only=True)
class Job:
    """What is to be trained.

    Attributes:
        corpus: folder of the corpus.
        encoder: name of the encoder of texts.
        model: command of the model's row.
        size: "small" or "paper".
        seed: of weights, order and dropout.
        out: folder under which every run has its own.
    """

    corpus: Path
    encoder: str
    model: str
    size: str
    seed: int
    out: Path

    @property
    def row(self) -> Row:
        """The model's row."""
        return find_row(self.model)

    @property
    def folder(self) -> Path:
        """Folder of the run."""
        return self.out / self.model / self.size / f"seed-{self.seed}"


def run(job: Job, material: Material, on_epoch: OnEpoch = lambda epoch: None) -> dict[str, Any]:
    """Trains, tests and keeps a model, or reads what was done before; returns what came of it, in JSON types.

    Raises:
        CheckpointError: in its folder lies the training of another corpus, encoder or configuration.
        SessionError: the corpus lacks a fold.
        OSError: the folder cannot be written.
    """
    about = {"model": job.row.name, "version": __version__, **material.about()}
    if job.row.kind in ("ppo", "cloning"):
        return _run_policy(job, about)
    model = make_model(job.row, job.size, material, job.seed)
    spec = model.spec
    started = time.perf_counter(), time.process_time()
    trained = train(
        model,
        material.examples(TRAIN, spec),
        material.examples(VALIDATION, spec),
        folder=job.folder,
        seed=job.seed,
        about=about,
        on_epoch=on_epoch,
    )
    wall, cpu = time.perf_counter() - started[0], time.process_time() - started[1]
    kept = job.folder / RESULT_FILE
    if (job.folder / PREDICTIONS_FILE).is_file() and kept.is_file():
        done = dict(json.loads(kept.read_text(encoding="utf-8")))
        _describe(job, model, material, done)
        return done
    predicted = predict(model, material.examples(TEST, spec))
    rows = task_predictions(job, material.columns, material.tables(TEST), predicted)
    write_predictions(job.folder / PREDICTIONS_FILE, rows, about={**about, "config": model.config.to_json()})
    draw_curves(trained.epochs, job.row.name, job.folder / CURVES_FILE)
    result = {**about, **_told(job, model, trained), "seconds": round(wall, 3), "cpu_seconds": round(cpu, 3)}
    write_atomically(kept, json.dumps(result, indent=1) + "\n")
    _describe(job, model, material, result)
    return result


def _describe(job: Job, model: TOTO, material: Material, result: Mapping[str, Any]) -> None:
    """Writes what who plays the model must know beside its weights."""
    pairs = material.byte_pairs(model.config.vocabulary) if needs_pieces(job.row, model.config) else None
    Description(
        row=job.row.command,
        config=model.config.to_json(),
        corpus=material.columns.content,
        encoder=material.encoder.name,
        encoder_id=material.encoder.id,
        spread=model.texts.spread if isinstance(model.texts, FrozenTexts) else None,
        merges=None if pairs is None else pairs.merges,
        weights=BEST_FILE,
        weights_sha256=sha256_of(job.folder / BEST_FILE),
        steps=result["points"] * result["epochs"],
        seconds=result["seconds"],
    ).write(job.folder)


def _run_policy(job: Job, about: dict[str, Any]) -> dict[str, Any]:
    """Trains and tests policies, unless that was done before."""
    # imported here: stable-baselines3 is slow to import
    from dorothie_gym.baselines.reinforcement import run_policy

    kept = job.folder / RESULT_FILE
    if (job.folder / PREDICTIONS_FILE).is_file() and kept.is_file():
        done = dict(json.loads(kept.read_text(encoding="utf-8")))
        if done.get("corpus") != about["corpus"]:
            message = f"{kept}: was trained on another corpus than is asked for now; choose another folder or delete it"
            raise CheckpointError(message)
        return done
    started = time.perf_counter()
    predicted, told = run_policy(job.corpus, job.row.kind, job.seed, job.folder, job.row.name)
    write_predictions(job.folder / PREDICTIONS_FILE, predicted, about=about)
    seconds = round(time.perf_counter() - started, 3)
    of = {"command": job.model, "size": job.size, "seed": job.seed, "folder": str(job.folder)}
    result = {**about, **of, "tasks": told, "seconds": seconds}
    write_atomically(kept, json.dumps(result, indent=1) + "\n")
    return result


def task_predictions(
    job: Job, columns: Columns, tables: tuple[PointTable, ...], predicted: Predicted
) -> tuple[TaskPredictions, ...]:
    """Returns predictions of points, which follow one another by task as in the tables, as they are scored."""
    found = []
    start = 0
    for task, table in zip(TASKS, tables, strict=True):
        rows = slice(start, start + len(table))
        start += len(table)
        names = np.array(columns.sessions.names)[table.session]
        answers: ActionPredictions | ActPredictions
        if task is Task.NFD:
            angles = predicted.angle[rows].double().numpy()
            answers = ActionPredictions(actions=predicted.action[rows].numpy(), angles=angles)
        else:
            answers = ActPredictions(moves=predicted.move[rows].numpy(), slots=predicted.slots[rows].numpy())
        found.append(
            TaskPredictions(
                model=job.row.name,
                seed=job.seed,
                task=task,
                sessions=names,
                events=table.event.astype(np.int64),
                predicted=answers,
                source=job.row.name,
            )
        )
    return tuple(found)


def _told(job: Job, model: torch.nn.Module, trained: Trained) -> dict[str, Any]:
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
