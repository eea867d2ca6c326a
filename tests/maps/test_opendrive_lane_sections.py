from pathlib import Path

import pytest

from dorothie_gym.maps import NoteAction, NoteKind, Town
from dorothie_gym.maps.import_notes import ImportNote
from dorothie_gym.maps.opendrive import import_opendrive

from .opendrive_text import lane, linked, opendrive, road, section


def _read(tmp_path: Path, *roads: str) -> tuple[Town, tuple[ImportNote, ...]]:
    path = tmp_path / "town.xodr"
    path.write_text(opendrive(*roads))
    town, notes = import_opendrive(path)
    return town, notes.sorted()


def _spans(town: Town) -> dict[int, tuple[float, float]]:
    """Where each lane begins and ends along x, by its number."""
    return {of.lane_id: (round(of.points[0, 0], 3), round(of.points[-1, 0], 3)) for of in town.lanes}


def _ways(town: Town) -> set[tuple[int, int]]:
    return {
        (town.lanes[link.source].lane_id, town.lanes[link.target].lane_id)
        for link in town.links
        if not link.type.is_lane_change
    }


def _changes(town: Town) -> set[tuple[int, int, str]]:
    return {
        (town.lanes[link.source].lane_id, town.lanes[link.target].lane_id, str(link.type).split("_")[0])
        for link in town.links
        if link.type.is_lane_change
    }


# --- Access ----------------------------------------------------------------------------------------------------------


def _bus(access: str) -> str:
    return section(0.0, lane(-1), lane(-2).replace("</lane>", access + "</lane>"))


@pytest.mark.parametrize(
    ("access", "driven"),
    [
        ('<access sOffset="0" rule="allow" restriction="bus"/>', False),
        ('<access sOffset="0" rule="deny" restriction="passengerCar"/>', False),
        ('<access sOffset="0" restriction="passengerCar"/>', False),
        ('<access sOffset="0" rule="allow"><restriction type="bus"/><restriction type="taxi"/></access>', False),
        ('<access sOffset="0" rule="deny"><restriction type="passengerCar"/></access>', False),
        ('<access sOffset="0" rule="allow"><restriction type="bus"/><restriction type="passengerCar"/></access>', True),
        ('<access sOffset="0" rule="allow" restriction="autonomousTraffic"/>', True),
        ('<access sOffset="0" rule="deny" restriction="truck"/>', True),
        ('<access sOffset="0" restriction="pedestrian"/>', True),
        ('<access sOffset="0" rule="allow" restriction="none"/>', True),
        ("", True),
    ],
)
def test_a_lane_without_access_for_cars_is_not_driven_on(tmp_path: Path, access: str, driven: bool) -> None:
    town, notes = _read(tmp_path, road(7, sections=_bus(access)))
    assert [of.lane_id for of in town.lanes] == ([-2, -1] if driven else [-1])
    assert bool(_changes(town)) == driven
    assert [(note.kind, note.element.split(" (")[0]) for note in notes] == (
        [] if driven else [(NoteKind.ACCESS, "road 7 / laneSection / lane -2")]
    )


def test_a_lane_is_open_where_its_restriction_does_not_hold(tmp_path: Path) -> None:
    access = (
        '<access sOffset="30" rule="allow" restriction="bus"/><access sOffset="70" rule="allow" restriction="none"/>'
    )
    town, _ = _read(tmp_path, road(sections=_bus(access)))
    spans = sorted((of.lane_id, round(of.points[0, 0]), round(of.points[-1, 0])) for of in town.lanes)
    assert spans == [(-2, 0, 30), (-2, 70, 100), (-1, 0, 100)]
    assert _ways(town) == set()


def test_widths_go_on_in_a_section_that_is_divided(tmp_path: Path) -> None:
    widening = lane(-1, width='a="3" b="0.01" c="0" d="0"')
    bus = lane(-2).replace("</lane>", '<access sOffset="50" rule="allow" restriction="bus"/></lane>')
    town, _ = _read(tmp_path, road(sections=section(0.0, widening, bus)))
    (inner,) = (of for of in town.lanes if of.lane_id == -1)
    assert [inner.width_at(s) for s in (0.0, 40.0, 60.0, 100.0)] == pytest.approx([3.0, 3.4, 3.6, 4.0], abs=1e-3)


# --- Directions ------------------------------------------------------------------------------------------------------


def _against(number: int, how: str) -> str:
    if how == "attribute":
        return lane(number).replace(' level="false"', ' level="false" direction="reversed"')
    travel = "backward" if number < 0 else "forward"
    return lane(number, more=f'<userData><vectorLane travelDir="{travel}"/></userData>')


@pytest.mark.parametrize("how", ["attribute", "travelDir"])
def test_a_reversed_lane_is_driven_the_other_way(tmp_path: Path, how: str) -> None:
    town, notes = _read(tmp_path, road(sections=section(0.0, _against(-1, how), lane(-2))))
    assert _spans(town) == {-1: (100.0, 0.0), -2: (0.0, 100.0)}
    assert town.links == () and notes == ()


@pytest.mark.parametrize("how", ["attribute", "travelDir"])
def test_a_reversed_lane_is_beside_the_lanes_across_the_middle(tmp_path: Path, how: str) -> None:
    town, _ = _read(tmp_path, road(sections=section(0.0, lane(1), _against(-1, how), lane(-2))))
    assert _changes(town) == {(1, -1, "left"), (-1, 1, "right")}


def test_reversed_lanes_are_linked_in_driving_direction(tmp_path: Path) -> None:
    parts = [
        section(0.0, _against(-1, "attribute").replace("<width", linked(after=-1) + "<width")),
        section(40.0, _against(-1, "attribute"), lane(-2)),
    ]
    town, notes = _read(tmp_path, road(sections="".join(parts)))
    assert _spans(town) == {-1: (100.0, 0.0), -2: (40.0, 100.0)}
    assert notes == ()


@pytest.mark.parametrize("number", [-1, 1])
def test_the_usual_direction_may_be_written(tmp_path: Path, number: int) -> None:
    usual = lane(
        number, more=f'<userData><vectorLane travelDir="{"forward" if number < 0 else "backward"}"/></userData>'
    )
    town, notes = _read(tmp_path, road(sections=section(0.0, usual)))
    assert _spans(town) == {number: (0.0, 100.0) if number < 0 else (100.0, 0.0)}
    assert notes == ()


def test_a_lane_for_both_directions_is_driven_in_one_and_noted(tmp_path: Path) -> None:
    both = lane(-1).replace(' level="false"', ' level="false" direction="both"')
    town, notes = _read(tmp_path, road(5, sections=section(0.0, both)))
    assert _spans(town) == {-1: (0.0, 100.0)}
    (note,) = notes
    assert (note.action, note.kind) == (NoteAction.ASSUMED, NoteKind.DIRECTION)
    assert note.element.startswith("road 5 / laneSection / lane -1")


# --- Sections of one side, several links, heights --------------------------------------------------------------------


def test_a_section_of_one_side_leaves_the_other_side_as_it_is(tmp_path: Path) -> None:
    first = section(0.0, lane(1, width='a="3" b="0.01" c="0" d="0"'), lane(-1, more=linked(after=-1)))
    single = section(50.0, lane(-1, more=linked(before=-1)), lane(-2)).replace("s=", 'singleSide="true" s=')
    town, notes = _read(tmp_path, road(sections=first + single))
    assert _spans(town) == {1: (100.0, 0.0), -1: (0.0, 100.0), -2: (50.0, 100.0)}
    (left,) = (of for of in town.lanes if of.lane_id == 1)
    assert [left.width_at(s) for s in (0.0, 50.0, 100.0)] == pytest.approx([4.0, 3.5, 3.0], abs=1e-3)
    assert notes == ()


def test_sections_of_one_side_may_follow_each_other(tmp_path: Path) -> None:
    right = section(30.0, lane(-1, more=linked(before=-1, after=-1))).replace("s=", 'singleSide="true" s=')
    left = section(60.0, lane(1, more=linked(before=1)), lane(2)).replace("s=", 'singleSide="true" s=')
    first = section(0.0, lane(1, more=linked(after=1)), lane(-1, more=linked(after=-1)))
    town, notes = _read(tmp_path, road(sections=first + right + left))
    assert _spans(town) == {1: (100.0, 0.0), -1: (0.0, 100.0), 2: (100.0, 60.0)}
    assert notes == ()


def test_a_lane_may_lead_into_several(tmp_path: Path) -> None:
    link = '<link><successor id="-1"/><successor id="-2"/></link>'
    split = section(0.0, lane(-1, more=link)) + section(50.0, lane(-1, more=linked(before=-1)), lane(-2))
    town, _ = _read(tmp_path, road(sections=split))
    assert sorted(of.lane_id for of in town.lanes) == [-2, -1, -1]
    assert _ways(town) == {(-1, -1), (-1, -2)}


def test_several_lanes_may_lead_into_one(tmp_path: Path) -> None:
    link = '<link><predecessor id="-1"/><predecessor id="-2"/></link>'
    merge = section(0.0, lane(-1), lane(-2)) + section(50.0, lane(-1, more=link))
    town, _ = _read(tmp_path, road(sections=merge))
    assert _ways(town) == {(-1, -1), (-2, -1)}


@pytest.mark.parametrize(("level", "heights"), [("true", [-0.4, -0.4]), ("false", [-0.6, -1.0])])
def test_level_lanes_stay_level_on_a_tilted_road(tmp_path: Path, level: str, heights: list[float]) -> None:
    tilt = '<lateralProfile><superelevation s="0" a="0.1" b="0" c="0" d="0"/></lateralProfile>'
    rows = section(0.0, lane(-1), *(lane(k).replace('level="false"', f'level="{level}"') for k in (-2, -3)))
    town, _ = _read(tmp_path, road(sections=rows, more=tilt))
    by_number = {of.lane_id: of for of in town.lanes}
    assert by_number[-1].points[0, 2] == pytest.approx(-0.2, abs=1e-3)
    assert [by_number[k].points[0, 2] for k in (-2, -3)] == pytest.approx(heights, abs=1e-2)


def test_profiles_of_micrometres_may_have_coefficients_of_trillions(tmp_path: Path) -> None:
    width = 'a="3.5" b="0" c="-6e12" d="4e18"/><width sOffset="1e-6" a="3.5" b="0" c="0" d="0"'
    town, notes = _read(tmp_path, road(sections=section(0.0, lane(-1, width=width))))
    assert town.lanes[0].widths == pytest.approx(3.5)
    assert notes == ()


@pytest.mark.parametrize("c", ["6e12", "1e300", "-1e308"])
def test_a_lane_whose_profile_explodes_is_dropped(tmp_path: Path, c: str) -> None:
    rows = section(0.0, lane(-1), lane(-2, width=f'a="3.5" b="0" c="{c}" d="0"'))
    town, notes = _read(tmp_path, road(9, sections=rows))
    assert [of.lane_id for of in town.lanes] == [-1]
    (note,) = notes
    assert (note.kind, note.element) == (NoteKind.LANE, "road 9 / laneSection 0 / lane -2")


def test_links_of_a_dropped_lane_are_left_out_and_the_others_renumbered(tmp_path: Path) -> None:
    first = section(0.0, lane(1), lane(-1, width='a="4" b="0" c="1e300" d="0"', more=linked(after=-1)))
    after = section(50.0, lane(-1, more=linked(before=-1)), lane(-2))
    town, _ = _read(tmp_path, road(sections=first + after))
    assert [of.id for of in town.lanes] == list(range(len(town.lanes)))
    assert all(link.source < len(town.lanes) and link.target < len(town.lanes) for link in town.links)
    assert 1 in [of.lane_id for of in town.lanes]
