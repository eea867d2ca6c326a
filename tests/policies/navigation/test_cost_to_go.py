from __future__ import annotations

import copy
import math

import numpy as np
import pytest

from dorothie_gym.maps import load_town
from dorothie_gym.maps.routing import router
from dorothie_gym.policies.navigation.cost_to_go import CostToGo, cost_table


@pytest.mark.parametrize("town", ["brookside", "midtown"])
def test_cost_to_go_is_cost_of_route(town: str) -> None:
    model, rng = load_town(town), np.random.default_rng(0)
    way = CostToGo(model)
    lanes = [lane for lane in model.lanes if not lane.in_junction and lane.length > 25.0]
    errors = []
    for _ in range(60):
        goal_lane, lane = (lanes[int(k)] for k in rng.integers(len(lanes), size=2))
        goal = goal_lane.id, float(rng.uniform(5.0, goal_lane.length - 5.0))
        start = lane.id, float(rng.uniform(0.0, lane.length - 12.0))
        way.aim(goal)
        route = router(model).route(start, goal)
        assert route is not None
        errors.append(abs(way.from_place(*start) - route.cost))
    # a cell of some 10 m may hide whether a lane change or U-turn can still begin in it
    assert np.median(errors) < 5.0 and np.mean(np.array(errors) < 35.0) > 0.9


def test_cost_falls_to_zero_at_goal_and_rises_behind_it() -> None:
    town = load_town("brookside")
    lane = max((lane for lane in town.lanes if not lane.in_junction), key=lambda lane: lane.length)
    goal = lane.length / 2
    way = CostToGo(town)
    way.aim((lane.id, goal))
    before = [way.from_place(lane.id, station) for station in np.arange(1.0, goal, 1.0)]
    assert np.all(np.diff(before) < 0.0) and before[-1] <= 1.0
    assert way.from_place(lane.id, goal) == 0.0
    assert way.from_place(lane.id, goal + 6.0) > 30.0


def test_roadblock_raises_cost() -> None:
    town = load_town("brookside")
    lane = max((lane for lane in town.lanes if not lane.in_junction), key=lambda lane: lane.length)
    way = CostToGo(town)
    goal = (lane.id, lane.length - 5.0)
    assert way.aim(goal) and not way.aim(goal)
    free = way.from_place(lane.id, 2.0)
    assert way.aim(goal, ((lane.id, lane.length / 2),))
    assert way.from_place(lane.id, 2.0) > free + 20.0


def test_cost_is_infinite_without_goal() -> None:
    assert math.isinf(CostToGo(load_town("brookside")).from_place(0, 0.0))


def test_environments_share_the_costs_to_a_goal() -> None:
    town = load_town("brookside")
    lane = max((lane for lane in town.lanes if not lane.in_junction), key=lambda lane: lane.length)
    goal, blocked = (lane.id, lane.length - 5.0), ((lane.id, lane.length / 2),)
    assert cost_table(town, goal, blocked) is cost_table(town, goal, blocked)
    way = CostToGo(town)
    way.aim(goal, blocked)
    twin = copy.deepcopy(way)
    assert twin.from_place(lane.id, 2.0) == way.from_place(lane.id, 2.0)
    twin.aim(goal)
    assert twin.from_place(lane.id, 2.0) < way.from_place(lane.id, 2.0)


def test_costs_from_lane_ends_are_those_of_the_lanes_behind() -> None:
    town = load_town("midtown")
    search = router(town)
    for site in town.sites[::5]:
        goal = site.lane, site.station
        row = cost_table(town, goal).costs
        np.testing.assert_array_equal(row[: -len(town.lanes)], search.distances_to(goal))
        for lane in town.lanes[::11]:  # from the end of a lane without the turn: the lanes behind begin there
            behind = [row[search.cell(link.target, 0.0)] for link in town.successors(lane.id)]
            assert row[len(row) - len(town.lanes) + lane.id] == min(behind, default=math.inf)
