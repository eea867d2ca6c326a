"""Time of a picture of the first-person camera by size and outputs, on one core, against OpenGL and MetaDrive."""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Final, TypeAlias

import numpy as np

from benchmarks.metadrive_reference import metadrive_reference
from benchmarks.opengl_reference import opengl_reference
from benchmarks.timing import Figures, Progress, cpu_seconds, ignore_progress, machine, rounded
from dorothie_gym.evaluation.rollout import play_session
from dorothie_gym.maps import Town, load_town
from dorothie_gym.ontology import Role
from dorothie_gym.pictures.camera.pose import CameraPose, pose_on_car
from dorothie_gym.pictures.camera.session_camera import SessionCamera
from dorothie_gym.pictures.camera.session_pictures import scene_of
from dorothie_gym.pictures.camera.town_scene import SessionScene
from dorothie_gym.policies import make_policy
from dorothie_gym.session.config import CameraConfig, CameraMount, CameraOutput, EnvConfig
from dorothie_gym.session.sensor_config import SensorMount
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.sim.config import FRAME_RATE, WorldConfig
from dorothie_gym.sim.state.world_arrays import WorldArrays
from dorothie_gym.sim.weather import Weather
from dorothie_gym.support.user_cache import CACHE_VARIABLE

Size: TypeAlias = tuple[int, int]
"""Width and height of a picture [pixels]."""

SIZES: Final[Sequence[Size]] = ((84, 84), (240, 160), (480, 320), (800, 600))
"""Sizes that are measured by default."""

REFERENCE_SIZE: Final[Size] = (480, 320)
"""Size of the first picture, of `camera_bytes` and of the references."""

RGB, EVERYTHING = (CameraOutput.RGB,), tuple(CameraOutput)
"""Outputs that are measured by default."""

PLACES: Final = 9
"""Number of places over whose pictures the time is averaged."""

DRIVE_FREQUENCY: Final = 5.0
"""Pictures per second of the drive [Hz]."""

PASSES: Final = 2
"""Passes of the drive, each with a new camera; of each picture the shorter time counts."""

_SHORTEST = 30.0  # lanes with a place [m]


@dataclass(frozen=True)
class Shot:
    """Content of a picture.

    Attributes:
        pose: pose of the camera.
        arrays: bodies.
        weather: weather and light.
        time: simulated time [s].
        lights: whether the head lights are on.
    """

    pose: CameraPose
    arrays: WorldArrays
    weather: Weather
    time: float
    lights: bool


def measure(
    town: str = "midtown",
    *,
    sizes: Sequence[Size] = SIZES,
    outputs: Sequence[tuple[CameraOutput, ...]] = (RGB, EVERYTHING),
    vehicles: int = 60,
    pedestrians: int = 60,
    seed: int = 0,
    seconds: float = 30.0,
    cold: bool = False,
    repeats: int = 5,
    progress: Progress = ignore_progress,
) -> Figures:
    """Draws pictures at places all over a town and along a drive, in CPU seconds of one thread.

    Args:
        town: name or file of a town.
        sizes: sizes of the pictures.
        outputs: parts of the pictures; RGB alone is also measured without antialiasing.
        vehicles: number of vehicles.
        pedestrians: number of pedestrians.
        seed: seed of the session.
        seconds: length of the drive [s].
        cold: whether to measure also the first picture with an empty cache, which compiles for minutes.
        repeats: number of pictures at a place, and of first pictures; the median counts.
        progress: callback for the progress.

    Returns:
        `rows`: for each size, outputs and antialiasing `milliseconds`, the mean over the places, and
        `milliseconds_p99` and `milliseconds_drive`, the 99th percentile and the median along the drive.
        `first_picture_seconds` after a session has begun, from caches; `cold_picture_seconds` or None;
        `town_bytes` and `camera_bytes`; `opengl` and `metadrive`: the time of the references or None.

    Raises:
        TownError: there is no such town, or its file is invalid.
    """
    progress("drive", 0.0)
    engine = _engine(town, vehicles, pedestrians, seconds)
    drive = _drive(engine, seed)
    places = _places(engine.town, drive[-1], CameraMount())
    scene = scene_of(engine.town, engine.scenario)
    kinds = [(size, parts, True) for size in sizes for parts in outputs]
    kinds += [(size, RGB, False) for size in sizes if RGB in outputs]
    kinds.sort(key=lambda kind: (kind[0], len(kind[1]), not kind[2]))
    rows = []
    for number, (size, parts, antialias) in enumerate(kinds):
        progress(f"{size[0]} x {size[1]}, {' '.join(parts)}", 0.05 + 0.75 * number / len(kinds))
        config = CameraConfig(width=size[0], height=size[1], outputs=parts, antialiasing=antialias)
        rows.append(
            {
                "width": size[0],
                "height": size[1],
                "outputs": [str(part) for part in parts],
                "antialias": antialias,
                **_times(scene, config, places, drive, repeats),
            }
        )
    progress("references", 0.8)
    width, height = REFERENCE_SIZE
    camera = SessionCamera(scene, CameraConfig(width=width, height=height, outputs=EVERYTHING))
    camera.render_from(drive[0].pose, drive[0].arrays, drive[0].weather, time=drive[0].time)
    references = _references(scene, places, repeats, seed)
    progress("first picture", 0.85)
    return {
        "town": engine.town.name,
        "vehicles": vehicles,
        "pedestrians": pedestrians,
        "seed": seed,
        "places": len(places),
        "drive_pictures": len(drive),
        "rows": rows,
        "first_picture_seconds": rounded(statistics.median(_first_picture(town) for _ in range(repeats))),
        "cold_picture_seconds": _cold_picture(town) if cold else None,
        "town_bytes": scene.town.nbytes,
        "camera_bytes": camera.camera.nbytes,
        **references,
        "repeats": repeats,
        "machine": machine(),
    }


def _engine(town: str, vehicles: int, pedestrians: int, seconds: float) -> SessionEngine:
    return SessionEngine(
        load_town(town),
        config=EnvConfig(
            decision_frequency=DRIVE_FREQUENCY,
            max_seconds=seconds,
            world=WorldConfig(vehicles=vehicles, pedestrians=pedestrians),
        ),
    )


def crowded_places(town: str, *, vehicles: int, pedestrians: int, seed: int) -> tuple[SessionScene, list[Shot], str]:
    """Returns the scene of a session, views all over its town after 10 s, with a camera on the road, and its name."""
    engine = _engine(town, vehicles, pedestrians, 60.0)
    engine.reset(seed=seed)
    world = engine.session.world
    world.step(10 * FRAME_RATE)
    crowd = Shot(CameraPose(0.0, 0.0, 0.0, 0.0), world.actors.arrays.copy(), world.weather, world.time, lights=False)
    on_road = SensorMount(up=0.2)
    shots = _places(engine.town, crowd, on_road)
    road = [replace(shot, pose=replace(shot.pose, z=shot.pose.z - on_road.up)) for shot in shots]
    return scene_of(engine.town, engine.scenario), road, engine.town.name


def _drive(engine: SessionEngine, seed: int) -> list[Shot]:
    """Returns the camera's view at each decision of a session of the scripted participant and Co-Wizard."""
    shots: list[Shot] = []
    config = CameraConfig()

    def note(engine: SessionEngine) -> None:
        world = engine.session.world
        x, y = world.car.position.tolist()
        pose = pose_on_car(config.mount, x, y, float(world.car.height), float(world.car.heading))
        shots.append(Shot(pose, world.actors.arrays.copy(), world.weather, world.time, world.ego.lights))

    scripted, silent = partial(make_policy, "scripted"), partial(make_policy, "silent")
    policies = {
        Role.PARTICIPANT: scripted(Role.PARTICIPANT, engine.limits),
        Role.CO_WIZARD: scripted(Role.CO_WIZARD, engine.limits),
        Role.AD_WIZARD: silent(Role.AD_WIZARD, engine.limits),
    }
    play_session(engine, policies, seed=seed, on_step=note)
    return shots


def _places(town: Town, crowd: Shot, mount: SensorMount) -> list[Shot]:
    """Returns views from the middles of lanes all over a town, with the bodies of another view."""
    lanes = [lane for lane in town.lanes if not lane.in_junction and lane.length >= _SHORTEST]
    chosen = [lanes[k * len(lanes) // PLACES] for k in range(PLACES)]
    shots = []
    for lane in chosen:
        station = 0.5 * lane.length
        x, y = lane.position(station).tolist()
        pose = pose_on_car(mount, x, y, lane.height_at(station), lane.heading_at(station))
        shots.append(Shot(pose, crowd.arrays, crowd.weather, crowd.time, lights=False))
    return shots


def _draw(camera: SessionCamera, shot: Shot) -> float:
    """Returns the time of a picture [s]."""
    return cpu_seconds(
        partial(camera.render_from, shot.pose, shot.arrays, shot.weather, time=shot.time, head_lights=shot.lights)
    )


def _times(
    scene: SessionScene, config: CameraConfig, places: Sequence[Shot], drive: Sequence[Shot], repeats: int
) -> dict[str, float]:
    """Returns the times of a camera by the names of the figures [ms]."""
    camera = SessionCamera(scene, config)
    means = []
    for shot in places:
        _draw(camera, shot)  # draws the map of shadows around the place
        means.append(statistics.median(_draw(camera, shot) for _ in range(repeats)))
    passes = []
    for _ in range(PASSES):
        camera = SessionCamera(scene, config)
        _draw(camera, drive[0])
        passes.append([_draw(camera, shot) for shot in drive])
    along = np.min(passes, axis=0)
    return {
        "milliseconds": rounded(1000.0 * statistics.mean(means)),
        "milliseconds_p99": rounded(1000.0 * float(np.percentile(along, 99.0))),
        "milliseconds_drive": rounded(1000.0 * float(np.median(along))),
    }


# --- References -------------------------------------------------------------------------------------------------------


def _references(scene: SessionScene, places: Sequence[Shot], repeats: int, seed: int) -> Figures:
    """Returns the times of the references at `REFERENCE_SIZE`; None where they are not installed."""
    found: Figures = {"opengl": None, "metadrive": None}
    opengl = opengl_reference(scene, *REFERENCE_SIZE)
    if opengl is not None:
        times = []
        for shot in places:
            opengl.draw(shot.pose)
            times.append(statistics.median(cpu_seconds(partial(opengl.draw, shot.pose)) for _ in range(repeats)))
        found["opengl"] = {"renderer": opengl.renderer, "milliseconds": rounded(1000.0 * statistics.mean(times))}
        opengl.close()
    metadrive = metadrive_reference(seed, picture=REFERENCE_SIZE)
    if metadrive is not None:
        steps = []
        for _ in range(10 * repeats):
            metadrive.prepare()
            steps.append(cpu_seconds(metadrive.step))
        found["metadrive"] = {"milliseconds": rounded(1000.0 * statistics.median(steps))}
        metadrive.close()
    return found


# --- First picture ----------------------------------------------------------------------------------------------------

_FIRST_PICTURE = """
import sys, time
import dorothie_gym
env = dorothie_gym.DuoWizardEnv(sys.argv[1])
env.reset(seed=0)
start = time.process_time()
from dorothie_gym.pictures.camera.scene_cache import town_scene
from dorothie_gym.pictures.camera.session_camera import SessionCamera
from dorothie_gym.pictures.camera.town_scene import SessionScene
scenario = env.session.scenario
names = [name.label for name in scenario.street_names]
scene = SessionScene(town_scene(env.session.world.town), names, scenario.storyboard.landmarks)
SessionCamera(scene, dorothie_gym.CameraConfig()).render(env.session.world)
print(time.process_time() - start)
"""


def _first_picture(town: str, cache: str | None = None) -> float:
    """Returns the processor time of the first picture of a process after a session has begun [s]."""
    environment = {**os.environ, "PYGAME_HIDE_SUPPORT_PROMPT": "1"}
    if cache is not None:
        environment[CACHE_VARIABLE] = cache
    program = [sys.executable, "-c", _FIRST_PICTURE, town]
    done = subprocess.run(program, env=environment, capture_output=True, check=True, text=True)
    return float(done.stdout.splitlines()[-1])


def _cold_picture(town: str) -> float:
    """Returns the time of a first picture that finds neither compiled code nor a scene [s]."""
    with tempfile.TemporaryDirectory() as folder:
        return rounded(_first_picture(town, folder))
