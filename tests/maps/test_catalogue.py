import os
from pathlib import Path

import pytest

from dorothie_gym.errors import TownError
from dorothie_gym.maps.catalogue import load_town, town_names
from dorothie_gym.maps.opendrive import read_opendrive
from dorothie_gym.sim.network.network import TownNetwork

from .opendrive_text import geometry, opendrive, road

LOOP = """\
junctions: {a: [0, 0], b: [100, 0]}
streets: {North: [a, [0, -80], [100, -80], b], Middle: [a, b], South: [a, [0, 80], [100, 80], b]}
"""


def test_brookside_is_shipped() -> None:
    assert "brookside" in town_names()


@pytest.mark.parametrize("name", town_names())
def test_every_shipped_town_loads_under_its_name(name: str) -> None:
    assert load_town(name).name == name


def test_a_town_is_read_once() -> None:
    assert load_town("brookside") is load_town("brookside")


@pytest.mark.parametrize("suffix", [".yaml", ".yml", ".YAML"])
def test_a_file_is_read_by_its_ending(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"loop{suffix}"
    path.write_text(LOOP)
    assert load_town(path).name == "loop"
    assert load_town(str(path)) is load_town(path)


def test_a_file_that_changed_is_read_again(tmp_path: Path) -> None:
    path = tmp_path / "loop.yaml"
    path.write_text(LOOP)
    before = load_town(path)
    path.write_text(LOOP.replace("Middle", "Centre"))
    os.utime(path, ns=(1, 1))
    assert [street.name for street in before.streets][1] == "Middle"
    assert [street.name for street in load_town(path).streets][1] == "Centre"


def test_opendrive_files_are_read() -> None:
    path = Path(__file__).parents[2] / "../shared/maps/Town02.xodr"
    if not path.exists():
        pytest.skip("../shared/maps is not here")
    assert len(load_town(path).lanes) == 88


@pytest.mark.parametrize("name", ["brokside", "town.json", ""])
def test_an_unknown_town_is_reported_with_the_known_towns(name: str) -> None:
    with pytest.raises(TownError, match=r"no such town; .*known towns are .*brookside.*\.xodr or \.yaml"):
        load_town(name)


@pytest.mark.parametrize("name", ["missing.yaml", "missing.xodr"])
def test_a_missing_file_is_reported(tmp_path: Path, name: str) -> None:
    with pytest.raises(TownError, match=rf"{name}: file: cannot be read \(No such file or directory\)"):
        load_town(tmp_path / name)


@pytest.mark.parametrize("far", [3e4, 1e6, 1e12])
def test_a_map_with_roads_far_apart_is_refused(far: float, tmp_path: Path) -> None:
    path = tmp_path / "far.xodr"
    path.write_text(opendrive(road(1), road(2, plan=geometry("<line/>", 100.0, x=far))))
    with pytest.raises(TownError, match=r"far\.xodr: town: spans .* km; at most 20 km can be simulated"):
        load_town(path)
    with pytest.raises(TownError, match="spans"):
        TownNetwork(read_opendrive(path))


def test_a_map_of_ten_kilometres_is_read(tmp_path: Path) -> None:
    path = tmp_path / "far.xodr"
    path.write_text(opendrive(road(1), road(2, plan=geometry("<line/>", 100.0, x=1e4))))
    assert load_town(path).extent == pytest.approx(10_100.0)
