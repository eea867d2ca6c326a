"""`dorothie-gym reference-times`: references of the scenarios of a rollout."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dorothie_gym.cli.completion import complete_towns
from dorothie_gym.cli.options import AsJson, Players
from dorothie_gym.cli.output import (
    check_file,
    exit_interrupted,
    fail,
    print_json,
    reporting_errors,
    session_progress,
    stdout,
)
from dorothie_gym.cli.seal import BeaconDate, BeaconText, beacon_of
from dorothie_gym.cli.tier_options import TierName, tier_of
from dorothie_gym.cli.warm_up import compile_first
from dorothie_gym.evaluation import closed_loop
from dorothie_gym.evaluation import rollout as rollouts
from dorothie_gym.support.processors import available_processors

if TYPE_CHECKING:
    from collections.abc import Sequence

    from dorothie_gym.evaluation.closed_loop.running import RolloutPlan
    from dorothie_gym.session.config import EnvConfig
    from dorothie_gym.session.scenario import ReferenceDrive


def reference_times(
    out: Annotated[Path, typer.Option(metavar="FILE.json", help="File of the references; those in it are kept.")],
    tier: TierName = "standard",
    towns: Annotated[
        str | None,
        typer.Option(metavar="FOLD|all|NAME,...", help="Towns in place of the tier's.", autocompletion=complete_towns),
    ] = None,
    sessions: Annotated[int, typer.Option(min=1, help="Number of sessions of `rollout`, all trials counted.")] = 100,
    seed: Annotated[
        int | None, typer.Option(min=0, show_default="0", help="Seed of the scenarios, as of `rollout`.")
    ] = None,
    beacon: BeaconText = None,
    beacon_date: BeaconDate = None,
    trials: Annotated[int, typer.Option(min=1, help="Sessions of each scenario, as of `rollout`.")] = 1,
    workers: Players = None,
    as_json: AsJson = False,
) -> None:
    """Measure the reference times of the scenarios that `rollout` plays with the same tier, towns and seed, or beacon.

    The scripted participant and Co-Wizard play each scenario with exact words and acts, in the usual traffic and
    without an Ad-Wizard. `rollout --references` and `submit --references` read the file.
    """
    with reporting_errors():
        found = tier_of(tier)
        if found is None:
            fail("--tier is empty; give the name of a tier")
        if found.config.talk is not None:
            fail(f"tier {tier} has tasks of talk, which have no reference times; give a tier of driving")
        drawn = beacon_of(beacon, beacon_date, found, {"--towns": towns is not None, "--seed": seed is not None})
        try:
            chosen = found.towns if towns is None else closed_loop.parse_towns(towns)
            plans = closed_loop.RolloutSettings(
                towns=chosen if drawn is None else drawn.towns,
                sessions=sessions,
                seed=(seed or 0) if drawn is None else drawn.seed,
                trials=trials,
            ).plans()
            config = found.config if drawn is None else closed_loop.sealed_config(found.config)
        except ValueError as error:
            fail(str(error))
        known = rollouts.read_drives(out) if out.is_file() else {}
        check_file(out)
        drives = dict(known)
        try:
            compile_first()
            _measure(out, drives, plans, config, workers, quiet=as_json)
        except KeyboardInterrupt:
            exit_interrupted(f"Interrupted with {len(drives)} references in {out}; the same command measures the rest.")
    added = len(drives) - len(known)
    if as_json:
        print_json({"file": str(out), "drives": len(drives), "added": added})
        return
    stdout().print(f"{len(drives)} references in {out}, {added} of them new", markup=False, soft_wrap=True)


def _measure(
    out: Path,
    drives: dict[str, ReferenceDrive],
    plans: Sequence[RolloutPlan],
    config: EnvConfig,
    workers: int | None,
    *,
    quiet: bool,
) -> None:
    """Measures the references of scenarios that `drives` does not have; writes each as soon as it is known."""
    tasks = list(dict.fromkeys((plan.town, plan.seed) for plan in plans))
    with session_progress(quiet=quiet) as on_session:
        on_session(0, len(tasks))
        measured = rollouts.measure_drives(tasks, config, drives, workers=workers or available_processors())
        for number, (key, drive) in enumerate(measured, start=1):
            drives[key] = drive
            rollouts.write_drives(out, drives)
            on_session(number, len(tasks))
