import numpy as np
import pytest

from dorothie_gym.sim.network.lane_lookup import closest_lane, project
from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.sim.state.town_arrays import town_arrays
from tests.sim.network.towns import EVERY_TOWN, find_town, places


@pytest.mark.parametrize("name", EVERY_TOWN)
def test_closest_lane_is_the_networks_at_any_place_and_height(name):
    network = TownNetwork(find_town(name))
    town = town_arrays(network)
    rng = np.random.default_rng(1)
    for place, heading, height in places(network, 400, seed=7):
        level = height if rng.random() < 0.5 else None
        expected = network.get_closest_lane_index(place, heading, level)
        row, station, lateral, segment = closest_lane(
            town, place[0], place[1], heading, np.cos(heading), np.sin(heading),
            np.nan if level is None else level, int(rng.integers(len(town.lanes))),
        )  # fmt: skip
        assert network.index_of(row) == expected
        lane = network.get_lane(expected)
        assert (station, lateral) == lane.local_coordinates(place)
        assert town.lanes[row].first <= segment < town.lanes[row].last


@pytest.mark.parametrize("name", ["curve", "brookside"])
def test_place_on_a_given_lane_is_the_networks_to_the_last_bit(name):
    network = TownNetwork(find_town(name))
    town = town_arrays(network)
    rng = np.random.default_rng(2)
    for place, _, _ in places(network, 300, seed=8):
        number = int(rng.integers(len(town.lanes)))
        station, lateral, _ = project(town, number, place[0], place[1])
        assert (station, lateral) == network.lane_of(number).local_coordinates(place)


def test_town_is_read_once():
    network = TownNetwork(find_town("curve"))
    assert town_arrays(network) is town_arrays(network)


def test_nan_position_is_an_error():
    town = town_arrays(TownNetwork(find_town("curve")))
    with pytest.raises(ValueError, match="not a number"):
        closest_lane(town, np.nan, 0.0, 0.0, 1.0, 0.0, np.nan, 0)
