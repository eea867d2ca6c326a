"""Pictures of whole towns against ray casting and against the map: depth, primitives, instances and classes.

Two towns with few places belong to the quick tests; `pytest -m slow` tries 20 places in each shipped town and in maps
of CARLA.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest
import shapely
from numpy.typing import NDArray

from dorothie_gym.maps import Town, load_town
from dorothie_gym.maps.catalogue import town_names
from dorothie_gym.maps.model import Array
from dorothie_gym.ontology import ObjectClass, WeatherParameter
from dorothie_gym.pictures.camera.cells import draw_cells, new_order, sorted_by_cell
from dorothie_gym.pictures.camera.first_person_camera import FirstPersonCamera
from dorothie_gym.pictures.camera.ground.cells import Painted
from dorothie_gym.pictures.camera.ground.materials import LOOKS, Material
from dorothie_gym.pictures.camera.ground.regions import polygons_of
from dorothie_gym.pictures.camera.ground.sheets import town_sheets
from dorothie_gym.pictures.camera.labels import new_labels, write_labels
from dorothie_gym.pictures.camera.mesh import Mesh, Surface, empty_mesh, joined
from dorothie_gym.pictures.camera.pose import CameraPose, View, view_from
from dorothie_gym.pictures.camera.rasterizer import NEAR, SKY, clear, new_buffer
from dorothie_gym.pictures.camera.samples import new_samples
from dorothie_gym.pictures.camera.scene_cache import town_scene
from dorothie_gym.pictures.camera.session_camera import SessionCamera
from dorothie_gym.pictures.camera.town_scene import SessionScene
from dorothie_gym.pictures.maps.levels import stretches
from dorothie_gym.pictures.maps.map_layers import MapLayers
from dorothie_gym.pictures.maps.shapes import TownSamples
from dorothie_gym.session.config import CameraConfig, CameraOutput, EnvConfig
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.sim.config import WorldConfig
from dorothie_gym.sim.weather import Weather
from dorothie_gym.support.compilation.records import plain
from tests.maps.opendrive_text import shared_map

WIDTH, HEIGHT = 240, 160
LABELS = CameraConfig(
    width=WIDTH,
    height=HEIGHT,
    outputs=(CameraOutput.DEPTH, CameraOutput.SEMANTIC, CameraOutput.INSTANCE, CameraOutput.BOXES),
)
PLACES = 20
TOWNS = [
    pytest.param("brookside", 4, id="brookside"),
    pytest.param("midtown", 6, id="midtown"),
    *(
        pytest.param(name, PLACES, id=f"{name}-{PLACES} places", marks=pytest.mark.slow)
        for name in (*town_names(), "Town01", "Town02", "Town05")
    ),
]
"""Towns with numbers of places."""


@dataclass(frozen=True, eq=False)
class Stage:
    """A session in a town: its camera, and bodies of its world."""

    engine: SessionEngine
    camera: SessionCamera

    @property
    def town(self) -> Town:
        return self.engine.session.world.town


@cache
def stage_of(name: str) -> Stage:
    source = name if name in town_names() else str(shared_map(name))
    engine = SessionEngine(source, config=EnvConfig(world=WorldConfig(vehicles=60, pedestrians=60)))
    engine.reset(seed=5)
    session = engine.session
    session.world.step(100)
    names = [street.label for street in session.scenario.street_names]
    scene = SessionScene(town_scene(load_town(source)), names, session.task.storyboard.landmarks)
    return Stage(engine, SessionCamera(scene, LABELS))


def poses_in(town: Town, count: int) -> Iterator[CameraPose]:
    """Yields poses on lanes in turn: anywhere, on bridges and in tunnels where there are some, and low at the kerb."""
    rng = np.random.default_rng(8)
    lengths = np.array([lane.length for lane in town.lanes])
    raised = stretches(town, TownSamples.of(town))
    for k in range(count):
        number = int(rng.choice(len(lengths), p=lengths / lengths.sum()))
        station, aside, up, turn = float(rng.uniform(0.0, lengths[number])), 0.0, 1.45, 0.0
        if k % 4 == 1 and raised:
            part = raised[int(rng.integers(len(raised)))]
            number, station = part.lane, float(rng.uniform(part.start, part.end))
        elif k % 4 == 2:
            aside, up = town.lanes[number].width_at(station) / 2.0 - 0.4, 0.5
            turn = float(rng.uniform(-0.5, 1.2))
        lane = town.lanes[number]
        x, y = lane.position(station, aside).tolist()
        heading = lane.heading_at(station) + turn
        yield CameraPose(x, y, lane.height_at(station) + up, heading, float(rng.uniform(-0.15, 0.05)))


def rays_hit(view: View, mesh: Mesh) -> tuple[NDArray[np.int64], Array]:
    """Returns the triangle that the ray through each pixel hits, and the exact depth of its plane there."""
    construction = pytest.importorskip("embreex.mesh_construction")
    scenes = pytest.importorskip("embreex.rtcore_scene")
    corners = mesh.corners.astype(np.float64)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    offsets = (normals * (corners[:, 0] - view.origin)).sum(axis=1)
    facing = np.flatnonzero(offsets < -1e-7 * np.linalg.norm(normals, axis=1))
    scene = scenes.EmbreeScene(robust=True)
    # around the camera, where float32 is finest; kept: the scene refers to it
    triangles = construction.TriangleMesh(scene, (corners[facing] - view.origin).astype(np.float32))
    ways = view.rays()
    starts = (NEAR * ways.reshape(-1, 3)).astype(np.float32)
    answer = scene.run(starts, ways.reshape(-1, 3).astype(np.float32), output=True)["primID"].astype(np.int64)
    del triangles
    hit = np.where(answer >= 0, facing[answer], SKY).reshape(ways.shape[:2])
    with np.errstate(divide="ignore", invalid="ignore"):
        depth = np.where(hit == SKY, np.inf, offsets[hit] / (normals[hit] * ways).sum(axis=-1))
    return hit, depth


def numbers_and_depth(stage: Stage, view: View) -> tuple[NDArray[np.int32], NDArray[np.float32], Mesh]:
    """Returns the triangles and depths that the rasterizer finds in a town without bodies, and all triangles."""
    scene = stage.camera.scene
    town, cells = scene.town.mesh, scene.town.cells
    overlay, overlay_cells, _ = sorted_by_cell(scene.overlay)
    buffer, labels = new_buffer(WIDTH, HEIGHT), new_labels(WIDTH, HEIGHT)
    clear(buffer)
    draw_cells(view, buffer, town, cells, new_order(cells, WIDTH, HEIGHT), 0)
    draw_cells(view, buffer, overlay, overlay_cells, new_order(overlay_cells, WIDTH, HEIGHT), town.size)
    write_labels(view, buffer, town, overlay, empty_mesh(), scene.town.ground.arrays, new_samples(), labels)
    return buffer.triangles.copy(), labels.depth, joined([town, overlay])


def bodies_of(stage: Stage, pose: CameraPose) -> Mesh:
    """Returns the triangles of all bodies around a pose, placed without the renderer."""
    arrays, bank = stage.engine.session.world.actors.arrays, stage.camera.scene.camera_scene.bank
    placed = plain(stage.camera.placed(pose, arrays, stage.engine.session.world.weather))
    parts = []
    for body in placed:
        model = bank.mesh.part(slice(*bank.ranges[int(body["model"])].tolist()))
        c, s = float(body["cos"]), float(body["sin"])
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [float(body["rise"]), 0.0, 1.0]])
        corners = model.corners.astype(np.float64) @ turn.T + (body["x"], body["y"], body["z"])
        keys = np.full(model.size, body["key"], np.int32)
        parts.append(model._replace(corners=corners.astype(np.float32), instances=keys))
    return joined(parts)


@pytest.mark.parametrize(("name", "count"), TOWNS)
def test_pixels_of_a_town_see_what_rays_hit(name: str, count: int) -> None:
    stage = stage_of(name)
    same, close, finite = [], [], 0
    for pose in poses_in(stage.town, count):
        view = view_from(pose, WIDTH, HEIGHT, 90.0)
        numbers, depth, mesh = numbers_and_depth(stage, view)
        hit, expected = rays_hit(view, mesh)
        same.append(numbers == hit)
        with np.errstate(invalid="ignore"):
            close.append(np.where(np.isinf(expected), np.isinf(depth), np.abs(depth - expected) <= 1e-3))
        finite += int(np.isfinite(expected).sum())
    assert finite > 0.4 * count * WIDTH * HEIGHT
    assert np.mean(same) >= 0.999
    assert np.mean(close) >= 0.999


@pytest.mark.parametrize(("name", "count"), TOWNS)
def test_instances_are_the_bodies_that_rays_reach(name: str, count: int) -> None:
    stage = stage_of(name)
    world, same, seen = stage.engine.session.world, [], 0
    for pose in poses_in(stage.town, count):
        frame = stage.camera.render_from(pose, world.actors.arrays, world.weather, time=world.time)
        assert frame.instance is not None and frame.boxes is not None
        overlay = stage.camera.scene.overlay
        mesh = joined([stage.camera.scene.town.mesh, overlay, bodies_of(stage, pose)])
        hit, _ = rays_hit(frame.view, mesh)
        expected = np.where(hit == SKY, 0, mesh.instances[hit])
        same.append(frame.instance == expected)
        # of bodies at the edge of what is visible, a ray may miss the few pixels
        keys, pixels = np.unique(expected[expected != 0], return_counts=True)
        shown, found = np.unique(frame.instance[frame.instance != 0], return_counts=True)
        assert set(keys[pixels > 2].tolist()) <= set(shown.tolist())
        assert set(shown[found > 2].tolist()) <= set(keys.tolist())
        assert shown.tolist() == frame.boxes.keys.tolist()
        seen += len(keys)
    assert seen > count / 2
    assert np.mean(same) >= 0.999


@pytest.mark.long
@pytest.mark.parametrize(("name", "count"), TOWNS)
def test_classes_of_the_ground_are_those_of_the_map_there(name: str, count: int) -> None:
    stage = stage_of(name)
    sheets = [Painting(sheet.polygons, sheet.outside) for sheet in town_sheets(MapLayers(stage.town))]
    world, right, wrong = stage.engine.session.world, dict.fromkeys(CLASSES, 0), dict.fromkeys(CLASSES, 0)
    for pose in poses_in(stage.town, count):
        frame = stage.camera.render_from(pose, world.actors.arrays, world.weather, time=world.time)
        assert frame.depth is not None and frame.semantic is not None and frame.instance is not None
        numbers, _, mesh = numbers_and_depth(stage, frame.view)
        ground = (frame.instance == 0) & (numbers != SKY) & (mesh.surfaces[numbers] & Surface.GROUND != 0)
        ground &= frame.depth < 120.0  # farther, a pixel is wider than a line
        depth, sheet = frame.depth[ground].astype(np.float64), mesh.textures[numbers[ground]]
        places = frame.view.origin + frame.view.rays()[ground] * depth[:, None]
        shown = frame.semantic[ground]
        for number in np.unique(sheet).tolist():
            on = sheet == number
            expected = sheets[number].classes_at(places[on, :2])
            for kind in CLASSES:
                right[kind] += int(((expected == kind) & (shown[on] == kind)).sum())
                wrong[kind] += int(((expected == kind) != (shown[on] == kind)).sum())
    for kind in CLASSES:
        assert right[kind] > 50 * count, ObjectClass(kind)
        assert right[kind] / (right[kind] + wrong[kind]) >= 0.99, ObjectClass(kind)


CLASSES = (ObjectClass.ROAD.value, ObjectClass.ROAD_LINE.value, ObjectClass.SIDE_WALK.value)


class Painting:
    """Polygons in the order of painting, looked up by shapely."""

    def __init__(self, polygons: Sequence[Painted], outside: Material) -> None:
        parts = [(part, row) for row, polygon in enumerate(polygons) for part in polygons_of([polygon.points])]
        self._tree = shapely.STRtree([part for part, _ in parts])
        self._rows = np.array([row for _, row in parts])
        self._kinds = np.array([LOOKS[p.material].kind.value for p in polygons] + [LOOKS[outside].kind.value])

    def classes_at(self, places: Array) -> NDArray[np.int64]:
        """Returns the classes (n,) of the top-most polygons at places (n, 2) [m]."""
        top = np.full(len(places), -1)
        point, polygon = self._tree.query(shapely.points(places), predicate="intersects")
        np.maximum.at(top, point, self._rows[polygon])
        return np.asarray(self._kinds[top])


def test_the_sun_does_not_shine_into_the_middle_of_a_tunnel() -> None:
    town, scene = stage_of("midtown").town, stage_of("midtown").camera.scene
    part = max(
        (row for row in stretches(town, TownSamples.of(town)) if row.level < 0), key=lambda row: row.end - row.start
    )
    lane, station = town.lanes[part.lane], (part.start + part.end) / 2.0
    x, y = lane.position(station).tolist()
    pose = CameraPose(x, y, lane.height_at(station) + 1.45, lane.heading_at(station), -math.pi / 2.0)
    weather = Weather()
    weather.set(WeatherParameter.SUN_ALTITUDE_ANGLE, 50.0)
    for azimuth in range(0, 360, 45):
        weather.set(WeatherParameter.SUN_AZIMUTH_ANGLE, float(azimuth))
        shaded, lit = (
            FirstPersonCamera(scene.camera_scene, CameraConfig(width=60, height=40, shadows=on), scene.overlay).render(
                pose, weather
            )
            for on in (True, False)
        )
        assert shaded.rgb is not None and lit.rgb is not None
        assert (shaded.rgb < 0.75 * lit.rgb).mean() > 0.98, azimuth


def test_poses_are_on_bridges_in_tunnels_and_at_kerbs() -> None:
    town = stage_of("midtown").town
    heights = [pose.z for pose in poses_in(town, PLACES)]
    assert min(heights) < -1.0
    assert sum(math.isclose(z, 0.5, abs_tol=0.05) for z in heights) >= 3
