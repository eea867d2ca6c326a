"""`dorothie-gym replay`, `film` and `compare`: playback, films and comparison of sessions."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dorothie_gym import archive
from dorothie_gym import pictures as drawing
from dorothie_gym._version import __version__
from dorothie_gym.cli.options import AsJson, Maps, Players, SessionTown, View, needs
from dorothie_gym.cli.output import (
    Facts,
    check_video,
    fail,
    print_json,
    reporting_errors,
    stderr,
    stdout,
    video_writer,
)
from dorothie_gym.cli.warm_up import compile_first
from dorothie_gym.evaluation import rollout as rollouts
from dorothie_gym.pictures import camera
from dorothie_gym.session.config import RenderView
from dorothie_gym.support.processors import available_processors

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from dorothie_gym.session.recording.session import Session


DIFFERENT = 1
"""Exit code where a session differs from its replay, or from another session."""


# --- Playback and replay check ----------------------------------------------------------------------------------------


def replay(
    path: Annotated[
        Path, typer.Argument(metavar="SESSION", help="A session of any layout, or with --check a folder of sessions.")
    ],
    fps: Annotated[float, typer.Option(min=0.5, max=30.0, help="Frames per second.")] = 10.0,
    video: Annotated[
        Path | None,
        typer.Option(metavar="F.mp4", help=f"Write a video instead of opening a window ({needs('video')})."),
    ] = None,
    check: Annotated[
        bool,
        typer.Option("--check", help="Simulate the session again from seed and actions; compare all frames."),
    ] = False,
    town: SessionTown = None,
    maps: Maps = None,
    storyboard: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Storyboard of the session, if it is not shipped (.json).")
    ] = None,
    workers: Players = None,
    as_json: AsJson = False,
) -> None:
    """Play back a recorded session in a window or video, or --check that its replay is equal.

    With --check the exit code is 1 if a replay differs; the first differing frame and field are printed.
    """
    if check and video is not None:
        fail("--check and --video exclude each other; give one of them")
    if video is not None:
        check_video(video)
    sources = rollouts.ReplaySources(town=town, maps=maps, storyboard=storyboard)
    with reporting_errors():
        if check:
            _check(path, sources, workers, as_json=as_json)
        else:
            _play_back(path, sources, fps, video, as_json=as_json)


def _check(path: Path, sources: rollouts.ReplaySources, workers: int | None, *, as_json: bool) -> None:
    checks = []
    for check in rollouts.check_replays(
        archive.Corpus.load(path, maps=sources.maps).entries, sources, workers=workers or available_processors()
    ):
        checks.append(check)
        if not as_json:
            stdout().print(_check_line(check), markup=False, soft_wrap=True)
    equal = all(check.equal for check in checks)
    if as_json:
        print_json({"checked": len(checks), "equal": equal, "sessions": [check.to_json() for check in checks]})
    elif len(checks) > 1:
        stdout().print(f"{sum(check.equal for check in checks)} of {len(checks)} replays are equal")
    if not equal:
        raise typer.Exit(DIFFERENT)


def _check_line(check: rollouts.ReplayCheck) -> str:
    found = check.difference
    if found is None:
        until = "" if check.complete else ", as far as it was recorded"
        return f"{check.session}: equal in all {check.frames} frames{until}"
    text = (
        f"{check.session}: differs first at frame {found.frame}, {found.field}: "
        f"recorded {found.recorded}, now {found.replayed}"
    )
    if check.recorded_by != __version__:
        text += f" (recorded by version {check.recorded_by}, this is {__version__})"
    return text


def _play_back(path: Path, sources: rollouts.ReplaySources, fps: float, video: Path | None, *, as_json: bool) -> None:
    session = archive.read_session(path, maps=sources.maps)
    playback = drawing.Playback(session, sources.town_of(session))
    shown = _write_video(playback, fps, video) if video is not None else _show_window(playback, fps)
    facts = {
        "session": session.name,
        "town": session.header.town,
        "complete": session.complete,
        "seconds": round(session.duration, 3),
        "pictures": shown,
        "video": None if video is None else str(video),
    }
    if as_json:
        print_json(facts)
    else:
        where = "" if video is None else f": {video}"
        stdout().print(
            f"{session.name}: {session.duration:.0f} s, {shown} pictures{where}", markup=False, soft_wrap=True
        )


def _write_video(playback: drawing.Playback, fps: float, video: Path) -> int:
    renderer = drawing.SceneRenderer()
    return _write(video, fps, (renderer.draw(scene) for scene in playback.scenes(fps)), playback.count(fps))


def _write(video: Path, fps: float, frames: Iterable[NDArray[np.uint8]], count: int, sound: Path | None = None) -> int:
    """Writes frames as a video, which appears when it is complete; returns their number.

    Args:
        video: file to write.
        fps: frame rate.
        frames: the frames.
        count: number of frames, for the progress.
        sound: audio file with the sound track; None for a silent video.
    """
    from rich.progress import track

    console, shown = stderr(), 0
    part = video.with_name(f".{video.stem}.part{video.suffix}")
    try:
        writer = video_writer(part, fps) if sound is None else video_writer(part, fps, sound)
        try:
            for frame in track(
                frames, "Writing video", total=count, console=console, transient=True, disable=not console.is_terminal
            ):
                writer.append_data(frame)
                shown += 1
        finally:
            writer.close()
        part.replace(video)
    finally:
        part.unlink(missing_ok=True)
    return shown


def _show_window(playback: drawing.Playback, fps: float) -> int:
    renderer = drawing.SceneRenderer()
    try:
        window = drawing.HumanWindow(renderer.size, "dorothie_gym")
    except RuntimeError:
        fail("no window can be opened here; write a video instead: --video FILE.mp4")
    shown = 0
    try:
        if _is_window_invisible():
            fail("there is no screen to open a window on; write a video instead: --video FILE.mp4")
        for scene in playback.scenes(fps):
            window.show(renderer.draw(scene), fps)
            if window.closed:
                break
            shown += 1
    finally:
        window.close()
    return shown


def _is_window_invisible() -> bool:
    """Returns whether SDL opened an invisible window although the user did not choose its driver."""
    import pygame

    return pygame.display.get_driver() in ("offscreen", "dummy") and "SDL_VIDEODRIVER" not in os.environ


# --- Films ------------------------------------------------------------------------------------------------------------


def film(
    path: Annotated[Path, typer.Argument(metavar="SESSION", help="A session of any layout, with its surroundings.")],
    out: Annotated[Path, typer.Option("--out", metavar="V.mp4", help=f"Video to write ({needs('video')}).")],
    view: View = RenderView.BOTH,
    fps: Annotated[float, typer.Option(min=0.5, max=30.0, help="Frames per second.")] = 10.0,
    town: SessionTown = None,
    maps: Maps = None,
    as_json: AsJson = False,
) -> None:
    """Film a recorded session through the windscreen, beside its map, with the talk as subtitles.

    A spoken session is filmed with its sound.
    """
    check_video(out)
    with reporting_errors():
        facts = _film(path, rollouts.ReplaySources(town=town, maps=maps), out, view, fps)
    if as_json:
        print_json(facts)
    else:
        sound = ", with sound" if facts["sound"] else ""
        line = f"{facts['session']}: {facts['seconds']:.0f} s, {facts['pictures']} pictures{sound}: {out}"
        stdout().print(line, markup=False, soft_wrap=True)


def _film(path: Path, sources: rollouts.ReplaySources, out: Path, view: RenderView, fps: float) -> Facts:
    from dorothie_gym.sim.config import FRAME_RATE

    session = archive.read_session(path, maps=sources.maps)
    town, renderer = sources.town_of(session), drawing.SessionRenderer(view)
    playback, size = drawing.Playback(session, town), renderer.windscreen
    if size is None:
        frames: Iterable[NDArray[np.uint8]] = (renderer.draw(scene) for scene in playback.scenes(fps))
        count, first = playback.count(fps), playback.first_frame
    else:
        compile_first(pictures=True)
        from dorothie_gym.session.config import CameraConfig

        pictures = camera.RecordedPictures(session, town, CameraConfig(width=size[0], height=size[1]))
        frames = (renderer.draw(playback.scene(frame), taken.rgb) for frame, taken in pictures.pictures(fps))
        taken_at = pictures.frames(fps)
        count, first, fps = len(taken_at), taken_at.start, FRAME_RATE / taken_at.step
    with _sound_file(session, first / FRAME_RATE, count / fps) as sound:
        shown = _write(out, fps, frames, count, sound)
    return {
        "session": session.name,
        "town": session.header.town,
        "seconds": round(session.duration, 3),
        "view": view.value,
        "pictures": shown,
        "sound": sound is not None,
        "video": str(out),
    }


@contextmanager
def _sound_file(session: Session, start: float, seconds: float) -> Iterator[Path | None]:
    """Yields a WAV file with the sound of a part of a session [s], or None for a session without audio."""
    if not session.audio:
        yield None
        return
    from dorothie_gym.support.audio import encode_wav

    with tempfile.TemporaryDirectory(prefix="dorothie_gym.") as folder:
        file = Path(folder) / "sound.wav"
        file.write_bytes(encode_wav(archive.sound_track(session, start, seconds)))
        yield file


# --- Comparison -------------------------------------------------------------------------------------------------------


def compare(
    first: Annotated[Path, typer.Argument(metavar="A", help="A session, or a folder of sessions (corpus, rollout).")],
    second: Annotated[Path, typer.Argument(metavar="B", help="The session or folder to compare it with.")],
    as_json: AsJson = False,
) -> None:
    """Compare two sessions, or two folders of sessions, event by event and frame by frame.

    Sessions of folders are compared with those of the same path. The exit code is 1 if any of them differs.
    """
    rows: list[tuple[str, archive.Difference | None]] = []
    with reporting_errors():
        for name, difference in archive.compare_folders(first, second):
            rows.append((name, difference))
            if not as_json:
                stdout().print(f"{name}: {_difference_line(difference)}", markup=False, soft_wrap=True)
    equal = sum(difference is None for _, difference in rows)
    if as_json:
        sessions = [
            {"session": name, "equal": found is None, "difference": _difference_page(found)} for name, found in rows
        ]
        print_json({"compared": len(rows), "equal": equal == len(rows), "sessions": sessions})
    elif len(rows) > 1:
        stdout().print(f"{equal} of {len(rows)} sessions are equal")
    if equal < len(rows):
        raise typer.Exit(DIFFERENT)


def _difference_line(difference: archive.Difference | None) -> str:
    if difference is None:
        return "equal"
    if difference.field == "session":  # one of the two folders has no such session
        return f"first: {difference.recorded}, second: {difference.replayed}"
    when = "before it begins" if difference.frame < 0 else f"at frame {difference.frame}"
    return f"differs first {when}, {difference.field}: {difference.recorded} and {difference.replayed}"


def _difference_page(difference: archive.Difference | None) -> dict[str, int | str] | None:
    if difference is None:
        return None
    return {
        "frame": difference.frame,
        "field": difference.field,
        "first": difference.recorded,
        "second": difference.replayed,
    }
