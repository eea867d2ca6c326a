"""Arms of a crossing: street segments as seen from it, with incoming and outgoing lanes, and ramps."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from dorothie_gym.maps.model import Lane
from dorothie_gym.maps.yaml.geometry import CurveSegment, Pose
from dorothie_gym.maps.yaml.plan import StreetPlan
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.portable_math import wrap_radians

if TYPE_CHECKING:
    from dorothie_gym.maps.yaml.segments import Crossing, StreetSegment

POCKET = -1
"""Number of a left-turn lane in the median."""


@dataclass(frozen=True, slots=True)
class LaneEnd:
    """Lane at a crossing: number (0 for the innermost, or `POCKET`) and offset, seen outwards [m]."""

    number: int
    offset: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Arm:
    """Street segment seen from one of its crossings; offsets are positive to the right, seen outwards [m].

    Attributes:
        index: index among the arms of the crossing, which are in order of heading.
        segment: index of the segment.
        at_start: whether the segment starts at this crossing instead of ending there.
        leg: first straight or arc of the segment, outwards from the centre of the crossing.
        street: street in the plan.
        incoming, outgoing: lanes from the kerb inwards.
        right, left: distance from the line to the edges of the road, pavements included except on rings [m].
        on_ring: whether it belongs to the ring of a roundabout.
    """

    index: int
    segment: int
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
        """Left-turn lane, or None."""
        return next((lane for lane in self.incoming if lane.number == POCKET), None)

    def ending(self, lane: LaneEnd, trim: float) -> Pose:
        """Returns the pose of the end of an incoming lane, `trim` metres from the centre."""
        x, y, heading = self.beginning(lane, trim)
        return x, y, wrap_radians(heading + math.pi)

    def beginning(self, lane: LaneEnd, trim: float) -> Pose:
        """Returns the pose of the start of an outgoing lane, `trim` metres from the centre."""
        x, y, heading = self.leg.at(trim)
        return x - lane.offset * pm.sin(heading), y + lane.offset * pm.cos(heading), wrap_radians(heading)


def turn_between(source: Arm, target: Arm) -> float:
    """Returns the change of heading from one arm into another [rad], positive to the right."""
    return wrap_radians(target.leg.heading - source.leg.heading - math.pi)


def arms_at(crossing: Crossing, segments: Sequence[StreetSegment], ends: Sequence[tuple[int, bool]]) -> tuple[Arm, ...]:
    """Returns the arms of a crossing in clockwise order of heading, without left-turn lanes.

    Args:
        crossing: the crossing.
        segments: all segments.
        ends: ends of segments at the crossing: index, and whether it is the start.

    Raises:
        TownError: the crossing has no arm, or only one.
    """
    if not ends:
        crossing.plan.entry.fail("no street runs through it; put it into the course of one, or remove it")
    if len(ends) == 1:
        crossing.plan.entry.fail(
            f"street {segments[ends[0][0]].street.name!r} ends here and no street continues: dead ends are not"
            " supported; lead another street here"
        )
    order = sorted(ends, key=lambda end: (wrap_radians(segments[end[0]].leg(end[1]).heading), end))
    return tuple(_arm(place, *end, segments[end[0]]) for place, end in enumerate(order))


def _arm(place: int, k: int, at_start: bool, segment: StreetSegment) -> Arm:
    section = segment.section
    forward = tuple(LaneEnd(n, offset) for n, offset in enumerate(section.forward))[::-1]
    backward = tuple(LaneEnd(n, offset) for n, offset in enumerate(section.backward))[::-1]
    if not at_start:  # seen against the course
        forward, backward = _mirrored(forward), _mirrored(backward)
    return Arm(
        index=place,
        segment=k,
        at_start=at_start,
        leg=segment.leg(at_start),
        street=segment.street,
        incoming=backward if at_start else forward,
        outgoing=forward if at_start else backward,
        # the pavement around a ring ends at the corners of the streets that meet it, and takes no room there
        right=section.side(at_start) if segment.arc is None else section.edge(at_start),
        left=section.side(not at_start) if segment.arc is None else section.edge(not at_start),
        on_ring=segment.arc is not None,
    )


def _mirrored(lanes: tuple[LaneEnd, ...]) -> tuple[LaneEnd, ...]:
    return tuple(LaneEnd(lane.number, -lane.offset) for lane in lanes)


def neighbours(arms: Sequence[Arm]) -> list[tuple[Arm, Arm, float]]:
    """Returns successive arms in clockwise order, and the angle between them from 0 to 2 pi [rad]."""
    pairs = zip(arms, (*arms[1:], arms[0]), strict=True)
    return [(a, b, (b.leg.heading - a.leg.heading) % (2.0 * math.pi)) for a, b in pairs]


# --- Arms with their lanes -------------------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True, eq=False)
class Approach:
    """Arm with its lanes, from the kerb inwards.

    Attributes:
        arm: arm of the layout.
        through: incoming lanes without the left-turn lane.
        pocket: left-turn lane beside them, or None.
        outgoing: outgoing lanes.
    """

    arm: Arm
    through: tuple[Lane, ...]
    pocket: Lane | None
    outgoing: tuple[Lane, ...]

    @property
    def incoming(self) -> tuple[Lane, ...]:
        """All incoming lanes."""
        return self.through if self.pocket is None else (*self.through, self.pocket)


# --- Ramps -----------------------------------------------------------------------------------------------------------

SMALLEST_ANGLE, LARGEST_ANGLE = math.radians(12.0), math.radians(45.0)
"""Range of angles at which a ramp leaves and joins [rad]; at larger angles it meets a junction like any street."""
_STRAIGHT_ON_ANGLE = math.radians(35.0)


def find_slips(crossing: Crossing, arms: Sequence[Arm]) -> Mapping[int, int]:
    """Returns the ramps that leave or join a street at a small angle at this crossing.

    A ramp that leaves lies just to the right of the arm in which its cars would otherwise continue; one that joins lies
    just to the left of the arm that it approaches, seen outwards.

    Returns:
        For the index of each such arm the index of the arm from which its cars come, or into which they continue.

    Raises:
        TownError: a ramp lies on the wrong side, or the street does not continue straight there.
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
    """Returns the arm on the other side of the crossing from the arm beside the ramp."""
    others = [arm for arm in arms if arm is not ramp and arm is not host and not arm.street.ramp]
    if ramp.outgoing:
        ways = [(abs(turn_between(arm, host)), arm.index) for arm in others if arm.incoming and host.outgoing]
        verb, way = "leaves", "nothing comes straight along that street"
    else:
        ways = [(abs(turn_between(host, arm)), arm.index) for arm in others if arm.outgoing and host.incoming]
        verb, way = "joins", "that street does not go on straight"
    if not ways or min(ways)[0] > _STRAIGHT_ON_ANGLE:
        ramp.street.entry.fail(
            f"the ramp {verb} {host.street.name!r} at {crossing.name!r}, but {way} on this side; ramps leave and"
            f" join on the {ramp.street.traffic} of a street that runs straight through the junction"
        )
    return min(ways)[1]


def _check_side(ramp: Arm, other: Arm, wrong: object, slips: Mapping[int, int]) -> None:
    """Rejects a ramp that is close to a street on the side of oncoming traffic."""
    if wrong and ramp.street.ramp and ramp.index not in slips and not other.street.ramp:
        verb, traffic = "leaves" if ramp.outgoing else "joins", ramp.street.traffic
        ramp.street.entry.fail(
            f"the ramp {verb} {other.street.name!r} on its {traffic.far_turn}; ramps are on the {traffic}, in driving"
            " direction: bend its"
            " first points to the other side"
        )
