"""Video of a session: the view that follows the car, ten frames per second."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np

from dorothie_gym.angles import wrap_radians
from dorothie_gym.cli.output import VideoWriter, video_writer
from dorothie_gym.engine.session_engine import SessionEngine
from dorothie_gym.engine.session_scene import scene_of
from dorothie_gym.recording import FRAME_RATE
from dorothie_gym.rendering.frames import SceneRenderer
from dorothie_gym.rendering.scene import Actor, Scene

FRAMES_PER_SECOND = 10
"""Frame rate of the video."""

_MAX_SPEED = 25.0
"""Actors of two decisions that are farther apart than this speed allows are different ones [m/s]."""


class Film:
    """Writes a video of a session while it is played; pass it to `play_session` as `on_step`.

    Between two decisions, the car follows its recorded trajectory; other actors are interpolated linearly.

    Attributes:
        frames: frames drawn so far.
        seconds: time spent on them [s].

    Args:
        path: file to write; its suffix chooses the format.

    Raises:
        ImportError: the extra `video` is not installed.
    """

    def __init__(self, path: Path) -> None:
        self.frames, self.seconds = 0, 0.0
        self._renderer = SceneRenderer()
        self._writer: VideoWriter = video_writer(path, FRAMES_PER_SECOND)
        self._last: Scene | None = None

    def __enter__(self) -> Self:
        """Returns the film."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Closes the file."""
        self._writer.close()

    def __call__(self, engine: SessionEngine) -> None:
        """Appends the frames of the last decision."""
        begun = time.perf_counter()
        self._append_decision(engine)
        self.seconds += time.perf_counter() - begun

    def _append_decision(self, engine: SessionEngine) -> None:
        scene = scene_of(engine.session)
        if self._last is None:
            self._append(scene)
        else:
            for between in _in_between(self._last, scene, engine):
                self._append(between)
        self._last = scene

    def _append(self, scene: Scene) -> None:
        self._writer.append_data(self._renderer.draw(scene))
        self.frames += 1


def _in_between(before: Scene, after: Scene, engine: SessionEngine) -> list[Scene]:
    """Returns the scenes of a decision, ten per second; texts and tasks change with the last."""
    rows = engine.last_frames
    step = FRAME_RATE // FRAMES_PER_SECOND
    scenes = []
    for k in range(step - 1, len(rows) - 1, step):
        _, x, y, heading, speed, *_ = rows[k].tolist()
        share = (k + 1) / len(rows)
        scenes.append(
            replace(
                before,
                time=before.time + share * (after.time - before.time),
                car=replace(after.car, x=x, y=y, heading=heading, speed=speed),
                others=_moved(before.others, after.others, share, after.time - before.time),
            )
        )
    return [*scenes, after]


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
