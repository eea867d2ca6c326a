from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from dorothie_gym.maps import Town, load_town
from dorothie_gym.maps.lane_graph import END, LENGTH, START, EdgeType, LaneGraph, Repair, lane_graph
from dorothie_gym.maps.sdn_graph import parse_sdn_graph
from tests.maps.opendrive_text import shared_map

NAMES = ["brookside", "Town01", "Town02", "Town05"]


@lru_cache(maxsize=4)
def town_of(name: str) -> Town:
    return load_town(shared_map(name) if name.startswith("Town") else name)


def predecessors(graph: LaneGraph) -> list[list[int]]:
    before: list[list[int]] = [[] for _ in range(len(graph))]
    for source, target in graph.edges_of(EdgeType.CONCAT):
        before[target].append(int(source))
    return before


def faulty(town: Town) -> LaneGraph:
    """The graph of a town with the fault of SDN's files: starts are ends, ends lie on lanes before, lengths are off."""
    graph = lane_graph(town)
    features = graph.features.copy()
    for row, before in enumerate(predecessors(graph)):
        features[row, START] = graph.features[row, END]
        features[row, END] = graph.features[row, START]
        if before:
            lane = town.lanes[before[-1]]
            back = max(lane.length - 4.0 - row % 9, 0.0)
            features[row, 6:8] = lane.position(back)
            features[row, 10] = np.degrees(lane.heading_at(back)) - 360.0
        features[row, LENGTH] = 5.0 + row % 17
        features[row, 3] += 360.0
    return replace(graph, features=features)


def reread(graph: LaneGraph) -> LaneGraph:
    return parse_sdn_graph(graph.to_json(), name="x")


def has(graph: LaneGraph, flag: Repair) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    result: np.ndarray[tuple[int], np.dtype[np.bool_]] = (graph.repairs & int(flag)) != 0
    return result


@pytest.mark.parametrize("name", NAMES)
def test_ends_and_starts_are_put_right(name: str) -> None:
    true, found = lane_graph(town_of(name)), reread(faulty(town_of(name)))
    assert found.notes == ()
    np.testing.assert_array_equal(found.features[:, 6:9], true.features[:, 6:9])
    np.testing.assert_allclose(found.features[:, 9:12], true.features[:, 9:12], atol=1e-9)
    np.testing.assert_allclose(found.features[:, 0:3], true.features[:, 0:3], atol=0.01)
    turned = (found.features[:, 4] - true.features[:, 4] + 180.0) % 360.0 - 180.0
    assert np.abs(turned).max() < 5.0  # lanes that follow one another may have a kink
    assert has(found, Repair.END_FROM_START).all()
    assert has(found, Repair.START_FROM_PREDECESSOR).all()
    assert not has(found, Repair.START_UNKNOWN).any()
    np.testing.assert_array_equal(found.edges, true.edges)


@pytest.mark.parametrize("name", NAMES)
def test_lengths_are_measured_anew(name: str) -> None:
    true, found = lane_graph(town_of(name)), reread(faulty(town_of(name)))
    error = np.abs(found.features[:, LENGTH] / true.features[:, LENGTH] - 1.0)
    assert np.median(error) < 0.01
    assert np.quantile(error, 0.9) < 0.11
    measured = has(found, Repair.LENGTH_FROM_META_MAP)
    assert 10 < measured.sum() < len(found) - 10
    # lanes of one direction differ a little where the road bends
    assert error[measured].max() < 0.08
    np.testing.assert_array_equal(measured, ~has(found, Repair.LENGTH_ESTIMATED))
    inside = found.junction_ids >= 0
    assert not measured[inside].any()
    assert error[inside].max() < 0.14


@pytest.mark.parametrize("name", NAMES)
def test_repaired_graph_is_well_formed_when_it_is_read_again(name: str) -> None:
    once = reread(faulty(town_of(name)))
    again = reread(once)
    np.testing.assert_array_equal(again.features, once.features)
    np.testing.assert_array_equal(again.repairs, once.repairs)
    bare = reread(replace(once, repairs=np.zeros_like(once.repairs)))
    np.testing.assert_array_equal(bare.features, once.features)
    assert not bare.repairs.any()


@pytest.mark.parametrize("name", NAMES)
def test_well_formed_graph_is_left_alone(name: str) -> None:
    graph = lane_graph(town_of(name))
    found = reread(graph)
    np.testing.assert_array_equal(found.features, graph.features)
    assert not found.repairs.any()
    assert found.notes == ()


def without_links_to(graph: LaneGraph, row: int) -> LaneGraph:
    keep = graph.edges[:, 1] != row
    return replace(graph, edges=graph.edges[keep], edge_types=graph.edge_types[keep])


def test_lane_without_a_predecessor_is_flagged() -> None:
    graph = faulty(town_of("brookside"))
    true = lane_graph(town_of("brookside"))
    found = reread(without_links_to(graph, 12))
    assert np.flatnonzero(has(found, Repair.START_UNKNOWN)).tolist() == [12]
    assert not has(found, Repair.START_FROM_PREDECESSOR)[12]
    np.testing.assert_array_equal(found.features[12, 0:3], graph.features[12, 6:9])
    np.testing.assert_array_equal(found.features[12, 6:9], true.features[12, 6:9])


def test_lane_whose_predecessors_end_apart_is_flagged() -> None:
    graph = faulty(town_of("brookside"))
    row, before = next((row, lanes) for row, lanes in enumerate(predecessors(graph)) if len(lanes) > 1)
    graph.features[before[0], 0] += 3.0
    found = reread(graph)
    flagged = set(np.flatnonzero(has(found, Repair.START_UNKNOWN)).tolist())
    assert row in flagged
    assert len(flagged) < 5


def test_ends_that_fit_no_reading_are_left_and_flagged() -> None:
    graph = lane_graph(town_of("brookside"))
    rng = np.random.default_rng(3)
    features = graph.features.copy()
    features[:, [0, 1, 6, 7]] = rng.uniform(-500.0, 500.0, (len(graph), 4))
    found = reread(replace(graph, features=features))
    np.testing.assert_array_equal(found.features, features)
    assert (found.repairs == int(Repair.UNRELIABLE)).all()
    assert "nothing was repaired" in found.notes[0]


def test_single_gaps_of_a_well_formed_graph_are_told() -> None:
    graph = lane_graph(town_of("brookside"))
    features = graph.features.copy()
    features[0, 6] += 3.0
    links = int(np.sum(graph.edges_of(EdgeType.CONCAT)[:, 0] == 0))
    found = reread(replace(graph, features=features))
    np.testing.assert_array_equal(found.features, features)
    assert found.notes == (f"{links} links join lanes whose ends are more than 1 m apart",)
    assert reread(found).notes == found.notes


def test_graph_without_links_cannot_be_judged() -> None:
    graph = lane_graph(town_of("brookside"))
    bare = replace(graph, edges=np.zeros((0, 2), dtype=np.int64), edge_types=np.zeros(0, dtype=np.int64))
    found = reread(bare)
    np.testing.assert_array_equal(found.features, graph.features)
    assert "cannot be told" in found.notes[0]
