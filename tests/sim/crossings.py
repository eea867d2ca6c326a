"""Towns with lights, and a crossing made by hand, to test junctions with."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from dorothie_gym.maps import Junction, Lane, LaneLink, LinkType, Town
from dorothie_gym.maps.model import Signal, SignalKind
from dorothie_gym.maps.town import LightPhase, LightProgramme
from tests.sim.network.towns import bend, lane

GREEN, YELLOW, ALL_RED = 15.0, 3.0, 1.0
CROSSING = 7
ARMS = "nesw"
SIZE, REACH = 12.0, 120.0
OUTWARD = {"n": (0.0, -1.0), "e": (1.0, 0.0), "s": (0.0, 1.0), "w": (-1.0, 0.0)}


def way_in(arm: str) -> int:
    """Lane that comes to the crossing from an arm."""
    return ARMS.index(arm)


def way_out(arm: str) -> int:
    """Lane that leaves the crossing by an arm."""
    return 4 + ARMS.index(arm)


def across(start: str, end: str) -> int:
    """Connector from an arm to another."""
    k, turn = ARMS.index(start), (ARMS.index(end) - ARMS.index(start)) % 4
    return 8 + 3 * k + turn - 1


def _place(arm: str, outward: float, right: float) -> tuple[float, float]:
    """Returns a place on an arm: distance from the middle, and offset to the right of incoming vehicles [m]."""
    x, y = OUTWARD[arm]
    return outward * x + right * y, outward * y - right * x


def crossing(
    controls: Mapping[str, SignalKind] | None = None, phases: Sequence[LightPhase] = (), offset: float = 0.0
) -> Town:
    """Four arms of one lane in each direction; the signal of an arm has the arm's number (0 north, 1 east ...)."""
    made = [lane(way_in(arm), [_place(arm, REACH, 2.0), _place(arm, SIZE, 2.0)], road=way_in(arm)) for arm in ARMS]
    made += [
        lane(way_out(arm), [_place(arm, SIZE, -2.0), _place(arm, REACH, -2.0)], road=way_in(arm), number=1)
        for arm in ARMS
    ]
    links: list[LaneLink] = []
    for start in ARMS:
        for turn, kind in ((1, LinkType.LEFT), (2, LinkType.STRAIGHT), (3, LinkType.RIGHT)):
            end = ARMS[(ARMS.index(start) + turn) % 4]
            a, b = _place(start, SIZE, 2.0), _place(end, SIZE, -2.0)
            vertical = start in "ns"
            corner = (a[0], b[1]) if vertical else (b[0], a[1])
            points = [a, b] if kind is LinkType.STRAIGHT else bend(a, corner, b)
            id = across(start, end)
            made.append(lane(id, points, road=id, junction=CROSSING))
            links += [LaneLink(way_in(start), id, kind), LaneLink(id, way_out(end), LinkType.STRAIGHT)]
    made.sort(key=lambda each: each.id)
    signals = [
        Signal(
            id=ARMS.index(arm), kind=kind, position=(*_place(arm, SIZE, 4.5), 0.0), heading=0.0, lanes=(way_in(arm),)
        )
        for arm, kind in (controls or {}).items()
    ]
    lit = tuple(signal.id for signal in signals if signal.kind is SignalKind.TRAFFIC_LIGHT)
    programmes = [LightProgramme(junction_id=CROSSING, signals=lit, phases=tuple(phases), offset=offset)] if lit else []
    junction = Junction(id=CROSSING, position=(0.0, 0.0), connectors=tuple(range(8, 20)))
    return Town(name="crossing", lanes=made, links=links, junctions=[junction], signals=signals, programmes=programmes)


def lit_crossing(first: str = "ns", green: float = 20.0) -> Town:
    """The crossing with lights: two arms have green first, then the other two."""
    groups = [tuple(ARMS.index(arm) for arm in group) for group in (first, "ew" if first == "ns" else "ns")]
    phases = []
    for group in groups:
        phases += [LightPhase(duration=green, green=group), LightPhase(duration=YELLOW, yellow=group)]
        phases.append(LightPhase(duration=ALL_RED))
    return crossing(dict.fromkeys(ARMS, SignalKind.TRAFFIC_LIGHT), phases)


def lit(town: Town) -> Town:
    """The town with lights at every junction of three or more approaches; those that face each other go together."""
    signals: list[Signal] = []
    programmes: list[LightProgramme] = []
    for junction in town.junctions:
        connectors = set(junction.connectors)
        approaches = sorted({link.source for link in town.links if link.target in connectors} - connectors)
        groups: list[list[Lane]] = []
        for approach in (town.lanes[id] for id in approaches):
            for group in groups:
                turn = float(approach.headings[-1] - group[0].headings[-1])
                if abs(math.sin(turn)) < 0.5:
                    group.append(approach)
                    break
            else:
                groups.append([approach])
        if len(groups) < 2:
            continue
        phases = []
        for group in groups:
            ids = []
            for approach in group:
                ids.append(len(signals))
                place = approach.points[-1]
                signals.append(
                    Signal(
                        id=len(signals),
                        kind=SignalKind.TRAFFIC_LIGHT,
                        lanes=(approach.id,),
                        heading=0.0,
                        position=(float(place[0]), float(place[1]), float(place[2])),
                    )
                )
            phases.append(LightPhase(duration=GREEN, green=tuple(ids)))
            phases += [LightPhase(duration=YELLOW, yellow=tuple(ids)), LightPhase(duration=ALL_RED)]
        switched = tuple(id for phase in phases for id in phase.green)
        programmes.append(LightProgramme(junction_id=junction.id, signals=switched, phases=tuple(phases)))
    return Town(
        name=f"{town.name} by lights", lanes=town.lanes, links=town.links, junctions=town.junctions,
        streets=town.streets, sites=town.sites, signals=signals, programmes=programmes,
    )  # fmt: skip
