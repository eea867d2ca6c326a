"""OpenDRIVE maps whose mutations are read: written towns, small ones of other tests, and pieces of maps at hand."""

from __future__ import annotations

import shutil
from collections import defaultdict, deque
from pathlib import Path
from random import Random
from typing import TYPE_CHECKING

from lxml import etree

from tests.maps.yaml_text import MIDTOWN

if TYPE_CHECKING:
    from dorothie_gym.maps import Town

Element = etree._Element

WHOLE = 60_000
"""Largest file that is mutated as a whole [bytes]."""


def piece(content: bytes, roads: int, random: Random) -> bytes:
    """Returns a part of a map: roads that are linked with each other, and the junctions with their connections."""
    root = etree.fromstring(content)
    by_id = {road.get("id", ""): road for road in root.iterfind("road")}
    kept = _linked(root, by_id, roads, random)
    for number, road in by_id.items():
        if number not in kept:
            root.remove(road)
    for junction in root.findall("junction"):
        for connection in junction.findall("connection"):
            if not {connection.get("incomingRoad"), connection.get("connectingRoad")} <= kept:
                junction.remove(connection)
        if junction.find("connection") is None:
            root.remove(junction)
    return etree.tostring(root)


def _linked(root: Element, by_id: dict[str, Element], count: int, random: Random) -> set[str]:
    """Returns the ids of roads around one of them."""
    near: defaultdict[str, set[str]] = defaultdict(set)
    for number, road in by_id.items():
        for side in road.iterfind("link/*"):
            other = side.get("elementId", "")
            if side.get("elementType") == "road" and other in by_id:
                near[number].add(other)
                near[other].add(number)
    for connection in root.iterfind("junction/connection"):
        a, b = connection.get("incomingRoad", ""), connection.get("connectingRoad", "")
        if a in by_id and b in by_id:
            near[a].add(b)
            near[b].add(a)
    first = random.choice(sorted(by_id))
    found, waiting = {first}, deque([first])
    while waiting and len(found) < count:
        for other in sorted(near[waiting.popleft()] - found):
            if len(found) < count:
                found.add(other)
                waiting.append(other)
    return found


# --- Originals --------------------------------------------------------------------------------------------------------


def make_written(folder: Path) -> None:
    """Writes a town with lights, a roundabout, turn lanes, sidewalks and crosswalks."""
    _write(_town(folder), folder)


def make_left(folder: Path) -> None:
    """Writes the same town with left-hand traffic."""
    from dorothie_gym.maps import mirrored

    _write(mirrored(_town(folder)), folder)


def make_ends(folder: Path) -> None:
    """Writes a ring with lanes that taper away, and a one-way road that leaves the map."""
    from tests.maps.ending_lanes import stub

    stub(folder / "town.xodr")


def make_at_hand(folder: Path) -> None:
    """Copies the largest map beside the repository; where there is none, writes a shipped town."""
    from dorothie_gym.maps import load_town

    maps = sorted((Path(__file__).parents[2] / "../shared/maps").glob("*.xodr"))
    if maps:
        shutil.copy(max(maps, key=lambda path: path.stat().st_size), folder / "town.xodr")
    else:
        _write(load_town("midtown"), folder)


def _town(folder: Path) -> Town:
    from dorothie_gym.maps import load_town
    from tests.maps.yaml_text import written

    file = written(folder, MIDTOWN)
    try:
        return load_town(file)
    finally:
        file.unlink()


def _write(town: Town, folder: Path) -> None:
    from dorothie_gym.maps import write_opendrive

    write_opendrive(town, folder / "town.xodr")
