"""Compiled traffic against highway-env on the same states."""

import itertools

import numpy as np
import pytest
from highway_env.vehicle.kinematics import Vehicle

from dorothie_gym.sim.batch.worlds import step_alone
from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.sim.state.codes import Kind
from dorothie_gym.sim.traffic.idm_traffic import drive
from dorothie_gym.sim.traffic.vehicle_models import slip_of, steering_angle
from tests.sim.network.towns import curve_town, find_town, straight_town
from tests.sim.state.states import DT, Pose, kernel_world, stock_road

NEIGHBOURS_WIDTH = 0.9
"""Offset from which on highway-env counts a vehicle as on the lane beside, too [m]."""


def random_poses(rng, network, count, *, changing=0.3):
    lanes = network.town.lanes
    poses = []
    for _ in range(count):
        lane = int(rng.integers(len(lanes)))
        beside = [index for index in network.side_lanes(network.index_of(lane))]
        target = network.lane_id(beside[rng.integers(len(beside))]) if beside and rng.random() < changing else None
        poses.append(
            Pose(
                lane=lane,
                station=float(rng.uniform(2.0, lanes[lane].length - 4.0)),
                lateral=float(rng.uniform(-NEIGHBOURS_WIDTH, NEIGHBOURS_WIDTH)),
                turned=float(rng.normal(scale=0.1)),
                speed=float(rng.choice([0.0, rng.uniform(0.0, 14.0)], p=[0.1, 0.9])),
                desired=float(rng.uniform(3.0, 16.0)),
                target=target,
            )
        )
    return poses


def test_accelerations_and_steering_equal_highway_envs_on_300_random_states():
    network = TownNetwork(straight_town(lanes=3, roads=3, length=100.0))
    rng = np.random.default_rng(11)
    states = followers = changers = 0
    for _ in range(36):
        poses = random_poses(rng, network, 12)
        town, world = kernel_world(network, poses)
        road = stock_road(network, poses)
        for i, stock in enumerate(road.vehicles):
            # the road ends here, which highway-env ignores
            if network.town.lanes[poses[i].lane].id >= 6 and poses[i].station > 40.0:
                continue
            drive(town, world, i)
            stock.act()
            vehicle = world.vehicles[i]
            assert vehicle.acceleration == pytest.approx(expected_acceleration(stock, road), abs=1e-9)
            assert steering_angle(vehicle.slip) == pytest.approx(stock.action["steering"], abs=1e-9)
            states += 1
            followers += road.neighbour_vehicles(stock)[0] is not None
            changers += stock.lane_index != stock.target_lane_index
    assert states >= 300 and followers > 150 and changers > 50


def expected_acceleration(stock, road):
    """Acceleration by highway-env, but with the distance to the vehicle in front measured along the lanes."""
    found = []
    for index in {stock.lane_index, stock.target_lane_index}:
        (front, gap), _ = road.neighbours(stock, index)
        stock.lane_distance_to = lambda other, gap=gap: gap
        found.append(stock.acceleration(stock, front))
    return float(np.clip(min(found), -stock.ACC_MAX, stock.ACC_MAX))


def test_lane_changes_equal_highway_envs_mobil():
    network = TownNetwork(straight_town(lanes=3, roads=3, length=100.0))
    rng = np.random.default_rng(12)
    changes = 0
    for _ in range(60):
        poses = [p for p in random_poses(rng, network, 15, changing=0.0) if 20.0 < p.station < 40.0 and p.lane < 6]
        for i in range(len(poses)):
            town, world = kernel_world(network, poses)
            stock = stock_road(network, poses).vehicles[i]
            world.vehicles[i].timer = stock.timer = 2.0
            stock.act()
            drive(town, world, i)
            assert network.index_of(int(world.vehicles[i].plan[0])) == stock.target_lane_index
            changes += stock.target_lane_index != stock.lane_index
    assert changes > 10


@pytest.mark.parametrize("name", ["curve", "brookside", "t-junction"])
def test_steering_equals_highway_envs_on_bends(name):
    network = TownNetwork(find_town(name))
    rng = np.random.default_rng(5)
    for pose in itertools.islice((p for _ in range(30) for p in random_poses(rng, network, 10)), 300):
        town, world = kernel_world(network, [pose])
        (stock,) = stock_road(network, [pose]).vehicles
        target = network.index_of(int(world.vehicles[0].plan[0]))
        drive(town, world, 0)
        target = network.index_of(int(world.vehicles[0].plan[0]))
        assert steering_angle(world.vehicles[0].slip) == pytest.approx(stock.steering_control(target), abs=1e-9)


@pytest.mark.parametrize(
    ("town", "speed", "lateral"),
    [(straight_town(), 3.0, 0.0), (straight_town(), 9.0, 1.2), (curve_town(), 4.0, -0.8), (curve_town(), 8.0, 0.0)],
)
def test_single_vehicle_drives_as_highway_envs_for_90_substeps(town, speed, lateral):
    network = TownNetwork(town)
    poses = [Pose(lane=0, station=6.0, lateral=lateral, turned=0.05, speed=speed, desired=8.0)]
    arrays, world = kernel_world(network, poses)
    world.vehicles.timer = -1e9  # so that it thinks of no lane change
    road = stock_road(network, poses)
    (stock,), vehicle = road.vehicles, world.vehicles[0]
    for _ in range(90):
        road.act()
        road.step(DT)
        step_alone(arrays, world, 1, DT)
        assert vehicle.x == pytest.approx(stock.position[0], abs=1e-9)
        assert vehicle.y == pytest.approx(stock.position[1], abs=1e-9)
        assert vehicle.heading == pytest.approx(stock.heading, abs=1e-9)
        assert vehicle.speed == pytest.approx(stock.speed, abs=1e-9)
        assert network.index_of(int(vehicle.lane)) == stock.lane_index
    assert stock.position[0] > 15.0


@pytest.mark.parametrize("steering", [0.0, 0.02, -0.4, 1.0])
def test_externally_controlled_car_moves_as_highway_envs_bicycle(steering):
    network = TownNetwork(straight_town())
    pose = Pose(1, 50.0, turned=0.1, speed=6.0)
    arrays, world = kernel_world(network, [pose])
    world.vehicles.kind = Kind.EGO
    stock = Vehicle(None, network.town.lanes[1].position(50.0), heading=0.1, speed=6.0)
    for acceleration in (1.5, 0.0, -1.0):
        stock.act({"acceleration": acceleration, "steering": steering})
        for _ in range(30):
            stock.step(DT)
        step_alone(arrays, world, 30, DT, acceleration, steering)
        car = world.vehicles[0]
        assert (car.x, car.y) == pytest.approx(tuple(stock.position), abs=1e-9)
        assert (car.heading, car.speed) == pytest.approx((stock.heading, stock.speed), abs=1e-9)


def test_brakes_stop_the_car_and_do_not_reverse_it():
    network = TownNetwork(straight_town())
    arrays, world = kernel_world(network, [Pose(1, 50.0, speed=6.0)])
    world.vehicles.kind = Kind.EGO
    step_alone(arrays, world, 60, DT, -8.0, 0.0)
    assert world.vehicles[0].speed == 0.0
    assert world.vehicles[0].x == pytest.approx(50.0 + 36.0 / 16.0, abs=0.2)


@pytest.mark.parametrize("angle", [-1.0, -0.3, 0.0, 1e-4, 0.7])
def test_slip_and_steering_angle_belong_together(angle):
    assert steering_angle(slip_of(angle)) == pytest.approx(angle, abs=1e-12)
