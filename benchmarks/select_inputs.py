"""Trains the Junction Reader and TOTO without one input at a time, and scores them on the validation folds.

Inputs and clocks are chosen by these figures. No test session is read. The models are those of `dorothie-gym train`.
"""

import json
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from statistics import fmean
from typing import Annotated, Any

import torch
import typer

from dorothie_gym.baselines.dataset import Dataset
from dorothie_gym.baselines.experiment import validation_scores
from dorothie_gym.baselines.model_entries import SIZES, find_row
from dorothie_gym.baselines.model_zoo import build_model
from dorothie_gym.baselines.point_tensors import TRAIN, VALIDATION
from dorothie_gym.baselines.toto import TOTOConfig
from dorothie_gym.baselines.trainer import predict, train
from dorothie_gym.evaluation.teacher_forced import COLUMNS


def _silent(name: str) -> Callable[[Any], None]:
    """Returns a change of a model: the part of the readout that a layer adds is 0."""

    def change(model: Any) -> None:
        layer = getattr(model, name)
        for weights in layer.parameters():
            torch.nn.init.zeros_(weights)
            weights.requires_grad_(False)

    return change


def _without_exits(model: Any) -> None:
    exits = model._exits
    model._exits = lambda inputs: (lambda tokens, there, *rest: (tokens, there & False, *rest))(*exits(inputs))


def _without_words(model: Any) -> None:
    model._words = lambda inputs: []


def _without_mentions(model: Any) -> None:
    named = model._named
    model._named = lambda inputs: named(inputs) * 0.0


VARIANTS: Mapping[str, tuple[str, Callable[[TOTOConfig], TOTOConfig], Callable[[Any], None]]] = {
    "reader": ("reader", lambda config: config, lambda model: None),
    "reader, session clock": ("reader", lambda config: replace(config, clock="session"), lambda model: None),
    "reader - exits": ("reader", lambda config: config, _without_exits),
    "reader - subwords": ("reader", lambda config: config, _without_words),
    "reader - mentions of slot values": ("reader", lambda config: config, _without_mentions),
    "reader - recent events": ("reader", lambda config: config, _silent("recent")),
    "reader - state of the car": ("reader", lambda config: config, _silent("state")),
    "reader - earlier spans": ("reader", lambda config: config, _silent("spans")),
    "TOTO": ("toto", lambda config: config, lambda model: None),
    "TOTO, point clock": ("toto", lambda config: replace(config, clock="point"), lambda model: None),
}
"""Row of the table, change of its config and change of the model, by name."""


def main(
    corpus: Annotated[Path, typer.Argument(help="folder of the corpus")],
    seeds: Annotated[int, typer.Option(help="number of seeds")] = 2,
    epochs: Annotated[int, typer.Option(min=1, help="largest number of epochs")] = 16,
    variants: Annotated[str, typer.Option(help="semicolon-separated names; by default all")] = "",
    encoder: Annotated[str, typer.Option(help="text encoder")] = "auto",
    as_json: Annotated[bool, typer.Option("--json", help="print JSON")] = False,
) -> None:
    """Prints the validation metrics of each variant and the mean of the metrics, over seeds [%]."""
    torch.set_num_threads(1)
    chosen = [name.strip() for name in variants.split(";")] if variants else list(VARIANTS)
    material, found = Dataset.load(corpus, encoder), {}
    if not as_json:
        print(f"{'variant':36}", *(f"{column:>22}" for column in (*COLUMNS, "mean")))
    for name in chosen:
        scores = [_score(name, material, seed, epochs) for seed in range(seeds)]
        found[name] = {key: fmean(score[key] for score in scores) for key in COLUMNS}
        found[name]["mean"] = fmean(found[name].values())
        if not as_json:
            print(f"{name:36}", *(f"{100.0 * value:22.1f}" for value in found[name].values()), flush=True)
    if as_json:
        about = {"corpus": material.columns.content, "seeds": seeds, "epochs": epochs}
        print(json.dumps({**about, "validation": found}, indent=1))


def _score(name: str, material: Dataset, seed: int, epochs: int) -> dict[str, float]:
    command, reconfigured, changed = VARIANTS[name]
    row = find_row(command)
    assert row.change is not None
    torch.manual_seed(seed)
    config = reconfigured(row.change(SIZES["small"]()))
    config = replace(config, min_epochs=min(config.min_epochs, epochs), max_epochs=epochs)
    model = build_model(row, config, material)
    changed(model)
    learned, checked = (material.examples(fold, model.spec) for fold in (TRAIN, VALIDATION))
    with tempfile.TemporaryDirectory() as folder:
        train(model, learned, checked, folder=Path(folder), seed=seed, about={"variant": name})
    scores = validation_scores(predict(model, checked), material.tables(VALIDATION))
    return {key: scores[key] or 0.0 for key in COLUMNS}


if __name__ == "__main__":
    typer.run(main)
