"""`dorothie-gym train-rl`: reinforcement learning."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import typer

from dorothie_gym.cli.options import AsJson, Ray
from dorothie_gym.cli.output import FAILED, INTERRUPTED, fail, print_json, reporting_errors, stderr, stdout
from dorothie_gym.ontology import AGENT_ROLES

if TYPE_CHECKING:
    from dorothie_gym.baselines.rl import TrainingResult, TrainingSettings
    from dorothie_gym.baselines.rl.training import TrainingEvaluation
    from dorothie_gym.baselines.selfplay.training import SelfPlayEvaluation


_OPTIONS = ("steps", "environments", "workers", "seed", "evaluate_every", "episodes")


def processes(environments: int) -> int:
    """Returns the default number of worker processes: one per processor, or 0 on a single processor."""
    from dorothie_gym.sim.batch.worlds import available_processors

    processors = available_processors()
    return min(processors, environments) if processors > 1 else 0


OnStep = Callable[[int, int, Any], None]
OnPreparation = Callable[[str, int, int], None]


@contextmanager
def training_progress(
    total: int, out: Path, line: Callable[[Any], str], *, quiet: bool
) -> Iterator[tuple[OnStep, OnPreparation]]:  # fmt: skip
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

        def watch(done: int, steps: int, row: Any) -> None:
            progress.update(bar, description="Steps", completed=done, total=steps)
            if row is not None and not quiet:
                progress.console.print(line(row), markup=False, soft_wrap=True)

        def tell(what: str, done: int, all_of_it: int) -> None:
            progress.update(bar, description=what, completed=done, total=all_of_it)

        try:
            yield watch, tell
        except KeyboardInterrupt:  # a running training catches it and saves
            progress.stop()
            message = f"Interrupted before the first step; {out} is unchanged. The same command starts again."
            console.print(message, markup=False, soft_wrap=True)
            raise typer.Exit(INTERRUPTED) from None


def facts_of(run: Any, settings: Any) -> dict[str, Any]:
    """Returns the result of a run and its settings in JSON types."""
    return {
        "out": str(run.folder),
        "finished": run.finished,
        "steps": run.steps,
        "seconds": round(run.seconds, 3),
        "steps_per_second": round(run.steps / run.seconds, 1) if run.seconds else None,
        "evaluations": [row.as_json() for row in run.rows],
        "settings": settings.as_json(),
    }


def rate_line(name: str, run: Any) -> str:
    """Returns the number of steps of a run and their rate, in a line."""
    rate = run.steps / run.seconds if run.seconds else 0.0
    return f"{name}: {run.steps:,} steps in {run.seconds:.0f} s ({rate:.0f} per second, without evaluations)"


def options_of(settings: Any, ray: str | None) -> list[str]:
    """Returns the command-line options for the settings of a run and for the cluster."""
    words = [word for name in _OPTIONS for word in (f"--{name.replace('_', '-')}", str(getattr(settings, name)))]
    more = {"--warm-start": settings.warm_start, "--ray": ray}
    return words + [word for name, value in more.items() if value is not None for word in (name, value)]


def exit_interrupted(steps: int, total: int, out: Path, command: str) -> NoReturn:
    """Prints after Ctrl-C the folder of the run and the command that resumes it, and exits."""
    stderr().print(
        f"Interrupted after {steps:,} of {total:,} steps; the run is saved in {out}. Resume with: {command}",
        markup=False, soft_wrap=True,
    )  # fmt: skip
    raise typer.Exit(INTERRUPTED)


# --- `dorothie-gym train-rl`: reinforcement learning -----------------------------------------------------------------

DRIVING = "dorothie_gym/Navigation-v0"

NEEDS = "train-rl needs torch and stable-baselines3; run: pip install 'dorothie-gym[baselines]'"


def train_rl(
    algorithm: Annotated[str, typer.Argument(metavar="ALGO", help="ppo, maskable_ppo, a2c, dqn, sac or selfplay.")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder of the run; a started run is resumed.")],
    env: Annotated[
        str | None,
        typer.Option(metavar="ID", help=f"Id of the environment; default {DRIVING}; selfplay has its own."),
    ] = None,
    setting: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="NAME=VALUE",
            help="Argument of the environment (guidance=goals); repeatable.",
        ),
    ] = None,
    steps: Annotated[int | None, typer.Option(min=1, help="Steps of all environments; default: tuned.")] = None,
    environments: Annotated[
        int | None, typer.Option(min=1, max=256, help="Parallel environments; default: tuned.")
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option(
            min=0,
            max=256,
            help="Worker processes that step the environments; default one per processor; 0: the learner steps them.",
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
    ray: Ray = None,
    as_json: AsJson = False,
) -> None:
    """Train a driver (or another role) with stable-baselines3 from tuned defaults.

    The folder receives the model (weights in safetensors, the rest in JSON), the best model so far, a line of JSON per
    evaluation, and the learning curve. Ctrl-C saves the run; the same command resumes it. selfplay trains all three
    roles at once, each in its own folder that rollout can play; --set shared=true gives them one network.
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
        if env is not None:
            fail("--env: selfplay uses DuoWizardEnv; omit the option, and choose a town with --set town=NAME")
        train_selfplay(out, given, changes, ray=ray, as_json=as_json)
        return
    with reporting_errors():
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
        exit_interrupted(run.steps, settings.steps, out, _command(settings, out, ray))


def _read_settings(given: list[str]) -> dict[str, Any]:
    """Returns the arguments of the environment; values are parsed as YAML, so that numbers are numbers."""
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
        f"{outcome.length:.0f} steps per episode"
    )


def _show(run: TrainingResult[TrainingEvaluation], settings: TrainingSettings) -> None:
    from dorothie_gym.baselines.rl.checkpoint import DESCRIPTION
    from dorothie_gym.baselines.rl.training import BEST, CURVE, best_of

    console = stdout()
    console.print(rate_line(f"{settings.algorithm} on {settings.env}", run), markup=False, soft_wrap=True)
    best = best_of(run.rows)
    if best is not None:
        console.print(f"Best: {_line(best).strip()}", markup=False, soft_wrap=True)
        console.print(f"Curve: {run.folder / CURVE}", markup=False, soft_wrap=True)
        console.print(f"Best model: {run.folder / BEST / DESCRIPTION}", markup=False, soft_wrap=True)
    console.print(f"Model: {run.folder / DESCRIPTION}", markup=False, soft_wrap=True)


def _facts(run: TrainingResult[TrainingEvaluation], settings: TrainingSettings) -> dict[str, Any]:
    from dorothie_gym.baselines.rl.training import best_of

    best = best_of(run.rows)
    return {**facts_of(run, settings), "best": None if best is None else best.as_json()}


def _command(settings: TrainingSettings, out: Path, ray: str | None) -> str:
    """Returns the command that resumes the run."""
    words = ["dorothie-gym", "train-rl", settings.algorithm, "--env", settings.env, "--out", str(out)]
    for name, value in settings.env_settings.items():
        words += ["--set", f"{name}={value}"]
    return shlex.join([*words, *options_of(settings, ray)])


# --- Self-play --------------------------------------------------------------------------------------------------------


def train_selfplay(
    out: Path, given: Mapping[str, Any], changes: Mapping[str, Any], *, ray: str | None, as_json: bool
) -> None:
    """Trains all three roles by self-play and prints the result.

    Args:
        out: folder of the run.
        given: arguments from `--set`.
        changes: options; None keeps the default.
        ray: address of a Ray cluster that steps the sessions, or None.
        as_json: whether to print one JSON object and nothing else.
    """
    from dorothie_gym.baselines.selfplay.settings import selfplay_settings
    from dorothie_gym.baselines.selfplay.training import SelfPlayTraining
    from dorothie_gym.errors import ModelFileError, ProcessError, SessionError, SettingsError

    with reporting_errors():
        try:
            settings = selfplay_settings(given, **changes)
            if changes["workers"] is None and ray is None:
                settings = replace(settings, workers=processes(settings.environments))
            with training_progress(settings.steps, out, _selfplay_line, quiet=as_json) as (watch, tell):
                run = SelfPlayTraining(settings, out, watch, ray, tell).go()
        except (SettingsError, ModelFileError, SessionError) as error:
            fail(str(error))
        except ProcessError as error:
            fail(str(error), FAILED)
    if as_json:
        print_json(facts_of(run, settings))
    else:
        _show_selfplay(run)
    if not run.finished:
        words = ["dorothie-gym", "train-rl", "selfplay", "--out", str(out)]
        words += [word for name, value in given.items() for word in ("--set", f"{name}={value}")]
        exit_interrupted(run.steps, settings.steps, out, shlex.join([*words, *options_of(settings, ray)]))


def _selfplay_line(row: SelfPlayEvaluation) -> str:
    returns = ", ".join(f"{role} {'-' if value is None else f'{value:.2f}'}" for role, value in row.returns.items())
    return (
        f"{row.steps:>10,} steps, {row.seconds:6.0f} s: success against the scripted Ad-Wizard "
        f"{100 * row.scripted.success:5.1f} %, the learned one {100 * row.learned.success:5.1f} %; rewards {returns}"
    )


def _show_selfplay(run: TrainingResult[SelfPlayEvaluation]) -> None:
    from dorothie_gym.baselines.rl.training import CURVE

    console = stdout()
    console.print(rate_line("selfplay", run), markup=False, soft_wrap=True)
    if run.rows:
        console.print(f"Curve: {run.folder / CURVE}", markup=False, soft_wrap=True)
    if run.steps:
        roles = " ".join(f"--{role.replace('_', '-')} {shlex.quote(str(run.folder / role))}" for role in AGENT_ROLES)
        console.print(f"Play: dorothie-gym rollout {roles}", markup=False, soft_wrap=True)
