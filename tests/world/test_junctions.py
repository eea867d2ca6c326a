from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from dorothie_gym.ontology import ObjectClass, PhysicalAction
from dorothie_gym.world.config import WorldConfig
from dorothie_gym.world.junctions import JunctionControl, Wait
from dorothie_gym.world.reports import WorldEvent, WorldEventKind
from dorothie_gym.world.town import Town
from dorothie_gym.world.town.lights import LightColour, LightPhase
from dorothie_gym.world.town.model import SignalKind
from dorothie_gym.world.traffic import TrafficVehicle
from dorothie_gym.world.world import World
from tests.world.crossings import ARMS, across, crossing, lit, lit_crossing, way_in, way_out
from tests.world.driving import ALONE, network, run

DT = 0.1
TURNS = {"left": 90, "straight": 0, "right": -90}


def world_in(town: Town, arm: str = "s", station: float = 20.0) -> World:
    """The car on an arm, on its way to the crossing, and nobody else."""
    return World(town, ALONE, seed=np.random.SeedSequence(1), departure=(way_in(arm), station))


def away(world: World) -> World:
    """The same without the car, so that it stands in nobody's way."""
    world.road.vehicles.remove(world.car)
    world.planner.command(PhysicalAction.STOP, 0, 0.0)
    return world


def add(world: World, start: str, end: str, station: float, speed: float = 8.0) -> TrafficVehicle:
    """A vehicle that crosses from an arm to another."""
    assert world.actors.add_vehicle(way_in(start), station, distance=0.0)
    vehicle = world.actors.vehicles[-1]
    vehicle.speed, vehicle._desired = speed, 8.0
    vehicle.route = [world.network.index_of(lane) for lane in (way_in(start), across(start, end), way_out(end))]
    return vehicle


def has_left(vehicle: TrafficVehicle) -> bool:
    return vehicle.lane_id >= way_out("n") and not vehicle.lane.town_lane.in_junction


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


def test_car_asked_for_its_way_at_a_red_light_waits_for_green() -> None:
    world = world_in(lit_crossing("ew"), station=90.0)
    run(world, 12.0)
    assert world.planner.waits_at_end
    turn(world, "straight")
    run(world, 10.0)
    assert world.planner.lane == way_in("s")
    run(world, 6.0)
    assert world.planner.lane != way_in("s")


@pytest.mark.parametrize("who", ["car", "traffic"])
@pytest.mark.parametrize(("before", "stops"), [(35.0, True), (6.0, False)])
def test_yellow_stops_who_can_stop_comfortably_and_lets_the_others_through(
    who: str, before: float, stops: bool
) -> None:
    town = crossing(
        dict.fromkeys(ARMS, SignalKind.TRAFFIC_LIGHT),
        [LightPhase(duration=4.0, yellow=(0, 2)), LightPhase(duration=40.0)],
    )
    length = town.lanes[way_in("s")].length
    station = length - before - 2.5
    if who == "car":
        world = world_in(town, "s", station)
        world.car.speed = 8.0
        turn(world, "straight")
    else:
        world = away(world_in(town, "n"))
        add(world, "s", "n", station)
    mover = world.car if who == "car" else world.actors.vehicles[0]
    run(world, 10.0)
    assert (mover.position[1] > 12.0) == stops  # the crossing begins 12 m south of its middle
    assert not stops or mover.speed == 0.0


def test_who_is_in_the_junction_at_red_clears_it_and_green_waits_for_that() -> None:
    control = JunctionControl(lit_crossing("ns", green=5.0))
    from_south, from_east = across("s", "n"), across("e", "w")
    control.announce(1, way_in("s"), from_south, 4.0, distance=5.0, speed=8.0)
    assert control.request(1, 4.0, room=lambda others: True) is None
    for now in np.arange(4.5, 12.0, 0.5):  # 5 s green, 3 s yellow, 1 s red for all, then green for the others
        control.note(1, from_south, 0.5, now)
        control.announce(2, way_in("e"), from_east, now, distance=1.0, speed=0.0)
        waits = control.request(2, now, room=lambda others: True)
        assert waits is (Wait.LIGHT if now < 9.0 else Wait.OCCUPIED)
    control.note(1, way_out("n"), 8.0, 12.0)
    assert control.request(2, 12.0, room=lambda others: True) is None


def test_permission_is_withdrawn_from_who_can_still_stop_for_the_light() -> None:
    control = JunctionControl(lit_crossing("ns", green=5.0))
    for now, distance, speed in ((4.0, 20.0, 8.0), (5.5, 15.0, 8.0)):
        control.announce(1, way_in("s"), across("s", "n"), now, distance=distance, speed=speed)
        waits = control.request(1, now, room=lambda others: True)
    assert waits is Wait.LIGHT
    assert control.holds(1) is None
    control.announce(2, way_in("s"), across("s", "n"), 4.0, distance=6.0, speed=8.0)
    assert control.request(2, 4.0, room=lambda others: True) is None
    control.announce(2, way_in("s"), across("s", "n"), 5.5, distance=3.0, speed=8.0)
    assert control.request(2, 5.5, room=lambda others: True) is None


def enters_on_red(world: World, seconds: float) -> tuple[int, list[tuple[float, int]]]:
    """How often a junction was entered, and who crossed its line a second or more after its light had turned red."""
    town = world.town
    before: dict[int, int] = {}
    entered, caught = 0, []
    for _ in range(round(seconds / DT)):
        world.step(round(DT * 30))
        for vehicle in world.actors.vehicles:
            lane, last = vehicle.lane_id, before.get(vehicle.key)
            before[vehicle.key] = lane
            if last is None or not town.lanes[lane].in_junction or town.lanes[last].in_junction:
                continue
            entered += 1
            if all(town.light(last, world.time - ago) is LightColour.RED for ago in (0.0, 0.5, 1.0)):
                caught.append((world.time, vehicle.key))
    return entered, caught


@pytest.mark.parametrize(
    ("name", "seconds"),
    [("brookside", 40.0), pytest.param("brookside", 600.0, marks=pytest.mark.slow)]
    + [pytest.param(name, 300.0, marks=pytest.mark.slow) for name in ("Town02", "Town05")],
)
def test_nobody_enters_on_red(name: str, seconds: float) -> None:
    town = lit(network(name).town)
    site = town.sites[1]
    config = WorldConfig(vehicles=16, pedestrians=0)
    world = away(World(town, config, seed=np.random.SeedSequence(4), departure=(site.lane, site.station)))
    entered, caught = enters_on_red(world, seconds)
    assert entered > seconds / 3
    assert not caught


def test_who_waits_at_a_long_red_light_is_not_towed() -> None:
    town = crossing(
        dict.fromkeys(ARMS, SignalKind.TRAFFIC_LIGHT),
        [LightPhase(duration=100.0, green=(1, 3)), LightPhase(duration=20.0, green=(0, 2))],
    )
    world = away(world_in(town, "n"))
    waiting = [add(world, "s", "n", station, 0.0) for station in (100.0, 85.0, 70.0)]
    run(world, 99.0)
    assert world.actors.vehicles == waiting
    assert all(vehicle.standing > 60.0 for vehicle in waiting)
    run(world, 20.0)
    assert [has_left(vehicle) for vehicle in waiting] == [True, True, True]


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
    assert all(vehicle.lane_id == way_out("s") for vehicle in oncoming)
    assert world.time < 25.0
    assert kinds(events)[0] == (WorldEventKind.HAZARD_STOP, ObjectClass.VEHICLES.label)


def test_left_turn_does_not_wait_for_who_is_far_away_stands_or_has_red() -> None:
    for oncoming in ("far", "red", "blocked"):
        phases = [LightPhase(duration=60.0, green=(2,) if oncoming == "red" else (0, 2))]
        control = JunctionControl(crossing(dict.fromkeys(ARMS, SignalKind.TRAFFIC_LIGHT), phases))
        distance, speed = {"far": (60.0, 8.0), "red": (30.0, 8.0), "blocked": (1.0, 0.0)}[oncoming]
        control.announce(1, way_in("n"), across("n", "s"), 1.0, distance=distance, speed=speed)
        if oncoming == "blocked":
            assert control.request(1, 1.0, room=lambda others: False) is Wait.NO_ROOM
        control.announce(2, way_in("s"), across("s", "w"), 1.0, distance=2.0, speed=2.0)
        assert control.request(2, 1.0, room=lambda others: True) is None, oncoming


def test_left_turn_lets_go_first_who_starts_at_the_same_green_light() -> None:
    control = JunctionControl(lit_crossing("ew", green=5.0))
    answers = {}
    for now in (8.5, 8.9, 9.1):  # all stand; green from 9 s on; the left turn happens to ask first
        for key, start, end in ((1, "s", "w"), (2, "n", "s")):
            control.announce(key, way_in(start), across(start, end), now, distance=1.0, speed=0.0)
        answers = {key: control.request(key, now, room=lambda others: True) for key in (1, 2)}
    assert answers == {1: Wait.GIVING_WAY, 2: None}


def oncoming_stream(control: JunctionControl, now: float, let_in: bool) -> None:
    """Somebody with priority is always two seconds away from the line, and is not let in."""
    key = 100 + int(now / 2)
    control.announce(key, way_in("n"), across("n", "s"), now, distance=8.0 * (2.0 - now % 2), speed=8.0)
    if let_in:
        control.request(key, now, room=lambda others: True)


def test_left_turn_may_use_the_yellow_when_nobody_comes() -> None:
    control = JunctionControl(lit_crossing("ns", green=15.0))
    entered = math.inf
    for now in np.arange(0.0, 19.0, DT):
        if now < 14.0:
            oncoming_stream(control, now, let_in=False)
        else:
            control.announce(99, way_in("n"), across("n", "s"), now, distance=20.0, speed=8.0)  # it can stop
        control.announce(1, way_in("s"), across("s", "w"), now, distance=1.0, speed=0.0)
        if control.request(1, now, room=lambda others: True) is None:
            entered = min(entered, now)
    assert 15.0 <= entered < 18.0


@pytest.mark.parametrize("sign", [None, SignalKind.YIELD])
def test_who_gives_way_to_an_endless_stream_has_its_turn_after_a_while(sign: SignalKind | None) -> None:
    control = JunctionControl(crossing({"s": sign} if sign else {}))
    entered = math.inf
    for now in np.arange(0.0, 60.0, DT):
        oncoming_stream(control, now, let_in=False)
        control.announce(1, way_in("s"), across("s", "w"), now, distance=1.0, speed=0.0)
        if control.request(1, now, room=lambda others: True) is None:
            entered = min(entered, now)
    assert 25.0 < entered < 35.0


# --- signs --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("who", ["car", "traffic"])
def test_stop_sign_is_stood_at(who: str) -> None:
    world = world_in(crossing({"s": SignalKind.STOP}), "s" if who == "car" else "n", 60.0)
    if who == "car":
        turn(world, "straight")
        mover = world.car
    else:
        mover = add(away(world), "s", "n", 60.0)
    slowest, reasons = math.inf, set()
    while mover.position[1] > 12.0 and world.time < 30.0:
        world.step(1)
        slowest = min(slowest, float(mover.speed) if mover.position[1] < 12.0 + 2.5 + 3.5 else math.inf)
        reasons.add(world.hazard.kind if world.hazard else None)
    assert world.time < 20.0
    assert slowest < 0.3
    assert (ObjectClass.TRAFFIC_SIGN in reasons) == (who == "car")


def test_nobody_stands_at_a_yield_sign_when_the_way_is_free() -> None:
    world = away(world_in(crossing({"s": SignalKind.YIELD}), "n"))
    mover = add(world, "s", "n", 60.0)
    slowest = math.inf
    while not has_left(mover) and world.time < 20.0:
        world.step(1)
        slowest = min(slowest, mover.speed)
    assert slowest > 4.0


def test_yield_sign_lets_the_main_road_pass() -> None:
    world = world_in(crossing({"s": SignalKind.YIELD}), station=75.0)
    main = [add(world, "e", "w", 70.0), add(world, "e", "w", 45.0)]
    turn(world, "straight")
    reasons = set()

    def crosses() -> bool:
        reasons.add(world.hazard.kind if world.hazard else None)
        return bool(world.town.lanes[world.planner.lane].in_junction)

    assert watch(world, 30.0, crosses) < 30.0
    assert all(vehicle.lane_id == way_out("w") for vehicle in main)
    assert ObjectClass.TRAFFIC_SIGN in reasons


# --- without lights and signs -------------------------------------------------------------------------------------


@pytest.mark.parametrize("way", [1, 2, 3])  # left, straight on, right
@pytest.mark.parametrize("sign", [None, SignalKind.STOP])
def test_four_cars_at_a_crossing_of_equals_all_get_across(way: int, sign: SignalKind | None) -> None:
    world = away(world_in(crossing(dict.fromkeys(ARMS, sign) if sign else {})))
    four = [add(world, arm, ARMS[(k + way) % 4], 80.0) for k, arm in enumerate(ARMS)]
    assert watch(world, 60.0, lambda: all(has_left(vehicle) for vehicle in four)) < 45.0
    assert not any(vehicle.crashed for vehicle in four)


def test_who_has_no_room_lets_in_who_came_later() -> None:
    control = JunctionControl(crossing())
    first, second = across("s", "n"), across("e", "w")
    control.announce(1, way_in("s"), first, 0.0, distance=1.0, speed=0.0)
    assert control.request(1, 0.0, room=lambda others: False) is Wait.NO_ROOM
    control.announce(2, way_in("e"), second, 0.1, distance=1.0, speed=0.0)
    assert control.request(2, 0.1, room=lambda others: True) is None
    assert control.request(1, 0.2, room=lambda others: True) is Wait.OCCUPIED
    control.release(2)
    assert control.request(1, 0.3, room=lambda others: True) is None


def test_first_come_is_first_served() -> None:
    control = JunctionControl(crossing())
    control.announce(9, way_in("s"), across("s", "w"), 0.0, distance=1.0, speed=0.0)
    assert control.request(9, 0.0, room=lambda others: True) is None
    answers = {}
    for now in (0.1, 0.2, 0.3):
        control.note(9, across("s", "w") if now < 0.25 else way_out("w"), 5.0, now)
        for key, arm in ((2, "n"), (1, "e")):  # the one who came later asks before the other
            if key == 1 or now > 0.15:
                control.announce(
                    key, way_in(arm), across(arm, "w" if arm == "e" else "s"), now, distance=1.0, speed=0.0
                )
                answers[key] = control.request(key, now, room=lambda others: True)
    assert answers == {1: None, 2: Wait.TURN}


def test_unused_permission_lapses() -> None:
    control = JunctionControl(crossing())
    control.announce(7, way_in("s"), across("s", "n"), 0.0, distance=1.0, speed=0.0)
    assert control.request(7, 0.0, room=lambda others: True) is None
    for now in (0.1, 1.0, 2.0):
        control.announce(8, way_in("e"), across("e", "w"), now, distance=1.0, speed=0.0)
        waits = control.request(8, now, room=lambda others: True)
        assert waits is (Wait.OCCUPIED if now < 1.5 else None)
        control.note(7, way_in("s"), 0.0, now + 0.05)  # it stands and asks no more
    assert control.holds(7) is None


def test_closed_junction_lets_nobody_in() -> None:
    town = crossing()
    control = JunctionControl(town)
    junction = town.junctions[0].id
    assert control.close(0, junction, 0.0)
    control.announce(1, way_in("s"), across("s", "n"), 0.5, distance=1.0, speed=0.0)
    assert control.request(1, 0.5, room=lambda others: True) is Wait.CLOSED
    assert control.request(1, 2.0, room=lambda others: True) is None
    assert not control.close(0, junction, 2.1)


def test_no_more_are_let_in_than_have_room_behind_the_junction() -> None:
    world = away(world_in(crossing(), "n"))
    stopped = add(world, "e", "n", 100.0, 0.0)
    stopped.position = world.town.lanes[way_out("n")].position(24.0)
    stopped.act = lambda action=None: None  # type: ignore[method-assign]
    stopped.speed = 0.0
    stopped.on_state_update()
    row = [add(world, "s", "n", station) for station in (90.0, 76.0, 62.0)]
    run(world, 25.0)
    assert not any(vehicle.lane.town_lane.in_junction for vehicle in row)
    assert has_left(row[0])


# --- all together -------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.parametrize("lights", [False, True])
@pytest.mark.parametrize("name", ["brookside", "Town02"])
def test_no_gridlock_in_five_minutes_with_thirty_vehicles(name: str, lights: bool) -> None:
    town = network(name).town
    town = lit(town) if lights else town
    site = town.sites[1]
    config = WorldConfig(vehicles=30, pedestrians=0)
    world = away(World(town, config, seed=np.random.SeedSequence(6), departure=(site.lane, site.station)))
    before = {vehicle.key for vehicle in world.actors.vehicles}
    run(world, 240.0)
    places = {vehicle.key: vehicle.position.copy() for vehicle in world.actors.vehicles}
    farthest = dict.fromkeys(places, 0.0)
    for _ in range(60):
        run(world, 1.0)
        for vehicle in world.actors.vehicles:
            if vehicle.key in places:
                way = math.hypot(*(vehicle.position - places[vehicle.key]))
                farthest[vehicle.key] = max(farthest[vehicle.key], way)
    assert len(before & set(places)) >= len(before) - 1  # hardly anybody had to be towed
    assert min(farthest.values()) > 10.0
