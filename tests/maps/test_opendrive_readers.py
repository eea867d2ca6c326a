"""Our OpenDRIVE files in other readers: `carla.Map` and netconvert; skipped where they are not installed."""

from __future__ import annotations

import math
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from dorothie_gym.maps import SignalKind, Town, load_town, write_opendrive

pytestmark = pytest.mark.long

TOWNS = ("brookside", "midtown")


def netconvert() -> str:
    """Returns the program of SUMO, from the package `eclipse-sumo` or installed."""
    try:
        import sumo
    except ImportError:
        found = shutil.which("netconvert")
    else:
        found = str(Path(sumo.SUMO_HOME) / "bin" / "netconvert")
    if found is None or not Path(found).is_file():
        pytest.skip("netconvert is not installed (extra sumo)")
    return found


def places(town: Town) -> Iterator[tuple[int, float, float, float]]:
    """Yields the lanes outside junctions with the points of their centre lines."""
    for lane in town.lanes:
        if not lane.in_junction:
            for x, y, z in lane.points:
                yield lane.id, float(x), float(y), float(z)


@pytest.mark.parametrize("name", TOWNS)
def test_carla_has_the_same_lanes_signals_and_crosswalks(name: str, tmp_path: Path) -> None:
    carla: Any = pytest.importorskip("carla")
    town = load_town(name)
    write_opendrive(town, tmp_path / "town.xodr")
    found = carla.Map(name, (tmp_path / "town.xodr").read_text(encoding="utf-8"))
    for lane, x, y, z in places(town):
        near = found.get_waypoint(carla.Location(x=x, y=y, z=z)).transform
        heading = math.radians(near.rotation.yaw)
        dx, dy = near.location.x - x, near.location.y - y
        assert abs(dy * math.cos(heading) - dx * math.sin(heading)) < 0.01, lane
        assert abs(near.location.z - z) < 0.03, lane
    for kind, number in ((SignalKind.TRAFFIC_LIGHT, "1000001"), (SignalKind.STOP, "206"), (SignalKind.YIELD, "205")):
        count = len({mark.id for mark in found.get_all_landmarks_of_type(number)})
        assert count == sum(signal.kind is kind for signal in town.signals)
    assert len(found.get_crosswalks()) == 4 * len(town.crosswalks)  # their corners
    connectors = sum(lane.in_junction for lane in town.lanes)
    assert len(found.get_topology()) >= connectors


@pytest.mark.parametrize("name", TOWNS)
def test_netconvert_has_the_same_lanes_and_lights(name: str, tmp_path: Path) -> None:
    program = netconvert()
    town = load_town(name)
    write_opendrive(town, tmp_path / "town.xodr")
    line = [program, "--opendrive-files", str(tmp_path / "town.xodr"), "-o", str(tmp_path / "town.net.xml")]
    subprocess.run(line, check=True, capture_output=True, timeout=60)
    net = ElementTree.parse(tmp_path / "town.net.xml").getroot()
    lit = {logic.get("id") for logic in net.iterfind("tlLogic")}
    assert len(lit) >= len(town.programmes)
    limits = {round(float(e.get("speed", "0")), 1) for edge in net.iterfind("edge") for e in edge.iterfind("lane")}
    assert {round(lane.speed_limit, 1) for lane in town.lanes} <= limits
