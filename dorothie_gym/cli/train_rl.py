"""`dorothie-gym train-rl`: reinforcement learning."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from dorothie_gym.cli.output import INTERRUPTED, fail, print_json, stderr, stdout, told_plainly

if TYPE_CHECKING:
    from dorothie_gym.baselines.rl import Run, TrainingSettings

NEEDS = "train-rl needs torch and stable-baselines3; pip install 'dorothie-gym[baselines]' brings them"


def train_rl(
    algorithm: Annotated[str, typer.Argument(metavar="ALGO", help="ppo, maskable_ppo, a2c, dqn or sac.")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder of the run; one that was begun is gone on with.")],
    env: Annotated[str, typer.Option(metavar="ID", help="Id of the environment.")] = "dorothie_gym/Navigation-v0",
    setting: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="An argument of the environment, as guidance=goals; repeat."),
    ] = None,
    steps: Annotated[int | None, typer.Option(min=1, help="Of all environments together; as tuned.")] = None,
    environments: Annotated[int | None, typer.Option(min=1, max=256, help="How many play at once; as tuned.")] = None,
    workers: Annotated[
        int | None,
        typer.Option(min=0, max=256, help="Processes that step them; 0: the one that learns. One for each processor."),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, max=2**31 - 1, help="Of networks and environments.")] = 0,
    evaluate_every: Annotated[int | None, typer.Option(min=1, help="Steps between evaluations; as tuned.")] = None,
    episodes: Annotated[int | None, typer.Option(min=1, help="Of an evaluation; as tuned.")] = None,
    warm_start: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Corpus: learn first what its Co-Wizards did (Navigation-v0; PPO and A2C)."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Write one JSON object, and nothing else.")] = False,
) -> None:
    """Train a driver (or any role) with stable-baselines3, from defaults that were tuned.

    The folder gets the model (weights in safetensors, all else in JSON), the best one so far, a line of JSON for each
    evaluation, and the learning curve. Ctrl-C keeps what there is; the same command goes on.
    """
    try:
        from dorothie_gym.baselines.rl import SettingsError, Training, WeightsError, tuned_settings
    except ImportError:
        fail(NEEDS)
    from dorothie_gym.sessions import SessionError

    with told_plainly():
        try:
            settings = tuned_settings(
                algorithm, env, env_settings=_read_settings(setting or []), steps=steps, environments=environments,
                workers=workers, seed=seed, evaluate_every=evaluate_every, episodes=episodes,
                warm_start=None if warm_start is None else str(warm_start),
            )  # fmt: skip
            if workers is None:
                settings = replace(settings, workers=_workers(settings.environments))
            with _progress(settings, quiet=as_json) as watch:
                run = Training(settings, out, watch).go()
        except (SettingsError, WeightsError, SessionError) as error:
            fail(str(error))
    if as_json:
        print_json(_facts(run, settings))
    else:
        _show(run, settings)
    if not run.finished:
        stderr().print(
            f"Interrupted after {run.steps:,} of {settings.steps:,} steps; all so far is in {out}. "
            f"Go on with: {_command(settings, out)}", markup=False, soft_wrap=True,
        )  # fmt: skip
        raise typer.Exit(INTERRUPTED)


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


def _workers(environments: int) -> int:
    """A process for each processor, where there is more than one."""
    from dorothie_gym.world.vector_world import available_processors

    processors = available_processors()
    return min(processors, environments) if processors > 1 else 0


@contextmanager
def _progress(settings: TrainingSettings, *, quiet: bool) -> Iterator[Callable[[int, int, Any], None]]:
    """A bar while standard error is a terminal, and a line for each evaluation."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    console = stderr()
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, disable=quiet or not console.is_terminal, transient=True) as progress:
        bar = progress.add_task("Steps", total=settings.steps)

        def watch(done: int, total: int, row: Any) -> None:
            progress.update(bar, completed=done, total=total)
            if row is not None and not quiet:
                progress.console.print(_line(row), markup=False, soft_wrap=True)

        yield watch


def _line(row: Any) -> str:
    outcome = row.outcome
    return (
        f"{row.steps:>10,} steps, {row.seconds:6.0f} s: success {100 * outcome.success:5.1f} % "
        f"({100 * outcome.low:.0f} to {100 * outcome.high:.0f}), reward {outcome.reward:.2f}, "
        f"{outcome.length:.0f} steps an episode"
    )


def _show(run: Run, settings: TrainingSettings) -> None:
    from dorothie_gym.baselines.rl.training import BEST, CURVE
    from dorothie_gym.baselines.rl.weights import DESCRIPTION

    console = stdout()
    rate = run.steps / run.seconds if run.seconds else 0.0
    console.print(f"{settings.algorithm} on {settings.env}: {run.steps:,} steps in {run.seconds:.0f} s ({rate:.0f} a "
                  "second, evaluations left out)", markup=False, soft_wrap=True)  # fmt: skip
    if run.best is not None:
        console.print(f"Best: {_line(run.best).strip()}", markup=False, soft_wrap=True)
        console.print(f"Curve: {run.folder / CURVE}", markup=False, soft_wrap=True)
        console.print(f"Best model: {run.folder / BEST / DESCRIPTION}", markup=False, soft_wrap=True)
    console.print(f"Model: {run.folder / DESCRIPTION}", markup=False, soft_wrap=True)


def _facts(run: Run, settings: TrainingSettings) -> dict[str, Any]:
    return {
        "out": str(run.folder),
        "finished": run.finished,
        "steps": run.steps,
        "seconds": round(run.seconds, 3),
        "steps_per_second": round(run.steps / run.seconds, 1) if run.seconds else None,
        "best": None if run.best is None else run.best.as_json(),
        "evaluations": [row.as_json() for row in run.rows],
        "settings": settings.as_json(),
    }


def _command(settings: TrainingSettings, out: Path) -> str:
    """The command that goes on."""
    words = ["dorothie-gym", "train-rl", settings.algorithm, "--env", settings.env, "--out", str(out)]
    for name, value in settings.env_settings.items():
        words += ["--set", f"{name}={value}"]
    for name in ("steps", "environments", "workers", "seed", "evaluate_every", "episodes"):
        words += [f"--{name.replace('_', '-')}", str(getattr(settings, name))]
    if settings.warm_start is not None:
        words += ["--warm-start", settings.warm_start]
    return shlex.join(words)
