"""Lanes that are not for cars at a junction: paths that only they lead to, and their lights."""

from __future__ import annotations

from pathlib import Path

import pytest

from dorothie_gym.maps.import_notes import NoteAction, NoteKind
from dorothie_gym.maps.lint import check_town
from dorothie_gym.maps.opendrive import import_opendrive
from tests.maps.opendrive_text import geometry, lane, linked, opendrive, road, section

BUS = '<access sOffset="0" rule="allow" restriction="bus"/>'


def signal(number: int, lane_number: int) -> str:
    place = f'<signal s="99" t="-5" id="{number}" type="1000001" dynamic="yes" orientation="+">'
    return f'{place}<validity fromLane="{lane_number}" toLane="{lane_number}"/></signal>'


def town_with(folder: Path, closed: str, *, parts: int) -> Path:
    """Writes a road with a second lane, whose path across the junction has some lane sections."""
    before = road(
        1,
        sections=section(0.0, lane(-1), closed),
        link='<successor elementType="junction" elementId="9"/>',
        more=f"<signals>{signal(70, -1)}{signal(71, -2)}</signals>",
    )
    ends = '<predecessor elementType="road" elementId="1" contactPoint="end"/>'
    ends += '<successor elementType="road" elementId="2" contactPoint="start"/>'
    paths = ""
    for number, source, count in ((10, -1, 1), (11, -2, parts)):
        length = 20.0 / count
        rows = [section(k * length, lane(-1, more=linked(source if k == 0 else -1, -1))) for k in range(count)]
        plan = geometry("<line/>", 20.0, x=100.0, y=4.0 * (source + 1))
        paths += road(number, length=20.0, plan=plan, sections="".join(rows), junction=9, link=ends)
    after = road(
        2,
        plan=geometry("<line/>", 100.0, x=120.0),
        sections=section(0.0, lane(-1)),
        link='<predecessor elementType="junction" elementId="9"/>',
    )
    connections = "".join(
        f'<connection id="{k}" incomingRoad="1" connectingRoad="{number}" contactPoint="start">'
        f'<laneLink from="{source}" to="-1"/></connection>'
        for k, (number, source) in enumerate(((10, -1), (11, -2)))
    )
    path = folder / "town.xodr"
    path.write_text(opendrive(before, paths, after, f'<junction id="9">{connections}</junction>'))
    return path


@pytest.mark.parametrize("parts", [1, 3])
@pytest.mark.parametrize(
    "closed", [lane(-2, kind="restricted"), lane(-2).replace("</lane>", BUS + "</lane>")], ids=["type", "access"]
)
def test_paths_and_lights_of_bus_lanes_are_dropped(tmp_path: Path, closed: str, parts: int) -> None:
    town, notes = import_opendrive(town_with(tmp_path, closed, parts=parts))
    assert {lane.road_id for lane in town.lanes} == {1, 10, 2}
    assert [signal.id for signal in town.signals] == [70]
    dropped = [note.element for note in notes.sorted() if note.action is NoteAction.DROPPED]
    kinds = {note.kind for note in notes.sorted() if note.action is NoteAction.DROPPED}
    assert kinds == {NoteKind.ACCESS}
    assert sum("road 11" in element for element in dropped) == parts
    assert "road 1 / signal 71" in dropped
    assert not [fault for fault in check_town(town) if "signal" in fault.message or "light" in fault.message]


def test_paths_and_lights_of_lanes_for_cars_are_kept(tmp_path: Path) -> None:
    town, _ = import_opendrive(town_with(tmp_path, lane(-2), parts=1))
    assert {lane.road_id for lane in town.lanes} == {1, 10, 11, 2}
    assert [signal.id for signal in town.signals] == [70, 71]
