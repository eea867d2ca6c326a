"""Lanes in files of different exporters: borders, tilted roads, opening lanes, links to missing lanes."""

import logging
from pathlib import Path

import numpy as np
import pytest

from dorothie_gym.maps.model import Lane, LinkType
from dorothie_gym.maps.opendrive import read_opendrive
from dorothie_gym.maps.opendrive.geometry import Spiral
from dorothie_gym.maps.town import Town

from .opendrive_text import geometry, lane, linked, opendrive, road, section


def _read(tmp_path: Path, *elements: str) -> Town:
    path = tmp_path / "small.xodr"
    path.write_text(opendrive(*elements))
    return read_opendrive(path)


def _at(lane: Lane, x: float) -> tuple[float, float, float]:
    """Lateral place (south), height and width of a lane that runs along the x axis."""
    station, _ = lane.project(np.array([x, 0.0]))
    return float(lane.position(station)[1]), lane.height_at(station), lane.width_at(station)


def _next(kind: str, number: int, contact: str) -> str:
    return f'<{kind} elementType="road" elementId="{number}" contactPoint="{contact}"/>'


def _bordered(number: int, border: str, kind: str = "driving") -> str:
    return f'<lane id="{number}" type="{kind}" level="false"><border sOffset="0" {border}/></lane>'


def test_lanes_may_be_given_by_their_borders(tmp_path: Path) -> None:
    rows = section(
        0.0,
        _bordered(2, 'a="7" b="0" c="0" d="0"'),
        _bordered(1, 'a="4" b="0" c="0" d="0"'),
        _bordered(-1, 'a="-3" b="-0.01" c="0" d="0"'),
        lane(-2, width='a="2" b="0" c="0" d="0"'),
    )
    town = _read(tmp_path, road(sections=rows))
    by_number = {lane.lane_id: lane for lane in town.lanes}
    assert _at(by_number[2], 50.0) == pytest.approx((-5.5, 0.0, 3.0))
    assert _at(by_number[1], 50.0) == pytest.approx((-2.0, 0.0, 4.0))
    assert _at(by_number[-1], 50.0) == pytest.approx((1.75, 0.0, 3.5), abs=0.01)
    assert _at(by_number[-2], 50.0) == pytest.approx((4.5, 0.0, 2.0), abs=0.01)  # beside the border, by its width


def test_a_border_stays_where_it_is_when_the_middle_is_shifted(tmp_path: Path) -> None:
    offset = '<laneOffset s="0" a="-1" b="0" c="0" d="0"/>'
    rows = section(0.0, _bordered(-1, 'a="-4" b="0" c="0" d="0"'))
    assert _at(_read(tmp_path, road(sections=rows, offset=offset)).lanes[0], 50.0) == pytest.approx((2.5, 0.0, 3.0))


def test_widths_count_where_a_lane_has_borders_too(tmp_path: Path) -> None:
    both = (
        '<lane id="-1" type="driving"><width sOffset="0" a="3" b="0" c="0" d="0"/>'
        '<border sOffset="0" a="-9" b="0" c="0" d="0"/></lane>'
    )
    assert _at(_read(tmp_path, road(sections=section(0.0, both))).lanes[0], 50.0) == pytest.approx((1.5, 0.0, 3.0))


def test_a_tilted_road_is_seen_from_above(tmp_path: Path) -> None:
    tilt = 0.3
    profile = '<elevation s="0" a="10" b="0" c="0" d="0"/>'
    lateral = f'<lateralProfile><superelevation s="0" a="{tilt}" b="0" c="0" d="0"/></lateralProfile>'
    town = _read(tmp_path, road(sections=section(0.0, lane(1), lane(-1)), profile=profile, more=lateral))
    right, left = sorted(town.lanes, key=lambda lane: lane.lane_id)
    assert _at(right, 50.0) == pytest.approx((2.0 * np.cos(tilt), 10.0 - 2.0 * np.sin(tilt), 4.0))
    assert _at(left, 50.0) == pytest.approx((-2.0 * np.cos(tilt), 10.0 + 2.0 * np.sin(tilt), 4.0))


def test_a_shift_of_the_middle_moves_all_lanes_with_it(tmp_path: Path) -> None:
    offset = '<laneOffset s="0" a="0" b="0" c="0" d="0"/><laneOffset s="40" a="0" b="0" c="0.0075" d="-0.00025"/>'
    offset += '<laneOffset s="60" a="1" b="0" c="0" d="0"/>'
    town = _read(tmp_path, road(sections=section(0.0, lane(1), lane(-1)), offset=offset))
    for found in town.lanes:
        side = 2.0 if found.lane_id < 0 else -2.0
        assert [_at(found, x)[0] for x in (20.0, 50.0, 80.0)] == pytest.approx([side, side - 0.5, side - 1.0], abs=0.02)


@pytest.mark.parametrize("kind", ["driving", "entry", "exit", "onRamp", "offRamp", "connectingRamp"])
def test_ramps_are_driven_on(tmp_path: Path, kind: str) -> None:
    assert len(_read(tmp_path, road(sections=section(0.0, lane(-1), lane(-2, kind=kind)))).lanes) == 2


@pytest.mark.parametrize(
    "kind",
    ["bidirectional", "biking", "bus", "median", "none", "parking", "restricted", "shoulder", "sidewalk", "stop"],
)
def test_lanes_of_other_types_take_room_but_are_not_driven_on(tmp_path: Path, kind: str) -> None:
    town = _read(tmp_path, road(sections=section(0.0, lane(-1, kind=kind), lane(-2))))
    assert [found.lane_id for found in town.lanes] == [-2]
    assert _at(town.lanes[0], 50.0)[0] == pytest.approx(6.0)


OPENING = 'a="0" b="0" c="0.01" d="-0.00022222"'  # from nothing to 3 m within 30 m


def test_a_lane_that_opens_beside_another_begins_where_one_can_drive(tmp_path: Path) -> None:
    pocket = (
        '<lane id="-2" type="driving"><width sOffset="0" a="0" b="0" c="0" d="0"/>'
        f'<width sOffset="20" {OPENING}/><width sOffset="50" a="3" b="0" c="0" d="0"/></lane>'
    )
    town = _read(tmp_path, road(sections=section(0.0, lane(-1), pocket)))
    turn, through = town.lanes
    assert (turn.lane_id, through.lane_id) == (-2, -1)
    assert turn.points[0, 0] == pytest.approx(35.0, abs=0.3)
    assert turn.widths.min() >= 1.5
    assert turn.points[-1] == pytest.approx([100.0, 5.5, 0.0])
    assert through.length == pytest.approx(100.0)
    assert {(link.source, link.target): link.type for link in town.links} == {
        (0, 1): LinkType.LANE_CHANGE_LEFT,
        (1, 0): LinkType.LANE_CHANGE_RIGHT,
    }


def test_a_lane_that_closes_beside_another_ends_where_one_can_still_drive(tmp_path: Path) -> None:
    closing = '<lane id="-2" type="driving"><width sOffset="0" a="3" b="0" c="-0.0009" d="0.000006"/></lane>'
    ending, _ = _read(tmp_path, road(sections=section(0.0, lane(-1), closing))).lanes
    assert ending.points[0, 0] == pytest.approx(0.0)
    assert 40.0 < ending.points[-1, 0] < 60.0
    assert ending.widths.min() >= 1.45


def test_a_lane_that_is_only_announced_does_not_count_until_it_has_a_width(tmp_path: Path) -> None:
    closed = lane(-2, width='a="0" b="0" c="0" d="0"', more=linked(after=-2))
    rows = section(0.0, lane(-1, more=linked(after=-1)), closed)
    rows += section(40.0, lane(-1, more=linked(before=-1)), lane(-2, more=linked(before=-2)))
    through, pocket = _read(tmp_path, road(sections=rows)).lanes
    assert pocket.points[[0, -1], 0] == pytest.approx([40.0, 100.0])
    assert through.points[[0, -1], 0] == pytest.approx([0.0, 100.0])


def test_a_lane_that_opens_out_of_another_is_joined_to_it_smoothly(tmp_path: Path) -> None:
    first = road(1, link=_next("successor", 2, "start"), sections=section(0.0, lane(-1, more=linked(after=-1))))
    rows = section(0.0, lane(-1, more=linked(before=-1)), lane(-2, width=OPENING, more=linked(before=-1)))
    back = _next("predecessor", 1, "end")
    second = road(2, length=30.0, plan=geometry("<line/>", 30.0, x=100.0), link=back, sections=rows)
    town = _read(tmp_path, first, second)
    before, pocket, through = town.lanes
    assert {(link.source, link.target) for link in town.links if not link.type.is_lane_change} == {(0, 1), (0, 2)}
    assert pocket.points[0] == pytest.approx(before.points[-1])
    assert through.points[0] == pytest.approx(before.points[-1])
    assert before.points[-1] == pytest.approx([100.0, 2.0, 0.0])
    assert pocket.points[-1] == pytest.approx([130.0, 5.5, 0.0], abs=0.01)
    assert abs(np.degrees(pocket.headings[0])) < 5.0
    assert np.degrees(np.abs(np.diff(pocket.headings))).max() < 5.0


def test_lane_links_that_lead_nowhere_are_left_out_and_logged(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    rows = section(0.0, lane(-1, more=linked(after=-3))) + section(50.0, lane(-1))
    with caplog.at_level(logging.WARNING):
        town = _read(tmp_path, road(12, sections=rows))
    assert (len(town.lanes), town.links) == (2, ())
    (record,) = caplog.records
    assert "small.xodr: road 12 / laneSection 0 / lane -1: links lane -3 of road 12" in record.getMessage()


def test_lane_links_against_the_traffic_are_left_out_and_logged(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    rows = section(0.0, lane(-1, more=linked(after=1))) + section(50.0, lane(1), lane(-1))
    with caplog.at_level(logging.WARNING):
        town = _read(tmp_path, road(12, sections=rows))
    assert town.links == ()
    assert "opposite directions" in caplog.text


def test_roads_that_meet_head_on_continue_in_each_other_s_opposite_lanes(tmp_path: Path) -> None:
    first = road(
        1,
        link=_next("successor", 2, "end"),
        sections=section(0.0, lane(1, more=linked(after=-1)), lane(-1, more=linked(after=1))),
    )
    plan = geometry("<line/>", 50.0, x=150.0, hdg=np.pi)
    second = road(
        2,
        length=50.0,
        plan=plan,
        link=_next("successor", 1, "end"),
        sections=section(0.0, lane(1, more=linked(after=-1)), lane(-1, more=linked(after=1))),
    )
    town = _read(tmp_path, first, second)
    ways = {(link.source, link.target) for link in town.links}
    assert {tuple((town.lanes[k].road_id, town.lanes[k].lane_id) for k in way) for way in ways} == {
        ((1, -1), (2, 1)),
        ((2, -1), (1, 1)),
    }


@pytest.mark.parametrize("link", ['elementType="road" elementId="-1"', 'elementType="junction" elementId="-1"'])
def test_a_link_to_minus_one_is_none(tmp_path: Path, link: str) -> None:
    assert len(_read(tmp_path, road(link=f"<successor {link}/>")).lanes) == 1


def test_a_side_road_of_a_virtual_junction_is_kept_without_a_way_on(tmp_path: Path) -> None:
    link = '<predecessor elementType="road" elementId="1" elementS="50" elementDir="+"/>'
    side = road(2, length=30.0, junction=7, plan=geometry("<line/>", 30.0, x=50.0, hdg=-1.0), link=link)
    junction = (
        '<junction id="7" type="virtual" mainRoad="1" sStart="45" sEnd="55" orientation="+">'
        '<connection id="0" incomingRoad="1" connectingRoad="2" contactPoint="start"><laneLink from="-1" to="-1"/>'
        '</connection><connection id="1" incomingRoad="1"/></junction>'
    )
    town = _read(tmp_path, road(1), side, junction)
    assert (len(town.lanes), town.links) == (2, ())


def _fork() -> tuple[str, ...]:
    """A road with two lanes that divides without roads between; the road that turns off runs towards the junction."""
    at_junction = 'elementType="junction" elementId="9"'
    main = road(
        2,
        plan=geometry("<line/>", 100.0, x=100.0),
        link=f"<predecessor {at_junction}/>",
        sections=section(0.0, lane(1), lane(-1)),
    )
    plan = geometry("<line/>", 100.0, x=200.0, y=-4.0, hdg=np.pi)
    off = road(3, plan=plan, link=f"<successor {at_junction}/>", sections=section(0.0, lane(1)))
    junction = (
        '<junction id="9" type="direct"><connection id="0" incomingRoad="1" linkedRoad="2" contactPoint="start">'
        '<laneLink from="1" to="1"/><laneLink from="-1" to="-1"/></connection>'
        '<connection id="1" incomingRoad="1" linkedRoad="3" contactPoint="end">'
        '<laneLink from="-2" to="1"/></connection></junction>'
    )
    wide = section(0.0, lane(1), lane(-1), lane(-2))
    return road(1, link=f"<successor {at_junction}/>", sections=wide), main, off, junction


def test_a_direct_junction_links_its_roads_in_driving_direction(tmp_path: Path) -> None:
    town = _read(tmp_path, *_fork())
    name = [(lane.road_id, lane.lane_id) for lane in town.lanes]
    ways = {(name[link.source], name[link.target]) for link in town.links if not link.type.is_lane_change}
    assert ways == {((1, -1), (2, -1)), ((1, -2), (3, 1)), ((2, 1), (1, 1))}
    for link in town.links:
        if not link.type.is_lane_change:
            gap = town.lanes[link.source].points[-1] - town.lanes[link.target].points[0]
            assert np.linalg.norm(gap) < 0.01
    assert town.junctions == ()


def _crossing(connection: str, own_links: str = "") -> tuple[str, ...]:
    """A road, a connecting road that runs against its own reference line, and the road behind it."""
    plan = geometry("<line/>", 20.0, x=120.0, hdg=np.pi)
    return (
        road(1, link='<successor elementType="junction" elementId="9"/>', sections=section(0.0, lane(1), lane(-1))),
        road(
            2,
            length=20.0,
            junction=9,
            plan=plan,
            link=_next("predecessor", 3, "start") + _next("successor", 1, "end"),
            sections=section(0.0, lane(1, more=own_links)),
        ),
        road(3, plan=geometry("<line/>", 100.0, x=120.0), sections=section(0.0, lane(1), lane(-1))),
        f'<junction id="9"><connection id="0" incomingRoad="1" connectingRoad="2" contactPoint="end">{connection}'
        "</connection></junction>",
    )


@pytest.mark.parametrize("connection", ['<laneLink from="-1" to="1"/>', ""])
def test_a_connection_that_names_no_lanes_means_the_same_ones(tmp_path: Path, connection: str) -> None:
    town = _read(tmp_path, *_crossing(connection, linked(before=-1)))
    name = [(lane.road_id, lane.lane_id) for lane in town.lanes]
    ways = {(name[link.source], name[link.target]) for link in town.links}
    assert ways == {((1, -1), (2, 1)), ((2, 1), (3, -1))}


@pytest.mark.parametrize("p_range", ["arcLength", "normalized", None])
def test_parametric_cubics_run_to_their_end_whatever_their_parameter_is(tmp_path: Path, p_range: str | None) -> None:
    length = 50.0
    scale = 1.0 if p_range == "arcLength" else length
    named = f'pRange="{p_range}"' if p_range else ""
    shape = f'<paramPoly3 {named} aU="0" bU="{scale}" cU="0" dU="0" aV="0" bV="0" cV="{0.004 * scale**2}" dV="0"/>'
    found = _read(tmp_path, road(length=length, plan=geometry(shape, length), sections=section(0.0, lane(-1)))).lanes[0]
    end, direction = np.array([50.0, -10.0]), np.arctan(0.4)
    right = np.array([-np.sin(-direction), np.cos(-direction)])
    assert found.points[-1, :2] == pytest.approx(end + 2.0 * right, abs=0.02)
    assert found.headings[-1] == pytest.approx(-direction, abs=0.01)


def test_a_road_of_straight_spiral_and_curve_has_no_kinks(tmp_path: Path) -> None:
    u, v, turned = (float(a[0]) for a in Spiral(0.0, 0.02).place(np.array([30.0]), 30.0))
    plan = (
        geometry("<line/>", 20.0)
        + geometry('<spiral curvStart="0" curvEnd="0.02"/>', 30.0, s=20.0, x=20.0)
        + geometry('<arc curvature="0.02"/>', 50.0, s=50.0, x=20.0 + u, y=v, hdg=turned)
    )
    found = _read(tmp_path, road(plan=plan)).lanes[0]
    assert found.headings[-1] == pytest.approx(-(0.3 + 1.0), abs=0.005)
    bends = np.abs(np.diff(found.headings)) / np.diff(found.stations)
    assert bends.max() < 0.025
