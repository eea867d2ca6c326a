"""Predictions of the shipped models of the three tasks."""

from __future__ import annotations

from pathlib import Path

import torch

from dorothie_gym.baselines.benchmark_co_wizard.inference import BenchmarkModel
from dorothie_gym.baselines.checkpoints import restore
from dorothie_gym.baselines.dataset import Dataset
from dorothie_gym.baselines.experiment import Experiment, task_predictions
from dorothie_gym.baselines.model_zoo import build_model
from dorothie_gym.baselines.point_tensors import TEST
from dorothie_gym.baselines.trainer import predict
from dorothie_gym.evaluation.teacher_forced import write_predictions
from dorothie_gym.policies.pretrained import pretrained_folder


def predicted_file(name: str, corpus: Path, out: Path) -> Path:
    """Writes the predictions for the test fold of a corpus and returns their file."""
    torch.set_num_threads(1)
    trained = BenchmarkModel.load(pretrained_folder(name))
    dataset = Dataset.load(corpus, trained.description.encoder)
    model = build_model(trained.row, trained.config, dataset, trained.description.spread)
    restore(trained.weights, model)
    job = Experiment(
        corpus=corpus, encoder=trained.description.encoder, model=trained.row.command, size="small", seed=0, out=out
    )
    answers = predict(model, dataset.examples(TEST, model.spec))
    rows = task_predictions(job, dataset.columns, dataset.tables(TEST), answers)
    write_predictions(out, rows, about={**dataset.about(), "config": model.config.to_json()})
    return out
