"""Programmes for the traffic lights of a map that says where lights stand, but not how they change."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from dorothie_gym.maps.model import Array, Junction, Lane, LaneLink, Signal, SignalKind
from dorothie_gym.maps.right_of_way import FACING, LEFTWARD, opposition, turn_into
from dorothie_gym.maps.traffic_lights import LightPhase, LightProgramme

THROUGH_GREEN = 20.0
"""Green of facing approaches [s]: ten cars a lane, 2 s from car to car (Highway Capacity Manual)."""

SHARED_GREEN = 45.0
"""Where more than two phases take turns they share about this much green [s], so that nobody waits for minutes."""

SHORTEST_GREEN = 12.0
"""Green of facing approaches where very many phases take turns [s]."""

LEFT_GREEN = 8.0
"""Green of lanes that only turn left [s]: four cars."""

YELLOW, LONGEST_YELLOW = 3.0, 6.0
"""Yellow after a green [s], at least and at most (MUTCD 2009, section 4D.26)."""

YELLOW_REACTION, YELLOW_BRAKING = 1.0, 3.0
"""Who drives on at yellow has this long to react [s] and would have to brake this hard [m/s^2]."""

ALL_RED = 2.0
"""Red for everybody before the next green [s], so that the junction clears: at most 6 s (MUTCD 2009, section 4D.26)."""

LONE_RED = 15.0
"""Red of lights that have none to take turns with [s]: that is when the approaches without lights get through."""

STAGGER = 7.0
"""A junction's lights begin this much later than those of the one before it [s], lest all change at once."""


@dataclass(frozen=True)
class _Movement:
    """A way across a junction.

    Attributes:
        source: the lane it comes from.
        speed: limit there [m/s].
        connector: the lane across.
        targets: where that leads.
        left: whether it turns left.
    """

    source: int
    speed: float
    connector: Lane
    targets: frozenset[int]
    left: bool


@dataclass(frozen=True)
class _Head:
    """Lights that always show the same: their ids, the movements that they rule, and the approaches of those.

    An approach is a road and its direction.
    """

    signals: tuple[int, ...]
    movements: tuple[_Movement, ...]
    approaches: frozenset[tuple[int, bool]]

    @property
    def only_left(self) -> bool:
        return all(movement.left for movement in self.movements)

    def opposition(self, other: _Head) -> float:
        """How far the two are from facing each other [rad], to a thousandth, so that equals are equal."""
        return round(min(opposition(a.connector, b.connector) for a in self.movements for b in other.movements), 3)

    def may_go_with(self, other: _Head) -> bool:
        """Whether the two may be green together."""
        return all(_compatible(a, b) for a in self.movements for b in other.movements)


def yellow_time(speed: float) -> float:
    """Yellow for an approach with a speed limit [m/s], to half a second [s].

    So long that who can no longer stop is past the line: time to react and half of that to brake to a stand (Institute
    of Transportation Engineers, Traffic Signal Timing Manual).
    """
    needed = YELLOW_REACTION + speed / (2.0 * YELLOW_BRAKING)
    return float(np.clip(np.ceil(2.0 * needed) / 2.0, YELLOW, LONGEST_YELLOW))


def derive_programmes(
    lanes: Sequence[Lane], links: Sequence[LaneLink], junctions: Sequence[Junction], signals: Sequence[Signal]
) -> tuple[LightProgramme, ...]:
    """A programme for every junction that has traffic lights at its approaches.

    Approaches that face each other are green together, all others one after the other. Who turns left there has to wait
    for who comes towards them (`RightOfWay.waits_for`); other movements never meet on green. Lights of lanes that only
    turn left, where there are others beside and facing them, have a phase of their own just before those beside them,
    shared with such lanes that face them. Lights that share a lane show the same. Every light is green once in a cycle.

    Args:
        lanes: lanes of the town, `lanes[i].id == i`.
        links: links between them.
        junctions: their order staggers the programmes.
        signals: those of other kinds, and lights whose lanes do not lead into a junction, are left out.

    Returns:
        Programmes in the order of the junctions.
    """
    followers: defaultdict[int, list[LaneLink]] = defaultdict(list)
    for link in links:
        if not link.type.is_lane_change:
            followers[link.source].append(link)
    lit: defaultdict[int, list[Signal]] = defaultdict(list)
    for signal in signals:
        junction = _junction(signal, lanes, followers) if signal.kind is SignalKind.TRAFFIC_LIGHT else None
        if junction is not None:
            lit[junction].append(signal)
    at = [junction.id for junction in junctions if junction.id in lit]
    return tuple(_programme(k, id_, _heads(id_, lit[id_], lanes, followers)) for k, id_ in enumerate(at))


def _junction(signal: Signal, lanes: Sequence[Lane], followers: dict[int, list[LaneLink]]) -> int | None:
    """Id of the junction that a light belongs to: the one that begins nearest to it of those its lanes lead into.

    A light that a map gives to both directions of a road would rule the junction at the road's other end, too.
    """
    found = [
        (float(np.hypot(*(lanes[lane].points[-1, :2] - signal.position[:2]))), lanes[link.target].junction_id)
        for lane in signal.lanes
        for link in followers.get(lane, ())
        if lanes[link.target].in_junction
    ]
    return min(found)[1] if found else None


def _heads(
    junction: int, signals: Sequence[Signal], lanes: Sequence[Lane], followers: dict[int, list[LaneLink]]
) -> list[_Head]:
    """Lights of a junction, those that share a lane joined, in order of their ids."""
    sharing: list[tuple[list[int], set[int]]] = []  # ids of lights and their lanes
    for signal in signals:
        ids, ruled = [signal.id], set(signal.lanes)
        apart = []
        for group in sharing:
            if ruled.isdisjoint(group[1]):
                apart.append(group)
            else:
                ids, ruled = group[0] + ids, group[1] | ruled
        sharing = [*apart, (ids, ruled)]
    heads = []
    for ids, ruled in sharing:
        entering = [k for lane in sorted(ruled) for k in followers[lane] if lanes[k.target].junction_id == junction]
        movements = tuple(
            _Movement(
                source=link.source,
                speed=lanes[link.source].speed_limit,
                connector=lanes[link.target],
                targets=frozenset(on.target for on in followers[link.target]),
                left=turn_into(link, lanes) in LEFTWARD,
            )
            for link in entering
        )
        roads = frozenset((lanes[k.source].road_id, lanes[k.source].lane_id < 0) for k in entering)
        heads.append(_Head(tuple(sorted(ids)), movements, roads))
    return sorted(heads, key=lambda head: head.signals)


def _programme(order: int, junction: int, heads: Sequence[_Head]) -> LightProgramme:
    turning = [head for head in heads if _is_turn_lane(head, heads)]
    through = _together([head for head in heads if head not in turning])
    left = _together(turning)
    green = float(np.clip(SHARED_GREEN / len(through), SHORTEST_GREEN, THROUGH_GREEN))
    phases: list[LightPhase] = []
    for group in through:
        roads = {road for head in group for road in head.approaches}
        leading = [turn for turn in left if any(head.approaches & roads for head in turn)]
        left = [turn for turn in left if turn not in leading]
        for turn in leading:
            phases.extend(_turn_of(turn, LEFT_GREEN))
        phases.extend(_turn_of(group, green))
    if len(phases) == len(_turn_of(heads, green)):
        phases.append(LightPhase(duration=LONE_RED))
    cycle = sum(phase.duration for phase in phases)
    return LightProgramme(
        junction_id=junction,
        signals=tuple(sorted(signal for head in heads for signal in head.signals)),
        phases=tuple(phases),
        offset=order * STAGGER % cycle,
    )


def _is_turn_lane(head: _Head, heads: Sequence[_Head]) -> bool:
    """Whether lights that let lanes turn left need a green of their own: there are others beside them and facing them.

    The stem of a T, or a road that ends at a one-way street, has nobody to be protected from.
    """
    others = [other for other in heads if not other.only_left]
    beside = any(head.approaches & other.approaches for other in others)
    return head.only_left and beside and any(head.opposition(other) < FACING for other in others)


def _turn_of(heads: Iterable[_Head], green: float) -> tuple[LightPhase, LightPhase, LightPhase]:
    """What happens when it is the turn of some lights: green, yellow, and red for all."""
    heads = tuple(heads)
    signals = tuple(sorted(signal for head in heads for signal in head.signals))
    fastest = max(movement.speed for head in heads for movement in head.movements)
    return (
        LightPhase(duration=green, green=signals),
        LightPhase(duration=yellow_time(fastest), yellow=signals),
        LightPhase(duration=ALL_RED),
    )


def _together(heads: Sequence[_Head]) -> list[list[_Head]]:
    """Divides lights into groups that may be green together, those that face each other best first."""

    def best(head: _Head) -> float:
        return min((head.opposition(other) for other in heads if other is not head), default=np.pi)

    groups, rest = [], sorted(heads, key=lambda head: (best(head), head.signals))
    while rest:
        group = [first := rest.pop(0)]
        for head in sorted(rest, key=lambda other: (first.opposition(other), other.signals)):
            if all(head.may_go_with(other) for other in group):
                group.append(head)
                rest.remove(head)
        groups.append(group)
    return groups


def _compatible(one: _Movement, other: _Movement) -> bool:
    """Whether two movements may have green together: those side by side, or face to face, unless they meet.

    Only a left turn may meet who comes towards it, for it waits. Who comes from aside never goes at the same time.
    """
    if one.source == other.source:
        return True
    off = opposition(one.connector, other.connector)
    if off < FACING and (one.left or other.left):
        return True
    if FACING <= off <= np.pi - FACING:
        return False
    merge = not one.targets.isdisjoint(other.targets)
    return not merge and not _cross(one.connector.points[:, :2], other.connector.points[:, :2])


def _cross(one: Array, other: Array) -> bool:
    """Whether two lines (n, 2), (m, 2) cross or touch: some segment of each has the other's ends on both its sides."""

    def sides(line: Array, points: Array) -> Array:
        """On which side of each segment of a line each point lies: the sign of the result (segments, points)."""
        along = np.diff(line, axis=0)[:, None]
        to = points[None] - line[:-1, None]
        return np.sign(along[..., 0] * to[..., 1] - along[..., 1] * to[..., 0])

    of_one, of_other = sides(one, other), sides(other, one).T
    return bool(np.any((of_one[:, :-1] * of_one[:, 1:] <= 0.0) & (of_other[:-1] * of_other[1:] <= 0.0)))
