from __future__ import annotations

import json
from functools import lru_cache
from typing import Any

import numpy as np
import pytest

from dorothie_gym.maps import NO_JUNCTION, load_town
from dorothie_gym.maps.lane_graph import END, LANE_ID, LENGTH, START, EdgeType, LaneGraph
from dorothie_gym.maps.sdn_graph import graph_to_json
from tests.maps.opendrive_text import shared_map

NAMES = ["brookside", "Town01", "Town02", "Town05"]


@lru_cache(maxsize=4)
def graph_of(name: str) -> LaneGraph:
    return load_town(shared_map(name) if name.startswith("Town") else name).to_graph()


@lru_cache(maxsize=4)
def file_of(name: str) -> dict[str, Any]:
    data: dict[str, Any] = json.loads(graph_to_json(graph_of(name)))
    return data


def values(place: dict[str, dict[str, float]]) -> list[float]:
    """The six numbers of an end of a lane in the order of `FEATURES`."""
    return [place["location"][k] for k in "xyz"] + [place["rotation"][k] for k in ("pitch", "yaw", "roll")]


def test_file_has_the_keys_of_sdn_files() -> None:
    data = file_of("brookside")
    assert set(data) == {"map", "meta_map", "num_streets", "streets"}
    assert set(data["map"]) == {"directed", "multigraph", "graph", "nodes", "adjacency"}
    node = data["map"]["nodes"][0]
    assert set(node) == {"id", "start", "end", "length", "opendriveid", "have_left", "have_right"}
    assert set(node["start"]) == {"location", "rotation"}
    assert set(node["start"]["location"]) == {"x", "y", "z"}
    assert set(node["start"]["rotation"]) == {"pitch", "yaw", "roll"}
    assert set(node["opendriveid"]) == {"road_id", "lane_id", "junction_id"}
    assert {edge["type"] for row in data["map"]["adjacency"] for edge in row} == {"concat", "uturn"}
    assert set(data["meta_map"]["nodes"][0]) == {"id", "x_axis", "y_axis", "neighbor_edge"}
    assert set(data["meta_map"]["adjacency"][0][0]) == {"id", "ids", "length"}
    assert len(data["streets"]["road_id"]) == len(data["streets"]["junction_id"]) == data["num_streets"]


def test_file_names_the_town() -> None:
    assert file_of("brookside")["map"]["graph"] == [["name", "brookside"]]


@pytest.mark.parametrize("name", NAMES)
def test_nodes_hold_the_features_of_the_lanes_to_the_last_bit(name: str) -> None:
    graph, nodes = graph_of(name), file_of(name)["map"]["nodes"]
    assert [node["id"] for node in nodes] == list(range(len(graph)))
    np.testing.assert_array_equal([values(node["start"]) for node in nodes], graph.features[:, START])
    np.testing.assert_array_equal([values(node["end"]) for node in nodes], graph.features[:, END])
    np.testing.assert_array_equal([node["length"] for node in nodes], graph.features[:, LENGTH])
    ids = [node["opendriveid"] for node in nodes]
    np.testing.assert_array_equal([row["lane_id"] for row in ids], graph.features[:, LANE_ID])
    np.testing.assert_array_equal([row["road_id"] for row in ids], graph.road_ids)
    np.testing.assert_array_equal([node["have_left"] for node in nodes], graph.have_left)
    np.testing.assert_array_equal([node["have_right"] for node in nodes], graph.have_right)
    inside = graph.junction_ids != NO_JUNCTION
    np.testing.assert_array_equal(np.array([row["junction_id"] for row in ids])[inside], graph.junction_ids[inside])


def test_no_junction_is_0_as_in_sdn_files_unless_a_junction_has_that_number() -> None:
    outside = {
        name: {node["opendriveid"]["junction_id"] for node in file_of(name)["map"]["nodes"]}
        - {int(number) for number in graph_of(name).meta_map.ids}
        for name in ("brookside", "Town02")
    }
    assert 0 in graph_of("brookside").meta_map.ids
    assert outside == {"brookside": {-1}, "Town02": {0}}


@pytest.mark.parametrize("name", NAMES)
def test_streets_are_those_of_the_graph(name: str) -> None:
    graph, data = graph_of(name), file_of(name)
    assert data["num_streets"] == graph.num_streets
    assert [tuple(row) for row in data["streets"]["road_id"]] == [street.roads for street in graph.streets]
    assert [tuple(row) for row in data["streets"]["junction_id"]] == [street.junctions for street in graph.streets]


@pytest.mark.parametrize("name", NAMES)
def test_junctions_and_the_paths_between_them_are_those_of_the_graph(name: str) -> None:
    graph, data = graph_of(name).meta_map, file_of(name)["meta_map"]
    assert [node["id"] for node in data["nodes"]] == graph.ids.tolist()
    np.testing.assert_array_equal([[node["x_axis"], node["y_axis"]] for node in data["nodes"]], graph.positions)
    rows = {number: row for row, number in enumerate(graph.ids.tolist())}
    found = [
        ((source, rows[edge["id"]]), tuple(edge["ids"]), edge["length"])
        for source, edges in enumerate(data["adjacency"])
        for edge in edges
    ]
    assert [row[0] for row in found] == [tuple(edge) for edge in graph.edges.tolist()]
    assert [row[1] for row in found] == list(graph.roads)
    assert [row[2] for row in found] == graph.lengths.tolist()


def test_lanes_of_a_street_are_those_of_its_roads_and_junctions() -> None:
    graph = graph_of("Town02")
    for number, street in enumerate(graph.streets):
        members = set(graph.members(number).tolist())
        expected = {k for k, road in enumerate(graph.road_ids) if road in street.roads}
        expected |= {k for k, junction in enumerate(graph.junction_ids) if junction in street.junctions}
        assert members == expected


@pytest.mark.parametrize("name", NAMES)
def test_layout_is_that_of_networkx_adjacency_data(name: str) -> None:
    """Edges of a row belong to the node of the same index, and name the other node by its id."""
    graph, data = graph_of(name), file_of(name)["map"]
    found = {
        (data["nodes"][row]["id"], edge["id"], edge["type"])
        for row, edges in enumerate(data["adjacency"])
        for edge in edges
    }
    expected = {(int(a), int(b), kind.value) for kind in EdgeType for a, b in graph.edges_of(kind)}
    assert found == expected
