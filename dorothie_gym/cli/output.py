"""Output of the commands: consoles, JSON, errors, progress, and checks of output files."""

from __future__ import annotations

import errno
import json
import os
import subprocess
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, Protocol, TypeAlias

import typer
from rich.console import Console

from dorothie_gym.errors import DorothieGymError, OutputFolderError, SpeechError, one_line
from dorothie_gym.support.installation import pip_install
from dorothie_gym.support.interruption import exit_code

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


Facts: TypeAlias = dict[str, Any]
"""Fields of a JSON object that a command prints, or of a row of its table; the command knows the type of each."""

FAILED = 1
"""Exit code where a command could not do its work."""

_NO_SPACE = tuple(getattr(errno, name) for name in ("ENOSPC", "EDQUOT", "EFBIG") if hasattr(errno, name))
"""Numbers of the errors that end when there is more space: full disk, used up quota, too large file."""

BAD_INPUT = 2
"""Exit code for invalid input."""

WIDTH = 130
"""Width of the output into a file or a pipe [columns]."""


def stdout() -> Console:
    """Returns a console on the present standard output; brackets in texts are printed as they are."""
    return Console(highlight=False, markup=False, emoji=False)


def wide_stdout() -> Console:
    """Returns a console on standard output for tables; `WIDTH` columns wide if it is no terminal."""
    console = stdout()
    if not console.is_terminal:
        console.width = WIDTH
    return console


def stderr() -> Console:
    """Returns a console on the present standard error."""
    return Console(stderr=True, highlight=False, markup=False, emoji=False)


def fail(message: str, code: int = BAD_INPUT) -> NoReturn:
    """Prints a message on standard error and exits."""
    console = stderr()
    console.print("Error: ", style="bold red", end="")
    console.print(message, markup=False, soft_wrap=True)
    raise typer.Exit(code)


def exit_interrupted(text: str) -> NoReturn:
    """Prints a line on standard error and exits with the code of the signal: 130 for Ctrl-C, 143 for SIGTERM."""
    stderr().print(text, markup=False, soft_wrap=True)
    raise typer.Exit(exit_code()) from None


def coefficient(value: float | None) -> str:
    """Returns a coefficient of agreement with two decimals; "undefined" for None."""
    return "undefined" if value is None else f"{value:.2f}"


@contextmanager
def stage_progress(*, quiet: bool) -> Iterator[Callable[[str, int, int], None]]:
    """Shows a progress bar on a terminal; the callback takes a stage, the number of its steps done, and their total."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    console = stderr()
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console, disable=quiet or not console.is_terminal, transient=True) as progress:
        bar = progress.add_task("")

        def on_stage(stage: str, done: int, planned: int) -> None:
            progress.update(bar, description=stage[:1].upper() + stage[1:], completed=done, total=planned)

        yield on_stage


def print_json(value: Mapping[str, object] | Sequence[object]) -> None:
    """Prints one JSON value on standard output."""
    typer.echo(json.dumps(value, allow_nan=False))


@contextmanager
def reporting_errors() -> Iterator[None]:
    """Turns errors into one message and exit code 2, or 1 if the disk is full or the output was deleted in between."""
    try:
        yield
    except OutputFolderError as error:
        fail(str(error), FAILED)
    except DorothieGymError as error:
        fail(str(error))
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        if error.errno is not None and error.errno in _NO_SPACE:
            fail(f"{where}{os.strerror(error.errno)}; make space and run the same command again", FAILED)
        fail(f"{where}{error.strerror}; check the path" if where else str(error))


def check_picture(path: Path) -> None:
    """Fails if no PNG file can be written at `path`."""
    if path.suffix.lower() != ".png":
        fail(f"{path}: a picture is written as PNG; give a name that ends in .png")
    check_file(path)


def check_file(path: Path) -> None:
    """Fails if no file can be written at `path`; creates nothing."""
    if not path.parent.is_dir():
        fail(f"{path}: the folder {path.parent} does not exist; create it first")
    there = path.exists()
    try:
        with path.open("ab"):
            pass
    except OSError as error:
        fail(f"{path}: cannot be written ({error.strerror}); choose another place")
    if not there:
        path.unlink()


def check_folder(path: Path) -> None:
    """Fails if nothing can be written into the folder `path`, which may have to be created; leaves nothing behind."""
    there = next(each for each in (path.absolute(), *path.absolute().parents) if each.exists())
    if not there.is_dir():
        fail(f"{path}: {there} is a file; give a folder")
    try:
        with tempfile.TemporaryDirectory(dir=there):
            pass
    except OSError as error:
        fail(f"{path}: cannot be written ({error.strerror}); choose another folder")


# --- Video files ------------------------------------------------------------------------------------------------------

_SUFFIXES = (".mp4", ".mkv", ".mov")
_QUICKTIME = (".mp4", ".mov")


def check_video(path: Path) -> None:
    """Fails if no video can be written at `path`."""
    if path.suffix.lower() not in _SUFFIXES:
        fail(f"{path}: not a video format; give a name that ends in {', '.join(_SUFFIXES)}")
    check_file(path)
    if find_spec("imageio") is None or find_spec("imageio_ffmpeg") is None:
        fail(f"--video needs imageio, which is not installed; run: {pip_install('video')}")


class VideoWriter(Protocol):
    """Writer of imageio, which has no types."""

    def append_data(self, image: NDArray[np.uint8]) -> None:
        """Appends a frame."""

    def close(self) -> None:
        """Closes the file."""


def video_writer(path: Path, frames_per_second: float, sound: Path | None = None) -> VideoWriter:
    """Returns a video writer of imageio: H.264, and AAC if there is sound, which every container of `_SUFFIXES` holds.

    Args:
        path: file to write. MP4 and MOV are written in fragments, so that a film that is broken off can be watched.
        frames_per_second: its frame rate.
        sound: audio file with its sound track; None for a silent video.

    Raises:
        ImportError: the extra `video` is not installed.
    """
    import imageio.v2 as imageio

    track = {} if sound is None else {"audio_path": str(sound), "audio_codec": "aac"}
    fragments = (
        ["-movflags", "+frag_keyframe+empty_moov+default_base_moof"] if path.suffix.lower() in _QUICKTIME else []
    )
    writer: VideoWriter = imageio.get_writer(
        path, fps=frames_per_second, macro_block_size=16, ffmpeg_params=["-preset", "veryfast", *fragments], **track
    )
    return writer


def add_sound(video: Path, sound: Path) -> None:
    """Adds a sound track (AAC) to a silent video; its pictures are copied.

    Args:
        video: the video, which is replaced.
        sound: audio file.

    Raises:
        ImportError: the extra `video` is not installed.
        SpeechError: ffmpeg failed.
    """
    import imageio_ffmpeg

    part = video.with_name(f".{video.stem}.part{video.suffix}")
    inputs = ["-i", str(video), "-i", str(sound), "-c:v", "copy", "-c:a", "aac"]
    try:
        ran = subprocess.run(
            [imageio_ffmpeg.get_ffmpeg_exe(), "-v", "error", "-y", *inputs, str(part)],
            capture_output=True,
            text=True,
            check=False,
        )
        if ran.returncode:
            raise SpeechError(f"{video}: the sound cannot be added ({one_line(ran.stderr)}); the pictures are kept")
        part.replace(video)
    finally:
        part.unlink(missing_ok=True)


# --- Progress ---------------------------------------------------------------------------------------------------------


@contextmanager
def session_progress(*, quiet: bool) -> Iterator[Callable[[int, int], None]]:
    """Shows a progress bar on a terminal; yields its update function (finished sessions, planned sessions)."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    console = stderr()
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    hidden = quiet or not console.is_terminal
    with Progress(*columns, console=console, disable=hidden, transient=True) as progress:
        bar = progress.add_task("Sessions", total=None)
        yield lambda done, total: progress.update(bar, completed=done, total=total)
