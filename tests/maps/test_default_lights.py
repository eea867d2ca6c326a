"""Imported maps without signals get traffic lights where main roads cross, if that is asked for."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from dorothie_gym.cli.app import app
from dorothie_gym.errors import TownError
from dorothie_gym.maps.catalogue import find_town, import_report, load_town
from dorothie_gym.maps.default_lights import FASTEST, Lights, split_lights, with_default_lights
from dorothie_gym.maps.generated.specification import split_names
from dorothie_gym.maps.import_notes import ImportNotes, NoteAction, NoteKind
from dorothie_gym.maps.mirroring import mirrored
from dorothie_gym.maps.model import Signal, SignalKind
from dorothie_gym.maps.opendrive.write import write_opendrive
from dorothie_gym.maps.right_of_way import FACING, right_of_way
from dorothie_gym.maps.town import Town

OPTION = ",lights=default"


def with_signals(town: Town, signals: tuple[Signal, ...]) -> Town:
    """Returns a town with other signals and no programmes."""
    parts = ("lanes", "links", "junctions", "streets", "sites", "crosswalks", "sidewalks", "traffic", "cruise")
    return Town(name=town.name, signals=signals, programmes=(), **{part: getattr(town, part) for part in parts})


@cache
def bare(name: str) -> Town:
    """Returns a shipped town without signals."""
    return with_signals(load_town(name), ())


@cache
def lit(name: str) -> Town:
    return with_default_lights(bare(name), ImportNotes(name))


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("maps") / "crossing.xodr"
    write_opendrive(bare("midtown"), path)
    return path


def entering(town: Town, junction: int) -> set[int]:
    links = [link for link in town.links if not link.type.is_lane_change]
    return {
        link.source
        for link in links
        if town.lanes[link.target].junction_id == junction and not town.lanes[link.source].in_junction
    }


@pytest.mark.parametrize("name", ["midtown", "northgate", "generated:5,traffic=left"])
def test_lights_stand_where_main_roads_cross_and_every_lane_has_one(name: str) -> None:
    town = lit(name)
    at = {programme.junction_id for programme in town.programmes}
    assert at
    assert len(at) < len(town.junctions)
    for junction in at:
        lanes = entering(town, junction)
        main = {}
        for lane in (town.lanes[k] for k in lanes):
            assert lane.speed_limit <= FASTEST
            assert right_of_way(town).control(lane.id) is SignalKind.TRAFFIC_LIGHT
            main.setdefault((lane.road_id, lane.lane_id < 0), []).append(lane)
        assert len(main) >= 3
        headings = [rows[0].headings[-1] for rows in main.values() if len(rows) >= 2]
        turned = [abs((a - b + np.pi) % (2.0 * np.pi) - np.pi) for a in headings for b in headings]
        assert any(FACING <= angle <= np.pi - FACING for angle in turned)


def test_each_light_is_green_once_and_stands_at_the_kerb_of_its_lanes() -> None:
    for town in (lit("midtown"), lit("generated:5,traffic=left")):
        for programme in town.programmes:
            greens = [signal for phase in programme.phases for signal in phase.green]
            assert sorted(greens) == sorted(programme.signals)
        for signal in town.signals:
            ends = np.array([town.lanes[k].points[-1, :2] for k in signal.lanes])
            away = np.hypot(*(ends - signal.position[:2]).T).min()
            assert away < 16.0
            lane = town.lanes[signal.lanes[0]]
            side = np.array([-np.sin(lane.headings[-1]), np.cos(lane.headings[-1])]) * town.traffic.sign
            assert side @ (np.array(signal.position[:2]) - lane.points[-1, :2]) > 1.0


def test_the_mirror_image_of_a_map_has_the_mirrored_lights() -> None:
    town, image = lit("midtown"), with_default_lights(mirrored(bare("midtown")), ImportNotes("image"))
    assert [signal.lanes for signal in town.signals] == [signal.lanes for signal in image.signals]
    assert town.programmes == image.programmes
    for signal, other in zip(town.signals, image.signals, strict=True):
        np.testing.assert_allclose((signal.position[0], -signal.position[1]), other.position[:2], atol=1e-9)


def test_signs_of_lit_approaches_are_left_out_and_others_stay() -> None:
    town = load_town("midtown")
    signs = tuple(signal for signal in town.signals if signal.kind is not SignalKind.TRAFFIC_LIGHT)
    mixed = with_default_lights(with_signals(town, signs), ImportNotes("midtown"))
    lanes = {k for signal in mixed.signals if signal.kind is SignalKind.TRAFFIC_LIGHT for k in signal.lanes}
    kept = [signal for signal in mixed.signals if signal.kind is not SignalKind.TRAFFIC_LIGHT]
    assert kept == [signal for signal in signs if not lanes.issuperset(signal.lanes)]
    assert len({signal.id for signal in mixed.signals}) == len(mixed.signals)


def test_maps_with_lights_and_maps_that_need_none_stay_as_they_are() -> None:
    for town in (load_town("midtown"), bare("brookside")):
        notes = ImportNotes(town.name)
        if any(signal.kind is SignalKind.TRAFFIC_LIGHT for signal in town.signals):
            assert with_default_lights(town, notes) is town
            (note,) = notes.sorted()
            assert "lights of its own" in note.message


def test_lights_are_an_option_of_the_file_and_off_by_default(file: Path) -> None:
    assert load_town(file).signals == () == load_town(f"{file},lights=map").signals
    town = load_town(f"{file}{OPTION}")
    assert town is load_town(file, lights="default")
    assert town.name == f"crossing{OPTION}"
    assert len(town.programmes) == len(lit("midtown").programmes)
    assert find_town(town.name, file.parent) is town
    assert find_town("crossing", file.parent) is load_town(file)
    assert find_town(town.name, None) is None
    assert split_names(f"midtown,{file}{OPTION},generated:4,size=small") == [
        "midtown",
        f"{file}{OPTION}",
        "generated:4,size=small",
    ]
    assert split_lights("a,b.xodr") == ("a,b.xodr", Lights.MAP)


def test_the_report_and_the_command_state_the_lights(file: Path) -> None:
    notes = [note for note in import_report(f"{file}{OPTION}") if note.kind is NoteKind.SIGNAL]
    assert {note.action for note in notes} == {NoteAction.ASSUMED}
    assert len(notes) == len(load_town(file, lights="default").programmes)
    assert not [note for note in import_report(file) if note.kind is NoteKind.SIGNAL]
    shown = CliRunner().invoke(app, ["towns", f"{file}{OPTION}", "--check"])
    assert "traffic lights by default" in shown.output
    printed = json.loads(CliRunner().invoke(app, ["towns", f"{file}{OPTION}", "--check", "--json"]).stdout)
    assert printed["town"] == f"crossing{OPTION}"
    assert len(printed["assumed"]["signal"]) == len(notes)


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        (f"midtown{OPTION}", "OpenDRIVE"),
        (f"generated:3{OPTION}", "OpenDRIVE"),
        (f"midtwon{OPTION}", r"give the file of a map \(\.xodr\)"),
        (f"mill.yaml{OPTION}", "name its junctions"),
        ("town.xodr,lights=some", "known are map, default"),
    ],
)
def test_other_towns_and_values_are_refused(name: str, reason: str) -> None:
    with pytest.raises(TownError, match=reason):
        load_town(name)
