"""The closest-lane index against an exhaustive search, at all kinds of places of every town."""

from collections.abc import Callable
from itertools import product

import numba
import numpy as np
import pytest
from highway_env.road.road import RoadNetwork
from numpy.typing import NDArray

from dorothie_gym.maps.model import distance, value_at
from dorothie_gym.sim.network.lane_lookup import GRID_CELL, SAME_LEVEL
from dorothie_gym.sim.network.network import TownNetwork

from .towns import EVERY_TOWN, find_town

Points = NDArray[np.float64]
"""Rows (n, 4): x, y [m], heading [rad], height [m]."""


@numba.njit(cache=False, fastmath=False)
def _exhaustive(points, offsets, ends, queries, weight, any_height):  # type: ignore[no-untyped-def]  # compiled: numba infers the types
    """First row of least distance for each query, over all lanes and without any index.

    The distance is highway-env's (`AbstractLane.distance_with_heading`), as the compiled lanes measure it; that they
    measure it rightly is the matter of test_lane.py, and that this search is highway-env's of the first test below.
    """
    found = np.empty(len(queries), dtype=np.int64)
    for q in range(len(queries)):
        x, y, heading, height = queries[q]
        best, row = np.inf, -1
        for level in (True, False):  # where no lane is at this height, all lanes are asked
            for lane in range(len(offsets) - 1):
                cost, station = distance(points, offsets, ends, lane, x, y, heading, weight)
                near = (
                    any_height or not level or abs(value_at(points, offsets, lane, 4, station) - height) <= SAME_LEVEL
                )
                if near and cost < best:
                    best, row = cost, lane
            if row >= 0:
                break
        found[q] = row
    return found


def exhaustive(network: TownNetwork, queries: Points, *, heading: bool, height: bool) -> NDArray[np.int64]:
    table = network.table
    return _exhaustive(table.points, table.offsets, table.ends, queries, 1.0 if heading else 0.0, not height)


def indexed(network: TownNetwork, queries: Points, *, heading: bool, height: bool) -> NDArray[np.int64]:
    found = (
        network.get_closest_lane_index(q[:2], q[2] if heading else None, q[3] if height else None) for q in queries
    )
    return np.array([network.row(index) for index in found])


def _stations(network: TownNetwork, rng: np.random.Generator, rows: NDArray[np.int64], spread: float) -> Points:
    """Places around random stations of lanes, with the lanes' headings and heights there."""
    places = np.empty((len(rows), 4))
    lanes = network.lanes_list()
    for k, row in enumerate(rows):
        station = rng.uniform(0.0, lanes[row].length)
        x, y = lanes[row].position(station, rng.normal(scale=spread))
        places[k] = x, y, lanes[row].heading_at(station), lanes[row].height_at(station)
    return places


def on_roads(network: TownNetwork, rng: np.random.Generator, count: int) -> Points:
    return _stations(network, rng, rng.integers(len(network.lanes_list()), size=count), 2.0)


def at_connectors(network: TownNetwork, rng: np.random.Generator, count: int) -> Points:
    inside = [row for row, lane in enumerate(network.lanes_list()) if lane.town_lane.in_junction]
    return _stations(network, rng, rng.choice(inside or [0], size=count), 1.0)


def at_lane_ends(network: TownNetwork, rng: np.random.Generator, count: int) -> Points:
    """Exactly where lanes begin, end or bend, and just beyond: the same distance to several lanes is common there."""
    points = network.table.points
    offsets = network.table.offsets
    ends = np.concatenate((offsets[:-1], offsets[1:] - 1))
    chosen = points[np.where(rng.random(count) < 0.7, rng.choice(ends, count), rng.integers(len(points), size=count))]
    ahead = np.column_stack((np.cos(chosen[:, 3]), np.sin(chosen[:, 3])))
    beyond = rng.choice([0.0, 1e-9, -1e-9, 0.5, -0.5, 20.0], size=count)
    return np.column_stack((chosen[:, :2] + beyond[:, None] * ahead, chosen[:, 3:5]))


def between_lanes(network: TownNetwork, rng: np.random.Generator, count: int) -> Points:
    """Midway between two points of lanes near one another."""
    near = on_roads(network, rng, count)
    points = network.table.points
    other = np.array(
        [np.argsort(np.hypot(*(points[:, :2] - q[:2]).T))[rng.integers(1, 12) % len(points)] for q in near]
    )
    own = np.array([np.argmin(np.hypot(*(points[:, :2] - q[:2]).T)) for q in near])
    near[:, :2] = 0.5 * (points[own, :2] + points[other, :2])
    return near


def off_the_road(network: TownNetwork, rng: np.random.Generator, count: int) -> Points:
    low, high = network.table.boxes[:, :2].min(axis=0), network.table.boxes[:, 2:].max(axis=0)
    places = rng.uniform(low - 150.0, high + 150.0, size=(count, 2))
    far = rng.random(count) < 0.1
    places[far] = rng.uniform(-1e6, 1e6, size=(int(far.sum()), 2))
    heights = rng.choice(network.table.points[:, 4], size=count)
    return np.column_stack((places, rng.uniform(-np.pi, np.pi, size=count), heights))


def at_cell_borders(network: TownNetwork, rng: np.random.Generator, count: int) -> Points:
    """On the lines where one cell of the index ends and the next begins."""
    places = on_roads(network, rng, count)
    origin = np.array(network._grid.origin)
    snapped = origin + GRID_CELL * np.round((places[:, :2] - origin) / GRID_CELL)
    places[:, :2] = np.where(rng.random((count, 2)) < 0.6, snapped, places[:, :2])
    return places


def at_overpasses(network: TownNetwork, rng: np.random.Generator, count: int) -> Points:
    """Returns places where lanes pass over others; any places on the roads in a town without bridges."""
    points = network.table.points
    some = points[rng.choice(len(points), size=min(len(points), 1500), replace=False)]
    over = np.array(
        [
            q
            for q in some
            if np.any((np.hypot(*(points[:, :2] - q[:2]).T) < 8.0) & (np.abs(points[:, 4] - q[4]) > SAME_LEVEL))
        ]
    )
    if len(over) == 0:
        return on_roads(network, rng, count)
    chosen = over[rng.integers(len(over), size=count)]
    return np.column_stack((chosen[:, :2] + rng.normal(scale=3.0, size=(count, 2)), chosen[:, 3:5]))


KINDS: tuple[Callable[[TownNetwork, np.random.Generator, int], Points], ...] = (
    on_roads,
    at_connectors,
    at_lane_ends,
    between_lanes,
    off_the_road,
    at_cell_borders,
    at_overpasses,
)


def places(network: TownNetwork, count: int, seed: int) -> Points:
    """Places of all kinds in equal parts; headings and heights are right, a little off, or anything."""
    rng = np.random.default_rng(seed)
    found = np.concatenate([kind(network, rng, -(-count // len(KINDS))) for kind in KINDS])[:count]
    found[:, 2] += rng.choice([0.0, 0.2, 3.0], size=count) * rng.normal(size=count)
    found[:, 3] += rng.choice([0.0, 2.0, 30.0], size=count) * rng.normal(size=count)
    return found


def disagreements(network: TownNetwork, count: int, seed: int) -> list[str]:
    """Places where index and search differ, each asked for with and without its heading and its height."""
    queries = places(network, count, seed)
    found = []
    for heading, height in product((False, True), repeat=2):
        fast = indexed(network, queries, heading=heading, height=height)
        slow = exhaustive(network, queries, heading=heading, height=height)
        found += [
            f"{queries[q].tolist()} {heading=} {height=}: {fast[q]}, not {slow[q]}"
            for q in np.flatnonzero(fast != slow)
        ]
    return found


@pytest.fixture(scope="module", params=EVERY_TOWN)
def network(request: pytest.FixtureRequest) -> TownNetwork:
    return TownNetwork(find_town(request.param))


def test_the_exhaustive_search_is_highway_env_s(network: TownNetwork) -> None:
    rows = {index: row for row, index in enumerate(network.lanes_dict())}
    queries = places(network, 140, seed=5)
    for heading in (False, True):
        stock = [RoadNetwork.get_closest_lane_index(network, q[:2], q[2] if heading else None) for q in queries]
        assert exhaustive(network, queries, heading=heading, height=False).tolist() == [rows[index] for index in stock]


def test_the_index_finds_what_the_exhaustive_search_finds(network: TownNetwork) -> None:
    assert disagreements(network, 1500, seed=11) == []


@pytest.mark.slow
def test_the_index_finds_what_the_exhaustive_search_finds_at_twenty_thousand_places(network: TownNetwork) -> None:
    assert disagreements(network, 20_000, seed=12) == []
