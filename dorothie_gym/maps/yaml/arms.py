"""The arms of a crossing: stretches as they are seen from it, with the lanes that come in and go out."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from dorothie_gym.angles import wrap_radians
from dorothie_gym.maps.model import Lane
from dorothie_gym.maps.yaml.geometry import CurveSegment, Pose
from dorothie_gym.maps.yaml.plan import StreetPlan
from dorothie_gym.maps.yaml.stretches import Crossing, Stretch

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
    leg: CurveSegment
    street: StreetPlan
    incoming: tuple[LaneEnd, ...]
    outgoing: tuple[LaneEnd, ...]
    right: float
    left: float
    on_ring: bool

    @property
    def heading(self) -> float:
        """Direction away from the centre of the crossing [rad]."""
        return wrap_radians(self.leg.heading)

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
        return x, y, wrap_radians(heading + math.pi)

    def beginning(self, lane: LaneEnd, trim: float) -> Pose:
        """Where and in which direction an outgoing lane begins, `trim` metres from the centre."""
        x, y, heading = self.leg.at(trim)
        return x - lane.offset * math.sin(heading), y + lane.offset * math.cos(heading), wrap_radians(heading)


def turn_between(source: Arm, target: Arm) -> float:
    """Change of heading on the way from one arm into another [rad], positive to the right."""
    return wrap_radians(target.leg.heading - source.leg.heading - math.pi)


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
    order = sorted(ends, key=lambda end: (wrap_radians(stretches[end[0]].leg(end[1]).heading), end))
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


# --- The arms of a crossing with the lanes that were built for them --------------------------------------------------


@dataclass(frozen=True, kw_only=True, eq=False)
class Approach:
    """An arm and its lanes, from the kerb inwards.

    Attributes:
        arm: as it was laid out.
        through: lanes that come in.
        pocket: the left-turn lane that comes in beside them, or None.
        outgoing: lanes that go out.
    """

    arm: Arm
    through: tuple[Lane, ...]
    pocket: Lane | None
    outgoing: tuple[Lane, ...]

    @property
    def incoming(self) -> tuple[Lane, ...]:
        """All lanes that come in."""
        return self.through if self.pocket is None else (*self.through, self.pocket)


# --- Where ramps leave and join other streets at a small angle, and with which arm they exchange their ca ------------

SMALLEST_ANGLE, LARGEST_ANGLE = math.radians(12.0), math.radians(45.0)
"""A ramp leaves and joins at an angle between these [rad]; at a larger one it meets a junction like any street."""
_STRAIGHT_ON = math.radians(35.0)


def find_slips(crossing: Crossing, arms: Sequence[Arm]) -> Mapping[int, int]:
    """Ramps that leave or join a street at this crossing instead of meeting it as streets meet.

    A ramp that leaves lies just to the right of the arm in which its cars would go on else; one that joins lies just to
    the left of the arm, seen outwards, from which it comes closer.

    Returns:
        For the index of each such arm that of the arm from which its cars come, or into which they go.

    Raises:
        TownError: a ramp lies on the wrong side, or nothing comes or goes on straight there.
    """
    slips: dict[int, int] = {}
    for before, arm, angle in neighbours(arms):
        if arm.street.ramp and arm.outgoing and angle < LARGEST_ANGLE and not before.on_ring:
            slips[arm.index] = _partner(crossing, arms, arm, before)
    for arm, after, angle in neighbours(arms):
        if arm.street.ramp and arm.incoming and angle < LARGEST_ANGLE and not after.on_ring:
            slips[arm.index] = _partner(crossing, arms, arm, after)
    for one, other, angle in neighbours(arms):
        if angle < LARGEST_ANGLE:
            _check_side(one, other, one.outgoing, slips)
            _check_side(other, one, other.incoming, slips)
    return slips


def _partner(crossing: Crossing, arms: Sequence[Arm], ramp: Arm, host: Arm) -> int:
    """The arm on the other side of the crossing from the arm beside which the ramp runs."""
    others = [arm for arm in arms if arm is not ramp and arm is not host and not arm.street.ramp]
    if ramp.outgoing:
        ways = [(abs(turn_between(arm, host)), arm.index) for arm in others if arm.incoming and host.outgoing]
        verb, way = "leaves", "nothing comes straight along that street"
    else:
        ways = [(abs(turn_between(host, arm)), arm.index) for arm in others if arm.outgoing and host.incoming]
        verb, way = "joins", "that street does not go on straight"
    if not ways or min(ways)[0] > _STRAIGHT_ON:
        ramp.street.entry.fail(
            f"the ramp {verb} {host.street.name!r} at {crossing.name!r}, but {way} on this side; ramps leave and"
            " join on the right of a street that runs straight through the junction"
        )
    return min(ways)[1]


def _check_side(ramp: Arm, other: Arm, wrong: object, slips: Mapping[int, int]) -> None:
    """Refuses a ramp that is close to a street on its left side."""
    if wrong and ramp.street.ramp and ramp.index not in slips and not other.street.ramp:
        verb = "leaves" if ramp.outgoing else "joins"
        ramp.street.entry.fail(
            f"the ramp {verb} {other.street.name!r} on its left; ramps are on the right, in driving direction: bend its"
            " first points to the other side"
        )
