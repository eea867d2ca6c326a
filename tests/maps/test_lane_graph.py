from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
import pytest

from dorothie_gym.maps import NO_STREET, Lane, LaneLink, LinkType, Town, load_town
from dorothie_gym.maps.lane_graph import END, FEATURES, LANE_ID, LENGTH, START, EdgeType, LaneGraph
from dorothie_gym.maps.sdn_graph import graph_to_json
from tests.maps.opendrive_text import shared_map

NAMES = ["brookside", "Town01", "Town02", "Town05"]


@lru_cache(maxsize=4)
def town_of(name: str) -> Town:
    return load_town(shared_map(name) if name.startswith("Town") else name)


@lru_cache(maxsize=4)
def graph_of(name: str) -> LaneGraph:
    return town_of(name).to_graph()


def straight(number: int, lane_id: int, xs: tuple[float, float], y: float, road: int = 1) -> Lane:
    return Lane(
        id=number,
        road_id=road,
        lane_id=lane_id,
        points=np.array([(xs[0], y, 0.0), (xs[1], y, 0.0)]),
        widths=np.full(2, 3.5),
        speed_limit=10.0,
    )


@pytest.mark.parametrize(
    ("name", "lanes", "links", "u_turns"),
    [("Town02", 88, 112, 40), ("Town01", 124, 160, 52), ("Town05", 486, 604, 218)],
)
def test_maps_have_as_many_lanes_and_links_as_sdn_counts(name: str, lanes: int, links: int, u_turns: int) -> None:
    graph = graph_of(name)
    assert (len(graph), len(graph.edges_of(EdgeType.CONCAT))) == (lanes, links)
    assert len(graph.edges_of(EdgeType.UTURN)) == u_turns


@pytest.mark.parametrize("name", NAMES)
def test_features_are_where_the_lanes_begin_and_end(name: str) -> None:
    town, graph = town_of(name), graph_of(name)
    assert graph.features.shape == (len(town.lanes), len(FEATURES)) == (len(town.lanes), 14)
    for lane, row in zip(town.lanes, graph.features, strict=True):
        assert row[START][:3] == pytest.approx(lane.points[0])
        assert row[END][:3] == pytest.approx(lane.points[-1])
        for part, heading in ((START, lane.headings[0]), (END, lane.headings[-1])):
            pitch, yaw, roll = row[part][3:]
            assert math.cos(math.radians(yaw) - heading) == pytest.approx(1.0)
            assert -180.0 <= yaw < 180.0
            assert (abs(pitch) < 20.0, roll) == (True, 0.0)
        assert (row[LENGTH], row[LANE_ID]) == (pytest.approx(lane.length), lane.lane_id)
        assert (graph.road_ids[lane.id], graph.junction_ids[lane.id]) == (lane.road_id, lane.junction_id)


@pytest.mark.parametrize("name", NAMES)
def test_edges_are_the_links_of_the_town(name: str) -> None:
    town, graph = town_of(name), graph_of(name)
    kinds = {
        EdgeType.LEFT_LANE_CHANGE: LinkType.LANE_CHANGE_LEFT,
        EdgeType.RIGHT_LANE_CHANGE: LinkType.LANE_CHANGE_RIGHT,
    }
    for edge, link in kinds.items():
        expected = {(row.source, row.target) for row in town.links if row.type is link}
        assert {(int(a), int(b)) for a, b in graph.edges_of(edge)} == expected
        have = graph.have_left if edge is EdgeType.LEFT_LANE_CHANGE else graph.have_right
        assert {int(row) for row in np.flatnonzero(have)} == {source for source, _ in expected}
    expected = {(row.source, row.target) for row in town.links if not row.type.is_lane_change}
    assert {(int(a), int(b)) for a, b in graph.edges_of(EdgeType.CONCAT)} == expected


@pytest.mark.parametrize("name", NAMES)
def test_linked_lanes_meet(name: str) -> None:
    graph = graph_of(name)
    source, target = graph.edges_of(EdgeType.CONCAT).T
    gaps = np.hypot(*(graph.features[source, 6:8] - graph.features[target, 0:2]).T)
    assert gaps.max() < 0.1


@pytest.mark.parametrize("name", NAMES)
def test_u_turns_lead_to_the_innermost_oncoming_lane_of_the_road(name: str) -> None:
    town, graph = town_of(name), graph_of(name)
    turning = set()
    for source, target in graph.edges_of(EdgeType.UTURN):
        one, two = town.lanes[source], town.lanes[target]
        assert one.road_id == two.road_id
        oncoming = [
            lane.lane_id for lane in town.lanes if lane.road_id == one.road_id and lane.lane_id * one.lane_id < 0
        ]
        assert abs(two.lane_id) == min(abs(number) for number in oncoming)
        turning.add(int(source))
    roads = {(lane.road_id, lane.lane_id > 0) for lane in town.lanes}
    assert turning == {lane.id for lane in town.lanes if (lane.road_id, lane.lane_id < 0) in roads}


def test_u_turn_leads_to_the_lane_beside_where_a_turn_lane_cuts_the_others() -> None:
    # westwards: two stretches of a through lane, the second beside a turn lane that has the number 1 there
    lanes = [
        straight(0, 1, (100, 40), -2),
        straight(1, 2, (40, 0), -5),
        straight(2, 1, (40, 0), -2),
        straight(3, -1, (0, 35), 2),
        straight(4, -1, (35, 100), 2),
    ]
    links = [LaneLink(0, 1, LinkType.STRAIGHT), LaneLink(3, 4, LinkType.STRAIGHT)]
    graph = Town(name="cut", lanes=lanes, links=links, junctions=()).to_graph()
    turns = {int(a): int(b) for a, b in graph.edges_of(EdgeType.UTURN)}
    assert turns == {0: 4, 1: 3, 2: 3, 3: 2, 4: 0}


def test_edge_is_written_once_where_successor_and_u_turn_lead_to_the_same_lane() -> None:
    lanes = [straight(0, -1, (0, 100), 2), straight(1, 1, (100, 0), -2)]
    town = Town(name="end", lanes=lanes, links=[LaneLink(0, 1, LinkType.U_TURN)], junctions=())
    graph = town.to_graph()
    assert graph.edges.tolist() == [[0, 1], [1, 0]]
    assert graph.edges_of(EdgeType.CONCAT).tolist() == [[0, 1]]


@pytest.mark.parametrize("name", NAMES)
def test_lanes_belong_to_the_streets_of_the_town(name: str) -> None:
    town, graph = town_of(name), graph_of(name)
    assert graph.num_streets == len(town.streets)
    assert graph.street.tolist() == [lane.street for lane in town.lanes]
    for street in town.streets:
        members = set(graph.members(street.id).tolist())
        assert set(street.lanes) <= members
        # besides its own a street has the connectors of the junctions that it touches, as TOTO counts them
        touched = {town.lanes[link.target].junction_id for k in street.lanes for link in town.successors(k)}
        assert touched - {-1} <= set(graph.streets[street.id].junctions)
        for row in members - set(street.lanes):
            assert town.lanes[row].junction_id in graph.streets[street.id].junctions


def test_connecting_road_that_several_streets_share_belongs_to_none() -> None:
    lanes = [straight(0, -1, (0, 50), 2, road=1), straight(1, -1, (50, 90), 2, road=2)]
    graph = Town(name="none", lanes=lanes, links=[], junctions=()).to_graph()
    assert graph.num_streets == 0
    assert graph.street.tolist() == [NO_STREET, NO_STREET]


@pytest.mark.parametrize("name", ["brookside", "Town05"])
def test_the_same_town_gives_the_same_graph(name: str) -> None:
    town = town_of(name)
    again = Town(name=town.name, lanes=town.lanes, links=town.links, junctions=town.junctions, streets=town.streets)
    assert again.to_graph() is not town.to_graph()
    assert graph_to_json(again.to_graph()) == graph_to_json(town.to_graph())
