"""From a written plan to centre lines: streets are split at junctions, bends rounded, junctions given room."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from dorothie_gym.world.town.model import Array
from dorothie_gym.world.town.yaml_town.geometry import Path, Point, line, rounded, turn_at
from dorothie_gym.world.town.yaml_town.schema import JunctionPlan, StreetPlan, TownPlan

CORNER_RADIUS = 8.0
"""Radius that a right turn between two arms has at least [m]; the car itself turns within 5 m."""
SMALLEST_RADIUS = 5.5
"""Radius of a lane's centre line below which a curve is refused [m]."""
SMALLEST_TRIM = 11.0
"""Distance from the centre of a junction to the ends of its lanes, at least [m]."""
SMALLEST_STRETCH = 10.0
"""Length of street that has to remain between two junctions [m]."""
SMALLEST_ANGLE = math.radians(45.0)
"""Angle between two arms of a junction, at least [rad]."""
_CLEARANCE_SLACK = 0.5
"""How much closer than edge to edge streets may come [m]: centre lines are compared at samples 1 m apart."""


@dataclass(frozen=True, kw_only=True)
class Arm:
    """A stretch seen from one of its junctions.

    Attributes:
        stretch: index of the stretch.
        at_start: whether the stretch starts at this junction (else it ends here).
        heading: direction away from the junction [rad].
        street: the street it belongs to.
    """

    stretch: int
    at_start: bool
    heading: float
    street: StreetPlan


@dataclass(frozen=True, kw_only=True)
class Stretch:
    """A piece of street from one junction to the next.

    Attributes:
        street: the street it belongs to.
        start, end: junctions.
        corners: polyline from centre to centre [m].
    """

    street: StreetPlan
    start: JunctionPlan
    end: JunctionPlan
    corners: tuple[Point, ...]

    def label(self) -> str:
        """What it is called in messages."""
        return f"between {self.start.name!r} and {self.end.name!r}"


@dataclass(frozen=True, kw_only=True)
class Layout:
    """A town's centre lines.

    Attributes:
        plan: what was written.
        stretches: all pieces of street.
        centres: centre line of each stretch, from the edge of its first junction to that of its second.
        arms: by name of the junction, in order of heading.
    """

    plan: TownPlan
    stretches: tuple[Stretch, ...]
    centres: tuple[Path, ...]
    arms: Mapping[str, tuple[Arm, ...]]


def lay_out(plan: TownPlan) -> Layout:
    """Finds the centre lines of a plan.

    Raises:
        TownError: streets or junctions do not fit into their places.
    """
    stretches = tuple(stretch for street in plan.streets for stretch in _split(street, plan.junctions))
    arms = _arms(stretches, plan.junctions)
    trims, radii = dict[tuple[int, bool], float](), dict[str, float]()
    for name, row in arms.items():
        room = _trims(row)
        radii[name] = max(room)
        trims.update({(arm.stretch, arm.at_start): trim for arm, trim in zip(row, room, strict=True)})
    _check_junctions(tuple(plan.junctions.values()), radii)
    centres = tuple(_centre(stretch, trims[k, True], trims[k, False]) for k, stretch in enumerate(stretches))
    layout = Layout(plan=plan, stretches=stretches, centres=centres, arms=arms)
    _check_clearance(layout)
    return layout


def _split(street: StreetPlan, junctions: Mapping[str, JunctionPlan]) -> list[Stretch]:
    stretches: list[Stretch] = []
    start, corners = junctions[str(street.course[0])], list[Point]()
    for step in street.course[1:]:
        if not isinstance(step, str):
            corners.append(step)
            continue
        end = junctions[step]
        points = (start.centre, *corners, end.centre)
        for a, b in zip(points, points[1:], strict=False):
            if math.dist(a, b) < 1.0:
                street.entry.fail(f"points {list(a)} and {list(b)} of its course are less than 1 m apart; remove one")
        stretches.append(Stretch(street=street, start=start, end=end, corners=points))
        start, corners = end, []
    return stretches


def _arms(stretches: Sequence[Stretch], junctions: Mapping[str, JunctionPlan]) -> dict[str, tuple[Arm, ...]]:
    found: dict[str, list[Arm]] = {name: [] for name in junctions}
    for k, stretch in enumerate(stretches):
        for at_start, junction, corners in (
            (True, stretch.start, stretch.corners),
            (False, stretch.end, stretch.corners[::-1]),
        ):
            heading = line(corners[0], corners[1]).heading
            found[junction.name].append(Arm(stretch=k, at_start=at_start, heading=heading, street=stretch.street))
    for name, arms in found.items():
        arms.sort(key=lambda arm: (arm.heading, arm.stretch))
        _check_arms(junctions[name], arms)
    return {name: tuple(arms) for name, arms in found.items()}


def _check_arms(junction: JunctionPlan, arms: Sequence[Arm]) -> None:
    if not arms:
        junction.entry.fail("no street runs through it; put it into the course of one, or remove it")
    if len(arms) == 1:
        junction.entry.fail(
            f"street {arms[0].street.name!r} ends here and nothing goes on: dead ends are not supported;"
            " lead another street here"
        )
    for arm, other, angle in _corners(arms):
        if angle < SMALLEST_ANGLE:
            junction.entry.fail(
                f"streets {arm.street.name!r} and {other.street.name!r} leave it only {math.degrees(angle):.0f} degrees"
                f" apart; {math.degrees(SMALLEST_ANGLE):.0f} are needed: move the next point of one of them"
            )


def _corners(arms: Sequence[Arm]) -> list[tuple[Arm, Arm, float]]:
    """Arms that follow each other around a junction, and the angle between them in (0, 2 pi] [rad]."""
    pairs = zip(arms, (*arms[1:], arms[0]), strict=True)
    full = 2.0 * math.pi
    return [(a, b, (b.heading - a.heading) % full or (full if len(arms) == 1 else 0.0)) for a, b in pairs]


def _trims(arms: Sequence[Arm]) -> list[float]:
    """How far from the centre the lanes of each arm end [m], so that every right turn has the corner's radius."""
    trims = [SMALLEST_TRIM] * len(arms)
    for k, (arm, other, angle) in enumerate(_corners(arms)):
        if angle >= math.pi - 1e-6:
            continue
        tangent = CORNER_RADIUS / math.tan(angle / 2.0)
        mine, its = arm.street.width / 2.0, other.street.width / 2.0
        # The two lanes' lines meet this far from the centre, measured along each arm.
        along = (its + mine * math.cos(angle)) / math.sin(angle)
        along_other = (mine + its * math.cos(angle)) / math.sin(angle)
        trims[k] = max(trims[k], tangent + along)
        following = (k + 1) % len(arms)
        trims[following] = max(trims[following], tangent + along_other)
    return trims


def _centre(stretch: Stretch, trim_start: float, trim_end: float) -> Path:
    """Centre line between the two junctions' edges, its corners rounded."""
    corners, street = stretch.corners, stretch.street
    legs = [math.dist(a, b) for a, b in zip(corners, corners[1:], strict=False)]
    room = legs[0] - trim_start - trim_end if len(legs) == 1 else min(legs[0] - trim_start, legs[-1] - trim_end)
    if room < (SMALLEST_STRETCH if len(legs) == 1 else 0.5):
        street.entry.fail(
            f"{stretch.label()} there is no room: the junctions take {trim_start:.1f} m and {trim_end:.1f} m of it;"
            " move the junctions or the bends next to them further apart"
        )
    first, last = line(corners[0], corners[1]), line(corners[-1], corners[-2])
    ends = (first.at(trim_start)[:2], last.at(trim_end)[:2])
    points = [ends[0], *corners[1:-1], ends[1]]
    path = rounded(points, _radii(stretch, points))
    if path.length < SMALLEST_STRETCH:
        street.entry.fail(
            f"{stretch.label()} only {path.length:.1f} m of street are left; {SMALLEST_STRETCH:g} m are needed:"
            " move the junctions apart"
        )
    return path


def _radii(stretch: Stretch, points: Sequence[Point]) -> list[float]:
    """Radius of each bend [m]: the street's own, else the largest for which neighbours share their leg evenly."""
    legs = [math.dist(a, b) for a, b in zip(points, points[1:], strict=False)]
    rooms = [leg if k in (0, len(legs) - 1) else leg / 2.0 for k, leg in enumerate(legs)]
    street, radii = stretch.street, list[float]()
    tightest = max(SMALLEST_RADIUS + street.width / 2.0, street.width + 1.0)
    for k in range(1, len(points) - 1):
        turn = max(abs(turn_at(points[k - 1], points[k], points[k + 1])), 1e-6)
        fits = min(rooms[k - 1], rooms[k]) / math.tan(min(turn, math.radians(179.0)) / 2.0)
        radius = fits if street.radius is None else street.radius
        where = f"the bend at {[round(c, 2) for c in points[k]]} {stretch.label()}"
        if radius < tightest:
            street.entry.fail(
                f"{where} is tighter than its lanes are wide: radius {radius:.1f} m, at least {tightest:.1f} m are"
                " needed; move its points apart, make the turn gentler, or give a larger radius"
            )
        if radius > fits * (1.0 + 1e-9):
            street.entry.fail(f"{where} has no room for radius {radius:g} m; at most {fits:.1f} m fit")
        radii.append(radius)
    return radii


def _check_junctions(junctions: Sequence[JunctionPlan], radii: Mapping[str, float]) -> None:
    """Junctions may not overlap; `radii` tells by name how much room each takes [m]."""
    for k, junction in enumerate(junctions):
        for other in junctions[:k]:
            gap, mine, its = math.dist(junction.centre, other.centre), radii[junction.name], radii[other.name]
            if gap < mine + its:
                junction.entry.fail(
                    f"it is {gap:.1f} m from {other.name!r}, closer than their radii of {mine:.1f} m and {its:.1f} m;"
                    " move them apart or make one junction of them"
                )


def _check_clearance(layout: Layout) -> None:
    """No street may touch another one, itself, or a junction that it does not run through."""
    samples = [_every(path, 1.0) for path in layout.centres]
    trees = [cKDTree(points) for points in samples]
    for k, stretch in enumerate(layout.stretches):
        here, width = f"{stretch.label()} it", stretch.street.width
        for other in range(k):
            its = layout.stretches[other].street
            gaps = np.asarray(trees[k].query(samples[other])[0])
            if gaps.min() < width + its.width - _CLEARANCE_SLACK:
                place = [round(float(c)) for c in samples[other][gaps.argmin()]]
                stretch.street.entry.fail(
                    f"{here} touches street {its.name!r} near {place}; put a junction there or move one of them away"
                )
        pairs = trees[k].query_pairs(2.0 * width - _CLEARANCE_SLACK, output_type="ndarray")
        if np.any(np.abs(pairs[:, 1] - pairs[:, 0]) > 4.0 * width):  # samples are about 1 m apart
            stretch.street.entry.fail(f"{here} runs into itself; move its points apart")
        for junction in layout.plan.junctions.values():
            distance = float(np.min(trees[k].query(junction.centre)[0]))
            if junction not in (stretch.start, stretch.end) and distance < SMALLEST_TRIM + width:
                stretch.street.entry.fail(
                    f"{here} runs over junction {junction.name!r} without naming it; name it in the course or keep away"
                )


def _every(path: Path, spacing: float) -> Array:
    """Points (n, 2) on a path, not further apart than `spacing` [m]."""
    return np.array(
        [
            piece.at(float(s))[:2]
            for piece in path.pieces
            for s in np.linspace(0.0, piece.length, math.ceil(piece.length / spacing) + 1)
        ]
    )
