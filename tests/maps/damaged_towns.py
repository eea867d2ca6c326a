"""Sound towns to damage, and ways to damage them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from dorothie_gym.maps.catalogue import load_town
from dorothie_gym.maps.lint import Fault, FaultKind
from dorothie_gym.maps.model import Array, Junction, Lane, LaneLink, LinkType, Sidewalk, Signal
from dorothie_gym.maps.town import Town

LEFT, RIGHT, STRAIGHT, U_TURN = LinkType.LEFT, LinkType.RIGHT, LinkType.STRAIGHT, LinkType.U_TURN


def rebuilt(
    town: Town,
    *,
    lanes: Sequence[Lane] | None = None,
    links: Sequence[LaneLink] | None = None,
    signals: Sequence[Signal] | None = None,
    sidewalks: Sequence[Sidewalk] | None = None,
) -> Town:
    return Town(
        name=town.name,
        lanes=town.lanes if lanes is None else lanes,
        links=town.links if links is None else links,
        junctions=town.junctions,
        signals=town.signals if signals is None else signals,
        sidewalks=town.sidewalks if sidewalks is None else sidewalks,
        programmes=town.programmes,
    )


def with_lane(town: Town, lane: Lane) -> Town:
    return rebuilt(town, lanes=[lane if old.id == lane.id else old for old in town.lanes])


def retyped(town: Town, link: LaneLink, kind: LinkType) -> Town:
    return rebuilt(town, links=[replace(old, type=kind) if old == link else old for old in town.links])


def resampled(lane: Lane, spacing: float = 0.5) -> Lane:
    s = np.linspace(0.0, lane.length, max(2, math.ceil(lane.length / spacing) + 1))
    points = np.column_stack([np.interp(s, lane.stations, column) for column in lane.points.T])
    return replace(lane, points=points, widths=np.interp(s, lane.stations, lane.widths))


def pushed(lane: Lane, aside: Callable[[Array, float], Array]) -> Lane:
    """The lane with its points moved to the right by a function of their stations and the lane's length."""
    lane = resampled(lane)
    right = np.column_stack((-np.sin(lane.headings), np.cos(lane.headings)))
    points = lane.points.copy()
    points[:, :2] += aside(lane.stations, lane.length)[:, None] * right
    return replace(lane, points=points)


def bulge(size: float) -> Callable[[Array, float], Array]:
    return lambda s, length: size * np.sin(np.pi * s / length) ** 2


def lane(number: int, points: Array, *, road: int | None = None, lane_id: int = -1, width: float = 3.5) -> Lane:
    points = points if points.shape[1] == 3 else np.column_stack((points, np.zeros(len(points))))
    road = number if road is None else road
    widths = np.full(len(points), width)
    return Lane(id=number, road_id=road, lane_id=lane_id, points=points, widths=widths, speed_limit=10.0)


def ring() -> Town:
    """Two lanes around a circle, in two halves: 0 and 2 outside, 1 and 3 inside; driven clockwise as seen."""
    lanes, links = [], []
    for half in (0, 1):
        angle = np.linspace(np.pi * half, np.pi * (half + 1), 120)
        circle = np.column_stack((np.cos(angle), np.sin(angle)))
        lanes += [lane(2 * half + k, circle * (60.0 - 3.5 * k), road=half, lane_id=-2 + k) for k in (0, 1)]
        outer, inner = 2 * half, 2 * half + 1
        links += [LaneLink(k, (k + 2) % 4, STRAIGHT) for k in (outer, inner)]
        links += [
            LaneLink(outer, inner, LinkType.LANE_CHANGE_RIGHT),  # the middle of a clockwise circle is on the right
            LaneLink(inner, outer, LinkType.LANE_CHANGE_LEFT),
        ]
    return Town(name="ring", lanes=lanes, links=links, junctions=[])


def eight(height: float = 6.0, *, crossing: int | None = None) -> Town:
    """Four lanes along a figure of eight; 0 passes `height` above 2, and may be said to be a connector."""
    lanes = []
    for k in range(4):
        t = np.linspace(-0.25 + 0.5 * k, 0.25 + 0.5 * k, 100) * np.pi
        points = np.column_stack((80.0 * np.sin(t), 80.0 * np.sin(t) * np.cos(t), 0.5 * height * (1.0 + np.cos(t))))
        lanes.append(replace(lane(k, points), junction_id=5 if k == crossing else -1))
    junctions = [] if crossing is None else [Junction(id=5, position=(0.0, 0.0), connectors=(crossing,))]
    links = [LaneLink(k, (k + 1) % 4, STRAIGHT) for k in range(4)]
    return Town(name="eight", lanes=lanes, links=links, junctions=junctions)


def paperclip(radius: float, *, step: float = 8.0) -> Town:
    """Two straights joined by half circles: each lane is a straight and a half circle in steps of so many degrees."""
    turn = np.radians(np.linspace(0.0, 180.0, round(180.0 / step) + 1)) - 0.5 * np.pi
    half = np.column_stack((20.0 + radius * np.cos(turn), radius * np.sin(turn)))
    points = np.concatenate(([[-20.0, -radius]], half))
    links = [LaneLink(0, 1, STRAIGHT), LaneLink(1, 0, STRAIGHT)]
    return Town(name="clip", lanes=[lane(0, points), lane(1, -points)], links=links, junctions=[])


@lru_cache(maxsize=1)
def brookside() -> Town:
    return load_town("brookside")


def a_connector(kind: LinkType) -> LaneLink:
    """A way into a junction of brookside, of the junction that has most connectors."""
    town = brookside()
    busiest = max(town.junctions, key=lambda junction: len(junction.connectors))
    return next(link for link in town.links if link.target in busiest.connectors and link.type is kind)


def a_street() -> Lane:
    """The longest lane of brookside outside junctions."""
    return max((lane for lane in brookside().lanes if not lane.in_junction), key=lambda lane: lane.length)


def only(faults: Sequence[Fault], kind: FaultKind) -> Sequence[Fault]:
    assert faults, "nothing is found"
    assert {fault.kind for fault in faults} == {kind}, faults
    return faults


def near(fault: Fault, place: Array, within: float = 1.0) -> bool:
    return math.dist(fault.position, place[:2]) <= within
