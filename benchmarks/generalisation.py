"""Trains drivers in the seen towns at once, and tries them in each of those, in the unseen town and in other maps.

A training and the evaluation of a finished one resume in the work folder. The episodes of the evaluation are used
neither in training nor for the choice of the best model.
"""

import json
import subprocess
import sys
from dataclasses import asdict, replace
from pathlib import Path
from typing import Annotated, Final

import torch
import typer
from rich.console import Console
from rich.table import Table

from dorothie_gym.baselines.rl.checkpoint import load_model
from dorothie_gym.baselines.rl.evaluation import FIRST_SEED, EpisodeStatistics, evaluate_settings, greedy_policy
from dorothie_gym.baselines.rl.run import BEST
from dorothie_gym.cli.output import reporting_errors
from dorothie_gym.evaluation.analysis.intervals import Estimate
from dorothie_gym.maps import SEEN_TOWNS, UNSEEN_TOWNS, load_town

FIRST_TEST: Final = FIRST_SEED + 500_000
"""Seed of the first episode; the evaluations of the training have lower ones."""

EVALUATIONS: Final = 10
"""Number of evaluations of a training whose steps are given."""


def main(
    maps: Annotated[list[str] | None, typer.Argument(help="further maps to try the drivers in")] = None,
    algorithm: Annotated[str, typer.Option(help="algorithm of train-rl")] = "maskable_ppo",
    guidance: Annotated[str, typer.Option(help="turns or goals")] = "goals",
    exceptions: Annotated[float, typer.Option(help="average number of exceptions in a session")] = 2.0,
    steps: Annotated[int | None, typer.Option(help="steps of a training; default: tuned")] = None,
    seeds: Annotated[int, typer.Option(min=1, help="number of trainings")] = 5,
    episodes: Annotated[int, typer.Option(min=1, help="episodes in each map")] = 100,
    work: Annotated[Path, typer.Option(help="folder of the trainings")] = Path("runs/generalisation"),
    as_json: Annotated[bool, typer.Option("--json")] = False,
) -> None:
    """Prints success by town with the 95 % interval of the mean over trainings."""
    torch.set_num_threads(1)
    with reporting_errors():
        for each in maps or []:
            load_town(each)  # before the first training
    towns = [*SEEN_TOWNS, *UNSEEN_TOWNS, *(maps or [])]
    rows: dict[str, dict[int, EpisodeStatistics]] = {town: {} for town in towns}
    for seed in range(seeds):
        folder = work / f"seed-{seed}"
        command = ["train-rl", algorithm, "--out", str(folder), "--seed", str(seed)]
        command += ["--set", f"town=[{','.join(SEEN_TOWNS)}]", "--set", f"guidance={guidance}"]
        command += ["--set", f"exceptions={exceptions:g}"]
        if steps is not None:
            command += ["--steps", str(steps), "--evaluate-every", str(max(steps // EVALUATIONS, 1))]
        print(f"dorothie-gym {' '.join(command)}", file=sys.stderr, flush=True)
        subprocess.run([sys.executable, "-m", "dorothie_gym", *command], check=True, stdout=sys.stderr)
        for town in towns:
            rows[town][seed] = outcome = _tried(folder, town, episodes)
            print(f"seed {seed}, {_name(town)}: success {100 * outcome.success:.0f} %", file=sys.stderr, flush=True)
    _show(rows, as_json=as_json)


def _tried(folder: Path, town: str, episodes: int) -> EpisodeStatistics:
    """Returns the statistics of the best model of a training in a town."""
    file = folder / f"test-{_name(town)}-{episodes}.json"
    if file.exists():
        return EpisodeStatistics(**json.loads(file.read_text(encoding="utf-8")))
    model, settings = load_model(folder / BEST)
    there = replace(settings, env_settings={**settings.env_settings, "town": town})
    outcome = evaluate_settings(there, greedy_policy(model, masked=settings.masked), episodes, FIRST_TEST)
    file.write_text(json.dumps(asdict(outcome)) + "\n", encoding="utf-8")
    return outcome


def _name(town: str) -> str:
    return load_town(town).name


def _show(rows: dict[str, dict[int, EpisodeStatistics]], *, as_json: bool) -> None:
    """Prints the success in each town, of each training and on average."""
    estimates = {town: Estimate.of({seed: each.success for seed, each in row.items()}) for town, row in rows.items()}
    if as_json:
        pages = {
            _name(town): {
                "part": _part(town),
                **estimates[town].to_json(),
                "trainings": {seed: asdict(each) for seed, each in row.items()},
            }
            for town, row in rows.items()
        }
        print(json.dumps(pages))
        return
    table = Table("town", "", "success", *(f"seed {seed}" for seed in next(iter(rows.values()))))
    for town, row in rows.items():
        mean, width = estimates[town].mean, estimates[town].half_width
        shown = "" if mean is None else f"{100 * mean:.0f}{'' if width is None else f' ± {100 * width:.0f}'} %"
        table.add_row(_name(town), _part(town), shown, *(f"{100 * each.success:.0f} %" for each in row.values()))
    Console().print(table)


def _part(town: str) -> str:
    return "seen" if town in SEEN_TOWNS else "unseen" if town in UNSEEN_TOWNS else "imported"


if __name__ == "__main__":
    typer.run(main)
