"""People where there is no pavement: beside the lanes, and now and then straight across."""

import numpy as np
import pytest

from dorothie_gym.maps import Town
from dorothie_gym.sim.batch.worlds import step_alone
from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.sim.pedestrians.pacing import (
    FROM_JUNCTION,
    KERB,
)
from dorothie_gym.sim.population import add_street_walker, add_vehicle, populate
from dorothie_gym.sim.state.codes import Footway, Walk
from dorothie_gym.sim.state.town_arrays import town_arrays
from dorothie_gym.sim.state.world_arrays import empty_world
from tests.sim.network.towns import find_town, lane, town
from tests.sim.state.states import DT

MAPS = ["brookside", "Town02.xodr", "Town05.xodr"]


def two_way_network(length=160.0):
    """A street to the east with a lane each way and no pavements; y points south."""
    return TownNetwork(town([lane(0, [(0, 2), (length, 2)]), lane(1, [(length, -2), (0, -2)], road=0, number=1)]))


def bare(name):
    full = find_town(name)
    return Town(name="bare", lanes=full.lanes, links=full.links, junctions=full.junctions, streets=full.streets)


@pytest.mark.parametrize("name", MAPS)
def test_street_walks_lie_beside_the_outermost_lanes_and_on_no_other(name):
    network = TownNetwork(find_town(name))
    arrays = town_arrays(network)
    walks = arrays.walks[arrays.walks.kind == Footway.STREET]
    assert len(walks) > 20 and set(arrays.walks.lane[arrays.walks.kind != Footway.STREET]) <= {-1}
    for walk in walks:
        beside = network.town.lanes[walk.lane]
        assert not beside.in_junction and arrays.lanes[beside.id].right < 0
        for x, y, _, _, z, across in arrays.walk_points[walk.first : walk.last + 1]:
            station, lateral = beside.project((x, y))
            assert lateral == pytest.approx(beside.width_at(station) / 2 + KERB, abs=0.1)
            closest = network.get_lane(network.get_closest_lane_index(np.array([x, y]), height=z))
            along, aside = closest.local_coordinates(np.array([x, y]))
            assert abs(aside) > closest.width_at(along) / 2 + KERB / 2 - 0.05
            assert across == 0.0 or FROM_JUNCTION - 0.1 < station < beside.length - FROM_JUNCTION + 0.1


def test_distance_across_the_street_is_the_width_of_lanes_and_kerbs():
    arrays = town_arrays(two_way_network())
    points = arrays.walk_points
    assert points[points[:, 5] > 0.0, 5] == pytest.approx(8.0 + 2 * KERB, abs=0.01)


def test_pedestrians_cross_the_street_and_continue_on_the_other_side():
    network = two_way_network()
    arrays = town_arrays(network)
    world = empty_world(arrays, vehicles=0, pedestrians=1)
    number = add_street_walker(network, arrays, world, 0, 60.0)
    walker = world.pedestrians[number]
    assert (walker.x, walker.y) == pytest.approx((60.0, 4.0 + KERB), abs=0.5)
    sides, strayed = set(), 0
    for _ in range(3000):
        step_alone(arrays, world, 5, DT)
        assert 3.0 < walker.x < 157.0
        strayed += walker.state == Walk.STRAYING
        if walker.state == Walk.WALKING:
            sides.add(arrays.walks.lane[walker.walk])
        else:
            assert FROM_JUNCTION - 1.0 < walker.x < 160.0 - FROM_JUNCTION + 1.0
    assert sides == {0, 1} and strayed > 100
    assert walker.odometer == pytest.approx(3000 * 5 * DT * 1.3, rel=0.05)


def test_no_pedestrian_steps_out_while_a_vehicle_is_close():
    network = two_way_network()
    arrays = town_arrays(network)
    world = empty_world(arrays, vehicles=1, pedestrians=20)
    for station in np.arange(70.0, 110.0, 2.0):
        add_street_walker(network, arrays, world, 0, float(station))
    add_vehicle(arrays, world, 0, 20.0, desired=8.0)
    for _ in range(300):
        world.vehicles[0].x, world.vehicles[0].speed = 20.0, 20.0  # 114 m are too close for that
        step_alone(arrays, world, 1, DT)
        assert not (world.pedestrians.state == Walk.STRAYING).any()


@pytest.mark.parametrize("speed", [4.0, 8.0, 12.0])
def test_vehicle_stops_for_a_straying_pedestrian(speed):
    network = two_way_network()
    arrays = town_arrays(network)
    world = empty_world(arrays, vehicles=1, pedestrians=1)
    number = add_street_walker(network, arrays, world, 1, 80.0)  # comes from the left of vehicles on lane 0
    walker = world.pedestrians[number]
    walker.state, walker.far, walker.pace = Walk.STRAYING, 8.0 + 2 * KERB, 0.6
    add_vehicle(arrays, world, 0, 66.0 - 5.0 * speed, desired=speed)
    world.vehicles[0].speed = speed
    slowest = speed
    for _ in range(900):
        step_alone(arrays, world, 1, DT)
        slowest = min(slowest, float(world.vehicles[0].speed))
        if walker.state != Walk.STRAYING:
            break
    assert walker.state == Walk.WALKING and arrays.walks.lane[walker.walk] == 0
    assert slowest < 0.5 and world.vehicles[0].x < 80.0 and not walker.crashed
    step_alone(arrays, world, 300, DT)
    assert world.vehicles[0].x > 85.0 and not walker.crashed


def test_no_pedestrian_is_added_without_a_footway_or_at_an_occupied_place():
    network = TownNetwork(find_town("brookside"))
    arrays = town_arrays(network)
    world = empty_world(arrays, vehicles=1, pedestrians=2)
    connector = next(k for k in range(len(arrays.lanes)) if arrays.lanes[k].junction >= 0)
    assert add_street_walker(network, arrays, world, connector, 2.0) is None
    street = arrays.walks[np.flatnonzero(arrays.walks.kind == Footway.STREET)[0]]
    assert add_street_walker(network, arrays, world, int(street.lane), 20.0) is not None
    assert add_street_walker(network, arrays, world, int(street.lane), 20.5) is None
    assert add_street_walker(network, arrays, world, int(street.lane), 25.0) is not None
    assert add_street_walker(network, arrays, world, int(street.lane), 30.0) is None  # no room in the world


def test_pedestrians_walk_beside_the_streets_of_a_town_without_pavements():
    network = TownNetwork(bare("brookside"))
    arrays = town_arrays(network)
    world = empty_world(arrays, vehicles=0, pedestrians=8, seed=1)
    populate(network, arrays, world, seed=1, vehicles=0, pedestrians=8)
    assert (world.pedestrians.state == Walk.WALKING).all()
    assert set(arrays.walks.kind[world.pedestrians.walk]) == {Footway.STREET}
    step_alone(arrays, world, 900, DT)
    assert world.pedestrians.odometer.min() > 30.0
