"""Movements through crossings: which lane leads into which, the room for them, and their paths."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from dorothie_gym.maps.model import LinkType
from dorothie_gym.maps.yaml.arms import (
    LARGEST_ANGLE,
    POCKET,
    SMALLEST_ANGLE,
    Arm,
    LaneEnd,
    find_slips,
    neighbours,
    turn_between,
)
from dorothie_gym.maps.yaml.geometry import Curve, connect
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.portable_math import wrap_radians

if TYPE_CHECKING:
    from dorothie_gym.maps.yaml.segments import Crossing, StreetSegment

STRAIGHT_BELOW = math.radians(35.0)
"""Largest change of heading of a straight movement [rad]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Movement:
    """Movement from an incoming lane to an outgoing lane; `slip` marks ramps that leave or join."""

    source: Arm
    source_lane: LaneEnd
    target: Arm
    target_lane: LaneEnd
    turn: float  # change of heading from arm to arm [rad], positive to the right
    slip: bool


def kinds_of(turns: Mapping[int, float]) -> dict[int, LinkType]:
    """Returns the turn types of movements from one lane, by change of heading [rad], positive to the right.

    Of several that turn by less than 35 degrees only the straightest is called straight.
    """
    straight = [key for key in turns if abs(turns[key]) < STRAIGHT_BELOW]
    straightest = min(straight, key=lambda key: (abs(turns[key]), key)) if straight else None
    kinds = {}
    for key, turn in turns.items():
        if key == straightest:
            kinds[key] = LinkType.STRAIGHT
        else:
            aside = turn if straightest is None or key not in straight else turn - turns[straightest]
            kinds[key] = LinkType.RIGHT if aside > 0.0 else LinkType.LEFT
    return kinds


def with_pockets(crossing: Crossing, arms: tuple[Arm, ...], segments: Sequence[StreetSegment]) -> tuple[Arm, ...]:
    """Adds left-turn lanes to arms whose street requests them, if there is a left turn.

    Raises:
        TownError: a street with a left-turn lane has no left turn.
    """
    slips = find_slips(crossing, arms)
    wanted = [arm for arm in arms if crossing.plan.name in arm.street.turn_lanes]
    result = []
    for arm in arms:
        if arm in wanted and LinkType.LEFT in _kinds(arms, arm, slips).values() and arm.incoming:
            # between the centre of the median and the incoming lanes, which are on the left seen outwards
            pocket = LaneEnd(POCKET, -segments[arm.segment].section.pocket)
            arm = replace(arm, incoming=(*arm.incoming, pocket))
        result.append(arm)
    for street in {arm.street.id: arm.street for arm in wanted}.values():
        if not any(arm.pocket for arm in result if arm.street is street):
            street.entry.fail(
                f"it has a turn lane before {crossing.name!r}, where nothing goes {street.traffic.far_turn}; remove it"
            )
    return tuple(result)


def movements_at(crossing: Crossing, arms: tuple[Arm, ...]) -> tuple[Movement, ...]:
    """Returns all movements through a crossing; every lane has a continuation and every arm can be reached.

    Raises:
        TownError: an incoming arm has no continuation, or an outgoing arm cannot be reached.
    """
    slips = find_slips(crossing, arms)
    found = [movement for arm in arms if arm.incoming for movement in _movements(arms, arm, slips)]
    for arm in arms:
        if arm.incoming and not any(movement.source is arm for movement in found):
            arm.street.entry.fail(
                f"it leads to {crossing.name!r} and no street continues from there: its lanes would lead nowhere; turn"
                " a one-way street round or make it two-way, or let this one only leave that junction (one_way)"
            )
        if arm.outgoing and not any(movement.target is arm for movement in found):
            arm.street.entry.fail(
                f"it leaves {crossing.name!r} and there is no way into it: its lanes cannot be reached; turn a one-way"
                " street round or make it two-way, or let this one only lead to that junction (one_way)"
            )
    return tuple(found)


def _targets(arms: Sequence[Arm], source: Arm, slips: Mapping[int, int]) -> list[Arm]:
    """Returns the arms that can be entered from an arm."""
    open_ = [arm for arm in arms if arm is not source and arm.outgoing]
    if source.index in slips:
        return [arm for arm in open_ if arm.index == slips[source.index]]
    return [arm for arm in open_ if slips.get(arm.index, source.index) == source.index]


def _kinds(arms: Sequence[Arm], source: Arm, slips: Mapping[int, int]) -> dict[int, LinkType]:
    """Returns the turn types into the arms that can be entered, by index."""
    return kinds_of({arm.index: turn_between(source, arm) for arm in _targets(arms, source, slips)})


def _movements(arms: Sequence[Arm], source: Arm, slips: Mapping[int, int]) -> Iterator[Movement]:
    """Yields the movements from an arm: first by the rules, then for lanes without a movement."""
    kinds = _kinds(arms, source, slips)
    served = set[int]()
    for index, kind in kinds.items():
        slip = source.index in slips or index in slips
        for lane, target in _lanes(source, arms[index], kind, slip):
            served.add(lane.number)
            yield _movement(source, lane, arms[index], target, slip)
    for place, lane in enumerate(source.through):
        if lane.number not in served and kinds:
            index, target = _spare(arms, source, place, kinds)
            yield _movement(source, lane, arms[index], target, source.index in slips)


def _movement(source: Arm, lane: LaneEnd, target: Arm, target_lane: LaneEnd, slip: bool) -> Movement:
    return Movement(
        source=source,
        source_lane=lane,
        target=target,
        target_lane=target_lane,
        turn=turn_between(source, target),
        slip=slip,
    )


def _lanes(source: Arm, target: Arm, kind: LinkType, slip: bool) -> list[tuple[LaneEnd, LaneEnd]]:
    """Returns the lane pairs of a movement: outermost to outermost to the right, innermost to innermost to the left.

    Straight on, on ramps, and onto and off a ring lanes continue side by side, counted from the kerb.
    """
    if kind is LinkType.STRAIGHT or slip or source.on_ring != target.on_ring:
        return list(zip(source.through, target.outgoing, strict=False))
    if kind is LinkType.RIGHT:
        return [(source.through[0], target.outgoing[0])]
    return [(source.pocket or source.through[-1], target.outgoing[-1])]


def _spare(arms: Sequence[Arm], source: Arm, place: int, kinds: Mapping[int, LinkType]) -> tuple[int, LaneEnd]:
    """Returns the target of a lane without a movement: straight on if possible, else beside the lane that turns.

    Args:
        arms: arms of the crossing.
        source: incoming arm.
        place: index of the lane among its through lanes, counted from the kerb.
        kinds: turn types by index of the target arm.
    """
    count = len(source.through)
    sides = [LinkType.RIGHT, LinkType.LEFT] if place + 0.5 < count / 2.0 else [LinkType.LEFT, LinkType.RIGHT]
    options = []
    for index, kind in kinds.items():
        lanes = arms[index].outgoing
        if kind is LinkType.LEFT:
            lanes, beside = lanes[::-1], count - 1 - place + (source.pocket is not None)
        else:
            beside = place
        # a target lane of its own is better than a merge, but a movement must not cross those ahead
        rank = (kind is not LinkType.STRAIGHT, beside >= len(lanes), kind is not sides[0], index)
        options.append((rank, index, lanes[min(beside, len(lanes) - 1)]))
    _, index, lane = min(options)
    return index, lane


# --- Room and paths --------------------------------------------------------------------------------------------------

CORNER_RADIUS = 8.0
"""Smallest radius of a turn between arms [m]; the car itself turns within 5 m."""
SLIP_RADIUS = 30.0
"""Smallest radius of a movement onto or off a ramp [m]."""
BEND_RADIUS = 20.0
"""Smallest radius of a straight movement between lanes that are not opposite each other [m]."""
SMALLEST_TRIM = 11.0
"""Smallest distance from the centre of a junction to the ends of its lanes [m]."""
SMALLEST_RING_TRIM = 6.0
"""The same on the ring of a roundabout and at the streets that meet it [m]."""
CROSSWALK_ROOM = 4.0
"""Distance from the ends of lanes to the edge of the adjacent road [m], with room for a crosswalk."""
GORE = 0.5
"""The same between arms without a movement between them, as at a ramp [m]."""
_STEP, _STEPS = 0.5, 160
_TOLERANCE = 1e-6
_ROUNDING = math.radians(0.5)


@dataclass(frozen=True, kw_only=True, eq=False)
class MovementPath:
    """Movement with its path through the crossing."""

    movement: Movement
    path: Curve

    @property
    def turn(self) -> float:
        """Change of heading from its start to its end [rad], positive to the right."""
        return wrap_radians(self.path.end[2] - self.path.start[2])


@dataclass(frozen=True, kw_only=True)
class CrossingRoom:
    """Room of a crossing.

    Attributes:
        trims: distance from its centre to the ends of the lanes of each arm [m].
        ways: paths of all movements.
    """

    trims: tuple[float, ...]
    ways: tuple[MovementPath, ...]


def make_room(crossing: Crossing, arms: Sequence[Arm], movements: Sequence[Movement]) -> CrossingRoom:
    """Trims the arms until roads do not overlap beside the crossing and no path is too tight.

    Raises:
        TownError: two arms are too close to each other, or a path remains too tight.
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
    return CrossingRoom(trims=tuple(trims), ways=ways)


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
    """Returns the distance from the centre at which an arm with edge `mine` is clear of one with edge `its` [m]."""
    if angle >= math.pi:
        return 0.0
    if angle >= math.pi / 2.0:
        return its * pm.sin(angle)
    return (its + mine * pm.cos(angle)) / pm.sin(angle)


def _turn_room(movement: Movement) -> tuple[float, float]:
    """Returns the trims of both arms for which an arc of the wanted radius fits between the two lanes [m]."""
    radius = SLIP_RADIUS if movement.slip else CORNER_RADIUS
    angle = movement.target.leg.heading - movement.source.leg.heading
    a, b, c, s = movement.source_lane.offset, movement.target_lane.offset, pm.cos(angle), pm.sin(angle)
    tangent = radius * pm.tan(abs(movement.turn) / 2.0)
    # intersection of both lanes, measured from the centre along each arm
    return (a * c - b) / s + tangent, (a - b * c) / s + tangent


def _wanted_radius(movement: Movement) -> float:
    if movement.slip:
        return SLIP_RADIUS
    on_ring = movement.source.on_ring and movement.target.on_ring
    return BEND_RADIUS if abs(movement.turn) < STRAIGHT_BELOW and not on_ring else CORNER_RADIUS


def _ways(crossing: Crossing, movements: Sequence[Movement], trims: list[float]) -> tuple[MovementPath, ...]:
    """Returns the paths of all movements; increases `trims` until none is too tight."""
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


def _way(movement: Movement, trims: Sequence[float]) -> MovementPath:
    source, target = movement.source, movement.target
    entry = source.ending(movement.source_lane, trims[source.index])
    exit_ = target.beginning(movement.target_lane, trims[target.index])
    return MovementPath(movement=movement, path=connect(entry, exit_))
