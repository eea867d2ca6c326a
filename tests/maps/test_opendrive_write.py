"""Towns written as OpenDRIVE and read back: the same lanes, links, signals, streets, sidewalks and crosswalks."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from lxml import etree

from dorothie_gym.maps import LinkType, Signal, SignalKind, Town, load_town, town_names, write_opendrive
from dorothie_gym.maps.opendrive import import_opendrive
from dorothie_gym.maps.opendrive.plan_view import Axis
from tests.maps.equal_towns import differences
from tests.maps.opendrive_text import shared_map
from tests.maps.yaml_text import MIDTOWN


def read_back(town: Town, folder: Path) -> Town:
    """Writes and reads a town; nothing may be dropped, repaired or assumed."""
    path = folder / f"{town.name}.xodr"
    write_opendrive(town, path)
    found, notes = import_opendrive(path)
    assert [note for note in notes.sorted() if "sidewalk" not in note.message] == []
    return found


def all_features(folder: Path) -> Town:
    """Returns a small town with turn lanes, a one-way street, a roundabout, lights with phases, and a hill."""
    path = folder / "features.yaml"
    path.write_text(MIDTOWN.replace("hill: [200, -150]", "hill: [200, -150, 6]"), encoding="utf-8")
    return load_town(path)


def with_parts(town: Town, **parts: object) -> Town:
    """Returns a town with other parts."""
    names = (
        "name",
        "lanes",
        "links",
        "junctions",
        "streets",
        "sites",
        "signals",
        "crosswalks",
        "sidewalks",
        "programmes",
    )
    return Town(**{name: parts.get(name, getattr(town, name)) for name in names})  # type: ignore[arg-type]


def test_town_is_read_back_as_written(tmp_path: Path) -> None:
    town = load_town("brookside")
    assert differences(town, read_back(town, tmp_path)) == []


@pytest.mark.long
@pytest.mark.parametrize(
    "name", ["brookside", *(pytest.param(n, marks=pytest.mark.slow) for n in town_names() if n != "brookside")]
)
def test_every_shipped_town_is_read_back_as_written(name: str, tmp_path: Path) -> None:
    town = load_town(name)
    again = read_back(town, tmp_path)
    assert differences(town, again) == []
    assert differences(again, read_back(again, tmp_path)) == []


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize("name", ["Town01", "Town02", "Town05"])
def test_imported_maps_are_read_back_as_written(name: str, tmp_path: Path) -> None:
    town = load_town(shared_map(name))
    assert differences(town, read_back(town, tmp_path)) == []


def test_turn_lanes_slopes_and_rings_are_read_back_as_written(tmp_path: Path) -> None:
    town = all_features(tmp_path)
    assert max(lane.points[:, 2].max() for lane in town.lanes) > 5.0
    assert differences(town, read_back(town, tmp_path)) == []


def test_lanes_side_by_side_are_lanes_of_one_road(tmp_path: Path) -> None:
    town = all_features(tmp_path)
    path = tmp_path / "town.xodr"
    write_opendrive(town, path)
    root = etree.parse(path).getroot()
    outside = [road for road in root.iterfind("road") if road.get("junction") == "-1"]
    plain = [lane for lane in town.lanes if not lane.in_junction]
    assert len(outside) < len(plain) / 2
    # where a turn lane opens, a lane section of the same road begins
    assert any(len(road.findall("lanes/laneSection")) > 1 for road in outside)
    changes = {e.get("laneChange") for e in root.iterfind("road/lanes/laneSection/*/lane/roadMark")}
    assert {"both", "none"} <= changes


def test_one_way_lane_changes_and_values_of_signs_are_kept(tmp_path: Path) -> None:
    town = all_features(tmp_path)
    first = next(link for link in town.links if link.type is LinkType.LANE_CHANGE_RIGHT)
    lane = town.lanes[first.source]
    x, y = lane.position(0.5 * lane.length, 4.0)
    limit = Signal(
        id=900,
        kind=SignalKind.SPEED,
        position=(float(x), float(y), 2.0),
        heading=lane.heading_at(0.5 * lane.length) + np.pi,
        lanes=(lane.id,),
        value=30.0 / 3.6,
    )
    changed = with_parts(
        town, links=[link for link in town.links if link != first], signals=[*town.signals, limit], sidewalks=()
    )
    again = read_back(changed, tmp_path)
    assert [d for d in differences(changed, again) if not d.startswith("signal 900 faces")] == []


def test_signal_beyond_its_junction_stays_there_and_rules_its_lanes(tmp_path: Path) -> None:
    town = load_town("brookside")
    light = next(signal for signal in town.signals if signal.kind is SignalKind.TRAFFIC_LIGHT)
    lane = town.lanes[light.lanes[0]]
    connector = town.lanes[town.successors(lane.id)[0].target]
    x, y = connector.position(connector.length, 5.0)
    moved = dataclasses.replace(light, position=(float(x), float(y), 5.0))
    signals = [moved if signal is light else signal for signal in town.signals]
    changed = with_parts(town, signals=signals)
    assert differences(changed, read_back(changed, tmp_path)) == []


def test_file_is_the_same_for_the_same_town(tmp_path: Path) -> None:
    town = load_town("brookside")
    for name in ("one.xodr", "other.xodr"):
        write_opendrive(town, tmp_path / name)
    assert (tmp_path / "one.xodr").read_bytes() == (tmp_path / "other.xodr").read_bytes()


def test_turns_keep_their_types_whatever_their_angles(tmp_path: Path) -> None:
    town = all_features(tmp_path)
    turn = next(
        link
        for link in town.links
        if link.type is LinkType.STRAIGHT
        and town.lanes[link.target].in_junction
        and not town.lanes[link.source].in_junction
    )
    links = [dataclasses.replace(link, type=LinkType.LEFT) if link == turn else link for link in town.links]
    changed = with_parts(town, links=links)
    assert differences(changed, read_back(changed, tmp_path)) == []


@pytest.mark.parametrize(("aside", "share"), [(0.0, 1.0), (3.0, 0.4), (4.5, 0.1), (6.0, -0.2)])
def test_lane_inside_of_a_bend_is_shorter_than_its_axis(aside: float, share: float) -> None:
    turned = np.linspace(0.0, 0.5 * np.pi, 40)
    axis = Axis(5.0 * np.column_stack((np.cos(turned), np.sin(turned))))  # turns left
    found = axis.shortening(np.array([0.0, axis.length]), np.array([aside, aside]))
    assert found == pytest.approx(share, abs=0.1)


def test_sidewalk_that_goes_round_several_times_is_written_and_read(tmp_path: Path) -> None:
    town = load_town("brookside")
    angle = np.linspace(0.0, 15.7 * 2.0 * np.pi, 900)
    lengths = 4.24 + 0.02 * np.sin(0.93 * angle)
    coil = np.column_stack((2000.0 + lengths * np.cos(angle), 2000.0 + lengths * np.sin(angle), 0.0 * angle))
    odd = dataclasses.replace(town.sidewalks[0], points=coil)
    write_opendrive(with_parts(town, sidewalks=(odd, *town.sidewalks[1:])), tmp_path / "town.xodr")
    read = load_town(tmp_path / "town.xodr")
    assert any(np.allclose(walk.points[[0, -1], :2], coil[[0, -1], :2], atol=0.05) for walk in read.sidewalks)
