from pathlib import Path

import numpy as np
import pytest

from dorothie_gym.maps.lint import FaultKind, check_town
from dorothie_gym.maps.model import LaneLink, LinkType, SignalKind
from dorothie_gym.maps.opendrive import read_opendrive
from dorothie_gym.maps.town import Town

from .opendrive_text import geometry, lane, linked, opendrive, road, section


def _town(tmp_path: Path, *elements: str) -> Town:
    path = tmp_path / "small.xodr"
    path.write_text(opendrive(*elements))
    return read_opendrive(path)


def _next(kind: str, number: int, contact: str) -> str:
    return f'<{kind} elementType="road" elementId="{number}" contactPoint="{contact}"/>'


def test_y_is_mirrored_and_lanes_run_on_the_right(tmp_path: Path) -> None:
    plan = geometry("<line/>", 30.0, x=5.0, y=7.0, hdg=np.pi / 2)  # north
    town = _town(tmp_path, road(4, length=30.0, plan=plan, sections=section(0.0, lane(1), lane(-1))))
    forward, backward = sorted(town.lanes, key=lambda lane: lane.lane_id)
    assert (forward.road_id, forward.lane_id, forward.junction_id) == (4, -1, -1)
    assert forward.points[[0, -1]] == pytest.approx(np.array([[7.0, -7.0, 0.0], [7.0, -37.0, 0.0]]))
    assert backward.points[[0, -1]] == pytest.approx(np.array([[3.0, -37.0, 0.0], [3.0, -7.0, 0.0]]))
    assert forward.headings[0] == pytest.approx(-np.pi / 2)
    assert town.name == "small"


def test_left_hand_traffic_runs_the_other_way(tmp_path: Path) -> None:
    town = _town(tmp_path, road(length=30.0, sections=section(0.0, lane(-1)), rule='rule="LHT"'))
    assert town.lanes[0].points[0] == pytest.approx([30.0, 2.0, 0.0])


def test_lanes_lie_beside_what_is_between_them_and_the_reference_line(tmp_path: Path) -> None:
    rows = section(0.0, lane(-1, kind="median", width='a="1.5" b="0" c="0" d="0"'), lane(-2))
    offset = '<laneOffset s="0" a="0.5" b="0" c="0" d="0"/>'
    town = _town(tmp_path, road(length=40.0, sections=rows, offset=offset))
    assert town.lanes[0].points[:, 1] == pytest.approx(np.full(len(town.lanes[0].points), -0.5 + 1.5 + 2.0))


def test_width_and_height_follow_their_profiles(tmp_path: Path) -> None:
    rows = section(0.0, lane(-1, width='a="3" b="0" c="0.0012" d="-0.000008"'))
    profile = '<elevation s="0" a="1" b="0.1" c="0" d="0"/><elevation s="50" a="6" b="0.1" c="-0.002" d="0"/>'
    town = _town(tmp_path, road(sections=rows, profile=profile))
    lane_ = town.lanes[0]
    for s in np.linspace(0.0, 100.0, 21):
        station, _ = lane_.project(np.array([s, 0.0]))
        height = 1 + 0.1 * s - (0.002 * (s - 50) ** 2 if s > 50 else 0.0)
        assert lane_.height_at(station) == pytest.approx(height, abs=0.02)
        assert lane_.width_at(station) == pytest.approx(3 + 0.0012 * s**2 - 0.000008 * s**3, abs=0.02)


@pytest.mark.parametrize("radius", [6.0, 25.0, 300.0])
def test_curves_are_sampled_to_a_centimetre(tmp_path: Path, radius: float) -> None:
    length = 0.5 * np.pi * radius
    plan = geometry(f'<arc curvature="{1 / radius}"/>', length)
    lane_ = _town(tmp_path, road(length=length, plan=plan)).lanes[0]
    middles = 0.5 * (lane_.points[1:, :2] + lane_.points[:-1, :2])
    centre = np.array([0.0, -radius])
    for points in (lane_.points[:, :2], middles):
        assert np.hypot(*(points - centre).T) == pytest.approx(np.full(len(points), radius + 2.0), abs=0.01)
    assert np.diff(lane_.stations).max() <= 2.0


def test_sections_that_continue_one_to_one_are_one_lane(tmp_path: Path) -> None:
    rows = (
        section(0.0, lane(-1, more=linked(after=-1)))
        + section(30.0, lane(-1, more=linked(-1, -2)))
        + section(30.0, lane(-1, kind="median"), lane(-2, more=linked(-1)))
    )
    assert len(_town(tmp_path, road(sections=rows)).lanes) == 1


def test_roads_that_continue_one_to_one_stay_two_lanes(tmp_path: Path) -> None:
    first = road(1, link=_next("successor", 2, "start"), sections=section(0.0, lane(-1, more=linked(after=-1))))
    plan = geometry("<line/>", 50.0, x=100.0)
    back = section(0.0, lane(-1, more=linked(before=-1)))
    second = road(2, length=50.0, plan=plan, link=_next("predecessor", 1, "end"), sections=back)
    town = _town(tmp_path, first, second)
    assert [lane.road_id for lane in town.lanes] == [1, 2]
    assert town.links == (LaneLink(0, 1, LinkType.STRAIGHT),)


@pytest.mark.parametrize("length", [1e-5, 0.0])
def test_a_road_of_no_length_is_left_out_and_linked_across(tmp_path: Path, length: float) -> None:
    ends = _next("predecessor", 1, "end") + _next("successor", 3, "start")
    both = section(0.0, lane(-1, more=linked(-1, -1)))
    town = _town(
        tmp_path,
        road(1, link=_next("successor", 2, "start"), sections=section(0.0, lane(-1, more=linked(after=-1)))),
        road(2, length=length, plan=geometry('<arc curvature="0.1"/>', length, x=100.0), link=ends, sections=both),
        road(3, plan=geometry("<line/>", 100.0, x=100.0), sections=section(0.0, lane(-1))),
    )
    assert [lane.road_id for lane in town.lanes] == [1, 3]
    assert [(link.source, link.target) for link in town.links] == [(0, 1)]


def test_a_small_gap_between_linked_lanes_is_closed(tmp_path: Path) -> None:
    first = road(1, link=_next("successor", 2, "start"), sections=section(0.0, lane(-1, more=linked(after=-1))))
    second = road(2, plan=geometry("<line/>", 100.0, x=100.02, y=0.03))
    town = _town(tmp_path, first, second)
    assert town.lanes[0].points[-1] == pytest.approx(town.lanes[1].points[0])
    assert town.lanes[0].points[-1] == pytest.approx([100.01, 2.0 - 0.015, 0.0])


def test_a_gap_beyond_rounding_is_kept_and_reported(tmp_path: Path) -> None:
    first = road(1, link=_next("successor", 2, "start"), sections=section(0.0, lane(-1, more=linked(after=-1))))
    town = _town(tmp_path, first, road(2, plan=geometry("<line/>", 100.0, x=100.1, y=0.08)))
    assert town.lanes[1].points[0] == pytest.approx([100.1, 2.0 - 0.08, 0.0])
    assert FaultKind.GAP in {fault.kind for fault in check_town(town)}


def _two_lanes(mark: str) -> str:
    inner = f'<lane id="-1" type="driving"><width sOffset="0" a="3" b="0" c="0" d="0"/>{mark}</lane>'
    return road(sections=section(0.0, inner, lane(-2)))


@pytest.mark.parametrize(
    ("allowed", "kinds"),
    [
        ("both", {(0, 1): LinkType.LANE_CHANGE_LEFT, (1, 0): LinkType.LANE_CHANGE_RIGHT}),
        ("increase", {(0, 1): LinkType.LANE_CHANGE_LEFT}),
        ("decrease", {(1, 0): LinkType.LANE_CHANGE_RIGHT}),
        ("none", {}),
    ],
)
def test_lanes_are_changed_where_the_mark_allows(
    tmp_path: Path, allowed: str, kinds: dict[tuple[int, int], LinkType]
) -> None:
    town = _town(tmp_path, _two_lanes(f'<roadMark sOffset="0" type="broken" laneChange="{allowed}"/>'))
    assert [lane.lane_id for lane in town.lanes] == [-2, -1]
    assert {(link.source, link.target): link.type for link in town.links} == kinds


def test_lanes_without_a_mark_can_be_changed(tmp_path: Path) -> None:
    assert len(_town(tmp_path, _two_lanes("")).links) == 2


def test_opposite_lanes_are_no_lane_change(tmp_path: Path) -> None:
    assert _town(tmp_path, road(sections=section(0.0, lane(1), lane(-1)))).links == ()


@pytest.mark.parametrize(
    ("speed", "limit"),
    [('max="36" unit="km/h"', 10.0), ('max="10" unit="mph"', 4.4704), ('max="9"', 9.0), ('max="no limit"', 50 / 3.6)],
)
def test_speed_limits_come_in_any_unit(tmp_path: Path, speed: str, limit: float) -> None:
    kind = f'<type s="0" type="town"><speed {speed}/></type>'
    assert _town(tmp_path, road(more=kind)).lanes[0].speed_limit == pytest.approx(limit)


def test_a_lane_has_its_own_limit_before_the_road_s(tmp_path: Path) -> None:
    kind = '<type s="0" type="town"><speed max="36" unit="km/h"/></type>'
    own = section(0.0, lane(-1, more='<speed sOffset="0" max="5" unit="m/s"/>'))
    assert _town(tmp_path, road(more=kind, sections=own)).lanes[0].speed_limit == 5.0


def _junction() -> tuple[str, ...]:
    """A road into a junction, one connector straight on and one to the left, and the roads behind them."""
    entry = road(1, link='<successor elementType="junction" elementId="9"/>', more=_signals())
    both = section(0.0, lane(-1, more=linked(-1, -1)))
    ahead = road(
        2,
        length=20.0,
        junction=9,
        plan=geometry("<line/>", 20.0, x=100.0),
        link=_next("predecessor", 1, "end") + _next("successor", 4, "start"),
        sections=both,
        more='<signals><signalReference id="70" s="1" t="0" orientation="+"><validity fromLane="-1" toLane="-1"/>'
        "</signalReference></signals>",
    )
    left = road(
        3,
        length=5.0 * np.pi,
        junction=9,
        plan=geometry('<arc curvature="0.1"/>', 5.0 * np.pi, x=100.0),
        link=_next("predecessor", 1, "end") + _next("successor", 5, "start"),
        sections=both,
    )
    after = section(0.0, lane(-1, more=linked(before=-1)))
    from_junction = '<predecessor elementType="junction" elementId="9"/>'
    east = road(4, plan=geometry("<line/>", 100.0, x=120.0), link=from_junction, sections=after)
    north = road(5, plan=geometry("<line/>", 100.0, x=110.0, y=10.0, hdg=np.pi / 2), link=from_junction, sections=after)
    rows = "".join(
        f'<connection id="{k}" incomingRoad="1" connectingRoad="{k + 2}" contactPoint="start">'
        '<laneLink from="-1" to="-1"/></connection>'
        for k in (0, 1)
    )
    return entry, ahead, left, east, north, f'<junction id="9">{rows}</junction>'


def _signals() -> str:
    common = 'zOffset="3" hOffset="0" orientation="+"'
    return (
        f'<signals><signal id="70" s="98" t="-3" {common} dynamic="yes" type="1000001">'
        '<validity fromLane="0" toLane="0"/></signal>'
        f'<signal id="71" s="50" t="-5" {common} dynamic="no" type="274" value="30"/>'
        f'<signal id="72" s="99" t="-5" {common} dynamic="no" type="206" value="-1"/></signals>'
    )


def test_a_junction_has_its_connectors_and_turn_types(tmp_path: Path) -> None:
    town = _town(tmp_path, *_junction())
    assert {(link.source, link.target): link.type for link in town.links} == {
        (0, 1): LinkType.STRAIGHT,
        (0, 2): LinkType.LEFT,
        (1, 3): LinkType.STRAIGHT,
        (2, 4): LinkType.STRAIGHT,
    }
    (junction,) = town.junctions
    assert (junction.id, junction.connectors) == (9, (1, 2))
    assert 100.0 < junction.position[0] < 120.0
    assert [(e.type, e.angle, e.lane) for e in town.exits(0)] == [(LinkType.STRAIGHT, 0, 3), (LinkType.LEFT, 90, 4)]


def test_signals_are_counted_once_and_rule_the_lane_into_the_junction(tmp_path: Path) -> None:
    light, limit, stop = _town(tmp_path, *_junction()).signals
    assert (light.id, light.kind, light.lanes) == (70, SignalKind.TRAFFIC_LIGHT, (0,))
    assert light.position == pytest.approx((98.0, 3.0, 3.0))
    assert abs(light.heading) == pytest.approx(np.pi)  # faces west, towards those who come from there
    assert (limit.kind, limit.value, limit.lanes) == (SignalKind.SPEED, pytest.approx(30 / 3.6), (0,))
    assert (stop.kind, stop.value) == (SignalKind.STOP, None)


@pytest.mark.parametrize(
    "outline",
    [
        '<outline><cornerLocal u="-1" v="-4" z="0"/><cornerLocal u="1" v="-4" z="0"/>'
        '<cornerLocal u="1" v="4" z="0"/><cornerLocal u="-1" v="4" z="0"/><cornerLocal u="-1" v="-4" z="0"/></outline>',
        '<outlines><outline><cornerRoad s="19" t="-4"/><cornerRoad s="21" t="-4"/><cornerRoad s="21" t="4"/>'
        '<cornerRoad s="19" t="4"/></outline></outlines>',
    ],
)
def test_crosswalks_are_placed_in_the_town_s_frame(tmp_path: Path, outline: str) -> None:
    crossing = f'<objects><object id="1" type="crosswalk" s="20" t="0" hdg="0">{outline}</object></objects>'
    (found,) = _town(tmp_path, road(more=crossing)).crosswalks
    assert found.outline == pytest.approx(np.array([[19.0, 4.0], [21.0, 4.0], [21.0, -4.0], [19.0, -4.0]]))
