"""Cheapest routes on the routing graph of a town, by Dijkstra's algorithm."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps.route_arrays import SETTLED, UNREACHED, PlaceRecord, RouteSearch
from dorothie_gym.maps.routing_graph import (
    CHANGE_LEFT,
    CHANGE_RIGHT,
    FOLLOW,
    LEAST_COST,
    NONE,
    SHARED,
    SLIGHTLY_BEHIND,
    RoutingEdge,
    RoutingGraph,
    add_changes,
    add_u_turn,
    cell_at,
    drive_on,
)
from dorothie_gym.support.compilation import compiled, inlined
from dorothie_gym.support.compilation.records import RecordArray

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array

# --- Start and goal of a search ---------------------------------------------------------------------------------------


@compiled
def find_departures(
    graph: RoutingGraph,
    search: RouteSearch,
    lane: int,
    station: float,
    goal_lane: int,
    goal_station: float,
    blocked: RecordArray[PlaceRecord],
    count: int,
) -> int:
    """Writes the edges from a start to `search.extra`: along its lane, and lane changes and U-turns that begin there.

    Args:
        graph: the routing graph.
        search: receives the edges.
        lane: lane of the start.
        station: station of the start [m].
        goal_lane: lane of the goal, for edges that connect both directly; -1 for none.
        goal_station: station of the goal [m].
        blocked: impassable places; in the cell of the start only those ahead count.
        count: number of impassable places.

    Returns:
        The number of edges.
    """
    extra, cell, nodes = search.extra, cell_at(graph, lane, station), len(graph.rows) - 1
    nearest = math.inf
    for k in range(count):
        place = blocked[k]
        if place.lane == lane and place.station >= station and cell_at(graph, lane, place.station) == cell:
            nearest = min(nearest, place.station)
    manoeuvres = _add_manoeuvres(graph, extra, lane, station, nearest)
    number = manoeuvres
    if goal_lane >= 0:
        number = _connect(graph, extra, manoeuvres, lane, station, goal_lane, goal_station, nearest)
    drive_on(graph, extra, 0, manoeuvres, nodes - len(graph.lanes) - 2)
    if nearest == math.inf:
        number = _follow(graph, extra, number, lane, station)
    for k in range(number):
        # obstacles in the cell of the start were already considered by position
        extra[k].source, extra[k].first = nodes - 2, cell + 1
    return number


@compiled
def _add_manoeuvres(
    graph: RoutingGraph, extra: RecordArray[RoutingEdge], lane: int, station: float, nearest: float
) -> int:
    """Adds the lane changes and U-turns from a station up to the nearest obstacle [m]; returns their number."""
    row = graph.lanes[lane]
    if row.junction:
        return 0
    number = 0
    for entry in (CHANGE_LEFT, CHANGE_RIGHT):
        added = add_changes(graph, lane, entry, station, extra, number)
        for k in range(number, added):
            if extra[k].leave + SHARED * extra[k].driven < nearest:
                extra[number] = extra[k]
                number += 1
    if station <= nearest:
        number = add_u_turn(graph, lane, station, station, extra, number)
    # also from the centre of the cell: just beyond a junction there may be no oncoming lane
    middle = (cell_at(graph, lane, station) - row.first + 0.5) * row.cell_size
    if station < middle <= nearest:
        number = add_u_turn(graph, lane, station, middle, extra, number)
    return number


@compiled
def _connect(
    graph: RoutingGraph,
    extra: RecordArray[RoutingEdge],
    number: int,
    lane: int,
    station: float,
    goal_lane: int,
    goal_station: float,
    nearest: float,
) -> int:
    """Adds edges from the start right to the goal, from the lane changes and U-turns found; returns the new number."""
    manoeuvres, cell = number, cell_at(graph, goal_lane, goal_station)
    goal, weight = len(graph.rows) - 2, graph.lanes[goal_lane].weight
    for k in range(manoeuvres):
        if extra[k].target == cell and extra[k].land <= goal_station:
            extra[number] = extra[k]
            edge = extra[number]
            edge.target, edge.cost = goal, edge.cost + max(goal_station - edge.land, 0.0) * weight
            number += 1
    within = cell == cell_at(graph, lane, station) and goal_station >= station - SLIGHTLY_BEHIND
    if within and nearest > goal_station:
        _set_along(extra, number, goal, max((goal_station - station) * weight, LEAST_COST), goal_lane, goal_station)
        number += 1
    return number


@compiled
def _set_along(extra: RecordArray[RoutingEdge], number: int, goal: int, cost: float, lane: int, station: float) -> None:
    """Writes an edge along a lane to the goal."""
    edge = extra[number]
    edge.target, edge.cost, edge.entry, edge.lane, edge.driven = goal, cost, FOLLOW, lane, 0.0
    edge.leave = edge.land = station
    edge.first, edge.last, edge.onto, edge.until = 0, NONE, 0, NONE


@compiled
def _follow(graph: RoutingGraph, extra: RecordArray[RoutingEdge], number: int, lane: int, station: float) -> int:
    """Adds the edges from a place along its lane; returns the new number."""
    row, cell = graph.lanes[lane], cell_at(graph, lane, station)
    gone = station - (cell - row.first) * row.cell_size
    for k in range(graph.rows[cell], graph.rows[cell + 1]):
        if graph.edges[k].entry == FOLLOW:
            extra[number] = graph.edges[k]
            extra[number].cost = max(extra[number].cost - gone * row.weight, LEAST_COST)
            number += 1
    return number


@compiled
def _add_arrivals(
    graph: RoutingGraph, search: RouteSearch, number: int, lane: int, station: float, manoeuvre_cost: float
) -> int:
    """Adds the edges to a goal: along its cell, and lane changes and U-turns that end before it in its cell.

    Each node keeps its cheapest one. Returns the new number of edges.
    """
    extra, nodes, row = search.extra, search.nodes, graph.lanes[lane]
    cell, goal = cell_at(graph, lane, station), len(graph.rows) - 2
    for k in range(graph.manoeuvre_rows[cell], graph.manoeuvre_rows[cell + 1]):
        if graph.manoeuvres[k].land <= station:
            extra[number] = graph.manoeuvres[k]
            edge = extra[number]
            edge.target = goal
            edge.cost += max(station - edge.land, 0.0) * row.weight + manoeuvre_cost
            node = nodes[edge.source]
            if node.arrival < 0 or edge.cost < extra[node.arrival].cost:
                node.arrival = number
            number += 1
    cost = max((station - (cell - row.first) * row.cell_size) * row.weight, LEAST_COST)
    _set_along(extra, number, goal, cost, lane, station)
    extra[number].source = cell
    if nodes[cell].arrival < 0 or cost < extra[nodes[cell].arrival].cost:
        nodes[cell].arrival = number
    return number + 1


# --- Search -----------------------------------------------------------------------------------------------------------


@compiled
def find_route(
    graph: RoutingGraph, search: RouteSearch, lane: int, station: float, goal_lane: int, goal_station: float,
    blocked: RecordArray[PlaceRecord], count: int, manoeuvre_cost: float,
) -> bool:  # fmt: skip
    """Finds the cheapest route between two places and writes it to `search`; returns whether there is one.

    Of paths with equal costs, to the last bit, the one with the smaller node before the last difference counts.

    Args:
        graph: the routing graph.
        search: receives the route.
        lane: lane of the start.
        station: station of the start [m].
        goal_lane: lane of the goal; one slightly behind the start on the same lane needs a detour.
        goal_station: station of the goal [m].
        blocked: impassable places (roadblocks). The route does not enter their cells, nor by lane changes; in the cell
            of the start only those ahead count.
        count: number of impassable places.
        manoeuvre_cost: extra cost of each lane change and U-turn [m].
    """
    result, goal, extra = search.result[0], len(graph.rows) - 2, search.extra
    result.steps, result.legs, result.cost = 0, 0, math.inf
    _prepare(graph, search, blocked, count, True)
    departures = find_departures(graph, search, lane, station, goal_lane, goal_station, blocked, count)
    for k in range(departures):
        extra[k].cost += manoeuvre_cost if extra[k].entry != FOLLOW else 0.0
    _drop_dearer(extra, departures)
    result.extra = _add_arrivals(graph, search, departures, goal_lane, goal_station, manoeuvre_cost)
    _drop_closed(search, count)
    size = 0
    for k in range(departures):
        if extra[k].target >= 0:
            size = _reach(search, size, extra[k].target, len(graph.edges) + k, extra[k].cost)
    found = False
    while size and not found:
        node = int(search.heap[0].node)
        size = _settle(search, size)
        found = node == goal
        cost = search.nodes[node].cost
        for k in range(graph.rows[node], graph.rows[node + 1]):
            if count == 0 or _is_clear(search.closed, graph.edges, k):
                extra_cost = manoeuvre_cost if graph.edges[k].entry != FOLLOW else 0.0
                size = _reach(search, size, graph.edges[k].target, k, cost + (graph.edges[k].cost + extra_cost))
        k = search.nodes[node].arrival
        if k >= 0:
            size = _reach(search, size, goal, len(graph.edges) + k, cost + extra[k].cost)
    _prepare(graph, search, blocked, count, False)
    if found:
        result.cost = search.nodes[goal].cost
        _trace(graph, search)
        _lay(graph, search, lane, station, goal_station)
    return found


@compiled
def find_costs(
    graph: RoutingGraph,
    search: RouteSearch,
    lane: int,
    station: float,
    blocked: RecordArray[PlaceRecord],
    count: int,
    costs: Array,
) -> None:
    """Writes the costs to a goal [m]; infinite without a route.

    Args:
        graph: the routing graph.
        search: scratch space.
        lane: lane of the goal.
        station: station of the goal [m].
        blocked: impassable places.
        count: number of impassable places.
        costs: (cells + lanes,) receives the costs from the starts of the cells and, for the ends of the lanes, those
            from the starts of the next lanes, without the turn.
    """
    _prepare(graph, search, blocked, count, True)
    search.result[0].extra = _add_arrivals(graph, search, 0, lane, station, 0.0)
    _drop_closed(search, count)
    size = 0
    for k in range(search.result[0].extra):
        source = search.extra[k].source
        if search.nodes[source].arrival == k:
            size = _reach(search, size, source, k, search.extra[k].cost)
    while size:
        node = int(search.heap[0].node)
        size = _settle(search, size)
        cost = search.nodes[node].cost
        for at in range(graph.incoming_rows[node], graph.incoming_rows[node + 1]):
            k = graph.incoming[at]
            if count == 0 or _is_clear(search.closed, graph.edges, k):
                size = _reach(search, size, graph.edges[k].source, k, cost + graph.edges[k].cost)
    _prepare(graph, search, blocked, count, False)
    cells = len(costs) - len(graph.lanes)
    for cell in range(cells):
        reached = search.nodes[cell]
        costs[cell] = reached.cost if reached.place == SETTLED else math.inf
    for tail in range(cells, len(costs)):
        costs[tail] = math.inf
        for k in range(graph.rows[tail], graph.rows[tail + 1]):
            costs[tail] = min(costs[tail], costs[graph.edges[k].target])


@compiled
def _prepare(
    graph: RoutingGraph, search: RouteSearch, blocked: RecordArray[PlaceRecord], count: int, begins: bool
) -> None:
    """Closes the cells of impassable places and forgets the last search; or, at its end, opens the cells again."""
    for k in range(count):
        search.closed[cell_at(graph, blocked[k].lane, blocked[k].station)] = begins
    if begins:
        for k in range(len(search.nodes)):
            search.nodes[k].place, search.nodes[k].arrival = UNREACHED, NONE


@compiled
def _drop_dearer(extra: RecordArray[RoutingEdge], number: int) -> None:
    """Drops each edge beside which a cheaper one leads to the same node: their target becomes -1."""
    for k in range(number):
        for other in range(number):
            if other != k and extra[other].target == extra[k].target:
                if extra[other].cost < extra[k].cost or (extra[other].cost == extra[k].cost and other < k):
                    extra[k].target = NONE
                    break


@compiled
def _drop_closed(search: RouteSearch, count: int) -> None:
    """Drops the edges from the start and to the goal that lead through closed cells."""
    if count == 0:
        return
    extra, nodes = search.extra, search.nodes
    for k in range(search.result[0].extra):
        if extra[k].target >= 0 and not _is_clear(search.closed, extra, k):
            extra[k].target = NONE
            if nodes[extra[k].source].arrival == k:
                nodes[extra[k].source].arrival = NONE


@compiled
def _is_clear(closed: NDArray[np.bool_], edges: RecordArray[RoutingEdge], number: int) -> bool:
    """Returns whether an edge neither ends in nor traverses closed cells."""
    edge = edges[number]
    if closed[edge.target]:
        return False
    for cell in range(edge.first, edge.last + 1):
        if closed[cell]:
            return False
    for cell in range(edge.onto, edge.until + 1):
        if closed[cell]:
            return False
    return True


@compiled
def _reach(search: RouteSearch, size: int, number: int, edge: int, cost: float) -> int:
    """Records an edge to a node if no cheaper one was found before; returns the size of the heap."""
    heap, nodes = search.heap, search.nodes
    node = nodes[number]
    at = int(node.place)
    if at == UNREACHED:
        at, size = size, size + 1
    elif at == SETTLED or not cost < node.cost:
        return size
    node.cost, node.edge = cost, edge
    while at:
        above = (at - 1) // 2
        other = int(heap[above].node)
        if not _is_before(cost, number, heap[above].cost, other):
            break
        heap[at].cost, heap[at].node = heap[above].cost, other
        nodes[other].place = at
        at = above
    heap[at].cost, heap[at].node = cost, number
    node.place = at
    return size


@compiled
def _settle(search: RouteSearch, size: int) -> int:
    """Takes the nearest node from the heap; returns the size of the heap."""
    heap, nodes = search.heap, search.nodes
    nodes[heap[0].node].place = SETTLED
    size -= 1
    if size == 0:
        return 0
    cost, number, at = heap[size].cost, int(heap[size].node), 0
    while 2 * at + 1 < size:
        below = 2 * at + 1
        one, other = heap[below], heap[min(below + 1, size - 1)]
        if _is_before(other.cost, int(other.node), one.cost, int(one.node)):
            below += 1
        least, first = heap[below].cost, int(heap[below].node)
        if not _is_before(least, first, cost, number):
            break
        heap[at].cost, heap[at].node = least, first
        nodes[first].place = at
        at = below
    heap[at].cost, heap[at].node = cost, number
    nodes[number].place = at
    return size


@inlined
def _is_before(cost: float, node: int, than: float, other: int) -> bool:
    """Returns whether a node with a cost is settled before another one."""
    return cost < than or (cost == than and node < other)


# --- Route ------------------------------------------------------------------------------------------------------------


@compiled
def _trace(graph: RoutingGraph, search: RouteSearch) -> None:
    """Writes the edges of the route found, in order, to `search.path`."""
    path, start, node = search.path, len(graph.rows) - 3, len(graph.rows) - 2
    steps = 0
    while node != start:
        number = search.nodes[node].edge
        path[steps] = number
        steps += 1
        beyond = number - len(graph.edges)
        node = search.extra[beyond].source if beyond >= 0 else graph.edges[number].source
    for k in range(steps // 2):
        path[k], path[steps - 1 - k] = path[steps - 1 - k], path[k]
    search.result[0].steps = steps


@compiled
def _lay(graph: RoutingGraph, search: RouteSearch, lane: int, station: float, goal_station: float) -> None:
    """Writes the legs of the route found."""
    legs, result = search.legs, search.result[0]
    leg, count = legs[0], 1
    leg.lane, leg.entry, leg.start = lane, FOLLOW, station
    for k in range(result.steps):
        beyond = search.path[k] - len(graph.edges)
        edges, number = (search.extra, beyond) if beyond >= 0 else (graph.edges, search.path[k])
        edge = edges[number]
        search.driven[k] = edge.driven
        if edge.entry == FOLLOW and edge.leave == edge.land:
            continue  # within a lane
        leg.end = edge.leave
        leg = legs[count]
        count += 1
        leg.lane, leg.entry, leg.start = edge.lane, edge.entry, edge.land
    leg.end = goal_station
    result.legs = count
