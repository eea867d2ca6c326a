"""`dorothie-gym train segformer|detr`: training of the vision models on pictures of recorded sessions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from dorothie_gym.cli.output import Facts, exit_interrupted, fail, print_json, stage_progress, stdout, wide_stdout
from dorothie_gym.support.processors import available_processors

_FIGURES: Final[Mapping[str, Mapping[str, str]]] = {
    "segformer": {"miou": "mIoU", "macc": "mAcc", "aacc": "aAcc", "depth_error": "depth error"},
    "detr": {
        "ap50": "AP50",
        "ap50_95": "AP50:95",
        "ap_place": "AP 2 m",
        "place_error": "place",
        "range_error": "depth",
        "size_error": "size",
        "heading_error": "heading",
        "axis_error": "axis",
    },
}
_UNITS: Final[Mapping[str, str]] = {"place_error": "m", "heading_error": "deg", "axis_error": "deg"}
"""Units of figures that are no shares."""
_MEANINGS: Final[Mapping[str, str]] = {
    "segformer": "Means over the classes that occur in the fold; depth error: mean relative error up to 80 m.",
    "detr": "Objects with at least 64 visible pixels; AP: means over the kinds that occur in the fold, of boxes in the "
    "picture and of places in space up to 2 m apart. Then mean errors in space of those found.",
}


def train_vision(
    model: str,
    corpus: Path,
    out: Path,
    *,
    size: str,
    seeds: int,
    device: str | None,
    inputs: str | None,
    epochs: int | None,
    workers: int | None,
    as_json: bool,
) -> None:
    """Trains a vision model with several seeds, tests it, and prints its figures beside the paper's."""
    from dorothie_gym.baselines.trainer import device as best_device
    from dorothie_gym.baselines.vision.experiment import VisionExperiment, check_experiment, run_vision_experiment

    if inputs is not None and model != "detr":
        fail("--inputs is for detr only")
    results: list[Facts] = []
    try:
        with stage_progress(quiet=as_json) as on_stage:
            for seed in range(seeds):
                job = VisionExperiment(
                    corpus=corpus,
                    model=model,
                    size=size,
                    seed=seed,
                    out=out,
                    epochs=epochs,
                    inputs=inputs or "predicted",
                    device=device or str(best_device()),
                )
                check_experiment(job)
                results.append(run_vision_experiment(job, workers=workers or available_processors(), on_stage=on_stage))
    except KeyboardInterrupt:
        exit_interrupted(
            f"Interrupted with {len(results)} of {seeds} trainings finished; resume with the same command."
        )
    if as_json:
        print_json({"model": model, "corpus": str(corpus), "runs": results})
        return
    _show(model, results)


def _show(model: str, results: Sequence[Mapping[str, Any]]) -> None:
    from rich.table import Table

    names = _FIGURES[model]
    table = Table(box=None, header_style="bold")
    table.add_column("")
    for title in names.values():
        table.add_column(title, justify="right")
    for result in results:
        for towns, figures in result["test"].items():
            label = f"{towns} towns" + (f", seed {result['seed']}" if len(results) > 1 else "")
            table.add_row(label, *(_shown(name, figures.get(name)) for name in names))
    table.add_row("paper", *(_shown(name, results[0]["paper"].get(name)) for name in names), style="dim")
    wide_stdout().print(table)
    stdout().print(_MEANINGS[model], style="dim", markup=False, soft_wrap=True)
    for result in results:
        stdout().print(
            f"Seed {result['seed']}: best epoch {result['best_epoch']} of {len(result['epochs'])}, "
            f"{result['processor_seconds']:.0f} s of processor time; {result['folder']}",
            style="dim",
            markup=False,
            soft_wrap=True,
        )


def _shown(name: str, value: float | None) -> str:
    """Returns a figure with its unit, "-" where there is none."""
    if value is None:
        return "-"
    unit = _UNITS.get(name)
    return f"{100.0 * value:.1f} %" if unit is None else f"{value:.1f} {unit}"
