"""Routing graph of a town in arrays: cells of about 10 m and the edges between them, with their costs."""

from __future__ import annotations

import enum
import math
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple, TypeAlias, cast

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps.lane_neighbours import across, oncoming_lanes
from dorothie_gym.maps.model import Array, IntArray, LaneTable, LinkType
from dorothie_gym.support.compilation import compiled
from dorothie_gym.support.compilation.records import (
    Flag,
    Float,
    Int32,
    RecordArray,
    argument,
    by_reference,
    empty_records,
    record_dtype,
)
from dorothie_gym.support.copying import shared

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town


class LaneEntry(enum.StrEnum):
    """Manoeuvre by which a lane of a route is entered."""

    FOLLOW = "follow"
    CHANGE_LEFT = "change_left"
    CHANGE_RIGHT = "change_right"
    U_TURN = "u_turn"


LANE_ENTRIES = tuple(LaneEntry)

FOLLOW, CHANGE_LEFT, CHANGE_RIGHT, U_TURN = (cast(int, np.int64(k)) for k in range(len(LANE_ENTRIES)))
"""Codes of the manoeuvres: indices into `LANE_ENTRIES`."""

NONE = cast(int, np.int64(-1))
"""No lane, node or edge."""

Place: TypeAlias = tuple[int, float]
"""Lane id and station [m]."""

CELL = 10.0
"""Approximate length of the cells into which lanes are divided [m]."""

CHANGE_LENGTH = 36.0
"""Planned length of a lane change [m]: three seconds at 40 km/h, plus the first metre."""

SHORT_CHANGE = 16.0
"""Shortest lane change [m]: 15 m for the planner and one metre for the request; each metre below `CHANGE_LENGTH` costs
double."""

CHANGE_LEAD = 1.0
"""Distance driven straight before a lane change begins [m]."""

CHANGE_COST = 10.0
"""Cost of a lane change [m]."""

END_COST = 100.0
"""Extra cost of a lane change close to the end of a lane, which is only made where the car is there already [m]."""

LATE_CHANGE = 0.01
"""Extra cost of a lane change for each metre along its lane: of equal ones the first is preferred."""

SHARED = 2.0 / 3.0
"""Share of a lane change during which obstacles matter: from its start for the lane that it leaves, before
its end for the other lane (lateral offset 1.7 m by then)."""

MAX_ASIDE = 6.0
"""Largest distance between the centre lines of lanes that one can change between [m]."""

TURN_COST = {LinkType.STRAIGHT: 0.0, LinkType.RIGHT: 5.0, LinkType.LEFT: 10.0, LinkType.U_TURN: 60.0}
"""Cost of a turn at a junction in right-hand traffic [m]."""

U_TURN_COST = 60.0
"""Cost of a U-turn between junctions [m]."""

U_TURN_LENGTH = 20.0
"""Length of a U-turn between junctions [m]."""

U_TURN_REST = 6.0
"""Distance between a U-turn and the earliest stop after it [m]."""

SLIGHTLY_BEHIND = 1.0
"""Distance by which a goal may lie behind the start without a detour [m]."""

LEAST_COST = 1e-3
"""Minimum cost of an edge [m]: searches of sparse graphs ignore edges without cost."""

USUAL_SPEED = 40.0 / 3.6
"""Reference speed of costs [m/s]: a metre with this limit costs one metre, with a higher limit less."""

SPEEDS = (10.0 / 3.6, 60.0 / 3.6)
"""Range to which speed limits are clipped [m/s]: a Co-Wizard never cruises at more than 60 km/h."""


class RoutingLane:
    """A lane of a town, divided into cells; indices are -1 if there is none."""

    length: Float  # [m]
    cell_size: Float  # length of its cells [m]
    weight: Float  # cost of a metre
    offset: Float  # start of the lane when all lanes are placed in one row with gaps of one metre [m]
    first: Int32  # first cell, and number of cells
    cells: Int32
    left: Int32  # lanes that one may change to
    right: Int32
    junction: Flag  # whether it is a connector through a junction
    end: Float  # station up to which it is wide enough for a car [m]
    merge: Int32  # entry of the change by which the lane must be left as it ends, or -1


class RoutingEdge:
    """An edge of the routing graph."""

    cost: Float  # [m at 40 km/h]
    leave: Float  # station on the previous lane at which the edge begins [m]
    land: Float  # station on `lane` at which it ends [m]
    driven: Float  # length of a lane change or U-turn [m], else 0
    source: Int32  # nodes
    target: Int32
    entry: Int32  # index into `LANE_ENTRIES`; FOLLOW within a lane and across its end
    lane: Int32  # lane at the end of the edge
    first: Int32  # range of traversed cells of the previous lane, both included; empty if `last` < `first`
    last: Int32
    onto: Int32  # the same for `lane`
    until: Int32


@by_reference
@shared
class RoutingGraph(NamedTuple):
    """Routing graph of a town; nodes are the starts of the cells in order, the tails of the lanes, start and goal.

    Attributes:
        lanes: lanes by their ids.
        points: (p, 6) points of the centre lines, see `polyline.LaneTable`.
        offsets: (lanes + 1,) first point of each lane, and p.
        ends: (lanes, 4) directions of their ends, see `polyline.LaneTable`.
        near: lanes that may be oncoming somewhere along a lane, lane by lane.
        near_rows: (lanes + 1,) their start for each lane.
        sign: that of the town's `DrivingSide`.
        edges: cheapest edge between each pair of cells and tails, sorted by source and target.
        rows: (nodes + 1,) first edge of each source, and the number of edges.
        incoming: edges sorted by target.
        incoming_rows: (nodes + 1,) first entry of `incoming` for each target, and the number of edges.
        manoeuvres: lane changes and U-turns from the starts of cells to the exact place where they end, whose cell is
            the target (in `edges` they lead to the start of the next cell instead), sorted by target.
        manoeuvre_rows: (nodes + 1,) the first of each target, and their number.
    """

    lanes: RecordArray[RoutingLane]
    points: Array
    offsets: IntArray
    ends: Array
    near: IntArray
    near_rows: IntArray
    sign: float
    edges: RecordArray[RoutingEdge]
    rows: IntArray
    incoming: IntArray
    incoming_rows: IntArray
    manoeuvres: RecordArray[RoutingEdge]
    manoeuvre_rows: IntArray

    @property
    def nodes(self) -> int:
        """Number of nodes."""
        return len(self.rows) - 1

    @property
    def cells(self) -> int:
        """Number of cells."""
        return self.nodes - len(self.lanes) - 2

    @property
    def start(self) -> int:
        """Node of the start of a search."""
        return self.nodes - 2

    @property
    def goal(self) -> int:
        """Node of the goal of a search."""
        return self.nodes - 1


@lru_cache(maxsize=16)
def routing_graph(town: Town) -> RoutingGraph:
    """Returns the routing graph of a town; built once for each town."""
    table, oncoming = LaneTable.of(town.lanes), oncoming_lanes(town)
    lanes = empty_records(RoutingLane, len(town.lanes))
    lengths = np.array([lane.length for lane in town.lanes])
    counts = np.maximum(1, np.round(lengths / CELL)).astype(np.int64)
    first = np.concatenate(([0], np.cumsum(counts)))
    lanes["length"], lanes["cells"], lanes["first"], lanes["cell_size"] = lengths, counts, first[:-1], lengths / counts
    lanes["weight"] = USUAL_SPEED / np.clip([lane.speed_limit for lane in town.lanes], *SPEEDS)
    lanes["offset"] = np.concatenate(([0.0], np.cumsum(lengths + 1.0)))[:-1]
    lanes["junction"] = [lane.in_junction for lane in town.lanes]
    for name, side in (("left", LinkType.LANE_CHANGE_LEFT), ("right", LinkType.LANE_CHANGE_RIGHT)):
        beside = [town.neighbour(lane.id, side) for lane in town.lanes]
        lanes[name] = [NONE if lane is None else lane for lane in beside]
    entries = {None: NONE, LinkType.LANE_CHANGE_LEFT: CHANGE_LEFT, LinkType.LANE_CHANGE_RIGHT: CHANGE_RIGHT}
    lanes["end"] = [lane.wide_until for lane in town.lanes]
    lanes["merge"] = [entries[town.merge(lane.id)] for lane in town.lanes]
    near = [oncoming.candidates(lane.id) for lane in town.lanes]
    none, no_rows, no_edges = np.zeros(0, dtype=np.int64), np.zeros(1, dtype=np.int64), empty_records(RoutingEdge, 0)
    bare = RoutingGraph(
        lanes, table.points, table.offsets, table.ends, np.concatenate([none, *near]),
        np.concatenate(([0], np.cumsum([len(each) for each in near]))), float(town.traffic.sign),
        no_edges, no_rows, none, no_rows, no_edges, no_rows,
    )  # fmt: skip
    cells = int(first[-1])
    nodes = cells + len(lanes) + 2
    manoeuvres = empty_records(RoutingEdge, 7 * cells)
    manoeuvres = manoeuvres[: find_manoeuvres(bare, manoeuvres)]
    following = _following(town, bare, cells)
    edges = empty_records(RoutingEdge, len(following) + len(manoeuvres))
    edges[: len(following)], edges[len(following) :] = following, manoeuvres
    drive_on(bare, edges, len(following), len(edges), cells)
    edges = cheapest(edges)
    manoeuvres = manoeuvres[np.argsort(manoeuvres["target"], kind="stable")]
    incoming = np.argsort(edges["target"], kind="stable")
    return bare._replace(
        lanes=argument(lanes),
        edges=argument(edges),
        rows=_rows(edges["source"], nodes),
        incoming=incoming,
        incoming_rows=_rows(edges["target"][incoming], nodes),
        manoeuvres=argument(manoeuvres),
        manoeuvre_rows=_rows(manoeuvres["target"], nodes),
    )


def _following(town: Town, graph: RoutingGraph, cells: int) -> RecordArray[RoutingEdge]:
    """Returns the edges between successive cells of each lane, and from the end of a lane to its successors.

    These begin in the last cell and in the tail of the lane, and end in the first cells of the successors.
    """
    lanes = graph.lanes
    owner = np.repeat(np.arange(len(lanes)), lanes["cells"])
    inner = np.ones(cells, dtype=np.bool_)
    inner[lanes["first"] + lanes["cells"] - 1] = False
    within = np.flatnonzero(inner)
    links = [link for link in town.links if not link.type.is_lane_change]
    source = np.array([link.source for link in links], dtype=np.int64)
    target = np.array([link.target for link in links], dtype=np.int64)
    turn = np.array([TURN_COST[town.traffic.as_right_hand(link.type)] for link in links])
    edges = empty_records(RoutingEdge, len(within) + 2 * len(links))
    edges["last"] = edges["until"] = NONE
    along, across_ends = edges[: len(within)], edges[len(within) :]
    ends, tails = across_ends[: len(links)], across_ends[len(links) :]
    lane = owner[within]
    along["source"], along["target"], along["lane"] = within, within + 1, lane
    along["leave"] = along["land"] = (within + 1 - lanes["first"][lane]) * lanes["cell_size"][lane]
    along["cost"] = lanes["cell_size"][lane] * lanes["weight"][lane]
    ends["source"] = lanes["first"][source] + lanes["cells"][source] - 1
    ends["cost"] = lanes["cell_size"][source] * lanes["weight"][source] + turn
    tails["source"], tails["cost"] = cells + source, np.maximum(turn, LEAST_COST)
    for crossing in (ends, tails):
        crossing["target"], crossing["lane"] = lanes["first"][target], target
        crossing["leave"] = lanes["length"][source]
    return edges


def cheapest(edges: RecordArray[RoutingEdge]) -> RecordArray[RoutingEdge]:
    """Returns only the cheapest edge between each pair of nodes, the first of equal ones, by source and target."""
    if not len(edges):
        return edges
    order = np.lexsort((edges["cost"], edges["target"], edges["source"]))
    source, target = edges["source"][order], edges["target"][order]
    new = (source[1:] != source[:-1]) | (target[1:] != target[:-1])
    return edges[order[np.concatenate(([True], new))]]


def joined(*tables: RecordArray[RoutingEdge]) -> RecordArray[RoutingEdge]:
    """Concatenates tables of edges."""
    edges = np.concatenate([empty_records(RoutingEdge, 0), *tables])
    return cast("RecordArray[RoutingEdge]", edges.astype(record_dtype(RoutingEdge), copy=False).view(np.recarray))


def _rows(keys: NDArray[np.int32], nodes: int) -> IntArray:
    return np.searchsorted(keys, np.arange(nodes + 1)).astype(np.int64)


# --- Geometry ---------------------------------------------------------------------------------------------------------


@compiled
def cell_at(graph: RoutingGraph, lane: int, station: float) -> int:
    """Returns the cell that contains a place."""
    row = graph.lanes[lane]
    return int(row.first) + min(max(int(station / row.cell_size), 0), int(row.cells) - 1)


@compiled
def oncoming_at(graph: RoutingGraph, lane: int, station: float) -> tuple[int, float, float]:
    """Returns the opposite point on the oncoming lane: lane (-1: none), station [m] and distance [m]."""
    near = graph.near[graph.near_rows[lane] : graph.near_rows[lane + 1]]
    return across(graph.points, graph.offsets, graph.ends, lane, station, near, graph.sign)


@compiled
def _position(graph: RoutingGraph, lane: int, station: float) -> tuple[float, float]:
    """Returns the position on a centre line [m], interpolated as by `np.interp` on all lanes in one row."""
    points, offset = graph.points, graph.lanes[lane].offset
    at = offset + station
    low, high = graph.offsets[lane], graph.offsets[lane + 1]
    while high - low > 1:
        middle = (low + high) // 2
        if points[middle, 2] + offset <= at:
            low = middle
        else:
            high = middle
    begin = points[low, 2] + offset
    if begin == at or high == len(points):
        return points[low, 0], points[low, 1]
    # after rounding, a station may lie beyond the end of the lane, in the gap before the next one
    end = points[high, 2] + (offset if high < graph.offsets[lane + 1] else graph.lanes[lane + 1].offset)
    width, ahead = end - begin, at - begin
    x = (points[high, 0] - points[low, 0]) / width * ahead + points[low, 0]
    y = (points[high, 1] - points[low, 1]) / width * ahead + points[low, 1]
    return x, y


@compiled
def _project(graph: RoutingGraph, lane: int, x: float, y: float) -> tuple[float, float]:
    """Returns station and distance of the point of a centre line that is closest to a position [m]."""
    points = graph.points
    along, away = 0.0, math.inf
    for k in range(graph.offsets[lane], graph.offsets[lane + 1] - 1):
        dx, dy = points[k + 1, 0] - points[k, 0], points[k + 1, 1] - points[k, 1]
        tx, ty = x - points[k, 0], y - points[k, 1]
        share = min(max((tx * dx + ty * dy) / (dx * dx + dy * dy), 0.0), 1.0)
        ex, ey = tx - share * dx, ty - share * dy
        gap = math.sqrt(ex * ex + ey * ey)
        if gap < away:
            away = gap
            along = points[k, 2] + share * (points[k + 1, 2] - points[k, 2])
    return along, away


# --- Lane changes and U-turns -----------------------------------------------------------------------------------------


@compiled
def find_manoeuvres(graph: RoutingGraph, edges: RecordArray[RoutingEdge]) -> int:
    """Writes the lane changes and U-turns from the starts of all cells outside junctions; returns their number.

    A U-turn begins in the middle of its cell.
    """
    count = 0
    for lane in range(len(graph.lanes)):
        row = graph.lanes[lane]
        for entry in (CHANGE_LEFT, CHANGE_RIGHT):
            for k in range(0 if row.junction else row.cells):
                count = add_changes(graph, lane, entry, k * row.cell_size, edges, count)
    for lane in range(len(graph.lanes)):
        row = graph.lanes[lane]
        for k in range(0 if row.junction else row.cells):
            begin = k * row.cell_size
            count = add_u_turn(graph, lane, begin, begin + 0.5 * row.cell_size, edges, count)
    return count


@compiled
def add_changes(
    graph: RoutingGraph, lane: int, entry: int, begin: float, edges: RecordArray[RoutingEdge], count: int
) -> int:
    """Adds lane changes of three lengths to one side from a station [m]; returns the number of edges.

    A lane that ends can also be left close to its end: that change leads beyond it.
    """
    row = graph.lanes[lane]
    beside = int(row.left) if entry == CHANGE_LEFT else int(row.right)
    if beside == NONE:
        return count
    for k in range(3):
        road, room = SHORT_CHANGE, row.length - begin
        if k == 1:
            road = (SHORT_CHANGE + CHANGE_LENGTH) / 2
        elif k == 2:
            road = min(CHANGE_LENGTH, room)  # the longest is limited by the rest of the lane
        if SHORT_CHANGE <= road <= room:
            count = _add_change(graph, lane, beside, entry, begin, road, edges, count)
    if row.merge == entry and row.length - begin < SHORT_CHANGE:
        added = _add_change(graph, lane, beside, entry, begin, SHORT_CHANGE, edges, count)
        for k in range(count, added):
            edges[k].cost += END_COST
        count = added
    return count


@compiled
def _add_change(
    graph: RoutingGraph,
    lane: int,
    beside: int,
    entry: int,
    begin: float,
    road: float,
    edges: RecordArray[RoutingEdge],
    count: int,
) -> int:
    """Adds a lane change of length `road` [m] if the lanes are adjacent there."""
    length = graph.lanes[lane].length
    leave, end = min(begin + CHANGE_LEAD, length), begin + road
    x, y = _position(graph, lane, leave)
    landing, first_gap = _project(graph, beside, x, y)
    x, y = _position(graph, lane, min(end, length))
    land, last_gap = _project(graph, beside, x, y)
    land = min(land + max(end - length, 0.0), graph.lanes[beside].length)
    if not (first_gap < MAX_ASIDE and last_gap < MAX_ASIDE):
        return count
    if graph.lanes[beside].merge != NONE and graph.lanes[lane].merge != entry:
        if land + SHORT_CHANGE > graph.lanes[beside].end:
            return count  # no room to leave the other lane again before it ends
    weight, edge = graph.lanes[lane].weight, edges[count]
    edge.source, edge.target = cell_at(graph, lane, begin), cell_at(graph, beside, land)
    edge.cost = road * weight + CHANGE_COST + 2.0 * (CHANGE_LENGTH - road) + LATE_CHANGE * begin
    edge.entry, edge.lane, edge.leave, edge.land, edge.driven = entry, beside, leave, land, end - leave
    edge.first, edge.last = edge.source, cell_at(graph, lane, leave + SHARED * (end - leave))
    edge.onto, edge.until = cell_at(graph, beside, land - SHARED * (land - landing)), edge.target
    return count + 1


@compiled
def add_u_turn(
    graph: RoutingGraph, lane: int, begin: float, leave: float, edges: RecordArray[RoutingEdge], count: int
) -> int:
    """Adds a U-turn at a station `leave`, if there is an oncoming lane with sufficient length beyond it.

    Args:
        graph: the routing graph.
        lane: lane before the U-turn.
        begin: station from which the cost counts [m].
        leave: station at which the U-turn begins [m].
        edges: where it is added.
        count: number of edges there.

    Returns:
        The number of edges.
    """
    row = graph.lanes[lane]
    inner = row.left if graph.sign > 0.0 else row.right
    if inner != NONE and row.length - leave >= SHORT_CHANGE:
        return count  # from such a lane only at its end
    other, station, _ = oncoming_at(graph, lane, leave)
    if other < 0 or not graph.lanes[other].length - station > CELL:
        return count
    edge, weight = edges[count], graph.lanes[other].weight
    edge.source, edge.target = cell_at(graph, lane, begin), cell_at(graph, other, station + U_TURN_REST)
    edge.cost = (leave - begin) * graph.lanes[lane].weight + U_TURN_LENGTH + U_TURN_COST + U_TURN_REST * weight
    edge.entry, edge.lane, edge.leave, edge.land = U_TURN, other, leave, station + U_TURN_REST
    edge.driven = U_TURN_LENGTH + U_TURN_REST
    edge.first, edge.last = 0, NONE
    edge.onto, edge.until = cell_at(graph, other, station), edge.target
    return count + 1


@compiled
def drive_on(graph: RoutingGraph, edges: RecordArray[RoutingEdge], first: int, last: int, cells: int) -> None:
    """Extends lane changes and U-turns to the start of the next cell, or to the tail of the lane."""
    for k in range(first, last):
        edge = edges[k]
        lane = graph.lanes[edge.lane]
        beyond = edge.target + 1 - lane.first
        if beyond == lane.cells:
            edge.target, ahead = cells + edge.lane, lane.length
        else:
            edge.target, ahead = edge.target + 1, beyond * lane.cell_size
        edge.cost += (ahead - edge.land) * lane.weight
