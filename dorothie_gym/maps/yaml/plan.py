"""What a town file says, read and checked for names, before any geometry: the schema writes it, the layout reads it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias

from dorothie_gym.maps.yaml.geometry import Point
from dorothie_gym.maps.yaml.nodes import YamlEntry


@dataclass(frozen=True, kw_only=True)
class Bend:
    """A plain point of a street's course: where it is [m] and how high, or None where the height follows on."""

    at: Point
    height: float | None = None


CourseStep: TypeAlias = "str | Bend"
"""A step of a street's course: a junction's name or a point that bends the street."""


@dataclass(frozen=True, kw_only=True)
class RoundaboutPlan:
    """A ring instead of a plain junction: radius of its middle line [m], lanes on it, speed limit [km/h]."""

    radius: float
    lanes: int
    speed: float


@dataclass(frozen=True, kw_only=True)
class JunctionPlan:
    """A junction as it is written.

    Attributes:
        id: its place in the list.
        name: in the file.
        centre: [m].
        height: [m].
        roundabout: the ring that stands for it, or None.
        entry: where it is written.
    """

    id: int
    name: str
    centre: Point
    height: float = 0.0
    roundabout: RoundaboutPlan | None = None
    entry: YamlEntry


@dataclass(frozen=True, kw_only=True)
class StreetPlan:
    """A street as it is written.

    Attributes:
        id: its place in the list.
        name: as people call it.
        course: junctions and points; the first and last step are junctions (they may be the same one: a ring).
        forward: lanes along the course, at least 1.
        backward: lanes against it; 0 makes the street one-way.
        median: width of what lies between the directions [m].
        turn_lanes: names of the junctions before which a left-turn lane opens in the median.
        ramp: whether it is a ramp: one-way, it leaves and joins other streets at their right side, at a small angle.
        speed: limit [km/h].
        width: of a lane [m].
        radius: of its bends [m], or None for the largest that fits.
        sidewalk: width of the pavement on either side [m]; 0 for none.
        entry: where it is written.
    """

    id: int
    name: str
    course: tuple[CourseStep, ...]
    forward: int = 1
    backward: int = 1
    median: float = 0.0
    turn_lanes: tuple[str, ...] = ()
    ramp: bool = False
    speed: float
    width: float
    radius: float | None = None
    sidewalk: float = 2.0
    entry: YamlEntry


@dataclass(frozen=True, kw_only=True)
class GreenPlan:
    """A phase of a light programme as it is written: streets that have green (all their approaches) and how long [s].

    `left_only` holds the names of those streets of which only the left-turn lanes have green.
    """

    streets: tuple[str, ...]
    seconds: float
    left_only: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class LightsPlan:
    """Lights of a junction: written phases, or none for a programme that is derived; offset of its start [s]."""

    junction: str
    phases: tuple[GreenPlan, ...] = ()
    offset: float = 0.0
    entry: YamlEntry


@dataclass(frozen=True, kw_only=True)
class TownPlan:
    """A town as it is written; names are known to be right, the geometry is not checked yet.

    Attributes:
        name: of the town.
        junctions: by name.
        streets: in order.
        lights: junctions with traffic lights, none of them a roundabout.
        stops: pairs of a junction's name and the street whose approaches have a stop sign there.
        yields: the same for yield signs.
        crosswalks: pairs of a junction's name and the street that is crossed there.
        sites: places where landmarks stand [m], or none: then they are laid out automatically.
    """

    name: str
    junctions: Mapping[str, JunctionPlan]
    streets: tuple[StreetPlan, ...]
    lights: tuple[LightsPlan, ...] = ()
    stops: tuple[tuple[str, StreetPlan], ...] = ()
    yields: tuple[tuple[str, StreetPlan], ...] = ()
    crosswalks: tuple[tuple[str, StreetPlan], ...] = ()
    sites: tuple[tuple[Point, YamlEntry], ...] = ()
