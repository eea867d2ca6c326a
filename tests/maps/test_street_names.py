"""Names of roads in OpenDRIVE files as names of streets."""

from __future__ import annotations

from pathlib import Path

import pytest

from dorothie_gym.maps import load_town, mirrored, write_opendrive
from dorothie_gym.maps.cache import pack, unpack
from dorothie_gym.maps.opendrive import read_opendrive
from dorothie_gym.maps.opendrive.street_names import street_name
from tests.maps.titled_towns import TITLES, renamed, titled


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
    assert town.street_titles == (names[0], *[""] * (len(titles) - 1))
    some = renamed(tmp_path, {names[-1]: ""})
    assert sum(street.is_inferred for street in some.streets) < len(town.streets) - 1


def test_only_names_of_other_programs_are_titles(tmp_path: Path) -> None:
    town = titled(tmp_path)
    assert town.street_titles == tuple(street.name for street in town.streets)
    assert set(TITLES) <= set(town.street_titles)
    assert mirrored(town).titled
    assert unpack(pack(town, "key"), "key").titled
    write_opendrive(load_town("brookside"), tmp_path / "own.xodr")
    for own in (load_town("brookside"), read_opendrive(tmp_path / "own.xodr")):
        assert not any(own.street_titles)


def test_numbered_roads_are_joined_as_before(tmp_path: Path) -> None:
    names = [street.name for street in load_town("brookside").streets]
    town = renamed(tmp_path, {name: f"Road {k}" for k, name in enumerate(names)})
    assert {street.name for street in town.streets} == {f"Street {k + 1}" for k in range(len(town.streets))}
