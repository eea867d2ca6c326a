"""Bodies that count as on a lane, those that reach into it or stand in a lane change included."""

import math

import numpy as np
import pytest

from dorothie_gym.sim.batch.worlds import step_alone
from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.sim.traffic.lane_index import rebuild
from dorothie_gym.sim.traffic.vehicle_models import GIVING_UP, update_lane
from tests.sim.network.towns import straight_town
from tests.sim.state.states import DT, Pose, kernel_world


def two_lanes():
    return TownNetwork(straight_town(lanes=2, roads=4))


def on_lane(world, lane):
    """Vehicles in the list of a lane, in its order."""
    found, n = [], int(world.heads[lane])
    while n >= 0:
        found.append(int(world.nodes[n].body))
        n = int(world.nodes[n].next)
    return found


@pytest.mark.parametrize(
    ("lateral", "turned", "beside"),
    [(0.0, 0.0, False), (0.9, 0.1, False), (0.3, math.pi / 4, False), (0.9, math.pi / 4, True), (1.9, 0.0, True)],
)
def test_vehicle_across_a_lane_line_is_on_both_lanes(lateral, turned, beside):
    _town, world = kernel_world(two_lanes(), [Pose(0, 50.0, lateral=lateral, turned=turned)])
    assert on_lane(world, 0) == [0]
    assert on_lane(world, 1) == ([0] if beside else [])


def test_lists_are_ordered_by_station_with_vehicles_askew():
    poses = [Pose(1, 70.0), Pose(0, 50.0, lateral=0.9, turned=math.pi / 4), Pose(1, 20.0)]
    town, world = kernel_world(two_lanes(), poses)
    assert on_lane(world, 1) == [2, 1, 0]
    world.vehicles[1].heading = 0.0
    world.vehicles[1].cos, world.vehicles[1].sin = 1.0, 0.0
    rebuild(town, world)
    assert on_lane(world, 1) == [2, 0]


def test_vehicle_stops_behind_one_askew_on_the_lane_beside():
    town, world = kernel_world(
        two_lanes(),
        [Pose(1, 20.0, speed=8.0), Pose(0, 90.0, lateral=1.2, turned=math.pi / 4), Pose(0, 24.0, speed=8.0)],
    )
    world.vehicles.timer = -1e9  # no vehicle considers a lane change
    for _ in range(600):
        askew = world.vehicles[1]
        askew.speed, askew.desired = 0.0, 0.0
        step_alone(town, world, 1, DT)
        assert not world.vehicles.crashed.any()
    assert world.vehicles[0].x < 87.0 and world.vehicles[0].speed < 0.3


def test_vehicle_that_stands_in_a_lane_change_gives_it_up():
    """Otherwise it would begin to move just when a vehicle comes along the other lane."""
    town, world = kernel_world(two_lanes(), [Pose(1, 50.0, target=0), Pose(1, 58.0)])
    for _ in range(round((GIVING_UP + 0.5) / DT)):
        world.vehicles[1].speed = world.vehicles[1].desired = 0.0
        step_alone(town, world, 1, DT)
    assert world.vehicles[0].plan[0] == 1


def test_vehicle_that_has_changed_lanes_stays_there_when_it_stands():
    town, world = kernel_world(two_lanes(), [Pose(1, 50.0, lateral=-2.3, target=0), Pose(0, 58.0)])
    vehicle = world.vehicles[0]
    update_lane(town, vehicle)
    assert vehicle.lane == 0
    for _ in range(round((GIVING_UP + 0.5) / DT)):
        world.vehicles[1].speed = world.vehicles[1].desired = 0.0
        step_alone(town, world, 1, DT)
    assert vehicle.plan[0] == 0 and np.isfinite(vehicle.x)
