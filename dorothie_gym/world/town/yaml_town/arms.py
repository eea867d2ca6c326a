"""The arms of a crossing: stretches as they are seen from it, with the lanes that come in and go out."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from dorothie_gym.world.town.yaml_town.geometry import Piece, Pose, wrap
from dorothie_gym.world.town.yaml_town.plan import StreetPlan
from dorothie_gym.world.town.yaml_town.stretches import Crossing, Stretch

POCKET = -1
"""Number of a left-turn lane that opens in the median."""


@dataclass(frozen=True, slots=True)
class LaneEnd:
    """A lane at a crossing: its number, 0 for the innermost or `POCKET`, and its offset, seen outwards [m]."""

    number: int
    offset: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Arm:
    """A stretch seen from one of its crossings; offsets are positive to the right as one looks outwards [m].

    Attributes:
        index: its place among the arms of the crossing, which are in order of heading.
        stretch: index of the stretch.
        at_start: whether the stretch starts at this crossing (else it ends here).
        leg: first piece of the stretch, outwards from the centre of the crossing.
        street: the street it belongs to.
        incoming, outgoing: its lanes, from the kerb inwards.
        right, left: distance from the line to the edges of the road, pavements included but for those of rings [m].
        on_ring: whether it is a part of a roundabout's ring.
    """

    index: int
    stretch: int
    at_start: bool
    leg: Piece
    street: StreetPlan
    incoming: tuple[LaneEnd, ...]
    outgoing: tuple[LaneEnd, ...]
    right: float
    left: float
    on_ring: bool

    @property
    def heading(self) -> float:
        """Direction away from the centre of the crossing [rad]."""
        return wrap(self.leg.heading)

    @property
    def through(self) -> tuple[LaneEnd, ...]:
        """Incoming lanes without the left-turn lane."""
        return tuple(lane for lane in self.incoming if lane.number != POCKET)

    @property
    def pocket(self) -> LaneEnd | None:
        """The left-turn lane, if there is one."""
        return next((lane for lane in self.incoming if lane.number == POCKET), None)

    def ending(self, lane: LaneEnd, trim: float) -> Pose:
        """Where and in which direction an incoming lane ends, `trim` metres from the centre."""
        x, y, heading = self.beginning(lane, trim)
        return x, y, wrap(heading + math.pi)

    def beginning(self, lane: LaneEnd, trim: float) -> Pose:
        """Where and in which direction an outgoing lane begins, `trim` metres from the centre."""
        x, y, heading = self.leg.at(trim)
        return x - lane.offset * math.sin(heading), y + lane.offset * math.cos(heading), wrap(heading)


def turn_between(source: Arm, target: Arm) -> float:
    """Change of heading on the way from one arm into another [rad], positive to the right."""
    return wrap(target.leg.heading - source.leg.heading - math.pi)


def arms_at(crossing: Crossing, stretches: Sequence[Stretch], ends: Sequence[tuple[int, bool]]) -> tuple[Arm, ...]:
    """The arms of a crossing in order of heading, clockwise; left-turn lanes are not there yet.

    Args:
        crossing: the crossing.
        stretches: all stretches.
        ends: which ends of which stretches meet here: index, and whether it is the start.

    Raises:
        TownError: nothing meets here, or only one arm.
    """
    if not ends:
        crossing.plan.entry.fail("no street runs through it; put it into the course of one, or remove it")
    if len(ends) == 1:
        crossing.plan.entry.fail(
            f"street {stretches[ends[0][0]].street.name!r} ends here and nothing goes on: dead ends are not supported;"
            " lead another street here"
        )
    order = sorted(ends, key=lambda end: (wrap(stretches[end[0]].leg(end[1]).heading), end))
    return tuple(_arm(place, *end, stretches[end[0]]) for place, end in enumerate(order))


def _arm(place: int, k: int, at_start: bool, stretch: Stretch) -> Arm:
    section = stretch.section
    forward = tuple(LaneEnd(n, offset) for n, offset in enumerate(section.forward))[::-1]
    backward = tuple(LaneEnd(n, offset) for n, offset in enumerate(section.backward))[::-1]
    if not at_start:  # seen against the course
        forward, backward = _mirrored(forward), _mirrored(backward)
    return Arm(
        index=place,
        stretch=k,
        at_start=at_start,
        leg=stretch.leg(at_start),
        street=stretch.street,
        incoming=backward if at_start else forward,
        outgoing=forward if at_start else backward,
        # The pavement around a ring ends where the corners of the streets that meet it begin, and takes no room there.
        right=section.side(at_start) if stretch.arc is None else section.edge(at_start),
        left=section.side(not at_start) if stretch.arc is None else section.edge(not at_start),
        on_ring=stretch.arc is not None,
    )


def _mirrored(lanes: tuple[LaneEnd, ...]) -> tuple[LaneEnd, ...]:
    return tuple(LaneEnd(lane.number, -lane.offset) for lane in lanes)


def neighbours(arms: Sequence[Arm]) -> list[tuple[Arm, Arm, float]]:
    """Arms that follow each other clockwise around a crossing, and the angle between them in [0, 2 pi) [rad]."""
    pairs = zip(arms, (*arms[1:], arms[0]), strict=True)
    return [(a, b, (b.leg.heading - a.leg.heading) % (2.0 * math.pi)) for a, b in pairs]
