"""`python -m benchmarks release`: measures the figures of README and docs at one commit, and writes them there."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from benchmarks.release import figures as figure_file
from benchmarks.release.quotes import QuoteFile
from benchmarks.release.running import Build, measure, outdated
from benchmarks.release.steps import STEPS
from dorothie_gym.cli.output import FAILED, exit_interrupted, fail, reporting_errors, stdout
from dorothie_gym.errors import ProcessError, did_you_mean

if TYPE_CHECKING:
    from benchmarks.release.figures import Measurement


def release(
    steps: Annotated[
        list[str] | None, typer.Argument(metavar="[STEP]...", help="Steps to measure; all if none.")
    ] = None,
    work: Annotated[Path, typer.Option(metavar="DIR", help="Folder of the results; a started release resumes.")] = Path(
        "release"
    ),
    show: Annotated[
        bool, typer.Option("--list", help="List the steps and what was measured; measure nothing.")
    ] = False,
    pages: Annotated[
        bool, typer.Option("--pages", help="Write the figures of the file into README and docs; measure nothing.")
    ] = False,
    check: Annotated[
        bool,
        typer.Option("--check", help="Fail if a figure is of another build, or a page states another one."),
    ] = False,
) -> None:
    """Measure the figures of README and docs at this commit, and write them to docs/figures.json and the pages.

    A step that was measured with this build of the package is not measured again. The whole takes hours.
    """
    names = _checked(steps or list(STEPS))
    with reporting_errors():
        measured = figure_file.load()
        build = Build.of_checkout()
        if show:
            _list(names, measured, build)
        elif check:
            _check(measured, build)
        elif pages:
            _write_pages(measured)
        else:
            _measure(names, measured, build, work)


def _checked(names: list[str]) -> list[str]:
    for name in names:
        if name not in STEPS:
            fail(f"there is no step {name!r}; {did_you_mean(name, STEPS)}--list lists them")
    return names


def _measure(names: list[str], measured: dict[str, Measurement], build: Build, work: Path) -> None:
    if build.changes:
        fail(f"{build.changes[0]} differs from commit {build.commit}; commit first, so that figures have a commit")
    screen = stdout()
    waiting = outdated(measured, names, build)
    for number, name in enumerate(waiting, 1):
        step = STEPS[name]
        screen.print(f"{number} of {len(waiting)}: {name}, about {step.minutes:.0f} min", style="bold")
        try:
            measured[name] = measure(step, build, work, lambda command: screen.print(f"  {command}", soft_wrap=True))
        except ProcessError as error:
            fail(str(error), FAILED)
        except KeyboardInterrupt:
            exit_interrupted(f"Interrupted in {name}; the same command resumes.")
        now = Build.of_checkout()
        if now.changes or now.package != build.package:
            fail(f"the checkout has changed while {name} was measured; delete its folder in {work}, and measure again")
        figure_file.save(measured)
    _write_pages(measured)


def _write_pages(measured: dict[str, Measurement]) -> None:
    changed = QuoteFile.load().renew(figure_file.by_name(measured))
    stdout().print(f"Changed pages: {', '.join(changed)}." if changed else "All pages state these figures.")


def _check(measured: dict[str, Measurement], build: Build) -> None:
    old = outdated(measured, list(STEPS), build)
    differences = list(QuoteFile.load().differences(figure_file.by_name(measured)))
    for name in old:
        found = measured.get(name)
        stdout().print(f"{name}: {'not measured' if found is None else f'measured at {found.commit}'}")
    for difference in differences:
        stdout().print(difference, soft_wrap=True)
    if old or differences:
        fail(f"{len(old)} steps are not of commit {build.commit}, {len(differences)} quotes differ", FAILED)
    stdout().print(f"All figures are of the package of commit {build.commit}, and the pages state them.")


def _list(names: list[str], measured: dict[str, Measurement], build: Build) -> None:
    from rich.table import Table

    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0))
    table.add_column("step", style="bold")
    table.add_column("min", justify="right")
    table.add_column("measured at")
    table.add_column("figures", justify="right")
    for name in names:
        found = measured.get(name)
        when = "-" if found is None else f"{found.commit}{' (this build)' if found.build == build.package else ''}"
        table.add_row(name, f"{STEPS[name].minutes:.0f}", when, "-" if found is None else str(len(found.figures)))
    stdout().print(table)
