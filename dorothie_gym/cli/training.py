"""What commands that train by reinforcement share: a bar, worker processes, and how to go on."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NoReturn

import typer

from dorothie_gym.cli.output import INTERRUPTED, stderr

_OPTIONS = ("steps", "environments", "workers", "seed", "evaluate_every", "episodes")


def processes(environments: int) -> int:
    """A process for each processor, where there is more than one."""
    from dorothie_gym.sim.batch.worlds import available_processors

    processors = available_processors()
    return min(processors, environments) if processors > 1 else 0


Watch = Callable[[int, int, Any], None]
Tell = Callable[[str, int, int], None]


@contextmanager
def training_progress(
    total: int, out: Path, line: Callable[[Any], str], *, quiet: bool
) -> Iterator[tuple[Watch, Tell]]:  # fmt: skip
    """A bar while standard error is a terminal, and a line for each evaluation; Ctrl-C before the first step is told.

    Args:
        total: steps there will be.
        out: folder of the run.
        line: tells of an evaluation.
        quiet: whether nothing is told.

    Yields:
        What is told of the steps of training, and what is told of what comes before them.
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
        except KeyboardInterrupt:  # a run that is under way catches it, and saves
            progress.stop()
            message = f"Interrupted before the run went on; what {out} has is as it was. The same command begins again."
            console.print(message, markup=False, soft_wrap=True)
            raise typer.Exit(INTERRUPTED) from None


def facts_of(run: Any, settings: Any) -> dict[str, Any]:
    """What came of a run and how, in JSON types."""
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
    """How far a run has come, and how fast."""
    rate = run.steps / run.seconds if run.seconds else 0.0
    return f"{name}: {run.steps:,} steps in {run.seconds:.0f} s ({rate:.0f} a second, evaluations left out)"


def options_of(settings: Any, ray: str | None) -> list[str]:
    """Words of a command line for the settings of a run that have options of their own, and for the cluster."""
    words = [word for name in _OPTIONS for word in (f"--{name.replace('_', '-')}", str(getattr(settings, name)))]
    more = {"--warm-start": settings.warm_start, "--ray": ray}
    return words + [word for name, value in more.items() if value is not None for word in (name, value)]


def tell_interrupted(steps: int, total: int, out: Path, command: str) -> NoReturn:
    """Tells after Ctrl-C where everything is and what goes on with it, and exits."""
    stderr().print(
        f"Interrupted after {steps:,} of {total:,} steps; all so far is in {out}. Go on with: {command}",
        markup=False, soft_wrap=True,
    )  # fmt: skip
    raise typer.Exit(INTERRUPTED)
