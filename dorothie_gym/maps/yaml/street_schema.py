"""Reader of the streets of a town file: courses through junctions and points, lanes, medians, turn lanes and ramps."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from dorothie_gym.maps.driving_side import DrivingSide
from dorothie_gym.maps.yaml.plan import Bend, CourseStep, JunctionPlan, StreetPlan

if TYPE_CHECKING:
    from dorothie_gym.maps.yaml.entries import YamlEntry

STREET_KEYS = ("through", "lanes", "one_way", "ramp", "median", "turn_lanes", "speed", "width", "radius", "sidewalk")
SPEED_RANGE = (5.0, 130.0)
"""Range of speed limits [km/h]."""
WIDTH_RANGE = (2.5, 6.0)
"""Range of lane widths [m]."""
SIDEWALK_RANGE = (0.0, 10.0)
"""Range of pavement widths [m]."""
MEDIAN_RANGE = (0.0, 50.0)
"""Range of median widths [m]."""
LANES_RANGE = (1, 4)
"""Range of lane counts in one direction."""
RADIUS_RANGE = (1.0, 20_000.0)
"""Range of radii of bends [m]."""
COORDINATE_LIMIT = 20_000.0
"""Largest coordinate [m]."""
HEIGHT_RANGE = (-500.0, 9000.0)
"""Range of heights [m], from the shore of the Dead Sea to the top of Everest."""


@dataclass(frozen=True, kw_only=True)
class StreetDefaults:
    """Default properties of streets: speed limit [km/h], widths [m], and the side of the road of their traffic."""

    speed: float = 40.0
    width: float = 3.5
    sidewalk: float = 2.0
    traffic: DrivingSide = DrivingSide.RIGHT

    def replaced(self, key: str, value: float) -> StreetDefaults:
        """Returns a copy with one number replaced."""
        change: dict[str, Any] = {key: value}
        return dataclasses.replace(self, **change)


def speed(entry: YamlEntry) -> float:
    """Reads a speed limit [km/h]."""
    return entry.number(*SPEED_RANGE, "km/h")


def lane_width(entry: YamlEntry) -> float:
    """Reads the width of a lane [m]."""
    return entry.number(*WIDTH_RANGE, "metres")


def pavement(entry: YamlEntry) -> float:
    """Reads the width of a pavement [m]."""
    return entry.number(*SIDEWALK_RANGE, "metres")


def point(entry: YamlEntry, *, flat: bool = False) -> Bend:
    """Reads a point `[x, y]` or, unless `flat`, `[x, y, height]` [m]."""
    expected = "a point [x, y] in metres" if flat else "a point [x, y] or [x, y, height] in metres"
    numbers = entry.elements(expected)
    if len(numbers) not in ((2,) if flat else (2, 3)):
        entry.fail(f"this must be {expected}, not {entry.shown()}")
    x, y = (number.number(-COORDINATE_LIMIT, COORDINATE_LIMIT, "metres") for number in numbers[:2])
    return Bend(at=(x, y), height=numbers[2].number(*HEIGHT_RANGE, "metres of height") if len(numbers) == 3 else None)


def read_street(
    k: int, key: YamlEntry, value: YamlEntry, junctions: Mapping[str, JunctionPlan], defaults: StreetDefaults
) -> StreetPlan:
    """Reads the street with index `k`.

    Raises:
        TownError: with the line, the street and the remedy.
    """
    name = key.text("a name")
    here = key.named(f"street {name!r}")
    if name in junctions and junctions[name].roundabout:
        here.fail("the ring of the roundabout of this name is a street of that name already; give this one another")
    value = value.named(here.element)
    fields = value.fields(STREET_KEYS, required=("through",)) if value.is_mapping else {}
    course = _course(fields.get("through", value).named(here.element), junctions)
    ramp = "ramp" in fields and fields["ramp"].boolean()
    forward, backward = _lanes(fields, ramp=ramp)
    width = lane_width(fields["width"]) if "width" in fields else defaults.width
    median = fields["median"].number(*MEDIAN_RANGE, "metres") if "median" in fields else 0.0
    if not backward and median:
        fields["median"].fail("a median keeps two directions apart and this street has one; remove it")
    turn_lanes: tuple[str, ...] = ()
    if "turn_lanes" in fields:
        turn_lanes = _turn_lanes(fields["turn_lanes"], course, junctions, defaults.traffic)
        _check_room(fields["turn_lanes"], backward=backward, median=median, width=width)
    return StreetPlan(
        id=k,
        name=name,
        course=course,
        forward=forward,
        backward=backward,
        median=median,
        turn_lanes=turn_lanes,
        ramp=ramp,
        speed=speed(fields["speed"]) if "speed" in fields else defaults.speed,
        width=width,
        radius=fields["radius"].number(*RADIUS_RANGE, "metres") if "radius" in fields else None,
        sidewalk=pavement(fields["sidewalk"]) if "sidewalk" in fields else 0.0 if ramp else defaults.sidewalk,
        traffic=defaults.traffic,
        entry=here,
    )


def approaches(street: StreetPlan, junction: str) -> bool:
    """Returns whether a direction of the street leads to a junction (a one-way street only leaves its first one)."""
    return junction in street.course[1:] or (street.backward > 0 and junction in street.course[:-1])


def _course(entry: YamlEntry, junctions: Mapping[str, JunctionPlan]) -> tuple[CourseStep, ...]:
    course: list[CourseStep] = []
    for element in entry.elements("a list of junctions and points that it runs through"):
        step: CourseStep = (
            point(element)
            if element.is_sequence
            else element.choice(junctions, "junction", "the name of a junction or a point [x, y]")
        )
        if course and course[-1] == step:
            element.fail(f"{shown(step)} comes twice in a row; remove one")
        course.append(step)
    if len(course) < 2:
        entry.fail("it runs nowhere; name at least the two junctions where it starts and ends")
    for end, where in ((course[0], "starts"), (course[-1], "ends")):
        if not isinstance(end, str):
            entry.fail(
                f"it {where} at {shown(end)}, which is no junction: dead ends are not supported; name a junction"
            )
    return tuple(course)


def shown(step: CourseStep) -> str:
    """Returns a step of a course for messages."""
    return repr(step) if isinstance(step, str) else f"[{step.at[0]:g}, {step.at[1]:g}]"


def _lanes(fields: Mapping[str, YamlEntry], *, ramp: bool) -> tuple[int, int]:
    """Reads the numbers of lanes along the course and against it."""
    one_way = fields["one_way"].boolean() if "one_way" in fields else ramp
    if ramp and not one_way:
        fields["one_way"].fail("a ramp has one direction; remove this key, or the key 'ramp'")
    lanes = fields.get("lanes")
    if lanes is None:
        return 1, 0 if one_way else 1
    if not lanes.is_sequence:
        count = lanes.whole(*LANES_RANGE, "lanes in one direction")
        return count, 0 if one_way else count
    if one_way:
        kind = "a ramp" if ramp else "a one-way street"
        lanes.fail(
            f"{kind} has no lanes backward; write one number, or remove the key '{'ramp' if ramp else 'one_way'}'"
        )
    forward, backward = (
        count.whole(*LANES_RANGE, "lanes in one direction (a street with one direction: one_way: true)")
        for count in lanes.pair("a number of lanes, or [forward, backward]")
    )
    return forward, backward


def _turn_lanes(
    entry: YamlEntry, course: tuple[CourseStep, ...], junctions: Mapping[str, JunctionPlan], traffic: DrivingSide
) -> tuple[str, ...]:
    found: list[str] = []
    on_course = list(dict.fromkeys(step for step in course if isinstance(step, str)))
    for element in entry.names("a list of junctions"):
        name = element.choice(junctions, "junction", "the name of a junction")
        if name not in on_course:
            element.fail(f"the street does not run through {name!r}; it does through {', '.join(on_course)}")
        if junctions[name].roundabout:
            element.fail(f"{name!r} is a roundabout, which has no {traffic.far_turn} turns; remove it here")
        if name in found:
            element.fail(f"{name!r} is there twice; remove one")
        found.append(name)
    return tuple(found)


def _check_room(entry: YamlEntry, *, backward: int, median: float, width: float) -> None:
    """Checks that turn lanes fit into the median."""
    if not backward:
        entry.fail("a one-way street has no median for turn lanes; remove them, or the key 'one_way' or 'ramp'")
    if median < width:
        entry.fail(
            f"turn lanes lie in the median, which is {median:g} m wide and the lanes are {width:g} m;"
            f" write 'median: {width:g}' or more"
        )
