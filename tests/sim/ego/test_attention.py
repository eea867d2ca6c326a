"""Automatic braking that covers only what the car perceives."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from dorothie_gym.ontology import ObjectClass, PhysicalAction, PropKind
from dorothie_gym.ontology.world_exceptions import WeatherParameter
from dorothie_gym.sim.config import FRAME_RATE, AutomaticBraking, WorldConfig
from dorothie_gym.sim.ego.attention import VIEW_PAUSE, keep_noticed
from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.sim.population import add_car
from dorothie_gym.sim.state.codes import Group
from dorothie_gym.sim.state.town_arrays import town_arrays
from dorothie_gym.sim.state.world_arrays import WorldArrays, empty_world
from dorothie_gym.sim.traffic_rules import WorldEventKind
from dorothie_gym.sim.world import World
from tests.sim.crossings import crossing, lit_crossing, way_in
from tests.sim.driving import run
from tests.sim.forcing import straight_street
from tests.sim.network.towns import lane, town

PERCEIVED = WorldConfig(vehicles=0, pedestrians=0, braking=AutomaticBraking.PERCEIVED)
COMPLETE = WorldConfig(vehicles=0, pedestrians=0)


def seen_world(*bodies: tuple[ObjectClass, float, float], delay: int = 0) -> WorldArrays:
    """A world whose ego at x = 5 m heads east and perceives bodies at (x, y) [m]; vehicles are 5 m by 2 m."""
    arrays = town_arrays(TownNetwork(town([lane(0, [(0.0, 0.0), (100.0, 0.0)])])))
    world = empty_world(arrays, vehicles=4, pedestrians=4, driven=True)
    add_car(arrays, world, 0, 5.0)
    world.car[0].attentive, world.car[0].attention = True, delay
    world.clock[0].frame = 100
    for n, (kind, x, y) in enumerate(bodies):
        row, vehicle = world.seen[n], kind is ObjectClass.VEHICLES
        row.x, row.y, row.kind, row.key, row.body = x, y, kind.value, 10 + n, n
        row.group = Group.VEHICLES if vehicle else Group.PEDESTRIANS
        row.length, row.width = (5.0, 2.0) if vehicle else (0.5, 0.5)
        row.cos, row.sin, row.distance2 = 1.0, 0.0, (x - 5.0) ** 2 + y**2
    return world


def test_a_vehicle_hides_the_person_behind_it_from_the_brakes() -> None:
    world = seen_world((ObjectClass.VEHICLES, 20.0, 3.0), (ObjectClass.PEDESTRIAN, 25.0, 4.2))
    assert keep_noticed(world, 2) == 1
    assert world.seen[0].kind == ObjectClass.VEHICLES.value


@pytest.mark.parametrize("place", [(25.0, 0.0), (15.0, 4.2), (25.0, 9.0)])
def test_a_person_beside_or_before_a_vehicle_is_in_view(place: tuple[float, float]) -> None:
    bodies = sorted([(ObjectClass.VEHICLES, 20.0, 3.0), (ObjectClass.PEDESTRIAN, *place)], key=lambda body: body[1])
    assert keep_noticed(seen_world(*bodies), 2) == 2


def test_the_brakes_act_on_what_has_been_in_view_for_a_while() -> None:
    world = seen_world((ObjectClass.PEDESTRIAN, 25.0, 0.0), delay=10)
    world.pedestrians[0].view_last = -1000
    noticed = []
    for frame in range(100, 115):
        world.clock[0].frame = frame
        noticed.append(keep_noticed(world, 1) == 1)
    assert noticed == [frame >= 110 for frame in range(100, 115)]
    world.clock[0].frame = 115 + VIEW_PAUSE  # lost from view for too long
    assert keep_noticed(world, 1) == 0


def waiting_at_red(config: WorldConfig, action: PhysicalAction) -> World:
    """A car that stands by the action Stop at a red light, and is then started by an action."""
    roads = lit_crossing("ew")
    length = roads.lanes[way_in("s")].length
    world = World(roads, config, seed=np.random.SeedSequence(1), departure=(way_in("s"), length - 5.0))
    world.planner.command(PhysicalAction.J_TURN, 0, 0.0)
    world.planner.command(PhysicalAction.STOP, 0, 0.0)
    world.step(FRAME_RATE)
    assert world.planner.held
    assert world.planner.command(action, 0, 0.0) is None
    return world


@pytest.mark.parametrize(
    ("config", "action", "runs"),
    [
        (PERCEIVED, PhysicalAction.START, True),
        (PERCEIVED, PhysicalAction.J_TURN, False),
        (COMPLETE, PhysicalAction.START, False),
    ],
)
def test_start_before_a_red_light_passes_it(config: WorldConfig, action: PhysicalAction, runs: bool) -> None:
    world = waiting_at_red(config, action)
    events = [event.kind for event in run(world, 8.0)]
    assert (WorldEventKind.RED_LIGHT in events) is runs
    assert (world.reports.infractions[WorldEventKind.RED_LIGHT] == 1) is runs


def test_start_far_before_a_red_light_stops_at_it() -> None:
    roads = lit_crossing("ew")
    length = roads.lanes[way_in("s")].length
    world = World(roads, PERCEIVED, seed=np.random.SeedSequence(1), departure=(way_in("s"), length - 30.0))
    world.planner.command(PhysicalAction.J_TURN, 0, 0.0)
    world.planner.command(PhysicalAction.STOP, 0, 0.0)
    world.step(FRAME_RATE)
    world.planner.command(PhysicalAction.START, 0, 0.0)
    run(world, 10.0)
    assert world.reports.infractions[WorldEventKind.RED_LIGHT] == 0


def test_a_car_without_a_light_obeys_the_rules_as_before() -> None:
    world = World(crossing(), PERCEIVED, seed=np.random.SeedSequence(1), departure=(way_in("s"), 60.0))
    world.planner.command(PhysicalAction.J_TURN, 0, 0.0)
    run(world, 30.0)
    assert sum(world.reports.infractions.values()) == 0


def into_fog(config: WorldConfig) -> World:
    """A car at 60 km/h in dense fog, with a roadblock 100 m ahead."""
    world = World(straight_street(), config, seed=np.random.SeedSequence(1), departure=(0, 20.0))
    world.weather.set_share(WeatherParameter.FOG_DENSITY, 1.0)
    world.ego.cruise = 60.0
    world.actors.add_prop(PropKind.STREET_BARRIER, 0, 220.0)
    return world


def test_too_fast_for_the_sight_the_car_hits_a_roadblock_by_its_own_fault() -> None:
    world = into_fog(PERCEIVED)
    (collision,) = [event for event in run(world, 25.0) if event.kind is WorldEventKind.COLLISION]
    assert collision.data["own_fault"] is True and collision.data["other"] == ObjectClass.STATIC.label
    assert world.collisions == 1


def test_complete_braking_slows_down_for_the_sight() -> None:
    world = into_fog(COMPLETE)
    run(world, 60.0)
    assert world.collisions == 0


def test_slow_enough_for_the_sight_the_car_stops_before_the_roadblock() -> None:
    world = into_fog(PERCEIVED)
    world.ego.cruise = 20.0
    run(world, 60.0)
    assert world.collisions == 0 and math.isclose(world.car.speed, 0.0, abs_tol=0.1)


@pytest.mark.parametrize(
    ("field", "value"), [("braking", "none"), ("braking_delay", 6.0), ("braking_delay", -1.0), ("density", 0.0)]
)
def test_wrong_settings_are_refused_by_name(field: str, value: object) -> None:
    with pytest.raises(ValueError, match=f"WorldConfig.{field}"):
        WorldConfig(**{field: value})  # type: ignore[arg-type]


def test_density_bounds_the_crowd_of_small_towns() -> None:
    config = WorldConfig(vehicles=60, pedestrians=40, density=10.0)
    assert config.crowd(2.1) == (21, 21) and config.crowd(5.0) == (50, 40) and config.crowd(20.0) == (60, 40)
    assert WorldConfig(vehicles=60, pedestrians=40).crowd(0.1) == (60, 40)
    roads = straight_street()  # 0.8 km of lanes
    world = World(roads, replace(config, density=5.0), seed=np.random.SeedSequence(1), departure=(0, 20.0))
    assert len(world.actors.vehicles) <= 4


def test_records_of_the_usual_braking_are_those_of_before() -> None:
    assert set(WorldConfig().record()) == {"vehicles", "pedestrians", "cruise_speed", "collisions_stop"}
    assert PERCEIVED.record()["braking"] == "perceived" and PERCEIVED.record()["braking_delay"] == 1.0
