"""Streets cut into stretches at the crossings that they run through."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from dorothie_gym.world.town.yaml_town.cross_section import CrossSection
from dorothie_gym.world.town.yaml_town.geometry import Piece, Point, line
from dorothie_gym.world.town.yaml_town.plan import Bend, JunctionPlan, StreetPlan, TownPlan


@dataclass(frozen=True, kw_only=True, eq=False)
class Crossing:
    """Where stretches meet: a junction, or the place where one street meets the ring of a roundabout.

    Attributes:
        id: of the town's junction.
        name: of the junction; on a ring with a number ("circus/1").
        centre: [m].
        height: [m].
        plan: the junction as it is written.
    """

    id: int
    name: str
    centre: Point
    height: float
    plan: JunctionPlan

    @property
    def on_ring(self) -> bool:
        """Whether it is a part of a roundabout."""
        return self.plan.roundabout is not None


@dataclass(frozen=True, kw_only=True, eq=False)
class Stretch:
    """A piece of street from one crossing to the next.

    Attributes:
        street: the street it belongs to.
        section: its lanes.
        start, end: crossings.
        corners: polyline from centre to centre [m]; on a ring its two ends.
        heights: of the corners, None where the height follows on [m].
        arc: the piece of a ring that it is, from centre to centre, or None.
    """

    street: StreetPlan
    section: CrossSection
    start: Crossing
    end: Crossing
    corners: tuple[Point, ...]
    heights: tuple[float | None, ...]
    arc: Piece | None = None

    def label(self) -> str:
        """What it is called in messages."""
        return f"between {self.start.name!r} and {self.end.name!r}"

    def crossing(self, at_start: bool) -> Crossing:
        """The crossing at one of its ends."""
        return self.start if at_start else self.end

    def leg(self, at_start: bool) -> Piece:
        """Its first piece, seen from the crossing at one of its ends outwards."""
        if self.arc is not None:
            return self.arc if at_start else self.arc.reversed()
        return line(*self.corners[:2]) if at_start else line(self.corners[-1], self.corners[-2])


@dataclass(frozen=True, kw_only=True)
class Run:
    """A stretch before roundabouts are laid out: its street, its two junctions, and the points between."""

    street: StreetPlan
    start: JunctionPlan
    end: JunctionPlan
    bends: tuple[Bend, ...]

    def junction(self, at_start: bool) -> JunctionPlan:
        """The junction at one of its ends."""
        return self.start if at_start else self.end

    def towards(self, at_start: bool) -> Point:
        """The point next to the junction at one of its ends [m]."""
        points = [self.start.centre, *(bend.at for bend in self.bends), self.end.centre]
        return points[1] if at_start else points[-2]


def split(plan: TownPlan) -> list[Run]:
    """Cuts the streets of a plan at their junctions.

    Raises:
        TownError: two points of a course are as good as the same.
    """
    return [run for street in plan.streets for run in _runs(street, plan.junctions)]


def _runs(street: StreetPlan, junctions: Mapping[str, JunctionPlan]) -> list[Run]:
    runs, bends = list[Run](), list[Bend]()
    start = junctions[str(street.course[0])]
    for step in street.course[1:]:
        if isinstance(step, Bend):
            bends.append(step)
            continue
        end = junctions[step]
        runs.append(Run(street=street, start=start, end=end, bends=tuple(bends)))
        _check_points(runs[-1])
        start, bends = end, []
    return runs


def _check_points(run: Run) -> None:
    points = [run.start.centre, *(bend.at for bend in run.bends), run.end.centre]
    for a, b in zip(points, points[1:], strict=False):
        if abs(a[0] - b[0]) + abs(a[1] - b[1]) < 1.0:
            run.street.entry.fail(f"points {list(a)} and {list(b)} of its course are less than 1 m apart; remove one")


def stretch_of(run: Run, start: Crossing, end: Crossing) -> Stretch:
    """The stretch of a run between two crossings."""
    return Stretch(
        street=run.street,
        section=CrossSection(run.street),
        start=start,
        end=end,
        corners=(start.centre, *(bend.at for bend in run.bends), end.centre),
        heights=(start.height, *(bend.height for bend in run.bends), end.height),
    )
