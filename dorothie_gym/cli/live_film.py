"""Video of a session while it is played: windscreen and map, ten frames per second."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.archive.sound import mixed_track
from dorothie_gym.cli.output import VideoWriter, add_sound, video_writer
from dorothie_gym.pictures.camera.body_snapshots import bodies_between, snapshot_of
from dorothie_gym.pictures.camera.session_pictures import windscreen_camera
from dorothie_gym.pictures.views.scene import Actor, Scene, SpokenLine
from dorothie_gym.pictures.views.session_scene import scene_of
from dorothie_gym.pictures.views.session_views import SessionRenderer
from dorothie_gym.session.config import RenderView
from dorothie_gym.session.live_session import LiveSession
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.sim.config import FRAME_RATE
from dorothie_gym.support.audio import SAMPLE_RATE, encode_wav
from dorothie_gym.support.portable_math import wrap_radians

if TYPE_CHECKING:
    from dorothie_gym.pictures.camera.body_snapshots import BodySnapshot
    from dorothie_gym.support.audio import Samples

FRAMES_PER_SECOND = 10
"""Frame rate of the video."""

_MAX_SPEED = 25.0
"""Actors of two decisions that are farther apart than this speed allows are different ones [m/s]."""


class Film:
    """Writes a video of a session while it is played; pass it to `play_session` as `on_step`.

    Between two decisions, the car follows its recorded trajectory; other actors are interpolated linearly. A spoken
    session gets its sound when the film is closed.

    Attributes:
        frames: frames drawn so far.
        seconds: time spent on them [s].

    Args:
        path: file to write; its suffix chooses the format.
        view: what it shows.

    Raises:
        ImportError: the extra `video` is not installed.
    """

    def __init__(self, path: Path, view: RenderView = RenderView.BOTH) -> None:
        self.frames, self.seconds = 0, 0.0
        self._renderer = SessionRenderer(view)
        self._path = path
        self._writer: VideoWriter = video_writer(path, FRAMES_PER_SECOND)
        self._spoken: list[tuple[float, Samples]] = []
        self._windscreen: _Windscreen | None = None
        self._last: Scene | None = None

    def __enter__(self) -> Self:
        """Returns the film."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Closes the file, and adds what was spoken."""
        self._writer.close()
        if self._spoken:
            self._add_sound()

    def __call__(self, engine: SessionEngine) -> None:
        """Appends the frames of the last decision."""
        begun = time.perf_counter()
        self._append_decision(engine)
        self._spoken += spoken_pieces(engine)
        self.seconds += time.perf_counter() - begun

    def _append_decision(self, engine: SessionEngine) -> None:
        session, size = engine.session, self._renderer.windscreen
        if self._windscreen is None and size is not None:
            self._windscreen = _Windscreen(session, size)
        scene = scene_of(session)
        if self._last is not None:
            for share, between in _in_between(self._last, scene, engine):
                self._append(between, None if self._windscreen is None else self._windscreen.between(between, share))
        self._append(scene, None if self._windscreen is None else self._windscreen.now())
        self._last = scene

    def _add_sound(self) -> None:
        # the first picture is that of the beginning of the session
        track = mixed_track(self._spoken, 0.0, self.frames / FRAMES_PER_SECOND)
        with tempfile.TemporaryDirectory(prefix="dorothie_gym.") as folder:
            file = Path(folder) / "sound.wav"
            file.write_bytes(encode_wav(track))
            add_sound(self._path, file)

    def _append(self, scene: Scene, picture: NDArray[np.uint8] | None) -> None:
        self._writer.append_data(self._renderer.draw(scene, picture))
        self.frames += 1


def spoken_pieces(engine: SessionEngine) -> Iterator[tuple[float, Samples]]:
    """Yields the start of each span that was delivered last [s], and its audio; the spans of an utterance follow on."""
    ends: dict[object, float] = {}
    for event in engine.last_events:
        samples = engine.last_recordings.get(str(event.data.get("audio")))
        if samples is not None:
            number = event.data["utterance"]
            begun = ends.get(number, float(str(event.data["start"])))
            ends[number] = begun + len(samples) / SAMPLE_RATE
            yield begun, samples


class _Moment(NamedTuple):
    """Bodies and height of the car [m] at a decision."""

    bodies: BodySnapshot
    height: float


class _Windscreen:
    """Camera on the car of a session in progress, at its decisions and between them."""

    def __init__(self, session: LiveSession, size: tuple[int, int]) -> None:
        self._world = session.world
        self._camera = windscreen_camera(session.world.town, session.scenario, session.config, size)
        self._last = self._moment()

    def now(self) -> NDArray[np.uint8] | None:
        """Returns the picture of the current decision, and keeps what the next pictures need."""
        self._last = self._moment()
        return self._camera.render(self._world).rgb

    def between(self, scene: Scene, share: float) -> NDArray[np.uint8] | None:
        """Returns the picture at a share of the time between the last decision and the present one.

        Args:
            scene: of that time, with the pose of the car.
            share: of the time.
        """
        world, now = self._world, self._moment()
        height = self._last.height + share * (now.height - self._last.height)
        return self._camera.render_from(
            self._camera.pose_on(scene.car.x, scene.car.y, height, scene.car.heading),
            bodies_between(self._last.bodies, now.bodies, share),
            world.weather,
            time=scene.time,
            head_lights=world.ego.lights,
            faults=world.faults,
        ).rgb

    def _moment(self) -> _Moment:
        return _Moment(snapshot_of(self._world.actors.arrays), float(self._world.car.height))


def _in_between(before: Scene, after: Scene, engine: SessionEngine) -> Iterator[tuple[float, Scene]]:
    """Yields the scenes between two decisions, ten per second, and their shares of time; tasks change afterwards."""
    rows = engine.last_frames
    step = FRAME_RATE // FRAMES_PER_SECOND
    for k in range(step - 1, len(rows) - 1, step):
        _, x, y, heading, speed, *_ = rows[k].tolist()
        share = (k + 1) / len(rows)
        now = before.time + share * (after.time - before.time)
        yield (
            share,
            replace(
                before,
                time=now,
                car=replace(after.car, x=x, y=y, heading=heading, speed=speed),
                others=_moved(before.others, after.others, share, after.time - before.time),
                speaking=_spoken_at(now, after),
                weather=after.weather,
            ),
        )


def _spoken_at(now: float, after: Scene) -> list[SpokenLine]:
    """Returns the utterances in progress at a time [s] shortly before a scene."""
    lines = (*after.utterances, *after.speaking)
    return [line for line in lines if line.start is not None and line.start <= now < line.time]


def _moved(before: Sequence[Actor], after: Sequence[Actor], share: float, seconds: float) -> list[Actor]:
    """Returns the actors of `after`, interpolated from the nearest actor of the same kind in `before`."""
    moved = []
    for actor in after:
        near = [other for other in before if other.kind == actor.kind]
        gaps = [float(np.hypot(other.x - actor.x, other.y - actor.y)) for other in near]
        if not near or min(gaps) > _MAX_SPEED * seconds:
            moved.append(actor)
            continue
        start = near[int(np.argmin(gaps))]
        turn = wrap_radians(actor.heading - start.heading)
        moved.append(
            replace(
                actor,
                x=start.x + share * (actor.x - start.x),
                y=start.y + share * (actor.y - start.y),
                heading=start.heading + share * turn,
            )
        )
    return moved
