"""Generated programmes for the traffic lights of maps that only give their positions."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from dorothie_gym.maps.driving_side import DrivingSide
from dorothie_gym.maps.model import Array, Junction, Lane, LaneLink, Signal, SignalKind
from dorothie_gym.maps.right_of_way import FACING, opposition, turn_into
from dorothie_gym.maps.town import LightPhase, LightProgramme
from dorothie_gym.support import portable_arrays as pn

THROUGH_GREEN = 20.0
"""Green of facing approaches [s]: ten cars per lane at a headway of 2 s (Highway Capacity Manual)."""

SHARED_GREEN = 45.0
"""Total green that more than two phases share approximately [s], to limit waiting times."""

SHORTEST_GREEN = 12.0
"""Shortest green of facing approaches with many phases [s]."""

LEFT_GREEN = 8.0
"""Green of left-turn lanes [s], in left-hand traffic of right-turn lanes: four cars."""

YELLOW, LONGEST_YELLOW = 3.0, 6.0
"""Shortest and longest yellow [s] (MUTCD 2009, section 4D.26)."""

YELLOW_REACTION, YELLOW_BRAKING = 1.0, 3.0
"""Reaction time [s] and braking [m/s^2] (ITE: 10 ft/s^2) assumed for the yellow time; traffic that would have to brake
harder passes the light."""

ALL_RED = 2.0
"""Clearance interval with red for all directions [s], at most 6 s (MUTCD 2009, section 4D.26)."""

LONE_RED = 15.0
"""Red phase of a junction with a single phase [s], for the approaches without lights."""

STAGGER = 7.0
"""Offset between the programmes of successive junctions [s]."""


@dataclass(frozen=True)
class _Movement:
    """Movement across a junction.

    Attributes:
        source: id of the incoming lane.
        speed: speed limit of the incoming lane [m/s].
        connector: lane across the junction.
        targets: ids of the lanes beyond it.
        far: whether it crosses oncoming traffic: a left turn, or in left-hand traffic a right turn.
    """

    source: int
    speed: float
    connector: Lane
    targets: frozenset[int]
    far: bool


@dataclass(frozen=True)
class _Head:
    """Lights that always show the same colour: ids, controlled movements, and the approaches of these.

    An approach is a road id and a direction.
    """

    signals: tuple[int, ...]
    movements: tuple[_Movement, ...]
    approaches: frozenset[tuple[int, bool]]

    @property
    def only_far(self) -> bool:
        return all(movement.far for movement in self.movements)

    def opposition(self, other: _Head) -> float:
        """Returns the deviation of two groups from facing each other [rad], rounded to 0.001 for stable ties."""
        return round(min(opposition(a.connector, b.connector) for a in self.movements for b in other.movements), 3)

    def may_go_with(self, other: _Head) -> bool:
        """Returns whether the two may be green together."""
        return all(_compatible(a, b) for a in self.movements for b in other.movements)


def yellow_time(speed: float) -> float:
    """Returns the yellow time for a speed limit [m/s], rounded up to half a second [s].

    Reaction time plus half the braking time to a stop: a car that can no longer stop passes the line (Institute of
    Transportation Engineers, Traffic Signal Timing Manual).
    """
    needed = YELLOW_REACTION + speed / (2.0 * YELLOW_BRAKING)
    return float(np.clip(np.ceil(2.0 * needed) / 2.0, YELLOW, LONGEST_YELLOW))


def derive_programmes(
    lanes: Sequence[Lane],
    links: Sequence[LaneLink],
    junctions: Sequence[Junction],
    signals: Sequence[Signal],
    traffic: DrivingSide = DrivingSide.RIGHT,
) -> tuple[LightProgramme, ...]:
    """Generates a programme for each junction with traffic lights.

    Approaches that face each other are green together, all others in sequence. Left turns yield to oncoming traffic
    (`RightOfWay.waits_for`); other movements never conflict. Lights of left-turn lanes, where there are others
    beside and facing them, have a protected phase just before the lights beside them, shared with facing left-turn
    lanes. Lights that share a lane show the same colour. Every light is green once in a cycle.

    Args:
        lanes: lanes of the town, `lanes[i].id == i`.
        links: links between them.
        junctions: junctions in the order of the offsets of their programmes.
        signals: signals; other kinds, and lights whose lanes do not lead into a junction, are ignored.
        traffic: side of the road on which vehicles drive; on the left, right turns take the place of left turns.

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
    return tuple(_programme(k, id_, _heads(id_, lit[id_], lanes, followers, traffic)) for k, id_ in enumerate(at))


def _junction(signal: Signal, lanes: Sequence[Lane], followers: dict[int, list[LaneLink]]) -> int | None:
    """Returns the junction of a light, or None: of those that its lanes lead into, the one nearest to the light.

    Some maps assign a light to both directions of a road, and thus to the junctions at both ends.
    """
    found = [
        (float(pn.hypot(*(lanes[lane].points[-1, :2] - signal.position[:2]))), lanes[link.target].junction_id)
        for lane in signal.lanes
        for link in followers.get(lane, ())
        if lanes[link.target].in_junction
    ]
    return min(found)[1] if found else None


def _heads(
    junction: int,
    signals: Sequence[Signal],
    lanes: Sequence[Lane],
    followers: dict[int, list[LaneLink]],
    traffic: DrivingSide,
) -> list[_Head]:
    """Returns the lights of a junction in order of their ids, grouped if they share a lane."""
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
                far=traffic.crosses_oncoming(turn_into(link, lanes)),
            )
            for link in entering
        )
        roads = frozenset((lanes[k.source].road_id, lanes[k.source].lane_id < 0) for k in entering)
        heads.append(_Head(tuple(sorted(ids)), movements, roads))
    return sorted(heads, key=lambda head: head.signals)


def _programme(order: int, junction: int, heads: Sequence[_Head]) -> LightProgramme:
    turning = [head for head in heads if _is_turn_lane(head, heads)]
    through = _together([head for head in heads if head not in turning])
    protected = _together(turning)
    green = float(np.clip(SHARED_GREEN / len(through), SHORTEST_GREEN, THROUGH_GREEN))
    phases: list[LightPhase] = []
    for group in through:
        roads = {road for head in group for road in head.approaches}
        leading = [turn for turn in protected if any(head.approaches & roads for head in turn)]
        protected = [turn for turn in protected if turn not in leading]
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
    """Returns whether lights of turns across oncoming traffic need a protected phase: others are beside and face them.

    The stem of a T, or a road that ends at a one-way street, has no oncoming traffic.
    """
    others = [other for other in heads if not other.only_far]
    beside = any(head.approaches & other.approaches for other in others)
    return head.only_far and beside and any(head.opposition(other) < FACING for other in others)


def _turn_of(heads: Iterable[_Head], green: float) -> tuple[LightPhase, LightPhase, LightPhase]:
    """Returns the phases of a group of lights: green, yellow, and red for all."""
    heads = tuple(heads)
    signals = tuple(sorted(signal for head in heads for signal in head.signals))
    fastest = max(movement.speed for head in heads for movement in head.movements)
    return (
        LightPhase(duration=green, green=signals),
        LightPhase(duration=yellow_time(fastest), yellow=signals),
        LightPhase(duration=ALL_RED),
    )


def _together(heads: Sequence[_Head]) -> list[list[_Head]]:
    """Divides lights into groups that may be green together, best facing pairs first."""

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
    """Returns whether two movements may be green together: parallel or opposite ones that do not meet.

    Turns across oncoming traffic may meet it because they yield. Crossing approaches are never green together.
    """
    if one.source == other.source:
        return True
    off = opposition(one.connector, other.connector)
    if off < FACING and (one.far or other.far):
        return True
    if FACING <= off <= np.pi - FACING:
        return False
    merge = not one.targets.isdisjoint(other.targets)
    return not merge and not _cross(one.connector.points[:, :2], other.connector.points[:, :2])


def _cross(one: Array, other: Array) -> bool:
    """Returns whether two lines (n, 2), (m, 2) cross or touch: some segments have each other's ends on both sides."""

    def sides(line: Array, points: Array) -> Array:
        """Returns the side of each segment on which each point lies, as a sign (segments, points)."""
        along = np.diff(line, axis=0)[:, None]
        to = points[None] - line[:-1, None]
        return np.sign(along[..., 0] * to[..., 1] - along[..., 1] * to[..., 0])

    of_one, of_other = sides(one, other), sides(other, one).T
    return bool(np.any((of_one[:, :-1] * of_one[:, 1:] <= 0.0) & (of_other[:-1] * of_other[1:] <= 0.0)))
