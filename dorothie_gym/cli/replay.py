"""`dorothie-gym replay`: a recorded session once more, to look at or to check."""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from dorothie_gym.cli.options import AsJson
from dorothie_gym.cli.output import INTERRUPTED, fail, print_json, stderr, stdout, told_plainly
from dorothie_gym.cli.video import check_video, video_writer

if TYPE_CHECKING:
    from dorothie_gym.maps import Town
    from dorothie_gym.recording import Session

_DIFFERENT = 1
"""Exit code where a session is not what comes out when it is played again."""


def replay(
    path: Annotated[
        Path, typer.Argument(metavar="SESSION", help="A session of any layout; with --check also a folder of them.")
    ],
    fps: Annotated[float, typer.Option(min=0.5, max=30.0, help="Pictures a second.")] = 10.0,
    video: Annotated[
        Path | None,
        typer.Option(metavar="F.mp4", help="Write a film instead of opening a window (needs dorothie-gym[video])."),
    ] = None,
    check: Annotated[
        bool, typer.Option("--check", help="Play it again from seed and actions, and compare frame by frame.")
    ] = False,
    town: Annotated[
        str | None, typer.Option(metavar="NAME|FILE", help="Its town, where that is not shipped (.xodr, .yaml).")
    ] = None,
    maps: Annotated[Path | None, typer.Option(metavar="DIR", help="Folder with maps of towns (Town01.xodr).")] = None,
    storyboard: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Its storyboard, where that is not shipped (.json).")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Show a recorded session, with the talk beside the town; or --check that it comes out the same again.

    With --check the exit code is 1 if anything differs; the first frame and field that do are told.
    """
    if check and video is not None:
        fail("--check and --video exclude each other; give one of them")
    if video is not None:
        check_video(video)
    try:
        with told_plainly():
            if check:
                _check(path, town, maps, storyboard, as_json=as_json)
            else:
                _show(path, town, maps, fps, video, as_json=as_json)
    except KeyboardInterrupt:
        stderr().print("Interrupted.")
        raise typer.Exit(INTERRUPTED) from None


def _check(path: Path, town: str | None, maps: Path | None, storyboard: Path | None, *, as_json: bool) -> None:
    from dorothie_gym.recording import Corpus
    from dorothie_gym.tasks import load_template

    template = None if storyboard is None else load_template(storyboard)
    rows = []
    for entry in Corpus.load(path, maps=maps).entries:
        session = entry.load()
        rows.append(_compare(session, _town(session, town, maps), template))
        if not as_json:
            _tell(rows[-1])
    equal = all(row["equal"] for row in rows)
    if as_json:
        print_json({"checked": len(rows), "equal": equal, "sessions": rows})
    elif len(rows) > 1:
        stdout().print(f"{sum(row['equal'] for row in rows)} of {len(rows)} sessions come out the same")
    if not equal:
        raise typer.Exit(_DIFFERENT)


def _compare(session: Session, town: Town, template: Any) -> dict[str, Any]:
    """Plays a session again; returns what --json writes of it."""
    from dataclasses import asdict

    from dorothie_gym._version import __version__
    from dorothie_gym.recording import first_difference
    from dorothie_gym.rollout import resimulate

    begun = time.perf_counter()
    difference = first_difference(session, resimulate(session, town, storyboard=template))
    return {
        "session": session.name,
        "equal": difference is None,
        "complete": session.complete,
        "frames": len(session.trajectory),
        "decisions": len(session.decisions or ()),
        "recorded_by": session.header.package_version,
        "replayed_by": __version__,
        "difference": None if difference is None else asdict(difference),
        "wall_seconds": round(time.perf_counter() - begun, 3),
    }


def _tell(row: dict[str, Any]) -> None:
    until = "" if row["complete"] else ", as far as it was recorded"
    if row["equal"]:
        text = f"{row['session']}: the same in all {row['frames']} frames{until}"
    else:
        found = row["difference"]
        text = (
            f"{row['session']}: differs first at frame {found['frame']}, {found['field']}: "
            f"recorded {found['recorded']}, now {found['replayed']}"
        )
        if row["recorded_by"] != row["replayed_by"]:
            text += f" (recorded by version {row['recorded_by']}, this is {row['replayed_by']})"
    stdout().print(text, markup=False, soft_wrap=True)


def _show(path: Path, town: str | None, maps: Path | None, fps: float, video: Path | None, *, as_json: bool) -> None:
    from dorothie_gym.recording import read_session
    from dorothie_gym.rollout import Playback

    session = read_session(path, maps=maps)
    playback = Playback(session, _town(session, town, maps))
    shown = _film(playback, fps, video) if video is not None else _window(playback, fps)
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


def _film(playback: Any, fps: float, video: Path) -> int:
    from rich.progress import track

    from dorothie_gym.rendering.frames import SceneRenderer

    renderer, console, shown = SceneRenderer(), stderr(), 0
    writer = video_writer(video, fps)
    try:
        scenes = track(
            playback.scenes(fps), "Filming", total=playback.count(fps), console=console, transient=True,
            disable=not console.is_terminal,
        )  # fmt: skip
        for scene in scenes:
            writer.append_data(renderer.draw(scene))
            shown += 1
    finally:
        writer.close()
    return shown


def _window(playback: Any, fps: float) -> int:
    from dorothie_gym.rendering.frames import HumanWindow, SceneRenderer

    renderer = SceneRenderer()
    try:
        window = HumanWindow(renderer.size, "dorothie_gym")
    except RuntimeError:
        fail("no window can be opened here; write a film instead: --video FILE.mp4")
    shown = 0
    try:
        if _is_unseen():
            fail("there is no screen to open a window on; write a film instead: --video FILE.mp4")
        for scene in playback.scenes(fps):
            window.show(renderer.draw(scene), fps)
            if window.closed:
                break
            shown += 1
    finally:
        window.close()
    return shown


def _is_unseen() -> bool:
    """Whether windows are open where nobody sees them, though nobody asked for that: so SDL does without a screen."""
    import pygame

    return pygame.display.get_driver() in ("offscreen", "dummy") and "SDL_VIDEODRIVER" not in os.environ


def _town(session: Session, town: str | None, maps: Path | None) -> Town:
    """The town of a session."""
    from dorothie_gym.maps import load_town
    from dorothie_gym.recording.towns import find_town

    if town is not None:
        return load_town(town)
    found = find_town(session.header.town, maps)
    if found is None:
        fail(f"{session.name}: its town {session.header.town!r} is not shipped; give --town FILE, or --maps DIR")
    return found
