"""Layout of a YAML town: streets divided at crossings, bends rounded, crossings given room and movements."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

from dorothie_gym.maps.yaml.arms import LARGEST_ANGLE, SMALLEST_ANGLE, Arm, arms_at, find_slips
from dorothie_gym.maps.yaml.clearance import check_clearance, check_crossings
from dorothie_gym.maps.yaml.courses import Course, course_of
from dorothie_gym.maps.yaml.movements import MovementPath, make_room, movements_at, with_pockets
from dorothie_gym.maps.yaml.plan import StreetPlan, TownPlan
from dorothie_gym.maps.yaml.roundabout import lay_ring
from dorothie_gym.maps.yaml.stretches import Crossing, Stretch, split, stretch_of

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
        stretches: all stretches, those on rings last.
        courses: line of each stretch, from the edge of its first crossing to that of its second.
        arms: arms in order of heading, by crossing id.
        ways: paths of all movements, by crossing id.
        pockets: length of left-turn lanes [m], by index of the stretch and whether they lead to its start.
        hosts: id of the street that each ramp leaves or else joins, by id of the ramp.
    """

    plan: TownPlan
    streets: tuple[StreetPlan, ...]
    crossings: tuple[Crossing, ...]
    stretches: tuple[Stretch, ...]
    courses: tuple[Course, ...]
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
        TownError: streets or junctions do not fit.
    """
    streets, crossings, stretches = _graph(plan)
    ends: dict[int, list[tuple[int, bool]]] = {crossing.id: [] for crossing in crossings}
    for k, stretch in enumerate(stretches):
        ends[stretch.start.id].append((k, True))
        ends[stretch.end.id].append((k, False))
    arms: dict[int, tuple[Arm, ...]] = {}
    ways: dict[int, tuple[MovementPath, ...]] = {}
    trims: dict[tuple[int, bool], float] = {}
    for crossing in crossings:
        here = with_pockets(crossing, arms_at(crossing, stretches, ends[crossing.id]), stretches)
        room = make_room(crossing, here, movements_at(crossing, here))
        arms[crossing.id], ways[crossing.id] = here, room.ways
        trims.update({(arm.stretch, arm.at_start): trim for arm, trim in zip(here, room.trims, strict=True)})
    hosts = _hosts(plan, crossings, arms)
    check_crossings(crossings, arms, trims)
    courses = tuple(course_of(stretch, trims[k, True], trims[k, False]) for k, stretch in enumerate(stretches))
    layout = Layout(
        plan=plan,
        streets=streets,
        crossings=crossings,
        stretches=stretches,
        courses=courses,
        arms=arms,
        ways=ways,
        pockets=_pockets(stretches, courses, arms),
        hosts=hosts,
    )
    check_clearance(crossings, stretches, courses, ways)
    return layout


def _graph(plan: TownPlan) -> tuple[tuple[StreetPlan, ...], tuple[Crossing, ...], tuple[Stretch, ...]]:
    """Returns streets, crossings and stretches, with roundabouts."""
    runs = split(plan)
    plain = {
        name: Crossing(id=j.id, name=name, centre=j.centre, height=j.height, plan=j)
        for name, j in plan.junctions.items()
        if j.roundabout is None
    }
    crossings, streets, ring_stretches = list(plain.values()), list(plan.streets), list[Stretch]()
    meeting: dict[tuple[int, bool], Crossing] = {}
    next_id = 1 + max(junction.id for junction in plan.junctions.values())
    for junction in plan.junctions.values():
        if junction.roundabout is not None:
            ring = lay_ring(junction, runs, street_id=len(streets), crossing_id=next_id)
            streets.append(ring.street)
            crossings.extend(ring.crossings)
            ring_stretches.extend(ring.stretches)
            meeting.update(zip(ring.ends, ring.crossings, strict=True))
            next_id += len(ring.crossings)
    stretches = [
        stretch_of(run, meeting.get((k, True)) or plain[run.start.name], meeting.get((k, False)) or plain[run.end.name])
        for k, run in enumerate(runs)
    ]
    return tuple(streets), tuple(crossings), (*stretches, *ring_stretches)


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
    stretches: Sequence[Stretch], courses: Sequence[Course], arms: Mapping[int, tuple[Arm, ...]]
) -> dict[tuple[int, bool], float]:
    """Returns the lengths of left-turn lanes; two in one narrow median must not overlap."""
    wanted = {(arm.stretch, arm.at_start): arm for row in arms.values() for arm in row if arm.pocket is not None}
    lengths = {}
    for (k, at_start), arm in wanted.items():
        street, length = arm.street, courses[k].path.length
        shared = (k, not at_start) in wanted and street.median < 2.0 * street.width
        room = min(length - _POCKET_REST, (length - _POCKETS_APART) / 2.0 if shared else length)
        if room < SHORTEST_POCKET:
            needed = 2.0 * SHORTEST_POCKET + _POCKETS_APART if shared else SHORTEST_POCKET + _POCKET_REST
            street.entry.fail(
                f"{stretches[k].label()} there is no room for the turn lane before"
                f" {stretches[k].crossing(at_start).name!r}: {length:.1f} m of street lie between the junctions,"
                f" {needed:.0f} m are needed; move them apart or remove the turn lane"
            )
        lengths[k, at_start] = min(POCKET_LENGTH, room)
    return lengths
