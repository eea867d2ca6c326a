"""Crosswalks, sidewalks, signals, light programmes and landmark sites of YAML towns."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import cKDTree

from dorothie_gym.maps.model import Array, Crosswalk, Junction, Lane, LaneLink, Sidewalk, Signal, SignalKind, Site
from dorothie_gym.maps.town import LightPhase, LightProgramme
from dorothie_gym.maps.traffic_light_programs import derive_programmes, yellow_time
from dorothie_gym.maps.yaml.arms import Approach, find_slips
from dorothie_gym.maps.yaml.plan import GreenPlan, LightsPlan, StreetPlan
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.portable_math import wrap_radians

if TYPE_CHECKING:
    from dorothie_gym.maps.yaml.entries import YamlEntry
    from dorothie_gym.maps.yaml.geometry import Point
    from dorothie_gym.maps.yaml.layout import Layout
    from dorothie_gym.maps.yaml.segments import Crossing

CROSSWALK_SPAN = (0.5, 3.5)
"""Distances of both edges of a crosswalk beyond the ends of the lanes, towards the junction [m]."""
CROSSWALK_ASIDE = 0.5
"""Extent of a crosswalk beyond the edges of the road [m]."""


def crosswalks(layout: Layout, approaches: Callable[[Crossing], Sequence[Approach]]) -> tuple[Crosswalk, ...]:
    """Returns one crosswalk for each arm of the street at the junction, across all lanes and the median."""
    found: list[Crosswalk] = []
    for name, street in layout.plan.crosswalks:
        for crossing in layout.crossings_of(name):
            for approach in approaches(crossing):
                if approach.arm.street is street:
                    found.append(Crosswalk(id=len(found), outline=_outline(approach)))
    return tuple(found)


def _outline(approach: Approach) -> Array:
    """Returns the corners (4, 2) of the crosswalk across an arm [m], clockwise from the left one next to the lanes."""
    outgoing, incoming = approach.outgoing, approach.through
    # any lane can be the reference: seen outwards, all end at the same distance from the centre
    lane = outgoing[0] if outgoing else incoming[0]
    x, y = lane.points[0 if outgoing else -1, :2]
    heading = float(lane.headings[0]) if outgoing else float(lane.headings[-1]) + math.pi
    arm = approach.arm
    offset = arm.outgoing[0].offset if outgoing else arm.incoming[0].offset
    left, right = -arm.left - offset - CROSSWALK_ASIDE, arm.right - offset + CROSSWALK_ASIDE
    pavement = arm.street.sidewalk
    outward, sideways = (
        np.array((pm.cos(heading), pm.sin(heading))),
        np.array((-pm.sin(heading), pm.cos(heading))),
    )
    near, far = CROSSWALK_SPAN
    corners = ((near, left + pavement), (near, right - pavement), (far, right - pavement), (far, left + pavement))
    return np.array([np.array((x, y)) - ahead * outward + aside * sideways for ahead, aside in corners])


def sidewalks(layout: Layout) -> tuple[Sidewalk, ...]:
    """Returns the pavements beside all segments whose street has them: right of its course, then left of it.

    A ring has a pavement on its outer (right) side only.
    """
    found: list[Sidewalk] = []
    for segment, centreline in zip(layout.segments, layout.centrelines, strict=True):
        street, width = segment.street, segment.street.sidewalk
        if width > 0.0:
            right, left = segment.section.right + width / 2.0, -segment.section.left - width / 2.0
            for offset in (right, left) if segment.arc is None else (right,):
                points = centreline.beside(offset)
                found.append(Sidewalk(id=len(found), points=points, width=width, street=layout.numbers[street.id]))
    return tuple(found)


# --- Signals and programmes ------------------------------------------------------------------------------------------

SIGNAL_HEIGHT = 3.0
"""Height of lights and signs above the road [m]."""
SIGNAL_ASIDE, MEDIAN_ASIDE = 1.0, 0.5
"""Distance of signals from the edge of the lane at the kerb, and from that of a left-turn lane in the median [m]."""
CLEARANCE_TIME = 2.0
"""Clearance interval between explicit phases, after yellow, with red for all lights that change [s]."""


def place_signals(
    layout: Layout,
    approaches: Callable[[Crossing], Sequence[Approach]],
    lanes: Sequence[Lane],
    links: Sequence[LaneLink],
    junctions: Sequence[Junction],
) -> tuple[tuple[Signal, ...], tuple[LightProgramme, ...]]:
    """Places all signals of a town and builds the programmes of its lights.

    A lit approach has one light for all lanes but its left-turn lane, which has its own. Approaches have stop and yield
    signs as in the plan; those of ramps that join and of streets onto roundabouts have yield signs if they have
    no other signal.

    Args:
        layout: the layout.
        approaches: function that returns the arms of a crossing with their lanes.
        lanes: lanes of the town.
        links: links between them.
        junctions: its junctions.

    Raises:
        TownError: an explicit programme refers to missing lights, or a light never has green.
    """
    signals: list[Signal] = []
    heads: dict[str, list[_Head]] = {}
    for crossing in layout.crossings:
        kinds = _kinds(layout, crossing)
        for approach in approaches(crossing):
            kind = kinds.get(approach.arm.index)
            if kind is not None and approach.through:
                placed = _heads(approach, kind, len(signals))
                signals.extend(head.signal for head in placed)
                heads.setdefault(crossing.name, []).extend(placed)
    return tuple(signals), _programmes(layout, heads, (lanes, links, junctions))


@dataclass(frozen=True)
class _Head:
    """Signal with the street of its approach, and whether it only controls the turn lane in the median."""

    signal: Signal
    street: StreetPlan
    turns: bool


def _kinds(layout: Layout, crossing: Crossing) -> dict[int, SignalKind]:
    """Returns the kind of signal at each arm of a crossing, by index."""
    arms, plan, name = layout.arms[crossing.id], layout.plan, crossing.plan.name
    if any(lights.junction == name for lights in plan.lights):
        return {arm.index: SignalKind.TRAFFIC_LIGHT for arm in arms}
    kinds = {arm.index: SignalKind.YIELD for arm in arms if crossing.on_ring and not arm.on_ring}
    kinds.update({index: SignalKind.YIELD for index in find_slips(crossing, arms) if arms[index].incoming})
    for kind, signs in ((SignalKind.YIELD, plan.yields), (SignalKind.STOP, plan.stops)):
        for junction, street in signs:
            if junction == name:
                kinds.update({arm.index: kind for arm in arms if arm.street is street})
    return kinds


def _heads(approach: Approach, kind: SignalKind, number: int) -> list[_Head]:
    """Returns the signals of an approach, with ids that count up from `number`."""
    street, through, pocket = approach.arm.street, approach.through, approach.pocket
    kerb = through[0]
    aside = kerb.widths[-1] / 2.0 + SIGNAL_ASIDE
    if kind is not SignalKind.TRAFFIC_LIGHT or pocket is None:
        return [_Head(_signal(number, kind, approach.incoming, kerb, aside), street, turns=False)]
    middle = -pocket.widths[-1] / 2.0 - MEDIAN_ASIDE
    return [
        _Head(_signal(number, kind, through, kerb, aside), street, turns=False),
        _Head(_signal(number + 1, kind, (pocket,), pocket, middle), street, turns=True),
    ]


def _signal(number: int, kind: SignalKind, rules: Sequence[Lane], beside: Lane, aside: float) -> Signal:
    """Returns a signal to the right of the end of a lane, facing approaching cars."""
    x, y = beside.position(beside.length, aside)
    return Signal(
        id=number,
        kind=kind,
        position=(float(x), float(y), float(beside.points[-1, 2]) + SIGNAL_HEIGHT),
        heading=wrap_radians(beside.heading_at(beside.length) + math.pi),
        lanes=tuple(lane.id for lane in rules),
    )


def _programmes(
    layout: Layout,
    heads: Mapping[str, Sequence[_Head]],
    town: tuple[Sequence[Lane], Sequence[LaneLink], Sequence[Junction]],
) -> tuple[LightProgramme, ...]:
    """Returns the programmes in the order of the junctions: explicit ones, and generated ones elsewhere."""
    ids = {junction.name: junction.id for junction in layout.plan.junctions.values()}
    written = {ids[p.junction]: _written(p, ids[p.junction], heads[p.junction]) for p in layout.plan.lights if p.phases}
    offsets = {ids[p.junction]: p.offset for p in layout.plan.lights if p.offset}
    lit = [head.signal for p in layout.plan.lights if not p.phases for head in heads[p.junction]]
    derived = derive_programmes(*town, sorted(lit, key=lambda signal: signal.id)) if lit else ()
    programmes = written | {
        programme.junction_id: replace(programme, offset=offsets.get(programme.junction_id, programme.offset))
        for programme in derived
    }
    return tuple(programmes[junction] for junction in sorted(programmes))


def _written(plan: LightsPlan, junction_id: int, heads: Sequence[_Head]) -> LightProgramme:
    """Returns the programme of explicit phases, with yellow and clearance between them for the lights that change."""
    greens = [_greens(plan, phase, heads) for phase in plan.phases]
    for head in heads:
        if not any(head.signal.id in green for green in greens):
            which = f"{head.street.traffic.far_turn}-turn lane" if head.turns else "light"
            plan.entry.fail(f"the {which} of {head.street.name!r} never has green; add its street to a phase")
    phases: list[LightPhase] = []
    for phase, green, after in zip(plan.phases, greens, (*greens[1:], greens[0]), strict=True):
        phases.append(LightPhase(duration=phase.seconds, green=green))
        stay = tuple(signal for signal in green if signal in after)
        if len(stay) < len(green):
            yellow = tuple(signal for signal in green if signal not in after)
            fastest = max(head.street.speed for head in heads if head.signal.id in yellow) / 3.6
            phases.append(LightPhase(duration=yellow_time(fastest), green=stay, yellow=yellow))
            phases.append(LightPhase(duration=CLEARANCE_TIME, green=stay))
    return LightProgramme(
        junction_id=junction_id,
        signals=tuple(head.signal.id for head in heads),
        phases=tuple(phases),
        offset=plan.offset,
    )


def _greens(plan: LightsPlan, phase: GreenPlan, heads: Sequence[_Head]) -> tuple[int, ...]:
    """Returns the ids of the signals that are green in a phase."""
    for name in (*phase.streets, *phase.turn_lanes_only):
        turns = name in phase.turn_lanes_only
        if not any(head.street.name == name and (head.turns or not turns) for head in heads):
            what = f"{heads[0].street.traffic.far_turn}-turn lane" if turns else "approach"
            plan.entry.fail(f"a phase gives green to {name!r}, which has no {what} here; name another street")
    return tuple(
        head.signal.id
        for head in heads
        if (head.street.name in phase.streets and head.street.name not in phase.turn_lanes_only)
        or (head.turns and head.street.name in phase.turn_lanes_only)
    )


# --- Landmark sites --------------------------------------------------------------------------------------------------

FARTHEST_SITE = 25.0
"""Largest distance of a landmark from its lane at the kerb [m]."""
_SITE_SPACING = 1.0
"""Sampling distance on lanes [m]."""
_STOP_ROOM = 1.0
"""Smallest distance of a waypoint from the ends of its lane [m]."""


def place_sites(places: Sequence[tuple[Point, YamlEntry]], lanes: Sequence[Lane]) -> tuple[Site, ...]:
    """Returns the sites at given positions, each on the nearest lane.

    Raises:
        TownError: a position is too far from all streets, on a road, or nearest to a junction.
    """
    points, owner = [], []
    for lane in lanes:
        stations = np.linspace(0.0, lane.length, max(2, int(lane.length / _SITE_SPACING) + 2))
        points.append(np.column_stack([np.interp(stations, lane.stations, lane.points[:, k]) for k in (0, 1)]))
        owner.append(np.full(len(stations), lane.id))
    tree, owners = cKDTree(np.concatenate(points)), np.concatenate(owner)
    outermost: dict[tuple[int, bool], int] = {}
    for lane in lanes:
        side = lane.road_id, lane.lane_id > 0
        outermost[side] = max(outermost.get(side, 0), abs(lane.lane_id))
    sites: list[Site] = []
    for place, entry in places:
        lane = lanes[int(owners[tree.query(place)[1]])]
        station, aside = lane.project(np.array(place))
        kerb = abs(lane.lane_id) == outermost[lane.road_id, lane.lane_id > 0] and not lane.in_junction
        _check(entry, lane, station, aside, kerb=kerb)
        x, y = lane.position(station)
        sites.append(
            Site(
                id=len(sites),
                lane=lane.id,
                station=station,
                position=(float(place[0]), float(place[1])),
                waypoint=(float(x), float(y)),
                street=lane.street,
            )
        )
    return tuple(sites)


def _check(entry: YamlEntry, lane: Lane, station: float, aside: float, *, kerb: bool) -> None:
    if abs(aside) > FARTHEST_SITE:
        entry.fail(f"it is {abs(aside):.1f} m from the nearest street; {FARTHEST_SITE:g} m are possible: move it")
    if abs(aside) < lane.width_at(station) / 2.0 + 0.5:
        entry.fail("it stands on the road; move it aside")
    if not kerb or aside < 0.0 or not _STOP_ROOM <= station <= lane.length - _STOP_ROOM:
        what = "a junction" if lane.in_junction or (kerb and aside > 0.0) else "a median"
        entry.fail(f"the nearest place to stop for it would be {what}; move it to the side of a street")
