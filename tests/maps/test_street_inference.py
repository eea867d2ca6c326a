import itertools
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from dorothie_gym.maps import load_town
from dorothie_gym.maps.model import NO_STREET, Lane, LaneLink, LinkType
from dorothie_gym.maps.opendrive import read_opendrive
from dorothie_gym.maps.routing import router
from dorothie_gym.maps.site_inference import lay_sites
from dorothie_gym.maps.street_inference import name_streets
from dorothie_gym.maps.town import Town

from .ending_lanes import ring
from .opendrive_text import shared_map

TOWNS = ("Town01", "Town02", "Town05")


@cache
def _read(name: str) -> Town:
    return read_opendrive(shared_map(name))


def _lane(number: int, road: int, *points: tuple[float, float], junction: int = -1, lane_id: int = -1) -> Lane:
    return Lane(
        id=number,
        road_id=road,
        lane_id=lane_id,
        junction_id=junction,
        points=np.array([(*p, 0.0) for p in points], dtype=float),
        widths=np.full(len(points), 4.0),
        speed_limit=10.0,
    )


def _crossing() -> tuple[list[Lane], list[LaneLink]]:
    """Two one-way roads that cross: west to east (roads 1, 2), north to south (roads 3, 4), and a turn between."""
    lanes = [
        _lane(0, 1, (0, 0), (100, 0)),
        _lane(1, 2, (120, 0), (200, 0)),
        _lane(2, 3, (110, -100), (110, -10)),
        _lane(3, 4, (110, 10), (110, 90)),
        _lane(4, 10, (100, 0), (120, 0), junction=5),
        _lane(5, 11, (110, -10), (110, 10), junction=5),
        _lane(6, 12, (100, 0), (107, 3), (110, 10), junction=5),
    ]
    ways = [(0, 4), (4, 1), (2, 5), (5, 3), (0, 6), (6, 3)]
    return lanes, [LaneLink(a, b, LinkType.STRAIGHT) for a, b in ways]


def test_a_street_continues_straight_across_a_junction() -> None:
    lanes, streets = name_streets(*_crossing())
    assert [lane.street for lane in lanes] == [0, 0, 1, 1, 0, 1, NO_STREET]
    assert [street.lanes for street in streets] == [(0, 1, 4), (2, 3, 5)]
    assert [street.name for street in streets] == ["Street 1", "Street 2"]


def test_streets_do_not_depend_on_the_order_of_the_links() -> None:
    lanes, links = _crossing()
    assert name_streets(lanes, links[::-1])[1] == name_streets(lanes, links)[1]


@pytest.mark.parametrize("roads", [1, 14, 30])
def test_there_are_never_more_than_14_streets(roads: int) -> None:
    lanes = [_lane(k, k, (0, 20.0 * k), (50.0 + k, 20.0 * k)) for k in range(roads)]
    named, streets = name_streets(lanes, [])
    assert len(streets) == min(roads, 14)
    assert all(lane.street != NO_STREET for lane in named)


@pytest.mark.parametrize("name", TOWNS)
def test_real_towns_have_8_to_14_streets_longest_first(name: str) -> None:
    town = _read(name)
    assert 8 <= len(town.streets) <= 14
    lengths = [sum(town.lanes[k].length for k in street.lanes) for street in town.streets]
    assert lengths == sorted(lengths, reverse=True)
    assert len({street.name for street in town.streets}) == len(town.streets)


@pytest.mark.parametrize("name", TOWNS)
def test_every_lane_outside_junctions_is_in_exactly_one_street(name: str) -> None:
    town = _read(name)
    listed = sorted(k for street in town.streets for k in street.lanes)
    assert listed == [lane.id for lane in town.lanes if lane.street != NO_STREET]
    assert all(lane.street != NO_STREET for lane in town.lanes if not lane.in_junction)
    for street in town.streets:
        assert {town.lanes[k].street for k in street.lanes} == {street.id}


@pytest.mark.parametrize("name", TOWNS)
def test_both_directions_of_a_road_are_one_street(name: str) -> None:
    by_road: dict[int, set[int]] = {}
    for lane in _read(name).lanes:
        if not lane.in_junction:
            by_road.setdefault(lane.road_id, set()).add(lane.street)
    assert all(len(streets) == 1 for streets in by_road.values())


@pytest.mark.parametrize("name", TOWNS)
def test_connectors_belong_to_the_street_on_both_of_their_ends(name: str) -> None:
    town = _read(name)
    for lane in town.lanes:
        if lane.in_junction:
            ends = {town.lanes[link.target].street for link in town.successors(lane.id)}
            ends |= {town.lanes[k].street for k in town.predecessors(lane.id)}
            assert lane.street == (ends.pop() if len(ends) == 1 else NO_STREET)


@pytest.mark.parametrize("name", TOWNS)
def test_sites_stand_beside_their_lane_away_from_its_ends(name: str) -> None:
    town = _read(name)
    assert [site.id for site in town.sites] == list(range(24))
    for site in town.sites:
        lane = town.lanes[site.lane]
        assert not lane.in_junction
        assert lane.street == site.street
        assert 14.5 <= site.station <= lane.length - 14.5
        assert lane.length >= 40.0
        assert lane.position(site.station) == pytest.approx(np.array(site.waypoint))
        station, lateral = lane.project(np.array(site.position))
        assert station == pytest.approx(site.station)
        assert lateral == pytest.approx(0.5 * lane.width_at(station) + 6.0, abs=0.05)


@pytest.mark.parametrize("name", TOWNS)
def test_no_other_lane_is_as_near_to_a_site(name: str) -> None:
    town = _read(name)
    for site in town.sites:
        distance = [abs(lane.project(np.array(site.position))[1]) for lane in town.lanes]
        assert int(np.argmin(distance)) == site.lane


@pytest.mark.parametrize("name", TOWNS)
def test_sites_are_spread_over_the_town(name: str) -> None:
    town = _read(name)
    places = np.array([site.position for site in town.sites])
    apart = np.hypot(*(places[:, None] - places[None]).transpose(2, 0, 1)) + np.eye(len(places)) * 1e9
    assert apart.min() > 20.0
    extent = np.ptp(np.concatenate([lane.points[:, :2] for lane in town.lanes]), axis=0)
    assert np.all(np.ptp(places, axis=0) > 0.8 * extent)


def _ring(length: float) -> tuple[list[Lane], list[LaneLink]]:
    """Two roads that lead into one another, driven both ways round."""
    there, back = ((0.0, 0.0), (length, 0.0)), ((length, 60.0), (0.0, 60.0))
    lanes = [_lane(0, 1, *there), _lane(1, 2, *back), _lane(2, 3, (0, 500), (length, 500))]
    links = [(0, 1), (1, 0), (1, 2)]
    return lanes, [LaneLink(a, b, LinkType.STRAIGHT) for a, b in links]


def test_no_site_lies_on_a_lane_without_return() -> None:
    lanes, links = _ring(100.0)
    sites = lay_sites(lanes, links, 40)
    assert {site.lane for site in sites} == {0, 1}


def test_sites_come_nearer_to_the_ends_of_lanes_in_a_small_town() -> None:
    sites = lay_sites(*_ring(20.0), 4)
    assert len(sites) == 4
    assert all(5.0 <= site.station <= 15.0 for site in sites)


def test_a_town_without_room_has_no_sites() -> None:
    lanes = [replace(lane, junction_id=1) for lane in _ring(100.0)[0]]
    assert lay_sites(lanes, _ring(100.0)[1], 4) == ()


def test_sites_lie_at_the_kerb() -> None:
    lanes = [_lane(0, 1, (0, 0), (100, 0)), _lane(1, 1, (0, 4), (100, 4), lane_id=-2)]
    both = [LaneLink(0, 1, LinkType.LANE_CHANGE_RIGHT), LaneLink(1, 0, LinkType.LANE_CHANGE_LEFT)]
    assert {site.lane for site in lay_sites(lanes, both, 5)} == {1}


@pytest.mark.parametrize("length", [100.0, 300.0])
def test_sites_of_a_street_without_a_junction_lie_on_both_sides(length: float) -> None:
    lanes = [_lane(0, 1, (0, 0), (length, 0)), _lane(1, 1, (length, -4), (0, -4), lane_id=1)]
    sites = lay_sites(lanes, [], 12)
    assert len(sites) == 12
    assert {site.lane for site in sites} == {0, 1}
    town = Town(name="street", lanes=lanes, links=[], junctions=[], sites=sites)
    for start, goal in itertools.permutations(sites, 2):
        assert router(town).route((start.lane, start.station), (goal.lane, goal.station)) is not None


def test_of_two_streets_apart_the_one_with_more_room_has_the_sites() -> None:
    lanes = [
        *(_lane(0, 1, (0, 0), (100, 0)), _lane(1, 1, (100, -4), (0, -4), lane_id=1)),
        *(_lane(2, 2, (0, 300), (250, 300)), _lane(3, 2, (250, 296), (0, 296), lane_id=1)),
    ]
    assert {site.lane for site in lay_sites(lanes, [], 12)} == {2, 3}


def test_sites_of_imported_maps_lie_away_from_where_cars_turn_in(tmp_path: Path) -> None:
    """Whoever has just turned into a street cannot be told in time to stop."""
    town = load_town(ring(tmp_path / "ring.xodr"))
    stations = [(site.station, town.lanes[site.lane].length) for site in town.sites]
    assert stations and all(station >= min(44.0, 0.39 * length) for station, length in stations)
    lanes = [_lane(0, 1, (0, 0), (100, 0)), _lane(1, 1, (100, -4), (0, -4), lane_id=1)]
    assert min(site.station for site in lay_sites(lanes, [], 12, approach=45.0)) == pytest.approx(40.0)
    assert min(site.station for site in lay_sites(lanes, [], 12)) < 25.0
