"""How much room a crossing takes: how far from its centre the lanes of each arm end, and the ways between them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from dorothie_gym.world.town.yaml_town.arms import Arm, neighbours
from dorothie_gym.world.town.yaml_town.geometry import Path, connect, wrap
from dorothie_gym.world.town.yaml_town.movements import STRAIGHT_BELOW, Movement
from dorothie_gym.world.town.yaml_town.ramps import LARGEST_ANGLE, SMALLEST_ANGLE
from dorothie_gym.world.town.yaml_town.stretches import Crossing

CORNER_RADIUS = 8.0
"""Radius that a turn from arm to arm has at least [m]; the car itself turns within 5 m."""
SLIP_RADIUS = 30.0
"""Radius that the way onto or off a ramp has at least [m]."""
BEND_RADIUS = 20.0
"""Radius that a way straight on has at least, where lanes do not lie opposite one another [m]."""
SMALLEST_TRIM = 11.0
"""Distance from the centre of a junction to the ends of its lanes, at least [m]."""
SMALLEST_RING_TRIM = 6.0
"""The same on the ring of a roundabout and where a street meets it [m]."""
CROSSWALK_ROOM = 4.0
"""Distance from the ends of lanes to the edge of the road beside them [m], so that a crosswalk lies between."""
GORE = 0.5
"""The same where two arms have no way between them, as at a ramp [m]."""
_STEP, _STEPS = 0.5, 160
_TOLERANCE = 1e-6
_ROUNDING = math.radians(0.5)


@dataclass(frozen=True, kw_only=True, eq=False)
class Way:
    """A movement and its course through the crossing."""

    movement: Movement
    path: Path

    @property
    def turn(self) -> float:
        """Change of heading from its start to its end [rad], positive to the right."""
        return wrap(self.path.end[2] - self.path.start[2])


@dataclass(frozen=True, kw_only=True)
class Room:
    """What a crossing takes.

    Attributes:
        trims: distance from its centre to the ends of the lanes, for each arm [m].
        ways: all ways through it.
    """

    trims: tuple[float, ...]
    ways: tuple[Way, ...]


def make_room(crossing: Crossing, arms: Sequence[Arm], movements: Sequence[Movement]) -> Room:
    """Trims the arms until roads do not overlap beside the crossing and no way through it is too tight.

    Raises:
        TownError: two arms are too close together, or a way stays too tight however far the arms are cut back.
    """
    _check_angles(crossing, arms, movements)
    least = SMALLEST_RING_TRIM if crossing.on_ring else SMALLEST_TRIM
    trims = [least] * len(arms)
    linked = {frozenset((m.source.index, m.target.index)) for m in movements}
    for arm, other, angle in neighbours(arms):
        gap = CROSSWALK_ROOM if frozenset((arm.index, other.index)) in linked else GORE
        mine, its = _edge_room(angle, arm.right, other.left), _edge_room(angle, other.left, arm.right)
        trims[arm.index] = max(trims[arm.index], mine + gap)
        trims[other.index] = max(trims[other.index], its + gap)
    for movement in movements:
        if not crossing.on_ring and (movement.slip or abs(movement.turn) >= STRAIGHT_BELOW):
            mine, its = _turn_room(movement)
            trims[movement.source.index] = max(trims[movement.source.index], mine)
            trims[movement.target.index] = max(trims[movement.target.index], its)
    ways = _ways(crossing, movements, trims)
    return Room(trims=tuple(trims), ways=ways)


def _check_angles(crossing: Crossing, arms: Sequence[Arm], movements: Sequence[Movement]) -> None:
    linked = {frozenset((m.source.index, m.target.index)) for m in movements}
    for arm, other, angle in neighbours(arms):
        least = LARGEST_ANGLE if frozenset((arm.index, other.index)) in linked else SMALLEST_ANGLE
        if angle < least - _ROUNDING:
            crossing.plan.entry.fail(
                f"streets {arm.street.name!r} and {other.street.name!r} leave it only {math.degrees(angle):.0f} degrees"
                f" apart; {math.degrees(least):.0f} are needed: move the next point of one of them"
            )


def _edge_room(angle: float, mine: float, its: float) -> float:
    """How far from the centre an arm with an edge `mine` beside its line is clear of one with the edge `its` [m]."""
    if angle >= math.pi:
        return 0.0
    if angle >= math.pi / 2.0:
        return its * math.sin(angle)
    return (its + mine * math.cos(angle)) / math.sin(angle)


def _turn_room(movement: Movement) -> tuple[float, float]:
    """Trims of the two arms of a movement so that one arc of the wanted radius fits between their lanes [m]."""
    radius = SLIP_RADIUS if movement.slip else CORNER_RADIUS
    angle = movement.target.leg.heading - movement.source.leg.heading
    a, b, c, s = movement.source_lane.offset, movement.target_lane.offset, math.cos(angle), math.sin(angle)
    tangent = radius * math.tan(abs(movement.turn) / 2.0)
    # Where the lines of the two lanes meet, measured from the centre along each arm.
    return (a * c - b) / s + tangent, (a - b * c) / s + tangent


def _wanted_radius(movement: Movement) -> float:
    if movement.slip:
        return SLIP_RADIUS
    on_ring = movement.source.on_ring and movement.target.on_ring
    return BEND_RADIUS if abs(movement.turn) < STRAIGHT_BELOW and not on_ring else CORNER_RADIUS


def _ways(crossing: Crossing, movements: Sequence[Movement], trims: list[float]) -> tuple[Way, ...]:
    """The courses of all movements; `trims` grow until none is too tight."""
    for _ in range(_STEPS):
        ways = [_way(movement, trims) for movement in movements]
        tight = [way for way in ways if way.path.smallest_radius < _wanted_radius(way.movement) - _TOLERANCE]
        if not tight:
            return tuple(ways)
        for index in {arm.index for way in tight for arm in (way.movement.source, way.movement.target)}:
            trims[index] += _STEP
    worst = min(tight, key=lambda way: way.path.smallest_radius)
    crossing.plan.entry.fail(
        f"the way from {worst.movement.source.street.name!r} to {worst.movement.target.street.name!r} is too tight:"
        f" radius {worst.path.smallest_radius:.1f} m, at least {_wanted_radius(worst.movement):g} m are needed; let"
        " them meet less sharply"
    )


def _way(movement: Movement, trims: Sequence[float]) -> Way:
    source, target = movement.source, movement.target
    entry = source.ending(movement.source_lane, trims[source.index])
    exit_ = target.beginning(movement.target_lane, trims[target.index])
    return Way(movement=movement, path=connect(entry, exit_))
