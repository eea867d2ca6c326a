"""Roundabouts: a ring of one-way stretches with one crossing for each street that meets it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from dorothie_gym.maps.yaml.geometry import CurveSegment, line
from dorothie_gym.maps.yaml.plan import JunctionPlan, StreetPlan
from dorothie_gym.maps.yaml.stretches import Crossing, CrossSection, StreetRun, Stretch

SMALLEST_RING = 8.0
"""Smallest radius of the innermost lane of a ring [m], for traffic that does not stop."""


@dataclass(frozen=True, kw_only=True)
class Ring:
    """Layout of a roundabout.

    Attributes:
        street: street with the name of the junction; lanes and pavement are as wide as the widest of the streets that
            meet it.
        crossings: one for each end of a run at the ring, clockwise.
        ends: for each crossing the index of the run, and whether the run starts there.
        stretches: stretches between the crossings.
    """

    street: StreetPlan
    crossings: tuple[Crossing, ...]
    ends: tuple[tuple[int, bool], ...]
    stretches: tuple[Stretch, ...]


def lay_ring(junction: JunctionPlan, runs: Sequence[StreetRun], *, street_id: int, crossing_id: int) -> Ring:
    """Lays out a roundabout; traffic circulates counter-clockwise as seen on a map.

    Args:
        junction: a junction with a roundabout.
        runs: all runs of the town.
        street_id: id of its street.
        crossing_id: id of its first crossing.

    Raises:
        TownError: it has no streets, or its ring is too small.
    """
    plan = junction.roundabout
    if plan is None:
        raise ValueError(f"junction {junction.name!r} has no roundabout")
    ends = [(k, at_start) for k, run in enumerate(runs) for at_start in (True, False)]
    ends = [(k, at_start) for k, at_start in ends if runs[k].junction(at_start) is junction]
    if not ends:
        junction.entry.fail("no street runs through it; put it into the course of one, or remove it")
    bearings = {(k, at_start): line(junction.centre, runs[k].towards(at_start)).heading for k, at_start in ends}
    ends.sort(key=lambda end: (bearings[end], end))
    street = StreetPlan(
        id=street_id,
        name=junction.name,
        course=(),
        forward=plan.lanes,
        backward=0,
        speed=plan.speed,
        width=max(runs[k].street.width for k, _ in ends),
        sidewalk=max(runs[k].street.sidewalk for k, _ in ends),
        entry=junction.entry,
    )
    inner = plan.radius - (plan.lanes - 1) * street.width / 2.0
    if inner < SMALLEST_RING:
        junction.entry.fail(
            f"its ring is too small: its innermost lane has a radius of {inner:.1f} m, at least {SMALLEST_RING:g} m are"
            f" needed; give it a radius of {SMALLEST_RING + plan.radius - inner:.1f} m or more"
        )
    crossings = []
    for place, end in enumerate(ends):
        run, bearing = runs[end[0]], bearings[end]
        if math.dist(junction.centre, run.towards(end[1])) < plan.radius + 1.0:
            run.street.entry.fail(
                f"its point next to {junction.name!r} lies inside of that roundabout's ring; move it further out"
            )
        centre = tuple(c + plan.radius * f(bearing) for c, f in zip(junction.centre, (math.cos, math.sin), strict=True))
        crossings.append(
            Crossing(
                id=crossing_id + place,
                name=f"{junction.name}/{place + 1}",
                centre=(centre[0], centre[1]),
                height=junction.height,
                plan=junction,
            )
        )
    stretches = tuple(
        _ring_stretch(street, crossings[k], crossings[k - 1], bearings[ends[k]], bearings[ends[k - 1]], plan.radius)
        for k in range(len(ends))
    )
    return Ring(street=street, crossings=tuple(crossings), ends=tuple(ends), stretches=stretches)


def _ring_stretch(
    street: StreetPlan, start: Crossing, end: Crossing, from_: float, to: float, radius: float
) -> Stretch:
    """Returns the stretch of the ring from one bearing [rad] back to a smaller one, or the full circle."""
    angle = (from_ - to) % (2.0 * math.pi) if start is not end else 2.0 * math.pi
    arc = CurveSegment(*start.centre, from_ - math.pi / 2.0, radius * angle, -1.0 / radius)
    return Stretch(
        street=street,
        section=CrossSection(street),
        start=start,
        end=end,
        corners=(start.centre, end.centre),
        heights=(start.height, end.height),
        arc=arc,
    )
