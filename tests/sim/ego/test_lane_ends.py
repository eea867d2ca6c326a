"""Lanes that end: the car, the traffic and routes leave them in time, and also from a standstill at their end."""

from pathlib import Path

import numpy as np
import pytest

from dorothie_gym.maps import load_town
from dorothie_gym.maps.routing import LaneEntry, router
from dorothie_gym.maps.town import LightColour, Town
from dorothie_gym.ontology.actions import PhysicalAction
from dorothie_gym.sim.batch.worlds import step_alone
from dorothie_gym.sim.config import WorldConfig
from dorothie_gym.sim.network.network import network_of
from dorothie_gym.sim.population import add_vehicle
from dorothie_gym.sim.state.town_arrays import town_arrays
from dorothie_gym.sim.state.world_arrays import empty_world
from dorothie_gym.sim.traffic.parameters import CAR_WIDTH
from dorothie_gym.sim.world import World
from tests.maps.ending_lanes import dead_end, ring, stub, taper
from tests.maps.opendrive_text import MAPS

EMPTY = WorldConfig(vehicles=0, pedestrians=0)


def start(town: Town, lane: int, station: float, config: WorldConfig = EMPTY, seed: int = 3) -> World:
    return World(town, config, seed=np.random.SeedSequence(seed), departure=(lane, station), network=network_of(town))


def ending(town: Town) -> list[int]:
    return [lane.id for lane in town.lanes if town.merge(lane.id) is not None]


@pytest.fixture
def tapers(tmp_path: Path) -> Town:
    return load_town(ring(tmp_path / "tapers.xodr"))


@pytest.mark.parametrize("before_end", [150.0, 60.0, 20.0, 5.0, 0.5])
def test_car_leaves_a_lane_before_it_is_too_narrow(tapers: Town, before_end: float) -> None:
    lane = tapers.lanes[ending(tapers)[0]]
    world = start(tapers, lane.id, lane.length - before_end)
    for _ in range(50):
        world.step(15)
        here = world.planner.lane
        if here == lane.id and before_end > 60.0:
            assert lane.width_at(world.planner.station) > CAR_WIDTH
    assert here != lane.id
    assert world.planner.lane in (*(link.target for link in tapers.successors(here)), here)
    assert world.car.speed > 5.0


def test_switch_out_of_a_lane_is_feasible_up_to_its_end(tapers: Town) -> None:
    lane = tapers.lanes[ending(tapers)[0]]
    world = start(tapers, lane.id, lane.length - 1.0)
    assert world.ego.apply(PhysicalAction.STOP) is None
    assert world.planner.feasible(0.0).switch_left
    assert world.ego.apply(PhysicalAction.LANE_SWITCH, angle=90) is None
    for _ in range(30):
        world.step(15)
    assert world.planner.lane != lane.id


def test_no_switch_leads_into_a_lane_that_cannot_be_left_again(tapers: Town) -> None:
    lane = tapers.lanes[ending(tapers)[0]]
    main = tapers.neighbour(lane.id, tapers.merge(lane.id))
    far, near = (tapers.lanes[main].project(lane.position(at))[0] for at in (100.0, lane.wide_until - 20.0))
    assert start(tapers, main, far).planner.feasible(0.0).switch_right
    assert not start(tapers, main, near).planner.feasible(0.0).switch_right


def test_traffic_leaves_a_lane_from_a_standstill_at_its_end(tapers: Town) -> None:
    lane = tapers.lanes[ending(tapers)[0]]
    main = tapers.neighbour(lane.id, tapers.merge(lane.id))
    town = town_arrays(network_of(tapers))
    world = empty_world(town, vehicles=2, pedestrians=0)
    add_vehicle(town, world, lane.id, lane.length - 6.0, desired=8.0)
    add_vehicle(town, world, main, 20.0, desired=8.0)
    world.vehicles[0].speed = 0.0
    for _ in range(40):
        step_alone(town, world, 15, 1.0 / 30.0)
    assert world.vehicles[0].lane != lane.id
    assert world.vehicles[0].speed > 2.0


def test_routes_change_lanes_up_to_the_end_of_a_lane(tapers: Town) -> None:
    lane = tapers.lanes[ending(tapers)[0]]
    main = tapers.neighbour(lane.id, tapers.merge(lane.id))
    for before_end in (100.0, 30.0, 12.0, 3.0, 0.0):
        route = router(tapers).route((lane.id, lane.length - before_end), (main, 30.0))
        assert route is not None
        assert route.legs[1].entry is LaneEntry.CHANGE_LEFT


def test_car_turns_round_from_the_right_lane_of_a_dead_end(tmp_path: Path) -> None:
    town = load_town(dead_end(tmp_path / "dead_end.xodr"))
    right = next(lane for lane in town.lanes if lane.lane_id == -2)
    assert not start(town, right.id, right.length - 40.0).planner.feasible(0.0).u_turn
    world = start(town, right.id, right.length - 4.0)
    assert world.planner.feasible(0.0).u_turn
    assert world.ego.apply(PhysicalAction.U_TURN) is None
    for _ in range(30):
        world.step(15)
    assert town.lanes[world.planner.lane].lane_id > 0


def stuck_places(town: Town, config: WorldConfig) -> list[tuple[int, float]]:
    """Places in the last 20 m of lanes from which the car neither drives on nor may do anything within 30 s.

    The time in which a light is red does not count.
    """
    found = []
    for lane in town.lanes:
        for back in (20.0, 8.0, 0.5):
            world = start(town, lane.id, max(lane.length - back, 0.0), config, lane.id)
            begin = world.car.position.copy()
            waited = 0
            while waited < 60:
                waited += town.light(world.planner.lane, world.time) in (None, LightColour.GREEN)
                feasible = world.planner.feasible(float(world.car.speed))
                acts = feasible.switch_left or feasible.switch_right or feasible.u_turn
                turns = feasible.j_turn and world.planner.choice[0] >= 0
                if acts or turns or np.hypot(*(world.car.position - begin)) > 25.0:
                    break
                world.step(15)
            else:
                found.append((lane.id, back))
    return found


@pytest.mark.parametrize("draw", [ring, dead_end, stub])
def test_some_action_leads_on_from_the_end_of_each_lane(tmp_path: Path, draw) -> None:
    assert not stuck_places(load_town(draw(tmp_path / "map.xodr")), WorldConfig())


def test_two_lanes_that_end_together_are_left_one_after_the_other(tmp_path: Path) -> None:
    town = load_town(ring(tmp_path / "map.xodr", right=taper(-2) + taper(-3)))
    assert len(ending(town)) == 4
    assert not stuck_places(town, EMPTY)


@pytest.mark.long
@pytest.mark.parametrize(
    "name",
    [
        "brookside",
        *(pytest.param(name, marks=pytest.mark.slow) for name in ("midtown", "millbrook", "northgate")),
        *(pytest.param(name, marks=pytest.mark.slow) for name in ("Town01", "Town02", "Town05")),
    ],
)
def test_some_action_leads_on_from_the_end_of_each_lane_of_whole_maps(name: str) -> None:
    path = MAPS / f"{name}.xodr"
    if name.startswith("Town") and not path.is_file():
        pytest.skip("../shared/maps is not there")
    assert not stuck_places(load_town(path if path.is_file() else name), WorldConfig())
