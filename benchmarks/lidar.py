"""Time of a turn of the lidar by channels and columns, on one core, against the ray casting of Embree."""

from __future__ import annotations

import importlib
import math
import statistics
from collections.abc import Sequence
from functools import partial
from typing import Any, Final, TypeAlias

import numpy as np

from benchmarks.camera import Shot, crowded_places
from benchmarks.timing import Figures, Progress, cpu_seconds, ignore_progress, machine, rounded
from dorothie_gym.maps.model import Array
from dorothie_gym.pictures.camera.mesh import joined
from dorothie_gym.pictures.camera.pose import CameraPose
from dorothie_gym.pictures.camera.range_sensors import CarState, Lidar
from dorothie_gym.pictures.camera.town_scene import SessionScene
from dorothie_gym.session.sensor_config import LidarConfig

Rays: TypeAlias = tuple[int, int]
"""Channels and columns of a turn."""

TURNS: Final[Sequence[Rays]] = ((32, 180), (32, 720), (32, 2160), (128, 1024))
"""Turns that are measured by default; 32 x 2160 are those of a Velodyne HDL-32E."""

REFERENCE: Final[Rays] = (32, 720)
"""Turn of the reference."""


def measure(
    town: str = "midtown",
    *,
    turns: Sequence[Rays] = TURNS,
    vehicles: int = 60,
    pedestrians: int = 60,
    seed: int = 0,
    repeats: int = 5,
    progress: Progress = ignore_progress,
) -> Figures:
    """Measures turns at places all over a town, in CPU seconds of one thread.

    Args:
        town: name or file of a town.
        turns: channels and columns.
        vehicles: number of vehicles.
        pedestrians: number of pedestrians.
        seed: seed of the session.
        repeats: number of turns at a place; the median counts.
        progress: callback for the progress.

    Returns:
        `rows`: for each turn `milliseconds`, the mean over the places, `milliseconds_worst`, that of the slowest
        place, and `returns`, the share of rays with a return. `embree`: the time of the reference or None.

    Raises:
        TownError: there is no such town, or its file is invalid.
    """
    progress("drive", 0.0)
    scene, places, name = crowded_places(town, vehicles=vehicles, pedestrians=pedestrians, seed=seed)
    rows = []
    for number, (channels, columns) in enumerate(turns):
        progress(f"{channels} x {columns}", 0.2 + 0.6 * number / len(turns))
        lidar = Lidar(scene, LidarConfig(channels=channels, columns=columns))
        times, returns = [], []
        for shot in places:
            turn = partial(lidar.turn, _car(shot), shot.arrays, shot.weather)
            returns.append(float((turn().points[..., 3] > 0.0).mean()))
            times.append(statistics.median(cpu_seconds(turn) for _ in range(repeats)))
        rows.append(
            {
                "channels": channels,
                "columns": columns,
                "milliseconds": rounded(1000.0 * statistics.mean(times)),
                "milliseconds_worst": rounded(1000.0 * max(times)),
                "returns": rounded(statistics.mean(returns)),
            }
        )
    progress("references", 0.8)
    return {
        "town": name,
        "vehicles": vehicles,
        "pedestrians": pedestrians,
        "seed": seed,
        "places": len(places),
        "rows": rows,
        "embree": _embree(scene, places, repeats),
        "repeats": repeats,
        "machine": machine(),
    }


def _car(shot: Shot) -> CarState:
    pose = shot.pose
    return CarState(pose.x, pose.y, pose.z, pose.heading, 0.0)


def _embree(scene: SessionScene, places: Sequence[Shot], repeats: int) -> dict[str, float] | None:
    """Returns the time of Embree for the rays of `REFERENCE` through town and session, without bodies; None without.

    Embree finds triangles only, and takes the rays one after the other on one thread; the time of its search tree is
    not counted.
    """
    try:
        construction: Any = importlib.import_module("embreex.mesh_construction")
        scenes: Any = importlib.import_module("embreex.rtcore_scene")
    except ImportError:
        return None
    mesh = joined([scene.camera_scene.town, scene.overlay])
    embree = scenes.EmbreeScene()
    construction.TriangleMesh(embree, np.ascontiguousarray(mesh.corners))
    times = []
    for shot in places:
        origins, directions = _rays(shot.pose)
        cast = partial(embree.run, origins, directions)
        cast()
        times.append(statistics.median(cpu_seconds(cast) for _ in range(repeats)))
    return {"milliseconds": rounded(1000.0 * statistics.mean(times))}


def _rays(pose: CameraPose) -> tuple[Array, Array]:
    """Returns origins and directions (n, 3) of the rays of `REFERENCE` on a level car."""
    config = LidarConfig(channels=REFERENCE[0], columns=REFERENCE[1])
    azimuths = pose.heading + np.arange(config.columns) * (2.0 * math.pi / config.columns)
    altitudes = np.radians(np.linspace(config.lower_fov, config.upper_fov, config.channels))[:, None]
    level, up = np.cos(altitudes), np.broadcast_to(np.sin(altitudes), (config.channels, config.columns))
    directions = np.stack((level * np.cos(azimuths), level * np.sin(azimuths), up), axis=-1).reshape(-1, 3)
    origin = np.array([pose.x, pose.y, pose.z + config.mount.up], np.float32)
    return np.tile(origin, (len(directions), 1)), directions.astype(np.float32)
