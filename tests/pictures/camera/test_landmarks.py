"""Landmarks: recognisable at 40 m, off the roads, and equal whether they are goals or not."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest
import shapely

from dorothie_gym.maps.catalogue import load_town, town_names
from dorothie_gym.maps.model import Array
from dorothie_gym.ontology import LandmarkName, ObjectClass
from dorothie_gym.pictures.camera.atlas import BRAND_SIGNS, Texture
from dorothie_gym.pictures.camera.mesh import Mesh, Surface
from dorothie_gym.pictures.camera.scenery.clearance import Clearance
from dorothie_gym.pictures.camera.scenery.landmarks import build_landmarks, landmark_form, landmark_key
from dorothie_gym.pictures.camera.scenery.lots import Lot
from dorothie_gym.pictures.camera.scenery.placing import FlatGround
from dorothie_gym.pictures.maps.map_layers import MapLayers
from dorothie_gym.pictures.maps.shapes import ribbon
from dorothie_gym.sim.network.network import network_of
from dorothie_gym.sim.state.town_arrays import town_arrays
from dorothie_gym.tasks.storyboard import Landmark

NAMES = [*BRAND_SIGNS, LandmarkName.HOUSE, LandmarkName.PERSON]
SIZES = [(20.0, 15.0), (10.0, 8.0), (4.0, 4.0)]


def lot(length: float = 20.0, depth: float = 15.0) -> Lot:
    """A lot 10 m to the right of a street along x."""
    return Lot(0, (40.0, 9.6), math.pi / 2.0, (40.0, 10.0), length, depth, 0)


def landmark(index: int, name: LandmarkName, site: int, *, hidden: bool = False, label: str = "House 1") -> Landmark:
    return Landmark(
        index=index, name=name, label=label, category="x", site=site, lane=0, station=0.0, position=(0.0, 0.0),
        waypoint=(0.0, 0.0), street=0, hidden=hidden,
    )  # fmt: skip


@cache
def lots_of(name: str) -> tuple[Lot, ...]:
    return Clearance(MapLayers(load_town(name))).lots


def pixels(mesh: Mesh, textures: set[int], eye: tuple[float, float, float], heading: float) -> Array:
    """Returns width and height [px] of the panels with textures in a picture of 480 pixels and 90 degrees."""
    corners = mesh.corners[np.isin(mesh.textures, list(textures))].reshape(-1, 3).astype(float) - eye
    normals = np.repeat(mesh.normals[np.isin(mesh.textures, list(textures))], 3, axis=0)
    corners = corners[(normals * corners).sum(axis=1) < 0.0]
    forward = corners[:, 0] * math.cos(heading) + corners[:, 1] * math.sin(heading)
    right = -corners[:, 0] * math.sin(heading) + corners[:, 1] * math.cos(heading)
    return np.array([np.ptp(240.0 * right / forward), np.ptp(240.0 * corners[:, 2] / forward)])


@pytest.mark.parametrize("name", BRAND_SIGNS)
@pytest.mark.parametrize("size", SIZES)
def test_the_name_of_a_brand_is_seen_from_40_metres_up_and_down_the_street(
    name: LandmarkName, size: tuple[float, float]
) -> None:
    mesh = landmark_form(name, lot(*size), FlatGround())
    texture = {int(BRAND_SIGNS[name][0])}
    for eye, heading in (((0.0, 2.0, 1.4), 0.0), ((80.0, 2.0, 1.4), math.pi)):
        width, height = pixels(mesh, texture, eye, heading)
        assert width > 28.0
        assert height > 6.5


@pytest.mark.parametrize(
    ("name", "sign"), [(LandmarkName.HOUSE, Texture.HOUSE_SIGN), (LandmarkName.PERSON, Texture.PERSON_SIGN)]
)
def test_houses_and_persons_have_a_cue_of_more_than_16_pixels_at_40_metres(name: LandmarkName, sign: Texture) -> None:
    for size in SIZES:
        mesh = landmark_form(name, lot(*size), FlatGround())
        for eye, heading in (((0.0, 2.0, 1.4), 0.0), ((80.0, 2.0, 1.4), math.pi)):
            assert (pixels(mesh, {int(sign)}, eye, heading) > 15.5).all()


@pytest.mark.parametrize("name", [LandmarkName.HOUSE, LandmarkName.PERSON])
def test_nothing_shows_which_house_or_person_is_a_goal(name: LandmarkName) -> None:
    lots = (lot(),)
    known = build_landmarks([landmark(0, name, 0, label="House 1")], lots, FlatGround())
    goal = build_landmarks([landmark(3, name, 0, hidden=True, label="House 2")], lots, FlatGround())
    for column, other in zip(known._replace(instances=goal.instances), goal, strict=True):
        np.testing.assert_array_equal(column, other)
    letters = {int(texture) for texture, *_ in BRAND_SIGNS.values()} | set(range(len(Texture), 99))
    assert not letters & set(known.textures.tolist())


def test_triangles_carry_the_key_of_their_landmark() -> None:
    pair = [landmark(0, LandmarkName.KFC, 0), landmark(5, LandmarkName.PERSON, 0)]
    mesh = build_landmarks(pair, (lot(),), FlatGround())
    assert set(mesh.instances.tolist()) == {landmark_key(0), landmark_key(5)} == {-1, -6}
    person = mesh.part(mesh.instances == -6)
    assert ObjectClass.PEDESTRIAN.value in person.classes


@pytest.mark.parametrize("name", BRAND_SIGNS)
def test_signs_are_not_mirrored(name: LandmarkName) -> None:
    mesh = landmark_form(name, lot(), FlatGround())
    shown = mesh.textures == int(BRAND_SIGNS[name][0])
    for u_axis, v_axis, normal in zip(mesh.u_axes[shown], mesh.v_axes[shown], mesh.normals[shown], strict=True):
        look = math.atan2(-normal[1], -normal[0])
        assert u_axis[:3] @ (-math.sin(look), math.cos(look), 0.0) > 0.0
        assert v_axis[2] > 0.0
    assert (mesh.surfaces[shown] == Surface.EMISSIVE.value).all()  # names are lit at night
    assert shown.sum() >= 6


@pytest.mark.long
@pytest.mark.parametrize("town", town_names())
def test_landmarks_stand_on_no_road_and_no_footway(town: str) -> None:
    loaded = load_town(town)
    arrays = town_arrays(network_of(loaded))
    lines = [arrays.walk_points[way.first : way.last + 1, :2] for way in arrays.walks if way.length > 0.0]
    kept = [shapely.Polygon(ribbon(lane)).buffer(0.0) for lane in loaded.lanes]
    tree = shapely.STRtree([*kept, *(shapely.LineString(line).buffer(0.3) for line in lines)])
    for place in lots_of(town):
        for name in NAMES:
            mesh = landmark_form(name, place, FlatGround())
            low = mesh.corners[..., 2].min(axis=1) < 2.2
            low &= mesh.classes != ObjectClass.PEDESTRIAN.value
            feet = shapely.MultiPoint(mesh.corners[low][..., :2].reshape(-1, 2)).convex_hull
            assert not len(tree.query(feet, predicate="intersects"))


def test_a_landmark_on_a_slope_leaves_no_gap_below() -> None:
    class Hill:
        def height_at(self, points: Array) -> Array:
            return np.asarray(0.1 * points[:, 0])

    for name in BRAND_SIGNS:
        mesh = landmark_form(name, lot(), Hill())
        assert mesh.corners[..., 2].min() < 0.1 * 30.0
