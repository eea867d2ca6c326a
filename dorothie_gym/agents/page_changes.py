"""Pages that show only what has changed since the last one, and the whole page again from the changes.

A page has lines `Title: words`, and lists: a line `Title:` with lines `- item` below. A page of changes has the lines
and lists that differ. Of the conversation it has the new lines, and of the places those whose words differ. Distances
of places, and distances and directions of what is in sight, change all the time: alone, they are shown with the whole
page only. Where the exits of the next junction differ in their distance only, one line has it. A line `No longer:`
names what has gone.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Final

_GONE: Final = "No longer"
_GROWING: Final = "Conversation"
_PLACES: Final = "Places"
_TIME: Final = "Time"
_EXITS: Final = "Exits of the next junction"
_IN_SIGHT: Final = "In sight"
_EVENTS: Final = "Just now"
_NO_EVENTS: Final = ["Just now:", "- Nothing new."]
_NUMBER: Final = re.compile(r"\d+")
_DISTANCE: Final = re.compile(r"in -?\d+ m$")
_AS_BEFORE: Final = " the same, "

Sections = dict[str, list[str]]
"""Lines of a page by title; the first line has the title."""


def page_changes(before: str, page: str) -> str:
    """Returns the changes of a page.

    Args:
        before: the page that was shown last, as a whole.
        page: the present page.
    """
    old, new = _sections(before), _sections(page)
    lines: list[str] = []
    for title, section in new.items():
        lines += section if title not in old or title == _TIME else _changed(title, old[title], section)
    gone = [title for title in old if title not in new]
    if gone:
        lines.append(f"{_GONE}: {'; '.join(gone)}")
    return "\n".join(lines)


def _changed(title: str, old: Sequence[str], new: Sequence[str]) -> list[str]:
    """Returns the lines of a section that both pages have, if it has changed."""
    if title.startswith(_GROWING):
        items = [line for line in new[1:] if line not in old]
    elif title.startswith(_PLACES):
        known = {_NUMBER.sub("", line) for line in old}
        items = [line for line in new[1:] if _NUMBER.sub("", line) not in known]
    elif title == _IN_SIGHT:
        items = list(new[1:]) if _kinds(new) != _kinds(old) else []
    elif title == _EVENTS:
        items = list(new[1:]) if list(new) != _NO_EVENTS else []
    elif title == _EXITS and len(new) > 1 and _without_distance(new) == _without_distance(old):
        return [f"{title}:{_AS_BEFORE}{_distance(new[1])}"] if list(new) != list(old) else []
    else:
        return list(new) if list(new) != list(old) else []
    return [new[0], *items] if items else []


def _kinds(section: Sequence[str]) -> list[str]:
    return sorted(_name(line) for line in section)


def _distance(exit_line: str) -> str:
    return exit_line.rpartition(", ")[2]


def _without_distance(section: Sequence[str]) -> tuple[list[str], int]:
    """Returns the lines of exits without their distance, and the number of distances, which is 1 for one junction."""
    return [_DISTANCE.sub("", line) for line in section], len({_distance(line) for line in section[1:]})


def merged_page(before: str, changes: str) -> str:
    """Returns the whole page after changes; distances of places and things in sight are those that were shown last.

    Args:
        before: the whole page before.
        changes: page of the next turn. One without a time, as after a fault, changes nothing.
    """
    sections, new = _sections(before), _sections(changes)
    if _TIME not in new:
        return before
    gone = new.pop(_GONE, [])
    new.setdefault(_EVENTS, _NO_EVENTS)
    for title in gone[0].partition(": ")[2].split("; ") if gone else ():
        sections.pop(title, None)
    for title, section in new.items():
        sections[title] = _with_items(sections, title, section)
    return "\n".join(line for section in sections.values() for line in section)


def _with_items(sections: Mapping[str, Sequence[str]], title: str, section: Sequence[str]) -> list[str]:
    """Returns a section with the items that were not repeated."""
    old = sections.get(title, section[:1])
    if title.startswith(_GROWING):
        return [section[0], *(line for line in old[1:] if line not in section), *section[1:]]
    if title.startswith(_PLACES):
        names = {_name(line): line for line in [*old[1:], *section[1:]]}
        return [section[0], *names.values()]
    if title == _EXITS and _AS_BEFORE in section[0]:
        distance = section[0].partition(_AS_BEFORE)[2]
        return [f"{title}:", *(_DISTANCE.sub(distance, line) for line in old[1:])]
    return list(section)


def _name(line: str) -> str:
    return line.partition(", ")[0]


def _sections(page: str) -> Sections:
    sections: Sections = {}
    title = ""
    for line in page.split("\n"):
        if not line.startswith("- "):
            title = line.partition(":")[0]
        sections.setdefault(title, []).append(line)
    return sections
