"""From centre lines to a `Town`: lanes, typed connectors, streets, lights, crosswalks and sites."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path as FilePath

import numpy as np

from dorothie_gym.world.town.derive import lay_sites
from dorothie_gym.world.town.model import (
    NO_JUNCTION,
    NO_STREET,
    Array,
    Crosswalk,
    Junction,
    Lane,
    LaneLink,
    LinkType,
    Signal,
    SignalKind,
    Street,
    Town,
)
from dorothie_gym.world.town.yaml_town.geometry import Path, connect, wrap
from dorothie_gym.world.town.yaml_town.layout import SMALLEST_RADIUS, Arm, Layout, lay_out
from dorothie_gym.world.town.yaml_town.schema import JunctionPlan, read_plan

STRAIGHT_BELOW = math.radians(35.0)
"""A way through a junction that turns less than this goes straight on [rad]."""
LIGHT_HEIGHT, LIGHT_ASIDE = 3.0, 1.0
"""A traffic light hangs this high, and stands this far from the edge of the lane [m]."""
CROSSWALK_SPAN = (0.5, 3.5)
"""A crosswalk lies between these distances beyond the ends of the lanes, towards the junction [m]."""
CROSSWALK_ASIDE = 0.5
"""A crosswalk reaches this far beyond the edges of the lanes [m]."""
SITES = 24
"""Landmark sites in a town."""
_KMH = 1.0 / 3.6


def read_yaml_town(path: str | FilePath) -> Town:
    """Compiles a town file.

    Raises:
        TownError: with the file, the line, the element, and what to do.
    """
    return compile_town(lay_out(read_plan(FilePath(path))))


def compile_town(layout: Layout) -> Town:
    """Builds the town of a layout: first the lanes of all stretches, two for each, then the connectors."""
    build = _Build(layout)
    for k in range(len(layout.stretches)):
        build.add_stretch(k)
    for junction in layout.plan.junctions.values():
        build.add_junction(junction)
    lanes = tuple(build.lanes)
    links = tuple(sorted(build.links, key=lambda link: (link.source, link.target)))
    streets = tuple(
        Street(id=s.id, name=s.name, lanes=tuple(lane.id for lane in lanes if lane.street == s.id))
        for s in layout.plan.streets
    )
    return Town(
        name=layout.plan.name,
        lanes=lanes,
        links=links,
        junctions=build.junctions,
        streets=streets,
        sites=lay_sites(lanes, links, count=SITES),
        signals=build.signals(),
        crosswalks=build.crosswalks(),
    )


@dataclass
class _Build:
    """Lanes, links and junctions as they are added."""

    layout: Layout
    lanes: list[Lane] = field(default_factory=list)
    links: list[LaneLink] = field(default_factory=list)
    junctions: list[Junction] = field(default_factory=list)
    roads: int = 0

    def add_stretch(self, k: int) -> None:
        """Adds the lane along the street's direction (id 2k) and the one against it (id 2k + 1)."""
        street, centre = self.layout.stretches[k].street, self.layout.centres[k]
        for lane_id, path in ((-1, centre), (1, centre.reversed())):
            self._add(
                path.offset(street.width / 2.0).sample(),
                lane_id=lane_id,
                widths=(street.width, street.width),
                speed_limit=street.speed * _KMH,
                street=street.id,
            )
        self.roads += 1

    def add_junction(self, plan: JunctionPlan) -> None:
        """Adds a connector from every arm to every other one."""
        first = len(self.lanes)
        arms = self.layout.arms[plan.name]
        for arm in arms:
            for other in arms:
                if other is not arm:
                    self._connect(plan, arm, other)
        self.junctions.append(
            Junction(id=plan.id, position=plan.centre, connectors=tuple(range(first, len(self.lanes))))
        )

    def _connect(self, plan: JunctionPlan, arm: Arm, other: Arm) -> None:
        source, target = self.lanes[_incoming(arm)], self.lanes[_outgoing(other)]
        (_, out), (into, _) = self._ends(arm), self._ends(other)
        entry = (float(source.points[-1, 0]), float(source.points[-1, 1]), out)
        exit_ = (float(target.points[0, 0]), float(target.points[0, 1]), into)
        path = connect(entry, exit_)
        if path.smallest_radius < SMALLEST_RADIUS:
            plan.entry.fail(
                f"the way from {arm.street.name!r} to {other.street.name!r} is too tight: radius"
                f" {path.smallest_radius:.1f} m, at least {SMALLEST_RADIUS:g} m are needed; let them meet less sharply"
            )
        points = path.sample()
        points[0], points[-1] = entry[:2], exit_[:2]
        connector = self._add(
            points,
            lane_id=-1,
            widths=(arm.street.width, other.street.width),
            speed_limit=min(source.speed_limit, target.speed_limit),
            street=arm.street.id if arm.street is other.street else NO_STREET,
            junction_id=plan.id,
        )
        self.roads += 1
        self.links.append(LaneLink(source.id, connector, _turn_type(wrap(into - out))))
        self.links.append(LaneLink(connector, target.id, LinkType.STRAIGHT))

    def _ends(self, arm: Arm) -> tuple[float, float]:
        """Headings of an arm's lanes at the junction's edge: outgoing, incoming [rad]."""
        centre: Path = self.layout.centres[arm.stretch]
        outgoing = centre.start[2] if arm.at_start else wrap(centre.end[2] + math.pi)
        return outgoing, wrap(outgoing + math.pi)

    def _add(
        self,
        points: Array,
        *,
        lane_id: int,
        widths: tuple[float, float],
        speed_limit: float,
        street: int,
        junction_id: int = NO_JUNCTION,
    ) -> int:
        """Adds a lane of the current road; its width goes evenly from the first value to the second."""
        lane = Lane(
            id=len(self.lanes),
            road_id=self.roads,
            lane_id=lane_id,
            junction_id=junction_id,
            points=np.column_stack([points, np.zeros(len(points))]),
            widths=np.linspace(*widths, len(points)),
            speed_limit=speed_limit,
            street=street,
        )
        self.lanes.append(lane)
        return lane.id

    def signals(self) -> list[Signal]:
        """One light for each approach of a lit junction, at the right of the end of its lane."""
        approaches = [_incoming(arm) for name in self.layout.plan.lights for arm in self.layout.arms[name]]
        signals = []
        for k, lane in enumerate(self.lanes[approach] for approach in approaches):
            x, y = lane.position(lane.length, lane.widths[-1] / 2.0 + LIGHT_ASIDE)
            signals.append(
                Signal(
                    id=k,
                    kind=SignalKind.TRAFFIC_LIGHT,
                    position=(float(x), float(y), LIGHT_HEIGHT),
                    heading=wrap(lane.heading_at(lane.length) + math.pi),
                    lanes=(lane.id,),
                )
            )
        return signals

    def crosswalks(self) -> list[Crosswalk]:
        """One for each arm of the street at the junction."""
        plan, crosswalks = self.layout.plan, list[Crosswalk]()
        for name, street in plan.crosswalks:
            for arm in self.layout.arms[name]:
                if arm.street.id == street.id:
                    crosswalks.append(Crosswalk(id=len(crosswalks), outline=self._crosswalk(arm)))
        return crosswalks

    def _crosswalk(self, arm: Arm) -> Array:
        lane = self.lanes[_incoming(arm)]
        near, far = (lane.length + beyond for beyond in CROSSWALK_SPAN)
        right = lane.widths[-1] / 2.0 + CROSSWALK_ASIDE
        left = -1.5 * lane.widths[-1] - CROSSWALK_ASIDE  # across the other lane too
        return np.array([lane.position(s, d) for s, d in ((near, left), (near, right), (far, right), (far, left))])


def _incoming(arm: Arm) -> int:
    """Lane of the arm that drives towards the junction."""
    return 2 * arm.stretch + (1 if arm.at_start else 0)


def _outgoing(arm: Arm) -> int:
    """Lane of the arm that drives away from the junction."""
    return 2 * arm.stretch + (0 if arm.at_start else 1)


def _turn_type(turn: float) -> LinkType:
    """Type of a way through a junction by its change of heading [rad], positive to the right."""
    if abs(turn) < STRAIGHT_BELOW:
        return LinkType.STRAIGHT
    return LinkType.RIGHT if turn > 0 else LinkType.LEFT
