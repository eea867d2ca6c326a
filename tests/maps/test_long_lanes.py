import math
from pathlib import Path

import numpy as np
import pytest

from dorothie_gym.maps import (
    FaultKind,
    LinkType,
    NoteAction,
    NoteKind,
    SignalKind,
    Town,
    check_town,
    import_report,
    load_town,
)
from dorothie_gym.maps.import_notes import ImportNotes
from dorothie_gym.maps.long_lanes import LONGEST_LANE, cut_long_lanes
from dorothie_gym.maps.yaml import read_yaml_town

from .opendrive_text import geometry, lane, linked, opendrive, road, section
from .test_opendrive_lane_changes import check_neighbours

RADIUS = 900.0
HALF = math.pi * RADIUS


def _oval(lanes: int, light: str = "") -> str:
    """A ring of two half circles with lanes of about 2.8 km."""
    rows = [
        lane(sign * k, more=linked(before=sign * k, after=sign * k)) for sign in (1, -1) for k in range(1, lanes + 1)
    ]
    arc = f'<arc curvature="{1 / RADIUS}"/>'
    halves = []
    for number, other, y, heading in ((1, 2, 0.0, 0.0), (2, 1, 2 * RADIUS, math.pi)):
        link = (
            f'<predecessor elementType="road" elementId="{other}" contactPoint="end"/>'
            f'<successor elementType="road" elementId="{other}" contactPoint="start"/>'
        )
        plan = geometry(arc, HALF, y=y, hdg=heading)
        more = light if number == 1 else ""
        halves.append(road(number, length=HALF, plan=plan, link=link, sections=section(0.0, *rows), more=more))
    return opendrive(*halves)


def _load(tmp_path: Path, text: str) -> Town:
    path = tmp_path / "oval.xodr"
    path.write_text(text)
    return load_town(path)


@pytest.mark.parametrize("lanes", [1, 3])
def test_no_lane_is_longer_than_positions_on_it(tmp_path: Path, lanes: int) -> None:
    town = _load(tmp_path, _oval(lanes))
    assert max(lane_.length for lane_ in town.lanes) <= LONGEST_LANE
    assert [lane_.id for lane_ in town.lanes] == list(range(len(town.lanes)))
    assert town.kilometres == pytest.approx(4 * lanes * HALF / 1000.0, rel=1e-3)
    assert {fault.kind for fault in check_town(town)} == {FaultKind.UNREACHABLE}  # one direction from the other
    check_neighbours(town)


def test_parts_follow_each_other_without_gap_or_kink(tmp_path: Path) -> None:
    town = _load(tmp_path, _oval(2))
    onward = [link for link in town.links if not link.type.is_lane_change]
    assert len(onward) == len(town.lanes)
    for link in onward:
        source, target = town.lanes[link.source], town.lanes[link.target]
        assert link.type is LinkType.STRAIGHT
        assert source.points[-1] == pytest.approx(target.points[0], abs=1e-6)
        turn = (target.headings[0] - source.headings[-1] + math.pi) % (2 * math.pi) - math.pi
        assert abs(turn) < 5e-3


def test_parts_side_by_side_are_neighbours(tmp_path: Path) -> None:
    town = _load(tmp_path, _oval(3))
    for lane_ in town.lanes:
        beside = [town.neighbour(lane_.id, side) for side in (LinkType.LANE_CHANGE_LEFT, LinkType.LANE_CHANGE_RIGHT)]
        assert any(other is not None for other in beside)
        for other in beside:
            if other is not None:
                station, offset = town.lanes[other].project(lane_.position(0.5 * lane_.length))
                assert 3.0 < abs(offset) < 5.0
                assert 0.3 < station / town.lanes[other].length < 0.7
    assert len([link for link in town.links if link.type.is_lane_change]) == len(town.lanes) * 4 // 3


def test_sites_and_signals_stay_where_they_are(tmp_path: Path) -> None:
    signs = (
        f'<signals><signal id="1" s="{HALF - 5:.1f}" t="-6" orientation="+" dynamic="no" type="206" subtype="-1"/>'
        '<signal id="2" s="5" t="-6" orientation="+" dynamic="no" type="274" value="50" subtype="-1"/></signals>'
    )
    town = _load(tmp_path, _oval(1, signs))
    for site in town.sites:
        lane_ = town.lanes[site.lane]
        assert lane_.position(site.station) == pytest.approx(np.array(site.waypoint), abs=0.02)
        assert 0.0 <= site.station <= lane_.length
    stop, limit = town.signals
    assert (stop.kind, limit.kind) == (SignalKind.STOP, SignalKind.SPEED)
    assert len(stop.lanes) == 1 and len(limit.lanes) > 1
    assert town.lanes[stop.lanes[0]].points[-1, :2] == pytest.approx([0.0, -2 * RADIUS], abs=5.0)
    assert {lane_.id for lane_ in town.lanes} == {k for street in town.streets for k in street.lanes}


def test_long_lanes_are_noted(tmp_path: Path) -> None:
    path = tmp_path / "oval.xodr"
    path.write_text(_oval(1))
    notes = import_report(path)
    assert {(note.action, note.kind) for note in notes} == {(NoteAction.REPAIRED, NoteKind.LANE)}
    assert {note.element.split(" / ")[0] for note in notes} == {"road 1", "road 2"}
    assert "3 lanes" in notes[0].message


def test_a_town_without_long_lanes_stays_itself() -> None:
    town, notes = load_town("brookside"), ImportNotes("brookside")
    assert cut_long_lanes(town, notes) is town
    assert notes.sorted() == ()


def test_long_streets_of_town_files_are_divided(tmp_path: Path) -> None:
    path = tmp_path / "plain.yaml"
    path.write_text(
        "junctions: {a: [0, 0], b: [2600, 0], c: [2600, 300], d: [0, 300]}\n"
        "streets:\n"
        "  Long Road: {through: [a, b], lanes: 2}\n  Side: [b, c]\n  Back: [c, d]\n  End: [d, a]\n"
        "  Ring: [b, [2900, 150], c]\n"
    )
    town = read_yaml_town(path)
    assert max(lane_.length for lane_ in town.lanes) <= LONGEST_LANE
    assert check_town(town) == ()
    check_neighbours(town)
    (street,) = (street for street in town.streets if street.name == "Long Road")
    assert sum(town.lanes[k].length for k in street.lanes) > 4 * 2500.0
