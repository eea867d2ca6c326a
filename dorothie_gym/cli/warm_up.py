"""`dorothie-gym warm-up`: compilation of the simulation, for container images and continuous integration."""

from __future__ import annotations

import time
from typing import Annotated

import typer

from dorothie_gym.cli.output import fail, print_json, stderr, stdout


def warm_up(
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON and nothing else.")] = False,
) -> None:
    """Compile the simulation for this machine; later commands start at once."""
    from dorothie_gym.support.compilation.cache import compiled_folder

    folder = compiled_folder()
    if folder is None:
        fail("caching is turned off (DOROTHIE_GYM_CACHE is empty): compiled functions would be lost; unset it")
    begun = time.perf_counter()
    compiled = compile_with_progress(everything=True, batches=True, pictures=True)
    seconds = round(time.perf_counter() - begun, 1)
    if as_json:
        print_json({"functions": compiled, "seconds": seconds, "folder": str(folder)})
    elif compiled:
        stdout().print(
            f"Compiled {compiled} functions in {seconds:.0f} s; kept in {folder}", soft_wrap=True, markup=False
        )
    else:
        stdout().print(f"Nothing to compile; all is in {folder}", soft_wrap=True, markup=False)


def compile_first(*, batches: bool = False, pictures: bool = False) -> None:
    """Compiles what is not in the cache, with a progress bar on a terminal.

    Args:
        batches: whether batches of the navigation environments are needed.
        pictures: whether the first-person camera is needed.
    """
    from dorothie_gym.envs import warm_up as navigation
    from dorothie_gym.session import warm_up as sessions

    batches = batches and not navigation.is_warm()
    pictures = pictures and not _is_camera_warm()
    if batches or pictures or not sessions.is_warm():
        compile_with_progress(batches=batches, pictures=pictures, rare=False)


def _is_camera_warm() -> bool:
    from dorothie_gym.pictures.camera import warm_up as pictures  # imported here: most commands draw no pictures

    return pictures.is_warm()


def compile_with_progress(*, everything: bool = False, batches: bool, pictures: bool, rare: bool = True) -> int:
    """Compiles with a progress bar on a terminal.

    Args:
        everything: whether to compile the functions of `Town-v0` as well.
        batches: see `compile_first`.
        pictures: see `compile_first`.
        rare: see `session.warm_up.warm_up`.

    Returns:
        The number of functions.
    """
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    from dorothie_gym.envs import warm_up as navigation
    from dorothie_gym.session import warm_up as sessions

    console, begun = stderr(), 0
    columns = (
        TextColumn("Compiling, once per machine"),
        BarColumn(),
        TimeElapsedColumn(),
        TextColumn("{task.description}"),
    )
    with Progress(*columns, console=console, disable=not console.is_terminal, transient=True) as progress:
        bar = progress.add_task("", total=None)

        def show(name: str, done: int, planned: int) -> None:
            nonlocal begun
            begun = done
            progress.update(bar, completed=done, total=planned, description=name)

        sessions.warm_up(show, everything=everything, rare=rare)
        total, begun = begun, 0
        if batches:
            navigation.warm_up(show)
            total, begun = total + begun, 0
        if pictures:
            from dorothie_gym.pictures.camera import warm_up as camera

            camera.warm_up(show, rare=rare)
    return total + begun
