"""`dorothie-gym train-rl`: reinforcement learning."""

from __future__ import annotations

import shlex
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from dorothie_gym.cli.options import AsJson, Ray
from dorothie_gym.cli.output import FAILED, fail, print_json, stdout, told_plainly
from dorothie_gym.cli.training import facts_of, options_of, processes, rate_line, tell_interrupted, training_progress

if TYPE_CHECKING:
    from dorothie_gym.baselines.rl import Run, TrainingSettings
    from dorothie_gym.baselines.rl.training import Row

DRIVING = "dorothie_gym/Navigation-v0"

NEEDS = "train-rl needs torch and stable-baselines3; pip install 'dorothie-gym[baselines]' brings them"


def train_rl(
    algorithm: Annotated[str, typer.Argument(metavar="ALGO", help="ppo, maskable_ppo, a2c, dqn, sac or selfplay.")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder of the run; one that was begun is gone on with.")],
    env: Annotated[
        str | None,
        typer.Option(metavar="ID", help=f"Id of the environment, {DRIVING} by default; selfplay has its own."),
    ] = None,
    setting: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="An argument of the environment, as guidance=goals; repeat."),
    ] = None,
    steps: Annotated[int | None, typer.Option(min=1, help="Of all environments together; as tuned.")] = None,
    environments: Annotated[int | None, typer.Option(min=1, max=256, help="How many play at once; as tuned.")] = None,
    workers: Annotated[
        int | None,
        typer.Option(
            min=0,
            max=256,
            help="Processes that step them, one for each processor without it; 0: the one that learns.",
        ),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, max=2**31 - 1, help="Of networks and environments.")] = 0,
    evaluate_every: Annotated[int | None, typer.Option(min=1, help="Steps between evaluations; as tuned.")] = None,
    episodes: Annotated[int | None, typer.Option(min=1, help="Of an evaluation; as tuned.")] = None,
    warm_start: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR", help="Corpus: learn first what was done in it (PPO and A2C on Navigation-v0; selfplay)."
        ),
    ] = None,
    ray: Ray = None,
    as_json: AsJson = False,
) -> None:
    """Train a driver (or any role) with stable-baselines3, from defaults that were tuned.

    The folder gets the model (weights in safetensors, all else in JSON), the best one so far, a line of JSON for each
    evaluation, and the learning curve. Ctrl-C keeps what there is; the same command goes on. selfplay trains all three
    roles at once, each in a folder of its own that rollout plays; --set shared=true gives them one network.
    """
    given = _read_settings(setting or [])
    changes = {
        "steps": steps, "environments": environments, "workers": workers, "seed": seed,
        "evaluate_every": evaluate_every, "episodes": episodes,
        "warm_start": None if warm_start is None else str(warm_start),
    }  # fmt: skip
    try:
        from dorothie_gym.baselines.rl import Training, tuned_settings
        from dorothie_gym.errors import ModelFileError, SettingsError
    except ImportError:
        fail(NEEDS)
    from dorothie_gym.errors import ProcessError, SessionError

    if algorithm == "selfplay":
        from dorothie_gym.cli.selfplay import train_selfplay

        if env is not None:
            fail("--env: selfplay plays DuoWizardEnv; leave it out, and choose a town with --set town=NAME")
        train_selfplay(out, given, changes, ray=ray, as_json=as_json)
        return
    with told_plainly():
        try:
            settings = tuned_settings(algorithm, env or DRIVING, env_settings=given, **changes)
            if workers is None and ray is None:
                settings = replace(settings, workers=processes(settings.environments))
            with training_progress(settings.steps, out, _line, quiet=as_json) as (watch, tell):
                run = Training(settings, out, watch, ray, tell).go()
        except (SettingsError, ModelFileError, SessionError) as error:
            fail(str(error))
        except ProcessError as error:
            fail(str(error), FAILED)
    if as_json:
        print_json(_facts(run, settings))
    else:
        _show(run, settings)
    if not run.finished:
        tell_interrupted(run.steps, settings.steps, out, _command(settings, out, ray))


def _read_settings(given: list[str]) -> dict[str, Any]:
    """Arguments of the environment; values are read as YAML, so that numbers are numbers."""
    import yaml

    settings: dict[str, Any] = {}
    for item in given:
        name, separator, value = item.partition("=")
        if not (name.isidentifier() and separator):
            fail(f"--set {item}: give it as NAME=VALUE, for instance guidance=goals")
        try:
            settings[name] = yaml.safe_load(value)
        except yaml.YAMLError:
            fail(f"--set {item}: the value {value!r} cannot be read")
    return settings


def _line(row: Any) -> str:
    outcome = row.outcome
    return (
        f"{row.steps:>10,} steps, {row.seconds:6.0f} s: success {100 * outcome.success:5.1f} % "
        f"({100 * outcome.low:.0f} to {100 * outcome.high:.0f}), reward {outcome.reward:.2f}, "
        f"{outcome.length:.0f} steps an episode"
    )


def _show(run: Run[Row], settings: TrainingSettings) -> None:
    from dorothie_gym.baselines.rl.training import BEST, CURVE, best_of
    from dorothie_gym.baselines.rl.weights import DESCRIPTION

    console = stdout()
    console.print(rate_line(f"{settings.algorithm} on {settings.env}", run), markup=False, soft_wrap=True)
    best = best_of(run.rows)
    if best is not None:
        console.print(f"Best: {_line(best).strip()}", markup=False, soft_wrap=True)
        console.print(f"Curve: {run.folder / CURVE}", markup=False, soft_wrap=True)
        console.print(f"Best model: {run.folder / BEST / DESCRIPTION}", markup=False, soft_wrap=True)
    console.print(f"Model: {run.folder / DESCRIPTION}", markup=False, soft_wrap=True)


def _facts(run: Run[Row], settings: TrainingSettings) -> dict[str, Any]:
    from dorothie_gym.baselines.rl.training import best_of

    best = best_of(run.rows)
    return {**facts_of(run, settings), "best": None if best is None else best.as_json()}


def _command(settings: TrainingSettings, out: Path, ray: str | None) -> str:
    """The command that goes on."""
    words = ["dorothie-gym", "train-rl", settings.algorithm, "--env", settings.env, "--out", str(out)]
    for name, value in settings.env_settings.items():
        words += ["--set", f"{name}={value}"]
    return shlex.join([*words, *options_of(settings, ray)])
