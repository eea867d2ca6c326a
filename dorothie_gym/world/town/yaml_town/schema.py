"""The town language: what a YAML town may say, read into a checked plan.

A village::

    name: village                  # optional, else the file's name
    speed: 40                      # km/h, optional
    junctions:                     # metres, x east, y south
      green: [0, 0]
      pond: [150, 0]
    streets:                       # through junctions and plain points, which bend the street
      High Street: [green, pond]
      Mill Lane: {through: [green, [0, 90], [150, 90], pond], speed: 30, width: 3.25, radius: 30}
      Back Lane: [green, [0, -90], [150, -90], pond]
    lights: [green]
    crosswalks: [[pond, High Street]]
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from dorothie_gym.world.town.yaml_town.geometry import Point
from dorothie_gym.world.town.yaml_town.nodes import Entry, read_nodes

DEFAULT_SPEED = 40.0
"""Speed limit where none is given [km/h]."""
DEFAULT_WIDTH = 3.5
"""Lane width where none is given [m]."""
FAR = 20_000.0
"""Coordinates are not larger than this [m]."""


@dataclass(frozen=True, kw_only=True)
class JunctionPlan:
    """A junction as it is written: `id` is its place in the list, `centre` is in metres."""

    id: int
    name: str
    centre: Point
    entry: Entry


@dataclass(frozen=True, kw_only=True)
class StreetPlan:
    """A street as it is written.

    Attributes:
        id: its place in the list.
        name: as people call it.
        course: names of junctions, and points (x, y) [m] that bend it between them.
        speed: limit [km/h].
        width: of a lane [m].
        radius: of its bends [m], or None for the largest that fits.
        entry: where it is written.
    """

    id: int
    name: str
    course: tuple[str | Point, ...]
    speed: float
    width: float
    radius: float | None
    entry: Entry


@dataclass(frozen=True, kw_only=True)
class TownPlan:
    """A town as it is written; names are known to be right, the geometry is not checked yet.

    Attributes:
        name: of the town.
        junctions: by name.
        streets: in order.
        lights: names of the junctions with traffic lights.
        crosswalks: pairs of a junction's name and the street that is crossed there.
    """

    name: str
    junctions: Mapping[str, JunctionPlan]
    streets: tuple[StreetPlan, ...]
    lights: tuple[str, ...]
    crosswalks: tuple[tuple[str, StreetPlan], ...]


def read_plan(path: Path) -> TownPlan:
    """Reads a town file.

    Raises:
        TownError: with the file, the line, the element, and what to do.
    """
    top = read_nodes(path)
    allowed = ("name", "speed", "width", "junctions", "streets", "lights", "crosswalks")
    fields = {key: value.named(key) for key, value in top.fields(allowed, required=("junctions", "streets")).items()}
    junctions = _junctions(fields["junctions"])
    speed = _speed(fields["speed"]) if "speed" in fields else DEFAULT_SPEED
    width = _width(fields["width"]) if "width" in fields else DEFAULT_WIDTH
    streets = tuple(
        _street(k, key, value, junctions, speed=speed, width=width)
        for k, (key, value) in enumerate(fields["streets"].items("streets by name"))
    )
    if not streets:
        fields["streets"].fail("there is no street; add one")
    return TownPlan(
        name=fields["name"].text("a name") if "name" in fields else path.stem,
        junctions=junctions,
        streets=streets,
        lights=_lights(fields["lights"], junctions) if "lights" in fields else (),
        crosswalks=_crosswalks(fields["crosswalks"], junctions, streets) if "crosswalks" in fields else (),
    )


def _speed(entry: Entry) -> float:
    return entry.number(5.0, 130.0, "km/h")


def _width(entry: Entry) -> float:
    return entry.number(2.5, 6.0, "metres")


def _point(entry: Entry) -> Point:
    expected = "a point [x, y] in metres"
    numbers = entry.elements(expected)
    if len(numbers) != 2:
        entry.fail(f"this must be {expected}, not a list of {len(numbers)}")
    x, y = (number.number(-FAR, FAR, "metres") for number in numbers)
    return x, y


def _junctions(entry: Entry) -> dict[str, JunctionPlan]:
    junctions: dict[str, JunctionPlan] = {}
    for k, (key, value) in enumerate(entry.items("junctions by name, each [x, y]")):
        name = key.text("a name")
        here = key.named(f"junction {name!r}")
        centre = _point(value.named(here.element))
        for other in junctions.values():
            if other.centre == centre:
                here.fail(f"it is at the same place as {other.name!r} (line {other.entry.line}); move or remove one")
        junctions[name] = JunctionPlan(id=k, name=name, centre=centre, entry=here)
    if not junctions:
        entry.fail("there is no junction; add one")
    return junctions


def _street(
    k: int, key: Entry, value: Entry, junctions: Mapping[str, JunctionPlan], *, speed: float, width: float
) -> StreetPlan:
    name = key.text("a name")
    here = key.named(f"street {name!r}")
    value = value.named(here.element)
    fields = (
        value.fields(allowed=("through", "speed", "width", "radius"), required=("through",)) if value.is_mapping else {}
    )
    return StreetPlan(
        id=k,
        name=name,
        course=_course(fields.get("through", value).named(here.element), junctions),
        speed=_speed(fields["speed"]) if "speed" in fields else speed,
        width=_width(fields["width"]) if "width" in fields else width,
        radius=fields["radius"].number(1.0, FAR, "metres") if "radius" in fields else None,
        entry=here,
    )


def _course(entry: Entry, junctions: Mapping[str, JunctionPlan]) -> tuple[str | Point, ...]:
    course: list[str | Point] = []
    for element in entry.elements("a list of junctions and points that it runs through"):
        step = _point(element) if element.is_sequence else _junction(element, junctions)
        if course and course[-1] == step:
            element.fail(f"{step} comes twice in a row; remove one")
        course.append(step)
    if len(course) < 2:
        entry.fail("it runs nowhere; name at least the two junctions where it starts and ends")
    for end, where in ((course[0], "starts"), (course[-1], "ends")):
        if not isinstance(end, str):
            entry.fail(f"it {where} at {list(end)}, which is no junction: dead ends are not supported; name a junction")
    return tuple(course)


def _junction(entry: Entry, junctions: Mapping[str, JunctionPlan]) -> str:
    name = entry.text("the name of a junction or a point [x, y]")
    if name not in junctions:
        entry.fail(f"unknown junction {name!r}; known are {', '.join(junctions)}")
    return name


def _lights(entry: Entry, junctions: Mapping[str, JunctionPlan]) -> tuple[str, ...]:
    lights: list[str] = []
    for element in entry.elements("a list of junctions"):
        name = _junction(element, junctions)
        if name in lights:
            element.fail(f"{name!r} is there twice; remove one")
        lights.append(name)
    return tuple(lights)


def _crosswalks(
    entry: Entry, junctions: Mapping[str, JunctionPlan], streets: tuple[StreetPlan, ...]
) -> tuple[tuple[str, StreetPlan], ...]:
    by_name = {street.name: street for street in streets}
    crosswalks: list[tuple[str, StreetPlan]] = []
    for element in entry.elements("a list of [junction, street]"):
        pair = element.elements("[junction, street]")
        if len(pair) != 2:
            element.fail(f"this must be [junction, street], not a list of {len(pair)}")
        name, street = _junction(pair[0], junctions), by_name.get(pair[1].text("the name of a street"))
        if street is None:
            pair[1].fail(f"unknown street {pair[1].text('')!r}; known are {', '.join(by_name)}")
        if name not in street.course:
            pair[1].fail(f"{street.name!r} does not run through {name!r}; name a street that does")
        if (name, street) in crosswalks:
            element.fail("it is there twice; remove one")
        crosswalks.append((name, street))
    return tuple(crosswalks)
