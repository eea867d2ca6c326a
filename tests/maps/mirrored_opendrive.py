"""Mirror image of an OpenDRIVE file: the same map with left-hand traffic."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from lxml import etree

if TYPE_CHECKING:
    from dorothie_gym.maps.opendrive.elements import Element

NEGATED = {
    "geometry": ("y", "hdg"),
    "arc": ("curvature",),
    "spiral": ("curvStart", "curvEnd"),
    "poly3": ("a", "b", "c", "d"),
    "paramPoly3": ("aV", "bV", "cV", "dV"),
    "laneOffset": ("a", "b", "c", "d"),
    "superelevation": ("a", "b", "c", "d"),
    "laneLink": ("from", "to"),
    "signal": ("t", "hOffset"),
    "signalReference": ("t",),
    "validity": ("fromLane", "toLane"),
    "object": ("t", "hdg"),
    "cornerLocal": ("v",),
    "cornerRoad": ("t",),
}
"""Attributes with a side, by element."""

SWAPPED = {"left": "right", "right": "left", "increase": "decrease", "decrease": "increase"}


def mirror(source: Path, target: Path) -> None:
    """Writes the mirror image of a file, whose roads have the rule LHT."""
    tree = etree.parse(source)
    for element in tree.getroot().iter("*"):
        for name in NEGATED.get(element.tag, ()):
            _negate(element, name)
        if element.tag == "road":
            element.set("rule", "LHT")
        elif element.tag == "laneSection":
            for side in element.iterchildren("left", "right"):
                side.tag = SWAPPED[side.tag]
        elif element.tag == "lane":
            for numbered in (element, *element.iterfind("link/*")):
                _negate(numbered, "id")
        elif element.tag == "roadMark" and element.get("laneChange") in SWAPPED:
            element.set("laneChange", SWAPPED[element.get("laneChange")])
    tree.write(target)


def _negate(element: Element, name: str) -> None:
    text = element.get(name)
    if text is not None and text != "0":
        element.set(name, text[1:] if text.startswith("-") else f"-{text}")
