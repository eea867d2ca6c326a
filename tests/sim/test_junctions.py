"""The ego at junctions among others; the traffic itself is tested in `tests/sim/traffic`."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import numpy as np
import pytest

from dorothie_gym.maps import Town
from dorothie_gym.maps.model import SignalKind
from dorothie_gym.maps.right_of_way import right_of_way
from dorothie_gym.maps.town import LightPhase
from dorothie_gym.ontology import ObjectClass, PhysicalAction
from dorothie_gym.sim.config import WorldConfig
from dorothie_gym.sim.population import add_vehicle
from dorothie_gym.sim.state.codes import Kind, Wait
from dorothie_gym.sim.state.records import VehicleRecord
from dorothie_gym.sim.state.town_arrays import town_arrays
from dorothie_gym.sim.state.world_arrays import WorldArrays, grown
from dorothie_gym.sim.traffic.lane_index import rebuild
from dorothie_gym.sim.traffic.vehicle_models import update_lane
from dorothie_gym.sim.traffic_rules import WorldEvent, WorldEventKind
from dorothie_gym.sim.world import World
from dorothie_gym.support.compilation.records import RecordArray
from tests.sim.crossings import ARMS, across, crossing, lit, lit_crossing, way_in, way_out
from tests.sim.driving import ALONE, network, run

TURNS = {"left": 90, "straight": 0, "right": -90}
ROOM = 4


def world_in(town: Town, arm: str = "s", station: float = 20.0) -> World:
    """Returns a world with the ego on an arm, on its way to the crossing, and room for `ROOM` others."""
    world = World(town, ALONE, seed=np.random.SeedSequence(1), departure=(way_in(arm), station))
    state = world.actors.arrays
    world.actors.arrays = grown(
        town_arrays(world.network), state, vehicles=1 + ROOM, pedestrians=0, props=len(state.props)
    )
    return world


def others(world: World) -> RecordArray[VehicleRecord]:
    return world.actors.arrays.vehicles


def add(world: World, start: str, end: str, station: float, speed: float = 8.0) -> int:
    """Number of a new vehicle that crosses from an arm to another."""
    number = add_vehicle(town_arrays(world.network), world.actors.arrays, way_in(start), station, desired=8.0)
    vehicle = others(world)[number]
    vehicle.speed, vehicle.planned = speed, 3
    vehicle.plan[:3] = way_in(start), across(start, end), way_out(end)
    return number


def watch(world: World, seconds: float, until: Callable[[], bool]) -> float:
    """Lets a world run, looking at every frame; returns when something came true [s], inf if it did not."""
    for _ in range(round(seconds * 30)):
        world.step(1)
        if until():
            return world.time
    return math.inf


def turn(world: World, way: str) -> None:
    assert world.planner.command(PhysicalAction.J_TURN, TURNS[way], 0.0) is None


def kinds(events: list[WorldEvent]) -> list[tuple[WorldEventKind, str]]:
    return [(event.kind, event.data["reason"]) for event in events]


# --- lights -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("way", ["left", "straight", "right"])
def test_car_waits_at_red_and_goes_on_green(way: str) -> None:
    world = world_in(lit_crossing("ew"))  # red for the car during the first 24 s
    turn(world, way)
    events = run(world, 23.0)
    assert world.car.speed == 0.0
    assert world.hazard is not None
    assert world.hazard.kind is ObjectClass.TRAFFIC_LIGHT
    line = world.town.lanes[way_in("s")].length - world.planner.station - world.car.LENGTH / 2
    assert 1.0 <= line <= 2.0
    assert kinds(events) == [(WorldEventKind.HAZARD_STOP, ObjectClass.TRAFFIC_LIGHT.label)]
    events = run(world, 15.0, lambda: not world.town.lanes[world.planner.lane].in_junction and world.planner.lane != 2)
    assert kinds(events) == [(WorldEventKind.HAZARD_END, ObjectClass.TRAFFIC_LIGHT.label)]
    assert world.planner.lane in (way_out("w"), way_out("n"), way_out("e"))


def test_car_with_a_turn_command_at_a_red_light_waits_for_green() -> None:
    world = world_in(lit_crossing("ew"), station=90.0)
    run(world, 12.0)
    assert world.planner.waits_at_end
    turn(world, "straight")
    run(world, 10.0)
    assert world.planner.lane == way_in("s")
    run(world, 6.0)
    assert world.planner.lane != way_in("s")


@pytest.mark.parametrize(("before", "stops"), [(35.0, True), (6.0, False)])
def test_yellow_stops_the_car_if_it_can_stop_comfortably(before: float, stops: bool) -> None:
    town = crossing(
        dict.fromkeys(ARMS, SignalKind.TRAFFIC_LIGHT),
        [LightPhase(duration=4.0, yellow=(0, 2)), LightPhase(duration=40.0)],
    )
    world = world_in(town, "s", town.lanes[way_in("s")].length - before - 2.5)
    world.car.speed = 8.0
    turn(world, "straight")
    run(world, 10.0)
    assert (world.car.position[1] > 12.0) == stops  # the crossing begins 12 m south of its middle
    assert not stops or world.car.speed == 0.0


# --- priority -----------------------------------------------------------------------------------------------------


def test_left_turn_lets_oncoming_pass() -> None:
    world = world_in(lit_crossing("ns", green=60.0), station=80.0)
    oncoming = [add(world, "n", "s", station) for station in (75.0, 50.0, 25.0)]
    turn(world, "left")
    events: list[WorldEvent] = []

    def turned() -> bool:
        return bool(world.town.lanes[world.planner.lane].in_junction)

    while world.time < 40.0 and not turned():
        events += world.step(3)
    assert all(others(world).lane[oncoming] == way_out("s"))
    assert world.time < 25.0
    assert kinds(events)[0] == (WorldEventKind.HAZARD_STOP, ObjectClass.VEHICLES.label)


def test_car_stands_at_a_stop_sign() -> None:
    world = world_in(crossing({"s": SignalKind.STOP}), "s", 60.0)
    turn(world, "straight")
    slowest, reasons = math.inf, set()
    while world.car.position[1] > 12.0 and world.time < 30.0:
        world.step(1)
        slowest = min(slowest, float(world.car.speed) if world.car.position[1] < 12.0 + 2.5 + 3.5 else math.inf)
        reasons.add(world.hazard.kind if world.hazard else None)
    assert world.time < 20.0
    assert slowest < 0.3
    assert ObjectClass.TRAFFIC_SIGN in reasons


def test_yield_sign_lets_the_main_road_pass() -> None:
    world = world_in(crossing({"s": SignalKind.YIELD}), station=75.0)
    main = [add(world, "e", "w", 70.0), add(world, "e", "w", 45.0)]
    turn(world, "straight")
    reasons = set()

    def crosses() -> bool:
        reasons.add(world.hazard.kind if world.hazard else None)
        return bool(world.town.lanes[world.planner.lane].in_junction)

    assert watch(world, 30.0, crosses) < 30.0
    assert all(others(world).lane[main] == way_out("w"))
    assert ObjectClass.TRAFFIC_SIGN in reasons


def test_others_give_way_to_the_car_where_it_has_priority() -> None:
    world = world_in(crossing({"e": SignalKind.YIELD}), station=70.0)
    world.car.speed = 8.0
    number = add(world, "e", "w", 80.0)
    turn(world, "straight")
    waits = set()

    def crossed() -> bool:
        waits.add(Wait(others(world)[number].wait))
        return bool(others(world)[number].lane == way_out("w"))

    assert watch(world, 30.0, lambda: world.planner.lane == way_out("n") or crossed()) < 30.0
    assert world.planner.lane == way_out("n") and Wait.GIVING_WAY in waits
    assert watch(world, 20.0, crossed) < math.inf


# --- U-turns ------------------------------------------------------------------------------------------------------


def test_others_stay_out_of_a_junction_into_which_the_cars_u_turn_reaches() -> None:
    world = world_in(crossing(), station=60.0)
    run(world, 20.0)  # it waits at the end of its lane
    assert world.planner.waits_at_end
    assert world.planner.command(PhysicalAction.U_TURN, 0, 0.0) is None
    comers = [add(world, "e", "w", 60.0), add(world, "n", "s", 55.0), add(world, "w", "n", 50.0)]
    arrays, lanes = world.actors.arrays, town_arrays(world.network).lanes
    begun, waits = 0, set()

    def is_round() -> bool:
        nonlocal begun
        if arrays.car[0].sweeping:
            begun += 1
            inside = [int(others(world)[i].inside) for i in comers]
            assert all(lanes[lane].junction < 0 for lane in inside if lane >= 0)
        waits.update(Wait(others(world)[i].wait) for i in comers)
        return begun > 0 and not arrays.car[0].sweeping

    assert watch(world, 40.0, is_round) < 40.0
    assert begun > 30 and Wait.CLOSED in waits
    assert world.planner.lane == way_out("s") and world.collisions == 0
    # and then they go on
    assert watch(world, 30.0, lambda: bool((others(world).lane[comers] >= 4).all())) < math.inf
    assert world.collisions == 0 and not others(world).crashed.any()


@pytest.mark.parametrize("away", [25.0, 40.0])
def test_traffic_gives_way_to_a_u_turn_of_the_ego(away: float) -> None:
    world = world_in(crossing(), station=40.0)
    assert world.planner.command(PhysicalAction.U_TURN, 0, 0.0) is None
    assert watch(world, 20.0, lambda: bool(world.actors.arrays.car[0].sweeping)) < 20.0
    x, y = world.car.position
    number = add(world, "s", "n", 10.0, 0.0)
    vehicle, lane = others(world)[number], way_out("s")  # it comes the other way, towards the car
    town = town_arrays(world.network)
    vehicle.plan[0], vehicle.planned, vehicle.lane = lane, 1, lane
    arm = world.town.lanes[lane]
    station = arm.project((x, y))[0] - away
    vehicle.x, vehicle.y = arm.position(station)
    vehicle.heading = arm.heading_at(station)
    vehicle.cos, vehicle.sin = math.cos(vehicle.heading), math.sin(vehicle.heading)
    vehicle.speed = 8.0
    update_lane(town, vehicle)
    rebuild(town, world.actors.arrays)
    slowest = 8.0

    def is_round() -> bool:
        nonlocal slowest
        slowest = min(slowest, float(others(world)[number].speed))
        return not world.actors.arrays.car[0].sweeping

    assert watch(world, 20.0, is_round) < 20.0
    assert world.collisions == 0 and not others(world).crashed.any()
    assert slowest < 6.0


# --- all together -------------------------------------------------------------------------------------------------


def drive_about(world: World, rng: np.random.Generator) -> None:
    """The car takes any way at the next junction, and now and then turns round."""
    planner, speed = world.planner, float(world.car.speed)
    if planner.in_manoeuvre:
        return
    if rng.random() < 0.002:
        planner.command(PhysicalAction.U_TURN, 0, speed)
    elif planner.turn_ahead is None:
        exits, _ = planner.exits()
        if exits:
            planner.command(PhysicalAction.J_TURN, exits[int(rng.integers(len(exits)))].angle, speed)


def connectors_in_use(arrays: WorldArrays) -> list[int]:
    """Returns the connectors with a vehicle that has not left the junction, or that was admitted and has begun."""
    there = arrays.vehicles[arrays.vehicles.kind != Kind.EMPTY]
    return [int(lane) for lane in there.inside if lane >= 0]


@pytest.mark.parametrize("lights", [False, True])
@pytest.mark.parametrize("name", ["brookside", "Town02"])
def test_crossing_connectors_are_never_driven_at_the_same_time_with_the_car_among_others(
    name: str, lights: bool
) -> None:
    roads = network(name)
    town = lit(roads.town) if lights else roads.town
    site = town.sites[1]
    config = WorldConfig(vehicles=30, pedestrians=0)
    world = World(town, config, seed=np.random.SeedSequence(4), departure=(site.lane, site.station))
    foes, rng = right_of_way(town).foes, np.random.default_rng(3)
    world.ego.cruise = 12.0
    together, through = 0, 0
    for _ in range(3 * 60 * 10):
        drive_about(world, rng)
        world.step(3)
        arrays = world.actors.arrays
        inside = connectors_in_use(arrays)
        for one, two in itertools.combinations(inside, 2):
            assert two not in foes(one), (world.time, one, two)
        together += len(inside) > 1
        through += int(arrays.vehicles[0].inside) >= 0
    assert together > 300 and through > 40
    assert world.collisions == 0 and world.actors.arrays.clock[0].collisions == 0
