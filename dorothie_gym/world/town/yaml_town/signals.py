"""Lights and signs at the approaches of crossings, and the programmes of the lights."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from dorothie_gym.world.town.lights import LightPhase, LightProgramme
from dorothie_gym.world.town.model import Junction, Lane, LaneLink, Signal, SignalKind
from dorothie_gym.world.town.programmes import derive_programmes, yellow_time
from dorothie_gym.world.town.yaml_town.approaches import Approach
from dorothie_gym.world.town.yaml_town.geometry import wrap
from dorothie_gym.world.town.yaml_town.layout import Layout
from dorothie_gym.world.town.yaml_town.plan import GreenPlan, LightsPlan, StreetPlan
from dorothie_gym.world.town.yaml_town.ramps import find_slips
from dorothie_gym.world.town.yaml_town.stretches import Crossing

SIGNAL_HEIGHT = 3.0
"""A light or a sign is this high above the road [m]."""
SIGNAL_ASIDE, MEDIAN_ASIDE = 1.0, 0.5
"""It stands this far from the edge of the lane at the kerb, and from that of a left-turn lane in the median [m]."""
CLEARANCE_TIME = 2.0
"""Between written phases: how long after their yellow all lights that change are red [s]."""


def place_signals(
    layout: Layout,
    approaches: Callable[[Crossing], Sequence[Approach]],
    lanes: Sequence[Lane],
    links: Sequence[LaneLink],
    junctions: Sequence[Junction],
) -> tuple[tuple[Signal, ...], tuple[LightProgramme, ...]]:
    """Places all signals of a town and makes the programmes of its lights.

    A lit approach has one light for all lanes but its left-turn lane, which has its own. Approaches have stop and yield
    signs where the plan says so; those of ramps that join and of streets onto roundabouts have yield signs if nothing
    else rules them.

    Args:
        layout: the layout.
        approaches: tells the arms of a crossing with their lanes.
        lanes: lanes of the town.
        links: links between them.
        junctions: its junctions.

    Raises:
        TownError: a written programme names lights that are not there, or leaves one without green.
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
    """A signal, the street at whose approach it stands, and whether it rules the left-turn lane alone."""

    signal: Signal
    street: StreetPlan
    left: bool


def _kinds(layout: Layout, crossing: Crossing) -> dict[int, SignalKind]:
    """What stands at the arms of a crossing, by index of the arm."""
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
    """The signals of an approach, the first of them with id `number`."""
    street, through, pocket = approach.arm.street, approach.through, approach.pocket
    kerb = through[0]
    aside = kerb.widths[-1] / 2.0 + SIGNAL_ASIDE
    if kind is not SignalKind.TRAFFIC_LIGHT or pocket is None:
        return [_Head(_signal(number, kind, approach.incoming, kerb, aside), street, left=False)]
    middle = -pocket.widths[-1] / 2.0 - MEDIAN_ASIDE
    return [
        _Head(_signal(number, kind, through, kerb, aside), street, left=False),
        _Head(_signal(number + 1, kind, (pocket,), pocket, middle), street, left=True),
    ]


def _signal(number: int, kind: SignalKind, rules: Sequence[Lane], beside: Lane, aside: float) -> Signal:
    """A signal to the right of the end of a lane; it faces the cars that come."""
    x, y = beside.position(beside.length, aside)
    return Signal(
        id=number,
        kind=kind,
        position=(float(x), float(y), float(beside.points[-1, 2]) + SIGNAL_HEIGHT),
        heading=wrap(beside.heading_at(beside.length) + math.pi),
        lanes=tuple(lane.id for lane in rules),
    )


def _programmes(
    layout: Layout,
    heads: Mapping[str, Sequence[_Head]],
    town: tuple[Sequence[Lane], Sequence[LaneLink], Sequence[Junction]],
) -> tuple[LightProgramme, ...]:
    """Written programmes, and derived ones where nothing is written, in the order of the junctions."""
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
    """The programme of written phases, with yellow and a clearance between them for the lights that change."""
    greens = [_greens(plan, phase, heads) for phase in plan.phases]
    for head in heads:
        if not any(head.signal.id in green for green in greens):
            which = "left-turn lane" if head.left else "light"
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
    """Ids of the signals that are green in a phase."""
    for name in (*phase.streets, *phase.left_only):
        left_only = name in phase.left_only
        if not any(head.street.name == name and (head.left or not left_only) for head in heads):
            what = "left-turn lane" if left_only else "approach"
            plan.entry.fail(f"a phase gives green to {name!r}, which has no {what} here; name another street")
    return tuple(
        head.signal.id
        for head in heads
        if (head.street.name in phase.streets and head.street.name not in phase.left_only)
        or (head.left and head.street.name in phase.left_only)
    )
