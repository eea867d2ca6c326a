"""Lights, signs, priority and room at junctions, as the kernel's traffic keeps them."""

from collections.abc import Callable

import numpy as np
import pytest

from dorothie_gym.maps import Town
from dorothie_gym.maps.model import SignalKind
from dorothie_gym.maps.right_of_way import right_of_way
from dorothie_gym.maps.town import LightColour, LightPhase
from dorothie_gym.sim.batch.worlds import step_alone
from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.sim.population import add_vehicle, populate
from dorothie_gym.sim.state.codes import Colour, Kind, Wait
from dorothie_gym.sim.state.town_arrays import TownArrays, town_arrays
from dorothie_gym.sim.state.world_arrays import WorldArrays, empty_world
from dorothie_gym.sim.traffic.junctions import light
from tests.sim.crossings import ARMS, across, crossing, lit, lit_crossing, way_in, way_out
from tests.sim.network.towns import find_town
from tests.sim.state.states import DT, Pose, kernel_world

LENGTH = 108.0


def going(town: Town, *ways: tuple[str, str, float]) -> tuple[TownArrays, WorldArrays]:
    """Vehicles that come from an arm, go to another one, and have so far to go to the line [m]."""
    network = TownNetwork(town)
    poses = [Pose(way_in(start), LENGTH - left, speed=8.0, desired=8.0) for start, _, left in ways]
    arrays, world = kernel_world(network, poses)
    for vehicle, (start, end, _) in zip(world.vehicles, ways, strict=True):
        vehicle.plan[:3], vehicle.planned = (way_in(start), across(start, end), way_out(end)), 3
    return arrays, world


def crossed(world: WorldArrays, i: int) -> bool:
    """Whether a vehicle has left the crossing behind it."""
    return bool(world.vehicles[i].lane >= 4 and world.vehicles[i].lane < 8)


def run(arrays: TownArrays, world: WorldArrays, seconds: float, until: Callable[[], bool] = lambda: False) -> float:
    """Goes on until something holds; returns the time [s]."""
    for _ in range(round(seconds / DT)):
        step_alone(arrays, world, 1, DT)
        assert not world.vehicles.crashed.any()
        if until():
            break
    return float(world.clock[0].time)


def test_vehicle_waits_at_red_and_goes_at_green():
    arrays, world = going(lit_crossing("ns", green=12.0), ("e", "w", 60.0))
    run(arrays, world, 14.0)
    vehicle = world.vehicles[0]
    assert vehicle.wait == Wait.LIGHT and vehicle.speed == 0.0
    assert 0.0 < vehicle.distance < 3.5
    assert run(arrays, world, 20.0, lambda: crossed(world, 0)) > 16.0
    assert crossed(world, 0)


@pytest.mark.parametrize(("before", "stops"), [(35.0, True), (6.0, False)])
def test_yellow_stops_vehicles_that_can_stop_comfortably(before, stops):
    phases = [LightPhase(duration=4.0, yellow=(0, 2)), LightPhase(duration=40.0)]
    town = crossing(dict.fromkeys(ARMS, SignalKind.TRAFFIC_LIGHT), phases)
    arrays, world = going(town, ("s", "n", before + 2.5))
    run(arrays, world, 10.0)
    assert crossed(world, 0) != stops
    assert not stops or (world.vehicles[0].speed == 0.0 and 0.0 < world.vehicles[0].distance < 3.5)


@pytest.mark.parametrize("kind", [Kind.CAR, Kind.CYCLIST])
def test_vehicle_at_a_long_red_light_is_not_respawned(kind):
    phases = [LightPhase(duration=100.0, green=(1, 3)), LightPhase(duration=20.0, green=(0, 2))]
    town = crossing(dict.fromkeys(ARMS, SignalKind.TRAFFIC_LIGHT), phases)
    arrays = town_arrays(TownNetwork(town))
    world = empty_world(arrays, vehicles=3, pedestrians=0)
    for station in (100.0, 85.0, 70.0):
        i = add_vehicle(arrays, world, way_in("s"), station, kind=kind, desired=8.0)
        world.vehicles[i].plan[:3] = way_in("s"), across("s", "n"), way_out("n")
    keys = world.vehicles.key.tolist()
    run(arrays, world, 99.0)
    assert world.vehicles.key.tolist() == keys and world.clock[0].towed == 0
    assert (world.vehicles.speed == 0.0).all() and (world.vehicles.lane == way_in("s")).all()
    run(arrays, world, 20.0)
    assert [crossed(world, i) for i in range(3)] == [True, True, True]


def test_vehicle_does_not_slow_down_for_a_green_light():
    arrays, world = going(lit_crossing("ew", green=60.0), ("e", "w", 60.0))
    slowest = 8.0
    while not crossed(world, 0):
        step_alone(arrays, world, 1, DT)
        slowest = min(slowest, float(world.vehicles[0].speed))
    assert slowest > 7.0


def test_vehicle_stands_at_a_stop_sign_before_it_goes():
    arrays, world = going(crossing({"s": SignalKind.STOP}), ("s", "n", 40.0))
    slowest = []
    run(arrays, world, 30.0, lambda: slowest.append(float(world.vehicles[0].speed)) or crossed(world, 0))
    assert crossed(world, 0) and min(slowest) < 0.3


def test_vehicle_passes_a_yield_sign_without_standing_on_a_free_road():
    arrays, world = going(crossing({"s": SignalKind.YIELD}), ("s", "n", 40.0))
    slowest = []
    run(arrays, world, 30.0, lambda: slowest.append(float(world.vehicles[0].speed)) or crossed(world, 0))
    assert crossed(world, 0) and min(slowest) > 3.0


@pytest.mark.parametrize(
    ("controls", "first", "second"),
    [
        ({"s": SignalKind.YIELD, "n": SignalKind.YIELD}, ("e", "w"), ("s", "n")),
        ({}, ("n", "s"), ("s", "w")),  # a left turn waits for the oncoming
    ],
)
def test_vehicle_without_priority_lets_the_other_pass(controls, first, second):
    arrays, world = going(crossing(controls), (*first, 38.0), (*second, 30.0))
    order = []
    run(arrays, world, 30.0, lambda: order.extend(i for i in (0, 1) if crossed(world, i) and i not in order) or False)
    assert order == [0, 1]


def test_first_come_first_served_among_equals():
    arrays, world = going(crossing(), ("e", "w", 50.0), ("s", "n", 30.0))
    order = []
    run(arrays, world, 30.0, lambda: order.extend(i for i in (0, 1) if crossed(world, i) and i not in order) or False)
    assert order == [1, 0]


@pytest.mark.parametrize("way", [1, 2, 3])  # left, straight on, right
@pytest.mark.parametrize("sign", [None, SignalKind.STOP])
def test_four_cars_at_a_junction_of_equals_all_cross(way, sign):
    town = crossing(dict.fromkeys(ARMS, sign) if sign else {})
    arrays, world = going(town, *((arm, ARMS[(k + way) % 4], 28.0) for k, arm in enumerate(ARMS)))
    done: set[int] = set()
    seconds = run(arrays, world, 60.0, lambda: done.update(i for i in range(4) if crossed(world, i)) or len(done) == 4)
    assert len(done) == 4 and seconds < 45.0


def test_junction_admits_only_vehicles_with_room_behind_it():
    network = TownNetwork(crossing())
    poses = [Pose(way_out("n"), 18.0), *(Pose(way_in("s"), LENGTH - left, speed=8.0) for left in (18.0, 32.0, 46.0))]
    arrays, world = kernel_world(network, poses)
    for vehicle in world.vehicles[1:]:
        vehicle.plan[:3], vehicle.planned = (way_in("s"), across("s", "n"), way_out("n")), 3
    entered: list[set[int]] = []
    for _ in range(round(14.0 / DT)):
        world.vehicles[0].desired = world.vehicles[0].speed = 0.0
        world.vehicles.standing = 0.0  # no vehicle draws another route
        step_alone(arrays, world, 1, DT)
        entered.append({i for i in (1, 2, 3) if arrays.lanes[world.vehicles[i].plan[0]].junction >= 0})
        assert not world.vehicles.crashed.any()
    assert {i for inside in entered for i in inside} == {1}
    vehicle = world.vehicles[1]
    assert vehicle.speed < 0.3 and vehicle.inside < 0  # it stands, and has left the crossing altogether
    assert vehicle.lane == way_out("n") and vehicle.own_station > 0.5 * vehicle.length


@pytest.mark.parametrize("seed", range(4))
def test_conflicting_paths_are_never_driven_together_and_no_vehicle_waits_for_ever(seed):
    town = crossing()
    rules, rng = right_of_way(town), np.random.default_rng(seed)
    ways = []
    for arm in ARMS:
        for k in range(3):
            end = ARMS[(ARMS.index(arm) + int(rng.integers(1, 4))) % 4]
            ways.append((arm, end, 20.0 + 14.0 * k + float(rng.uniform(0.0, 3.0))))
    arrays, world = going(town, *ways)
    through: set[int] = set()

    def look() -> bool:
        inside = [int(c) for c in world.vehicles.inside if c >= 0]
        assert not any(one in rules.foes(other) for one in inside for other in inside)
        through.update(i for i in range(len(ways)) if crossed(world, i))
        return len(through) == len(ways)

    run(arrays, world, 180.0, look)
    assert len(through) == len(ways)


def test_vehicle_without_room_behind_the_junction_waits_and_then_reroutes():
    network = TownNetwork(crossing())
    arrays, world = kernel_world(network, [Pose(way_in("e"), LENGTH - 40.0, speed=8.0), Pose(way_out("w"), 4.0)])
    own, other = world.vehicles
    own.plan[:3], own.planned = (way_in("e"), across("e", "w"), way_out("w")), 3
    waits, driven = [], set()
    for _ in range(900):
        other.desired = other.speed = 0.0  # it stands where the first one wants to go
        step_alone(arrays, world, 1, DT)
        waits.append(int(own.wait))
        driven.add(int(own.plan[0]))
    assert waits.count(Wait.NO_ROOM) * DT > 5.0
    assert across("e", "w") not in driven and len(driven) > 1


@pytest.mark.parametrize("name", ["brookside", "millbrook"])
def test_lights_follow_the_towns_programmes(name):
    town = find_town(name)
    town = town if town.programmes else lit(town)
    arrays = town_arrays(TownNetwork(town))
    world = empty_world(arrays, vehicles=1, pedestrians=0)
    names = {LightColour.GREEN: Colour.GREEN, LightColour.YELLOW: Colour.YELLOW, LightColour.RED: Colour.RED}
    rng = np.random.default_rng(4)
    for _ in range(300):
        world.clock.time += rng.uniform(0.0, 4.0)
        now, later = float(world.clock[0].time), float(world.clock[0].time + rng.uniform(0.0, 3.0))
        for lane in town.lanes:
            for time in (now, later):
                shown = town.light(lane.id, time)
                assert light(arrays, world, lane.id, time) == (Colour.GREEN if shown is None else names[shown])


@pytest.mark.parametrize("seed", [1, 2])
def test_traffic_never_runs_a_red_light(seed):
    town = lit(find_town("brookside"))
    network = TownNetwork(town)
    arrays = town_arrays(network)
    world = empty_world(arrays, vehicles=40, pedestrians=0, seed=seed)
    populate(network, arrays, world, seed=seed, vehicles=40, pedestrians=0)
    vehicles, lengths = world.vehicles, arrays.lanes.length
    lights = arrays.lanes.programme >= 0
    before = np.zeros(len(vehicles), dtype=bool)
    passed = 0
    for _ in range(3 * 60 * 30):
        step_alone(arrays, world, 1, DT)
        over = lights[vehicles.lane] & (vehicles.own_station + 0.5 * vehicles.length > lengths[vehicles.lane])
        for i in np.flatnonzero(over & ~before & (vehicles.kind > 0)):
            assert town.light(int(vehicles.lane[i]), float(world.clock[0].time)) is not LightColour.RED
            passed += 1
        before = over
    assert passed > 100 and world.clock[0].collisions == 0
