"""Facts of an OpenStreetMap file that netconvert does not read: the side of the road, and names in Latin letters."""

from __future__ import annotations

import gzip
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Final

from lxml import etree

_DRAWN: Final = re.compile(r"[\u0000-\u07ff\u10a0-\u10ff\u1e00-\u206f]*")
"""Letters that the font of the pictures has: Latin, Greek, Cyrillic, Hebrew, Arabic, Georgian."""

_OTHER_NAMES: Final = ("name:en", "int_name", "name:latin", "alt_name:en", "name:fr", "name:de", "name:es")
"""Tags with names in Latin letters, the preferred ones first."""


@dataclass(frozen=True, kw_only=True)
class StreetMapFacts:
    """Facts of a street map.

    Attributes:
        left_hand: whether the roundabouts, and what ways say of the side (`driving_side`), show left-hand traffic.
        latin_names: name in Latin letters of each name of a street that the pictures cannot draw.
    """

    left_hand: bool
    latin_names: dict[str, str]


def read_facts(path: Path) -> StreetMapFacts:
    """Reads the facts of a street map, XML that may be compressed; a file that breaks off has those until there."""
    names: dict[str, str] = {}
    rings: list[list[str]] = []
    left = right = 0
    for way in _elements(path, "way"):
        tags = {tag.get("k", ""): tag.get("v", "") for tag in way.iterfind("tag")}
        if "highway" not in tags:
            continue
        left += tags.get("driving_side") == "left"
        right += tags.get("driving_side") == "right"
        nodes = [node.get("ref", "") for node in way.iterfind("nd")]
        if tags.get("junction") == "roundabout" and len(nodes) > 3 and nodes[0] == nodes[-1]:
            rings.append(nodes if tags.get("oneway") != "-1" else nodes[::-1])
        name = tags.get("name", "")
        other = next((tags[key] for key in _OTHER_NAMES if tags.get(key) and _DRAWN.fullmatch(tags[key])), "")
        if other and not _DRAWN.fullmatch(name):
            names[name] = other
    places = _places(path, {node for ring in rings for node in ring}) if rings else {}
    for ring in rings:
        area = _area([places[node] for node in ring if node in places])
        left, right = left + (area < 0.0), right + (area > 0.0)
    return StreetMapFacts(left_hand=left > right, latin_names=names)


def _places(path: Path, wanted: set[str]) -> dict[str, tuple[float, float]]:
    """Returns longitude and latitude of some nodes [degrees]."""
    found = {}
    for node in _elements(path, "node"):
        if node.get("id") in wanted:
            try:
                found[node.get("id", "")] = float(node.get("lon", "")), float(node.get("lat", ""))
            except ValueError:
                continue
    return found


def _area(points: list[tuple[float, float]]) -> float:
    """Returns twice the area of a ring of points, positive if it runs counter-clockwise."""
    pairs = zip(points, [*points[1:], *points[:1]], strict=True)
    return sum(x * v - u * y for (x, y), (u, v) in pairs)


def _elements(path: Path, tag: str) -> Iterator[etree._Element]:
    """Yields the elements of a name; memory does not grow with the file."""
    with _opened(path) as file:
        try:
            for _, element in etree.iterparse(file, tag=tag, resolve_entities=False, no_network=True):
                yield element
                element.clear()
                while element.getprevious() is not None:
                    del element.getparent()[0]
        except (etree.XMLSyntaxError, EOFError, OSError):
            return  # netconvert reports what is wrong with the file


@contextmanager
def _opened(path: Path) -> Iterator[IO[bytes] | gzip.GzipFile]:
    with path.open("rb") as file:
        if file.read(2) != b"\x1f\x8b":
            file.seek(0)
            yield file
            return
        file.seek(0)
        with gzip.open(file) as content:
            yield content


def rename_roads(content: bytes, names: dict[str, str]) -> bytes:
    """Returns an OpenDRIVE file in which roads of some names have others."""
    if not names:
        return content
    root = etree.fromstring(content)
    for road in root.iterfind("road"):
        name = road.get("name", "")
        road.set("name", names.get(name, name))
    return etree.tostring(root, xml_declaration=True, encoding="UTF-8")
