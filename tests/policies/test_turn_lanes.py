from dorothie_gym.maps import LinkType, load_town
from dorothie_gym.maps.routing import router
from dorothie_gym.policies.route_progress import RouteProgress, lanes_beside
from dorothie_gym.policies.turn_lanes import leads_beside, next_turn, next_turn_lane, turn_lanes

TOWN = load_town("northgate")


def _left_turn_lane():
    """Returns a lane that leads only left, with a lane beside it that leads straight on, both long enough to change."""
    for lane in sorted(turn_lanes(TOWN)):
        way, room = TOWN.exits(lane)[0], TOWN.lanes[lane].length
        beside = [other for other in lanes_beside(TOWN, lane) if other in turn_lanes(TOWN)]
        if way.type is LinkType.LEFT and beside and room > 30.0 and TOWN.lanes[way.lane].length > 20.0:
            return lane, beside[0]
    raise AssertionError("northgate has no road with a lane for the turn to the left")


def test_lane_for_a_turn_beside_one_straight_on_is_a_turn_lane():
    lane, beside = _left_turn_lane()
    straight = next_turn_lane(TOWN, beside, 5.0)
    assert straight is not None and straight.lane == beside
    assert straight.junction == TOWN.exits(lane)[0].junction_id
    assert straight.distance == TOWN.lanes[beside].length - 5.0


def test_brookside_has_no_turn_lanes():
    assert not turn_lanes(load_town("brookside"))


def test_route_from_the_lane_beside_turns_left_at_the_junction():
    lane, beside = _left_turn_lane()
    way = TOWN.exits(lane)[0]
    progress = RouteProgress.plan(TOWN, (beside, 1.0), (way.lane, 10.0))
    turn = next_turn(progress, TOWN, 1.0)
    assert turn is not None and turn.lane == lane and turn.exit == way
    assert abs(turn.distance - TOWN.lanes[beside].length) < 10.0


def test_lanes_side_by_side_lead_to_the_turn_and_those_of_other_roads_do_not():
    lane, beside = _left_turn_lane()
    assert leads_beside(TOWN, lane, lane) and leads_beside(TOWN, beside, lane)
    assert not leads_beside(TOWN, TOWN.exits(lane)[0].lane, lane)


def test_cost_of_manoeuvres_prefers_a_way_with_fewer_of_them():
    start = TOWN.sites[0]
    for site in TOWN.sites[1:]:
        places = (start.lane, start.station), (site.lane, site.station)
        direct, calm = router(TOWN).route(*places), router(TOWN).route(*places, manoeuvre_cost=500.0)
        assert direct is not None and calm is not None
        assert _manoeuvres(calm) <= _manoeuvres(direct)


def _manoeuvres(route):
    return sum(leg.entry != "follow" for leg in route.legs)
