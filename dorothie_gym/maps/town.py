"""Town: lanes, links and objects along the roads, including traffic lights, with the queries of the simulation."""

from __future__ import annotations

import enum
from bisect import bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate

import numpy as np

from dorothie_gym.errors import TownError
from dorothie_gym.maps.driving_side import DrivingSide
from dorothie_gym.maps.lane_graph import LaneGraph, build_lane_graph
from dorothie_gym.maps.model import (
    Crosswalk,
    Exit,
    Junction,
    Lane,
    LaneLink,
    LinkType,
    Sidewalk,
    Signal,
    Site,
    Street,
)
from dorothie_gym.support.copying import digest_of, shared
from dorothie_gym.support.portable_math import wrap_degrees

# --- Traffic lights ---------------------------------------------------------------------------------------------------
# Traffic light programmes: the colour of each light of a junction as a function of time alone.

_SHORTLY = 1e-6  # [s] more than rounding moves the end of a phase


class LightColour(enum.StrEnum):
    """Colour of a traffic light."""

    GREEN = "green"
    YELLOW = "yellow"
    RED = "red"


@shared
@dataclass(frozen=True, kw_only=True)
class LightPhase:
    """Interval in which no light of the junction changes.

    Attributes:
        duration: [s], more than 0.
        green: ids of the green signals; signals in neither list are red.
        yellow: ids of the yellow signals.
    """

    duration: float
    green: tuple[int, ...] = ()
    yellow: tuple[int, ...] = ()

    def colour(self, signal: int) -> LightColour:
        """Returns the colour of a signal during the phase."""
        if signal in self.green:
            return LightColour.GREEN
        return LightColour.YELLOW if signal in self.yellow else LightColour.RED


@shared
@dataclass(frozen=True, kw_only=True)
class LightProgramme:
    """Cyclic programme of the lights of one junction.

    Attributes:
        junction_id: id of the junction.
        signals: ids of the signals that it controls.
        phases: phases in order, at least one.
        offset: start of the first phase in the first cycle [s].
    """

    junction_id: int
    signals: tuple[int, ...]
    phases: tuple[LightPhase, ...]
    offset: float = 0.0

    def __post_init__(self) -> None:
        if not self.phases or any(phase.duration <= 0.0 for phase in self.phases):
            raise ValueError(f"junction {self.junction_id}: a light programme needs phases, each longer than 0 s")

    @cached_property
    def _ends(self) -> tuple[float, ...]:
        return tuple(accumulate(phase.duration for phase in self.phases))

    @property
    def cycle(self) -> float:
        """Length of a cycle [s]."""
        return self._ends[-1]

    def phase_at(self, time: float) -> LightPhase:
        """Returns the phase at a simulated time [s]."""
        ends = self._ends
        return self.phases[bisect_right(ends, (time - self.offset) % ends[-1]) % len(ends)]

    def change_after(self, time: float) -> float:
        """Returns a simulated time up to which the phase stays that of `time`: shortly before its end [s]."""
        ends = self._ends
        passed = (time - self.offset) % ends[-1]
        return time + ends[bisect_right(ends, passed) % len(ends)] - passed - _SHORTLY

    def colour(self, signal: int, time: float) -> LightColour:
        """Returns the colour of a signal at a simulated time [s]."""
        return self.phase_at(time).colour(signal)


# --- Town -------------------------------------------------------------------------------------------------------------

SLOW_CRUISE = 40.0
"""Cruise speed in towns with slow traffic, such as the shipped ones [km/h]."""

MAX_EXTENT = 20_000.0
"""Largest extent of a town along x and y [m]; the index of its lanes takes 250 MB there."""


def check_extent(town: Town, source: str) -> None:
    """Raises `TownError` if a town is too large to be simulated.

    Args:
        town: the town.
        source: file or name that the message gives.
    """
    if not town.extent <= MAX_EXTENT:
        raise TownError(
            source,
            "town",
            f"spans {town.extent / 1000.0:g} km; at most {MAX_EXTENT / 1000.0:g} km can be simulated: remove far roads",
        )


@dataclass(frozen=True, kw_only=True)
class TownIdentity:
    """Identity of a town.

    Attributes:
        name: its name.
        content: digest of its parts, in hexadecimal.
    """

    name: str
    content: str


@shared
class Town:
    """Road map of a town. Immutable: do not modify its parts, they are cached and shared.

    Args:
        name: short name.
        lanes: all driving lanes, connectors through junctions included; `lanes[i].id` must be `i`.
        links: lane links, each once; successors come before lane changes.
        junctions: junctions in any order, with unique ids.
        streets: named streets; `streets[i].id` must be `i`.
        sites: places beside the lanes for landmarks.
        signals: traffic lights and signs.
        crosswalks: marked pedestrian crossings.
        sidewalks: pavements.
        programmes: traffic light programmes, one for each junction with lights.
        traffic: side of the road on which vehicles drive.
        cruise: cruise speed of the ego without a request [km/h], in a town with slow traffic like the paper's; None for
            a town where all drive as fast as lane, sight and weather allow.
        titled: whether people are to see and hear the names that the map has for its streets.

    Attributes:
        name, lanes, links, junctions, streets, sites: the arguments; sequences as tuples.
        signals, crosswalks, sidewalks: likewise.
        programmes, traffic, cruise, titled: likewise.
    """

    def __init__(
        self,
        *,
        name: str,
        lanes: Sequence[Lane],
        links: Sequence[LaneLink],
        junctions: Sequence[Junction],
        streets: Sequence[Street] = (),
        sites: Sequence[Site] = (),
        signals: Sequence[Signal] = (),
        crosswalks: Sequence[Crosswalk] = (),
        sidewalks: Sequence[Sidewalk] = (),
        programmes: Sequence[LightProgramme] = (),
        traffic: DrivingSide = DrivingSide.RIGHT,
        cruise: float | None = SLOW_CRUISE,
        titled: bool = False,
    ) -> None:
        self.name = name
        self.lanes = tuple(lanes)
        self.links = tuple(links)
        self.junctions = tuple(junctions)
        self.streets = tuple(streets)
        self.sites = tuple(sites)
        self.signals = tuple(signals)
        self.crosswalks = tuple(crosswalks)
        self.sidewalks = tuple(sidewalks)
        self.programmes = tuple(programmes)
        self.traffic = traffic
        self.cruise = cruise
        self.titled = titled

    @cached_property
    def identity(self) -> TownIdentity:
        """Name and content: equal for towns with equal parts, which copies of a town in other processes are."""
        parts = [self.lanes, self.links, self.junctions, self.streets, self.sites]
        beside = [self.signals, self.crosswalks, self.sidewalks, self.programmes, self.cruise]
        side: list[object] = [] if self.traffic is DrivingSide.RIGHT else [self.traffic]
        side += ["titled"] if self.titled else []
        return TownIdentity(name=self.name, content=digest_of([*parts, *beside, *side]))

    @cached_property
    def street_titles(self) -> tuple[str, ...]:
        """Name of each street in the map, for towns whose names people are to see; otherwise empty texts."""
        return tuple(street.name if self.titled and not street.is_inferred else "" for street in self.streets)

    @property
    def kilometres(self) -> float:
        """Length of all driving lanes, connectors included [km]."""
        return sum(lane.length for lane in self.lanes) / 1000.0

    @cached_property
    def extent(self) -> float:
        """Distance between the outermost points of the lanes along x or y, whichever is larger [m]; 0 without lanes."""
        ends = [(lane.points[:, :2].min(axis=0), lane.points[:, :2].max(axis=0)) for lane in self.lanes]
        if not ends:
            return 0.0
        low, high = (np.array(side) for side in zip(*ends, strict=True))
        return float((high.max(axis=0) - low.min(axis=0)).max())

    @cached_property
    def junction_indices(self) -> Mapping[int, int]:
        """Index in `junctions` by the id of the junction."""
        return {junction.id: index for index, junction in enumerate(self.junctions)}

    @cached_property
    def _links_from(self) -> tuple[tuple[LaneLink, ...], ...]:
        table: list[list[LaneLink]] = [[] for _ in self.lanes]
        for link in self.links:
            table[link.source].append(link)
        return tuple(tuple(row) for row in table)

    @cached_property
    def _predecessors(self) -> tuple[tuple[int, ...], ...]:
        table: list[list[int]] = [[] for _ in self.lanes]
        for link in self.links:
            if not link.type.is_lane_change:
                table[link.target].append(link.source)
        return tuple(tuple(row) for row in table)

    def successors(self, lane: int) -> tuple[LaneLink, ...]:
        """Returns the links from the end of a lane to the lanes that follow it, lane changes excluded.

        Raises:
            IndexError: no lane has this id.
        """
        return tuple(link for link in self._links_from[lane] if not link.type.is_lane_change)

    def predecessors(self, lane: int) -> tuple[int, ...]:
        """Returns the ids of the lanes that lead into the start of a lane, lane changes excluded.

        Raises:
            IndexError: no lane has this id.
        """
        return self._predecessors[lane]

    def neighbour(self, lane: int, side: LinkType) -> int | None:
        """Returns the parallel lane that a lane change leads to, or None.

        Args:
            lane: id of the lane.
            side: `LinkType.LANE_CHANGE_LEFT` or `LinkType.LANE_CHANGE_RIGHT`.

        Raises:
            IndexError: no lane has this id.
        """
        return next((link.target for link in self._links_from[lane] if link.type is side), None)

    @cached_property
    def _merges(self) -> dict[int, LinkType]:
        """Side of the lane change out of each lane without successors, by lane id."""
        found: dict[int, LinkType] = {}
        sides = self.traffic.to_middle, self.traffic.to_kerb
        ending = [lane.id for lane in self.lanes if not self.successors(lane.id)]
        leading = {lane.id for lane in self.lanes} - set(ending)
        while True:
            new: dict[int, LinkType] = {}
            for lane in ending:
                side = next((side for side in sides if self.neighbour(lane, side) in leading), None)
                if side is not None and lane not in leading:
                    new[lane] = side
            if not new:
                return found
            found.update(new)
            leading.update(new)

    def merge(self, lane: int) -> LinkType | None:
        """Returns the lane change by which a lane that ends is left; None where lanes follow, or none is beside.

        Of two sides the one with fewer changes to a lane that leads on, of equal ones that towards the middle.

        Raises:
            IndexError: no lane has this id.
        """
        return self._merges.get(self.lanes[lane].id)

    @cached_property
    def _lights(self) -> dict[int, tuple[LightProgramme, int]]:
        """Programme and signal id of the light at the end of each lane, by lane id."""
        programme_of = {signal: programme for programme in self.programmes for signal in programme.signals}
        return {
            lane: (programme_of[signal.id], signal.id)
            for signal in self.signals
            if signal.id in programme_of
            for lane in signal.lanes
        }

    def light(self, lane: int, time: float) -> LightColour | None:
        """Returns the colour of the traffic light at the end of a lane, or None if the lane has no light.

        Args:
            lane: id of the lane.
            time: simulated time [s].
        """
        found = self._lights.get(lane)
        return None if found is None else found[0].colour(found[1], time)

    def to_graph(self) -> LaneGraph:
        """Returns the town as a lane graph with its junction graph (the map input of TOTO); built once."""
        return self._graph

    @cached_property
    def _graph(self) -> LaneGraph:
        return build_lane_graph(
            name=self.name, lanes=self.lanes, links=self.links, junctions=self.junctions, streets=self.streets
        )

    @cached_property
    def _exits(self) -> tuple[tuple[Exit, ...], ...]:
        return tuple(self._find_exits(lane) for lane in self.lanes)

    def exits(self, lane: int) -> tuple[Exit, ...]:
        """Returns the exits from the end of a lane, sorted by angle from right to left.

        Raises:
            IndexError: no lane has this id.
        """
        return self._exits[lane]

    def _find_exits(self, lane: Lane) -> tuple[Exit, ...]:
        found, sign = [], self.traffic.sign
        for link in self.successors(lane.id):
            target, junction = self.lanes[link.target], self.lanes[link.target].junction_id
            seen = {target.id}
            while (
                target.in_junction and len(onward := self.successors(target.id)) == 1 and onward[0].target not in seen
            ):
                target = self.lanes[onward[0].target]
                seen.add(target.id)
            turn = wrap_degrees(sign * float(np.degrees(lane.headings[-1] - target.headings[0])))
            found.append((turn, link, target, junction))
        found.sort(key=lambda row: (row[0], row[2].id))
        used: set[int] = set()
        exits = []
        for turn, link, target, junction in found:
            angle = int(wrap_degrees(sign * round(turn)))
            while angle in used:
                angle = int(wrap_degrees(angle + sign))
            used.add(angle)
            exits.append(Exit(connector=link.target, lane=target.id, type=link.type, angle=angle, junction_id=junction))
        return tuple(exits[::sign])
