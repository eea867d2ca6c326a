from __future__ import annotations

import itertools
from collections import deque
from typing import Any

import numpy as np
import pytest

from dorothie_gym.maps import LinkType, Town
from dorothie_gym.maps.lane_neighbours import oncoming_lanes
from dorothie_gym.ontology import ExceptionKind, PropKind, Sensor, WeatherParameter
from dorothie_gym.session.exception_executor import FROM_CAR, ExceptionExecutor
from dorothie_gym.session.scenario import draw_scenario
from dorothie_gym.session.spaces import AdWizardAction
from dorothie_gym.session.spaces.actions import LanePosition
from dorothie_gym.sim.collisions import OrientedBox, boxes_touch
from dorothie_gym.sim.config import WorldConfig
from dorothie_gym.sim.world import World
from dorothie_gym.tasks import TaskState
from tests.sim.driving import network, run, world_at


def adversary_in(name: str = "brookside", props: int = 16, vehicles: int = 0) -> tuple[World, ExceptionExecutor]:
    town = network(name).town
    scenario = draw_scenario(town, None, 3)
    world = world_at(name, *scenario.departure, WorldConfig(vehicles=vehicles, pedestrians=0))
    return world, ExceptionExecutor(world, TaskState(scenario.storyboard), props)


def place(lane: int, metres: float, kind: ExceptionKind = ExceptionKind.PLACE_PROP, **fields: Any) -> AdWizardAction:
    return AdWizardAction(exception=kind, place=LanePosition(lane=lane, metres=round(metres)), **fields)


def crowd_of(world: World, kind: ExceptionKind) -> list[Any]:
    """Returns the actors that a spawn adds to."""
    return list(world.actors.vehicles if kind is ExceptionKind.SPAWN_VEHICLES else world.actors.pedestrians)


def free_place(world: World, adversary: ExceptionExecutor) -> AdWizardAction:
    for lane in world.town.lanes:
        for metres in range(30, int(lane.length) - 8, 5):
            action = place(lane.id, metres)
            if not lane.in_junction and adversary._unsafe(action, action.prop, without=None) is None:
                return action
    raise AssertionError("no place for a prop")


def test_prop_is_placed_moved_and_deleted() -> None:
    world, adversary = adversary_in()
    action = free_place(world, adversary)
    outcome = adversary.execute(action)
    assert isinstance(outcome, dict)
    assert (outcome["lane"], outcome["station"]) == (action.place.lane, action.place.metres)
    further = place(action.place.lane, action.place.metres + 1, ExceptionKind.MOVE_PROP, item=0)
    assert isinstance(adversary.execute(further), dict)
    assert [prop.station for prop in world.actors.props] == [action.place.metres + 1]
    assert isinstance(adversary.execute(AdWizardAction(exception=ExceptionKind.DELETE_PROP, item=0)), dict)
    assert world.actors.props == []
    for kind in (ExceptionKind.DELETE_PROP, ExceptionKind.MOVE_PROP):
        assert adversary.execute(AdWizardAction(exception=kind, item=0)) == "there is no prop 0"


def test_prop_is_refused_with_the_reason() -> None:
    world, adversary = adversary_in()
    town = world.town
    connector = next(lane.id for lane in town.lanes if lane.in_junction)
    site = max(town.sites, key=lambda s: np.hypot(*(np.array(s.waypoint) - world.car.position)))
    lane = world.planner.lane
    ahead = world.planner.station + FROM_CAR - 5.0
    cases = {
        place(9999, 5): "the town has no lane 9999",
        place(connector, 2): "a prop in a junction",
        place(site.lane, 2): "a prop stands at least 30 m into its lane",
        place(lane, 1000): "m long",
        place(site.lane, max(site.station, 30)): "it would stand where a landmark is reached",
    }
    if 30 < ahead < town.lanes[lane].length - 8:
        cases[place(lane, ahead)] = "it would appear inside the car's stopping distance"
    for action, reason in cases.items():
        outcome = adversary.execute(action)
        assert isinstance(outcome, str)
        assert reason in outcome
    assert world.actors.props == []


def test_no_more_props_than_fit() -> None:
    world, adversary = adversary_in(props=1)
    assert isinstance(adversary.execute(free_place(world, adversary)), dict)
    assert adversary.execute(place(0, 50)) == "there are 1 props already"


def search_sites(town: Town, start: tuple[int, float], blocks: dict[int, list[float]]) -> set[int]:
    """Returns the sites that are reached by driving on, changing lanes and turning round, in steps of 2 m."""
    found: set[int] = set()
    first = (start[0], int(start[1] // 2))
    queue, seen = deque([first]), {first}
    sites: dict[int, list[Any]] = {}
    for site in town.sites:
        sites.setdefault(site.lane, []).append(site)
    while queue:
        lane_id, k = queue.popleft()
        lane, station = town.lanes[lane_id], 2.0 * k
        found |= {site.id for site in sites.get(lane_id, []) if abs(site.station - station) <= 2.0}
        onward: list[tuple[int, float]] = []
        if station + 2.0 < lane.length:
            onward.append((lane_id, station + 2.0))
        else:
            onward += [(link.target, 0.0) for link in town.successors(lane_id)]
        if not lane.in_junction:
            for side in (LinkType.LANE_CHANGE_LEFT, LinkType.LANE_CHANGE_RIGHT):
                beside = town.neighbour(lane_id, side)
                if beside is not None and station + 16.0 < lane.length:
                    onward.append((beside, town.lanes[beside].project(lane.position(station + 16.0))[0]))
            oncoming = oncoming_lanes(town).at(lane_id, station)
            if oncoming is not None and town.lanes[oncoming.lane].length - oncoming.station > 6.0:
                onward.append((oncoming.lane, oncoming.station))
        for target, at in onward:
            cell = (target, int(at // 2))
            # a car stands 16 m before the middle of a prop
            if cell not in seen and not any(-1.0 < block - at < 16.0 for block in blocks.get(target, [])):
                seen.add(cell)
                queue.append(cell)
    return found


@pytest.mark.parametrize("name", ["brookside", "Town01"])
def test_prop_that_cuts_off_a_site_is_refused(name: str) -> None:
    world, adversary = adversary_in(name)
    town, rng = world.town, np.random.default_rng(0)
    start = (world.planner.lane, world.planner.station)
    before = search_sites(town, start, {})
    assert before == {site.id for site in town.sites}
    for _ in range(400):
        lane = int(rng.integers(len(town.lanes)))
        adversary.execute(place(lane, rng.uniform(0, town.lanes[lane].length)))
    assert len(world.actors.props) >= 2
    blocks: dict[int, list[float]] = {}
    for prop in world.actors.props:
        blocks.setdefault(prop.lane_id, []).append(prop.station)
    assert search_sites(town, start, blocks) == before
    for prop in world.actors.props:  # nor is the car trapped where it stops for a prop
        assert search_sites(town, (prop.lane_id, prop.station - 17.0), blocks) == before


def test_unchanged_weather_is_refused() -> None:
    world, adversary = adversary_in()
    action = AdWizardAction(exception=ExceptionKind.WEATHER, weather=WeatherParameter.FOG_DENSITY, share=0.5)
    assert adversary.execute(action) == {"parameter": str(WeatherParameter.FOG_DENSITY), "value": 50.0}
    assert adversary.execute(action) == f"{WeatherParameter.FOG_DENSITY} is 50 already"
    assert world.weather.values[WeatherParameter.FOG_DENSITY] == 50.0


def test_sensor_fault_ends_after_thirty_seconds() -> None:
    world, adversary = adversary_in()
    action = AdWizardAction(exception=ExceptionKind.SENSOR_FAULT, sensor=Sensor.GPS, on=True)
    assert adversary.execute(action) == {"sensor": str(Sensor.GPS), "on": True}
    assert isinstance(adversary.execute(action), str)
    run(world, 29.5)
    assert Sensor.GPS in world.faults
    run(world, 1.0)
    assert Sensor.GPS not in world.faults


@pytest.mark.parametrize("kind", [ExceptionKind.SPAWN_VEHICLES, ExceptionKind.SPAWN_PEDESTRIANS])
def test_spawn_reports_count_and_keeps_distance_from_ego(kind: ExceptionKind) -> None:
    world, adversary = adversary_in()
    lane = max((lane for lane in world.town.lanes if not lane.in_junction), key=lambda lane: lane.length)
    assert adversary.execute(place(lane.id, 20, kind)) == "nobody was to come: count is 0"
    outcome = adversary.execute(place(lane.id, lane.length / 2, kind, count=8, extent=80))
    assert isinstance(outcome, dict)
    assert outcome["asked"] == 8
    crowd = crowd_of(world, kind)
    assert 0 < outcome["count"] == len(crowd) <= 8
    least = FROM_CAR if kind is ExceptionKind.SPAWN_VEHICLES else 7.0
    assert min(np.hypot(*(one.position - world.car.position)) for one in crowd) >= least
    for one in crowd:
        assert outcome["x0"] <= one.position[0] <= outcome["x1"]
        assert outcome["y0"] <= one.position[1] <= outcome["y1"]


@pytest.mark.parametrize("extent", [5, 15, 40])
@pytest.mark.parametrize("kind", [ExceptionKind.SPAWN_VEHICLES, ExceptionKind.SPAWN_PEDESTRIANS])
def test_spawn_is_limited_by_room(kind: ExceptionKind, extent: int) -> None:
    world, adversary = adversary_in("midtown")
    far = [lane for lane in world.town.lanes if np.hypot(*(lane.position(40.0) - world.car.position)) > 120.0]
    lane = max((lane for lane in far if not lane.in_junction), key=lambda lane: lane.length)
    counts, outcome = [], adversary.execute(place(lane.id, lane.length / 2, kind, count=16, extent=extent))
    while isinstance(outcome, dict):
        counts.append(outcome["count"])
        outcome = adversary.execute(place(lane.id, lane.length / 2, kind, count=16, extent=extent))
    assert outcome in ("there is no room for anybody in the rectangle", "there are 30 of them in the town already")
    crowd = crowd_of(world, kind)
    assert sum(counts) == len(crowd)
    assert len(crowd) >= {5: 1, 15: 2, 40: 6}[extent]
    for one, other in itertools.combinations(crowd, 2):  # some are in the tunnel, others above it
        assert abs(one.height - other.height) > 2.5 or not boxes_touch(OrientedBox.of(one), OrientedBox.of(other))


def test_no_vehicle_is_spawned_on_a_waypoint() -> None:
    world, adversary = adversary_in()
    site = max(world.town.sites, key=lambda site: np.hypot(*(np.array(site.waypoint) - world.car.position)))
    action = place(site.lane, site.station, ExceptionKind.SPAWN_VEHICLES, count=16, extent=60)
    assert isinstance(adversary.execute(action), dict)
    for vehicle in world.actors.vehicles:
        for site in world.town.sites:
            assert vehicle.lane_id != site.lane or np.hypot(*(vehicle.position - np.array(site.waypoint))) >= 7.5


def test_spawn_distance_grows_with_speed_and_wetness() -> None:
    world, adversary = adversary_in()
    least = []
    for speed, wet in ((0.0, 0.0), (15.0, 0.0), (15.0, 1.0)):
        world.car.speed = speed
        world.weather.set_share(WeatherParameter.WETNESS, wet)
        least.append(adversary._stopping_distance())
    assert least[0] == 0.0
    assert least[1] == pytest.approx(37.5)
    assert least[2] > least[1]


def test_props_may_block_a_direction_only_with_room_to_turn_round() -> None:
    world, adversary = adversary_in("northgate")
    town, put = world.town, 0
    for lane in town.lanes:
        beside = town.neighbour(lane.id, LinkType.LANE_CHANGE_LEFT)
        if lane.in_junction or beside is None or lane.length < 90.0:
            continue
        # the car reaches one prop, changes lanes, and reaches the other
        if not isinstance(adversary.execute(place(lane.id, 40.0)), dict):
            continue
        across = town.lanes[beside].project(lane.position(40.0))[0]
        for staggered in (-18.0, 12.0):
            assert isinstance(adversary.execute(place(beside, across + staggered)), str)
        put += isinstance(adversary.execute(place(beside, across + 28.0)), dict)
    assert put >= 1


def test_placed_prop_keeps_kind_and_pose() -> None:
    world, adversary = adversary_in()
    for kind in PropKind:
        action = free_place(world, adversary)
        outcome = adversary.execute(place(action.place.lane, action.place.metres, prop=kind))
        assert isinstance(outcome, dict)
        assert outcome["prop"] == str(kind)


def test_empty_message_is_refused() -> None:
    _, adversary = adversary_in()
    assert adversary.execute(AdWizardAction(exception=ExceptionKind.MESSAGE)) == "the message is empty"
    assert adversary.execute(AdWizardAction(exception=ExceptionKind.MESSAGE, message="Hurry")) == {}
