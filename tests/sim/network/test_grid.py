import numpy as np
import pytest
from highway_env.road.road import RoadNetwork

from dorothie_gym.sim.network.lane_lookup import SAME_LEVEL
from dorothie_gym.sim.network.network import TownNetwork

from .towns import EVERY_TOWN, find_town, lane, overpass_town, places, straight_town, town


@pytest.fixture(scope="module", params=EVERY_TOWN)
def network(request):
    return TownNetwork(find_town(request.param))


def stock(network, position, heading):
    return RoadNetwork.get_closest_lane_index(network, position, heading)


def scan_at_height(network, position, heading, height):
    """Stock scan over the lanes of one height."""
    found, distances = [], []
    for index, candidate in network.lanes_dict().items():
        station, _ = candidate.local_coordinates(position)
        if abs(candidate.height_at(station) - height) <= SAME_LEVEL:
            found.append(index)
            distances.append(candidate.distance_with_heading(position, heading))
    return found[int(np.argmin(distances))] if found else stock(network, position, heading)


@pytest.mark.long
def test_index_equals_highway_envs_scan(network):
    for position, heading, _ in places(network, 2000, seed=1):
        assert network.get_closest_lane_index(position) == stock(network, position, None)
        assert network.get_closest_lane_index(position, heading) == stock(network, position, heading)


def test_index_with_height_equals_the_scan_over_lanes_of_that_height(network):
    for i, (position, heading, height) in enumerate(places(network, 600, seed=2)):
        heading = heading if i % 2 else None
        expected = scan_at_height(network, position, heading, height)
        assert network.get_closest_lane_index(position, heading, height) == expected


def test_first_of_several_equally_close_lanes_wins():
    twins = town([lane(i, [(0, 0), (50, 0)], road=i) for i in range(4)])
    network = TownNetwork(twins)
    for position in ([25.0, 1.0], [-3.0, 0.0], [500.0, 400.0]):
        assert network.get_closest_lane_index(np.array(position)) == next(iter(network.lanes_dict()))
    halfway = np.array([50.0, 2.0])
    wide = TownNetwork(straight_town())
    assert wide.get_closest_lane_index(halfway) == stock(wide, halfway, None)


def test_height_separates_the_bridge_from_the_road_below():
    network = TownNetwork(overpass_town())
    crossing = np.array([0.0, 0.0])
    assert network.lane_id(network.get_closest_lane_index(crossing, height=0.0)) == 0
    assert network.lane_id(network.get_closest_lane_index(crossing, height=6.0)) == 1
    nowhere = network.get_closest_lane_index(crossing, 0.3, height=50.0)
    assert nowhere == stock(network, crossing, 0.3)


@pytest.mark.parametrize("position", [[1e12, 0.0], [-1e300, 1e300], [np.nan, 0.0], [np.inf, 0.0]])
def test_invalid_positions_are_answered_as_by_highway_envs_scan(position):
    network = TownNetwork(straight_town())
    with np.errstate(all="ignore"):
        expected = stock(network, np.array(position), None)
        assert network.get_closest_lane_index(np.array(position)) == expected
