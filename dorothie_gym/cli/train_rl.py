"""`dorothie-gym train-rl`: reinforcement learning."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Annotated, NoReturn, TypeAlias

import typer

from dorothie_gym import policies as players
from dorothie_gym.baselines import rl
from dorothie_gym.cli.completion import complete_algorithm, complete_env
from dorothie_gym.cli.options import AsJson, Ray
from dorothie_gym.cli.output import FAILED, exit_interrupted, fail, print_json, reporting_errors, stderr, stdout
from dorothie_gym.cli.warm_up import compile_first
from dorothie_gym.errors import ModelFileError, ProcessError, SettingsError
from dorothie_gym.support.installation import pip_install
from dorothie_gym.support.processors import available_processors

DEFAULT_ENV = "dorothie_gym/Navigation-v0"
"""Environment of train-rl."""

CONTINUOUS_ENV = "dorothie_gym/Navigation-continuous-v0"
"""Environment of algorithms that need continuous actions."""

Given: TypeAlias = Mapping[str, object]
"""Settings from the command line, by name; None keeps the default."""

_OPTIONS = ("steps", "environments", "workers", "seed", "evaluate_every", "episodes")


def train_rl(
    algorithm: Annotated[
        str,
        typer.Argument(metavar="ALGO", help="ppo, maskable_ppo, a2c, dqn or sac.", autocompletion=complete_algorithm),
    ],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder of the run; a started run is resumed.")],
    env: Annotated[
        str | None,
        typer.Option(
            metavar="ID",
            help=f"Id of the environment; default {DEFAULT_ENV}, for sac {CONTINUOUS_ENV}.",
            autocompletion=complete_env,
        ),
    ] = None,
    setting: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="NAME=VALUE",
            help="Argument of the environment (guidance=goals); repeatable.",
        ),
    ] = None,
    observation: Annotated[
        str | None,
        typer.Option(metavar="KIND", help="What a driver of the navigation environments observes: vector or camera."),
    ] = None,
    steps: Annotated[int | None, typer.Option(min=1, help="Steps of all environments; default: tuned.")] = None,
    environments: Annotated[
        int | None, typer.Option(min=1, max=4096, help="Parallel environments; default: tuned.")
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option(
            min=0,
            max=256,
            help="Worker processes that step the environments; default 0 for Navigation, else one per processor.",
        ),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, max=2**31 - 1, help="Seed of networks and environments.")] = 0,
    evaluate_every: Annotated[int | None, typer.Option(min=1, help="Steps per evaluation; default: tuned.")] = None,
    episodes: Annotated[int | None, typer.Option(min=1, help="Episodes of an evaluation; default: tuned.")] = None,
    warm_start: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR", help="Corpus for behaviour cloning before training (PPO and A2C on Navigation-v0)."
        ),
    ] = None,
    device: Annotated[str | None, typer.Option(help="Device of the networks, such as cuda; default cpu.")] = None,
    ray: Ray = None,
    as_json: AsJson = False,
) -> None:
    """Train a driver (or another role) with stable-baselines3 from tuned defaults.

    The folder receives the model (weights in safetensors, the rest in JSON), the best model so far, a line of JSON per
    evaluation, and the learning curve. Ctrl-C saves the run; the same command resumes it. With --env
    dorothie_gym/AdWizard-v0, --set partners={co_wizard: POLICY, participant: POLICY} names those it is trained against.
    """
    given = _read_settings(setting or []) | ({} if observation is None else {"observation": observation})
    changes: Given = {
        "steps": steps,
        "environments": environments,
        "workers": workers,
        "seed": seed,
        "evaluate_every": evaluate_every,
        "episodes": episodes,
        "warm_start": None if warm_start is None else str(warm_start),
    }
    with _reporting_errors():
        env = env or (CONTINUOUS_ENV if algorithm == "sac" else DEFAULT_ENV)
        _train(algorithm, env, out, given, changes, ray=ray, device=device, as_json=as_json)


def _read_settings(given: list[str]) -> dict[str, object]:
    """Returns the settings of --set; values are parsed as YAML, so that numbers are numbers."""
    import yaml

    settings: dict[str, object] = {}
    for item in given:
        name, separator, value = item.partition("=")
        if not (name.isidentifier() and separator):
            fail(f"--set {item}: give it as NAME=VALUE, for instance guidance=goals")
        try:
            settings[name] = yaml.safe_load(value)
        except yaml.YAMLError:
            fail(f"--set {item}: the value {value!r} cannot be read")
    return settings


@contextmanager
def _reporting_errors() -> Iterator[None]:
    """Turns errors of the settings, of the corpus and of processes into one message."""
    try:
        import sb3_contrib  # noqa: F401
        import torch  # noqa: F401
    except ImportError:
        fail(f"train-rl needs torch and stable-baselines3; run: {pip_install('baselines')}")
    with reporting_errors():
        try:
            yield
        except (SettingsError, ModelFileError) as error:
            fail(str(error))
        except ProcessError as error:
            fail(str(error), FAILED)


def _train(
    algorithm: str,
    env: str,
    out: Path,
    given: Given,
    changes: Given,
    *,
    ray: str | None,
    device: str | None,
    as_json: bool,
) -> None:
    """Trains a model of stable-baselines3 and prints the result.

    Args:
        algorithm: name of the algorithm.
        env: id of the environment.
        out: folder of the run.
        given: arguments of the environment.
        changes: other settings.
        ray: address of a Ray cluster that steps the environments, or None.
        device: device of the networks; None for the processor.
        as_json: whether to print one JSON object and nothing else.
    """
    settings = rl.tuned_settings(algorithm, env, env_settings=given, **changes)
    if changes["workers"] is None and ray is None and not rl.has_batch(settings.env):
        settings = _with_default_workers(settings)
    if ray is None and settings.env.startswith("dorothie_gym/"):
        compile_first(batches=rl.has_batch(settings.env) and settings.workers == 0, pictures=settings.sees)
    with _progress(settings.steps, out, quiet=as_json) as (on_progress, on_stage):
        result = rl.Training(settings, out, on_progress, ray, on_stage, device or "cpu").run()
    if as_json:
        best = rl.best_of(result.rows, settings)
        print_json({**_facts(result, settings), "best": None if best is None else best.as_json()})
    else:
        _show(result, settings)
    if not result.finished:
        arguments = [settings.algorithm, "--env", settings.env, "--out", str(out)]
        arguments += ["--device", device] if device else []
        _exit_interrupted(result.steps, settings, out, _command(arguments, given, settings, ray))


def _line(row: rl.TrainingEvaluation) -> str:
    outcome = row.outcome
    return (
        f"{row.steps:>10,} steps, {row.seconds:6.0f} s: success {100 * outcome.success:5.1f} % "
        f"({100 * outcome.low:.0f} to {100 * outcome.high:.0f}), reward {outcome.reward:.2f}, "
        f"{outcome.length:.0f} steps per episode"
    )


def _show(result: rl.TrainingResult, settings: rl.TrainingSettings) -> None:
    console = stdout()
    console.print(_rate_line(f"{settings.algorithm} on {settings.env}", result), markup=False, soft_wrap=True)
    best = rl.best_of(result.rows, settings)
    if best is not None:
        console.print(f"Best: {_line(best).strip()}", markup=False, soft_wrap=True)
        console.print(f"Curve: {result.folder / rl.CURVE}", markup=False, soft_wrap=True)
        console.print(f"Best model: {result.folder / rl.BEST / players.DESCRIPTION}", markup=False, soft_wrap=True)
    console.print(f"Model: {result.folder / players.DESCRIPTION}", markup=False, soft_wrap=True)


def _with_default_workers(settings: rl.TrainingSettings) -> rl.TrainingSettings:
    """Returns settings with one worker process per processor; with none on a single processor."""
    processors = available_processors()
    return replace(settings, workers=min(processors, settings.environments) if processors > 1 else 0)


@contextmanager
def _progress(total: int, out: Path, *, quiet: bool) -> Iterator[tuple[rl.OnProgress, rl.OnStage]]:
    """Shows a progress bar on a terminal and a line per evaluation; handles Ctrl-C before the first step.

    Args:
        total: number of training steps.
        out: folder of the run.
        quiet: whether bar and lines are hidden.

    Yields:
        Callbacks for the steps of the training, and for the work before the first step.
    """
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    console = stderr()
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, disable=quiet or not console.is_terminal, transient=True) as progress:
        bar = progress.add_task("Steps", total=total)

        def on_progress(done: int, steps: int, row: rl.TrainingEvaluation | None) -> None:
            progress.update(bar, description="Steps", completed=done, total=steps)
            if row is not None and not quiet:
                progress.console.print(_line(row), markup=False, soft_wrap=True)

        def on_stage(stage: str, done: int, stage_total: int) -> None:
            progress.update(bar, description=stage, completed=done, total=stage_total)

        try:
            yield on_progress, on_stage
        except KeyboardInterrupt:  # a running training catches it and saves
            progress.stop()
            exit_interrupted("Interrupted before the first step; the same command starts again.")


def _facts(result: rl.TrainingResult, settings: rl.TrainingSettings) -> dict[str, object]:
    """Returns the result of a run and its settings in JSON types."""
    return {
        "out": str(result.folder),
        "finished": result.finished,
        "steps": result.steps,
        "seconds": round(result.seconds, 3),
        "steps_per_second": round(result.steps / result.seconds, 1) if result.seconds else None,
        "evaluations": [row.as_json() for row in result.rows],
        "settings": settings.as_json(),
    }


def _rate_line(name: str, result: rl.TrainingResult) -> str:
    """Returns a line with the number of steps of a run and their rate."""
    rate = result.steps / result.seconds if result.seconds else 0.0
    return f"{name}: {result.steps:,} steps in {result.seconds:.0f} s ({rate:.0f} per second, without evaluations)"


def _command(arguments: list[str], given: Given, settings: rl.TrainingSettings, ray: str | None) -> str:
    """Returns the command that resumes a run."""
    words = ["dorothie-gym", "train-rl", *arguments]
    words += [word for name, value in given.items() for word in ("--set", f"{name}={value}")]
    words += [word for name in _OPTIONS for word in (f"--{name.replace('_', '-')}", str(getattr(settings, name)))]
    optional = {"--warm-start": settings.warm_start, "--ray": ray}
    words += [word for name, value in optional.items() if value is not None for word in (name, value)]
    return shlex.join(words)


def _exit_interrupted(steps: int, settings: rl.TrainingSettings, out: Path, command: str) -> NoReturn:
    """Prints after Ctrl-C the folder of the run and the command that resumes it, and exits."""
    exit_interrupted(
        f"Interrupted after {steps:,} of {settings.steps:,} steps; the run is saved in {out}. Resume with: {command}"
    )
