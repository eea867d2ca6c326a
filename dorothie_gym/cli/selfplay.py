"""`dorothie-gym train-rl selfplay`: all three roles at once."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dorothie_gym.cli.output import FAILED, fail, print_json, stdout, told_plainly
from dorothie_gym.cli.training import facts_of, options_of, processes, rate_line, tell_interrupted, training_progress
from dorothie_gym.ontology import AGENT_ROLES

if TYPE_CHECKING:
    from dorothie_gym.baselines.rl import Run
    from dorothie_gym.baselines.selfplay.training import Row


def train_selfplay(
    out: Path, given: Mapping[str, Any], changes: Mapping[str, Any], *, ray: str | None, as_json: bool
) -> None:
    """Trains and tells what came of it.

    Args:
        out: folder of the run.
        given: what was set by `--set`.
        changes: options; None for what is left to the defaults.
        ray: address of a cluster that steps the sessions, or None.
        as_json: whether to write one JSON object, and nothing else.
    """
    from dorothie_gym.baselines.selfplay.settings import selfplay_settings
    from dorothie_gym.baselines.selfplay.training import SelfPlay
    from dorothie_gym.errors import ModelFileError, ProcessError, SessionError, SettingsError

    with told_plainly():
        try:
            settings = selfplay_settings(given, **changes)
            if changes["workers"] is None and ray is None:
                settings = replace(settings, workers=processes(settings.environments))
            with training_progress(settings.steps, out, _line, quiet=as_json) as (watch, tell):
                run = SelfPlay(settings, out, watch, ray, tell).go()
        except (SettingsError, ModelFileError, SessionError) as error:
            fail(str(error))
        except ProcessError as error:
            fail(str(error), FAILED)
    if as_json:
        print_json(facts_of(run, settings))
    else:
        _show(run)
    if not run.finished:
        words = ["dorothie-gym", "train-rl", "selfplay", "--out", str(out)]
        words += [word for name, value in given.items() for word in ("--set", f"{name}={value}")]
        tell_interrupted(run.steps, settings.steps, out, shlex.join([*words, *options_of(settings, ray)]))


def _line(row: Row) -> str:
    returns = ", ".join(f"{role} {'-' if value is None else f'{value:.2f}'}" for role, value in row.returns.items())
    return (
        f"{row.steps:>10,} steps, {row.seconds:6.0f} s: success against the scripted Ad-Wizard "
        f"{100 * row.scripted.success:5.1f} %, the learned one {100 * row.learned.success:5.1f} %; rewards {returns}"
    )


def _show(run: Run[Row]) -> None:
    from dorothie_gym.baselines.rl.training import CURVE

    console = stdout()
    console.print(rate_line("selfplay", run), markup=False, soft_wrap=True)
    if run.rows:
        console.print(f"Curve: {run.folder / CURVE}", markup=False, soft_wrap=True)
    if run.steps:
        roles = " ".join(f"--{role.replace('_', '-')} {shlex.quote(str(run.folder / role))}" for role in AGENT_ROLES)
        console.print(f"Play: dorothie-gym rollout {roles}", markup=False, soft_wrap=True)
