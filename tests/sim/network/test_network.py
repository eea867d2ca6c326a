import copy
import pickle

import numpy as np
import pytest
from highway_env.road.lane import LineType, StraightLane
from highway_env.road.road import RoadNetwork
from highway_env.vehicle.controller import ControlledVehicle

from dorothie_gym.maps import LinkType, Town
from dorothie_gym.sim.network.lane import PolylineLane
from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.sim.road import TownRoad

from .towns import (
    EAST_OUT,
    EVERY_TOWN,
    SOUTH_OUT,
    WEST_EAST,
    WEST_IN,
    WEST_SOUTH,
    bend,
    find_town,
    lane,
    straight_town,
    t_junction_town,
    town,
)


@pytest.fixture(scope="module", params=EVERY_TOWN)
def network(request):
    return TownNetwork(find_town(request.param))


def test_every_lane_is_in_the_graph_once(network):
    indexes = network.lanes_dict()
    assert len(indexes) == len(network.town.lanes)
    for index, found in indexes.items():
        assert network.index_of(network.lane_id(index)) == index
        assert network.lane_of(network.lane_id(index)) is network.get_lane(index) is found
        assert isinstance(found, PolylineLane)


def test_linked_lanes_share_a_node(network):
    for link in network.town.links:
        source, target = network.index_of(link.source), network.index_of(link.target)
        if not link.type.is_lane_change:
            assert source[1] == target[0]
            assert target in network.successors(source)
            assert source in network.predecessors(target)


def test_lanes_with_lane_changes_are_one_edge_from_left_to_right(network):
    for link in network.town.links:
        if link.type is LinkType.LANE_CHANGE_RIGHT:
            left, right = network.index_of(link.source), network.index_of(link.target)
            assert left[:2] == right[:2]
            assert left[2] < right[2]


def test_side_lanes_are_those_of_the_lane_change_links(network):
    for index in network.lanes_dict():
        lane_id = network.lane_id(index)
        sides = [network.town.neighbour(lane_id, t) for t in (LinkType.LANE_CHANGE_LEFT, LinkType.LANE_CHANGE_RIGHT)]
        assert [network.lane_id(side) for side in network.side_lanes(index)] == [s for s in sides if s is not None]


def test_next_lane_is_always_a_linked_one(network):
    rng = np.random.default_rng(0)
    for index in network.lanes_dict():
        onward = [link.target for link in network.town.successors(network.lane_id(index))]
        following = network.next_lane(index, route=None, position=np.zeros(2), np_random=rng)
        assert network.lane_id(following) in onward if onward else following == index


def test_side_by_side_lanes_make_one_edge():
    network = TownNetwork(straight_town(lanes=3, roads=2))
    assert network.index_of(0)[:2] == network.index_of(2)[:2]
    assert [network.index_of(i)[2] for i in range(3)] == [0, 1, 2]
    assert network.side_lanes(network.index_of(1)) == [network.index_of(0), network.index_of(2)]
    assert network.all_side_lanes(network.index_of(1)) == [network.index_of(i) for i in range(3)]


def test_opposite_lanes_and_lanes_of_different_length_stay_apart():
    opposite = town([lane(0, [(0, 2), (50, 2)]), lane(1, [(50, -2), (0, -2)], number=1)])
    assert TownNetwork(opposite).index_of(0)[:2] != TownNetwork(opposite).index_of(1)[:2]
    pocket = town([lane(0, [(0, 2), (50, 2)]), lane(1, [(30, 6), (50, 6)], number=-2)])
    assert TownNetwork(pocket).index_of(0)[:2] != TownNetwork(pocket).index_of(1)[:2]


def test_connectors_that_fan_out_to_one_road_are_ordered_from_left_to_right():
    straight, right = bend((50, 0), (60, 0), (70, 0)), bend((50, 0), (60, 2), (70, 4))
    lanes = [
        lane(0, [(0, 0), (50, 0)]),
        lane(1, right, road=1, junction=1),
        lane(2, straight, road=2, junction=1),
        lane(3, [(70, 0), (90, 0)], road=3),
        lane(4, [(70, 4), (90, 4)], road=3, number=-2),
    ]
    links = [(0, 1, "right"), (0, 2, "straight"), (1, 4, "straight"), (2, 3, "straight")]
    network = TownNetwork(town(lanes, [(a, b, LinkType(kind)) for a, b, kind in links]))
    assert network.index_of(1)[:2] == network.index_of(2)[:2]
    assert network.index_of(2)[2] < network.index_of(1)[2]


def test_next_lane_follows_the_route():
    network = TownNetwork(t_junction_town())
    start = network.index_of(WEST_IN)
    for connector, out in ((WEST_EAST, EAST_OUT), (WEST_SOUTH, SOUTH_OUT)):
        route = [start, (*network.index_of(connector)[:2], None), network.index_of(out)]
        first = network.next_lane(start, route=route, position=np.zeros(2))
        assert network.lane_id(first) == connector
        assert network.lane_id(network.next_lane(first, route=route, position=np.zeros(2))) == out


def test_next_lane_without_a_usable_route_is_drawn_from_the_links():
    network = TownNetwork(t_junction_town())
    start = network.index_of(WEST_IN)
    astray = [network.index_of(SOUTH_OUT)]
    rng = np.random.default_rng(0)
    for source in (rng, np.random.RandomState(0), np.random):
        drawn = {network.lane_id(network.next_lane(start, list(astray), np.zeros(2), source)) for _ in range(40)}
        assert drawn == {WEST_EAST, WEST_SOUTH}


def test_lane_without_continuation_is_kept():
    network = TownNetwork(t_junction_town())
    end = network.index_of(EAST_OUT)
    assert network.next_lane(end, position=np.zeros(2)) == end


def test_lane_on_the_next_road_is_the_linked_one():
    network = TownNetwork(straight_town(lanes=3, roads=2))
    (start, end, _), (_, goal, _) = network.index_of(0), network.index_of(3)
    far_right = np.array([100.0, 8.0])
    chosen, distance = network.next_lane_given_next_road(start, end, 1, goal, None, far_right)
    assert (chosen, distance) == (1, 4.0)
    assert network.next_lane_given_next_road(start, end, 1, goal, 2, far_right)[0] == 1


def test_paths_and_connections_work_as_inherited():
    network = TownNetwork(t_junction_town())
    start, goal = network.index_of(WEST_IN)[0], network.index_of(SOUTH_OUT)[1]
    path = network.shortest_path(start, goal)
    assert path == next(network.bfs_paths(start, goal)) == RoadNetwork.shortest_path(network, start, goal)
    assert len(path) == 4
    assert network.is_connected_road(network.index_of(WEST_IN), network.index_of(WEST_SOUTH), depth=1)
    assert network.is_connected_road(network.index_of(WEST_IN), network.index_of(SOUTH_OUT), depth=2)
    assert not network.is_connected_road(network.index_of(SOUTH_OUT), network.index_of(WEST_IN), depth=2)


def test_shortest_path_equals_highway_envs(network):
    rng = np.random.default_rng(0)
    nodes = sorted(network.graph)
    for _ in range(30):
        start = str(rng.choice(nodes))
        goal = start
        for _ in range(3):  # a goal near enough for the stock search
            goal = str(rng.choice(sorted(network.graph.get(goal, {goal: []}))))
        if goal != start:
            assert network.shortest_path(start, goal) == RoadNetwork.shortest_path(network, start, goal)
    assert network.shortest_path(nodes[0], nodes[0]) == []
    assert network.shortest_path(nodes[0], "nowhere") == []


def test_vehicle_plans_a_route_across_town():
    network = TownNetwork(t_junction_town())
    road = TownRoad(network)
    vehicle = ControlledVehicle(road, [-80.0, 2.0], 0.0, 5.0)
    vehicle.plan_route_to(network.index_of(SOUTH_OUT)[1])
    edges = [network.index_of(i)[:2] for i in (WEST_IN, WEST_SOUTH, SOUTH_OUT)]
    assert [leg[:2] for leg in vehicle.route] == edges


def test_random_lanes_are_drawn_from_all_and_repeatable(network):
    drawn = [network.random_lane_index(np.random.default_rng(seed)) for seed in range(20)]
    assert drawn == [network.random_lane_index(np.random.default_rng(seed)) for seed in range(20)]
    assert all(index in network.lanes_dict() for index in drawn)


def test_config_gives_the_same_graph(network):
    plain = TownNetwork.from_config(network.to_config())
    assert list(plain.lanes_dict()) == list(network.lanes_dict())
    rng = np.random.default_rng(0)
    low, high = network.table.boxes[:, :2].min(axis=0), network.table.boxes[:, 2:].max(axis=0)
    for place in rng.uniform(low, high, size=(20, 2)):
        assert plain.get_closest_lane_index(place) == network.get_closest_lane_index(place)


def test_network_is_complete_when_built_and_shared_by_copies():
    network = TownNetwork(straight_town())
    assert copy.deepcopy(network) is network
    with pytest.raises(TypeError, match="add the lane to the town"):
        network.add_lane("a", "b", StraightLane([0, 0], [1, 0]))
    again = pickle.loads(pickle.dumps(network))
    assert again.get_closest_lane_index([120.0, 3.0], 0.1) == network.get_closest_lane_index([120.0, 3.0], 0.1)


def test_town_without_lanes_is_refused():
    with pytest.raises(ValueError, match="no lanes"):
        TownNetwork(Town(name="void", lanes=[], links=[], junctions=[]))


def test_lines_are_striped_between_lanes_and_solid_outside():
    network = TownNetwork(straight_town(lanes=2, roads=1))
    assert network.lane_of(0).line_types == [LineType.CONTINUOUS, LineType.NONE]
    assert network.lane_of(1).line_types == [LineType.STRIPED, LineType.CONTINUOUS]
