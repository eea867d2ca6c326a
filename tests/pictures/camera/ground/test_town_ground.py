"""Mesh of the ground in whole towns: without gaps, as high as the lanes, and free to drive on."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from dorothie_gym.maps.catalogue import load_town, town_names
from dorothie_gym.maps.model import Array
from dorothie_gym.maps.town import Town
from dorothie_gym.ontology import ObjectClass
from dorothie_gym.pictures.camera.ground.ground import Ground
from dorothie_gym.pictures.camera.ground.lookup import GroundArrays, materials_at
from dorothie_gym.pictures.camera.ground.materials import KERB_HEIGHT, LOOKS, Material, Relief
from dorothie_gym.pictures.camera.ground.town_ground import build_ground
from dorothie_gym.pictures.camera.mesh import Mesh, Surface
from dorothie_gym.pictures.maps.ground import town_bounds
from dorothie_gym.pictures.maps.levels import LevelLookup, stretches
from dorothie_gym.pictures.maps.map_layers import MapLayers
from dorothie_gym.pictures.maps.shapes import TownSamples
from tests.maps.opendrive_text import shared_map

TOWNS = ["brookside", *(pytest.param(name, marks=pytest.mark.long) for name in ("midtown", "Town05"))]


def town_of(name: str) -> Town:
    return load_town(name if name in town_names() else str(shared_map(name)))


@cache
def ground_of(name: str) -> Ground:
    return build_ground(MapLayers(town_of(name)))


def distances(mesh: Mesh, origins: Array, ways: Array) -> Array:
    """Distance to the first triangle along rays (n,) [m], infinite without one."""
    construction = pytest.importorskip("embreex.mesh_construction")
    scene = pytest.importorskip("embreex.rtcore_scene").EmbreeScene()
    construction.TriangleMesh(scene, np.ascontiguousarray(mesh.corners))
    found = scene.run(origins.astype(np.float32), ways.astype(np.float32), query="INTERSECT", output=True)
    return np.where(found["primID"] >= 0, found["tfar"], np.inf)


def lane_points(town: Town, count: int) -> tuple[Array, Array]:
    """Positions (n, 3) on random lanes and their headings."""
    rng = np.random.default_rng(1)
    lanes = [town.lanes[k] for k in rng.integers(0, len(town.lanes), count)]
    stations = rng.uniform(0.0, 1.0, count) * [lane.length for lane in lanes]
    places = [[*lane.position(s), lane.height_at(s)] for lane, s in zip(lanes, stations.tolist(), strict=True)]
    return np.array(places), np.array([lane.heading_at(s) for lane, s in zip(lanes, stations.tolist(), strict=True)])


@pytest.mark.long
@pytest.mark.parametrize("name", TOWNS)
def test_ground_has_no_gaps(name: str) -> None:
    rng = np.random.default_rng(2)
    x0, y0, x1, y1 = town_bounds(town_of(name), 60.0)
    points = np.column_stack((rng.uniform((x0, y0), (x1, y1), (40_000, 2)), np.full(40_000, 50.0)))
    far = np.column_stack((rng.uniform(-1500.0, 1500.0, (2000, 2)), np.full(2000, 50.0)))
    origins = np.concatenate((points, far))
    down = distances(ground_of(name).mesh, origins, np.tile([0.0, 0.0, -1.0], (len(origins), 1)))
    assert np.isfinite(down).all()
    slanted = np.tile([0.6, 0.5, -0.3], (len(points), 1))  # meets kerbs and walls as well
    assert np.isfinite(distances(ground_of(name).mesh, points, slanted)).all()


@pytest.mark.parametrize("name", TOWNS)
def test_road_is_as_high_as_its_lanes(name: str) -> None:
    ground = ground_of(name)
    places, _ = lane_points(town_of(name), 1500)
    sheets = len(ground.arrays.origins)
    heights = np.stack([ground.height_at(places[:, :2], sheet) for sheet in range(sheets)])
    away = np.nanmin(np.abs(heights - places[:, 2]), axis=0)
    assert np.quantile(away, 0.99) < 0.08  # on slopes; elsewhere exactly
    assert away.max() < 0.3


@pytest.mark.long
@pytest.mark.parametrize("name", [*TOWNS, pytest.param("northgate", marks=pytest.mark.slow)])
def test_nothing_stands_in_the_way_of_a_car(name: str) -> None:
    places, headings = lane_points(town_of(name), 3000)
    eyes = places + [0.0, 0.0, 0.9]
    ways = np.column_stack((np.cos(headings), np.sin(headings), np.zeros(len(headings))))
    free = distances(ground_of(name).mesh, eyes, ways)
    above = distances(ground_of(name).mesh, eyes, np.tile([0.0, 0.0, 1.0], (len(eyes), 1)))
    assert (free > 1.5).all()
    aside = np.random.default_rng(4).uniform(-1.0, 1.0, (len(eyes), 1)) * np.stack(
        (-ways[:, 1], ways[:, 0], 0.0 * ways[:, 0]), axis=-1
    )
    assert (distances(ground_of(name).mesh, eyes + aside, ways) > 1.0).all()
    assert above.min() > 2.5  # in tunnels and under bridges


def test_pavements_stand_a_kerb_above_the_road() -> None:
    ground = ground_of("brookside")
    rng = np.random.default_rng(3)
    places, _ = lane_points(town_of("brookside"), 4000)
    points = np.ascontiguousarray(places[:, :2] + rng.uniform(-9.0, 9.0, (4000, 2)))
    kinds = np.empty(len(points), dtype=np.uint8)
    materials_at(ground.arrays, 0, points, kinds)
    reliefs = [LOOKS[Material(kind)].relief for kind in kinds.tolist()]
    heights = ground.height_at(points)
    raised = np.array([relief is Relief.RAISED for relief in reliefs])
    flat = np.array([relief is Relief.FLAT for relief in reliefs])
    assert raised.sum() > 500
    assert flat.sum() > 500
    # edges of the mesh are simplified by centimetres
    assert np.isclose(heights[raised], KERB_HEIGHT, atol=1e-3).mean() > 0.99
    assert np.isclose(heights[flat], 0.0, atol=1e-3).mean() > 0.99


def test_pavements_of_a_sunken_road_are_level() -> None:
    ground, town = ground_of("midtown"), town_of("midtown")
    sunken = level = 0
    for walk in town.sidewalks:
        way = np.diff(walk.points[:, :2], axis=0)
        across = np.column_stack((-way[:, 1], way[:, 0])) / np.hypot(*way.T)[:, None]
        middle = (walk.points[1:] + walk.points[:-1]) / 2.0
        heights = np.stack([ground.height_at(middle[:, :2] + side * across) for side in (-0.8, 0.0, 0.8)])
        open_sky = (heights < 0.0).all(axis=0) & (middle[:, 2] < -1.0)  # above tunnels lies the ground of the street
        level += int((np.abs(heights[:, open_sky] - middle[open_sky, 2] - KERB_HEIGHT).max(axis=0) < 0.15).sum())
        sunken += int(open_sky.sum())
    assert sunken > 20
    assert level >= 0.97 * sunken  # a pavement may end at the wall beside the mouth of the tunnel


@pytest.mark.long
def test_pavements_continue_through_a_tunnel() -> None:
    ground, town = ground_of("midtown"), town_of("midtown")
    samples = TownSamples.of(town)
    tunnels = LevelLookup(samples, [part for part in stretches(town, samples) if part.level < 0])
    number = next(k for k, kind in enumerate(ground.arrays.outside.tolist()) if kind == Material.TUNNEL_FLOOR)
    tried = 0
    for walk in town.sidewalks:
        way = np.diff(walk.points[:, :2], axis=0)
        across = np.column_stack((-way[:, 1], way[:, 0])) / np.hypot(*way.T)[:, None]
        middle = (walk.points[1:] + walk.points[:-1]) / 2.0
        inside = tunnels.beside(middle, 8.0)
        middle, across = middle[inside], across[inside]
        for side in (-0.8, 0.0, 0.8):
            places = middle + np.column_stack((side * across, np.zeros(len(across))))
            floor = ground.height_at(places[:, :2], number)
            here = np.isfinite(floor)  # not in the open before the mouth
            np.testing.assert_allclose(floor[here] - places[here, 2], KERB_HEIGHT, atol=0.1)
            kinds = np.empty(int(here.sum()), dtype=np.uint8)
            materials_at(ground.arrays, number, np.ascontiguousarray(places[here, :2]), kinds)
            assert (kinds == Material.PAVEMENT).all()
            heads = places[here] + [0.0, 0.0, 1.8]
            for turn in (-1.0, 1.0):  # nothing between people on it, nor over their heads
                ways = np.column_stack((turn * across[here], np.zeros(int(here.sum()))))
                assert distances(ground.mesh, heads - 0.3 * ways, ways).min(initial=9.0) > 0.4
            assert distances(ground.mesh, heads, np.tile([0.0, 0.0, 1.0], (len(heads), 1))).min(initial=9.0) > 0.5
            tried += int(here.sum())
    assert tried > 30


def test_kerbs_face_the_road() -> None:
    ground = ground_of("brookside")
    faces = ground.mesh.part(ground.mesh.classes == ObjectClass.SIDE_WALK.value)
    middle = faces.corners.mean(axis=1)[:, :2]
    assert (np.abs(faces.normals[:, 2]) < 1e-3).all()
    before = ground.height_at(middle + 0.05 * faces.normals[:, :2])
    behind = ground.height_at(middle - 0.05 * faces.normals[:, :2])
    assert (np.isclose(before, 0.0) & np.isclose(behind, KERB_HEIGHT)).mean() > 0.98


@pytest.mark.parametrize("name", TOWNS)
def test_mesh_is_small(name: str) -> None:
    mesh = ground_of(name).mesh
    assert mesh.size < 40_000
    on_ground = mesh.surfaces & int(Surface.GROUND) != 0
    assert (mesh.normals[on_ground, 2] >= -1e-3).all()


def test_bridges_and_tunnels_are_sheets_of_their_own() -> None:
    ground = ground_of("midtown")
    town = town_of("midtown")
    lowest = min(town.lanes, key=lambda lane: lane.points[:, 2].min())
    at = lowest.points[np.argmin(lowest.points[:, 2]), :2]
    covered = ground.height_at(np.array([at]), 1)
    assert covered[0] == pytest.approx(-5.0, abs=0.05)
    assert np.isnan(ground.height_at(np.array([[1e6, 1e6]]))).all()


def test_ground_is_the_same_when_built_again() -> None:
    first, second = ground_of("brookside"), build_ground(MapLayers(town_of("brookside")))
    for name in Mesh._fields:
        assert getattr(first.mesh, name).tobytes() == getattr(second.mesh, name).tobytes(), name
    for name in GroundArrays._fields:
        assert getattr(first.arrays, name).tobytes() == getattr(second.arrays, name).tobytes(), name


@pytest.mark.long
def test_people_on_bridges_walk_on_the_deck() -> None:
    ground, town = ground_of("Town05"), town_of("Town05")
    points = np.concatenate([walk.points for walk in town.sidewalks])
    above = points[points[:, 2] > 5.0]
    heights = np.stack([ground.height_at(above[:, :2], sheet) for sheet in range(len(ground.arrays.origins))])
    with np.errstate(invalid="ignore"):
        away = np.nanmin(np.abs(heights - above[:, 2]), axis=0)
    assert len(above) > 100
    assert (away < KERB_HEIGHT + 0.1).mean() > 0.97
