"""highway-env's vehicles, observation types and viewer on a town's road."""

import itertools

import numpy as np
import pytest
from highway_env.envs.common.abstract import AbstractEnv
from highway_env.envs.common.graphics import EnvViewer
from highway_env.vehicle.behavior import IDMVehicle
from highway_env.vehicle.objects import Obstacle

from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.sim.road import TownRoad

from .towns import EAST_OUT, SOUTH_OUT, WEST_EAST, WEST_IN, WEST_SOUTH, curve_town, find_town, t_junction_town

OBSERVATIONS = {
    "Kinematics": {"type": "Kinematics", "see_behind": True},
    "OccupancyGrid": {"type": "OccupancyGrid", "features": ["presence", "on_road"], "align_to_vehicle_axes": True},
    "LidarObservation": {"type": "LidarObservation"},
    "TimeToCollision": {"type": "TimeToCollision", "horizon": 10},
}


class StockEnv(AbstractEnv):
    """The least that highway-env accepts as an environment, on a town's road."""

    town = t_junction_town

    def _reset(self):
        network = TownNetwork(type(self).town())
        self.road = TownRoad(network, np_random=self.np_random)
        lanes = [lane for lane in network.lanes_list() if lane.length > 50][:6]
        self.road.vehicles = [IDMVehicle(self.road, lane.position(30, 0), lane.heading_at(30), 6) for lane in lanes]
        self.vehicle = self.action_type.vehicle_class(self.road, lanes[0].position(5, 0), lanes[0].heading_at(5), 6)
        self.road.vehicles.insert(0, self.vehicle)
        self.road.objects.append(Obstacle(self.road, lanes[1].position(10, 0)))

    def _reward(self, action):
        return 0.0

    def _is_terminated(self):
        return False

    def _is_truncated(self):
        return False


def drive(network, lane_id, seconds, route=None):
    """Lanes that a stock driver comes along, and how far off their centre lines it got [m]."""
    road = TownRoad(network)
    lane = network.lane_of(lane_id)
    vehicle = IDMVehicle(road, lane.position(5, 0), lane.heading_at(5), 8, target_speed=8, route=route)
    road.vehicles.append(vehicle)
    visited, off = [], 0.0
    for _ in range(int(15 * seconds)):
        road.act()
        road.step(1 / 15)
        off = max(off, abs(network.get_lane(vehicle.target_lane_index).local_coordinates(vehicle.position)[1]))
        if network.lane_id(vehicle.target_lane_index) not in visited:
            visited.append(network.lane_id(vehicle.target_lane_index))
    return visited, off


def test_idm_vehicle_drives_round_a_curve():
    visited, off = drive(TownNetwork(curve_town()), 0, 10)
    assert visited == [0, 1]
    assert off < 0.5


@pytest.mark.parametrize(("connector", "out"), [(WEST_EAST, EAST_OUT), (WEST_SOUTH, SOUTH_OUT)])
def test_idm_vehicle_drives_its_route_through_a_junction(connector, out):
    network = TownNetwork(t_junction_town())
    route = [network.index_of(i) for i in (WEST_IN, connector, out)]
    visited, off = drive(network, WEST_IN, 15, route)
    assert visited == [WEST_IN, connector, out]
    assert off < 2.0  # highway-env's steering cuts a corner of 8 m radius


@pytest.mark.parametrize("name", ["brookside", "Town02.xodr", "Town05.xodr"])
def test_idm_vehicle_keeps_to_the_links_of_a_town(name):
    network = TownNetwork(find_town(name))
    start = next(lane.id for lane in network.town.lanes if not lane.in_junction and lane.length > 60)
    visited, _ = drive(network, start, 60)
    assert len(visited) > 3
    for lane, following in itertools.pairwise(visited):
        beside = [network.lane_id(side) for side in network.side_lanes(network.index_of(lane))]
        onward = [link.target for link in network.town.successors(lane)]
        assert following in onward + beside


@pytest.mark.parametrize("name", OBSERVATIONS)
def test_highway_envs_observations_work_on_a_town_road(name):
    env = StockEnv({"observation": OBSERVATIONS[name], "simulation_frequency": 15, "policy_frequency": 5})
    observation, _ = env.reset(seed=3)
    for _ in range(10):
        assert env.observation_space.shape == observation.shape
        assert np.isfinite(observation).all()
        observation, *_ = env.step(env.action_type.actions_indexes["IDLE"])
    assert observation.any()
    env.close()


def test_highway_envs_environments_can_be_copied_and_simplified():
    env = StockEnv({"policy_frequency": 5})
    env.reset(seed=0)
    simple = env.simplify()
    assert simple.road is not env.road
    assert simple.road.network is env.road.network
    simple.step(simple.action_type.actions_indexes["FASTER"])
    assert (simple.vehicle.position != env.vehicle.position).any()


def test_highway_envs_viewer_draws_the_town(monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    env = StockEnv({"screen_width": 300, "screen_height": 200, "scaling": 3.0}, render_mode="rgb_array")
    env.reset(seed=0)
    env.viewer = EnvViewer(env)
    env.viewer.enabled = True  # highway-env draws nothing on a dummy display, though surfaces work without one
    picture = env.render()
    assert picture.shape == (200, 300, 3)
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 2  # ground, marks, vehicles
    env.close()
