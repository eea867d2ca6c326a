"""Street segments: streets divided at their crossings, and their cross-sections."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

from dorothie_gym.maps.yaml.geometry import CurveSegment, Point, line
from dorothie_gym.maps.yaml.plan import Bend, JunctionPlan, StreetPlan, TownPlan


@dataclass(frozen=True, eq=False)
class CrossSection:
    """Cross-section of a street in the direction of its course; offsets are positive to the right [m].

    The line is the centre of the median of a two-way street, and the centre of the lanes of a one-way street.
    """

    street: StreetPlan

    @cached_property
    def forward(self) -> tuple[float, ...]:
        """Offsets of the lanes along the course, innermost first [m]."""
        street = self.street
        inner = street.median / 2.0 if street.backward else -street.forward * street.width / 2.0
        return tuple(inner + (k + 0.5) * street.width for k in range(street.forward))

    @cached_property
    def backward(self) -> tuple[float, ...]:
        """Offsets of the lanes against the course, innermost first [m]."""
        street = self.street
        return tuple(-street.median / 2.0 - (k + 0.5) * street.width for k in range(street.backward))

    @property
    def right(self) -> float:
        """Distance from the line to the edge of the road on its right [m]."""
        return self.forward[-1] + self.street.width / 2.0

    @property
    def left(self) -> float:
        """Distance from the line to the edge of the road on its left [m]."""
        return self.street.width / 2.0 - (self.backward[-1] if self.backward else self.forward[0])

    @property
    def pocket(self) -> float:
        """Offset of the left-turn lane in the median for the lanes along the course [m]."""
        return (self.street.median - self.street.width) / 2.0

    def edge(self, to_the_right: bool) -> float:
        """Returns the distance from the line to the edge of the road on one side [m]."""
        return self.right if to_the_right else self.left

    def side(self, to_the_right: bool) -> float:
        """Returns the distance from the line to the outer edge of the pavement on one side [m]."""
        return self.edge(to_the_right) + self.street.sidewalk

    def tightest(self, to_the_right: bool, lane_radius: float) -> float:
        """Returns the line's radius in a bend to one side for which the inner lane has the radius `lane_radius` [m]."""
        edge = self.edge(to_the_right)
        # the pavement needs some radius as well
        return max(lane_radius + edge - self.street.width / 2.0, edge + max(self.street.sidewalk, 0.5) + 0.5)


# --- Segments ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True, eq=False)
class Crossing:
    """Meeting point of segments: a junction, or the point where a street meets the ring of a roundabout.

    Attributes:
        id: id of the junction of the town.
        name: name of the junction; on a ring with a number ("circus/1").
        centre: [m].
        height: [m].
        plan: junction in the plan.
    """

    id: int
    name: str
    centre: Point
    height: float
    plan: JunctionPlan

    @property
    def on_ring(self) -> bool:
        """Whether it belongs to a roundabout."""
        return self.plan.roundabout is not None


@dataclass(frozen=True, kw_only=True, eq=False)
class StreetSegment:
    """Part of a street from one crossing to the next.

    Attributes:
        street: street in the plan.
        section: cross-section.
        start, end: crossings.
        corners: polyline between the centres of both crossings [m]; on a ring its two ends.
        heights: heights of the corners, None to interpolate [m].
        arc: arc of the ring between both centres, or None.
    """

    street: StreetPlan
    section: CrossSection
    start: Crossing
    end: Crossing
    corners: tuple[Point, ...]
    heights: tuple[float | None, ...]
    arc: CurveSegment | None = None

    def label(self) -> str:
        """Returns its name in messages."""
        return f"between {self.start.name!r} and {self.end.name!r}"

    def crossing(self, at_start: bool) -> Crossing:
        """Returns the crossing at one end."""
        return self.start if at_start else self.end

    def leg(self, at_start: bool) -> CurveSegment:
        """Returns its first straight or arc, outwards from the crossing at one end."""
        if self.arc is not None:
            return self.arc if at_start else self.arc.reversed()
        return line(*self.corners[:2]) if at_start else line(self.corners[-1], self.corners[-2])


@dataclass(frozen=True, kw_only=True)
class StreetRun:
    """Street segment before the layout of roundabouts: street, two junctions, and the points between them."""

    street: StreetPlan
    start: JunctionPlan
    end: JunctionPlan
    bends: tuple[Bend, ...]

    def junction(self, at_start: bool) -> JunctionPlan:
        """Returns the junction at one end."""
        return self.start if at_start else self.end

    def towards(self, at_start: bool) -> Point:
        """Returns the point next to the junction at one end [m]."""
        points = [self.start.centre, *(bend.at for bend in self.bends), self.end.centre]
        return points[1] if at_start else points[-2]


def split(plan: TownPlan) -> list[StreetRun]:
    """Divides the streets of a plan at their junctions.

    Raises:
        TownError: two points of a course are (almost) equal.
    """
    return [run for street in plan.streets for run in _runs(street, plan.junctions)]


def _runs(street: StreetPlan, junctions: Mapping[str, JunctionPlan]) -> list[StreetRun]:
    runs, bends = list[StreetRun](), list[Bend]()
    start = junctions[str(street.course[0])]
    for step in street.course[1:]:
        if isinstance(step, Bend):
            bends.append(step)
            continue
        end = junctions[step]
        runs.append(StreetRun(street=street, start=start, end=end, bends=tuple(bends)))
        _check_points(runs[-1])
        start, bends = end, []
    return runs


def _check_points(run: StreetRun) -> None:
    points = [run.start.centre, *(bend.at for bend in run.bends), run.end.centre]
    for a, b in itertools.pairwise(points):
        if abs(a[0] - b[0]) + abs(a[1] - b[1]) < 1.0:
            run.street.entry.fail(f"points {list(a)} and {list(b)} of its course are less than 1 m apart; remove one")


def segment_of(run: StreetRun, start: Crossing, end: Crossing) -> StreetSegment:
    """Returns the segment of a run between two crossings."""
    return StreetSegment(
        street=run.street,
        section=CrossSection(run.street),
        start=start,
        end=end,
        corners=(start.centre, *(bend.at for bend in run.bends), end.centre),
        heights=(start.height, *(bend.height for bend in run.bends), end.height),
    )
