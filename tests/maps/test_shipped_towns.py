"""Shipped towns: of the scale of the paper's towns, with all elements of road traffic."""

from __future__ import annotations

import math
from itertools import combinations, pairwise

import numpy as np
import pytest
from scipy.spatial.distance import cdist

from dorothie_gym.maps import LinkType, SignalKind, Town, describe, load_town
from dorothie_gym.maps.model import Array
from dorothie_gym.maps.routing import router

# lanes, km, junctions: from the scale of CARLA's towns in the paper
SCALE = {
    "brookside": ((60, 100), (2.5, 3.5), (8, 9)),
    "millbrook": ((110, 140), (6.0, 7.0), (12, 13)),
    "midtown": ((350, 420), (12.0, 14.0), (10, 40)),
    "northgate": ((450, 520), (20.0, 24.0), (10, 40)),
}


@pytest.mark.parametrize("name", SCALE)
def test_town_has_the_scale_of_the_papers(name: str) -> None:
    facts = describe(load_town(name))
    for value, (low, high) in zip((facts["lanes"], facts["kilometres"], facts["junctions"]), SCALE[name], strict=True):
        assert low <= value <= high
    assert facts["components_with_lane_changes"] == [facts["lanes"]]
    assert facts["sites"] == 24
    assert facts["signals"] > 0 and facts["crosswalks"] > 0


@pytest.mark.parametrize("name", ["brookside", "millbrook"])
def test_small_towns_have_single_lane_streets(name: str) -> None:
    town = load_town(name)
    assert not any(link.type.is_lane_change for link in town.links)
    for junction in town.junctions:
        arms = {town.lanes[town.predecessors(k)[0]].road_id for k in junction.connectors}
        assert len(arms) in (3, 4)


def side_by_side(town: Town, lane: int) -> int:
    """Returns the number of parallel lanes in the direction of a lane."""
    count = 1
    for side in (LinkType.LANE_CHANGE_LEFT, LinkType.LANE_CHANGE_RIGHT):
        beside = town.neighbour(lane, side)
        while beside is not None:
            count += 1
            beside = town.neighbour(beside, side)
    return count


def test_midtown_has_avenues_a_roundabout_a_one_way_pair_and_a_tunnel() -> None:
    town = load_town("midtown")
    streets = {
        street.name: [town.lanes[k] for k in street.lanes if not town.lanes[k].in_junction] for street in town.streets
    }
    assert {2, 3} <= {side_by_side(town, lane.id) for lane in town.lanes if not lane.in_junction}
    one_way = {name for name, lanes in streets.items() if all(lane.lane_id < 0 for lane in lanes)}
    ring = {
        name
        for name in one_way
        if sum(abs(float(np.sum(np.diff(lane.headings)))) for lane in streets[name]) > 3.0
        and all(lane.length < 40.0 for lane in streets[name])
    }
    assert len(ring) == 1 and len(one_way - ring) == 2
    assert {side_by_side(town, lane.id) for name in ring for lane in streets[name]} == {2}
    assert min(float(lane.points[:, 2].min()) for lane in town.lanes) <= -4.5
    assert any(not town.predecessors(lane.id) and len(town.exits(lane.id)) == 1 for lane in town.lanes)  # turn lanes


def test_northgate_has_a_ring_highway_with_ramps_and_an_overpass() -> None:
    town = load_town("northgate")
    highway = next(street for street in town.streets if street.name == "Highway")
    lanes = [town.lanes[k] for k in highway.lanes if not town.lanes[k].in_junction]
    assert max(lane.speed_limit for lane in lanes) >= 70.0 / 3.6
    carriageway = {lane.id for lane in lanes if lane.speed_limit >= 70.0 / 3.6}
    assert len(carriageway) < len(lanes)  # ramps
    yielding = {lane for signal in town.signals if signal.kind is SignalKind.YIELD for lane in signal.lanes}
    assert len(yielding & set(highway.lanes)) >= 2  # those that join
    route = router(town).route((min(carriageway), 0.0), (min(carriageway), town.lanes[min(carriageway)].length - 1.0))
    assert route is not None
    assert min(float(town.lanes[k].points[:, 2].min()) for k in carriageway) <= -4.5


def _middle(town: Town, lane: int) -> Array:
    """Points on a centre line, a metre apart (n, 2) [m]."""
    way = town.lanes[lane]
    return np.array([way.position(s) for s in np.linspace(0.0, way.length, int(way.length) + 2)])


@pytest.mark.parametrize("name", SCALE)
def test_lights_never_let_crossing_traffic_go_together(name: str) -> None:
    town = load_town(name)
    for programme in town.programmes:
        shown: dict[int, set[str]] = {signal: set() for signal in programme.signals}
        for second in range(round(programme.cycle)):
            for signal in programme.signals:
                shown[signal].add(programme.colour(signal, second + 0.5))
        assert all(len(colours) == 3 for colours in shown.values())  # each is green, yellow and red at some time
        connectors = [
            (link.target, link.source)
            for junction in town.junctions
            if junction.id == programme.junction_id
            for k in junction.connectors
            for link in town.links
            if link.target == k and link.type is LinkType.STRAIGHT
        ]
        for second in range(round(programme.cycle)):
            going = [c for c, lane in connectors if town.light(lane, second + 0.5) == "green"]
            for one, other in combinations(going, 2):
                if math.cos(town.lanes[one].headings[0] - town.lanes[other].headings[0]) > 0.8:
                    continue  # from one approach, where drivers see each other
                assert cdist(_middle(town, one), _middle(town, other)).min() > 2.5


@pytest.mark.parametrize("name", SCALE)
def test_lights_change_from_green_over_yellow_to_red(name: str) -> None:
    for programme in load_town(name).programmes:
        times = np.arange(0.0, 2 * programme.cycle, 0.25)
        for signal in programme.signals:
            colours = [programme.colour(signal, float(time)) for time in times]
            changes = {(one, two) for one, two in pairwise(colours) if one != two}
            assert changes == {("green", "yellow"), ("yellow", "red"), ("red", "green")}
