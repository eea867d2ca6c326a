"""Short cuts of the scripted policies that must not change what they decide."""

from dataclasses import dataclass

import numpy as np
import pytest

from dorothie_gym.maps import load_town
from dorothie_gym.policies.decision_random import decision_random
from dorothie_gym.policies.lane_bounds import may_be_near
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.road_ahead import BESIDE_ROAD
from dorothie_gym.policies.route_progress import RouteProgress
from dorothie_gym.policies.town_tables import kept_with_town

TOWN = load_town("brookside")


@dataclass(frozen=True, kw_only=True)
class State:
    count: int = 0
    name: str = ""


def test_replacing_fields_by_themselves_keeps_the_state():
    state = State(count=3, name="car")
    assert replace(state, count=3) is state
    assert replace(state, count=4, name=state.name) == State(count=4, name="car")
    assert state == State(count=3, name="car")


def test_deferred_generator_draws_what_the_generator_of_its_seed_draws():
    deferred, generator = decision_random(7, 12), np.random.default_rng((7, 12))
    assert deferred.random() == generator.random()
    assert deferred.integers(100) == generator.integers(100)
    assert deferred.choice(5, p=[0.1, 0.2, 0.3, 0.2, 0.2]) == generator.choice(5, p=[0.1, 0.2, 0.3, 0.2, 0.2])


def test_answers_about_a_town_are_found_once_for_each():
    asked = []

    @kept_with_town
    def double(town, lane):
        asked.append((town.name, lane))
        return 2 * lane

    other = load_town("midtown")
    assert [double(TOWN, 1), double(TOWN, 1), double(other, 1), double(TOWN, 2)] == [2, 2, 2, 4]
    assert asked == [("brookside", 1), ("midtown", 1), ("brookside", 2)]


@pytest.mark.parametrize("distance", [3.0, BESIDE_ROAD])
def test_points_near_a_lane_are_within_reach_of_its_bounds(distance):
    rng = np.random.default_rng(1)
    near = 0
    for lane in TOWN.lanes:
        for _ in range(10):
            x, y = rng.uniform(lane.points[:, :2].min(axis=0) - 60.0, lane.points[:, :2].max(axis=0) + 60.0)
            foot = lane.position(lane.project(np.array([x, y]))[0])
            if np.hypot(foot[0] - x, foot[1] - y) <= distance:
                near += 1
                assert may_be_near(TOWN, lane.id, x, y, distance)
            elif not may_be_near(TOWN, lane.id, x, y, distance):
                near += 1
    assert near > 100


def test_what_a_route_has_ahead_follows_the_car():
    start, goal = TOWN.sites[0], TOWN.sites[-1]
    plan = RouteProgress.plan(TOWN, (start.lane, start.station), (goal.lane, goal.station))
    for leg in range(len(plan.legs)):
        for station in (plan.legs[leg].start, plan.legs[leg].end):
            moved = replace(plan, leg=leg)  # a copy of one that has been asked
            fresh = RouteProgress(goal=plan.goal, route=plan.route, leg=leg)
            for _ in range(2):
                assert moved.left(station) == fresh.left(station)
                assert moved.next_manoeuvre(station) == fresh.next_manoeuvre(station)
                assert moved.next_crossing(TOWN, station) == next(fresh.crossings(TOWN, station), None)
            plan.left(station)
