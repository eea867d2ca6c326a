"""Steps of the built-in instructor, compiled: choice of the goal, route, and the instruction that is due."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps.model import closest_on_segment
from dorothie_gym.maps.route_search import find_route
from dorothie_gym.maps.routing_graph import CHANGE_LEFT, NONE, U_TURN, RoutingGraph
from dorothie_gym.ontology.slots import ActionValue
from dorothie_gym.policies.navigation.instructor_arrays import LEGS_LEFT, InstructorArrays, StepKind
from dorothie_gym.policies.navigation.junction_exits import nearest_sector
from dorothie_gym.policies.route_legs import (
    PASSED,
    distance_left,
    find_crossing,
    find_leg,
    find_manoeuvre,
    needs_switch,
)
from dorothie_gym.policies.route_progress import ASTRAY, CELL_BEHIND, SAME_ROADBLOCK
from dorothie_gym.policies.scripted_agent_limits import GuidanceConfig
from dorothie_gym.sim.config import FRAME_RATE
from dorothie_gym.sim.ego.limits import EGO_STANDING, U_TURN_SPEED, u_turn_braking
from dorothie_gym.sim.sensing.perception import see
from dorothie_gym.sim.state.codes import STATIC
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation import compiled, inlined

if TYPE_CHECKING:
    from dorothie_gym.maps.route_arrays import RouteSearch
    from dorothie_gym.policies.route_tables import RouteTables
    from dorothie_gym.sim.state.world_arrays import WorldArrays

SWITCH_DISTANCE = 80.0
"""Distance at which a lane switch is announced [m]."""

REACTION_TIME = 1.5
"""Time from an instruction to its effect [s]."""

ON_LANE = 2.0
"""Largest distance of a roadblock on a lane from the centre line [m]."""

_CONFIG: Final = GuidanceConfig()
_TURN_DISTANCE, _STOP_DISTANCE = _CONFIG.turn_distance, _CONFIG.stop_distance
_REPEAT_AFTER, _ROADBLOCK_SIGHT = _CONFIG.repeat_after, _CONFIG.roadblock_sight
_ARRIVED_WITHIN = _CONFIG.arrived_within
_U_TURN_SPEED_SQUARED = U_TURN_SPEED * U_TURN_SPEED
_J_TURN, _SWITCH, _TURN_ROUND, _STOP, _START = (
    int(value.value)
    for value in (
        ActionValue.J_TURN,
        ActionValue.LANE_SWITCH,
        ActionValue.U_TURN,
        ActionValue.STOP,
        ActionValue.START,
    )
)
_u_turn_braking = inlined(u_turn_braking)
_LEFT, _RIGHT = nearest_sector(90.0), nearest_sector(-90.0)

_NO_STEP, _GOAL_STEP, _TURN_STEP, _ROUND_STEP, _SWITCH_STEP, _STOP_STEP, _ON_STEP = map(int, StepKind)

Step: TypeAlias = tuple[int, int, int, int, int, int, int, float]
"""Step before it is said: kind, the two numbers that identify it, action, street, landmark, sector, distance [m]."""


@compiled
def attend(world: WorldArrays, guide: InstructorArrays) -> None:
    """Reads the instructor's view from the arrays of a world.

    Args:
        world: arrays of the world.
        guide: the instructor, whose `now` and static bodies in sight are written.
    """
    view, plan, car, frame = guide.now[0], world.plan[0], world.vehicles[0], world.clock[0].frame
    view.lane, view.station, view.speed, view.time = plan.lane, plan.station, car.speed, frame / FRAME_RATE
    view.waits = plan.held and car.speed <= EGO_STANDING
    view.turning = max(plan.end - world.car[0].s, 0.1) if plan.off_line else 0.0
    view.things = 0
    if not _has_props(world):
        return
    count = see(world.vehicles, world.pedestrians, world.props, world.seen, world.eye[0], car.x, car.y, frame, 0)
    for row in range(min(count, len(guide.things))):
        body = world.seen[row]
        if body.kind == STATIC:
            thing = guide.things[view.things]
            view.things += 1
            dx, dy = body.x - car.x, body.y - car.y
            thing.x, thing.y, thing.distance = body.x, body.y, math.sqrt(dx * dx + dy * dy)


@compiled
def _has_props(world: WorldArrays) -> bool:
    for k in range(len(world.props)):
        if world.props[k].present:
            return True
    return False


@compiled
def instruct(
    tables: RouteTables, graph: RoutingGraph, search: RouteSearch, sectors: NDArray[np.int32], guide: InstructorArrays
) -> bool:
    """Gives an instruction if one is due; returns whether it does.

    Args:
        tables: exits of the town.
        graph: routing graph of the town.
        search: scratch space for route searches.
        sectors: sector of each exit of `tables`, or -1.
        guide: the instructor; `now`, the subgoals and the static bodies in sight describe the current decision.
    """
    view, route, said = guide.now[0], guide.route[0], guide.said[0]
    _choose_goal(graph, search, guide)
    if route.subgoal < 0:
        return False
    _note_roadblocks(graph, search, guide)
    if view.turning == 0.0:
        _follow(tables, graph, search, guide)
    mark = guide.marks[route.landmark]
    if view.by_name and mark.known:
        step = (_GOAL_STEP, int(route.landmark), 0, NONE, NONE, int(mark.name), NONE, 0.0)
    elif view.turning > 0.0:
        step = _stop_after_manoeuvre(guide)
    else:
        step = _next_step(tables, sectors, guide)
    kind, first, second, action, street, landmark, sector, distance = step
    if kind == _NO_STEP:
        return False
    repeated = kind == said.kind and first == said.first and second == said.second
    if repeated and said.given and view.time - said.time < _REPEAT_AFTER:
        return False
    said.kind, said.first, said.second, said.given = kind, first, second, True
    said.action, said.street, said.landmark, said.sector = action, street, landmark, sector
    said.distance, said.time = distance, view.time
    return True


# --- Goal and route ---------------------------------------------------------------------------------------------------


@compiled
def _choose_goal(graph: RoutingGraph, search: RouteSearch, guide: InstructorArrays) -> None:
    """Keeps the current subgoal while it is open; otherwise chooses the closest one that may be done now."""
    route, subgoals = guide.route[0], guide.subgoals
    if route.subgoal >= 0:
        now = subgoals[route.subgoal]
        if now.open and now.allowed and now.landmark == route.landmark:
            return
    route.subgoal, route.landmark, route.legs = NONE, NONE, 0
    guide.said[0].kind = _NO_STEP
    best = math.inf
    for k in range(len(subgoals)):
        landmark = subgoals[k].landmark
        if not (subgoals[k].open and subgoals[k].allowed and 0 <= landmark < len(guide.marks)):
            continue
        if guide.marks[landmark].name == 0:
            continue
        cost = _find_route(graph, search, guide, landmark)
        if route.subgoal < 0 or cost < best:
            best, route.subgoal, route.landmark = cost, k, landmark
            _take_route(search, guide)


@compiled
def _find_route(graph: RoutingGraph, search: RouteSearch, guide: InstructorArrays, landmark: int) -> float:
    """Finds a route to a landmark; where the roadblocks leave none, one that ignores them. Returns its cost [m]."""
    view, mark, count = guide.now[0], guide.marks[landmark], guide.route[0].closed
    while True:
        found = find_route(graph, search, view.lane, view.station, mark.lane, mark.station, guide.closed, count, 0.0)
        if found or count == 0:
            return float(search.result[0].cost)
        count = 0


@compiled
def _take_route(search: RouteSearch, guide: InstructorArrays) -> None:
    """Takes the route found last, or as many legs as there is room for; there is none if it has no legs."""
    route, count = guide.route[0], min(int(search.result[0].legs), len(guide.legs))
    for k in range(count):
        guide.legs[k] = search.legs[k]
    route.legs, route.leg, route.astray, route.cut = count, 0, 0, count < search.result[0].legs


@compiled
def _note_roadblocks(graph: RoutingGraph, search: RouteSearch, guide: InstructorArrays) -> None:
    """Adds roadblocks that have become visible, and plans around them."""
    view, route = guide.now[0], guide.route[0]
    if view.things == 0:
        return
    lanes = 0
    for k in range(route.leg, min(route.legs, route.leg + len(guide.ahead))):
        guide.ahead[lanes] = guide.legs[k].lane
        lanes += 1
    for k in range(view.things):
        thing = guide.things[k]
        if thing.distance > _ROADBLOCK_SIGHT:
            continue
        lane, station = _place_on(graph, guide.ahead, lanes, thing.x, thing.y)
        behind = lane == view.lane and station < view.station
        if lane < 0 or behind or _is_known(guide, lane, station) or route.closed + 2 > len(guide.closed):
            continue
        one, two = guide.closed[route.closed], guide.closed[route.closed + 1]
        one.lane, one.station = lane, station
        # its cell and the next one, because the car's own cell counts as free
        two.lane, two.station = lane, min(station + CELL_BEHIND, graph.lanes[lane].length)
        route.closed += 2
        _find_route(graph, search, guide, route.landmark)
        _take_route(search, guide)


@compiled
def _place_on(graph: RoutingGraph, lanes: NDArray[np.int32], count: int, x: float, y: float) -> tuple[int, float]:
    """Returns the first of the given lanes on which a point lies (-1: none), and the distance along it [m]."""
    points = graph.points
    for n in range(count):
        best, at, share = math.inf, 0, 0.0
        for k in range(graph.offsets[lanes[n]], graph.offsets[lanes[n] + 1] - 1):
            t, gap = closest_on_segment(points, k, x, y)
            if gap < best:
                best, at, share = gap, k, t
        dx = x - (points[at, 0] + share * (points[at + 1, 0] - points[at, 0]))
        dy = y - (points[at, 1] + share * (points[at + 1, 1] - points[at, 1]))
        if pm.hypot(dx, dy) <= ON_LANE:
            return int(lanes[n]), points[at, 2] + share * (points[at + 1, 2] - points[at, 2])
    return NONE, 0.0


@compiled
def _is_known(guide: InstructorArrays, lane: int, station: float) -> bool:
    """Returns whether a roadblock at a place is one of those known."""
    for k in range(guide.route[0].closed):
        place = guide.closed[k]
        if place.lane == lane and abs(place.station - station) < SAME_ROADBLOCK:
            return True
    return False


@compiled
def _follow(tables: RouteTables, graph: RoutingGraph, search: RouteSearch, guide: InstructorArrays) -> None:
    """Updates the progress on the route, and plans another one when the car has left it."""
    view, route = guide.now[0], guide.route[0]
    leg = find_leg(tables, guide.legs, route.legs, route.leg, view.lane, view.station)
    if leg >= 0:
        route.leg, route.astray = leg, 0
    else:
        route.astray += 1
    passed = route.legs > 0 and distance_left(guide.legs, route.legs, route.leg, view.station) < -PASSED
    if route.astray >= ASTRAY or passed:
        _find_route(graph, search, guide, route.landmark)
        _take_route(search, guide)
        guide.said[0].kind = _NO_STEP
    elif route.cut and route.leg >= route.legs - LEGS_LEFT:
        _find_route(graph, search, guide, route.landmark)
        _take_route(search, guide)


# --- Steps ------------------------------------------------------------------------------------------------------------


@compiled
def _nothing() -> Step:
    return _NO_STEP, 0, 0, NONE, NONE, NONE, NONE, 0.0


@compiled
def _send_on(waits: bool, distance: float) -> Step:
    """Returns a start for a stopped car."""
    return (_ON_STEP, 0, 0, _START, NONE, NONE, NONE, distance) if waits else _nothing()


@compiled
def _next_step(tables: RouteTables, sectors: NDArray[np.int32], guide: InstructorArrays) -> Step:
    """Returns the next step on the route if it is near; a stopped car is instructed to continue."""
    view, route, legs = guide.now[0], guide.route[0], guide.legs
    if route.astray:
        return _nothing()
    before, way, crossing = find_crossing(tables, legs, route.legs, route.leg, view.station, route.leg)
    entry, distance = find_manoeuvre(legs, route.legs, route.leg, view.station)
    left = distance_left(legs, route.legs, route.leg, view.station) if route.legs else math.inf
    if entry >= 0 and (before < 0 or distance < crossing):
        alone = entry == U_TURN or before < 0
        if not alone:
            behind = left - crossing
            alone = needs_switch(tables, view.lane, view.station, way, behind, guide.closed, route.closed)
        if alone:
            step = _manoeuvre_step(guide, entry, distance)
            if step[0] != _NO_STEP:
                return step
        if before < 0 or entry == U_TURN:
            return _send_on(view.waits, 0.0)
    if before < 0:
        return _stop_step(guide, left)
    if crossing > _TURN_DISTANCE:
        return _send_on(view.waits, 0.0)
    taken = tables.exits[way]
    street = tables.street[taken.lane]
    name = int(guide.names[street]) if 0 <= street < len(guide.names) else 0
    kind, lane, connector = _TURN_STEP, int(legs[before].lane), int(taken.connector)
    return kind, lane, connector, _J_TURN, name if name > 0 else NONE, NONE, int(sectors[way]), crossing


@compiled
def _manoeuvre_step(guide: InstructorArrays, entry: int, distance: float) -> Step:
    """Returns a U-turn, or a lane switch that is not part of a turn, if it is near."""
    view = guide.now[0]
    if entry == U_TURN:
        if distance <= REACTION_TIME * view.speed + _u_turn_braking(view.speed, _U_TURN_SPEED_SQUARED):
            return _ROUND_STEP, int(view.lane), 0, _TURN_ROUND, NONE, NONE, NONE, distance
        return _nothing()
    if distance > SWITCH_DISTANCE:
        return _nothing()
    left = entry == CHANGE_LEFT
    sector = _LEFT if left else _RIGHT
    return _SWITCH_STEP, int(view.lane), int(left), _SWITCH, NONE, NONE, sector, distance


@compiled
def _stop_after_manoeuvre(guide: InstructorArrays) -> Step:
    """Returns a stop for a goal right after the manoeuvre in progress, while there is time to stop."""
    view, mark = guide.now[0], guide.marks[guide.route[0].landmark]
    left = mark.station - view.station  # a car in a manoeuvre is reported at the manoeuvre's end
    if mark.lane == view.lane and -_ARRIVED_WITHIN <= left <= _STOP_DISTANCE:
        return _stop_step(guide, left + view.turning)
    return _send_on(view.waits, 0.0)


@compiled
def _stop_step(guide: InstructorArrays, left: float) -> Step:
    """Returns a stop at a distance [m]; a car that stands elsewhere than at the goal is instructed to continue."""
    view, row = guide.now[0], guide.route[0].landmark
    if view.waits:
        return _nothing() if abs(left) <= _ARRIVED_WITHIN else _send_on(True, left)
    if left > _STOP_DISTANCE:
        return _nothing()
    return _STOP_STEP, int(row), 0, _STOP, NONE, int(guide.marks[row].name), NONE, max(left, 0.0)
