"""Plan of a YAML town: contents of a file with validated names, before any geometry."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias

from dorothie_gym.maps.yaml.entries import YamlEntry
from dorothie_gym.maps.yaml.geometry import Point


@dataclass(frozen=True, kw_only=True)
class Bend:
    """Point of a street's course besides junctions: position [m], and height [m] or None to interpolate."""

    at: Point
    height: float | None = None


CourseStep: TypeAlias = "str | Bend"
"""Step of a street's course: name of a junction, or a point that bends the street."""


@dataclass(frozen=True, kw_only=True)
class RoundaboutPlan:
    """Roundabout: radius of the centre line [m], number of lanes, speed limit [km/h]."""

    radius: float
    lanes: int
    speed: float


@dataclass(frozen=True, kw_only=True)
class JunctionPlan:
    """Junction in a plan.

    Attributes:
        id: index in the list.
        name: name in the file.
        centre: [m].
        height: [m].
        roundabout: roundabout, or None for a plain junction.
        entry: position in the file.
    """

    id: int
    name: str
    centre: Point
    height: float = 0.0
    roundabout: RoundaboutPlan | None = None
    entry: YamlEntry


@dataclass(frozen=True, kw_only=True)
class StreetPlan:
    """Street in a plan.

    Attributes:
        id: index in the list.
        name: name of the street.
        course: junctions and points; the first and last step are junctions, possibly the same one (a ring).
        forward: lanes along the course, at least 1.
        backward: lanes against it; 0 makes the street one-way.
        median: width of the median [m].
        turn_lanes: names of the junctions before which a left-turn lane opens in the median.
        ramp: whether it is a ramp: one-way, leaves and joins other streets on their right at a small angle.
        speed: speed limit [km/h].
        width: width of a lane [m].
        radius: radius of its bends [m], or None for the largest that fits.
        sidewalk: width of the pavements on both sides [m]; 0 for none.
        entry: position in the file.
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
    """Phase of a light programme in a plan: streets with green on all approaches, and duration [s].

    `left_only` holds the names of the streets with green for the left-turn lanes only.
    """

    streets: tuple[str, ...]
    seconds: float
    left_only: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class LightsPlan:
    """Lights of a junction: explicit phases, or none for a generated programme; offset of its start [s]."""

    junction: str
    phases: tuple[GreenPlan, ...] = ()
    offset: float = 0.0
    entry: YamlEntry


@dataclass(frozen=True, kw_only=True)
class TownPlan:
    """Plan of a town with validated names; the geometry is not checked yet.

    Attributes:
        name: name of the town.
        junctions: junctions by name.
        streets: streets in the order of the file.
        lights: junctions with traffic lights, none of them a roundabout.
        stops: pairs of a junction name and a street whose approaches have a stop sign there.
        yields: the same for yield signs.
        crosswalks: pairs of a junction name and the street that is crossed there.
        sites: positions of landmarks [m]; empty to place them automatically.
        cruise: cruise speed of the ego without a request, in a town with slow traffic [km/h]; None: the speed limits.
    """

    name: str
    junctions: Mapping[str, JunctionPlan]
    streets: tuple[StreetPlan, ...]
    lights: tuple[LightsPlan, ...] = ()
    stops: tuple[tuple[str, StreetPlan], ...] = ()
    yields: tuple[tuple[str, StreetPlan], ...] = ()
    crosswalks: tuple[tuple[str, StreetPlan], ...] = ()
    sites: tuple[tuple[Point, YamlEntry], ...] = ()
    cruise: float | None = None
