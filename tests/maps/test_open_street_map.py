"""Districts of OpenStreetMap as towns, through netconvert (skipped without it)."""

from __future__ import annotations

import heapq
from pathlib import Path

import pytest

from dorothie_gym.errors import TownError
from dorothie_gym.maps import LinkType, SignalKind, Town, convert_street_map, is_street_map, load_town
from tests.maps.osm_text import Drawing, district
from tests.maps.test_opendrive_readers import netconvert


def town_of(drawing: Drawing, folder: Path) -> Town:
    """Returns the town of a drawing."""
    netconvert()
    source, out = folder / "district.osm", folder / "district.xodr"
    source.write_text(drawing.text(), encoding="utf-8")
    convert_street_map(source, out)
    return load_town(out)


def lanes_of(town: Town, name: str) -> list[int]:
    number = next(street.id for street in town.streets if street.name == name)
    return [lane.id for lane in town.lanes if lane.street == number and not lane.in_junction]


@pytest.mark.parametrize(("name", "known"), [("a.osm", True), ("A.OSM.gz", True), ("a.xodr", False), ("osm", False)])
def test_street_maps_are_known_by_their_names(name: str, known: bool) -> None:
    assert is_street_map(name) == known


def test_names_lights_and_directions_are_kept(tmp_path: Path) -> None:
    town = town_of(district(), tmp_path)
    names = {street.name for street in town.streets}
    assert {"Rue de l'Église", "Bus Avenue", "North Street", "1st Street", "Mill Lane", "South Road"} <= names
    assert any(signal.kind is SignalKind.TRAFFIC_LIGHT and signal.lanes for signal in town.signals)
    assert len(town.programmes) == 2
    one_way = [town.lanes[k] for k in lanes_of(town, "Rue de l'Église")]
    assert one_way and all(lane.points[-1, 0] > lane.points[0, 0] for lane in one_way)  # to the east
    assert {round(lane.speed_limit * 3.6) for lane in one_way} == {30}
    both = {town.lanes[k].points[-1, 0] > town.lanes[k].points[0, 0] for k in lanes_of(town, "North Street")}
    assert both == {True, False}


def test_lanes_for_buses_are_kept_from_cars(tmp_path: Path) -> None:
    town = town_of(district(), tmp_path)
    lanes = lanes_of(town, "Bus Avenue")
    assert lanes
    # one lane for cars in each direction, although the street has two
    assert not [link for link in town.links if link.source in lanes and link.type.is_lane_change]
    assert max(len([k for k in lanes if town.lanes[k].road_id == town.lanes[j].road_id]) for j in lanes) <= 2


def test_roundabout_is_driven_one_way(tmp_path: Path) -> None:
    town = town_of(district(), tmp_path)
    entry = max(lanes_of(town, "Bus Avenue"), key=lambda k: town.lanes[k].points[-1, 0])
    # counter-clockwise from the west: first the exit to the south, then that to the north, then back
    queue, met = [(town.lanes[entry].length, entry)], list[str]()
    seen = {entry}
    while queue:
        far, lane = heapq.heappop(queue)
        for link in town.successors(lane):
            target = town.lanes[link.target]
            name = town.streets[target.street].name if target.street >= 0 else ""
            if target.length > 100.0:
                met += [name] if name not in met else []
            elif target.id not in seen:
                seen.add(target.id)
                heapq.heappush(queue, (far + target.length, target.id))
    assert met[0] == "South Road"
    assert met[1].startswith("Street ")
    assert met[2] == "Bus Avenue"


@pytest.mark.parametrize(
    ("text", "message"),
    [("", "netconvert"), ("<osm", "netconvert"), ('<osm version="0.6"></osm>', "No nodes")],
)
def test_what_is_no_street_map_is_refused(text: str, message: str, tmp_path: Path) -> None:
    netconvert()
    source = tmp_path / "broken.osm"
    source.write_text(text, encoding="utf-8")
    with pytest.raises(TownError, match=message):
        convert_street_map(source, tmp_path / "town.xodr")
    assert not (tmp_path / "town.xodr").exists()


def test_map_without_streets_for_cars_is_refused(tmp_path: Path) -> None:
    netconvert()
    drawing = Drawing()
    drawing.node("a", 0.0, 0.0)
    drawing.node("b", 100.0, 0.0)
    drawing.way("Path", ["a", "b"], {"highway": "footway"})
    (tmp_path / "paths.osm").write_text(drawing.text(), encoding="utf-8")
    with pytest.raises(TownError, match=r"paths\.osm"):
        convert_street_map(tmp_path / "paths.osm", tmp_path / "town.xodr")


def test_missing_file_and_missing_program_are_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(TownError, match="cannot be read"):
        convert_street_map(tmp_path / "nowhere.osm", tmp_path / "town.xodr")
    (tmp_path / "district.osm").write_text(district().text(), encoding="utf-8")
    monkeypatch.setenv("PATH", "")
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(TownError, match=r"pip install .*\[sumo\]"):
        convert_street_map(tmp_path / "district.osm", tmp_path / "town.xodr")


def test_lane_changes_of_wide_streets_are_kept(tmp_path: Path) -> None:
    drawing = Drawing()
    for k in range(4):
        drawing.node(str(k), 200.0 * (k % 2), 200.0 * (k // 2))
    drawing.way("Wide Street", ["0", "1"], {"highway": "primary", "oneway": "yes", "lanes": "3"})
    for name, nodes in (("East Road", ["1", "3"]), ("North Road", ["3", "2"]), ("West Road", ["2", "0"])):
        drawing.way(name, nodes, {"highway": "primary", "oneway": "yes", "lanes": "1"})
    town = town_of(drawing, tmp_path)
    wide = lanes_of(town, "Wide Street")
    changes = {link.type for link in town.links if link.source in wide and link.type.is_lane_change}
    assert changes == {LinkType.LANE_CHANGE_LEFT, LinkType.LANE_CHANGE_RIGHT}
