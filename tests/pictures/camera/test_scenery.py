"""Scenery: nothing stands where people walk or cars drive, and camera, map and lights agree."""

from __future__ import annotations

import hashlib
import itertools
import math
import subprocess
import sys
from functools import cache

import numpy as np
import pytest
import shapely

from dorothie_gym.maps.catalogue import load_town, town_names
from dorothie_gym.maps.model import Array, SignalKind
from dorothie_gym.ontology import ObjectClass
from dorothie_gym.pictures import palette
from dorothie_gym.pictures.camera.atlas import STREET_NAMES, Texture
from dorothie_gym.pictures.camera.ground.arrays import ground_arrays
from dorothie_gym.pictures.camera.ground.lookup import GROUND_SHEET, material_at
from dorothie_gym.pictures.camera.ground.materials import LOOKS, Material
from dorothie_gym.pictures.camera.ground.sheets import town_sheets
from dorothie_gym.pictures.camera.mesh import MeshBuilder, Surface
from dorothie_gym.pictures.camera.scenery.buildings import Building, Style, build_buildings, plan_buildings
from dorothie_gym.pictures.camera.scenery.clearance import Clearance, free_of
from dorothie_gym.pictures.camera.scenery.guard_rails import BESIDE, build_rails, rail_lines
from dorothie_gym.pictures.camera.scenery.houses import house_look
from dorothie_gym.pictures.camera.scenery.lawns import build_lawns
from dorothie_gym.pictures.camera.scenery.placing import FlatGround, stamped
from dorothie_gym.pictures.camera.scenery.signals import build_signals
from dorothie_gym.pictures.camera.scenery.street_lamps import build_lamps, lamp_places, lot_lamps
from dorothie_gym.pictures.camera.scenery.street_signs import build_blades, plan_blades
from dorothie_gym.pictures.camera.scenery.town_scenery import Scenery, build_scenery
from dorothie_gym.pictures.camera.scenery.trees import build_trees, tree_places
from dorothie_gym.pictures.maps.map_layers import MapLayers
from dorothie_gym.pictures.maps.shapes import ribbon
from dorothie_gym.sim.network.network import network_of
from dorothie_gym.sim.state.codes import Colour
from dorothie_gym.sim.state.town_arrays import town_arrays

MARKS = {"brookside": (), "midtown": (), "northgate": pytest.mark.slow}  # the largest
TOWNS = [pytest.param(name, marks=MARKS.get(name, pytest.mark.long)) for name in town_names()]


@cache
def layers_of(name: str) -> MapLayers:
    return MapLayers(load_town(name))


@cache
def clearance_of(name: str) -> Clearance:
    return Clearance(layers_of(name))


@cache
def buildings_of(name: str) -> list[Building]:
    return plan_buildings(layers_of(name), clearance_of(name))


@cache
def scenery_of(name: str) -> Scenery:
    return build_scenery(layers_of(name), FlatGround())


def footways(name: str) -> list[shapely.Polygon]:
    """The ways of the simulation's pedestrians, with the room that they take."""
    arrays = town_arrays(network_of(load_town(name)))
    lines = [arrays.walk_points[way.first : way.last + 1, :2] for way in arrays.walks if way.length > 0.0]
    return [shapely.LineString(line).buffer(0.6) for line in lines]


@pytest.mark.long
@pytest.mark.parametrize("name", TOWNS)
def test_buildings_stand_on_no_road_pavement_footway_or_site(name: str) -> None:
    ground = shapely.STRtree([shapely.Polygon(building.outline) for building in buildings_of(name)])
    town = load_town(name)
    roads = [shapely.Polygon(ribbon(lane, 1.0)).buffer(0.0) for lane in town.lanes]
    pavements = [shapely.LineString(walk.points[:, :2]).buffer(walk.width / 2.0) for walk in town.sidewalks]
    sites = [shapely.Point(site.position).buffer(3.0) for site in town.sites]
    views = [shapely.LineString([site.position, site.waypoint]) for site in town.sites]
    for kept in (roads, pavements, footways(name), sites, views):
        assert not len(ground.query(kept, predicate="intersects")[0])


@pytest.mark.parametrize("name", TOWNS)
def test_buildings_line_the_streets_without_touching_each_other(name: str) -> None:
    buildings = buildings_of(name)
    ground = [shapely.Polygon(building.outline).buffer(-0.01) for building in buildings]
    first, second = shapely.STRtree(ground).query(ground, predicate="intersects")
    assert (first == second).all()
    assert len(buildings) > 30
    assert len({building.style for building in buildings}) >= 3


@pytest.mark.parametrize("name", TOWNS)
def test_buildings_spare_the_trees_and_parks_of_the_map(name: str) -> None:
    ground = shapely.STRtree([shapely.Polygon(building.outline) for building in buildings_of(name)])
    drawn = [shape for shape in layers_of(name).shapes if shape.colour in (palette.TREE, palette.COUNTRY_TREE)]
    assert not len(ground.query([shapely.Polygon(shape.points) for shape in drawn], predicate="intersects")[0])


@pytest.mark.parametrize("name", TOWNS)
def test_crowns_are_where_and_as_wide_as_on_the_map(name: str) -> None:
    layers = layers_of(name)
    places = tree_places(layers)
    kinds = palette.TREE, palette.COUNTRY_TREE, palette.MEDIAN_TREE
    drawn = sum(shape.colour in kinds for shape in layers.shapes)
    assert 0.9 * drawn < len(places) <= drawn
    lanes = shapely.STRtree([shapely.Polygon(ribbon(lane)).buffer(0.0) for lane in layers.town.lanes])
    assert not len(lanes.query(shapely.points(places[:, :2]), predicate="intersects")[0])  # others are under a road
    mesh = build_trees(layers, FlatGround())
    crowns = mesh.corners[mesh.surfaces == Surface.LEAF].reshape(-1, 3)[:, :2].astype(float)
    for x, y, radius in places[:: max(1, len(places) // 10)]:
        away = np.hypot(*(crowns - (x, y)).T)
        near = away[away < radius + 0.6]
        assert near.max() == pytest.approx(radius, rel=0.15)


@pytest.mark.parametrize("name", TOWNS)
def test_street_lamps_stand_beside_the_roads_and_shine_on_them(name: str) -> None:
    places = lamp_places(layers_of(name), clearance_of(name))
    lanes = [shapely.Polygon(ribbon(lane)).buffer(0.0) for lane in load_town(name).lanes]
    tree = shapely.STRtree(lanes)
    assert len(places) > 20
    assert not len(tree.query(shapely.points(places[:, :2]), predicate="intersects")[0])
    _, lights = build_lamps(places, FlatGround())
    over = np.unique(tree.query(shapely.points(lights[:, :2]), predicate="intersects")[0])
    assert len(over) > 0.95 * len(places)


@pytest.mark.long
@pytest.mark.parametrize("name", TOWNS)
def test_each_light_of_the_map_has_three_lenses_with_its_signal(name: str) -> None:
    layers = layers_of(name)
    posts = [post for post in layers.posts if post.kind is SignalKind.TRAFFIC_LIGHT]
    scenery = scenery_of(name)
    lenses = scenery.lenses
    assert len(lenses.signals) >= 3 * len(posts)
    programmed = {number for programme in layers.town.programmes for number in programme.signals}
    assert set(lenses.signals.tolist()) == {s.id for s in layers.town.signals if s.id in programmed}
    lanes = {signal.id: signal.lanes for signal in layers.town.signals}
    for post, k in zip(posts, range(0, len(lenses.signals), 3), strict=False):
        assert lanes[int(lenses.signals[k])] == post.lanes
        heights = {}
        for row in range(k, k + 3):
            part = scenery.signals.part(slice(*lenses.ranges[row].tolist()))
            assert set(part.classes.tolist()) == {ObjectClass.TRAFFIC_LIGHT.value}
            middle = part.corners.reshape(-1, 3).mean(axis=0)
            assert math.hypot(middle[0] - post.at[0], middle[1] - post.at[1]) < 0.6
            heights[Colour(int(lenses.colours[row]))] = middle[2]
            lane = layers.town.lanes[post.lanes[0]]
            looks = np.array([math.cos(lane.headings[-1]), math.sin(lane.headings[-1])])
            assert (part.normals[:, :2] @ looks < -0.9).all()  # it faces the cars that wait for it
        assert heights[Colour.RED] > heights[Colour.YELLOW] > heights[Colour.GREEN]


@pytest.mark.long
@pytest.mark.parametrize("name", ["midtown", pytest.param("northgate", marks=pytest.mark.slow)])
def test_the_first_car_in_a_queue_sees_its_light(name: str) -> None:
    """Most lanes that go straight on have a light in view from their stop line, which shows their signal."""
    layers, scenery = layers_of(name), scenery_of(name)
    lenses = scenery.lenses
    middles = np.array([scenery.signals.corners[low:high].mean(axis=(0, 1)) for low, high in lenses.ranges.tolist()])
    looks = np.array([-scenery.signals.normals[low] for low, _ in lenses.ranges.tolist()])
    seen = []
    for post in layers.posts:
        if post.kind is not SignalKind.TRAFFIC_LIGHT or not any(
            abs(e.angle) < 20 for k in post.lanes for e in layers.town.exits(k)
        ):
            continue
        lane = layers.town.lanes[post.lanes[0]]
        station = layers.stops.get(lane.id, lane.length) - 2.0
        eye, heading = lane.position(station), lane.heading_at(station)
        way = middles[:, :2] - eye
        forward = way @ (math.cos(heading), math.sin(heading))
        right = way @ (-math.sin(heading), math.cos(heading))
        high = np.abs(middles[:, 2] - 1.4) < 0.6 * forward
        in_view = (np.abs(right) < 0.95 * forward) & high & (forward < 80.0)
        in_view &= (looks[:, :2] * way).sum(axis=1) > 0.5 * np.hypot(*way.T)
        lanes = {s.id for s in layers.town.signals if s.lanes == post.lanes}
        seen.append(bool((in_view & np.isin(lenses.signals, list(lanes))).any()))
    assert np.mean(seen) > 0.9


def test_lights_and_signs_of_the_map_stand_at_its_posts() -> None:
    layers = layers_of("midtown")
    mesh, _ = build_signals(layers, clearance_of("midtown"), FlatGround())
    signs = mesh.corners[mesh.textures == Texture.STOP].reshape(-1, 3)[:, :2].astype(float)
    for post in layers.posts:
        if post.kind is SignalKind.STOP:
            assert np.hypot(*(signs - post.at).T).min() < 0.6


@pytest.mark.parametrize("name", TOWNS)
def test_blades_name_the_street_of_the_approach_and_are_read_from_it(name: str) -> None:
    layers = layers_of(name)
    blades = plan_blades(layers, clearance_of(name))
    assert len(blades) >= 8
    mesh = build_blades(layers, blades, FlatGround())
    shown = mesh.textures[mesh.classes == ObjectClass.TRAFFIC_SIGN.value] - STREET_NAMES
    assert set(shown.tolist()) == {street for blade in blades for street, _ in blade.names}
    assert set(shown.tolist()) <= {street.id for street in layers.town.streets}
    named = mesh.textures >= STREET_NAMES
    for u_axis, normal in zip(mesh.u_axes[named][:40], mesh.normals[named][:40], strict=True):
        look = math.atan2(-normal[1], -normal[0])
        right = np.array([-math.sin(look), math.cos(look), 0.0])
        assert u_axis[:3] @ right > 0.3  # not mirrored


@pytest.mark.parametrize("name", TOWNS)
def test_each_site_has_a_lot_of_its_own_beside_it(name: str) -> None:
    town, lots = load_town(name), clearance_of(name).lots
    ground = [shapely.box(0.0, 0.0, lot.length, lot.depth) for lot in lots]
    assert [lot.site for lot in lots] == [site.id for site in town.sites]
    assert min(shape.area for shape in ground) >= 16.0
    for lot, site in zip(lots, town.sites, strict=True):
        assert math.dist(lot.front, site.position) <= 9.01
        towards = np.array(site.waypoint) - lot.front
        assert towards @ (math.cos(lot.heading), math.sin(lot.heading)) < 0.0  # its front faces the road


@pytest.mark.parametrize("name", TOWNS)
def test_no_building_hides_a_landmark_from_a_car_40_metres_before_it(name: str) -> None:
    town, lots = load_town(name), clearance_of(name).lots
    ground = shapely.STRtree([shapely.Polygon(building.outline) for building in buildings_of(name)])
    tried = 0
    for site, lot in zip(town.sites, lots, strict=True):
        lane = town.lanes[site.lane]
        if site.station < 40.0:
            continue
        eye = lane.position(site.station - 40.0)
        sides = [lot.at(0.0, side) for side in (-lot.length / 2.0 - 0.9, lot.length / 2.0 + 0.9)]
        near = min(sides, key=lambda side: float(np.hypot(*(eye - side))))
        assert not len(ground.query(shapely.LineString(np.array([eye, near])), predicate="intersects"))
        tried += 1
    assert tried > 5


def test_buildings_stand_on_slopes_without_gaps() -> None:
    class Hill:
        def height_at(self, points: Array) -> Array:
            return np.asarray(0.2 * points[:, 0])

    house = Building((50.0, 20.0), 0.4, 12.0, 9.0, 2, Style.HOUSE, False, 3)
    mesh = build_buildings([house], Hill())
    foot = mesh.corners[..., 2].min()
    assert foot < Hill().height_at(house.outline).min()
    assert mesh.corners[..., 2].max() > Hill().height_at(house.outline).max() + 2 * 3.2


def test_ground_that_ends_leaves_no_gaps_in_positions() -> None:
    class Island:
        def height_at(self, points: Array) -> Array:
            return np.where(np.hypot(*points.T) < 100.0, 3.0, np.nan)

    scenery = build_scenery(layers_of("brookside"), Island())
    for mesh in (scenery.mesh, scenery.signals):
        assert np.isfinite(mesh.corners).all()


def test_stamps_turn_and_scale_a_mesh_with_its_texture() -> None:
    builder = MeshBuilder()
    builder.panel((1.0, 0.0, 1.0), 0.0, 2.0, 1.0, colour=(100, 100, 100), kind=ObjectClass.TRAFFIC_SIGN, texture=3)
    template = builder.build()
    mesh = stamped(
        template,
        np.array([[5.0, 0.0, 0.0], [0.0, 9.0, 2.0]]),
        np.array([0.0, math.pi / 2.0]),
        np.array([1.0, 2.0]),
        np.array([[1.0, 1.0, 1.0], [0.5, 1.0, 2.0]]),
    )
    np.testing.assert_allclose(mesh.corners[:2], template.corners + (5.0, 0.0, 0.0), atol=1e-6)
    np.testing.assert_allclose(mesh.corners[2:].reshape(-1, 3).mean(axis=0)[1], 9.0 + 2.0, atol=1e-5)
    np.testing.assert_allclose(mesh.normals[2:], [[0.0, -1.0, 0.0]] * 2, atol=1e-6)
    right = np.array([-1.0, 0.0, 0.0])  # of somebody who looks south
    np.testing.assert_allclose(mesh.u_axes[2:, :3] @ right, 0.25, atol=1e-6)
    assert mesh.colours[2].tolist() == [50, 100, 200]


@pytest.mark.long
def test_a_town_has_few_triangles_and_the_same_bytes_in_another_process() -> None:
    mesh = scenery_of("midtown").mesh
    assert 15_000 < mesh.size < 40_000
    digest = hashlib.sha256(b"".join(column.tobytes() for column in mesh)).hexdigest()
    program = (
        "import hashlib; from dorothie_gym.pictures.camera.scenery.placing import FlatGround;"
        "from dorothie_gym.pictures.camera.scenery.town_scenery import build_scenery;"
        "from dorothie_gym.maps.catalogue import load_town;"
        "from dorothie_gym.pictures.maps.map_layers import MapLayers;"
        "mesh = build_scenery(MapLayers(load_town('midtown')), FlatGround()).mesh;"
        "print(hashlib.sha256(b''.join(c.tobytes() for c in mesh)).hexdigest())"
    )
    other = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout.strip()
    assert other == digest


@pytest.mark.parametrize("name", TOWNS)
def test_no_lamp_or_light_stands_on_asphalt(name: str) -> None:
    layers, clearance = layers_of(name), clearance_of(name)
    lamps = np.concatenate((lamp_places(layers, clearance), lot_lamps(clearance)))[:, :2]
    mesh, _ = build_signals(layers, clearance, FlatGround())
    poles = mesh.corners[mesh.classes == ObjectClass.POLE.value].reshape(-1, 3)[:, :2].astype(float)
    own = np.array([post.at for post in layers.posts]).reshape(-1, 2)
    if len(own):
        poles = poles[np.hypot(*(poles[:, None] - own).transpose(2, 0, 1)).min(axis=1) > 0.3]
    sheet = ground_arrays(town_sheets(MapLayers(load_town(name))))
    for feet in (lamps, poles):
        kinds = [LOOKS[Material(material_at(sheet, GROUND_SHEET, x, y))].kind for x, y in feet.tolist()]
        assert ObjectClass.ROAD not in kinds
        assert ObjectClass.ROAD_LINE not in kinds


@pytest.mark.parametrize("name", TOWNS)
def test_most_lots_are_lit_at_night(name: str) -> None:
    clearance = clearance_of(name)
    _, lights = build_lamps(lot_lamps(clearance), FlatGround())
    near = [np.hypot(*(lights[:, :2] - lot.front).T).min() < lot.length / 2.0 + 4.0 for lot in clearance.lots]
    assert np.mean(near) > 0.9


def test_rails_stand_where_the_ground_beside_a_road_is_much_lower() -> None:
    class Plateau:
        def height_at(self, points: Array) -> Array:
            return np.where(points[:, 0] > 0.0, -5.0, 0.0)

    layers, clearance = layers_of("brookside"), clearance_of("brookside")
    assert rail_lines(layers, clearance, FlatGround()) == []
    lines = rail_lines(layers, clearance, Plateau())
    assert lines
    for line in lines:
        assert not clearance.on_asphalt(line[:, :2]).any()
        assert not clearance.on_footway(line[:, :2]).any()
        assert line[:, 0].max() > -BESIDE - 8.0
    mesh = build_rails(lines)
    assert set(mesh.classes.tolist()) == {ObjectClass.GUARD_RAIL.value}


@pytest.mark.parametrize("name", [*TOWNS, pytest.param("generated:5", marks=pytest.mark.slow)])
def test_two_houses_near_each_other_differ_in_two_of_colour_storeys_roof_and_garden(name: str) -> None:
    looks = [(house_look(row.tone), row) for row in buildings_of(name) if row.style is Style.HOUSE]
    described = [(look.wall, row.storeys, (look.roof, look.tiles), look.garden) for look, row in looks]
    pairs = [
        sum(one != other for one, other in zip(described[k], described[i], strict=True))
        for k, i in itertools.combinations(range(len(looks)), 2)
        if math.dist(looks[k][1].centre, looks[i][1].centre) < 150.0
    ]
    assert len(pairs) > 20
    assert np.mean(np.array(pairs) >= 2) >= 0.93  # of few pairs; of all towns together 0.98


@pytest.mark.parametrize("name", TOWNS)
def test_most_houses_have_a_garden_and_lawns_have_shrubs(name: str) -> None:
    buildings, clearance = buildings_of(name), clearance_of(name)
    mesh = build_lawns(layers_of(name), clearance, buildings, FlatGround())
    places = mesh.corners.astype(float).mean(axis=1)[:, :2]
    outlines = [shapely.Polygon(row.outline).buffer(4.0) for row in buildings if row.style is Style.HOUSE]
    points = shapely.MultiPoint(places)
    assert np.mean([outline.intersects(points) for outline in outlines]) > 0.75
    assert set(mesh.classes.tolist()) <= {ObjectClass.VEGETATION.value, ObjectClass.FENCE.value}
    assert free_of(np.array(points.geoms, dtype=object), clearance.ways).all()
    apart = shapely.STRtree([shapely.Polygon(row.outline).buffer(4.0) for row in buildings])
    shrubs = free_of(np.array(points.geoms, dtype=object), apart)
    assert shrubs.sum() > 20 * 25  # triangles of some shrubs away from buildings
    again = build_lawns(layers_of(name), clearance, buildings, FlatGround())
    np.testing.assert_array_equal(mesh.corners, again.corners)
