"""Signals, crosswalks and sidewalks in files of different exporters."""

from pathlib import Path

import numpy as np
import pytest

from dorothie_gym.maps.model import Signal, SignalKind
from dorothie_gym.maps.opendrive import read_opendrive
from dorothie_gym.maps.town import LightColour, Town

from .opendrive_text import geometry, lane, linked, opendrive, road, section, shared_map


def _read(tmp_path: Path, *elements: str) -> Town:
    path = tmp_path / "small.xodr"
    path.write_text(opendrive(*elements))
    return read_opendrive(path)


def _next(kind: str, number: int, contact: str) -> str:
    return f'<{kind} elementType="road" elementId="{number}" contactPoint="{contact}"/>'


def _signal(number: int, s: float, more: str = "", *, kind: str = "206", tag: str = "signal", lanes: str = "") -> str:
    return f'<{tag} id="{number}" s="{s}" t="-4" {more} type="{kind}" value="-1">{lanes}</{tag}>'


def _street(first: str = "", second: str = "", connector: str = "", out: str = "") -> tuple[str, ...]:
    """Road 1 (100 m), road 2 (20 m) to a junction, connector 3 (20 m), road 4 (100 m); one lane each way on 1, 2, 4."""

    def signals(rows: str) -> str:
        return f"<signals>{rows}</signals>"

    both = section(0.0, lane(1, more=linked(1, 1)), lane(-1, more=linked(-1, -1)))
    to_junction = 'elementType="junction" elementId="9"/>'
    return (
        road(1, link=_next("successor", 2, "start"), sections=both, more=signals(first)),
        road(
            2,
            length=20.0,
            plan=geometry("<line/>", 20.0, x=100.0),
            link=_next("predecessor", 1, "end") + f"<successor {to_junction}",
            sections=both,
            more=signals(second),
        ),
        road(
            3,
            length=20.0,
            junction=9,
            plan=geometry("<line/>", 20.0, x=120.0),
            link=_next("predecessor", 2, "end") + _next("successor", 4, "start"),
            sections=section(0.0, lane(-1, more=linked(-1, -1))) + section(1e-5, lane(-1, more=linked(-1, -1))),
            more=signals(connector),
        ),
        road(
            4,
            plan=geometry("<line/>", 100.0, x=140.0),
            link=f"<predecessor {to_junction}",
            sections=both,
            more=signals(out),
        ),
        '<junction id="9"><connection id="0" incomingRoad="2" connectingRoad="3" contactPoint="start">'
        '<laneLink from="-1" to="-1"/></connection></junction>',
    )


def _ruled(town: Town, number: int = 0) -> set[tuple[int, int]]:
    """Roads and lane numbers of the lanes that a signal rules."""
    return {(town.lanes[k].road_id, town.lanes[k].lane_id) for k in town.signals[number].lanes}


def test_a_sign_before_the_end_of_its_road_rules_the_lane_into_the_junction(tmp_path: Path) -> None:
    assert _ruled(_read(tmp_path, *_street(first=_signal(70, 95.0, 'orientation="+"')))) == {(2, -1)}
    assert _ruled(_read(tmp_path, *_street(second=_signal(70, 15.0, 'orientation="+"')))) == {(2, -1)}


def test_a_speed_limit_holds_on_its_own_lane(tmp_path: Path) -> None:
    town = _read(tmp_path, *_street(first=_signal(70, 10.0, 'orientation="+"', kind="274")))
    assert _ruled(town) == {(1, -1)}


def test_a_light_at_the_far_side_of_its_junction_does_not_rule_the_road_that_leads_away(tmp_path: Path) -> None:
    far = _signal(70, 3.0, 'orientation="+" dynamic="yes"', kind="1000001")
    assert _ruled(_read(tmp_path, *_street(out=far))) == set()
    assert _ruled(_read(tmp_path, *_street(out=_signal(70, 3.0, 'orientation="-"')))) == {(4, 1)}


@pytest.mark.parametrize("s", [0.0, 10.0, 20.0])
def test_a_reference_on_a_connector_rules_the_lane_before_it(tmp_path: Path, s: float) -> None:
    none, connector = '<validity fromLane="0" toLane="0"/>', '<validity fromLane="-1" toLane="-1"/>'
    pole = _signal(70, 3.0, 'orientation="+" dynamic="yes"', kind="1000001", lanes=none)
    reference = _signal(70, s, 'orientation="-"', tag="signalReference", lanes=connector)
    town = _read(tmp_path, *_street(out=pole, connector=reference))
    assert _ruled(town) == {(2, -1)}
    assert town.signals[0].position[0] == pytest.approx(143.0)


def test_a_reference_to_a_missing_signal_is_ignored(tmp_path: Path) -> None:
    assert _read(tmp_path, *_street(connector=_signal(70, 3.0, tag="signalReference"))).signals == ()


@pytest.mark.parametrize(
    ("orientation", "validity", "ruled"),
    [
        ("+", (-1, -1), {(2, -1)}),
        ("-", (-1, -1), {(2, -1)}),  # what is named counts, whatever way it is said to face
        ("+", (-3, 2), {(2, -1)}),
        ("-", (2, -3), {(2, 1)}),
        ("none", (1, -1), {(2, 1), (2, -1)}),
        ("+", (0, 0), set()),
        ("+", None, {(2, -1)}),
        ("-", None, {(2, 1)}),
    ],
)
def test_a_signal_rules_the_lanes_it_names(
    tmp_path: Path, orientation: str, validity: tuple[int, int] | None, ruled: set[tuple[int, int]]
) -> None:
    named = "" if validity is None else f'<validity fromLane="{validity[0]}" toLane="{validity[1]}"/>'
    town = _read(tmp_path, *_street(second=_signal(70, 10.0, f'orientation="{orientation}"', lanes=named)))
    assert _ruled(town) == ruled


@pytest.mark.parametrize(
    ("kind", "dynamic", "expected"),
    [
        ("1000001", "yes", SignalKind.TRAFFIC_LIGHT),
        ("1000011", "yes", SignalKind.TRAFFIC_LIGHT),
        ("1000002", "yes", SignalKind.OTHER),  # for those on foot
        ("206", "no", SignalKind.STOP),
        ("205", "no", SignalKind.YIELD),
        ("274", "no", SignalKind.SPEED),
        ("294", "no", SignalKind.OTHER),
    ],
)
def test_kind_of_a_signal_follows_from_its_type(tmp_path: Path, kind: str, dynamic: str, expected: SignalKind) -> None:
    (signal,) = _read(tmp_path, *_street(first=_signal(70, 5.0, f'dynamic="{dynamic}"', kind=kind))).signals
    assert isinstance(signal, Signal)
    assert signal.kind is expected


@pytest.mark.parametrize(
    ("value", "expected"),
    [('value="30"', 30 / 3.6), ('value="3.0e+1" unit="mph"', 30 * 0.44704), ('value="-1.0"', None), ('value=""', None)],
)
def test_limits_on_signs_come_in_their_units(tmp_path: Path, value: str, expected: float | None) -> None:
    sign = f'<signals><signal id="7" s="5" t="0" type="274" {value}/></signals>'
    (signal,) = _read(tmp_path, road(more=sign)).signals
    assert signal.value == (None if expected is None else pytest.approx(expected))


def test_an_imported_light_changes_by_a_programme(tmp_path: Path) -> None:
    light = _signal(70, 18.0, 'orientation="+" dynamic="yes"', kind="1000001")
    town = _read(tmp_path, *_street(second=light))
    (programme,) = town.programmes
    assert (programme.junction_id, programme.signals) == (9, (70,))
    (approach,) = town.signals[0].lanes
    shown = {town.light(approach, time) for time in np.arange(0.0, programme.cycle, 0.5)}
    assert LightColour.GREEN in shown


def test_every_light_of_town02_is_green_at_times_and_red_at_others() -> None:
    town = read_opendrive(shared_map("Town02"))
    assert sorted(k for programme in town.programmes for k in programme.signals) == [s.id for s in town.signals]
    assert {programme.junction_id for programme in town.programmes} <= {junction.id for junction in town.junctions}
    for programme in town.programmes:
        for number in programme.signals:
            shown = {programme.colour(number, time) for time in np.arange(0.0, programme.cycle, 0.5)}
            assert {LightColour.GREEN, LightColour.RED} <= shown


def _crosswalk(inside: str, more: str = "") -> str:
    return f'<objects><object id="1" type="crosswalk" s="20" {more}>{inside}</object></objects>'


def test_a_crosswalk_may_have_only_a_length_and_a_width(tmp_path: Path) -> None:
    crossing = _crosswalk("", f't="1" hdg="{np.pi / 2}" length="8" width="3"')
    (found,) = _read(tmp_path, road(more=crossing)).crosswalks
    low, high = found.outline.min(axis=0), found.outline.max(axis=0)
    assert low == pytest.approx([18.5, -5.0])
    assert high == pytest.approx([21.5, 3.0])


def test_the_outer_outline_of_a_crosswalk_counts(tmp_path: Path) -> None:
    def outline(size: float) -> str:
        corners = ((-size, -size), (size, -size), (size, size), (-size, size))
        return "<outline>" + "".join(f'<cornerLocal u="{u}" v="{v}" z="0"/>' for u, v in corners) + "</outline>"

    crossing = _crosswalk(f"<outlines>{outline(4.0)}{outline(1.0)}</outlines>", 't="0"')
    (found,) = _read(tmp_path, road(more=crossing)).crosswalks
    assert found.outline.shape == (4, 2)
    assert np.ptp(found.outline, axis=0) == pytest.approx([8.0, 8.0])


def test_a_crosswalk_without_any_shape_is_left_out(tmp_path: Path) -> None:
    assert _read(tmp_path, road(more=_crosswalk("", 't="0"'))).crosswalks == ()


def _walk(number: int, width: float = 2.0) -> str:
    return lane(number, kind="sidewalk", width=f'a="{width}" b="0" c="0" d="0"')


def test_sidewalks_run_along_both_sides_of_their_street(tmp_path: Path) -> None:
    town = _read(tmp_path, road(sections=section(0.0, _walk(2), lane(1), lane(-1), _walk(-2))))
    left, right = town.sidewalks
    assert (left.id, right.id) == (0, 1)
    assert left.points[[0, -1]] == pytest.approx(np.array([[0.0, -5.0, 0.0], [100.0, -5.0, 0.0]]))
    assert right.points[[0, -1]] == pytest.approx(np.array([[0.0, 5.0, 0.0], [100.0, 5.0, 0.0]]))
    assert left.width == right.width == pytest.approx(2.0)
    assert left.street == right.street == town.lanes[0].street == 0


def test_sidewalks_continue_through_lane_sections_and_end_where_they_are_too_narrow(tmp_path: Path) -> None:
    rows = section(0.0, lane(-1), _walk(-2))
    rows += section(30.0, lane(-1), lane(-2, kind="none", width='a="0" b="0" c="0" d="0"'), _walk(-3))
    rows += section(60.0, lane(-1), _walk(-2, 0.2))
    rows += section(80.0, lane(-1), _walk(-2))
    first, second = _read(tmp_path, road(sections=rows)).sidewalks
    assert first.points[[0, -1], 0] == pytest.approx([0.0, 60.0])
    assert second.points[[0, -1], 0] == pytest.approx([80.0, 100.0])


def test_a_sidewalk_that_jumps_is_two(tmp_path: Path) -> None:
    offset = '<laneOffset s="0" a="0" b="0" c="0" d="0"/><laneOffset s="50" a="1e9" b="0" c="0" d="0"/>'
    walks = _read(tmp_path, road(sections=section(0.0, _walk(2)), offset=offset), road(2)).sidewalks
    assert [np.ptp(walk.points[:, 0]) for walk in walks] == pytest.approx([50.0, 50.0], abs=0.5)


def test_sidewalks_rise_with_their_road(tmp_path: Path) -> None:
    profile = '<elevation s="0" a="1" b="0.05" c="0" d="0"/>'
    (walk,) = _read(tmp_path, road(sections=section(0.0, lane(-1), _walk(-2)), profile=profile)).sidewalks
    assert walk.points[[0, -1], 2] == pytest.approx([1.0, 6.0])


def test_real_sidewalks_lie_beside_the_lanes() -> None:
    town = read_opendrive(shared_map("Town02"))
    assert len(town.sidewalks) > 50
    for walk in town.sidewalks:
        middle = walk.points[len(walk.points) // 2, :2]
        away = min(np.hypot(*(lane.points[:, :2] - middle).T).min() for lane in town.lanes)
        assert 0.5 * (walk.width + 3.0) < away < 25.0
