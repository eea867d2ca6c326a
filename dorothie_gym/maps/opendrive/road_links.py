"""Links of roads, lanes and junctions that state the lane links of a town."""

from __future__ import annotations

import itertools
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from dorothie_gym.maps.model import NO_JUNCTION

if TYPE_CHECKING:
    from dorothie_gym.maps.model import LaneLink
    from dorothie_gym.maps.opendrive.cross_sections import CrossSection
    from dorothie_gym.maps.opendrive.road_layout import RoadLayout
    from dorothie_gym.maps.opendrive.strands import Strand


class RoadTip(NamedTuple):
    """End of a road: its number, and whether it is the end (and not the start) of the reference line."""

    road: int
    at_end: bool

    @property
    def contact(self) -> str:
        """Value of contactPoint."""
        return "end" if self.at_end else "start"


class LaneAt(NamedTuple):
    """Lane of a lane section: number of the road, index of the section, number of the lane."""

    road: int
    section: int
    lane: int


class JunctionLink(NamedTuple):
    """Connection of a junction: end of the incoming road, start of the connecting road, pairs of lanes."""

    incoming: RoadTip
    connecting: RoadTip
    lanes: tuple[tuple[int, int], ...]


@dataclass(frozen=True, kw_only=True)
class RoadLinks:
    """Links of all roads.

    Attributes:
        roads: the end of a road that each end of a road leads to.
        junctions: the junction that each other end leads to.
        predecessors, successors: numbers of the linked lanes before and after a lane, along the reference line.
        connections: connections by junction.
        missing: lanes with a link that cannot be stated.
    """

    roads: dict[RoadTip, RoadTip] = field(default_factory=dict)
    junctions: dict[RoadTip, int] = field(default_factory=dict)
    predecessors: defaultdict[LaneAt, dict[int, None]] = field(default_factory=lambda: defaultdict(dict))
    successors: defaultdict[LaneAt, dict[int, None]] = field(default_factory=lambda: defaultdict(dict))
    connections: dict[int, tuple[JunctionLink, ...]] = field(default_factory=dict)
    missing: set[int] = field(default_factory=set)


def link_roads(
    roads: Sequence[RoadLayout], sections: Sequence[tuple[CrossSection, ...]], links: Sequence[LaneLink]
) -> RoadLinks:
    """Returns the links between roads and lanes.

    Args:
        roads: roads.
        sections: lane sections of each road.
        links: links of the town; lane changes are ignored.
    """
    linker = _Linker(roads, sections)
    pairs = linker.inside([(link.source, link.target) for link in links if not link.type.is_lane_change])
    linker.choose(pairs)
    linker.between(pairs)
    return linker.found


class _Linker:
    """Links so far."""

    def __init__(self, roads: Sequence[RoadLayout], sections: Sequence[tuple[CrossSection, ...]]) -> None:
        self.found = RoadLinks()
        self._roads = {road.number: road for road in roads}
        self._sections = {road.number: of for road, of in zip(roads, sections, strict=True)}
        self._of = {s.lane: (road.number, s) for road in roads for s in road.strands if s.lane is not None}
        for road in roads:
            for strand in road.strands:
                self._go_on(road.number, strand)

    def _go_on(self, road: int, strand: Strand) -> None:
        """Links the parts of a lane in successive sections."""
        sections = self._sections[road]
        held = [k for k, s in enumerate(sections) if strand.begin <= s.start and s.end <= strand.end]
        for k, after in itertools.pairwise(held):
            one, other = sections[k].number(strand), sections[after].number(strand)
            self.found.successors[LaneAt(road, k, one)][other] = None
            self.found.predecessors[LaneAt(road, after, other)][one] = None

    def _place(self, lane: int, at_end: bool) -> tuple[LaneAt, RoadTip, float]:
        """Returns the part of a lane at one of its ends, that end along the road, and its distance."""
        road, strand = self._of[lane]
        sections = self._sections[road]
        along = strand.forward == at_end
        place = strand.end if along else strand.begin
        k = next(k for k, s in enumerate(sections) if (s.end if along else s.start) == place)
        return LaneAt(road, k, sections[k].number(strand)), RoadTip(road, along), place

    def inside(self, links: Sequence[tuple[int, int]]) -> dict[tuple[RoadTip, RoadTip], list[tuple[int, int]]]:
        """Links lanes that follow each other inside of a road; returns the others by the ends of their roads."""
        pairs: defaultdict[tuple[RoadTip, RoadTip], list[tuple[int, int]]] = defaultdict(list)
        for source, target in links:
            (here, leaves, place), (there, enters, start) = self._place(source, True), self._place(target, False)
            ends = [
                at == (self._roads[tip.road].axis.length if tip.at_end else 0.0)
                for tip, at in ((leaves, place), (enters, start))
            ]
            if all(ends):
                pairs[leaves, enters].append((source, target))
            elif here.road == there.road and place == start and leaves.at_end != enters.at_end:
                first, second = (here, there) if leaves.at_end else (there, here)
                self.found.successors[first][second.lane] = None
                self.found.predecessors[second][first.lane] = None
            else:
                self.found.missing.update((source, target))
        return dict(pairs)

    def _crosses(self, tip: RoadTip) -> bool:
        return self._roads[tip.road].junction != NO_JUNCTION

    def choose(self, pairs: dict[tuple[RoadTip, RoadTip], list[tuple[int, int]]]) -> None:
        """Chooses the road that each end leads to: connectors to the roads they link, others only where needed."""
        counts: defaultdict[RoadTip, Counter[RoadTip]] = defaultdict(Counter)
        for (a, b), lanes in pairs.items():
            counts[a][b] += len(lanes)
            counts[b][a] += len(lanes)
        chosen = self.found.roads
        for tip in sorted(counts):
            if self._crosses(tip):
                chosen[tip] = min(counts[tip], key=lambda other: (-counts[tip][other], other))
        while left := [pair for pair in sorted(pairs) if not self._is_stated(*pair)]:
            open_ = Counter(tip for pair in left for tip in pair)
            free = [(open_[tip], tip, other) for a, b in left for tip, other in ((a, b), (b, a)) if tip not in chosen]
            if not free:
                for pair in left:
                    self.found.missing.update(lane for link in pairs[pair] for lane in link)
                break
            _, tip, other = min(free)
            chosen[tip] = other
            if other not in chosen and sum(pair.count(other) for pair in left) == 1:
                chosen[other] = tip
        for tip in sorted(set(counts) - set(chosen)):
            junctions = [self._roads[other.road].junction for other in counts[tip] if self._crosses(other)]
            if junctions:
                self.found.junctions[tip] = min(junctions)
            else:
                chosen[tip] = min(counts[tip], key=lambda other: (-counts[tip][other], other))

    def _is_stated(self, a: RoadTip, b: RoadTip) -> bool:
        return self.found.roads.get(a) == b or self.found.roads.get(b) == a

    def between(self, pairs: dict[tuple[RoadTip, RoadTip], list[tuple[int, int]]]) -> None:
        """Links lanes of different roads, in the lanes and, for roads that lead into junctions, in these."""
        joined: defaultdict[int, list[JunctionLink]] = defaultdict(list)
        for (a, b), lanes in sorted(pairs.items()):
            numbers = []
            for source, target in lanes:
                here, there = self._place(source, True)[0], self._place(target, False)[0]
                numbers.append((here.lane, there.lane))
                for tip, own, other, beyond in ((a, here, there, b), (b, there, here, a)):
                    if self.found.roads.get(tip) == beyond:
                        table = self.found.successors if tip.at_end else self.found.predecessors
                        table[own][other.lane] = None
            if self._crosses(b) and not self._crosses(a) and self.found.roads[b] == a:
                joined[self._roads[b.road].junction].append(JunctionLink(a, b, tuple(numbers)))
        self.found.connections.update({junction: tuple(joined[junction]) for junction in sorted(joined)})


def begun_inside(road: RoadLayout, section: CrossSection) -> Iterator[int]:
    """Yields the numbers of the lanes of a section that begin in it, and not at an end of their road."""
    for lane in section.lanes:
        strand = lane.strand
        if strand is None or strand.lane is None:
            continue
        if strand.forward and strand.begin == section.start > 0.0:
            yield lane.number
        elif not strand.forward and strand.end == section.end < road.axis.length:
            yield lane.number
