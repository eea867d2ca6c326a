from collections import Counter
from functools import cache
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from dorothie_gym.maps.model import Lane, LinkType, SignalKind
from dorothie_gym.maps.opendrive import read_opendrive
from dorothie_gym.maps.town import Town

from .opendrive_text import shared_map

TOWNS = ("Town01", "Town02", "Town05")


@cache
def _read(path: Path) -> Town:
    return read_opendrive(path)


@pytest.fixture
def town(request: pytest.FixtureRequest) -> Town:
    return _read(shared_map(request.param))


every_town = pytest.mark.parametrize("town", TOWNS, indirect=True)


def _components(town: Town, *, lane_changes: bool) -> list[int]:
    links = [link for link in town.links if lane_changes or not link.type.is_lane_change]
    ends = [link.source for link in links], [link.target for link in links]
    graph = coo_matrix((np.ones(len(links)), ends), shape=(len(town.lanes),) * 2)
    _, part = connected_components(graph, directed=True, connection="strong")
    return sorted(np.bincount(part).tolist(), reverse=True)


@pytest.mark.parametrize(
    ("town", "lanes", "links", "components", "kilometres"),
    [
        ("Town01", 124, 160, [124], 6.40),
        ("Town02", 88, 112, [88], 2.92),
        ("Town05", 486, 604, [454, 8, 8, 8, 8], 23.48),
    ],
    indirect=["town"],
)
def test_counts_are_those_of_the_published_town_graphs(
    town: Town, lanes: int, links: int, components: list[int], kilometres: float
) -> None:
    assert len(town.lanes) == lanes
    assert sum(not link.type.is_lane_change for link in town.links) == links
    assert _components(town, lane_changes=False) == components
    assert _components(town, lane_changes=True) == [lanes]
    assert round(town.kilometres, 2) == kilometres


@every_town
def test_lanes_are_numbered_by_index_and_well_sampled(town: Town) -> None:
    assert [lane.id for lane in town.lanes] == list(range(len(town.lanes)))
    for lane in town.lanes:
        steps = np.diff(lane.stations)
        assert steps.min() > 0.05
        assert steps.max() <= 20.0
        turned = np.abs(np.diff(np.unwrap(np.arctan2(*np.diff(lane.points[:, 1::-1], axis=0).T[::1]))))
        bent = np.flatnonzero(turned > 0.05)
        assert np.all(np.minimum(steps[bent], steps[bent + 1]) <= 2.0 + 1e-6)
        assert lane.points.shape == (len(lane.widths), 3)
        assert np.all(lane.widths > 0.0)


@every_town
def test_linked_lanes_meet_without_gap_or_kink(town: Town) -> None:
    for link in town.links:
        if not link.type.is_lane_change:
            before, after = town.lanes[link.source], town.lanes[link.target]
            assert np.linalg.norm(before.points[-1] - after.points[0]) < 0.05
            kink = (before.headings[-1] - after.headings[0] + np.pi) % (2 * np.pi) - np.pi
            assert abs(np.degrees(kink)) < 5.0


@every_town
def test_successor_links_come_before_lane_changes_and_once(town: Town) -> None:
    pairs = [(link.source, link.target) for link in town.links]
    assert len(set(pairs)) == len(pairs)
    changes = [link.type.is_lane_change for link in town.links]
    assert changes == sorted(changes)


@every_town
def test_turns_are_typed_by_the_side_they_lead_to(town: Town) -> None:
    for link in town.links:
        before, after = town.lanes[link.source], town.lanes[link.target]
        if not link.type.is_lane_change and after.in_junction and not before.in_junction:
            heading = before.headings[-1]
            ahead, right = np.array([np.cos(heading), np.sin(heading)]), np.array([-np.sin(heading), np.cos(heading)])
            way = after.points[-1, :2] - after.points[0, :2]
            if link.type is LinkType.LEFT:
                assert way @ right < 0.0
            elif link.type is LinkType.RIGHT:
                assert way @ right > 0.0
            else:
                assert way @ ahead > abs(way @ right)
        elif not link.type.is_lane_change:
            assert link.type is LinkType.STRAIGHT


def test_lanes_beside_one_another_are_linked_on_the_right_side() -> None:
    town = _read(shared_map("Town05"))
    changes = [link for link in town.links if link.type.is_lane_change]
    assert changes
    for link in changes:
        here, there = town.lanes[link.source], town.lanes[link.target]
        assert here.road_id == there.road_id
        assert not here.in_junction
        assert here.lane_id * there.lane_id > 0
        _, lateral = here.project(there.position(0.5 * there.length))
        assert (lateral > 0) == (link.type is LinkType.LANE_CHANGE_RIGHT)
        assert 2.5 < abs(lateral) < 4.5
    sides = Counter((link.source, link.type) for link in changes)
    assert max(sides.values()) == 1


@every_town
def test_traffic_keeps_to_the_right_of_its_road(town: Town) -> None:
    by_road: dict[int, list[Lane]] = {}
    for lane in town.lanes:
        if not lane.in_junction:
            by_road.setdefault(lane.road_id, []).append(lane)
    for lanes in by_road.values():
        for a, b in combinations(lanes, 2):
            if a.lane_id * b.lane_id < 0 and min(a.length, b.length) > 20.0:
                _, lateral = a.project(b.position(0.5 * b.length))
                assert lateral < 0.0


def test_town02_has_its_24_traffic_lights_and_each_rules_an_approach() -> None:
    town = _read(shared_map("Town02"))
    assert Counter(signal.kind for signal in town.signals) == {SignalKind.TRAFFIC_LIGHT: 24}
    for signal in town.signals:
        assert signal.lanes
        for index in signal.lanes:
            lane = town.lanes[index]
            assert not lane.in_junction
            assert all(town.lanes[link.target].in_junction for link in town.successors(index))
            station, lateral = lane.project(np.array(signal.position[:2]))
            assert lane.length - station < 15.0
            assert 0.0 < lateral < 6.0  # at the driver's right, and facing the driver
            assert np.cos(signal.heading - lane.headings[-1]) < -0.9


def test_speed_limits_are_in_metres_per_second() -> None:
    limits = {round(lane.speed_limit / 0.44704) for lane in _read(shared_map("Town05")).lanes}
    assert limits == {35, 55, 65}  # mph, as the file says


@every_town
def test_every_connector_belongs_to_one_junction(town: Town) -> None:
    listed = sorted(index for junction in town.junctions for index in junction.connectors)
    assert listed == [lane.id for lane in town.lanes if lane.in_junction]
    for junction in town.junctions:
        for index in junction.connectors:
            assert town.lanes[index].junction_id == junction.id
            middle = town.lanes[index].position(0.5 * town.lanes[index].length)
            assert np.hypot(*(middle - junction.position)) < 50.0


def _crossings(a: Lane, b: Lane) -> list[float]:
    """Differences of height where two centre lines cross in the plane."""
    p, r = a.points[:-1], np.diff(a.points, axis=0)
    q, s = b.points[:-1], np.diff(b.points, axis=0)
    gap = q[None] - p[:, None]
    across = r[:, None, 0] * s[None, :, 1] - r[:, None, 1] * s[None, :, 0]
    with np.errstate(all="ignore"):
        t = (gap[..., 0] * s[None, :, 1] - gap[..., 1] * s[None, :, 0]) / across
        u = (gap[..., 0] * r[:, None, 1] - gap[..., 1] * r[:, None, 0]) / across
    hits = np.argwhere((t > 0) & (t < 1) & (u > 0) & (u < 1))
    return [float(abs(p[i, 2] + t[i, j] * r[i, 2] - q[j, 2] - u[i, j] * s[j, 2])) for i, j in hits]


def test_three_pairs_of_roads_cross_at_different_heights_in_town05() -> None:
    town = _read(shared_map("Town05"))
    plain = [lane for lane in town.lanes if not lane.in_junction]
    pairs: dict[tuple[int, int], list[float]] = {}
    for a, b in combinations(plain, 2):
        apart = a.points[:, :2].min(0) > b.points[:, :2].max(0), b.points[:, :2].min(0) > a.points[:, :2].max(0)
        if a.road_id != b.road_id and not np.any(apart) and (heights := _crossings(a, b)):
            pairs.setdefault((min(a.road_id, b.road_id), max(a.road_id, b.road_id)), []).extend(heights)
    over = {pair: heights for pair, heights in pairs.items() if min(heights) > 1.0}
    assert len(over) == 3
    assert all(5.0 < height < 15.0 for heights in over.values() for height in heights)


def test_reading_twice_gives_the_same_town() -> None:
    path = shared_map("Town02")
    first, second = read_opendrive(path), read_opendrive(str(path))
    assert first.links == second.links
    assert first.sites == second.sites
    assert first.streets == second.streets
    assert all(np.array_equal(a.points, b.points) for a, b in zip(first.lanes, second.lanes, strict=True))


@every_town
def test_every_exit_leads_out_of_the_junction_at_its_own_angle(town: Town) -> None:
    for lane in town.lanes:
        exits = town.exits(lane.id)
        assert exits
        assert len({e.angle for e in exits}) == len(exits)
        if not lane.in_junction:
            assert not any(town.lanes[e.lane].in_junction for e in exits)
