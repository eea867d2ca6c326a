"""The town as everybody else sees it: lanes, how they are linked, and what stands beside them.

Frame: metres, x east, y south, z up; headings in radians, clockwise seen from above (so positive to the right).
Angles of actions are degrees, positive to the LEFT: an angle is minus the change of heading (spec: ontology).
"""

from __future__ import annotations

import enum
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps.traffic_lights import LightColour, LightProgramme

if TYPE_CHECKING:
    from dorothie_gym.maps.lane_graph import LaneGraph

Array: TypeAlias = NDArray[np.float64]

NO_JUNCTION = -1
NO_STREET = -1

STRAIGHT_RATIO = 3.0
"""A segment this many times longer than the one beside it is a straight that meets a curve."""


class LinkType(enum.StrEnum):
    """How a lane goes on in another one."""

    STRAIGHT = "straight"
    LEFT = "left"
    RIGHT = "right"
    U_TURN = "uturn"
    LANE_CHANGE_LEFT = "left_lane_change"
    LANE_CHANGE_RIGHT = "right_lane_change"

    @property
    def is_lane_change(self) -> bool:
        """Whether the target runs beside the source instead of following it."""
        return self in (LinkType.LANE_CHANGE_LEFT, LinkType.LANE_CHANGE_RIGHT)


@dataclass(frozen=True, kw_only=True, eq=False)
class Lane:
    """A driving lane, described by its centre line in driving direction.

    Attributes:
        id: index of the lane in `Town.lanes`.
        road_id: OpenDRIVE road (in our own towns: the stretch of street between two junctions, or a connector).
        lane_id: OpenDRIVE lane number; its sign tells the two directions of a road apart.
        junction_id: junction that the lane crosses (then it is a connector), or -1.
        points: centre line (n, 3) [m], n >= 2, no two successive points equal in x and y.
        widths: width at each point (n,) [m].
        speed_limit: [m/s].
        street: index in `Town.streets`, or -1.
    """

    id: int
    road_id: int
    lane_id: int
    junction_id: int = NO_JUNCTION
    points: Array
    widths: Array
    speed_limit: float
    street: int = NO_STREET

    @cached_property
    def stations(self) -> Array:
        """Distance along the lane of each point (n,) [m], measured in the plane."""
        steps = np.hypot(*np.diff(self.points[:, :2], axis=0).T)
        return np.concatenate(([0.0], np.cumsum(steps)))

    @cached_property
    def headings(self) -> Array:
        """Direction of the centre line at each point (n,) [rad], unwrapped.

        An inner point takes the mean of its two segments as on an arc; beside a much longer segment it takes that one's
        direction, which is a straight, for it would have been cut finer otherwise. The ends go on with the curvature.
        """
        steps = np.diff(self.points[:, :2], axis=0)
        segment = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))  # (n-1,)
        if len(segment) == 1:
            return np.repeat(segment, 2)
        length = np.diff(self.stations)
        before, after = length[:-1], length[1:]
        inner = (segment[:-1] * after + segment[1:] * before) / (before + after)
        inner = np.where(before > STRAIGHT_RATIO * after, segment[:-1], inner)
        inner = np.where(after > STRAIGHT_RATIO * before, segment[1:], inner)
        first = segment[0] if length[0] > STRAIGHT_RATIO * length[1] else 2 * segment[0] - inner[0]
        last = segment[-1] if length[-1] > STRAIGHT_RATIO * length[-2] else 2 * segment[-1] - inner[-1]
        return np.concatenate(([first], inner, [last]))

    @property
    def length(self) -> float:
        """Length of the centre line in the plane [m]."""
        return float(self.stations[-1])

    @property
    def in_junction(self) -> bool:
        """Whether the lane is a connector through a junction."""
        return self.junction_id != NO_JUNCTION

    def position(self, longitudinal: float, lateral: float = 0.0) -> Array:
        """World position (2,) [m] at a distance along the lane and to its RIGHT; straight on beyond the ends."""
        s = float(np.clip(longitudinal, 0.0, self.length))
        x = np.interp(s, self.stations, self.points[:, 0])
        y = np.interp(s, self.stations, self.points[:, 1])
        heading = self.heading_at(s)
        c, n = np.cos(heading), np.sin(heading)
        over = longitudinal - s
        return np.array([x + over * c - lateral * n, y + over * n + lateral * c])

    def heading_at(self, longitudinal: float) -> float:
        """Direction of the lane [rad]."""
        return float(np.interp(longitudinal, self.stations, self.headings))

    def height_at(self, longitudinal: float) -> float:
        """Height of the lane [m]."""
        return float(np.interp(longitudinal, self.stations, self.points[:, 2]))

    def width_at(self, longitudinal: float) -> float:
        """Width of the lane [m]."""
        return float(np.interp(longitudinal, self.stations, self.widths))

    def project(self, position: Array) -> tuple[float, float]:
        """Closest place on the lane to a world position (2,).

        Returns:
            Distance along the lane in [0, length] [m], and signed distance from the centre line, positive right [m].
        """
        a, b = self.points[:-1, :2], self.points[1:, :2]
        d = b - a
        t = np.clip(np.einsum("ij,ij->i", position[:2] - a, d) / np.einsum("ij,ij->i", d, d), 0.0, 1.0)
        offset = position[:2] - (a + t[:, None] * d)
        k = int(np.argmin(np.einsum("ij,ij->i", offset, offset)))
        side = d[k, 0] * offset[k, 1] - d[k, 1] * offset[k, 0]
        distance = float(np.hypot(*offset[k]))
        s = self.stations[k] + t[k] * (self.stations[k + 1] - self.stations[k])
        return float(s), distance if side >= 0 else -distance


@dataclass(frozen=True)
class LaneLink:
    """Lane `source` goes on in lane `target`. A turn is typed on the link that enters the connector."""

    source: int
    target: int
    type: LinkType


@dataclass(frozen=True, kw_only=True)
class Exit:
    """A way on from the end of a lane.

    Attributes:
        connector: lane that is entered first (a connector of a junction, or plainly the next lane).
        lane: lane that the car is on after the junction.
        type: turn type.
        angle: yaw change to the exit in whole degrees in [-180, 180), positive left. The exits of a lane have
            different angles: equal ones are moved apart by a degree in their order from right to left.
        junction_id: junction that is crossed, or -1.
    """

    connector: int
    lane: int
    type: LinkType
    angle: int
    junction_id: int


@dataclass(frozen=True, kw_only=True)
class Junction:
    """Where roads meet.

    Attributes:
        id: the map's own number, unique in the town; plans (`PlanUpdate`) refer to it.
        position: centre (x, y) [m].
        connectors: lanes that cross it.
    """

    id: int
    position: tuple[float, float]
    connectors: tuple[int, ...]


@dataclass(frozen=True, kw_only=True)
class Street:
    """A street as people name it: lanes that go on straight across junctions. `name` is the map's own."""

    id: int
    name: str
    lanes: tuple[int, ...]


@dataclass(frozen=True, kw_only=True)
class Site:
    """A place beside a lane where a landmark may stand.

    Attributes:
        id: index in `Town.sites`.
        lane: lane it is reached from.
        station: distance along that lane of its waypoint, the place where a car stops for it [m].
        position: where the landmark stands (x, y) [m].
        waypoint: the closest place on the lane (x, y) [m].
        street: index of its street.
    """

    id: int
    lane: int
    station: float
    position: tuple[float, float]
    waypoint: tuple[float, float]
    street: int


class SignalKind(enum.StrEnum):
    """Signs and lights that the towns know."""

    TRAFFIC_LIGHT = "traffic_light"
    STOP = "stop"
    YIELD = "yield"
    SPEED = "speed"
    OTHER = "other"


@dataclass(frozen=True, kw_only=True)
class Signal:
    """A light or sign: where it stands (x, y, z) [m], where it faces [rad], and the lanes it rules."""

    id: int
    kind: SignalKind
    position: tuple[float, float, float]
    heading: float
    lanes: tuple[int, ...] = ()
    value: float | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class Crosswalk:
    """A marked crossing: its outline (n, 2) [m]."""

    id: int
    outline: Array


@dataclass(frozen=True, kw_only=True, eq=False)
class Sidewalk:
    """A pavement beside a street.

    Attributes:
        id: index in `Town.sidewalks`.
        points: its middle line (n, 3) [m].
        width: [m].
        street: index of its street, or -1.
    """

    id: int
    points: Array
    width: float
    street: int = NO_STREET


def wrap_degrees(angle: float) -> float:
    """The same angle in [-180, 180) [degrees]."""
    return (angle + 180.0) % 360.0 - 180.0


class Town:
    """A map to drive in.

    Attributes:
        name: short name.
        lanes: all driving lanes; `lanes[i].id == i`.
        links: lane links, those that go on before lane changes, each once.
        junctions, streets, sites, signals, crosswalks, sidewalks: what else the map has.
        programmes: of the traffic lights, one for each junction that has lights.
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

    @property
    def kilometres(self) -> float:
        """Length of all driving lanes, connectors included [km]."""
        return sum(lane.length for lane in self.lanes) / 1000.0

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
        """Links by which a lane goes on at its end."""
        return tuple(link for link in self._links_from[lane] if not link.type.is_lane_change)

    def predecessors(self, lane: int) -> tuple[int, ...]:
        """Lanes that go on in this one."""
        return self._predecessors[lane]

    def neighbour(self, lane: int, side: LinkType) -> int | None:
        """Lane beside this one that a lane change leads to; `side` is one of the two lane-change types."""
        return next((link.target for link in self._links_from[lane] if link.type is side), None)

    @cached_property
    def _lights(self) -> dict[int, tuple[LightProgramme, int]]:
        """By lane: the programme and the signal that rule its end."""
        programme_of = {signal: programme for programme in self.programmes for signal in programme.signals}
        return {
            lane: (programme_of[signal.id], signal.id)
            for signal in self.signals
            if signal.id in programme_of
            for lane in signal.lanes
        }

    def light(self, lane: int, time: float) -> LightColour | None:
        """What the traffic light at the end of a lane shows at a simulated time [s]; None where there is no light."""
        found = self._lights.get(lane)
        return None if found is None else found[0].colour(found[1], time)

    def to_graph(self) -> LaneGraph:
        """The town as a lane graph with its junction graph, as TOTO reads it; made once."""
        return self._graph

    @cached_property
    def _graph(self) -> LaneGraph:
        from dorothie_gym.maps.lane_graph import lane_graph  # it needs the model itself

        return lane_graph(self)

    @cached_property
    def _exits(self) -> tuple[tuple[Exit, ...], ...]:
        return tuple(self._find_exits(lane) for lane in self.lanes)

    def exits(self, lane: int) -> tuple[Exit, ...]:
        """Ways on from the end of a lane, from right to left."""
        return self._exits[lane]

    def _find_exits(self, lane: Lane) -> tuple[Exit, ...]:
        found = []
        for link in self.successors(lane.id):
            target, junction = self.lanes[link.target], self.lanes[link.target].junction_id
            seen = {target.id}
            while target.in_junction and len(on := self.successors(target.id)) == 1 and on[0].target not in seen:
                target = self.lanes[on[0].target]
                seen.add(target.id)
            turn = wrap_degrees(float(np.degrees(lane.headings[-1] - target.headings[0])))
            found.append((turn, link, target, junction))
        found.sort(key=lambda row: (row[0], row[2].id))
        used: set[int] = set()
        exits = []
        for turn, link, target, junction in found:
            angle = int(wrap_degrees(round(turn)))
            while angle in used:
                angle = int(wrap_degrees(angle + 1))
            used.add(angle)
            exits.append(Exit(connector=link.target, lane=target.id, type=link.type, angle=angle, junction_id=junction))
        return tuple(exits)
