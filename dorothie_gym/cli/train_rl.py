"""`dorothie-gym train-rl`: reinforcement learning and self-play."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn, TypeAlias, TypeVar

import typer

from dorothie_gym.cli.completion import complete_algorithm, complete_env
from dorothie_gym.cli.options import AsJson, Ray
from dorothie_gym.cli.output import FAILED, exit_interrupted, fail, print_json, reporting_errors, stderr, stdout
from dorothie_gym.cli.warm_up import compile_first
from dorothie_gym.ontology.roles import AGENT_ROLES
from dorothie_gym.processors import available_processors

if TYPE_CHECKING:
    from dorothie_gym.baselines.rl.run import OnProgress, OnStage, RunEvaluation, TrainingResult
    from dorothie_gym.baselines.rl.settings import RunSettings, SelfPlaySettings, TrainingSettings
    from dorothie_gym.baselines.rl.training import TrainingEvaluation
    from dorothie_gym.baselines.selfplay.training import SelfPlayEvaluation

Evaluation = TypeVar("Evaluation", bound="RunEvaluation")
Settings = TypeVar("Settings", bound="RunSettings")

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
        typer.Argument(
            metavar="ALGO", help="ppo, maskable_ppo, a2c, dqn, sac or selfplay.", autocompletion=complete_algorithm
        ),
    ],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder of the run; a started run is resumed.")],
    env: Annotated[
        str | None,
        typer.Option(
            metavar="ID",
            help=f"Id of the environment; default {DEFAULT_ENV}, for sac {CONTINUOUS_ENV}; selfplay has its own.",
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
            metavar="DIR", help="Corpus for behaviour cloning before training (PPO and A2C on Navigation-v0; selfplay)."
        ),
    ] = None,
    device: Annotated[
        str | None, typer.Option(help="Device of the networks, such as cuda; default cpu. Not for selfplay.")
    ] = None,
    ray: Ray = None,
    as_json: AsJson = False,
) -> None:
    """Train a driver (or another role) with stable-baselines3 from tuned defaults.

    The folder receives the model (weights in safetensors, the rest in JSON), the best model so far, a line of JSON per
    evaluation, and the learning curve. Ctrl-C saves the run; the same command resumes it. selfplay trains all three
    roles at once, each in its own folder that rollout can play; --set shared=true gives them one network, and
    --set co_wizard=POLICY --set participant=POLICY trains an Ad-Wizard against these.
    """
    given = _read_settings(setting or []) | ({} if observation is None else {"observation": observation})
    changes: Given = {
        "steps": steps, "environments": environments, "workers": workers, "seed": seed,
        "evaluate_every": evaluate_every, "episodes": episodes,
        "warm_start": None if warm_start is None else str(warm_start),
    }  # fmt: skip
    with _reporting_errors():
        if algorithm == "selfplay":
            if env is not None:
                fail("--env: selfplay uses DuoWizardEnv; omit the option, and choose a town with --set town=NAME")
            if device is not None:
                fail("--device: the networks of selfplay are trained on the processor; omit the option")
            _train_selfplay(out, given, changes, ray=ray, as_json=as_json)
        else:
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
        fail("train-rl needs torch and stable-baselines3; run: pip install 'dorothie-gym[baselines]'")
    from dorothie_gym.errors import ModelFileError, ProcessError, SettingsError

    with reporting_errors():
        try:
            yield
        except (SettingsError, ModelFileError) as error:
            fail(str(error))
        except ProcessError as error:
            fail(str(error), FAILED)


# --- Reinforcement learning -------------------------------------------------------------------------------------------


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
    from dorothie_gym.baselines.rl.environments import has_batch
    from dorothie_gym.baselines.rl.settings import tuned_settings
    from dorothie_gym.baselines.rl.training import Training, best_of

    settings = tuned_settings(algorithm, env, env_settings=given, **changes)
    if changes["workers"] is None and ray is None and not has_batch(settings.env):
        settings = _with_default_workers(settings)
    if ray is None and settings.env.startswith("dorothie_gym/"):
        compile_first(batches=has_batch(settings.env) and settings.workers == 0, pictures=settings.sees)
    with _progress(settings.steps, out, _line, quiet=as_json) as (on_progress, on_stage):
        result = Training(settings, out, on_progress, ray, on_stage, device or "cpu").run()
    if as_json:
        best = best_of(result.rows)
        print_json({**_facts(result, settings), "best": None if best is None else best.as_json()})
    else:
        _show(result, settings)
    if not result.finished:
        arguments = [settings.algorithm, "--env", settings.env, "--out", str(out)]
        arguments += ["--device", device] if device else []
        _exit_interrupted(result.steps, settings, out, _command(arguments, given, settings, ray))


def _line(row: TrainingEvaluation) -> str:
    outcome = row.outcome
    return (
        f"{row.steps:>10,} steps, {row.seconds:6.0f} s: success {100 * outcome.success:5.1f} % "
        f"({100 * outcome.low:.0f} to {100 * outcome.high:.0f}), reward {outcome.reward:.2f}, "
        f"{outcome.length:.0f} steps per episode"
    )


def _show(result: TrainingResult[TrainingEvaluation], settings: TrainingSettings) -> None:
    from dorothie_gym.baselines.rl.run import BEST, CURVE
    from dorothie_gym.baselines.rl.training import best_of
    from dorothie_gym.policies.policy_loader import DESCRIPTION

    console = stdout()
    console.print(_rate_line(f"{settings.algorithm} on {settings.env}", result), markup=False, soft_wrap=True)
    best = best_of(result.rows)
    if best is not None:
        console.print(f"Best: {_line(best).strip()}", markup=False, soft_wrap=True)
        console.print(f"Curve: {result.folder / CURVE}", markup=False, soft_wrap=True)
        console.print(f"Best model: {result.folder / BEST / DESCRIPTION}", markup=False, soft_wrap=True)
    console.print(f"Model: {result.folder / DESCRIPTION}", markup=False, soft_wrap=True)


# --- Self-play --------------------------------------------------------------------------------------------------------


def _train_selfplay(out: Path, given: Given, changes: Given, *, ray: str | None, as_json: bool) -> None:
    """Trains all three roles by self-play and prints the result.

    Args:
        out: folder of the run.
        given: settings of --set.
        changes: other settings.
        ray: address of a Ray cluster that steps the sessions, or None.
        as_json: whether to print one JSON object and nothing else.
    """
    from dorothie_gym.baselines.rl.settings import selfplay_settings
    from dorothie_gym.baselines.selfplay.training import SelfPlayTraining

    settings: SelfPlaySettings = selfplay_settings(given, **changes)
    if changes["workers"] is None and ray is None:
        settings = _with_default_workers(settings)
    if ray is None:
        compile_first()
    with _progress(settings.steps, out, _selfplay_line, quiet=as_json) as (on_progress, on_stage):
        result = SelfPlayTraining(settings, out, on_progress, ray, on_stage).run()
    if as_json:
        print_json(_facts(result, settings))
    else:
        _show_selfplay(result, settings)
    if not result.finished:
        command = _command(["selfplay", "--out", str(out)], given, settings, ray)
        _exit_interrupted(result.steps, settings, out, command)


def _selfplay_line(row: SelfPlayEvaluation) -> str:
    returns = ", ".join(f"{role} {'-' if value is None else f'{value:.2f}'}" for role, value in row.returns.items())
    return (
        f"{row.steps:>10,} steps, {row.seconds:6.0f} s: success against the scripted Ad-Wizard "
        f"{100 * row.scripted.success:5.1f} %, the learned one {100 * row.learned.success:5.1f} %; rewards {returns}"
    )


def _show_selfplay(result: TrainingResult[SelfPlayEvaluation], settings: SelfPlaySettings) -> None:
    from dorothie_gym.baselines.rl.run import CURVE

    console = stdout()
    console.print(_rate_line("selfplay", result), markup=False, soft_wrap=True)
    if result.rows:
        console.print(f"Curve: {result.folder / CURVE}", markup=False, soft_wrap=True)
    if result.steps:
        players = {role: settings.partners.get(role, str(result.folder / role)) for role in AGENT_ROLES}
        roles = " ".join(f"--{role.replace('_', '-')} {shlex.quote(name)}" for role, name in players.items())
        console.print(f"Play: dorothie-gym rollout {roles}", markup=False, soft_wrap=True)


# --- Both -------------------------------------------------------------------------------------------------------------


def _with_default_workers(settings: Settings) -> Settings:
    """Returns settings with one worker process per processor; with none on a single processor."""
    processors = available_processors()
    return replace(settings, workers=min(processors, settings.environments) if processors > 1 else 0)


@contextmanager
def _progress(
    total: int, out: Path, line: Callable[[Evaluation], str], *, quiet: bool
) -> Iterator[tuple[OnProgress[Evaluation], OnStage]]:
    """Shows a progress bar on a terminal and a line per evaluation; handles Ctrl-C before the first step.

    Args:
        total: number of training steps.
        out: folder of the run.
        line: formats an evaluation.
        quiet: whether bar and lines are hidden.

    Yields:
        Callbacks for the steps of the training, and for the work before the first step.
    """
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    console = stderr()
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, disable=quiet or not console.is_terminal, transient=True) as progress:
        bar = progress.add_task("Steps", total=total)

        def on_progress(done: int, steps: int, row: Evaluation | None) -> None:
            progress.update(bar, description="Steps", completed=done, total=steps)
            if row is not None and not quiet:
                progress.console.print(line(row), markup=False, soft_wrap=True)

        def on_stage(stage: str, done: int, stage_total: int) -> None:
            progress.update(bar, description=stage, completed=done, total=stage_total)

        try:
            yield on_progress, on_stage
        except KeyboardInterrupt:  # a running training catches it and saves
            progress.stop()
            exit_interrupted("Interrupted before the first step; the same command starts again.")


def _facts(result: TrainingResult[Evaluation], settings: RunSettings) -> dict[str, object]:
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


def _rate_line(name: str, result: TrainingResult[Evaluation]) -> str:
    """Returns a line with the number of steps of a run and their rate."""
    rate = result.steps / result.seconds if result.seconds else 0.0
    return f"{name}: {result.steps:,} steps in {result.seconds:.0f} s ({rate:.0f} per second, without evaluations)"


def _command(arguments: list[str], given: Given, settings: RunSettings, ray: str | None) -> str:
    """Returns the command that resumes a run."""
    words = ["dorothie-gym", "train-rl", *arguments]
    words += [word for name, value in given.items() for word in ("--set", f"{name}={value}")]
    words += [word for name in _OPTIONS for word in (f"--{name.replace('_', '-')}", str(getattr(settings, name)))]
    optional = {"--warm-start": settings.warm_start, "--ray": ray}
    words += [word for name, value in optional.items() if value is not None for word in (name, value)]
    return shlex.join(words)


def _exit_interrupted(steps: int, settings: RunSettings, out: Path, command: str) -> NoReturn:
    """Prints after Ctrl-C the folder of the run and the command that resumes it, and exits."""
    exit_interrupted(
        f"Interrupted after {steps:,} of {settings.steps:,} steps; the run is saved in {out}. Resume with: {command}"
    )
