import itertools
import math

import numpy as np
import pytest

from dorothie_gym.tasks.sites import SPACING, spread_places

from .builders import FakePlace, grid_places


def closest_pair(places):
    return min(
        min(math.dist(a.position, b.position), math.dist(a.waypoint, b.waypoint))
        for a, b in itertools.combinations(places, 2)
    )


@pytest.mark.parametrize("seed", range(20))
def test_places_lie_apart_though_many_are_close(seed):
    chosen = spread_places(grid_places(400, spacing=6.0, lanes=20), 12, np.random.default_rng(seed))
    assert len({place.id for place in chosen}) == 12
    assert closest_pair(chosen) >= SPACING


@pytest.mark.parametrize("seed", range(20))
def test_lanes_of_their_own_come_first(seed):
    chosen = spread_places(grid_places(64, lanes=8), 12, np.random.default_rng(seed))
    assert len({place.lane for place in chosen[:8]}) == 8


def test_a_crowded_town_still_gives_distinct_places_the_farthest_first():
    row = [FakePlace(k, 0, float(k), (float(k), 2.0), (float(k), 0.0), 0) for k in range(10)]
    chosen = spread_places(row, 2, np.random.default_rng(0))
    assert closest_pair(chosen) >= 4.0
    assert {place.id for place in spread_places(row, 10, np.random.default_rng(0))} == set(range(10))


def test_two_sides_of_one_stop_are_not_both_taken_while_others_are_free():
    pairs = [
        FakePlace(2 * k + side, 2 * k + side, 0.0, (30.0 * k, 20.0 * side), (30.0 * k, 9.0 + 2.0 * side), k)
        for k in range(6)
        for side in (0, 1)
    ]
    chosen = spread_places(pairs, 6, np.random.default_rng(1))
    assert {place.street for place in chosen} == set(range(6))
