"""Trains drivers in pools of towns, and tries them in the shipped towns, in unseen generated ones and in other maps.

A training and the evaluation of a finished one resume in the work folder. The episodes of the evaluation are used
neither in training nor for the choice of the best model.
"""

import json
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import Annotated, Final

import torch
import typer
from gymnasium.vector import AutoresetMode
from rich.console import Console
from rich.table import Table

from dorothie_gym.baselines.rl.checkpoint import load_model
from dorothie_gym.baselines.rl.environments import make_batch
from dorothie_gym.baselines.rl.evaluation import (
    FIRST_SEED,
    EpisodeStatistics,
    evaluate_settings,
    greedy_policy,
    play_batch,
)
from dorothie_gym.baselines.rl.run import BEST
from dorothie_gym.cli.output import fail, reporting_errors
from dorothie_gym.evaluation.analysis.intervals import Estimate
from dorothie_gym.maps import DEVELOPMENT_TOWNS, SEEN_TOWNS, UNSEEN_TOWNS, fold_of, load_town
from dorothie_gym.maps.generated.specification import SERIES

FIRST_TEST: Final = FIRST_SEED + 500_000
"""Seed of the first episode; the evaluations of the training have lower ones."""

TRAINING_EPISODES: Final = 100
"""Episodes of an evaluation of a training, in all towns of its pool together."""

POOLS: Final[Mapping[str, tuple[str, int]]] = {
    "seen": (f"[{','.join(SEEN_TOWNS)}]", len(SEEN_TOWNS)),
    "generated": (SERIES, 1),
}
"""Towns to train in, as the argument `town`, and the number of groups of towns that are evaluated one by one."""

UNSEEN: Final = f"{len(UNSEEN_TOWNS)} unseen generated towns"
"""Row of the unseen fold, whose towns take turns."""

Rows = dict[str, dict[tuple[str, int], EpisodeStatistics]]
"""Outcomes by town, and by pool and seed of the training."""


def main(
    maps: Annotated[list[str] | None, typer.Argument(help="further maps to try the drivers in")] = None,
    algorithm: Annotated[str, typer.Option(help="algorithm of train-rl")] = "maskable_ppo",
    pools: Annotated[
        str, typer.Option("--pools", help="towns to train in: seen, generated (the first 64), or both")
    ] = "seen",
    guidance: Annotated[str, typer.Option("--guidance", help="turns or goals")] = "goals",
    exceptions: Annotated[float, typer.Option(help="average number of exceptions in a session")] = 2.0,
    steps: Annotated[int | None, typer.Option(help="steps of a training; default: tuned")] = None,
    evaluations: Annotated[
        int, typer.Option("--evaluations", min=1, help="evaluations of a training of given steps")
    ] = 10,
    seeds: Annotated[int, typer.Option(min=1, help="number of trainings in each pool")] = 5,
    episodes: Annotated[int, typer.Option(min=1, help="episodes in each map, and in all unseen towns together")] = 100,
    work: Annotated[Path, typer.Option(help="folder of the trainings")] = Path("runs/generalisation"),
    as_json: Annotated[bool, typer.Option("--json")] = False,
) -> None:
    """Prints success by town with the 95 % interval of the mean over trainings."""
    torch.set_num_threads(1)
    chosen = pools.split(",")
    if unknown := [pool for pool in chosen if pool not in POOLS]:
        fail(f"--pools {unknown[0]}: give {', '.join(POOLS)}")
    with reporting_errors():
        for each in maps or []:
            load_town(each)  # before the first training
    places: dict[str, list[str]] = {town: [town] for town in (*SEEN_TOWNS, *DEVELOPMENT_TOWNS)}
    places |= {UNSEEN: list(UNSEEN_TOWNS)} | {load_town(each).name: [each] for each in maps or []}
    rows: Rows = {place: {} for place in places}
    for seed in range(seeds):
        for pool in chosen:
            folder = work / pool / f"seed-{seed}"
            there, groups = POOLS[pool]
            command = ["train-rl", algorithm, "--out", str(folder), "--seed", str(seed), "--set", f"town={there}"]
            command += ["--set", f"guidance={guidance}", "--set", f"exceptions={exceptions:g}"]
            command += ["--episodes", str(TRAINING_EPISODES // groups)]
            if steps is not None:
                command += ["--steps", str(steps), "--evaluate-every", str(max(steps // evaluations, 1))]
            print(f"dorothie-gym {' '.join(command)}", file=sys.stderr, flush=True)
            subprocess.run([sys.executable, "-m", "dorothie_gym", *command], check=True, stdout=sys.stderr)
            for place, towns in places.items():
                rows[place][pool, seed] = outcome = _tried(folder, place, towns, episodes)
                line = f"{pool}, seed {seed}, {place}: success {100 * outcome.success:.0f} %"
                print(line, file=sys.stderr, flush=True)
    _show(rows, chosen, as_json=as_json)


def _tried(folder: Path, place: str, towns: list[str], episodes: int) -> EpisodeStatistics:
    """Returns the statistics of the best model of a training in a town, or in towns over which the episodes cycle."""
    file = folder / f"test-{place.replace(' ', '-')}-{episodes}.json"
    if file.exists():
        return EpisodeStatistics(**json.loads(file.read_text(encoding="utf-8")))
    model, settings = load_model(folder / BEST)
    act = greedy_policy(model, masked=settings.masked)
    if len(towns) == 1:
        there = replace(settings, env_settings={**settings.env_settings, "town": towns[0]})
        outcome = evaluate_settings(there, act, episodes, FIRST_TEST)
    else:
        arguments = {**settings.env_settings, "town": towns}
        make = partial(make_batch, settings.env, arguments, mode=AutoresetMode.DISABLED)
        outcome = play_batch(make, act, episodes, FIRST_TEST).statistics
    file.write_text(json.dumps(asdict(outcome)) + "\n", encoding="utf-8")
    return outcome


def _show(rows: Rows, pools: list[str], *, as_json: bool) -> None:
    """Prints the success in each town of the drivers of each pool, of each training and on average."""
    found = {
        (place, pool): {seed: each for (own, seed), each in row.items() if own == pool}
        for pool in pools
        for place, row in rows.items()
    }
    estimates = {key: Estimate.of({seed: each.success for seed, each in row.items()}) for key, row in found.items()}
    if as_json:
        pages = [
            {
                "town": place,
                "fold": _fold(place),
                "trained_in": pool,
                **estimates[place, pool].to_json(),
                "trainings": {seed: asdict(each) for seed, each in row.items()},
            }
            for (place, pool), row in found.items()
        ]
        print(json.dumps(pages))
        return
    seeds = list(dict.fromkeys(seed for row in found.values() for seed in row))
    table = Table("trained in", "town", "fold", "success", *(f"seed {seed}" for seed in seeds))
    for (place, pool), row in found.items():
        mean, width = estimates[place, pool].mean, estimates[place, pool].half_width
        shown = "" if mean is None else f"{100 * mean:.0f}{'' if width is None else f' ± {100 * width:.0f}'} %"
        cells = (f"{100 * each.success:.0f} %" for each in row.values())
        table.add_row(pool, place, _fold(place), shown, *cells)
    Console().print(table)


def _fold(place: str) -> str:
    return "unseen" if place == UNSEEN else str(fold_of(place) or "imported")


if __name__ == "__main__":
    typer.run(main)
