"""Layout of a YAML town: street segments, centre lines, crossings with their movements, and rings of roundabouts."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

from dorothie_gym.maps.yaml.arms import LARGEST_ANGLE, SMALLEST_ANGLE, Arm, arms_at, find_slips
from dorothie_gym.maps.yaml.centrelines import Centreline, centreline_of
from dorothie_gym.maps.yaml.clearance import check_clearance, check_crossings
from dorothie_gym.maps.yaml.geometry import CurveSegment, line
from dorothie_gym.maps.yaml.movements import MovementPath, make_room, movements_at, with_pockets
from dorothie_gym.maps.yaml.plan import JunctionPlan, StreetPlan, TownPlan
from dorothie_gym.maps.yaml.segments import Crossing, CrossSection, StreetRun, StreetSegment, segment_of, split
from dorothie_gym.support import portable_math as pm

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
        segments: segments between the crossings.
    """

    street: StreetPlan
    crossings: tuple[Crossing, ...]
    ends: tuple[tuple[int, bool], ...]
    segments: tuple[StreetSegment, ...]


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
        traffic=runs[ends[0][0]].street.traffic,
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
        if pm.dist(junction.centre, run.towards(end[1])) < plan.radius + 1.0:
            run.street.entry.fail(
                f"its point next to {junction.name!r} lies inside of that roundabout's ring; move it further out"
            )
        centre = tuple(c + plan.radius * f(bearing) for c, f in zip(junction.centre, (pm.cos, pm.sin), strict=True))
        crossings.append(
            Crossing(
                id=crossing_id + place,
                name=f"{junction.name}/{place + 1}",
                centre=(centre[0], centre[1]),
                height=junction.height,
                plan=junction,
            )
        )
    segments = tuple(
        _ring_stretch(street, crossings[k], crossings[k - 1], bearings[ends[k]], bearings[ends[k - 1]], plan.radius)
        for k in range(len(ends))
    )
    return Ring(street=street, crossings=tuple(crossings), ends=tuple(ends), segments=segments)


def _ring_stretch(
    street: StreetPlan, start: Crossing, end: Crossing, from_: float, to: float, radius: float
) -> StreetSegment:
    """Returns the segment of the ring from one bearing [rad] back to a smaller one, or the full circle."""
    angle = (from_ - to) % (2.0 * math.pi) if start is not end else 2.0 * math.pi
    arc = CurveSegment(*start.centre, from_ - math.pi / 2.0, radius * angle, -1.0 / radius)
    return StreetSegment(
        street=street,
        section=CrossSection(street),
        start=start,
        end=end,
        corners=(start.centre, end.centre),
        heights=(start.height, end.height),
        arc=arc,
    )


# --- Layout -----------------------------------------------------------------------------------------------------------

POCKET_LENGTH, SHORTEST_POCKET = 40.0, 25.0
"""Length of left-turn lanes, and smallest length on short blocks [m]."""
_POCKET_REST = 10.0
"""Shortest length of street before a left-turn lane opens [m]."""
_POCKETS_APART = 4.0
"""Distance between two left-turn lanes that share a narrow median [m]."""


@dataclass(frozen=True, kw_only=True)
class Layout:
    """Lines of a town.

    Attributes:
        plan: plan of the town.
        streets: streets of the plan, then the rings of roundabouts.
        crossings: junctions in the order of the file, then crossings on rings; ids may have gaps.
        segments: all segments, those on rings last.
        centrelines: line of each segment, from the edge of its first crossing to that of its second.
        arms: arms in order of heading, by crossing id.
        ways: paths of all movements, by crossing id.
        pockets: length of turn lanes in medians [m], by index of the segment and whether they lead to its start.
        hosts: id of the street that each ramp leaves or else joins, by id of the ramp.
    """

    plan: TownPlan
    streets: tuple[StreetPlan, ...]
    crossings: tuple[Crossing, ...]
    segments: tuple[StreetSegment, ...]
    centrelines: tuple[Centreline, ...]
    arms: Mapping[int, tuple[Arm, ...]]
    ways: Mapping[int, tuple[MovementPath, ...]]
    pockets: Mapping[tuple[int, bool], float]
    hosts: Mapping[int, int]

    @property
    def named_streets(self) -> tuple[StreetPlan, ...]:
        """Streets of the town: all but ramps, which belong to other streets."""
        return tuple(street for street in self.streets if street.id not in self.hosts)

    @cached_property
    def numbers(self) -> Mapping[int, int]:
        """Index of each street in the town, by its id in the plan."""
        own = {street.id: k for k, street in enumerate(self.named_streets)}
        return own | {ramp: own[host] for ramp, host in self.hosts.items()}

    def crossings_of(self, junction: str) -> list[Crossing]:
        """Returns the crossing of a junction, or all crossings on the ring of a roundabout."""
        return [crossing for crossing in self.crossings if crossing.plan.name == junction]


def lay_out(plan: TownPlan) -> Layout:
    """Computes the layout of a plan.

    Raises:
        TownError: streets or junctions do not fit together.
    """
    streets, crossings, segments = _graph(plan)
    ends: dict[int, list[tuple[int, bool]]] = {crossing.id: [] for crossing in crossings}
    for k, segment in enumerate(segments):
        ends[segment.start.id].append((k, True))
        ends[segment.end.id].append((k, False))
    arms: dict[int, tuple[Arm, ...]] = {}
    ways: dict[int, tuple[MovementPath, ...]] = {}
    trims: dict[tuple[int, bool], float] = {}
    for crossing in crossings:
        here = with_pockets(crossing, arms_at(crossing, segments, ends[crossing.id]), segments)
        room = make_room(crossing, here, movements_at(crossing, here))
        arms[crossing.id], ways[crossing.id] = here, room.ways
        trims.update({(arm.segment, arm.at_start): trim for arm, trim in zip(here, room.trims, strict=True)})
    hosts = _hosts(plan, crossings, arms)
    check_crossings(crossings, arms, trims)
    centrelines = tuple(centreline_of(segment, trims[k, True], trims[k, False]) for k, segment in enumerate(segments))
    layout = Layout(
        plan=plan,
        streets=streets,
        crossings=crossings,
        segments=segments,
        centrelines=centrelines,
        arms=arms,
        ways=ways,
        pockets=_pockets(segments, centrelines, arms),
        hosts=hosts,
    )
    check_clearance(crossings, segments, centrelines, ways)
    return layout


def _graph(plan: TownPlan) -> tuple[tuple[StreetPlan, ...], tuple[Crossing, ...], tuple[StreetSegment, ...]]:
    """Returns streets, crossings and segments, with roundabouts."""
    runs = split(plan)
    plain = {
        name: Crossing(id=j.id, name=name, centre=j.centre, height=j.height, plan=j)
        for name, j in plan.junctions.items()
        if j.roundabout is None
    }
    crossings, streets, ring_segments = list(plain.values()), list(plan.streets), list[StreetSegment]()
    meeting: dict[tuple[int, bool], Crossing] = {}
    next_id = 1 + max(junction.id for junction in plan.junctions.values())
    for junction in plan.junctions.values():
        if junction.roundabout is not None:
            ring = lay_ring(junction, runs, street_id=len(streets), crossing_id=next_id)
            streets.append(ring.street)
            crossings.extend(ring.crossings)
            ring_segments.extend(ring.segments)
            meeting.update(zip(ring.ends, ring.crossings, strict=True))
            next_id += len(ring.crossings)
    segments = [
        segment_of(run, meeting.get((k, True)) or plain[run.start.name], meeting.get((k, False)) or plain[run.end.name])
        for k, run in enumerate(runs)
    ]
    return tuple(streets), tuple(crossings), (*segments, *ring_segments)


def _hosts(plan: TownPlan, crossings: Sequence[Crossing], arms: Mapping[int, tuple[Arm, ...]]) -> dict[int, int]:
    """Returns the streets that ramps belong to; rejects ramps that meet every street at a large angle."""
    left, joined = dict[int, int](), dict[int, int]()
    for crossing in crossings:
        here = arms[crossing.id]
        for index, partner in find_slips(crossing, here).items():
            hosts = left if here[index].outgoing else joined
            hosts[here[index].street.id] = here[partner].street.id
    hosts = joined | left
    for street in plan.streets:
        if street.ramp and street.id not in hosts:
            street.entry.fail(
                "it is a ramp, but neither leaves nor joins a street at a small angle (from"
                f" {math.degrees(SMALLEST_ANGLE):.0f} to {math.degrees(LARGEST_ANGLE):.0f} degrees): put a point beside"
                " that street next to its junction, or remove `ramp`"
            )
    return hosts


def _pockets(
    segments: Sequence[StreetSegment], centrelines: Sequence[Centreline], arms: Mapping[int, tuple[Arm, ...]]
) -> dict[tuple[int, bool], float]:
    """Returns the lengths of left-turn lanes; two in one narrow median must not overlap."""
    wanted = {(arm.segment, arm.at_start): arm for row in arms.values() for arm in row if arm.pocket is not None}
    lengths = {}
    for (k, at_start), arm in wanted.items():
        street, length = arm.street, centrelines[k].path.length
        shared = (k, not at_start) in wanted and street.median < 2.0 * street.width
        room = min(length - _POCKET_REST, (length - _POCKETS_APART) / 2.0 if shared else length)
        if room < SHORTEST_POCKET:
            needed = 2.0 * SHORTEST_POCKET + _POCKETS_APART if shared else SHORTEST_POCKET + _POCKET_REST
            street.entry.fail(
                f"{segments[k].label()} there is no room for the turn lane before"
                f" {segments[k].crossing(at_start).name!r}: {length:.1f} m of street lie between the junctions,"
                f" {needed:.0f} m are needed; move them apart or remove the turn lane"
            )
        lengths[k, at_start] = min(POCKET_LENGTH, room)
    return lengths
