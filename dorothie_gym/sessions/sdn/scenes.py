"""What was around the car, kept in a file of ours beside those of SDN's release layout."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from dorothie_gym.sessions.frames_file import read_frames, write_frames
from dorothie_gym.sessions.report import ReadReport
from dorothie_gym.sessions.scene import Scene, SceneTable
from dorothie_gym.sessions.sdn.layouts import FRAMES_EACH
from dorothie_gym.sessions.session import Session
from dorothie_gym.sessions.trajectory import Trajectory


def write_scene(path: Path, session: Session) -> None:
    """Writes what was recorded around the car at frames of 10 Hz; no file where nothing was.

    Raises:
        OSError: it cannot be written.
    """
    trajectory = session.trajectory[session.trajectory["frame"] % FRAMES_EACH == 0]
    scene = scene_at(session.scene, trajectory)
    if any(map(len, (scene.actors, scene.lights, scene.weather))):
        write_frames(path, trajectory, scene)


def read_scene(path: Path, scene: Scene, trajectory: Trajectory, report: ReadReport) -> Scene:
    """Returns a scene with what the file holds of the frames of a trajectory.

    Args:
        path: the file, which may be missing.
        scene: what the layout's own files tell.
        trajectory: the frames that there are.
        report: is told what is not understood.

    Raises:
        SessionError: the file is damaged; the message names it.
    """
    if not path.is_file():
        return scene
    _, around = read_frames(path, report)
    around = scene_at(around, trajectory)
    return replace(scene, actors=around.actors, lights=around.lights, weather=around.weather)


def scene_at(scene: Scene, trajectory: Trajectory) -> Scene:
    """Returns what was recorded at the frames of a trajectory, without further columns."""
    frames = trajectory["frame"]
    return Scene(
        actors=_kept(scene.actors, frames), lights=_kept(scene.lights, frames), weather=_kept(scene.weather, frames)
    )


def _kept(table: SceneTable, frames: np.ndarray[tuple[int], np.dtype[np.int64]]) -> SceneTable:
    kept = np.isin(table.frames, frames)
    sizes = np.diff(table.offsets)
    offsets = np.concatenate(([0], np.cumsum(sizes[kept]))).astype(np.int64)
    return SceneTable(table.frames[kept], offsets, table.rows[np.repeat(kept, sizes)])
