from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from dorothie_gym.ontology import ObjectClass, PhysicalAction, PropKind
from dorothie_gym.world.actors import GOES_HOME
from dorothie_gym.world.boxes import Box, boxes_touch
from dorothie_gym.world.config import WorldConfig
from dorothie_gym.world.crosswalks import layout
from dorothie_gym.world.cyclists import FROM_EDGE, SPEEDS, Cyclist, may_ride
from dorothie_gym.world.reports import WorldEvent, WorldEventKind
from dorothie_gym.world.town import LinkType, Town
from dorothie_gym.world.town.footways import WayKind, footways
from dorothie_gym.world.town.lights import LightColour
from dorothie_gym.world.walkers import Walker
from dorothie_gym.world.world import World
from tests.world.driving import network, run, world_at


def town_with_people(name: str, people: int, vehicles: int = 0, seed: int = 1) -> World:
    site = network(name).town.sites[0]
    world = world_at(name, site.lane, site.station, WorldConfig(vehicles=vehicles, pedestrians=people), seed)
    world.planner.command(PhysicalAction.STOP, 0, 0.0)
    return world


def is_on_lane(world: World, walker: Walker) -> bool:
    roads = network(world.town.name)
    lane = roads.get_lane(roads.get_closest_lane_index(walker.position, height=walker.height))
    station, lateral = lane.local_coordinates(walker.position)
    return bool(abs(lateral) < lane.width_at(station) / 2 and 0.0 <= station <= lane.length)


def start_at_crosswalk(world: World, number: int, end: int = 0) -> Walker:
    """Somebody who comes to one end of a crosswalk and is to cross it."""
    ways = footways(world.town)
    crossing = next(k for k, way in enumerate(ways.ways) if way.crosswalk == number)
    node = ways.ways[crossing].ends[end]
    before = next(k for k in ways.at[node] if k != crossing)
    way = ways.ways[before]
    at_end = way.ends[1] == node
    walker = Walker(
        world.road, ways, world.actors.crosswalks, before, way.length if at_end else 0.0,
        key=999, rng=np.random.default_rng(0),
    )  # fmt: skip
    walker._direction, walker._next = (1 if at_end else -1), crossing
    walker.position = np.array(way.place(way.length if at_end else 0.0)[:2])
    world.road.objects.append(walker)
    world.actors.pedestrians.append(walker)
    return walker


# --- footways -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["brookside", "millbrook", "midtown", "northgate"])
def test_every_crosswalk_joins_two_pavements(name: str) -> None:
    town = network(name).town
    ways = footways(town)
    crossings = [way for way in ways.ways if way.kind is WayKind.CROSSWALK]
    assert {way.crosswalk for way in crossings} == {crosswalk.id for crosswalk in town.crosswalks}
    for way in crossings:
        assert all(len(ways.at[node]) >= 2 for node in way.ends)
        assert way.width == pytest.approx(3.0, abs=0.1)


def test_only_crosswalks_lead_over_lanes() -> None:
    for name in ("brookside", "midtown"):
        roads = network(name)
        for way in footways(roads.town).ways:
            if way.kind is WayKind.CROSSWALK:
                continue
            for station in np.linspace(0.0, way.length, 9):
                x, y, z = way.place(float(station))
                lane = roads.get_lane(roads.get_closest_lane_index(np.array([x, y]), height=z))
                at, lateral = lane.local_coordinates(np.array([x, y]))
                inside = 0.0 < at < lane.length and abs(lateral) < lane.width_at(at) / 2
                assert not inside, (name, way.kind, x, y)


def test_lanes_cross_a_crosswalk_where_its_outline_is() -> None:
    town = network("midtown").town
    found = layout(town)
    assert {span.crosswalk for spans in found.spans.values() for span in spans} == {c.id for c in town.crosswalks}
    for lane, spans in found.spans.items():
        for span in spans:
            middle = town.lanes[lane].position((span.start + span.end) / 2)
            outline = town.crosswalks[span.crosswalk].outline
            sides = [cross(outline[k] - outline[k - 1], middle - outline[k - 1]) for k in range(len(outline))]
            assert all(side >= -0.5 for side in sides) or all(side <= 0.5 for side in sides)
            assert 1.0 < span.end - span.start < 25.0


def cross(one: np.ndarray, other: np.ndarray) -> float:
    return float(one[0] * other[1] - one[1] * other[0])


# --- walking ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["brookside", "midtown"])
def test_people_walk_on_pavements_and_step_on_lanes_at_crosswalks_only(name: str) -> None:
    world = town_with_people(name, 30)
    assert len(world.actors.pedestrians) == 30
    last = [walker.position.copy() for walker in world.actors.pedestrians]
    walked, crossed = np.zeros(30), set()
    for _ in range(240):
        world.step(5)
        for k, walker in enumerate(world.actors.pedestrians):
            assert isinstance(walker, Walker)
            step = float(np.hypot(*(walker.position - last[k])))
            assert step < 5 / 30 * 1.7
            walked[k] += step
            last[k] = walker.position.copy()
            if walker.crosswalk >= 0:
                crossed.add((walker.key, walker.crosswalk))
            else:
                assert not is_on_lane(world, walker)
    assert walked.min() > 0.0
    assert walked.mean() > 25.0
    assert crossed


def test_people_keep_out_of_one_anothers_way() -> None:
    world = town_with_people("brookside", 60)
    for _ in range(120):
        world.step(5)
        boxes = [Box.of(walker) for walker in world.actors.pedestrians]
        assert not any(boxes_touch(one, other) for k, one in enumerate(boxes) for other in boxes[:k])


def test_two_who_meet_head_on_pass_each_other() -> None:
    world = town_with_people("brookside", 0)
    ways = footways(world.town)
    number = max(range(len(ways.ways)), key=lambda k: ways.ways[k].length)
    walkers = []
    for station, direction in ((20.0, 1), (30.0, -1)):
        walker = Walker(
            world.road, ways, world.actors.crosswalks, number, station, key=90 + direction,
            rng=np.random.default_rng(0),
        )  # fmt: skip
        walker._direction = direction
        walker.position = np.array(ways.ways[number].place(station)[:2])
        world.road.objects.append(walker)
        world.actors.pedestrians.append(walker)
        walkers.append(walker)
    run(world, 9.0)
    assert walkers[0]._station > 28.0
    assert walkers[1]._station < 22.0


def test_people_walk_round_a_prop() -> None:
    world = town_with_people("brookside", 0)
    ways = footways(world.town)
    number = max(range(len(ways.ways)), key=lambda k: ways.ways[k].length)
    walker = Walker(
        world.road, ways, world.actors.crosswalks, number, 20.0, key=99, rng=np.random.default_rng(0)
    )  # fmt: skip
    walker._direction = 1
    prop = world.actors.add_prop(PropKind.CONSTRUCTION_CONE, 0, 40.0)
    prop.position = np.array(ways.ways[number].place(26.0)[:2])
    world.road.objects.append(walker)
    world.actors.pedestrians.append(walker)
    for _ in range(60):
        world.step(5)
        assert not boxes_touch(Box.of(walker), Box.of(prop))
    assert walker._station > 29.0


def test_towns_without_pavements_keep_their_people_beside_the_lanes() -> None:
    town = network("brookside").town
    bare = Town(
        name="bare", lanes=town.lanes, links=town.links, junctions=town.junctions, streets=town.streets,
        sites=town.sites, signals=town.signals, crosswalks=town.crosswalks, programmes=town.programmes,
    )  # fmt: skip
    world = World(
        bare, WorldConfig(vehicles=0, pedestrians=8), seed=np.random.SeedSequence(1),
        departure=(town.sites[0].lane, town.sites[0].station),
    )  # fmt: skip
    assert len(world.actors.pedestrians) == 8
    assert not any(isinstance(walker, Walker) for walker in world.actors.pedestrians)


# --- crosswalks ---------------------------------------------------------------------------------------------------


def lit_crosswalk(town: Town) -> int:
    return next(number for number, lanes in layout(town).lights.items() if lanes)


def test_people_cross_while_the_light_of_those_who_drive_is_red() -> None:
    world = town_with_people("midtown", 0)
    number = lit_crosswalk(world.town)
    crossed = 0
    for end in (0, 1) * 3:
        walker = start_at_crosswalk(world, number, end)
        for _ in range(400):
            world.step(5)
            if walker.crosswalk == number and walker.across > 1.5:
                for lane in layout(world.town).lights[number]:
                    assert world.town.light(lane, world.time) is LightColour.RED
                crossed += 1
            elif crossed and walker.crosswalk < 0:
                break
        world.road.objects.remove(walker)
        world.actors.pedestrians.remove(walker)
    assert crossed > 50


def open_crosswalk(town: Town) -> tuple[int, int, float]:
    """A crosswalk without lights, a lane that leads to it, and where on that lane it begins [m]."""
    found = layout(town)
    for lane, spans in found.spans.items():
        for span in spans:
            before = [source for source in town.predecessors(lane) if town.lanes[source].length > 60.0]
            if not found.lights[span.crosswalk] and before and town.lanes[lane].in_junction and span.start < 8.0:
                return span.crosswalk, before[0], town.lanes[before[0]].length + span.start
    pytest.skip("no crosswalk without lights")


def test_car_gives_way_to_people_on_a_crosswalk() -> None:
    town = network("northgate").town
    number, lane, line = open_crosswalk(town)
    world = world_at("northgate", lane, town.lanes[lane].length - 45.0)
    way = next(
        way
        for way in world.planner.exits()[0]
        if any(span.crosswalk == number for span in layout(town).spans.get(way.connector, ()))
    )
    world.planner.command(PhysicalAction.J_TURN, way.angle, 0.0)
    walker = start_at_crosswalk(world, number)
    slowest, events = cross_slowly(world, walker, lambda: float(world.car.speed))
    assert slowest < 0.5
    assert world.planner.station < line or world.planner.lane == lane
    assert not any(event.kind is WorldEventKind.COLLISION for event in events)
    reasons = {event.data["reason"] for event in events if event.kind is WorldEventKind.HAZARD_STOP}
    assert ObjectClass.PEDESTRIAN.label in reasons


def test_traffic_gives_way_to_people_on_a_crosswalk_and_then_goes_on() -> None:
    town = network("northgate").town
    number, lane, _ = open_crosswalk(town)
    world = town_with_people("northgate", 0)
    assert world.actors.add_vehicle(lane, town.lanes[lane].length - 45.0, distance=5.0)
    (vehicle,) = world.actors.vehicles
    connector = next(
        link.target
        for link in town.successors(lane)
        if any(span.crosswalk == number for span in layout(town).spans.get(link.target, ()))
    )
    vehicle.route = [world.network.index_of(lane), world.network.index_of(connector)]
    walker = start_at_crosswalk(world, number)
    slowest, _ = cross_slowly(world, walker, lambda: vehicle.speed)
    assert slowest < 0.5
    assert not vehicle.crashed
    run(world, 10.0, lambda: vehicle.lane_id not in (lane, connector))
    assert vehicle.lane_id not in (lane, connector)


def cross_slowly(
    world: World, walker: Walker, speed: Callable[[], float]
) -> tuple[float, list[WorldEvent]]:  # fmt: skip
    """Lets somebody cross at leisure; returns the least speed of who comes meanwhile, and the events."""
    slowest, events, on = 99.0, [], 0
    for _ in range(400):
        events += world.step(5)
        if walker.crosswalk >= 0:
            on += 1
            walker._speed = 0.35
            slowest = min(slowest, speed())
        elif on:
            break
    assert on > 10
    return slowest, events


# --- cyclists -----------------------------------------------------------------------------------------------------


def test_about_one_vehicle_in_eight_is_a_cyclist_on_a_slow_rightmost_lane() -> None:
    cyclists = vehicles = 0
    for seed in range(12):
        world = town_with_people("northgate", 0, vehicles=30, seed=seed)
        vehicles += len(world.actors.vehicles)
        for vehicle in world.actors.vehicles:
            if isinstance(vehicle, Cyclist):
                cyclists += 1
                lane = world.town.lanes[vehicle.lane_id]
                assert may_ride(lane)
                assert world.town.neighbour(lane.id, LinkType.LANE_CHANGE_RIGHT) is None
    assert 0.04 < cyclists / vehicles < 0.2


def cyclist_on(world: World, lane: int, station: float) -> Cyclist:
    world.actors._traffic_rng = AlwaysCyclist()  # type: ignore[assignment]
    assert world.actors.add_vehicle(lane, station, distance=5.0)
    (cyclist,) = world.actors.vehicles
    assert isinstance(cyclist, Cyclist)
    return cyclist


class AlwaysCyclist:
    def random(self) -> float:
        return 0.0

    def uniform(self, low: float, high: float) -> float:
        return (low + high) / 2

    def integers(self, high: int) -> int:
        return 0


def test_cyclist_is_narrow_slow_and_keeps_right() -> None:
    world = town_with_people("brookside", 0)
    lane = max((lane for lane in world.town.lanes if not lane.in_junction), key=lambda lane: lane.length)
    cyclist = cyclist_on(world, lane.id, 10.0)
    run(world, 8.0)
    assert 0.6 <= cyclist.WIDTH <= 0.7
    assert SPEEDS[0] * 0.9 <= cyclist.speed <= SPEEDS[1]
    station, lateral = lane.project(cyclist.position)
    assert lateral == pytest.approx(lane.width_at(station) / 2 - FROM_EDGE, abs=0.15)


def test_car_stays_behind_a_cyclist_where_there_is_one_lane() -> None:
    town = network("brookside").town
    lane = max((lane for lane in town.lanes if not lane.in_junction), key=lambda lane: lane.length)
    world = world_at("brookside", lane.id, 5.0)
    cyclist = cyclist_on(world, lane.id, 25.0)
    run(world, 8.0)
    assert world.planner.lane == lane.id
    gap = lane.project(cyclist.position)[0] - world.planner.station
    assert 4.0 < gap < 20.0
    assert float(world.car.speed) < SPEEDS[1] + 1.0
    assert world.collisions == 0


def test_walkers_who_do_not_get_on_go_home_and_others_come() -> None:
    world = town_with_people("brookside", 6)
    held = world.actors.pedestrians[0]
    before = list(world.actors.pedestrians)
    assert isinstance(held, Walker)
    held._speed = 0.0  # as between a wall and a car
    run(world, GOES_HOME - 2.0)
    assert held in world.actors.pedestrians
    run(world, 4.0)
    assert held not in world.actors.pedestrians and held not in world.road.objects
    assert len(world.actors.pedestrians) == len(before)
