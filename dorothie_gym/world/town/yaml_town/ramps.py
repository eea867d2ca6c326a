"""Where ramps leave and join other streets at a small angle, and with which arm they exchange their cars."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from dorothie_gym.world.town.yaml_town.arms import Arm, neighbours, turn_between
from dorothie_gym.world.town.yaml_town.stretches import Crossing

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
