"""Division of lanes that are longer than a position on a lane can state (`LanePosition.metres`)."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.maps.import_notes import NoteKind
from dorothie_gym.maps.model import Junction, Lane, LaneLink, LinkType, Signal, SignalKind, Site, Street
from dorothie_gym.maps.town import Town

if TYPE_CHECKING:
    from dorothie_gym.maps.import_notes import ImportNotes

LONGEST_LANE = 1023.0
"""Largest length of a lane [m]: positions on a lane are whole metres from 0 to 1023."""

_LONGEST_PART = 1000.0  # [m]
_SHORTEST_PART = 5.0  # [m] cuts of parallel lanes nearer to each other are one, and none is as near to an end
_SHORTEST_OVERLAP = 5.0  # [m] of parts with a lane change

_AT_END = (SignalKind.TRAFFIC_LIGHT, SignalKind.STOP, SignalKind.YIELD)


@dataclass(frozen=True)
class _Parts:
    """Parts of a lane.

    Attributes:
        first: id of the first part in the new town; the others follow.
        edges: distances along the lane at which parts begin and end [m].
    """

    first: int
    edges: tuple[float, ...]

    @property
    def ids(self) -> tuple[int, ...]:
        return tuple(range(self.first, self.first + len(self.edges) - 1))

    @property
    def last(self) -> int:
        return self.first + len(self.edges) - 2

    def at(self, station: float) -> tuple[int, float]:
        """Returns the part at a distance along the lane, and the distance along the part [m]."""
        k = min(max(int(np.searchsorted(self.edges, station, side="right")) - 1, 0), len(self.edges) - 2)
        return self.first + k, station - self.edges[k]


def cut_long_lanes(town: Town, notes: ImportNotes | None = None) -> Town:
    """Returns a town without lanes longer than `LONGEST_LANE`; the same town if it has none.

    Lanes beside a long one are divided at the same places. Parts follow each other straight, and have the lane changes,
    streets, sites and signals of their lane.

    Args:
        town: the town.
        notes: gets a note for each long lane.
    """
    if all(lane.length <= LONGEST_LANE for lane in town.lanes):
        return town
    cuts = _cuts(town)
    parts: list[_Parts] = []
    for lane in town.lanes:
        first = parts[-1].last + 1 if parts else 0
        parts.append(_Parts(first, (0.0, *cuts.get(lane.id, ()), lane.length)))
        if notes is not None and lane.length > LONGEST_LANE:
            reason = f"is {lane.length:,.0f} m long and divided into {len(parts[-1].ids)} lanes"
            notes.repaired(NoteKind.LANE, f"road {lane.road_id} / lane {lane.lane_id}", reason)
    return Town(
        name=town.name,
        lanes=[part for lane, of in zip(town.lanes, parts, strict=True) for part in _divided(lane, of)],
        links=_links(town, parts),
        junctions=[_junction(junction, parts) for junction in town.junctions],
        streets=[_street(street, parts) for street in town.streets],
        sites=[_site(site, parts) for site in town.sites],
        signals=[_signal(signal, parts) for signal in town.signals],
        crosswalks=town.crosswalks,
        sidewalks=town.sidewalks,
        programmes=town.programmes,
        cruise=town.cruise,
        titled=town.titled,
        traffic=town.traffic,
    )


def _cuts(town: Town) -> dict[int, tuple[float, ...]]:
    """Returns where lanes are cut: distances along each lane [m], by lane id; lanes that stay whole are left out."""
    beside: defaultdict[int, dict[int, None]] = defaultdict(dict)
    for link in town.links:
        if link.type.is_lane_change:
            beside[link.source][link.target] = beside[link.target][link.source] = None
    found: dict[int, tuple[float, ...]] = {}
    for start in sorted(town.lanes, key=lambda lane: (-lane.length, lane.id)):
        if start.length <= LONGEST_LANE:
            break
        todo: list[tuple[Lane, tuple[float, ...]]] = [] if start.id in found else [(start, ())]
        while todo:
            lane, near = todo.pop(0)
            if lane.id in found:
                continue
            found[lane.id] = cut = _filled(lane, near)
            places = [lane.position(station) for station in cut]
            for number in beside[lane.id]:
                other = town.lanes[number]
                todo.append((other, tuple(other.project(place)[0] for place in places)))
    return {lane: cut for lane, cut in found.items() if cut}


def _filled(lane: Lane, near: tuple[float, ...]) -> tuple[float, ...]:
    """Returns the cuts of a lane: those of the lane beside it, and more where a part would be too long."""
    edges = [0.0]
    for station in sorted(near):
        if station - edges[-1] >= _SHORTEST_PART and lane.length - station >= _SHORTEST_PART:
            edges.append(station)
    edges.append(lane.length)
    cuts = []
    for start, end in pairwise(edges):
        count = 1 if end - start <= LONGEST_LANE else math.ceil((end - start) / _LONGEST_PART)
        cuts += [start + (end - start) * k / count for k in range(count)]
    return tuple(cuts[1:])


def _divided(lane: Lane, parts: _Parts) -> Iterator[Lane]:
    if len(parts.ids) == 1:
        yield replace(lane, id=parts.first)
        return
    columns = np.column_stack((lane.points, lane.widths))
    for number, (start, end) in zip(parts.ids, pairwise(parts.edges), strict=True):
        inside = (lane.stations > start + 1e-3) & (lane.stations < end - 1e-3)
        at = np.concatenate(([start], lane.stations[inside], [end]))
        rows = np.column_stack([np.interp(at, lane.stations, column) for column in columns.T])
        yield replace(lane, id=number, points=rows[:, :3].copy(), widths=rows[:, 3].copy())


def _links(town: Town, parts: list[_Parts]) -> list[LaneLink]:
    found = [LaneLink(number, number + 1, LinkType.STRAIGHT) for of in parts for number in of.ids if number != of.last]
    for link in town.links:
        if link.type.is_lane_change:
            found += _changes(town, parts, link)
        else:
            found.append(LaneLink(parts[link.source].last, parts[link.target].first, link.type))
    return sorted(found, key=lambda link: (link.type.is_lane_change, link.source))


def _changes(town: Town, parts: list[_Parts], link: LaneLink) -> list[LaneLink]:
    """Returns the lane changes between the parts of two lanes, for each part the longest neighbour first."""
    source, target = parts[link.source], parts[link.target]
    if len(source.ids) == len(target.ids) == 1:
        return [LaneLink(source.first, target.first, link.type)]
    lane, other = town.lanes[link.source], town.lanes[link.target]
    places = [other.project(lane.position(station))[0] for station in source.edges]
    rows = []
    for a, (low, high) in zip(source.ids, pairwise(places), strict=True):
        for b, (start, end) in zip(target.ids, pairwise(target.edges), strict=True):
            shared = min(high, end) - max(low, start)
            if shared >= _SHORTEST_OVERLAP:
                rows.append((a, -shared, b))
    return [LaneLink(a, b, link.type) for a, _, b in sorted(rows)]


def _junction(junction: Junction, parts: list[_Parts]) -> Junction:
    return replace(junction, connectors=tuple(k for lane in junction.connectors for k in parts[lane].ids))


def _street(street: Street, parts: list[_Parts]) -> Street:
    return replace(street, lanes=tuple(k for lane in street.lanes for k in parts[lane].ids))


def _site(site: Site, parts: list[_Parts]) -> Site:
    lane, station = parts[site.lane].at(site.station)
    return replace(site, lane=lane, station=station)


def _signal(signal: Signal, parts: list[_Parts]) -> Signal:
    """Returns a signal for the parts: one that controls the end of its lanes for the last ones, others for all."""
    at_end = signal.kind in _AT_END
    lanes = (k for lane in signal.lanes for k in ((parts[lane].last,) if at_end else parts[lane].ids))
    return replace(signal, lanes=tuple(sorted(lanes)))
