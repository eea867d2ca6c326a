import math

import numpy as np
from highway_env.utils import are_polygons_intersecting
from shapely.geometry import Polygon

from dorothie_gym.ontology import PropKind
from dorothie_gym.sim.batch.worlds import step_alone
from dorothie_gym.sim.collisions import overlap
from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.sim.population import add_prop
from dorothie_gym.sim.state.town_arrays import town_arrays
from dorothie_gym.sim.state.world_arrays import empty_world
from tests.sim.network.towns import overpass_town, straight_town
from tests.sim.state.states import DT, Pose, kernel_world


def random_pairs(count, seed):
    rng = np.random.default_rng(seed)
    for _ in range(count):
        sizes = rng.uniform([0.4, 0.4, 0.4, 0.4], [6.0, 2.5, 6.0, 2.5])
        headings = rng.uniform(-math.pi, math.pi, 2)
        if rng.random() < 0.3:
            headings[1] = headings[0] + rng.choice([0.0, math.pi / 2, math.pi])
        yield rng.uniform(-4.0, 4.0, 2), headings, sizes


def outline(place, heading, length, width):
    c, s = math.cos(heading), math.sin(heading)
    corners = np.array([(-1, -1), (-1, 1), (1, 1), (1, -1), (-1, -1)]) * (length / 2, width / 2)
    return corners @ np.array([(c, s), (-s, c)]) + place


def touches(offset, headings, sizes):
    (c, s), (oc, os) = ((math.cos(h), math.sin(h)) for h in headings)
    return overlap(*offset, c, s, *sizes[:2], oc, os, *sizes[2:])


def test_overlap_equals_highway_envs_polygons_on_5000_pairs():
    hits = 0
    for offset, headings, sizes in random_pairs(5000, seed=3):
        one, other = outline(np.zeros(2), headings[0], *sizes[:2]), outline(offset, headings[1], *sizes[2:])
        expected, _, _ = are_polygons_intersecting(one, other, np.zeros(2), np.zeros(2))
        assert touches(offset, headings, sizes) == expected
        hits += expected
    assert 1000 < hits < 4000


def test_overlap_equals_shapely_on_5000_pairs():
    hits = 0
    for offset, headings, sizes in random_pairs(5000, seed=4):
        one, other = outline(np.zeros(2), headings[0], *sizes[:2]), outline(offset, headings[1], *sizes[2:])
        expected = Polygon(one).intersects(Polygon(other))
        assert touches(offset, headings, sizes) == expected
        hits += expected
    assert 1000 < hits < 4000


def test_all_crashes_of_a_crowd_are_found_and_no_others():
    network = TownNetwork(straight_town(lanes=3, roads=1, length=300.0))
    rng = np.random.default_rng(8)
    for _ in range(10):
        poses = [
            Pose(int(rng.integers(3)), float(rng.uniform(5, 290)), float(rng.normal()), float(rng.normal()), 0.0)
            for _ in range(40)
        ]
        town, world = kernel_world(network, poses)
        vehicles = world.vehicles
        places = np.column_stack((vehicles.x, vehicles.y))
        expected = np.zeros(len(poses), dtype=bool)
        for i in range(len(poses)):
            for j in range(i):
                one = outline(places[i], vehicles[i].heading, 5.0, 2.0)
                other = outline(places[j], vehicles[j].heading, 5.0, 2.0)
                if are_polygons_intersecting(one, other, np.zeros(2), np.zeros(2))[0]:
                    expected[[i, j]] = True
        step_alone(town, world, 1, 0.0)
        assert vehicles.crashed.tolist() == expected.tolist()
        assert 0 < expected.sum() < len(poses)


def test_vehicles_on_a_bridge_do_not_touch_those_below():
    network = TownNetwork(overpass_town())
    town, world = kernel_world(network, [Pose(0, 100.0), Pose(1, network.town.lanes[1].length / 2)])
    assert abs(world.vehicles[0].x - world.vehicles[1].x) < 1.0
    step_alone(town, world, 3, DT)
    assert not world.vehicles.crashed.any()


def test_crashed_vehicle_respawns_elsewhere():
    network = TownNetwork(straight_town())
    town, world = kernel_world(network, [Pose(0, 50.0, speed=5.0), Pose(0, 54.0)])
    step_alone(town, world, 1, DT)
    assert world.vehicles.crashed.all() and world.clock[0].collisions == 1
    before = world.vehicles.x.copy()
    step_alone(town, world, 600, DT)
    assert not world.vehicles.crashed.any() and world.clock[0].towed == 2
    assert (np.abs(world.vehicles.x - before) > 5.0).all()


def test_vehicle_placed_inside_a_prop_crashes():
    network = TownNetwork(straight_town())
    town = town_arrays(network)
    world = empty_world(town, vehicles=1, pedestrians=0)
    _, placed = kernel_world(network, [Pose(0, 50.0)])
    world.vehicles[0] = placed.vehicles[0]
    add_prop(network, town, world, PropKind.DUMPSTER, 0, 51.0)
    step_alone(town, world, 1, DT)
    assert world.vehicles[0].crashed
