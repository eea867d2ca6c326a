from __future__ import annotations

import math

import numpy as np
import pytest

from dorothie_gym.maps import Town
from dorothie_gym.maps.model import Array, SignalKind
from dorothie_gym.ontology import ObjectClass, PhysicalAction, PropKind
from dorothie_gym.sim.collisions import OrientedBox, boxes_touch
from dorothie_gym.sim.config import WorldConfig
from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.sim.traffic_rules import (
    INFRACTION_KINDS,
    WorldEvent,
    WorldEventKind,
)
from dorothie_gym.sim.world import World
from tests.sim.crossings import across, crossing, lit_crossing, way_in, way_out
from tests.sim.driving import ALONE, long_lane, network, run, world_at
from tests.sim.forcing import TOO_LATE, blind, park, straight_street, swerve
from tests.sim.state.trajectory_watch import TrajectoryWatch


def world_in(town: Town, lane: int, station: float, config: WorldConfig = ALONE) -> World:
    return World(town, config, seed=np.random.SeedSequence(1), departure=(lane, station))


def infractions(events: list[WorldEvent]) -> list[WorldEvent]:
    return [event for event in events if event.kind in INFRACTION_KINDS]


def too_late_for_the_line(town: Town) -> World:
    """A car that comes from the south, goes straight on, and is too fast to stop before the crossing."""
    world = world_in(town, way_in("s"), town.lanes[way_in("s")].length - TOO_LATE)
    assert world.planner.command(PhysicalAction.J_TURN, 0, 0.0) is None
    world.car.speed = 12.0
    return world


# --- lights and signs ---------------------------------------------------------------------------------------------


def test_running_a_red_light_is_reported_once_with_place_and_light() -> None:
    world = too_late_for_the_line(lit_crossing("ew"))
    events = infractions(run(world, 20.0))
    assert [event.kind for event in events] == [WorldEventKind.RED_LIGHT]
    data = events[0].data
    assert (data["lane"], data["key"], data["other"]) == (way_in("s"), 2, ObjectClass.TRAFFIC_LIGHT.label)
    assert data["station"] == world.town.lanes[way_in("s")].length
    assert (data["x"], data["y"]) == pytest.approx((2.0, 14.5), abs=0.5)  # its front is over the line, 12 m off
    assert 0 < events[0].frame < world.frame
    assert world.reports.infractions[WorldEventKind.RED_LIGHT] == 1


@pytest.mark.parametrize("first", ["ns", "ew"])
def test_car_that_obeys_its_light_breaks_no_rule(first: str) -> None:
    world = world_in(lit_crossing(first), way_in("s"), 60.0)
    world.planner.command(PhysicalAction.J_TURN, 0, 0.0)
    assert infractions(run(world, 45.0)) == []
    assert world.planner.lane == way_out("n")


@pytest.mark.parametrize("obeys", [True, False])
def test_stop_sign_requires_a_stand(obeys: bool) -> None:
    town = crossing({"s": SignalKind.STOP})
    world = world_in(town, way_in("s"), 60.0) if obeys else too_late_for_the_line(town)
    world.planner.command(PhysicalAction.J_TURN, 0, float(world.car.speed))
    events = infractions(run(world, 30.0))
    assert world.planner.lane == way_out("n")
    assert [event.kind for event in events] == ([] if obeys else [WorldEventKind.STOP_SIGN])
    if events:
        assert (events[0].data["key"], events[0].data["other"]) == (2, ObjectClass.TRAFFIC_SIGN.label)


@pytest.mark.parametrize("kind", [SignalKind.YIELD, SignalKind.SPEED])
def test_other_signs_require_no_stand(kind: SignalKind) -> None:
    world = world_in(crossing({"s": kind}), way_in("s"), 60.0)
    world.planner.command(PhysicalAction.J_TURN, 0, 0.0)
    world.car.speed = slowest = 8.0
    for _ in range(20):
        assert infractions(world.step(15)) == []
        slowest = min(slowest, float(world.car.speed))
    assert world.planner.lane == way_out("n")
    assert slowest > 1.0


def way(
    places: list[tuple[float, float]], heading: float, *, turning: bool = False, speeds: list[float] | None = None
) -> Array:
    """Poses at successive frames."""
    count = len(places)
    return np.column_stack(
        (
            np.array(places),
            np.full(count, heading),
            speeds or np.full(count, 8.0),
            np.zeros(count),
            np.full(count, turning),
        )
    )


def watch_in(town: Town) -> TrajectoryWatch:
    return TrajectoryWatch(TownNetwork(town))


def northwards(middle: float, count: int, step: float = 0.25) -> list[tuple[float, float]]:
    """Places on the way north to the crossing, on the right lane, the first `middle` from the crossing's [m]."""
    return [(2.0, middle - step * k) for k in range(count)]


def kinds(found: list[WorldEvent]) -> list[WorldEventKind]:
    return [event.kind for event in found]


NORTH = -math.pi / 2


def test_light_counts_at_the_frame_at_which_the_front_passes() -> None:
    town = lit_crossing("ns", green=20.0)  # green for 20 s, yellow for 3 s
    places = northwards(15.0, 4)  # the front passes the line at 12 m between the poses 2 and 3
    for frame, broken in ((0, False), (599, False), (680, False), (687, False), (689, True), (1400, True)):
        found = watch_in(town).look(way(places, NORTH), frame)
        assert kinds(found) == ([WorldEventKind.RED_LIGHT] if broken else []), frame
        assert all(breach.frame == frame + 3 for breach in found)


def test_line_is_not_passed_in_a_u_turn_or_from_the_other_side() -> None:
    town = lit_crossing("ew")
    watch = watch_in(town)
    places = northwards(15.0, 8)
    assert watch.look(way(places, NORTH, turning=True), 0) == []
    assert kinds(watch.look(way(places[::-1], -NORTH), 0)) == [WorldEventKind.WRONG_WAY]
    aside = [(x + 2.5, y) for x, y in places]  # on no lane that ends here
    assert WorldEventKind.RED_LIGHT not in kinds(watch.look(way(aside, NORTH), 0))


@pytest.mark.parametrize(("stands_at", "broken"), [(1.0, False), (3.0, False), (5.0, True), (None, True)])
def test_stand_too_far_before_the_line_does_not_count(stands_at: float | None, broken: bool) -> None:
    town = crossing({"s": SignalKind.STOP})
    watch = watch_in(town)
    places = northwards(24.5, 60)
    speeds = [0.0 if stands_at is not None and abs(y - 2.5 - 12.0 - stands_at) < 0.1 else 8.0 for _, y in places]
    assert (0.0 in speeds) == (stands_at is not None)
    # cut in two, as decisions cut it
    found = watch.look(way(places[:40], NORTH, speeds=speeds[:40]), 0)
    found += watch.look(way(places[39:], NORTH, speeds=speeds[39:]), 39)
    assert kinds(found) == ([WorldEventKind.STOP_SIGN] if broken else [])


def test_a_stand_counts_for_one_passage_only() -> None:
    town = crossing({"s": SignalKind.STOP})
    watch = watch_in(town)
    places = northwards(16.0, 12)
    speeds = [0.0] + [8.0] * 11
    assert watch.look(way(places, NORTH, speeds=speeds), 0) == []
    assert kinds(watch.look(way(places, NORTH), 0)) == [WorldEventKind.STOP_SIGN]


# --- lanes --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("beside", "off"), [(0.0, False), (1.9, False), (2.4, False), (2.6, True), (9.0, True)])
def test_road_ends_half_a_metre_outside_of_its_lanes(beside: float, off: bool) -> None:
    town = crossing()
    assert town.lanes[way_in("s")].widths[0] == 4.0
    places = [(2.0 + beside, 60.0 - k) for k in range(20)]
    found = watch_in(town).look(way(places, NORTH), 0)
    assert kinds(found) == ([WorldEventKind.OFF_ROAD] if off else [])
    for breach in found:
        assert breach.data["lane"] == way_in("s")
        assert breach.data["station"] == pytest.approx(120.0 - 59.0)
        assert breach.data["key"] is None


def test_leaving_the_road_is_reported_once_per_departure() -> None:
    town = straight_street()
    world = world_in(town, 0, 30.0)
    for _ in range(2):
        swerve(world)
        events = infractions(run(world, 8.0))
        assert [event.kind for event in events] == [WorldEventKind.OFF_ROAD]
        data = events[0].data
        assert data["lane"] == 0
        assert 0.5 < town.lanes[0].project(np.array([data["x"], data["y"]]))[1] - 2.0 < 1.0
        assert data["station"] == pytest.approx(data["x"], abs=0.01)
        assert abs(world.planner.offset) < 0.3  # back in its lane
    assert world.reports.infractions[WorldEventKind.OFF_ROAD] == 2


def test_driving_on_the_left_is_wrong_and_turning_round_is_not() -> None:
    world = world_at("brookside", long_lane(network("brookside").town), 40.0)
    assert world.planner.command(PhysicalAction.U_TURN, 0, 0.0) is None
    assert infractions(run(world, 15.0)) == []
    assert world.planner.lane != long_lane(world.town)
    world.car.heading += math.pi  # now it looks back, against its lane
    (event,) = infractions(run(world, 1.5))
    assert event.kind is WorldEventKind.WRONG_WAY
    assert event.data["lane"] == world.planner.lane
    assert event.data["other"] is None


@pytest.mark.parametrize(("degrees", "against"), [(0, False), (90, False), (115, False), (125, True), (180, True)])
def test_across_the_road_is_not_against_the_traffic(degrees: int, against: bool) -> None:
    town = crossing()
    places = [(2.0, 60.0)] * 5
    found = watch_in(town).look(way(places, NORTH + math.radians(degrees)), 0)
    assert kinds(found) == ([WorldEventKind.WRONG_WAY] if against else [])


def test_no_direction_is_wrong_in_a_junction() -> None:
    town = crossing()
    connector = town.lanes[across("s", "n")]
    x, y = connector.position(connector.length / 2)
    assert watch_in(town).look(way([(x, y)] * 5, -NORTH), 0) == []


# --- collisions ---------------------------------------------------------------------------------------------------


def test_boxes_touch_where_their_outlines_do() -> None:
    rng = np.random.default_rng(0)
    answers = []
    for _ in range(5000):
        boxes = [
            OrientedBox(*rng.uniform(-4, 4, 2), rng.uniform(-7, 7), rng.uniform(0.3, 6), rng.uniform(0.3, 3))
            for _ in "ab"
        ]
        answers.append(boxes_touch(*boxes))
        assert answers[-1] == boxes_touch(*boxes[::-1])
        assert answers[-1] == meet(*(corners(box) for box in boxes))
    assert 0.2 < np.mean(answers) < 0.8


def corners(box: OrientedBox) -> list[complex]:
    turn = complex(math.cos(box.heading), math.sin(box.heading))
    half = [complex(a * box.length / 2, b * box.width / 2) for a, b in ((1, 1), (1, -1), (-1, -1), (-1, 1))]
    return [complex(box.x, box.y) + place * turn for place in half]


def side(a: complex, b: complex, place: complex) -> float:
    """Positive where a place is on the one side of the line from a to b, negative on the other."""
    return ((b - a).conjugate() * (place - a)).imag


def meet(one: list[complex], other: list[complex]) -> bool:
    """Whether a corner of one is inside of the other, or two of their sides cross."""
    for inner, outer in ((one, other), (other, one)):
        for place in inner:
            signs = {side(outer[k - 1], outer[k], place) > 0.0 for k in range(4)}
            if len(signs) == 1:
                return True
    return any(
        side(one[i - 1], one[i], other[j - 1]) * side(one[i - 1], one[i], other[j]) < 0.0
        and side(other[j - 1], other[j], one[i - 1]) * side(other[j - 1], other[j], one[i]) < 0.0
        for i in range(4)
        for j in range(4)
    )


@pytest.mark.parametrize("kind", list(PropKind))
def test_running_into_a_prop_is_the_cars_fault_and_names_the_prop(kind: PropKind) -> None:
    world = world_at("brookside", long_lane(network("brookside").town), 2.0)
    prop = world.actors.add_prop(kind, world.planner.lane, 40.0)
    blind(world)
    events = infractions(run(world, 12.0))
    assert [event.kind for event in events] == [WorldEventKind.COLLISION]
    data = events[0].data
    assert (data["key"], data["other"], data["own_fault"]) == (prop.key, ObjectClass.STATIC.label, True)
    assert data["station"] == pytest.approx(40.0 - (kind.length + world.car.LENGTH) / 2, abs=0.6)
    assert world.actors.props == []
    assert world.collisions == 1


def test_collision_with_a_body_that_appears_too_close_is_reported() -> None:
    world = world_in(straight_street(), 0, 30.0)
    world.car.speed = 10.0
    prop = world.actors.add_prop(PropKind.STREET_BARRIER, 0, 38.0)  # 10 m/s need 6 m to stop at the very best
    (event,) = infractions(run(world, 4.0))
    assert (event.kind, event.data["key"]) == (WorldEventKind.COLLISION, prop.key)
    assert 1.0 < event.data["speed"] < 8.0
    assert event.data["own_fault"] is True


def test_running_into_a_vehicle_names_it_and_stops_both() -> None:
    world = world_at("brookside", long_lane(network("brookside").town), 2.0)
    vehicle = park(world, 30.0, speed=2.0)
    blind(world)
    events: list[WorldEvent] = []
    speeds = []
    for _ in range(240):
        events += infractions(world.step(1))
        if events:
            speeds.append((float(world.car.speed), vehicle.speed))
    (event,) = events
    assert (event.data["key"], event.data["other"]) == (vehicle.key, ObjectClass.VEHICLES.label)
    assert event.data["own_fault"] is True
    assert event.data["speed"] > 3.0
    assert speeds[0] == (0.0, 0.0)
    assert vehicle.crashed


def test_touched_pedestrian_is_reported_once() -> None:
    world = world_at("brookside", long_lane(network("brookside").town), 2.0)
    assert world.actors.add_pedestrian(world.planner.lane, 30.0)
    (walker,) = world.actors.pedestrians
    walker.position = world.town.lanes[world.planner.lane].position(30.0)
    walker.record.pace = 0.0
    blind(world)
    (event,) = infractions(run(world, 7.0))
    assert (event.data["key"], event.data["other"]) == (walker.key, ObjectClass.PEDESTRIAN.label)
    assert event.data["own_fault"] is True


def test_passing_close_by_is_no_collision() -> None:
    for gap, hit in ((0.1, False), (-0.1, True)):
        world = world_in(crossing(), way_in("s"), 2.0)
        park(world, 40.0, lateral=world.car.WIDTH + gap)
        blind(world)
        world.planner.command(PhysicalAction.J_TURN, 0, 0.0)
        assert bool(infractions(run(world, 8.0))) == hit, gap
        assert world.planner.station > 50.0 or hit


def test_being_run_into_from_behind_is_not_the_cars_fault() -> None:
    world = world_in(crossing(), way_in("s"), 40.0)
    world.planner.command(PhysicalAction.STOP, 0, 0.0)
    vehicle = park(world, 20.0, speed=8.0)
    (event,) = infractions(run(world, 4.0))
    assert event.data["key"] == vehicle.key
    assert event.data["own_fault"] is False
    assert event.data["speed"] == 0.0
    assert world.collisions == 0


def test_crash_between_others_is_not_reported() -> None:
    world = world_at("brookside", long_lane(network("brookside").town), 40.0)
    world.planner.command(PhysicalAction.STOP, 0, 0.0)
    one, other = park(world, 60.0), park(world, 80.0)
    lane = world.town.lanes[world.planner.lane]
    one.position, other.position = lane.position(46.0, -1.0), lane.position(46.5, 1.0)  # a metre before the car
    other.heading += 0.5
    world.step(15)
    assert one.crashed
    assert other.crashed
    assert world.reports.infractions[WorldEventKind.COLLISION] == 0
    assert not world.car.crashed


def test_car_that_drives_at_random_by_the_planner_breaks_no_rule() -> None:
    for name in ("brookside", "midtown"):
        town, rng = network(name).town, np.random.default_rng(3)
        world = world_at(name, town.sites[0].lane, town.sites[0].station)
        events: list[WorldEvent] = []
        for _ in range(240):
            exits, distance = world.planner.exits()
            speed = float(world.car.speed)
            if exits and world.planner.manoeuvre[0] is None and distance < 60.0:
                world.planner.command(PhysicalAction.J_TURN, exits[int(rng.integers(len(exits)))].angle, speed)
            elif rng.random() < 0.05:
                world.planner.command(PhysicalAction.U_TURN, 0, speed)
            events += world.step(15)
        assert infractions(events) == []
