import pytest

from dorothie_gym.dialogue import Direction
from dorothie_gym.errors import PolicyStateError
from dorothie_gym.maps import LinkType, load_town
from dorothie_gym.maps.town import LightColour
from dorothie_gym.policies.participant.state import TaskProgress
from dorothie_gym.policies.route_progress import RouteProgress, find_exit, light_ahead, next_choice, stopping_distance
from dorothie_gym.policies.route_state import RouteState
from dorothie_gym.policies.route_tables import is_choice

TOWN = load_town("brookside")
CHOICES = [lane.id for lane in TOWN.lanes if is_choice(TOWN, lane.id)]


def test_next_choice_is_at_end_of_lane_before_it():
    lane = TOWN.lanes[CHOICES[0]]
    choice = next_choice(TOWN, lane.id, 5.0)
    assert choice is not None and choice.lane == lane.id
    assert choice.distance == lane.length - 5.0


def test_every_direction_of_a_junction_finds_its_exit():
    for lane in CHOICES:
        choice = next_choice(TOWN, lane, 0.0)
        assert choice is not None
        for way in choice.exits:
            found = find_exit(TOWN, choice, Direction(str(way.type)))
            assert found is not None and found.type is way.type


def test_street_identifies_exit():
    choice = next_choice(TOWN, CHOICES[0], 0.0)
    assert choice is not None
    for way in choice.exits:
        street = frozenset({TOWN.lanes[way.lane].street})
        found = find_exit(TOWN, choice, None, street)
        assert found is not None and TOWN.lanes[found.lane].street in street


def test_route_counts_down_to_goal_and_detects_wrong_turn():
    start, goal = TOWN.sites[0], TOWN.sites[-1]
    journey = RouteProgress.plan(TOWN, (start.lane, start.station), (goal.lane, goal.station))
    before = journey.left(start.station)
    later = journey.followed(TOWN, start.lane, start.station + 5.0)
    assert abs(before - later.left(start.station + 5.0) - 5.0) < 1e-6
    off = next(lane.id for lane in TOWN.lanes if lane.id not in {leg.lane for leg in journey.legs})
    assert journey.followed(TOWN, off, 1.0).astray == 1


def test_route_ignores_roadblocks_that_cannot_be_avoided():
    start, goal = TOWN.sites[0], TOWN.sites[-1]
    everywhere = tuple((lane.id, s * lane.length) for lane in TOWN.lanes for s in (0.0, 0.25, 0.5, 0.75, 1.0))
    journey = RouteProgress.plan(TOWN, (start.lane, start.station), (goal.lane, goal.station), everywhere)
    assert journey.route is not None


def test_passed_goal_counts_as_astray():
    goal = TOWN.sites[0]
    journey = RouteProgress.plan(TOWN, (goal.lane, max(goal.station - 10.0, 0.0)), (goal.lane, goal.station))
    assert journey.followed(TOWN, goal.lane, goal.station + 1.0).astray == 0
    assert journey.followed(TOWN, goal.lane, goal.station + 6.0).astray == 1


def test_stopping_distance_grows_with_speed():
    assert 0.0 == stopping_distance(0.0) < stopping_distance(4.0) < stopping_distance(8.0)


def test_only_near_traffic_light_is_found():
    lane = next(lane for lane in TOWN.lanes if lane.length > 75.0 and TOWN.light(lane.id, 0.0) is not None)
    colours = {light_ahead(TOWN, lane.id, lane.length - 5.0, float(time)) for time in range(120)}
    assert colours == set(LightColour)
    assert light_ahead(TOWN, lane.id, lane.length - 70.0, 0.0) is None
    dark = next(lane for lane in TOWN.lanes if lane.id in CHOICES and TOWN.light(lane.id, 0.0) is None)
    assert light_ahead(TOWN, dark.id, dark.length - 5.0, 0.0) is None


def test_goal_right_behind_junction_needs_lane_change_before_it() -> None:
    town = load_town("northgate")
    tried = 0
    for site in town.sites:
        lane = town.lanes[site.lane]
        before = [k for k in range(len(town.lanes)) if any(way.lane == lane.id for way in town.exits(k))]
        for source in before:
            beside = town.neighbour(source, LinkType.LANE_CHANGE_LEFT)
            straight = beside is not None and any(abs(way.angle) < 20 for way in town.exits(beside))
            if not straight or site.station > 20.0 or town.lanes[source].length < 55.0:
                continue
            assert beside is not None
            journey = RouteProgress.plan(town, (beside, 1.0), (site.lane, site.station))
            crossing = journey.next_crossing(town, 1.0)
            if crossing is not None and crossing.lane == source and crossing.exit.lane == lane.id:
                assert journey.needs_switch(town, beside, 1.0, crossing)
                tried += 1
    assert tried


def test_overrun_u_turn_does_not_count_as_the_last_leg_of_the_same_lane():
    town = load_town("millbrook")
    progress = RouteProgress.plan(town, (0, 20.0), (0, 15.0))
    legs = [leg.lane for leg in progress.legs]
    assert legs[0] == legs[-1] == 0 and len(legs) == 3, "round and back again, to a place just behind"
    gone_on = progress.followed(town, 0, 80.0)
    assert gone_on.astray == 1 and gone_on.leg == 0


def test_what_needs_a_route_or_a_target_is_refused_without_one() -> None:
    with pytest.raises(PolicyStateError, match="the agent has no route"):
        RouteState().replanned(TOWN, (0, 1.0))
    with pytest.raises(PolicyStateError, match="the participant has no target"):
        _ = TaskProgress().destination
