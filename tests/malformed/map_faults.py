"""Faults that exporters and hands make in OpenDRIVE files: order, namespaces, circular links, empty parts, encoding."""

from __future__ import annotations

import copy
import gzip
from collections.abc import Callable
from random import Random
from typing import Final, TypeAlias

from lxml import etree

Element: TypeAlias = etree._Element

NAMESPACE: Final = "http://code.asam.net/simulation/standard/opendrive_schema"
"""Namespace of OpenDRIVE 1.7 and later."""


def _some(elements: list[Element], random: Random) -> list[Element]:
    """Returns one of the elements, some of them, or all."""
    share = random.choice((0.0, 0.1, 0.5, 1.0))
    found = [element for element in elements if random.random() < share]
    return found or ([random.choice(elements)] if elements else [])


def _any(root: Element, path: str, random: Random) -> list[Element]:
    return _some(root.findall(path), random)


def reorder(root: Element, random: Random) -> None:
    """Reverses or shuffles the children of the root, of roads, or of all elements."""
    depth = random.choice(("root", "roads", "all"))
    parents = {"root": [root], "roads": root.findall("road"), "all": list(root.iter("*"))}[depth]
    for parent in parents:
        children = list(parent)
        if random.random() < 0.5:
            children.reverse()
        else:
            random.shuffle(children)
        parent[:] = children


def qualify(root: Element, random: Random) -> None:
    """Gives all elements a namespace, or some of them another one."""
    elements = list(root.iter("*")) if random.random() < 0.5 else _some(list(root.iterdescendants("*")), random)
    name = random.choice((NAMESPACE, "urn:x", "http://www.w3.org/2001/XInclude"))
    for element in elements:
        if not str(element.tag).startswith("{"):
            element.tag = f"{{{name}}}{element.tag}"


def write_units(root: Element, random: Random) -> None:
    """Writes units behind numbers, decimal commas, or another unit of speeds."""
    for speed in _any(root, ".//speed", random):
        speed.set("unit", random.choice(("km/h", "mph", "kmh", "KM/H", "m/s ", "knots", "")))
        speed.set(
            "max", random.choice((speed.get("max", ""), "-1", "0", "no limit", "undefined", "walk", "300", "1e9"))
        )
    name = random.choice(("s", "length", "a", "x", "hdg", "sOffset", "width"))
    style = random.choice(("{} m", "{}m", "+{}", " {} ", "{}f", "{}e0", "{}_0"))
    for element in _some(root.findall(f".//*[@{name}]"), random):
        text = element.get(name, "")
        element.set(name, text.replace(".", ",") if random.random() < 0.3 else style.format(text))


def same_ids(root: Element, random: Random) -> None:
    """Gives roads, junctions, lanes, signals or controllers one id."""
    elements = root.findall(random.choice(("road", "junction", ".//lane", ".//signal", ".//controller", ".//object")))
    if elements:
        number = random.choice(elements).get("id", "1")
        for element in _some(elements, random):
            element.set("id", number)


def drop_geometry(root: Element, random: Random) -> None:
    """Empties plan views, profiles, lanes, sections or records of shapes."""
    part = random.choice(("planView", "planView/geometry", "lanes", "lanes/laneSection", "elevationProfile",
                          ".//laneSection/right", ".//laneSection/center", ".//lane/link", "link"))  # fmt: skip
    for element in _any(root, f"road/{part}", random):
        element[:] = []


def link_in_circles(root: Element, random: Random) -> None:
    """Links roads, lanes or connections with themselves, with their predecessors, or in a circle."""
    roads = root.findall("road")
    kind = random.randrange(4)
    if kind == 0:
        for road in _some(roads, random):
            for end in road.findall("link/*"):
                end.set("elementType", "road")
                end.set("elementId", road.get("id", ""))
    elif kind == 1:
        for link in _any(root, ".//lane/link", random):
            own = link.getparent().get("id", "")
            link[:] = [etree.Element(tag, {"id": own}) for tag in ("predecessor", "successor")]
    elif kind == 2 and roads:
        chosen = random.sample(roads, min(len(roads), random.choice((2, 3, 5))))
        for road, after in zip(chosen, [*chosen[1:], chosen[0]], strict=True):
            for old in road.findall("link"):
                road.remove(old)
            link = etree.Element("link")
            contact = random.choice(("start", "end"))
            etree.SubElement(
                link, "successor", {"elementType": "road", "elementId": after.get("id", ""), "contactPoint": contact}
            )
            road.insert(0, link)
    else:
        for connection in _any(root, "junction/connection", random):
            connection.set("connectingRoad", connection.get("incomingRoad", ""))


def shrink(root: Element, random: Random) -> None:
    """Gives roads, elements of plan views, sections or profiles no length, or all one start."""
    kind = random.randrange(5)
    if kind == 0:
        for road in _any(root, "road", random):
            road.set("length", random.choice(("0", "1e-6", "0.01", "0.5", "-3")))
    elif kind == 1:
        for geometry in _any(root, "road/planView/geometry", random):
            geometry.set("length", random.choice(("0", "1e-9", "-1", "0.001")))
    elif kind == 2:
        for road in _some(root.findall("road"), random):
            start = random.choice(("0", road.get("length", "0"), "1e6", "-5"))
            for section in road.findall("lanes/laneSection"):
                section.set("s", start)
    elif kind == 3:
        for section in _any(root, ".//laneSection", random):
            again = copy.deepcopy(section)
            section.addnext(again)
    else:
        for width in _any(root, ".//lane/width", random):
            for name in "abcd":
                width.set(name, "0")


def make_widths_negative(root: Element, random: Random) -> None:
    """Makes widths or borders of lanes negative, wild, or out of order; mirrors or moves the lanes of a side."""
    for width in _any(root, ".//lane/width", random):
        name = random.choice(("a", "a", "b", "c", "d", "sOffset"))
        width.set(name, random.choice(("-3.5", "-0.01", "-100", "40", "1e5", "0.3", "-0.2", "1e-12")))
        if random.random() < 0.2:
            width.tag = "border"
    if random.random() < 0.3:
        for lane in _any(root, ".//lane", random):
            number = lane.get("id", "0")
            lane.set("id", number.removeprefix("-") if number.startswith("-") else f"-{number}")


def include(root: Element, random: Random) -> None:
    """Inserts elements that refer to other files."""
    target = random.choice(("/etc/passwd", "town.xodr", "../town.xodr", "http://127.0.0.1:9/x.xodr", "", "/dev/zero"))
    tag = random.choice(("include", "{http://www.w3.org/2001/XInclude}include"))
    for parent in (root, *_any(root, "road", random)):
        parent.insert(0, etree.Element(tag, {"file": target, "href": target}))


def change_header(root: Element, random: Random) -> None:
    """Empties, drops, repeats or spoils the header and its geoReference."""
    header = root.find("header")
    if header is None or random.random() < 0.1:
        header = etree.Element("header")
        root.insert(random.randrange(len(root) + 1), header)
    kind = random.randrange(4)
    if kind == 0:
        header.attrib.clear()
        header[:] = []
    elif kind == 1:
        root.remove(header)
    elif kind == 2:
        for name in ("revMajor", "revMinor", "north", "version", "vendor", "name"):
            header.set(name, random.choice(("", "x", "-1", "99", "1e999", "dorothie_gym", "nan", "SUMO")))
    else:
        for _ in range(random.choice((1, 2, 50))):
            reference = etree.SubElement(header, "geoReference")
            reference.text = random.choice(
                ("", "+proj=tmerc +lat_0=nan", "+proj=utm +zone=99", "EPSG:4326", "PROJCS[", "x" * 20_000, "\n\n", "½")
            )
        header.append(etree.Element("offset", {"x": "1e300", "y": "nan", "z": "", "hdg": "9"}))


def empty_junctions(root: Element, random: Random) -> None:
    """Leaves junctions without connections, or gives them other types; puts plain roads into them."""
    for junction in _any(root, "junction", random):
        if random.random() < 0.5:
            junction[:] = []
        junction.set("type", random.choice(("default", "virtual", "direct", "crossing", "", "x")))
        if random.random() < 0.3:
            junction.set("mainRoad", junction.get("id", ""))
    if random.random() < 0.3:
        for road in _any(root, "road", random):
            road.set("junction", random.choice(("-1", "", "0", "77777", road.get("id", ""))))


def move_signals(root: Element, random: Random) -> None:
    """Puts signals and objects beyond their roads, and breaks what refers to them."""
    for element in (*_any(root, ".//signal", random), *_any(root, ".//object", random)):
        element.set("s", random.choice(("-1", "1e5", "-1e12", "1e12", "nan", element.get("s", "0"))))
        element.set("t", random.choice(("1e4", "-1e9", "0", element.get("t", "0"))))
    for element in _any(root, ".//signalReference", random):
        element.set("id", random.choice(("", "-1", "none", "1e3")))
    for element in _any(root, ".//validity", random):
        element.set("fromLane", random.choice(("-99", "99", "0", "x")))
    for element in _any(root, ".//control", random):
        element.set("signalId", random.choice(("", "-1", "none")))


FAULTS: Final[tuple[Callable[[Element, Random], None], ...]] = (
    reorder, qualify, write_units, same_ids, drop_geometry, link_in_circles, shrink, make_widths_negative, include,
    change_header, empty_junctions, move_signals,
)  # fmt: skip
"""Faults of elements; each changes a tree in place."""


def encode(content: bytes, random: Random) -> bytes:
    """Returns the bytes of a file in another encoding: with a BOM, CRLF, UTF-16, compressed, with text around it."""
    kind = random.randrange(10)
    if kind < 3:
        return (
            b"\xef\xbb\xbf" + content,
            content.replace(b"\n", b"\r\n").replace(b"><", b">\r\n<"),
            b"\r\n " + content,
        )[kind]
    if kind == 3:
        return gzip.compress(content, mtime=0)
    if kind == 4:
        return content + random.choice((b"\x00" * 40, b"<OpenDRIVE/>", b"\n\n", b"garbage", content))
    body = content[content.find(b"?>") + 2 :] if content.startswith(b"<?xml") else content
    text = body.decode("utf-8", "replace")
    if kind == 5:
        return ('<?xml version="1.0" encoding="UTF-16"?>' + text).encode(random.choice(("utf-16", "utf-16-le")))
    if kind == 6:
        return b'<?xml version="1.0" encoding="ISO-8859-1"?>' + text.encode("latin-1", "replace")
    if kind == 7:
        return f'<?xml version="1.0" encoding="{random.choice(("x", "UTF-7", "UTF-32", "ASCII"))}"?>'.encode() + body
    if kind == 8:
        entity = random.choice((b"file:///etc/passwd", b"town.xodr", b"file:///dev/zero"))
        return (
            b'<?xml version="1.0"?><!DOCTYPE OpenDRIVE [<!ENTITY x SYSTEM "'
            + entity
            + b'">]>'
            + body.replace(b"<header", b"&x;<header", 1)
        )
    return b'<?xml version="1.1" standalone="no"?><?xml-stylesheet href="a"?><!-- <road/> -->' + body
