"""`dorothie-gym frames`: pictures and labels of recorded sessions, for vision models."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from dorothie_gym import archive
from dorothie_gym.cli.options import AsJson, Maps, Players, SessionTown
from dorothie_gym.cli.output import (
    FAILED,
    Facts,
    exit_interrupted,
    fail,
    print_json,
    reporting_errors,
    stderr,
    stdout,
)
from dorothie_gym.cli.warm_up import compile_first
from dorothie_gym.errors import ProcessError
from dorothie_gym.evaluation import rollout as rollouts
from dorothie_gym.support.processors import available_processors


def frames(
    path: Annotated[
        Path, typer.Argument(metavar="SESSION|CORPUS", help="A session, or a folder of sessions, of any layout.")
    ],
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder to write; a started one is resumed.")],
    rate: Annotated[float, typer.Option(metavar="N", help="Pictures for a second of a session.")] = 2.0,
    size: Annotated[str, typer.Option(metavar="WxH", help="Width and height of the pictures [pixels].")] = "480x320",
    outputs: Annotated[
        str | None, typer.Option(metavar="LIST", help="Such as rgb,depth,semantic,instance,boxes; default all.")
    ] = None,
    layout: Annotated[
        str, typer.Option(metavar="native|sdn", help="rgb/000123.png by frames at 30 Hz, or rgba/41.jpg at 10 Hz.")
    ] = "native",
    town: SessionTown = None,
    maps: Maps = None,
    workers: Players = None,
    as_json: AsJson = False,
) -> None:
    """Write pictures of recorded sessions through the windscreen: RGB, depth, classes, instances, boxes (COCO).

    A folder for each session; after an interruption the same command resumes.
    """
    export = _export(rate, size, outputs, layout)
    begun = time.perf_counter()
    with reporting_errors():
        done = _write(path, out, export, (town, maps), workers or available_processors(), quiet=as_json)
    facts = _facts(done, out, time.perf_counter() - begun)
    if as_json:
        print_json(facts)
        return
    written = sum(each.new for each in done)
    stdout().print(
        f"{facts['pictures']} pictures with {facts['boxes']} boxes of {len(done)} sessions in {out}; "
        f"{written} sessions written now in {facts['wall_seconds']:.0f} s",
        markup=False,
        soft_wrap=True,
    )


def _export(rate: float, size: str, outputs: str | None, layout: str) -> rollouts.FrameExport:
    """Returns the settings of a command line; exits where one is wrong."""
    width, cross, height = size.partition("x")
    if not (cross and width.isdecimal() and height.isdecimal()):
        fail(f"--size is {size!r}; it must be like 480x320")
    if layout not in [each.value for each in rollouts.FrameLayout]:
        fail(f"--layout is {layout!r}; it must be one of {', '.join(rollouts.FrameLayout)}")
    from dorothie_gym.evaluation.rollout.frame_export import WRITTEN_OUTPUTS
    from dorothie_gym.session.config import CameraConfig

    known = [output.value for output in WRITTEN_OUTPUTS]
    named = known if outputs is None else outputs.split(",")
    unknown = [name for name in named if name not in known]
    if unknown:
        fail(f"--outputs has {unknown[0]!r}; it must be of {', '.join(known)}")
    chosen = tuple(output for output in WRITTEN_OUTPUTS if output.value in named)
    try:
        camera = CameraConfig(width=int(width), height=int(height), outputs=chosen)
        return rollouts.FrameExport(rate=rate, camera=camera, layout=rollouts.FrameLayout(layout))
    except ValueError as error:
        fail(str(error))


def _write(
    path: Path,
    out: Path,
    export: rollouts.FrameExport,
    maps: tuple[str | None, Path | None],
    workers: int,
    *,
    quiet: bool,
) -> list[rollouts.ExportedSession]:
    corpus = archive.Corpus.load(path, maps=maps[1])
    if out.resolve() == path.resolve() or path.resolve() in out.resolve().parents:
        fail(f"{out}: lies within {path}; choose a folder outside of it")
    compile_first(pictures=True)
    try:
        with _progress(quiet=quiet) as on_part:
            sources = rollouts.ReplaySources(town=maps[0], maps=maps[1])
            return rollouts.export_frames(corpus, out, export, sources, workers=workers, on_part=on_part)
    except KeyboardInterrupt:
        exit_interrupted(f"Interrupted; finished sessions are in {out}; the same command resumes.")
    except ProcessError as error:
        fail(str(error), FAILED)


@contextmanager
def _progress(*, quiet: bool) -> Iterator[Callable[[int, int], None]]:
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

    console = stderr()
    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    hidden = quiet or not console.is_terminal
    with Progress(*columns, console=console, disable=hidden, transient=True) as progress:
        bar = progress.add_task("Drawing", total=None)
        yield lambda done, total: progress.update(bar, completed=done, total=total)


def _facts(done: list[rollouts.ExportedSession], out: Path, wall: float) -> Facts:
    return {
        "out": str(out),
        "pictures": sum(each.pictures for each in done),
        "boxes": sum(each.annotations for each in done),
        "wall_seconds": round(wall, 3),
        "sessions": [
            {
                "session": each.session,
                "folder": str(each.folder),
                "pictures": each.pictures,
                "boxes": each.annotations,
                "new": each.new,
            }
            for each in done
        ],
    }
