"""Lanes inside bends that are tighter than their distance from the reference line, and lanes that turn back."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from dorothie_gym.errors import TownError
from dorothie_gym.maps import NoteAction, NoteKind, Town
from dorothie_gym.maps.import_notes import ImportNote
from dorothie_gym.maps.opendrive import import_opendrive
from dorothie_gym.maps.opendrive.lane_loops import turns_back, without_loops

from .opendrive_text import geometry, lane, linked, opendrive, road, section


def _bend(folder: Path, curvature: float, turn: float = 2.0) -> tuple[Town, tuple[ImportNote, ...]]:
    """A road of two lanes in each direction with straights before and after one bend."""
    length, side = turn / abs(curvature), math.copysign(1.0, curvature)
    x, y = 100.0 + math.sin(turn) / abs(curvature), side * (1.0 - math.cos(turn)) / abs(curvature)
    plan = (
        geometry("<line/>", 100.0)
        + geometry(f'<arc curvature="{curvature}"/>', length, s=100.0, x=100.0)
        + geometry("<line/>", 100.0, s=100.0 + length, x=x, y=y, hdg=side * turn)
    )
    path = folder / "bend.xodr"
    lanes = section(0.0, *(lane(number) for number in (2, 1, -1, -2)))
    path.write_text(opendrive(road(1, length=200.0 + length, plan=plan, sections=lanes)))
    town, notes = import_opendrive(path)
    return town, notes.sorted()


@pytest.mark.parametrize("curvature", [0.1, 0.2, 0.35, 0.5, -0.2, -0.5])
def test_lanes_inside_a_sharp_bend_lead_on_without_loops(tmp_path: Path, curvature: float) -> None:
    town, notes = _bend(tmp_path, curvature)
    assert len(town.lanes) == 4
    for of in town.lanes:
        assert np.abs(np.diff(np.unwrap(of.headings))).sum() < 2.0 + math.radians(60.0)
        assert of.length > 180.0
    inside = 1.0 / abs(curvature) < 6.0
    assert [note.action for note in notes] == [NoteAction.REPAIRED] * (len(notes) if inside else 0)
    assert bool(notes) == inside


def test_a_line_without_loops_is_the_same_object() -> None:
    angle = np.linspace(0.0, 6.0, 200)
    line = np.column_stack((5.0 * np.cos(angle), 5.0 * np.sin(angle), angle, np.full(200, 3.5)))
    assert without_loops(line) is line


@pytest.mark.parametrize("overlap", [0.001, 0.02])
def test_sections_that_overlap_by_millimetres_are_no_fold(overlap: float) -> None:
    x = np.concatenate((np.arange(0.0, 10.0, 0.25), np.arange(9.75 - overlap, 20.0, 0.25)))
    line = np.column_stack((x, np.zeros((len(x), 2)), np.full(len(x), 3.5)))
    assert without_loops(line) is line
    assert not turns_back(line)


def test_a_road_that_is_driven_back_on_itself_cannot_be_driven(tmp_path: Path) -> None:
    back = geometry("<line/>", 100.0) + geometry("<line/>", 60.0, s=100.0, x=100.0, hdg=math.pi)
    path = tmp_path / "back.xodr"
    path.write_text(opendrive(road(1, length=160.0, plan=back, sections=section(0.0, lane(-1)))))
    try:
        town, _ = import_opendrive(path)
    except TownError as error:
        assert "turns back" in str(error)
    else:
        assert not any(turns_back(of.points) for of in town.lanes)


@pytest.mark.parametrize(("x", "heading"), [(150.0, 0.0), (100.0, math.pi)])
def test_links_between_lanes_that_do_not_meet_are_dropped(tmp_path: Path, x: float, heading: float) -> None:
    onward = '<successor elementType="road" elementId="2" contactPoint="start"/>'
    sections = section(0.0, lane(-1, more=linked(after=-1)))
    after = geometry("<line/>", 100.0, x=x, hdg=heading)
    path = tmp_path / "apart.xodr"
    path.write_text(opendrive(road(1, sections=sections, link=onward), road(2, plan=after)))
    town, notes = import_opendrive(path)
    assert not town.links
    assert NoteKind.LANE_LINK in {note.kind for note in notes.sorted()}
