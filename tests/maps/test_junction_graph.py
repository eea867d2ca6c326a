from __future__ import annotations

from collections import deque
from functools import lru_cache

import numpy as np
import pytest

from dorothie_gym.maps import Junction, Lane, LaneLink, LinkType, Town, load_town
from dorothie_gym.maps.lane_graph import JunctionGraph
from tests.maps.opendrive_text import shared_map

NAMES = ["brookside", "Town01", "Town02", "Town05"]


@lru_cache(maxsize=4)
def town_of(name: str) -> Town:
    return load_town(shared_map(name) if name.startswith("Town") else name)


def graph_of(name: str) -> JunctionGraph:
    return town_of(name).to_graph().meta_map


def lane(number: int, points: list[tuple[float, float]], *, road: int, junction: int = -1, lane_id: int = -1) -> Lane:
    return Lane(
        id=number,
        road_id=road,
        lane_id=lane_id,
        junction_id=junction,
        points=np.array([(x, y, 0.0) for x, y in points]),
        widths=np.full(len(points), 3.5),
        speed_limit=10.0,
    )


@pytest.mark.parametrize("name", NAMES)
def test_every_pair_of_junctions_with_nothing_between_is_joined(name: str) -> None:
    town, graph = town_of(name), graph_of(name)
    expected = set()
    for junction in town.junctions:
        queue = deque(lane.id for lane in town.lanes if lane.junction_id == junction.id)
        seen = set(queue)
        while queue:
            source = queue.popleft()
            for link in (row for row in town.links if row.source == source):
                at = town.lanes[link.target].junction_id
                if at >= 0 and at != junction.id:
                    expected.add((junction.id, at))
                elif at >= 0 and town.lanes[source].junction_id < 0:
                    expected.add((junction.id, at))
                elif link.target not in seen:
                    seen.add(link.target)
                    queue.append(link.target)
    assert {(int(graph.ids[a]), int(graph.ids[b])) for a, b in graph.edges} == expected
    assert graph.ids.tolist() == [junction.id for junction in town.junctions]
    for junction in town.junctions:
        assert graph.neighbours(junction.id) == tuple(sorted(b for a, b in expected if a == junction.id))


@pytest.mark.parametrize("name", ["brookside", "Town01", "Town02"])
def test_a_way_along_one_road_is_as_long_as_the_lane_that_leads_there(name: str) -> None:
    town, graph = town_of(name), graph_of(name)
    compared = 0
    for (_, target), length, roads in zip(graph.edges, graph.lengths, graph.roads, strict=True):
        to = int(graph.ids[target])
        leading = [
            lane.length
            for lane in town.lanes
            if lane.road_id in roads and any(town.lanes[on.target].junction_id == to for on in town.successors(lane.id))
        ]
        if len(roads) == 1 and len(leading) == 1:
            assert length == pytest.approx(leading[0])
            compared += 1
    assert compared > 8


@pytest.mark.parametrize("name", NAMES)
def test_paths_list_their_roads_and_street(name: str) -> None:
    town, graph = town_of(name), graph_of(name)
    roads = {lane.road_id: lane for lane in town.lanes if not lane.in_junction}
    for ids, street, length in zip(graph.roads, graph.streets, graph.lengths, strict=True):
        assert all(road in roads for road in ids)
        assert street == (roads[ids[0]].street if ids else -1)
        assert (length > 0.0) == bool(ids)


def test_the_shorter_of_two_paths_between_junctions_counts() -> None:
    lanes = [
        lane(0, [(-10, 0), (0, 0)], road=10, junction=5),
        lane(1, [(0, 0), (50, 40), (100, 0)], road=1),
        lane(2, [(0, 0), (100, 0)], road=2),
        lane(3, [(100, 0), (110, 0)], road=11, junction=6),
    ]
    links = [LaneLink(a, b, LinkType.STRAIGHT) for a, b in ((0, 1), (0, 2), (1, 3), (2, 3))]
    junctions = [Junction(id=k, position=(0, 0), connectors=()) for k in (5, 6)]
    graph = Town(name="two", lanes=lanes, links=links, junctions=junctions).to_graph().meta_map
    assert (graph.edges.tolist(), graph.lengths.tolist(), graph.roads) == ([[0, 1]], [pytest.approx(100.0)], ((2,),))


def test_turn_lane_without_a_lane_before_it_is_part_of_the_way() -> None:
    lanes = [
        lane(0, [(-10, 0), (0, 0)], road=10, junction=5),
        lane(1, [(0, 0), (100, 0)], road=1),
        lane(2, [(60, -3.5), (100, -3.5)], road=1, lane_id=-2),
        lane(3, [(100, -3.5), (110, -9)], road=11, junction=6),
    ]
    links = [
        LaneLink(0, 1, LinkType.STRAIGHT),
        LaneLink(2, 3, LinkType.LEFT),
        LaneLink(1, 2, LinkType.LANE_CHANGE_LEFT),
        LaneLink(2, 1, LinkType.LANE_CHANGE_RIGHT),
    ]
    junctions = [Junction(id=k, position=(0, 0), connectors=()) for k in (5, 6)]
    graph = Town(name="turn", lanes=lanes, links=links, junctions=junctions).to_graph().meta_map
    assert (graph.edges.tolist(), graph.lengths.tolist(), graph.roads) == ([[0, 1]], [pytest.approx(100.0)], ((1,),))


def test_neighbours_of_an_unknown_junction_name_those_there_are() -> None:
    with pytest.raises(KeyError, match="no junction 999; the map has 20, 76"):
        graph_of("Town02").neighbours(999)
