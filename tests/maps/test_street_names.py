"""Names of roads in OpenDRIVE files as names of streets."""

from __future__ import annotations

from pathlib import Path

import pytest

from dorothie_gym.maps import Town, load_town, write_opendrive
from dorothie_gym.maps.opendrive import read_opendrive
from dorothie_gym.maps.opendrive.street_names import street_name


@pytest.mark.parametrize(
    "name",
    [
        "Mill Lane",
        "5th Avenue",
        "Rue du 8 Mai 1945",
        "1st Street",
        "Straße des 17. Juni",
        "Ленина улица",
        "High Street",
    ],
)
def test_names_are_kept(name: str) -> None:
    assert street_name(name, own=False) == name


@pytest.mark.parametrize("name", ["", "Road 12", "road_3", "A1B1", "-37#2", "7", "Street 4", "Lane 1", "  "])
def test_numbers_of_roads_are_no_names(name: str) -> None:
    assert street_name(name, own=False) == ""


def test_marks_of_xml_that_are_written_twice_are_read() -> None:
    assert street_name("Rue de l&apos;Église", own=False) == "Rue de l'Église"


def renamed(folder: Path, names: dict[str, str]) -> Town:
    """Returns brookside as another program would write it, with other names of streets."""
    path = folder / "renamed.xodr"
    write_opendrive(load_town("brookside"), path)
    text = path.read_text(encoding="utf-8").replace('vendor="dorothie_gym"', 'vendor="somebody"')
    for old, new in names.items():
        text = text.replace(f'name="{old}"', f'name="{new}"')
    path.write_text(text, encoding="utf-8")
    return read_opendrive(path)


def test_roads_with_one_name_are_one_street(tmp_path: Path) -> None:
    town, original = renamed(tmp_path, {}), load_town("brookside")
    assert [street.name for street in town.streets] == [street.name for street in original.streets]
    assert sum(len(s.lanes) for s in town.streets) == sum(len(s.lanes) for s in original.streets)


def test_streets_without_a_name_are_inferred_beside_those_with_one(tmp_path: Path) -> None:
    names = [street.name for street in load_town("brookside").streets]
    town = renamed(tmp_path, dict.fromkeys(names[1:], ""))
    titles = [street.name for street in town.streets]
    assert titles[0] == names[0]
    assert len(titles) > 1 and all(title.startswith("Street ") for title in titles[1:])
    assert all(lane.street >= 0 for lane in town.lanes if not lane.in_junction)


def test_numbered_roads_are_joined_as_before(tmp_path: Path) -> None:
    names = [street.name for street in load_town("brookside").streets]
    town = renamed(tmp_path, {name: f"Road {k}" for k, name in enumerate(names)})
    assert {street.name for street in town.streets} == {f"Street {k + 1}" for k in range(len(town.streets))}
