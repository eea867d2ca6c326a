"""YAML town compiler: from the layout to a `Town` with lanes, connectors, links, and objects beside the roads."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path as FilePath
from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.maps.driving_side import DrivingSide
from dorothie_gym.maps.import_notes import ImportNotes
from dorothie_gym.maps.long_lanes import cut_long_lanes
from dorothie_gym.maps.mirroring import mirrored
from dorothie_gym.maps.model import NO_JUNCTION, NO_STREET, Array, Junction, Lane, LaneLink, LinkType, Site, Street
from dorothie_gym.maps.site_inference import lay_sites
from dorothie_gym.maps.town import Town
from dorothie_gym.maps.yaml.arms import POCKET, Approach, Arm, LaneEnd
from dorothie_gym.maps.yaml.furniture import crosswalks, place_signals, place_sites, sidewalks
from dorothie_gym.maps.yaml.layout import Layout, lay_out
from dorothie_gym.maps.yaml.movements import MovementPath, kinds_of
from dorothie_gym.maps.yaml.schema import read_plan

if TYPE_CHECKING:
    from dorothie_gym.maps.yaml.segments import Crossing

SITES = 24
"""Number of landmark sites of a town without explicit ones."""
_KMH = 1.0 / 3.6


def read_yaml_town(path: str | FilePath) -> Town:
    """Compiles a town file.

    Raises:
        TownError: with the file, the line, the element, and the remedy.
    """
    return import_yaml_town(path)[0]


def import_yaml_town(path: str | FilePath) -> tuple[Town, ImportNotes]:
    """Compiles a town file like `read_yaml_town`; also returns what was repaired: lanes that were too long."""
    plan = read_plan(FilePath(path))
    return town_of_layout(lay_out(plan.right_handed()), str(path), mirror=plan.traffic is DrivingSide.LEFT)


def town_of_layout(layout: Layout, source: str, *, mirror: bool = False) -> tuple[Town, ImportNotes]:
    """Compiles a layout like `import_yaml_town`.

    Args:
        layout: the layout, for traffic on the right.
        source: its name in messages.
        mirror: whether the town is the mirror image of the layout, with traffic on the left.
    """
    notes = ImportNotes(source)
    town = compile_town(layout)
    return cut_long_lanes(mirrored(town) if mirror else town, notes), notes


def compile_town(layout: Layout) -> Town:
    """Builds the town of a layout, with right-hand traffic: first the lanes of all segments, then the connectors.

    Raises:
        TownError: the phases of a light do not match its signals, or a site is far from all streets.
    """
    build = _Build(layout)
    for k in range(len(layout.segments)):
        build.add_stretch(k)
    for crossing in layout.crossings:
        build.add_crossing(crossing)
    lanes = tuple(build.lanes)
    links = tuple(sorted(build.links, key=lambda link: (link.type.is_lane_change, link.source, link.target)))
    signals, programmes = place_signals(layout, build.approaches, lanes, links, build.junctions)
    return Town(
        name=layout.plan.name,
        lanes=lanes,
        links=links,
        junctions=build.junctions,
        streets=tuple(
            Street(id=k, name=street.name, lanes=tuple(lane.id for lane in lanes if lane.street == k))
            for k, street in enumerate(layout.named_streets)
        ),
        sites=_sites(layout, lanes, links, build.on_ramps),
        signals=signals,
        crosswalks=crosswalks(layout, build.approaches),
        sidewalks=sidewalks(layout),
        programmes=programmes,
        cruise=layout.plan.cruise,
    )


def _sites(
    layout: Layout, lanes: Sequence[Lane], links: Sequence[LaneLink], on_ramps: Collection[int]
) -> tuple[Site, ...]:
    """Returns the explicit sites, or sites spread over the town; none on ramps."""
    if layout.plan.sites:
        return place_sites(layout.plan.sites, lanes)
    return lay_sites(lanes, links, count=SITES, avoid=on_ramps)


@dataclass
class _Build:
    """Builder of lanes, links and junctions.

    Attributes:
        layout: layout of the town.
        lanes, links, junctions: elements so far.
        first, last: id of the first and last lane, by index of the segment, whether along its course, and lane number.
        on_ramps: ids of the lanes of ramps.
        roads: number of roads so far.
    """

    layout: Layout
    lanes: list[Lane] = field(default_factory=list)
    links: list[LaneLink] = field(default_factory=list)
    junctions: list[Junction] = field(default_factory=list)
    first: dict[tuple[int, bool, int], int] = field(default_factory=dict)
    last: dict[tuple[int, bool, int], int] = field(default_factory=dict)
    on_ramps: list[int] = field(default_factory=list)
    roads: int = 0

    def add_stretch(self, k: int) -> None:
        """Adds the lanes along a segment's course, innermost first, then those against it.

        Where a left-turn lane opens, the lanes are split and a new road begins.
        """
        length, section = self.layout.centrelines[k].path.length, self.layout.segments[k].section
        road = self._road()
        for along, offsets, pocket in (
            (True, section.forward, section.pocket),
            (False, section.backward, -section.pocket),
        ):
            # rest of the street in driving direction where the left-turn lane opens
            room = self.layout.pockets.get((k, not along), 0.0)
            opening = length - room if along else room
            before = (0.0, opening) if along else (opening, length)
            lanes = self._add_side(k, road, list(enumerate(offsets)), before, along=along)
            self.first.update({(k, along, number): lane for number, lane in lanes.items()})
            if room:
                after = (opening, length) if along else (0.0, opening)
                beside = self._add_side(k, self._road(), [(POCKET, pocket), *enumerate(offsets)], after, along=along)
                for number, lane in lanes.items():
                    self._join(lane, beside[number])
                lanes = beside
            self.last.update({(k, along, number): lane for number, lane in lanes.items()})

    def _add_side(
        self, k: int, road: int, offsets: Sequence[tuple[int, float]], span: tuple[float, float], *, along: bool
    ) -> dict[int, int]:
        """Adds parallel lanes, innermost first, between two distances along a segment; returns ids by number."""
        street, centreline = self.layout.segments[k].street, self.layout.centrelines[k]
        whole = span == (0.0, centreline.path.length)
        ids: dict[int, int] = {}
        for place, (number, offset) in enumerate(offsets, start=1):
            points = centreline.beside(offset, None if whole else span)
            ids[number] = self._add(
                points if along else points[::-1].copy(),
                road_id=road,
                lane_id=-place if along else place,
                widths=(street.width, street.width),
                speed_limit=street.speed * _KMH,
                street=self.layout.numbers[street.id],
            )
        for inner, outer in pairwise(ids.values()):
            self.links.append(LaneLink(inner, outer, LinkType.LANE_CHANGE_RIGHT))
            self.links.append(LaneLink(outer, inner, LinkType.LANE_CHANGE_LEFT))
        if street.ramp:
            self.on_ramps.extend(ids.values())
        return ids

    def _join(self, source: int, target: int) -> None:
        """Links a lane to its continuation, at exactly the same point."""
        self.lanes[target].points[0] = self.lanes[source].points[-1]
        self.links.append(LaneLink(source, target, LinkType.STRAIGHT))

    def add_crossing(self, crossing: Crossing) -> None:
        """Adds a connector for each path through a crossing."""
        begin = len(self.lanes)
        onward: dict[int, dict[int, MovementPath]] = defaultdict(dict)
        for way in self.layout.ways[crossing.id]:
            source, connector = self._connect(crossing, way)
            onward[source][connector] = way
        for source, ways in onward.items():
            kinds = kinds_of({connector: way.turn for connector, way in ways.items()})
            self.links.extend(LaneLink(source, connector, kinds[connector]) for connector in ways)
        connectors = tuple(range(begin, len(self.lanes)))
        self.junctions.append(Junction(id=crossing.id, position=crossing.centre, connectors=connectors))

    def _connect(self, crossing: Crossing, way: MovementPath) -> tuple[int, int]:
        """Adds the connector of a path; returns the ids of its predecessor and of the connector."""
        movement = way.movement
        source = self.lanes[self._incoming(movement.source, movement.source_lane)]
        target = self.lanes[self._outgoing(movement.target, movement.target_lane)]
        plane, _ = way.path.sample()
        points = np.column_stack((plane, np.full(len(plane), crossing.height)))
        points[0], points[-1] = source.points[-1], target.points[0]
        same = movement.source.street is movement.target.street
        connector = self._add(
            points,
            road_id=self._road(),
            lane_id=-1,
            widths=(movement.source.street.width, movement.target.street.width),
            speed_limit=min(source.speed_limit, target.speed_limit),
            street=self.layout.numbers[movement.source.street.id] if same else NO_STREET,
            junction_id=crossing.id,
        )
        self.links.append(LaneLink(connector, target.id, LinkType.STRAIGHT))
        return source.id, connector

    def _incoming(self, arm: Arm, lane: LaneEnd) -> int:
        return self.last[arm.segment, not arm.at_start, lane.number]

    def _outgoing(self, arm: Arm, lane: LaneEnd) -> int:
        return self.first[arm.segment, arm.at_start, lane.number]

    def approaches(self, crossing: Crossing) -> list[Approach]:
        """Returns the arms of a crossing with their lanes."""
        return [
            Approach(
                arm=arm,
                through=tuple(self.lanes[self._incoming(arm, lane)] for lane in arm.through),
                pocket=self.lanes[self._incoming(arm, arm.pocket)] if arm.pocket else None,
                outgoing=tuple(self.lanes[self._outgoing(arm, lane)] for lane in arm.outgoing),
            )
            for arm in self.layout.arms[crossing.id]
        ]

    def _road(self) -> int:
        self.roads += 1
        return self.roads - 1

    def _add(
        self,
        points: Array,
        *,
        road_id: int,
        lane_id: int,
        widths: tuple[float, float],
        speed_limit: float,
        street: int,
        junction_id: int = NO_JUNCTION,
    ) -> int:
        """Adds a lane whose width changes linearly from the first value to the second."""
        lane = Lane(
            id=len(self.lanes),
            road_id=road_id,
            lane_id=lane_id,
            junction_id=junction_id,
            points=points,
            widths=np.linspace(*widths, len(points)),
            speed_limit=speed_limit,
            street=street,
        )
        self.lanes.append(lane)
        return lane.id
