"""How far a command that plays many sessions has come, and how many processes play."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from dorothie_gym.cli.output import stderr


def processors() -> int:
    """Number of processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextmanager
def session_progress(*, quiet: bool) -> Iterator[Callable[[int, int], None]]:
    """Shows a bar on a terminal; gives what tells it how many sessions are done, and how many are to be."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    console = stderr()
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    hidden = quiet or not console.is_terminal
    with Progress(*columns, console=console, disable=hidden, transient=True) as progress:
        bar = progress.add_task("Sessions", total=None)
        yield lambda done, total: progress.update(bar, completed=done, total=total)
