from __future__ import annotations

import copy
import json
from collections.abc import Callable
from dataclasses import fields, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dorothie_gym.errors import TownError
from dorothie_gym.maps import load_town
from dorothie_gym.maps.lane_graph import EdgeType, JunctionGraph, LaneGraph, Repair, lane_graph
from dorothie_gym.maps.sdn_graph import parse_sdn_graph, read_sdn_graph
from tests.maps.opendrive_text import shared_map

NAMES = ["brookside", "Town01", "Town02", "Town05"]
Change = Callable[[dict[str, Any]], object]


@lru_cache(maxsize=4)
def graph_of(name: str) -> LaneGraph:
    return lane_graph(load_town(shared_map(name) if name.startswith("Town") else name))


@lru_cache(maxsize=1)
def brookside() -> dict[str, Any]:
    data: dict[str, Any] = json.loads(graph_of("brookside").to_json())
    return data


def changed(change: Change) -> str:
    data = copy.deepcopy(brookside())
    change(data)
    return json.dumps(data)


def assert_same(one: LaneGraph | JunctionGraph, two: LaneGraph | JunctionGraph) -> None:
    for field in fields(one):
        a, b = getattr(one, field.name), getattr(two, field.name)
        if isinstance(a, np.ndarray):
            assert a.dtype == b.dtype
            np.testing.assert_array_equal(a, b, err_msg=field.name)
        elif isinstance(a, JunctionGraph):
            assert_same(a, b)
        else:
            assert a == b


@pytest.mark.parametrize("name", NAMES)
def test_graphs_are_read_back_exactly(name: str, tmp_path: Path) -> None:
    graph = graph_of(name)
    file = tmp_path / "elsewhere.json"
    file.write_text(graph.to_json(), encoding="utf-8")
    found = read_sdn_graph(file)
    assert_same(graph, found)
    assert not found.repairs.any()
    assert found.to_json() == graph.to_json()


def test_flags_and_notes_are_read_back_too() -> None:
    graph = graph_of("brookside")
    flags = np.arange(len(graph), dtype=np.int64) % 3 * int(Repair.LENGTH_ESTIMATED)
    marked = replace(graph, repairs=flags, notes=("something was wrong",))
    assert_same(parse_sdn_graph(marked.to_json(), name="x"), marked)


def test_file_has_the_keys_of_sdn_files() -> None:
    data = brookside()
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


def test_no_junction_is_0_as_in_sdn_files_unless_a_junction_has_that_number() -> None:
    outside = {
        name: {node["opendriveid"]["junction_id"] for node in json.loads(graph_of(name).to_json())["map"]["nodes"]}
        - {int(number) for number in graph_of(name).meta_map.ids}
        for name in ("brookside", "Town02")
    }
    assert 0 in graph_of("brookside").meta_map.ids
    assert outside == {"brookside": {-1}, "Town02": {0}}


def test_name_is_that_of_the_file_where_it_tells_none(tmp_path: Path) -> None:
    data = copy.deepcopy(brookside())
    data["map"]["graph"] = []
    (tmp_path / "Town02.json").write_text(json.dumps(data), encoding="utf-8")
    assert read_sdn_graph(tmp_path / "Town02.json").name == "Town02"


def test_lanes_of_a_street_are_those_of_its_roads_and_junctions() -> None:
    graph = graph_of("Town02")
    data = json.loads(graph.to_json())
    data["streets"] = {"road_id": [[4, 5], [5]], "junction_id": [[], [188]]}
    data["num_streets"] = 2
    found = parse_sdn_graph(json.dumps(data), name="x")
    first, second = set(found.members(0).tolist()), set(found.members(1).tolist())
    assert first == {k for k, road in enumerate(graph.road_ids) if road in (4, 5)}
    inside = {k for k, junction in enumerate(graph.junction_ids) if junction == 188}
    assert inside and second == inside | {k for k, road in enumerate(graph.road_ids) if road == 5}
    # a road of two streets counts as one of the first
    assert {int(found.street[k]) for k in first} == {0}
    assert {int(found.street[k]) for k in inside} == {-1}


def test_stray_junctions_among_the_roads_of_streets_are_left_out() -> None:
    graph = graph_of("Town02")
    data = json.loads(graph.to_json())
    data["streets"]["road_id"].insert(7, [int(number) for number in graph.meta_map.ids[:2]])
    found = parse_sdn_graph(json.dumps(data), name="x")
    assert found.streets == graph.streets
    assert found.notes == ("streets.road_id[7] is left out: there are 8 streets",)


def test_surplus_streets_are_left_out_from_the_end() -> None:
    found = parse_sdn_graph(changed(lambda data: data["streets"]["road_id"].append([0])), name="x")
    assert found.streets == graph_of("brookside").streets
    assert found.notes == ("streets.road_id[10] is left out: there are 10 streets",)


def test_unknown_junctions_of_a_street_are_told() -> None:
    found = parse_sdn_graph(changed(lambda data: data["streets"]["junction_id"][2].append(24)), name="x")
    assert found.notes == ("streets.junction_id[2] names junctions that the map has not: [24]",)


def test_nodes_may_have_any_ids() -> None:
    def renumber(data: dict[str, Any]) -> None:
        for node in data["map"]["nodes"]:
            node["id"] = 1000 - 3 * node["id"]
        for row in data["map"]["adjacency"]:
            for edge in row:
                edge["id"] = 1000 - 3 * edge["id"]

    assert_same(parse_sdn_graph(changed(renumber), name="x"), graph_of("brookside"))


def node(data: dict[str, Any], number: int) -> dict[str, Any]:
    found: dict[str, Any] = data["map"]["nodes"][number]
    return found


MALFORMED: list[tuple[Change, str, str]] = [
    (lambda d: d.pop("map"), "map", "is missing"),
    (lambda d: d.update(map=[]), "map", "is a list; an object is expected"),
    (lambda d: d.pop("meta_map"), "meta_map", "is missing"),
    (lambda d: d.pop("num_streets"), "num_streets", "is missing"),
    (lambda d: d.update(num_streets="10"), "num_streets", "is text; a whole number is expected"),
    (lambda d: d.update(num_streets=-1), "num_streets", "is -1"),
    (lambda d: d.update(num_streets=12), "streets.road_id", "has 10 entries; num_streets is 12"),
    (lambda d: d["streets"].pop("junction_id"), "streets.junction_id", "is missing"),
    (lambda d: d["streets"]["road_id"][1].append("High"), "streets.road_id[1]", "is text; a whole number"),
    (lambda d: d["map"].pop("nodes"), "map.nodes", "is missing"),
    (lambda d: d["map"]["nodes"].pop(), "map.adjacency", "has 86 rows; one for each of 85 nodes"),
    (lambda d: node(d, 3).pop("id"), "map.nodes[3].id", "is missing"),
    (lambda d: node(d, 3).update(id=2), "map.nodes[3].id", "is 2 like that of nodes[2]"),
    (lambda d: node(d, 3).update(id=True), "map.nodes[3].id", "is true or false; a whole number"),
    (lambda d: node(d, 3).pop("start"), "map.nodes[3].start", "is missing"),
    (lambda d: node(d, 3)["end"].pop("rotation"), "map.nodes[3].end.rotation", "is missing"),
    (lambda d: node(d, 3)["end"]["location"].update(y=None), "map.nodes[3].end.location.y", "is null; a number"),
    (lambda d: node(d, 3)["end"]["location"].update(y=float("nan")), "map.nodes[3].end.location.y", "is nan"),
    (lambda d: node(d, 3)["end"]["location"].update(y=1e300), "map.nodes[3].end.location.y", "is 1e+300"),
    (lambda d: node(d, 3).update(length="7 m"), "map.nodes[3].length", "is text; a number is expected"),
    (lambda d: node(d, 3).update(have_left=0), "map.nodes[3].have_left", "is a whole number; true or false"),
    (lambda d: node(d, 3)["opendriveid"].update(lane_id=0.5), "map.nodes[3].opendriveid.lane_id", "is a number"),
    (lambda d: node(d, 3)["opendriveid"].pop("road_id"), "map.nodes[3].opendriveid.road_id", "is missing"),
    (lambda d: d["map"]["nodes"].__setitem__(3, 7), "map.nodes[3]", "is a whole number; an object"),
    (lambda d: d["map"]["adjacency"].__setitem__(3, {}), "map.adjacency[3]", "is an object; a list is expected"),
    (lambda d: d["map"]["adjacency"][3][0].update(id=86), "map.adjacency[3][0].id", "is 86, which no node has"),
    (
        lambda d: d["map"]["adjacency"][3][0].update(type="merge"),
        "map.adjacency[3][0].type",
        "is 'merge'; one of concat",
    ),
    (lambda d: d["map"]["adjacency"][3].append(d["map"]["adjacency"][3][0]), "map.adjacency[3]", "a second time"),
    (lambda d: d["map"].update(graph=[["name"]]), "map.graph[0]", "is no pair"),
    (lambda d: d["map"].update(graph=[["notes", 7]]), "map.graph.notes", "is a whole number; a list"),
    (lambda d: d["meta_map"]["nodes"][0].pop("x_axis"), "meta_map.nodes[0].x_axis", "is missing"),
    (lambda d: d["meta_map"]["adjacency"][0][0].update(ids=4), "meta_map.adjacency[0][0].ids", "is a whole number"),
    (lambda d: d["meta_map"]["adjacency"][0][0].pop("length"), "meta_map.adjacency[0][0].length", "is missing"),
    (lambda d: d["meta_map"]["adjacency"][0][0].update(id=99), "meta_map.adjacency[0][0].id", "is 99, which no node"),
]


@pytest.mark.parametrize(("change", "key", "reason"), MALFORMED, ids=[f"{k}-{r}" for _, k, r in MALFORMED])
def test_malformed_files_are_refused_with_file_and_key(change: Change, key: str, reason: str, tmp_path: Path) -> None:
    file = tmp_path / "town.json"
    file.write_text(changed(change), encoding="utf-8")
    with pytest.raises(TownError) as caught:
        read_sdn_graph(file)
    assert caught.value.source == str(file)
    assert caught.value.element.startswith(key)
    assert reason in caught.value.reason


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "line 1: is not JSON"),
        (b'{"map": \n oops}', "line 2: is not JSON"),
        (b"[1]", "map: is a list|file: is a list; an object with the key 'map' is expected"),
        (b"\xff\xfe\x00", "file: cannot be read .is not UTF-8 text."),
        (b"[" * 100_000, "file: is no town graph: .*recursion"),
        (b'{"map": ' + b"1" * 5000 + b"}", "file: is no town graph: .*digits"),
    ],
)
def test_what_is_no_json_is_refused(content: bytes, message: str, tmp_path: Path) -> None:
    file = tmp_path / "town.json"
    file.write_bytes(content)
    with pytest.raises(TownError, match=f"town.json: (?:{message})"):
        read_sdn_graph(file)


def test_file_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(TownError, match="Town09.json: file: cannot be read .No such file"):
        read_sdn_graph(tmp_path / "Town09.json")


def test_layout_is_that_of_networkx_adjacency_data() -> None:
    """Edges of a row belong to the node of the same place, and name the other by its id."""
    graph = graph_of("Town05")
    data = json.loads(graph.to_json())["map"]
    found = {
        (data["nodes"][row]["id"], edge["id"], edge["type"])
        for row, edges in enumerate(data["adjacency"])
        for edge in edges
    }
    expected = {(int(a), int(b), kind.value) for kind in EdgeType for a, b in graph.edges_of(kind)}
    assert found == expected
