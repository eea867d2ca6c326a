"""Pages that show only what has changed since the last one, and the whole page again from the changes.

A page has lines `Title: words`, and lists: a line `Title:` with lines `- item` below. A page of changes has the lines
and lists that differ. Of the conversation it has the new lines, and of the places those whose words differ. Distances
of places and of the goal, and distances and directions of what is in sight, change all the time: alone, they are shown
with the whole page only. Where the exits of the next junction differ in their distance only, one line has it. Choices
that end as before, and the car whose settings are as before, are shown up to there. What was said just now is not
repeated in the conversation. A line `No longer:` names what has gone.
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
_GOAL: Final = "Goal"
_CAR: Final = "Car"
_SETTINGS: Final = ", cruise speed "
_DRIVE: Final = "You can drive"
_FROM: Final = "; as before from "
_LEAST_TAIL: Final = 2
_SAID: Final = re.compile(r'- The (\w+) said: "(.*)"')
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
        if title in old and title != _TIME:
            section = _changed(title, old[title], section)
        lines += _without_said(section, new) if title.startswith(_GROWING) else section
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
    elif title == _GOAL:
        return list(new) if _NUMBER.sub("", new[0]) != _NUMBER.sub("", old[0]) else []
    elif title == _DRIVE:
        return [_without_tail(old[0], new[0])] if new != old else []
    elif title == _CAR:
        return [_without_settings(old[0], new[0])] if new != old else []
    else:
        return list(new) if list(new) != list(old) else []
    return [new[0], *items] if items else []


def _without_said(section: Sequence[str], page: Sections) -> Sequence[str]:
    """Returns the conversation without what the last speaker has said just now."""
    said = _said_now(page)
    if not said or not section or section[-1] != said[-1]:
        return section
    return section[:-1] if len(section) > 2 else []


def _said_now(page: Sections) -> list[str]:
    """Returns the lines of the conversation that belong to what was said just now."""
    time = page[_TIME][0].partition(": ")[2] if _TIME in page else ""
    found = (_SAID.match(line) for line in page.get(_EVENTS, ()))
    return [f"- {time} {match[1]}: {match[2]}" for match in found if match is not None]


def _without_tail(before: str, line: str) -> str:
    """Returns a line of choices without those at its end that are as before."""
    old, new = before.split(", "), line.split(", ")
    same = 0
    while same < min(len(old), len(new)) - 1 and old[-1 - same] == new[-1 - same]:
        same += 1
    return line if same < _LEAST_TAIL else f"{', '.join(new[:-same])}{_FROM}{new[-same]}"


def _with_tail(before: str, line: str) -> str:
    shown, _, first = line.partition(_FROM)
    old = before.split(", ")
    return ", ".join([shown, *old[old.index(first) :]]) if first in old else line


def _without_settings(before: str, line: str) -> str:
    """Returns the line of the car without its settings if they are as before."""
    shown, _, settings = line.partition(_SETTINGS)
    return shown if settings == before.partition(_SETTINGS)[2] else line


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
    _repeat_said(sections, new)
    for title in gone[0].partition(": ")[2].split("; ") if gone else ():
        sections.pop(title, None)
    for title, section in new.items():
        sections[title] = _with_items(sections, title, section)
    return "\n".join(line for section in sections.values() for line in section)


def _repeat_said(sections: Sections, new: Sections) -> None:
    """Adds what was said just now to the conversation."""
    title = next((title for title in sections if title.startswith(_GROWING)), "")
    said = _said_now(new)[-1:]
    shown = {line.split(" ", 2)[-1] for line in new.get(title, ())}
    if title and said and said[0].split(" ", 2)[-1] not in shown:
        new[title] = [*new.get(title, sections[title][:1]), *said]


def _with_items(sections: Mapping[str, Sequence[str]], title: str, section: Sequence[str]) -> list[str]:
    """Returns a section with the items that were not repeated."""
    old = sections.get(title, section[:1])
    if title.startswith(_GROWING):
        return [section[0], *(line for line in old[1:] if line not in section), *section[1:]]
    if title.startswith(_PLACES):
        names = {_name(line): line for line in [*old[1:], *section[1:]]}
        return [section[0], *names.values()]
    if title == _DRIVE:
        return [_with_tail(old[0], section[0])]
    if title == _CAR and _SETTINGS not in section[0]:
        return [section[0] + "".join(old[0].partition(_SETTINGS)[1:])]
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
