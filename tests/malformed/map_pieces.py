"""OpenDRIVE maps whose mutations are read: written towns, small ones of other tests, and pieces of maps at hand."""

from __future__ import annotations

from collections import defaultdict, deque
from pathlib import Path
from random import Random

from lxml import etree

Element = etree._Element


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


def maps_at_hand() -> list[Path]:
    """Returns the maps beside the repository, in the order of their names; none where there are none."""
    folder = Path(__file__).parents[2] / "../shared/maps"
    return sorted(folder.glob("*.xodr"))
