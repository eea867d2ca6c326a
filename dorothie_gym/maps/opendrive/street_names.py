"""Streets of an OpenDRIVE file by the names of its roads; others are inferred."""

from __future__ import annotations

import html
import re
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from dorothie_gym.maps.model import NO_STREET, Lane, LaneLink, Street
from dorothie_gym.maps.street_inference import FEWEST_STREETS, common_streets, name_streets

if TYPE_CHECKING:
    from dorothie_gym.maps.opendrive.records import OpenDriveRecords

# Words with which exporters number roads ("Road 12").
_PLACEHOLDERS = frozenset(
    ("road", "lane", "street", "connection", "connector", "junction", "unnamed", "default", "new")
)

# A word, and a number that is one ("5th").
_WORD = re.compile(r"[^\W\d_]{2,}|\d+[^\W\d_]{1,3}")

# Longest name that is kept.
_LONGEST = 60


def street_name(text: str, *, own: bool) -> str:
    """Returns the name of a street that a road has; empty if it is that of the road alone ("Road 12", "A1B1", "-37#2").

    A name has a word: a part between spaces that has letters only, or is an ordinal number. SUMO writes the marks of
    XML in names twice ("l&apos;Eglise").

    Args:
        text: attribute `name` of the road.
        own: whether all names of the file are those of streets.
    """
    name = " ".join(html.unescape(text).split())[:_LONGEST]
    if own:
        return name
    words = [part.strip(".,'()") for part in re.split(r"[\s-]+", name)]
    words = [word for word in words if _WORD.fullmatch(word)]
    numbered = any(char.isdigit() for char in name)
    return name if any(word.lower() not in _PLACEHOLDERS for word in words) or (words and not numbered) else ""


def find_streets(
    records: OpenDriveRecords, lanes: Sequence[Lane], links: Sequence[LaneLink]
) -> tuple[tuple[Lane, ...], tuple[Street, ...]]:
    """Returns the lanes with their streets, and the streets.

    Roads outside junctions with one name are one street, in the order of the file. Lanes of roads without a name belong
    to streets that are inferred from them alone. A connector belongs to the street of all lanes at both of its ends; in
    our files to that of its name.

    Args:
        records: the file.
        lanes: its lanes; `street` is ignored.
        links: links between them.
    """
    names = [_name(records, lane) for lane in lanes]
    if not any(names):
        return name_streets(lanes, links)
    roads = dict.fromkeys(lane.road_id for lane in lanes if not lane.in_junction)
    index: dict[str, int] = {}
    for road in records.roads.values():
        if road.id in roads and road.street:
            index.setdefault(road.street, len(index))
    street_of = {lane.id: index[name] for lane, name in zip(lanes, names, strict=True) if name}
    titles = [*index]
    for members in _inferred(lanes, links, names, FEWEST_STREETS - len(titles)):
        number = len(titles)
        street_of |= dict.fromkeys(members, number)
        titles.append(_title(titles))
    numbers = common_streets(lanes, links, street_of)
    if records.own:
        named = [index.get(records.roads[lane.road_id].street, NO_STREET) for lane in lanes]
        numbers = [name if lane.in_junction else k for lane, k, name in zip(lanes, numbers, named, strict=True)]
    found = tuple(replace(lane, street=number) for lane, number in zip(lanes, numbers, strict=True))
    of: defaultdict[int, list[int]] = defaultdict(list)
    for lane in found:
        of[lane.street].append(lane.id)
    return found, tuple(Street(id=k, name=title, lanes=tuple(of[k])) for k, title in enumerate(titles))


def _name(records: OpenDriveRecords, lane: Lane) -> str:
    return "" if lane.in_junction else records.roads[lane.road_id].street


def _title(titles: Sequence[str]) -> str:
    """Returns the placeholder name of the next inferred street."""
    number = 1
    while Street.placeholder(number) in titles:
        number += 1
    return Street.placeholder(number)


def _inferred(lanes: Sequence[Lane], links: Sequence[LaneLink], names: Sequence[str], fewest: int) -> list[list[int]]:
    """Returns the lanes of each street inferred from the roads without a name; below `fewest`, streets are divided."""
    rest = [lane for lane, name in zip(lanes, names, strict=True) if lane.in_junction or not name]
    if all(lane.in_junction for lane in rest):
        return []
    place = {lane.id: k for k, lane in enumerate(rest)}
    part = [replace(lane, id=k) for k, lane in enumerate(rest)]
    within = [
        LaneLink(place[link.source], place[link.target], link.type)
        for link in links
        if link.source in place and link.target in place
    ]
    _, streets = name_streets(part, within, fewest)
    return [[rest[k].id for k in street.lanes if not rest[k].in_junction] for street in streets]
