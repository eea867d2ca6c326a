"""People on foot before the session's car; where they walk and when they cross is tested in `kernel`."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dorothie_gym.ontology import ObjectClass, PhysicalAction
from dorothie_gym.sim.population import add_pedestrian
from dorothie_gym.sim.state.codes import Walk
from dorothie_gym.sim.state.town_arrays import town_arrays
from dorothie_gym.sim.state.world_arrays import grown
from dorothie_gym.sim.traffic_rules import WorldEventKind
from tests.sim.driving import network, world_at


def open_crosswalks(name: str) -> list[tuple[int, int, int]]:
    """Crosswalks without lights in the mouths of junctions, lanes of some length and connectors that lead onto them."""
    roads = network(name)
    arrays = town_arrays(roads)
    found = {}
    for connector in np.flatnonzero(arrays.lanes.junction >= 0).tolist():
        lane = arrays.lanes[connector]
        for passage in arrays.passages[lane.passage : lane.passage + lane.passages]:
            before = [k for k in roads.town.predecessors(connector) if arrays.lanes[k].length > 60.0]
            if arrays.crossings[passage.crossing].lights == 0 and before and passage.start < 8.0:
                found.setdefault(int(passage.crossing), (before[0], connector))
    return [(crossing, *way) for crossing, way in found.items()]


@pytest.mark.parametrize("end", [0, 1])
@pytest.mark.parametrize("which", [0, 1, 2])
def test_car_yields_to_pedestrians_on_a_crosswalk_and_then_continues(which: int, end: int) -> None:
    number, lane, connector = open_crosswalks("northgate")[which]
    roads = network("northgate")
    town, arrays = roads.town, town_arrays(roads)
    world = world_at("northgate", lane, town.lanes[lane].length - 58.0)
    state = world.actors.arrays
    world.actors.arrays = grown(arrays, state, vehicles=len(state.vehicles), pedestrians=1, props=len(state.props))
    way = next(way for way in world.planner.exits()[0] if way.connector == connector)
    world.planner.command(PhysicalAction.J_TURN, way.angle, 0.0)
    crossing = arrays.crossings[number]
    add_pedestrian(arrays, world.actors.arrays, int(crossing.walk[end]), float(crossing.station[end]), pace=0.4)
    walker = world.actors.arrays.pedestrians[0]
    walker.state, walker.crossing, walker.mouth = Walk.WAITING, number, end
    walker.direction = 1.0 if end == 0 else -1.0
    on, slowest, events = 0, math.inf, []
    for _ in range(400):
        events += world.step(5)
        walker = world.actors.arrays.pedestrians[0]
        if walker.state == Walk.CROSSING:
            on += 1
            slowest = min(slowest, float(world.car.speed))
            in_its_way = abs(float(walker.station) - passage_of(arrays, connector, number)) < 1.5
            assert not in_its_way or world.planner.lane == lane or world.planner.station < 8.0
        elif on:
            break
    assert on > 10 and slowest < 0.5
    assert not any(event.kind is WorldEventKind.COLLISION for event in events)
    reasons = {event.data["reason"] for event in events if event.kind is WorldEventKind.HAZARD_STOP}
    assert ObjectClass.PEDESTRIAN.label in reasons
    world.step(300)
    assert world.planner.lane not in (lane, connector)


def passage_of(arrays, connector: int, crossing: int) -> float:  # type: ignore[no-untyped-def]  # arrays of compiled records have no type
    """Returns the distance along a crosswalk at which a lane crosses it [m]."""
    lane = arrays.lanes[connector]
    passages = arrays.passages[lane.passage : lane.passage + lane.passages]
    return float(next(passage.across for passage in passages if passage.crossing == crossing))
