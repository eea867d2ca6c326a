"""A session as a film: the view that follows the car, ten frames a second."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np

from dorothie_gym.cli.output import video_writer
from dorothie_gym.engine.session_engine import SessionEngine
from dorothie_gym.engine.session_scene import scene_of
from dorothie_gym.recording import FRAME_RATE
from dorothie_gym.rendering.frames import SceneRenderer
from dorothie_gym.rendering.scene import Actor, Scene

FRAMES_PER_SECOND = 10
"""The benchmark's frame rate (design, Time)."""

_FASTEST = 25.0
"""Whoever would have to be faster between two decisions is another one [m/s]."""


class Film:
    """Writes a film of a session while it is played; hand it to `play_session` as `on_step`.

    Between two decisions the car is where it was, frame by frame, and the others where a straight line puts them.

    Args:
        path: file to write; its suffix chooses the format.

    Raises:
        ImportError: the extra `video` is not installed.
    """

    def __init__(self, path: Path) -> None:
        self.frames = 0
        self._renderer = SceneRenderer()
        self._writer: Any = video_writer(path, FRAMES_PER_SECOND)
        self._last: Scene | None = None

    def __enter__(self) -> Self:
        """The film itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Closes the file, which can be played from then on."""
        self._writer.close()

    def __call__(self, engine: SessionEngine) -> None:
        """Appends the frames of the last decision."""
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
    """The scenes of a decision, ten a second, the present one last; words and tasks change with the last."""
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
    """Everybody of `after` on the way there from the nearest one of the same kind in `before`."""
    moved = []
    for actor in after:
        near = [other for other in before if other.kind == actor.kind]
        gaps = [float(np.hypot(other.x - actor.x, other.y - actor.y)) for other in near]
        if not near or min(gaps) > _FASTEST * seconds:
            moved.append(actor)
            continue
        start = near[int(np.argmin(gaps))]
        turn = (actor.heading - start.heading + np.pi) % (2 * np.pi) - np.pi
        moved.append(
            replace(
                actor,
                x=start.x + share * (actor.x - start.x),
                y=start.y + share * (actor.y - start.y),
                heading=start.heading + share * turn,
            )
        )
    return moved
