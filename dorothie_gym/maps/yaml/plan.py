"""Plan of a YAML town: contents of a file with validated names, before any geometry."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TypeAlias

from dorothie_gym.maps.driving_side import DrivingSide
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
        turn_lanes: names of the junctions before which a lane for turns across oncoming traffic opens in the median.
        ramp: whether it is a ramp: one-way, leaves and joins other streets on the side of their kerb at a small angle.
        speed: speed limit [km/h].
        width: width of a lane [m].
        radius: radius of its bends [m], or None for the largest that fits.
        sidewalk: width of the pavements on both sides [m]; 0 for none.
        traffic: side of the road on which vehicles drive in its town.
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
    traffic: DrivingSide = DrivingSide.RIGHT
    entry: YamlEntry


@dataclass(frozen=True, kw_only=True)
class GreenPlan:
    """Phase of a light programme in a plan: streets with green on all approaches, and duration [s].

    `turn_lanes_only` holds the names of the streets with green for the turn lanes in the median only.
    """

    streets: tuple[str, ...]
    seconds: float
    turn_lanes_only: tuple[str, ...] = ()


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
        traffic: side of the road on which vehicles drive.
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
    traffic: DrivingSide = DrivingSide.RIGHT

    def right_handed(self) -> TownPlan:
        """Returns the plan to lay out, for right-hand traffic: that of a left-hand town with y negated."""
        if self.traffic is DrivingSide.RIGHT:
            return self
        streets = {street.id: _mirrored_street(street) for street in self.streets}
        stops, yields, crosswalks = (
            tuple((name, streets[street.id]) for name, street in pairs)
            for pairs in (self.stops, self.yields, self.crosswalks)
        )
        return replace(
            self,
            junctions={name: replace(j, centre=_mirrored(j.centre)) for name, j in self.junctions.items()},
            streets=tuple(streets.values()),
            stops=stops,
            yields=yields,
            crosswalks=crosswalks,
            sites=tuple((_mirrored(place), entry) for place, entry in self.sites),
        )


def _mirrored(point: Point) -> Point:
    return point[0], 0.0 - point[1]  # never -0.0, whose bearings would be other ones


def _mirrored_street(street: StreetPlan) -> StreetPlan:
    return replace(
        street, course=tuple(s if isinstance(s, str) else replace(s, at=_mirrored(s.at)) for s in street.course)
    )
