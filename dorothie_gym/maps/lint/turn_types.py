"""Turn types, lane changes and signals: checks that types agree with the geometry."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.maps.lint.fault import Fault, FaultKind
from dorothie_gym.maps.lint.samples import SAME_GROUND
from dorothie_gym.maps.model import Lane, LaneLink, LinkType, SignalKind

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town

WRONG_WAY = 10.0
"""Largest angle of a left turn to the right, or of a right turn to the left [degrees]: the branches of a fork that are
both almost straight are called left and right."""

LARGEST_STRAIGHT = 50.0
"""Largest angle of a straight movement [degrees]; towns use 35 degrees, human judgement varies."""

U_TURN_FROM = 120.0
"""Smallest angle of a U-turn [degrees]."""

MAX_SEPARATION = 1.0
"""Largest gap or overlap between the lanes of a lane change [m]."""

MAX_DIVERGENCE = math.radians(20.0)
"""Largest angle between the lanes of a lane change [rad]."""

_HEEDED = (SignalKind.TRAFFIC_LIGHT, SignalKind.STOP, SignalKind.YIELD)


def turn_type_faults(town: Town) -> Iterator[Fault]:
    """Yields turns and lane changes that contradict their type, and signals without effect."""
    for link in town.links:
        if link.type.is_lane_change:
            yield from _lane_change(town.lanes[link.source], town.lanes[link.target], link.type)
        else:
            yield from _turn(town, link)
    yield from _order_of_turns(town)
    yield from _signals(town)


def _turn(town: Town, link: LaneLink) -> Iterator[Fault]:
    """Checks a turn by its net change of direction, and beyond a half circle also by the driven one."""
    if not town.lanes[link.target].in_junction:
        if link.type is not LinkType.STRAIGHT and not town.lanes[link.source].in_junction:
            yield _turn_fault(town, link, "leads into a lane that continues its road without a junction")
        return
    if town.lanes[link.source].in_junction:
        return  # the link into the junction carries the type
    net, driven = _turned(town, link)
    if not any(_fits(link.type, angle) for angle in (net, driven)):
        direction = "right" if driven < 0 else "left"
        yield _turn_fault(town, link, f"turns by {abs(driven):.0f} degrees to the {direction}")


def _fits(kind: LinkType, angle: float) -> bool:
    """Returns whether a type matches a turn by an angle [degrees], positive left."""
    if kind is LinkType.STRAIGHT:
        return abs(angle) < LARGEST_STRAIGHT
    if kind is LinkType.U_TURN:
        return abs(angle) >= U_TURN_FROM
    return (angle if kind is LinkType.LEFT else -angle) >= -WRONG_WAY


def _turned(town: Town, link: LaneLink) -> tuple[float, float]:
    """Returns the change of direction across a junction [degrees], positive left: net in [-180, 180), and driven."""
    before, target = town.lanes[link.source], town.lanes[link.target]
    driven, seen = 0.0, {target.id}
    while True:
        driven += float(target.headings[-1] - target.headings[0])
        on = town.successors(target.id)
        if len(on) != 1 or not town.lanes[on[0].target].in_junction or on[0].target in seen:
            break
        target = town.lanes[on[0].target]
        seen.add(target.id)
    net = math.remainder(float(target.headings[-1] - before.headings[-1]), math.tau)
    return -math.degrees(net), -math.degrees(driven)


def _order_of_turns(town: Town) -> Iterator[Fault]:
    """Checks that left turns lie to the left of the straight movement and right turns to the right of it."""
    for lane in town.lanes:
        ways = [link for link in town.successors(lane.id) if town.lanes[link.target].in_junction]
        straight = [link for link in ways if link.type is LinkType.STRAIGHT]
        if lane.in_junction or not straight:
            continue
        angles = [_turned(town, link)[0] for link in straight]
        for link in ways:
            net, driven = _turned(town, link)
            if abs(driven) > 180.0 or not _fits(link.type, net):
                continue  # it ends on the other side of its start, or is reported already
            if (link.type is LinkType.LEFT and net < min(angles) - WRONG_WAY) or (
                link.type is LinkType.RIGHT and net > max(angles) + WRONG_WAY
            ):
                yield _turn_fault(town, link, "lies on the other side of the way straight on")


def _turn_fault(town: Town, link: LaneLink, what: str) -> Fault:
    x, y = town.lanes[link.target].points[0, :2]
    message = f"the way from lane {link.source} into lane {link.target} is called {link.type} and {what}"
    return Fault(
        kind=FaultKind.TURN_TYPE, lanes=(link.source, link.target), position=(float(x), float(y)), message=message
    )


def _lane_change(source: Lane, target: Lane, side: LinkType) -> Iterator[Fault]:
    """Checks that the target lies beside the source somewhere, on the side of the lane change."""
    reasons: list[str] = []
    for station in np.linspace(0.0, source.length, max(3, int(source.length / 5.0) + 2))[1:-1]:
        found = _why_not_beside(source, float(station), target, side)
        if found is None:
            return
        reasons.append(found)
    x, y = source.position(0.5 * source.length)
    message = (
        f"the {side.replace('_', ' ')} from lane {source.id} leads to lane {target.id}, {reasons[len(reasons) // 2]}"
    )
    lanes = (source.id, target.id)
    yield Fault(kind=FaultKind.LANE_CHANGE, lanes=lanes, position=(float(x), float(y)), message=message)


def _why_not_beside(source: Lane, station: float, target: Lane, side: LinkType) -> str | None:
    """Returns the reason against a lane change at a station, or None if it is possible."""
    there, across = target.project(source.position(station))
    apart = abs(across) - 0.5 * (source.width_at(station) + target.width_at(there))
    turn = math.remainder(target.heading_at(there) - source.heading_at(station), math.tau)
    if abs(source.height_at(station) - target.height_at(there)) > SAME_GROUND:
        return "which runs at another height"
    if abs(turn) > MAX_DIVERGENCE:
        return f"which runs at {math.degrees(abs(turn)):.0f} degrees to it"
    if abs(apart) > MAX_SEPARATION:
        return f"which is {abs(apart):.1f} m {'away from' if apart > 0 else 'into'} it"
    # as seen from the target, the source lies on the other side
    if (across > 0.0) != (side is LinkType.LANE_CHANGE_LEFT):
        return "which runs on its other side"
    return None


def _signals(town: Town) -> Iterator[Fault]:
    switched = {signal for programme in town.programmes for signal in programme.signals}
    for signal in town.signals:
        name, position = signal.kind.replace("_", " "), (signal.position[0], signal.position[1])
        if signal.kind in _HEEDED and not signal.lanes:
            message = f"{name} {signal.id} rules no lane"
        elif signal.kind is SignalKind.TRAFFIC_LIGHT and town.programmes and signal.id not in switched:
            message = f"{name} {signal.id} is in no programme and never shows a colour"
        else:
            continue
        yield Fault(kind=FaultKind.SIGNAL, lanes=signal.lanes, position=position, message=message)
