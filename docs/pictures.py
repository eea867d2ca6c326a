"""Draws the pictures of the documentation again; a step of every release.

python docs/pictures.py --corpus DIR       # all; DIR: dorothie-gym generate --sessions 183 --seed 77 --out DIR
python docs/pictures.py session midtown    # some of them

`navigation_curve.png` comes from training runs, see `docs/pages.py curves`; `perception.png` comes from
`benchmarks/perception.py --picture`, `detections.webp` from `benchmarks/detections.py`. Charts have a hash of what they
show (`FINGERPRINT`), with which the tests find charts that are out of date without drawing them: the pixels of a chart
depend on the version of matplotlib.
"""

from __future__ import annotations

import argparse
import dataclasses
import hashlib
import json
import re
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import environment_animations
import numpy as np
from film_cut import film_frames
from numpy.typing import NDArray
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from dorothie_gym.cli.run import draw_session
from dorothie_gym.envs.navigation_v0 import NavigationEnv
from dorothie_gym.evaluation.closed_loop.leaderboard import PART_TITLES
from dorothie_gym.evaluation.closed_loop.leaderboard_chart import CHART_METRICS, ChartRow, draw_rows
from dorothie_gym.evaluation.rollout import play_session
from dorothie_gym.maps import Town, fold_of, load_town
from dorothie_gym.ontology import AGENT_ROLES, ActionValue, LandmarkName, WeatherParameter
from dorothie_gym.pictures import town_picture
from dorothie_gym.pictures.camera.body_snapshots import snapshot_of
from dorothie_gym.pictures.camera.pose import pose_on_car
from dorothie_gym.pictures.camera.range_sensors import CarState, Lidar
from dorothie_gym.pictures.camera.recorded_pictures import RecordedPictures
from dorothie_gym.pictures.camera.scene_cache import town_scene
from dorothie_gym.pictures.camera.session_camera import EarlierWorld, SessionCamera
from dorothie_gym.pictures.camera.session_pictures import scene_of
from dorothie_gym.pictures.camera.town_scene import SessionScene
from dorothie_gym.pictures.views.playback import Playback
from dorothie_gym.pictures.views.session_views import SessionRenderer
from dorothie_gym.policies import make_policy
from dorothie_gym.policies.navigation import NavigationAction
from dorothie_gym.session.config import CameraConfig, CameraMount, CameraOutput, EnvConfig, RenderView
from dorothie_gym.session.recording import Session
from dorothie_gym.session.sensor_config import LidarConfig
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.sim.config import WorldConfig
from dorothie_gym.sim.weather import Weather

sys.path.append(str(Path(__file__).parents[1]))  # the benchmarks are a folder of the checkout and not installed
from benchmarks.report import Report, world_report
from benchmarks.report_chart import draw

DOCS = Path(__file__).parent
BENCHMARK = DOCS.parent / "benchmarks" / "results" / "world.json"

FINGERPRINT: Final = "dorothie_gym content"
"""Key of the text in a PNG file with the hash of the content of a chart."""

CLASS_COLOURS: Final = np.array(
    [
        (0, 0, 0), (70, 70, 70), (190, 153, 153), (72, 0, 90), (220, 20, 60), (153, 153, 153), (240, 240, 240),
        (128, 64, 128), (244, 35, 232), (107, 142, 35), (0, 0, 142), (102, 102, 156), (220, 220, 0), (70, 130, 180),
        (81, 0, 81), (150, 100, 100), (230, 150, 140), (180, 165, 180), (250, 170, 30), (110, 190, 160), (170, 120, 50),
        (45, 60, 150), (152, 251, 152),
    ],
    dtype=np.uint8,
)  # fmt: skip
"""Colours of the semantic classes, as in Cityscapes."""

COLOURS: Final = 256
"""Number of colours of the pictures, which keeps their files small."""

SESSION_TOWN, SESSION_SEED = "brookside", 8
"""Session on the first picture of docs/tour.md: that of `dorothie-gym run --town brookside --seed 8`."""


def draw_first_session(path: Path) -> None:
    """Draws the picture that `dorothie-gym run --town brookside --seed 8` draws."""
    engine = SessionEngine(SESSION_TOWN)
    policies = {role: make_policy("scripted", role, engine.limits) for role in AGENT_ROLES}
    play_session(engine, policies, seed=SESSION_SEED)
    draw_session(engine, path)
    _reduce(path)


def draw_midtown(path: Path) -> None:
    """Draws the map that `dorothie-gym towns midtown --picture` draws, in a size for a page."""
    town_picture(load_town("midtown"), path, size=(1400, 1372), fold=fold_of("midtown"))
    _reduce(path)


GENERATED_TOWNS: Final = (
    "generated:2,size=large,style=grid", "generated:5,size=large,style=organic",
    "generated:3,size=medium,style=radial", "generated:2,size=large,style=mixed",
)  # fmt: skip
"""Towns on the picture of docs/towns.md, row by row."""


def draw_generated_towns(path: Path) -> None:
    """Draws the maps of four generated towns."""
    width, height = 900, 700
    sheet = Image.new("RGB", (2 * width, 2 * height))
    for k, name in enumerate(GENERATED_TOWNS):
        town_picture(load_town(name), path, size=(width, height))
        with Image.open(path) as image:
            sheet.paste(image, (k % 2 * width, k // 2 * height))
    sheet.save(path)
    _reduce(path)


WINDSCREEN_TOWN, WINDSCREEN_SEED, WINDSCREEN_SECONDS = "midtown", 7, 52.0
WINDSCREEN_FRAME = 684

FILM_TOWN, FILM_SEED, FILM_RATE = "midtown", 7, 10
"""Session of the film, with the frames in a second."""


def recorded_session(town: str, seed: int, config: EnvConfig | None = None) -> tuple[Session, Town]:
    """Returns a session of the scripted players, and its town."""
    engine = SessionEngine(town, config=config)
    policies = {role: make_policy("scripted", role, engine.limits) for role in AGENT_ROLES}
    with TemporaryDirectory() as folder:
        play_session(engine, policies, seed=seed, folder=Path(folder) / "session")
        return Session.load(Path(folder) / "session"), engine.town


def windscreen_frames(session: Session, town: Town, frames: Sequence[int]) -> Iterator[NDArray[np.uint8]]:
    """Yields what `dorothie-gym film` shows of a session at some frames."""
    renderer = SessionRenderer(RenderView.BOTH)
    width, height = renderer.windscreen or (0, 0)
    playback = Playback(session, town)
    pictures = RecordedPictures(session, town, CameraConfig(width=width, height=height))
    for frame in frames:
        yield renderer.draw(playback.scene(frame), pictures.picture(frame).rgb)


def draw_windscreen(path: Path) -> None:
    """Draws the first picture of docs/tour.md: windscreen, talk and map."""
    config = EnvConfig(max_seconds=WINDSCREEN_SECONDS, world=WorldConfig(vehicles=70, pedestrians=90))
    session, town = recorded_session(WINDSCREEN_TOWN, WINDSCREEN_SEED, config)
    (frame,) = windscreen_frames(session, town, [WINDSCREEN_FRAME])
    Image.fromarray(frame).save(path, optimize=True)


def draw_film(path: Path) -> None:
    """Draws the film of README.md, smaller than the pictures: twelve seconds, cut by the events of a session."""
    session, town = recorded_session(FILM_TOWN, FILM_SEED)
    frames = windscreen_frames(session, town, film_frames(session, FILM_RATE))
    shots = [Image.fromarray(frame).resize((800, 450), Image.Resampling.LANCZOS) for frame in frames]
    shots[0].save(
        path.with_suffix(".webp"), save_all=True, append_images=shots[1:], duration=1000 // FILM_RATE, loop=0,
        quality=60, method=6,
    )  # fmt: skip


CAMERA_TOWN, CAMERA_SEED, CAMERA_LANDMARK = "midtown", 3, LandmarkName.IKEA


def draw_camera(path: Path) -> None:
    """Draws a street with a landmark: by day, at night, in rain, and its semantic classes."""
    engine = SessionEngine(CAMERA_TOWN, config=EnvConfig(world=WorldConfig(vehicles=60, pedestrians=60)))
    engine.reset(seed=CAMERA_SEED)
    session = engine.session
    session.world.step(600)
    names = [name.label for name in session.scenario.street_names]
    marks = session.task.storyboard.landmarks
    scene = SessionScene(town_scene(engine.town), names, marks)
    camera = SessionCamera(scene, CameraConfig(outputs=(CameraOutput.RGB, CameraOutput.SEMANTIC)))
    mark = next(mark for mark in marks if mark.name is CAMERA_LANDMARK)
    lane, station = engine.town.lanes[mark.lane], max(mark.station - 26.0, 0.0)
    x, y = lane.position(station).tolist()
    pose = pose_on_car(camera.config.mount, x, y, lane.height_at(station), lane.heading_at(station))
    day, night, rain = Weather(), Weather(), Weather()
    night.set(WeatherParameter.SUN_ALTITUDE_ANGLE, -20.0)
    for parameter, value in ((WeatherParameter.PRECIPITATION, 60.0), (WeatherParameter.CLOUDINESS, 90.0)):
        rain.set(parameter, value)
    frames = [
        camera.render_from(
            pose, session.world.actors.arrays, weather, time=session.world.time, head_lights=weather is night
        )
        for weather in (day, night, rain)
    ]
    pictures = [np.asarray(frame.rgb) for frame in frames]
    pictures.append(CLASS_COLOURS[np.asarray(frames[0].semantic)])
    rows = [np.concatenate(pictures[k : k + 2], axis=1) for k in (0, 2)]
    Image.fromarray(np.concatenate(rows)).save(path)
    _reduce(path)


SENSORS_TOWN, SENSORS_SEED, SENSORS_LANDMARK = "midtown", 3, LandmarkName.IKEA
FLOW_SCALE = 6.0
"""Brightness of a movement of one pixel."""


def draw_sensors(path: Path) -> None:
    """Draws what several cameras and the lidar of a car show at one moment."""
    engine = SessionEngine(SENSORS_TOWN, config=EnvConfig(world=WorldConfig(vehicles=60, pedestrians=60)))
    engine.reset(seed=SENSORS_SEED)
    world = engine.session.world
    world.step(600)
    scene = scene_of(engine.town, engine.scenario)
    mark = next(mark for mark in scene.landmarks if mark.name is SENSORS_LANDMARK)
    lane, station = engine.town.lanes[mark.lane], max(mark.station - 26.0, 0.0)
    (x, y), before = lane.position(station).tolist(), lane.position(station - 1.5).tolist()
    height, heading = lane.height_at(station), lane.heading_at(station)
    earlier = EarlierWorld(*before, height, heading, snapshot_of(world.actors.arrays))
    world.step(4)
    size, parts = {"width": 320, "height": 240}, tuple(CameraOutput)
    front = SessionCamera(scene, CameraConfig(**size, outputs=parts, metres_per_pixel=0.2))
    arrays, weather = world.actors.arrays, world.weather
    frame = front.render_from(front.pose_on(x, y, height, heading), arrays, weather, time=world.time, before=earlier)
    sides = []
    for yaw in (-90.0, 90.0, 180.0):
        camera = SessionCamera(scene, CameraConfig(**size, mount=CameraMount(yaw=yaw)))
        sides.append(
            camera.render_from(camera.pose_on(x, y, height, heading), arrays, weather, time=world.time).colours
        )
    flow = np.asarray(frame.optical_flow)
    moved = np.concatenate((128.0 + FLOW_SCALE * flow, np.full((*flow.shape[:2], 1), 128.0)), axis=-1)
    faces = 127.5 + 127.5 * np.asarray(frame.normals)
    lidar = Lidar(scene, LidarConfig())
    turn = lidar.turn(CarState(x, y, height, heading, 0.0), arrays, weather)
    pictures = [
        sides[0], frame.colours, sides[1],
        sides[2], np.clip(moved, 0.0, 255.0).astype(np.uint8), faces.astype(np.uint8),
        CLASS_COLOURS[frame.classes], CLASS_COLOURS[np.asarray(frame.birds_eye)],
        _plot_lidar(turn.points, turn.semantic, (240, 320)),
    ]  # fmt: skip
    rows = [np.concatenate(pictures[k : k + 3], axis=1) for k in (0, 3, 6)]
    Image.fromarray(np.concatenate(rows)).save(path)
    _reduce(path)


def _plot_lidar(points: NDArray[np.float32], classes: NDArray[np.uint8], size: tuple[int, int]) -> NDArray[np.uint8]:
    """Returns the returns of a lidar from above, the car in the centre, 0.2 m in a pixel, in the colours of classes."""
    picture = np.zeros((*size, 3), np.uint8)
    rows = np.floor(0.5 * size[0] - points[..., 0] / 0.2).astype(int)
    columns = np.floor(0.5 * size[1] + points[..., 1] / 0.2).astype(int)
    inside = (points[..., 3] > 0.0) & (rows >= 0) & (rows < size[0]) & (columns >= 0) & (columns < size[1])
    picture[rows[inside], columns[inside]] = CLASS_COLOURS[classes[inside]]
    return picture


DASHBOARD_DECISIONS = (20, 44, 52, 66)


def draw_dashboard(path: Path) -> None:
    """Draws what a driver observes that carries out turns as it is told, three times as large."""
    env = NavigationEnv(observation="camera", traffic="medium")
    shown, _ = env.reset(seed=0)
    shots = []
    for decision in range(DASHBOARD_DECISIONS[-1] + 1):
        if decision in DASHBOARD_DECISIONS:
            shots += [shown.repeat(3, axis=0).repeat(3, axis=1), np.full((3 * len(shown), 6, 3), 255, np.uint8)]
        said, action = env.batch.heard(0).instruction, NavigationAction.NOTHING
        if said is not None and said.action is ActionValue.U_TURN:
            action = NavigationAction.U_TURN
        elif said is not None and said.action is ActionValue.J_TURN and said.sector is not None:
            action = NavigationAction.turn(said.sector)
        shown, *_ = env.step(int(action) if env.action_masks()[action] else 0)
    Image.fromarray(np.concatenate(shots[:-1], axis=1)).save(path, optimize=True)


def draw_corpus(path: Path, corpus: Path) -> None:
    """Draws moves and slots of a corpus."""
    from dorothie_gym.archive import Corpus
    from dorothie_gym.evaluation.analysis import corpus_stats_of
    from dorothie_gym.evaluation.analysis.profile_charts import draw_profiles

    census = corpus_stats_of(Corpus.load(corpus))
    made = json.loads((corpus / "generation.json").read_text(encoding="utf-8"))
    draw_profiles(census.profiles, census.counts.heading, f"{made['sessions']} generated sessions", path)


def benchmark_report() -> Report:
    """Returns the recorded measurement of `python -m benchmarks world`."""
    return world_report(json.loads(BENCHMARK.read_text(encoding="utf-8")))


def draw_benchmark(path: Path) -> None:
    """Draws the recorded measurement of `python -m benchmarks world`."""
    report = benchmark_report()
    draw(report, path)
    sign(path, dataclasses.asdict(report))


def leaderboard_rows() -> list[ChartRow]:
    """Returns the rows of the charts on the leaderboard, from the tables of its page."""
    page = (DOCS / "leaderboard.md").read_text(encoding="utf-8")
    rows = []
    for part, title in PART_TITLES.items():
        table = re.search(rf"## {title}\n\n(.*?)\n\n", page, flags=re.DOTALL)
        if table is None:
            continue
        head, _, *lines = [[cell.strip() for cell in line.strip("|").split(" |")] for line in table[1].splitlines()]
        for cells in lines:
            found = dict(zip(head, cells, strict=True))
            figures = {key: _figure(found[name]) for key, name in CHART_COLUMNS.items()}
            rows.append(ChartRow(label=found["Co-Wizard"], part=part, figures=figures))
    return rows


CHART_COLUMNS: Final[Mapping[str, str]] = {
    "success": "success",
    "goal_condition_success": "goals",
    "driving_score": "driving score",
    "spl": "SPL",
}
"""Column of the page of each of `CHART_METRICS`."""


def _figure(cell: str) -> dict[str, float | None]:
    """Returns mean and interval of a cell such as "98.3 [91.1, 99.7] %"."""
    numbers = [float(number) / 100.0 for number in re.findall(r"\d+\.\d+", cell)]
    mean, low, high = (*numbers, None, None, None)[:3]
    return {"mean": mean, "low": low, "high": high}


def draw_leaderboard(path: Path) -> None:
    """Draws the leaderboard from its page."""
    rows = leaderboard_rows()
    assert set(CHART_COLUMNS) == set(CHART_METRICS)
    draw_rows(rows, path)
    sign(path, [dataclasses.asdict(row) for row in rows])


def fingerprint(content: object) -> str:
    """Returns the hash of the content of a chart, in JSON types."""
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:16]


def sign(path: Path, content: object) -> None:
    """Writes the fingerprint of its content into a PNG file."""
    text = PngInfo()
    text.add_text(FINGERPRINT, fingerprint(content))
    with Image.open(path) as image:
        image.load()
        image.save(path, optimize=True, pnginfo=text)


def _reduce(path: Path) -> None:
    with Image.open(path) as image:
        image.convert("RGB").quantize(COLOURS).save(path, optimize=True)


PICTURES: Final[Mapping[str, Callable[[Path], None]]] = {
    "session": draw_first_session,
    "midtown": draw_midtown,
    "generated_towns": draw_generated_towns,
    "windscreen": draw_windscreen,
    "film": draw_film,
    "camera": draw_camera,
    "sensors": draw_sensors,
    "dashboard": draw_dashboard,
    "bench_world": draw_benchmark,
    "leaderboard": draw_leaderboard,
}
"""Functions that draw the pictures that need nothing but the repository, by name of the file."""


def main(arguments: Sequence[str]) -> None:
    """Draws all pictures, or some."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    names = (*PICTURES, "corpus", "environments")
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(names)}; default: all")
    parser.add_argument("--corpus", type=Path, help="corpus for corpus.png")
    given: Any = parser.parse_args(arguments)
    if unknown := set(given.names) - set(names):
        parser.error(f"there is no picture {min(unknown)}; choose from {', '.join(names)}")
    for name in given.names or names:
        if name in PICTURES:
            PICTURES[name](DOCS / f"{name}.png")
        elif name == "environments":
            environment_animations.draw_animations()
        elif given.corpus is None:
            print("corpus: left out; give a corpus with --corpus DIR")
        else:
            draw_corpus(DOCS / "corpus.png", given.corpus)


if __name__ == "__main__":
    main(sys.argv[1:])
