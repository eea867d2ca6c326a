"""What commands write, and how they fail."""

from __future__ import annotations

import json
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NoReturn

import typer
from rich.console import Console

FAILED = 1
"""Exit code where what was asked for could not be done."""

BAD_INPUT = 2
"""Exit code for a user's mistake."""

INTERRUPTED = 130
"""Exit code after Ctrl-C, as shells have it (128 + SIGINT)."""

WIDTH = 130
"""Columns of what is written into a file or a pipe, which have no width of their own."""


def stdout() -> Console:
    """A console on standard output, as it is now."""
    return Console(highlight=False)


def wide_stdout() -> Console:
    """A console on standard output for tables: `WIDTH` columns where it is no terminal."""
    console = stdout()
    if not console.is_terminal:
        console.width = WIDTH
    return console


def stderr() -> Console:
    """A console on standard error, as it is now."""
    return Console(stderr=True, highlight=False)


def fail(message: str, code: int = BAD_INPUT) -> NoReturn:
    """Writes one message on standard error and exits."""
    console = stderr()
    console.print("Error: ", style="bold red", end="")
    console.print(message, markup=False, soft_wrap=True)
    raise typer.Exit(code)


def print_json(value: Mapping[str, Any] | list[Any]) -> None:
    """Writes one JSON value, and nothing else, on standard output."""
    typer.echo(json.dumps(value, allow_nan=False))


@contextmanager
def told_plainly() -> Iterator[None]:
    """Turns the mistakes that a user can make into one message and exit code 2."""
    from dorothie_gym.errors import SessionError, StoryboardError, TownError

    try:
        yield
    except (TownError, StoryboardError, SessionError) as error:
        fail(str(error))
    except OSError as error:
        fail(f"{error.filename}: {error.strerror}; check the path" if error.filename else str(error))


@contextmanager
def compiling(after: float = 2.0) -> Iterator[None]:
    """Tells on a terminal what takes so long, where the world's loops have to be compiled first.

    Args:
        after: seconds until it is told.
    """
    console = stderr()
    message = "compiling the world's loops for this machine: once after an installation, about a minute ..."
    timer = threading.Timer(after, lambda: console.print(message, style="dim"))
    timer.daemon = True
    if console.is_terminal:
        timer.start()
    try:
        yield
    finally:
        timer.cancel()


def check_picture(path: Path) -> None:
    """Fails where a PNG file cannot be written at `path`, before anything takes time."""
    if path.suffix.lower() != ".png":
        fail(f"{path}: a picture is written as PNG; give a name that ends in .png")
    check_file(path)


def check_file(path: Path) -> None:
    """Fails where a file cannot be written at `path`; leaves nothing behind."""
    if not path.parent.is_dir():
        fail(f"{path}: the folder {path.parent} does not exist; make it first")
    there = path.exists()
    try:
        with path.open("ab"):
            pass
    except OSError as error:
        fail(f"{path}: cannot be written ({error.strerror}); choose another place")
    if not there:
        path.unlink()
