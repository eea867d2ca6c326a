import math
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from dorothie_gym.errors import TownError
from dorothie_gym.maps.lint import check_town
from dorothie_gym.maps.model import LinkType, SignalKind
from dorothie_gym.maps.town import LightColour, Town
from dorothie_gym.support.portable_math import wrap_degrees
from tests.maps.yaml_plans import AVENUES, CIRCUS, INTERCHANGE, PAIR, compiled, street_of, ways

PLANS = {"avenues": AVENUES, "circus": CIRCUS, "pair": PAIR, "interchange": INTERCHANGE}
LEFT, RIGHT, STRAIGHT = LinkType.LEFT, LinkType.RIGHT, LinkType.STRAIGHT


@pytest.fixture(scope="module")
def towns(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Town]:
    folder = tmp_path_factory.mktemp("towns")
    return {name: compiled(folder, text) for name, text in PLANS.items()}


@pytest.fixture(params=list(PLANS))
def town(request: pytest.FixtureRequest, towns: dict[str, Town]) -> Town:
    return towns[request.param]


def test_linked_lanes_meet_without_gap_or_kink(town: Town) -> None:
    for link in town.links:
        if not link.type.is_lane_change:
            source, target = town.lanes[link.source], town.lanes[link.target]
            assert np.array_equal(source.points[-1], target.points[0])
            assert abs(wrap_degrees(math.degrees(source.headings[-1] - target.headings[0]))) < 3.0


def test_every_lane_reaches_every_other_if_it_changes_lanes(town: Town) -> None:
    pairs = np.array([(link.source, link.target) for link in town.links])
    size = len(town.lanes)
    graph = coo_matrix((np.ones(len(pairs)), pairs.T), shape=(size, size))
    assert connected_components(graph, directed=True, connection="strong")[0] == 1


def test_every_lane_leads_on_and_lanes_beside_each_other_can_be_changed(town: Town) -> None:
    for lane in town.lanes:
        assert town.successors(lane.id)
    for link in town.links:
        if link.type.is_lane_change:
            source, target = town.lanes[link.source], town.lanes[link.target]
            assert source.road_id == target.road_id and source.lane_id * target.lane_id > 0
            assert not source.in_junction and abs(source.length - target.length) < 0.5 * source.length
            aside = source.project(target.position(target.length / 2.0))[1]
            assert aside == pytest.approx(3.5 if link.type is LinkType.LANE_CHANGE_RIGHT else -3.5, abs=0.05)
            back = next(b for b in town.links if (b.source, b.target) == (link.target, link.source))
            assert {link.type, back.type} == {LinkType.LANE_CHANGE_LEFT, LinkType.LANE_CHANGE_RIGHT}


def test_successor_links_come_before_lane_changes(town: Town) -> None:
    kinds = [link.type.is_lane_change for link in town.links]
    assert kinds == sorted(kinds) and len(set(town.links)) == len(town.links)


def test_turns_are_typed_by_their_change_of_heading(town: Town) -> None:
    for lane in town.lanes:
        straight = 0
        for link in town.successors(lane.id):
            connector = town.lanes[link.target]
            if connector.in_junction:
                turn = math.degrees(connector.headings[-1] - connector.headings[0])
                straight += link.type is STRAIGHT
                if abs(turn) > 35.5:
                    assert link.type is (RIGHT if turn > 0 else LEFT)
        assert straight <= 1


def test_lanes_are_numbered_outwards_and_negative_along_the_course(towns: dict[str, Town]) -> None:
    town = towns["pair"]
    king = [town.lanes[k] for k in town.streets[0].lanes if not town.lanes[k].in_junction]
    assert sorted({lane.lane_id for lane in king}) == [-2, -1]
    mid = [town.lanes[k] for k in town.streets[4].lanes if not town.lanes[k].in_junction]
    assert sorted(lane.lane_id for lane in mid) == [-1, 1]


def test_a_turn_lane_is_entered_by_a_lane_change_only(towns: dict[str, Town]) -> None:
    town = towns["avenues"]
    pockets = [lane for lane in town.lanes if not lane.in_junction and lane.length == pytest.approx(40.0)]
    turning = [lane for lane in pockets if not town.predecessors(lane.id)]
    assert len(turning) == 2 and len(pockets) == 2 * 4
    for lane in turning:
        assert abs(lane.lane_id) == 1
        beside = town.neighbour(lane.id, LinkType.LANE_CHANGE_RIGHT)
        assert beside is not None and abs(town.lanes[beside].lane_id) == 2
        assert town.neighbour(beside, LinkType.LANE_CHANGE_LEFT) == lane.id
        (before,) = town.predecessors(beside)
        assert street_of(town, before) == "Avenue" and not town.lanes[before].in_junction
        assert town.successors(before)[0].type is STRAIGHT
        assert abs(town.lanes[before].lane_id) == 1
        assert [way.type for way in town.exits(lane.id)] == [LEFT]


def test_lanes_lead_where_a_driver_would_go(towns: dict[str, Town]) -> None:
    town = towns["avenues"]
    assert ways(town, "Avenue", "Avenue") == [(2, 1), (3, 2), (4, 3)]
    assert ways(town, "Avenue", "Lane", LEFT) == [(1, 1)]
    assert ways(town, "Avenue", "Lane", RIGHT) == [(4, 1), (4, 2)]  # the outermost of one lane, and of two
    assert ways(town, "Lane", "Avenue", RIGHT) == [(1, 3), (2, 3)]
    assert ways(town, "Lane", "Avenue", LEFT) == [(1, 1)]
    assert ways(town, "Lane", "Lane") == [(1, 1), (2, 2)]


def test_two_lanes_turn_side_by_side_where_nothing_else_is_possible(towns: dict[str, Town]) -> None:
    town = towns["pair"]
    assert ways(town, "King Street", "West") == [(1, 1), (2, 2)]
    assert ways(town, "Mid", "Queen Street", LEFT) == [(1, 1)]
    assert ways(town, "Mid", "King Street") == [(1, 1)]
    assert not ways(town, "Mid", "Queen Street", RIGHT)  # against the one-way street


def test_lanes_without_another_successor_merge(tmp_path: Path) -> None:
    narrow = PAIR.replace(
        "West: {through: [nw, sw], one_way: true, lanes: 2}", "West: {through: [nw, sw], one_way: true}"
    )
    town = compiled(tmp_path, narrow)
    assert ways(town, "King Street", "West") == [(1, 1), (2, 1)]
    assert ways(town, "West", "Queen Street") == [(1, 1)]  # a left turn; the other lane is reached by a lane change


def test_roundabouts_are_entered_and_left_by_right_turns(towns: dict[str, Town]) -> None:
    town = towns["circus"]
    assert ways(town, "Avenue", "circus") == [(1, 1), (2, 2)] == ways(town, "circus", "Avenue")
    assert ways(town, "Lane", "circus") == [(1, 2)] and ways(town, "circus", "Lane") == [(2, 1)]
    assert ways(town, "circus", "circus") == [(1, 1), (2, 2)]
    for way in (*ways(town, "Avenue", "circus", LEFT), *ways(town, "circus", "Avenue", LEFT)):
        pytest.fail(f"{way} turns left")
    assert [street.name for street in town.streets] == ["Avenue", "Lane", "Loop", "circus"]
    yields = [signal for signal in town.signals if signal.kind is SignalKind.YIELD]
    assert sorted(len(signal.lanes) for signal in yields) == [1, 1, 2, 2]
    assert {street_of(town, lane) for signal in yields for lane in signal.lanes} == {"Avenue", "Lane"}


def test_ramps_join_with_a_yield_sign(towns: dict[str, Town]) -> None:
    town = towns["interchange"]
    assert [signal.kind for signal in town.signals] == [SignalKind.YIELD] * 2
    for signal in town.signals:
        (lane,) = (town.lanes[k] for k in signal.lanes)
        assert street_of(town, lane.id) == "Highway" and lane.speed_limit < 20.0  # a ramp, not the carriageway


def test_ramps_belong_to_the_street_that_they_leave_or_join(towns: dict[str, Town]) -> None:
    town = towns["interchange"]
    assert not any(street.name.startswith(("Off", "On")) for street in town.streets)
    highway = next(street for street in town.streets if street.name == "Highway")
    assert {town.lanes[k].lane_id for k in highway.lanes if not town.lanes[k].in_junction} == {-1, -2, 1, 2}
    assert all(
        lane.street == street.id for street in town.streets for lane in map(town.lanes.__getitem__, street.lanes)
    )
    on_ramps = {lane for signal in town.signals for lane in signal.lanes}
    assert not on_ramps & {site.lane for site in town.sites}


def test_lanes_have_heights_and_connectors_those_of_their_junction(towns: dict[str, Town]) -> None:
    town = towns["interchange"]
    bridge = [town.lanes[k] for k in town.streets[1].lanes if not town.lanes[k].in_junction]
    assert all(np.all(lane.points[:, 2] == 6.0) for lane in bridge)
    climbs = [lane.points[-1, 2] - lane.points[0, 2] for lane in town.lanes if not lane.in_junction]
    assert sorted(round(climb, 6) for climb in climbs if climb != 0.0) == [-6.0] * 4 + [6.0] * 4  # ramps, North, South
    for lane in town.lanes:
        if lane.in_junction:
            assert np.ptp(lane.points[:, 2]) == 0.0


def test_each_group_of_lanes_of_a_lit_approach_has_its_own_light(towns: dict[str, Town]) -> None:
    town = towns["avenues"]
    lights = [signal for signal in town.signals if signal.kind is SignalKind.TRAFFIC_LIGHT]
    assert sorted(len(signal.lanes) for signal in lights) == [1, 1, 1, 2, 3, 3]
    ruled = [lane for signal in lights for lane in signal.lanes]
    assert len(ruled) == len(set(ruled))
    for signal in lights:
        lane = town.lanes[signal.lanes[0]]
        aside = lane.project(np.array(signal.position[:2]))[1]
        if [way.type for way in town.exits(lane.id)] == [LEFT]:
            assert aside == pytest.approx(-1.75 - 0.5)  # in the median
        else:
            assert aside == pytest.approx(1.75 + 1.0)
        assert math.cos(signal.heading - lane.headings[-1]) == pytest.approx(-1.0)


def test_stop_and_yield_signs_rule_all_lanes_of_the_approach(towns: dict[str, Town]) -> None:
    town = towns["avenues"]
    (stop,) = (signal for signal in town.signals if signal.kind is SignalKind.STOP)
    (give_way,) = (signal for signal in town.signals if signal.kind is SignalKind.YIELD)
    assert [street_of(town, lane) for lane in stop.lanes] == ["Lane"]
    assert [street_of(town, lane) for lane in give_way.lanes] == ["Avenue"] * 3
    assert {town.lanes[town.successors(lane)[0].target].junction_id for lane in give_way.lanes} == {1}


def test_a_written_programme_is_kept_with_yellow_and_clearance_between(towns: dict[str, Town]) -> None:
    town = towns["avenues"]
    (programme,) = town.programmes
    assert (programme.junction_id, programme.offset) == (0, 7.0)
    assert [phase.duration for phase in programme.phases] == [20.0, 4.0, 2.0, 8.0, 4.0, 2.0, 10.0, 3.5, 2.0]
    avenue = {
        s.id for s in town.signals if s.kind is SignalKind.TRAFFIC_LIGHT and street_of(town, s.lanes[0]) == "Avenue"
    }
    left = {s for s in avenue if len(town.signals[s].lanes) == 1}
    assert set(programme.phases[0].green) == avenue
    assert set(programme.phases[1].green) == left and set(programme.phases[1].yellow) == avenue - left
    assert set(programme.phases[3].green) == left and set(programme.phases[4].yellow) == left
    assert programme.phases[5].green == programme.phases[5].yellow == ()
    lane = next(lane for s in sorted(avenue - left) for lane in town.signals[s].lanes)
    assert [town.light(lane, 7.0 + t) for t in (1.0, 21.0, 24.0, 40.0)] == [
        LightColour.GREEN,
        LightColour.YELLOW,
        LightColour.RED,
        LightColour.RED,
    ]


def test_a_light_without_phases_gets_a_generated_programme(tmp_path: Path) -> None:
    text = AVENUES[: AVENUES.index("lights:")] + "lights: [cross, {at: north, offset: 12}]\n"
    town = compiled(tmp_path, text)
    assert [programme.junction_id for programme in town.programmes] == [0, 3]
    assert town.programmes[1].offset == 12.0
    for signal in town.signals:
        cycle = max(programme.cycle for programme in town.programmes)
        assert LightColour.GREEN in {town.light(signal.lanes[0], float(t)) for t in np.arange(0.0, 2.0 * cycle, 0.5)}


def test_a_crosswalk_lies_across_all_lanes_and_the_median(towns: dict[str, Town]) -> None:
    town = towns["avenues"]
    assert len(town.crosswalks) == 2
    for crosswalk in town.crosswalks:
        across, along = np.ptp(crosswalk.outline[:, 1]), np.ptp(crosswalk.outline[:, 0])
        assert (across, along) == pytest.approx((25.0 + 2 * 0.5, 3.0))
        assert np.mean(crosswalk.outline[:, 1]) == pytest.approx(0.0)
        inner = np.abs(crosswalk.outline[:, 0]).min()
        assert inner > 2 * 3.5  # clear of the wider half of the street that crosses


def test_pavements_run_beside_the_outermost_lanes_of_their_segment(towns: dict[str, Town]) -> None:
    town = towns["avenues"]
    assert len(town.sidewalks) == 2 * 8
    first, second = town.sidewalks[:2]
    assert first.points[:, 1] == pytest.approx(12.5 + 1.0) and second.points[:, 1] == pytest.approx(-12.5 - 1.0)
    assert first.points[:, 0].max() <= -13.0  # not into the junction
    assert not [s for s in towns["interchange"].sidewalks if s.street == 0]


def test_a_pavement_runs_around_a_roundabout_between_its_streets(tmp_path: Path) -> None:
    wide = CIRCUS.replace("Lane: {through: [n, circus, s]}", "Lane: {through: [n, circus, s], sidewalk: 3}")
    town = compiled(tmp_path, wide)
    street = next(street.id for street in town.streets if street.name == "circus")
    around = [walk for walk in town.sidewalks if walk.street == street]
    assert len(around) == 4 and {walk.width for walk in around} == {3.0}
    outer_edge = 30.0 + 3.5
    for walk in around:
        assert np.hypot(*walk.points[:, :2].T) == pytest.approx(outer_edge + 1.5)
        assert np.abs(walk.points[:, :2]).min() > 5.0  # the streets lie on the axes
    quarters = {(x > 0.0, y > 0.0) for x, y in (walk.points[len(walk.points) // 2, :2] for walk in around)}
    assert len(quarters) == 4
    assert check_town(town) == ()


def test_a_roundabout_of_streets_without_pavements_has_none(tmp_path: Path) -> None:
    assert compiled(tmp_path, "sidewalk: 0\n" + CIRCUS).sidewalks == ()


def test_a_pavement_around_a_roundabout_takes_no_room_from_its_streets(tmp_path: Path) -> None:
    def lengths(town: Town) -> list[float]:
        return [lane.length for lane in town.lanes if not lane.in_junction and street_of(town, lane.id) == "Avenue"]

    wide = CIRCUS.replace("Lane: {through: [n, circus, s]}", "Lane: {through: [n, circus, s], sidewalk: 6}")
    assert lengths(compiled(tmp_path, CIRCUS)) == pytest.approx(lengths(compiled(tmp_path, wide)), abs=1e-6)


def test_written_sites_are_reached_from_the_kerb_beside_them(towns: dict[str, Town]) -> None:
    town = towns["avenues"]
    assert [site.position for site in town.sites] == [(70.0, 22.0), (20.0, 80.0)]
    avenue, lane = (town.lanes[site.lane] for site in town.sites)
    assert town.sites[0].waypoint == pytest.approx((70.0, 10.75))
    assert avenue.position(town.sites[0].station) == pytest.approx(town.sites[0].waypoint)
    assert town.neighbour(avenue.id, LinkType.LANE_CHANGE_RIGHT) is None
    assert (street_of(town, avenue.id), street_of(town, lane.id)) == ("Avenue", "Lane")


def test_a_phase_without_lights_is_refused(tmp_path: Path) -> None:
    with pytest.raises(TownError, match="lights"):
        compiled(tmp_path, AVENUES.replace("{green: [Lane], seconds: 10}", "{green: [Avenue], seconds: 10}"))


def test_compiling_is_deterministic(tmp_path: Path, towns: dict[str, Town]) -> None:
    for name, text in PLANS.items():
        again, town = compiled(tmp_path, text), towns[name]
        assert all(np.array_equal(a.points, b.points) for a, b in zip(town.lanes, again.lanes, strict=True))
        assert (again.links, again.signals, again.sites) == (town.links, town.signals, town.sites)
