"""Tables of ways on, and measurements along centre lines, against those of the map."""

from __future__ import annotations

import numpy as np
import pytest

from dorothie_gym.maps import LinkType
from dorothie_gym.maps.lane_neighbours import oncoming_lanes
from dorothie_gym.maps.model import HEADING, HEIGHT, WIDTH
from dorothie_gym.sim.ego.manoeuvre_lanes import find_oncoming
from dorothie_gym.sim.ego.path_builder import position_on, project_on, value_on
from dorothie_gym.sim.state.town_arrays import town_arrays
from tests.sim.driving import network

TOWNS = ["brookside", "millbrook", "Town05"]


@pytest.mark.parametrize("name", TOWNS)
def test_exits_are_those_of_the_town_in_their_order(name: str) -> None:
    roads = network(name)
    town, arrays = roads.town, town_arrays(roads)
    for lane in town.lanes:
        ways = arrays.ways[lane.id]
        rows = arrays.exits[ways.exit : ways.exit + ways.exits]
        exits = town.exits(lane.id)
        assert [(row.connector, row.lane, row.angle) for row in rows] == [
            (way.connector, way.lane, way.angle) for way in exits
        ]
        assert [row.junction >= 0 for row in rows] == [way.junction_id >= 0 for way in exits]
        turns = {way.angle for way in exits if way.junction_id >= 0}
        assert bool(ways.chooses) == (len(exits) > 1 and len(turns) > 0)
        if ways.chooses or not exits:
            assert ways.onward == -1
        else:
            assert abs(next(w.angle for w in exits if w.connector == ways.onward)) == min(abs(w.angle) for w in exits)
        assert not ways.chooses or ways.offers


@pytest.mark.parametrize("name", TOWNS)
def test_lanes_beside_are_all_that_lane_changes_lead_to(name: str) -> None:
    roads = network(name)
    town, arrays = roads.town, town_arrays(roads)
    for lane in town.lanes:
        reached, todo = {lane.id}, [lane.id]
        while todo:
            one = todo.pop()
            for side in (LinkType.LANE_CHANGE_LEFT, LinkType.LANE_CHANGE_RIGHT):
                other = town.neighbour(one, side)
                if other is not None and other not in reached:
                    reached.add(other)
                    todo.append(other)
        ways = arrays.ways[lane.id]
        beside = arrays.lane_lists[ways.beside : ways.beside + ways.besides].tolist()
        assert beside[0] == lane.id
        assert sorted(beside) == sorted(reached)


@pytest.mark.parametrize("name", TOWNS)
def test_measurements_along_lanes_are_those_of_the_map_to_the_last_bit(name: str) -> None:
    roads, rng = network(name), np.random.default_rng(5)
    town, arrays = roads.town, town_arrays(roads)
    for lane in town.lanes:
        record = arrays.lanes[lane.id]
        stations = [*rng.uniform(-3.0, lane.length + 3.0, 6).tolist(), *rng.choice(lane.stations, 2).tolist()]
        for station in stations:
            assert position_on(arrays.points, record, station) == tuple(lane.position(station).tolist())
            for column, value in ((HEADING, lane.heading_at), (HEIGHT, lane.height_at), (WIDTH, lane.width_at)):
                assert value_on(arrays.points, record, column, station) == value(station)
            near = lane.position(station) + rng.normal(0.0, 4.0, 2)
            far = rng.uniform(-400.0, 400.0, 2)
            for x, y in (near.tolist(), far.tolist()):
                assert project_on(arrays, lane.id, x, y) == lane.project(np.array((x, y)))


@pytest.mark.parametrize("name", TOWNS)
def test_oncoming_lanes_are_those_of_the_map(name: str) -> None:
    roads, rng, found = network(name), np.random.default_rng(6), 0
    town, arrays, oncoming = roads.town, town_arrays(roads), oncoming_lanes(roads.town)
    for lane in town.lanes:
        for station in rng.uniform(0.0, lane.length, 5).tolist():
            expected = oncoming.at(lane.id, station)
            other, at = find_oncoming(arrays, lane.id, station)
            assert (other, at) == ((-1, 0.0) if expected is None else (expected.lane, expected.station))
            found += expected is not None
    assert found > 20
