"""Decision of the navigation environments (compiled), many at once: from the driver's action to observation and reward.

A decision has two halves, because rare events between them are Python's: `act` carries out the action and steps the
physics; `guide` lets the instructor speak, judges the episode, and observes. If a half needs Python to continue, it
sets `DriveRecord.stage`.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.envs.navigation.ad_wizard_trigger import look_for_moment
from dorothie_gym.envs.navigation.continuous_control import find_path, has_lost_path, instructed_manoeuvre, observe_path
from dorothie_gym.envs.navigation.decision_state import (
    CRUISE_LIMIT,
    EVENTS,
    DriveArrays,
    DriveRecord,
    DrivingTown,
    Event,
    Stage,
    row_of,
)
from dorothie_gym.envs.navigation.episode import EpisodeArrays, judge
from dorothie_gym.ontology.actions import SPEED_STEP, PhysicalAction
from dorothie_gym.ontology.dialogue_acts import DialogueMove
from dorothie_gym.ontology.slots import ARRIVAL_DISTANCE
from dorothie_gym.policies.navigation.actions import NavigationAction, order_of
from dorothie_gym.policies.navigation.cost_to_go import cost_from
from dorothie_gym.policies.navigation.guidance_steps import attend, instruct
from dorothie_gym.policies.navigation.observation_vector import observe
from dorothie_gym.sim.batch.threads import take
from dorothie_gym.sim.config import FRAME_RATE
from dorothie_gym.sim.ego.decision_setup import note_props
from dorothie_gym.sim.ego.limits import EGO_STANDING, may_change_cruise
from dorothie_gym.sim.ego.manoeuvres import command
from dorothie_gym.sim.ego.path_builder import point_before, position_on
from dorothie_gym.sim.sensing.perception import switch_lamps
from dorothie_gym.sim.state.codes import Refusal
from dorothie_gym.sim.step import step
from dorothie_gym.sim.traffic.parameters import MAX_SUBSTEPS
from dorothie_gym.support.compilation import compiled, concurrent

if TYPE_CHECKING:
    from dorothie_gym.maps.route_arrays import RouteSearch
    from dorothie_gym.maps.routing_graph import RoutingGraph
    from dorothie_gym.policies.navigation.driver_view import DriverArrays
    from dorothie_gym.policies.navigation.instructor_arrays import InstructorArrays
    from dorothie_gym.policies.navigation.junction_exits import ExitArrays
    from dorothie_gym.policies.route_tables import RouteTables
    from dorothie_gym.sim.state.town_arrays import TownArrays
    from dorothie_gym.sim.state.world_arrays import WorldArrays

NEAR_WAYPOINT: Final = ARRIVAL_DISTANCE + 1e-6
"""Distance within which Python checks whether the ego has arrived [m]."""

_FASTER = int(NavigationAction.FASTER)
_INSTRUCT = int(DialogueMove.INSTRUCT.value)
_SPEED_CHANGE, _LIGHT_CHANGE = int(PhysicalAction.SPEED_CHANGE.value), int(PhysicalAction.LIGHT_CHANGE.value)
_may_change_cruise = compiled(may_change_cruise)


_DONE, _ACTING, _MOVING, _NO_SPACE, _GUIDING, _NO_COSTS, _LOST, _OBSERVING = map(int, Stage)
_WAITS, _NEAR, _IS_LOST, _TOLD = map(int, Event)


# --- Action and physics -----------------------------------------------------------------------------------------------


@compiled
def act(
    town: TownArrays,
    exits: ExitArrays,
    world: WorldArrays,
    driver: DriverArrays,
    drive: DriveArrays,
    frames: int,
    pedals: bool,
) -> None:
    """Carries out the action of a decision and steps the physics, or lays a new path, until Python is needed.

    Args:
        town: arrays of the town.
        exits: exits of its junctions.
        world: arrays of the world.
        driver: arrays of the driver.
        drive: the decision.
        frames: substeps of a decision.
        pedals: whether the driver uses throttle, steering and brake.
    """
    state = drive.state[0]
    if state.lost:
        found = find_path(town, world) != Refusal.NO_SPACE
        state.lost, state.stage = not found, _OBSERVING if found else _NO_SPACE
        return
    if not state.halfway:
        state.speed, state.since = world.vehicles[0].speed, world.clock[0].frame / FRAME_RATE
        refusal = carry_out(town, exits, world, driver, state, pedals)
        if refusal == Refusal.NO_SPACE:
            state.stage = _NO_SPACE
            return
        state.refusal, state.halfway, state.left = refusal, True, frames
    while state.left > 0:
        part = min(int(state.left), MAX_SUBSTEPS)
        if step(town, world, part, 1.0 / FRAME_RATE) == Refusal.NO_SPACE:
            state.stage = _NO_SPACE
            return
        state.left -= part
        if state.faulty and state.left > 0:
            state.stage = _MOVING
            return
    state.halfway, state.stage, state.near = False, _GUIDING, False
    ego = world.vehicles[0]
    if ego.speed <= EGO_STANDING:
        for k in range(len(drive.waypoints)):
            dx, dy = drive.waypoints[k, 0] - ego.x, drive.waypoints[k, 1] - ego.y
            state.near = state.near or dx * dx + dy * dy <= NEAR_WAYPOINT * NEAR_WAYPOINT


@compiled
def carry_out(
    town: TownArrays, exits: ExitArrays, world: WorldArrays, driver: DriverArrays, state: DriveRecord, pedals: bool
) -> int:
    """Carries out a navigation action, or plans the instructed manoeuvre of a driver with pedals.

    Returns:
        `codes.Refusal` or `CRUISE_LIMIT`.
    """
    plan = world.plan[0]
    if pedals:
        plan.throttle, plan.steer, plan.brake = state.controls[0], state.controls[1], state.controls[2]
        order, angle = instructed_manoeuvre(town, exits, world, driver)
    else:
        order, angle = order_of(driver, int(state.action))
    state.order = order
    if order == 0:
        return Refusal.NONE
    if order == _LIGHT_CHANGE:
        plan.lights = not plan.lights
        switch_lamps(world.eye[0], plan.lights)
        return Refusal.NONE
    if order == _SPEED_CHANGE:
        faster = state.action == _FASTER
        if not _may_change_cruise(plan.cruise, faster):
            return CRUISE_LIMIT
        plan.cruise += SPEED_STEP if faster else -SPEED_STEP
        plan.follows = False
        return Refusal.NONE
    return command(town, world, order, angle, world.vehicles[0].speed)


# --- Guidance, reward and observation ---------------------------------------------------------------------------------


@compiled
def guide(
    tables: RouteTables, graph: RoutingGraph, search: RouteSearch, town: TownArrays, common: DrivingTown,
    world: WorldArrays, driver: DriverArrays, guidance: InstructorArrays, drive: DriveArrays,
) -> None:  # fmt: skip
    """Lets the instructor speak after the physics; the stage becomes `NO_COSTS` if those to the goal are missing.

    Args:
        tables: lanes and exits of the town for guidance.
        graph: its routing graph.
        search: scratch space for route searches.
        town: its arrays.
        common: data that all environments of the town share.
        world: arrays of the world.
        driver: arrays of the driver.
        guidance: arrays of the instructor.
        drive: the decision.
    """
    state, heard, said, ego = drive.state[0], driver.heard[0], guidance.said[0], world.vehicles[0]
    now = world.clock[0].frame / FRAME_RATE
    note_seen(world)
    heard.driven += (now - state.since) * (state.speed + ego.speed) / 2.0
    attend(world, guidance)
    state.said = instruct(tables, graph, search, common.sectors, guidance)
    route = guidance.route[0]
    state.fresh = route.landmark != state.landmark
    if state.fresh:
        heard.goal_lane = -1
    if state.said:
        heard.distance, heard.time, heard.driven, heard.move = said.distance, said.time, 0.0, _INSTRUCT
        heard.action, heard.sector, heard.landmark, heard.street = said.action, said.sector, said.landmark, said.street
        if said.landmark >= 0 and said.action < 0:
            mark = guidance.marks[route.landmark]
            heard.goal_lane, heard.goal_station = mark.lane, mark.station
            heard.goal_x, heard.goal_y = position_on(town.points, town.lanes[mark.lane], mark.station)
    note_told_goal(world, guidance, state)
    if route.landmark >= 0 and route.closed > 0 and (state.fresh or route.closed != state.closed):
        state.stage = _NO_COSTS


@compiled
def note_told_goal(world: WorldArrays, guidance: InstructorArrays, state: DriveRecord) -> None:
    """Records whether a goal was stated, and its place, at the stated distance ahead, unless the map shows it."""
    said, landmark = guidance.said[0], int(guidance.route[0].landmark)
    state.told, state.told_lane = state.fresh or (state.said and said.landmark >= 0), -1
    if state.said and said.landmark >= 0 and said.action >= 0 and not guidance.marks[landmark].known:
        point = world.course[point_before(world, min(world.car[0].s + said.distance, world.plan[0].length))]
        state.told_lane, state.told_station = point.lane, int(point.station)


@compiled
def note_seen(world: WorldArrays) -> None:
    """Records the props that the ego sees, if there are any."""
    for k in range(len(world.props)):
        if world.props[k].present:
            note_props(world, int(world.clock[0].frame))
            return
    world.plan[0].props = 0


@compiled
def finish(
    graph: RoutingGraph,
    common: DrivingTown,
    world: WorldArrays,
    guidance: InstructorArrays,
    episode: EpisodeArrays,
    drive: DriveArrays,
) -> None:
    """Measures progress, and judges the episode unless it begins; see `guide`."""
    state, route, outcome, plan = drive.state[0], guidance.route[0], episode.state[0], world.plan[0]
    last, lane, station = outcome.left, int(plan.lane), plan.station
    if not state.begins:
        left = _cost_to_go(graph, common, state, lane, station)
        known = math.isfinite(left) and math.isfinite(last)
        outcome.progress = last - left if known else 0.0
    if state.fresh or route.closed != state.closed:
        outcome.renewed = True
    state.landmark, state.goal_lane = route.landmark, -1
    if route.landmark >= 0:
        mark = guidance.marks[route.landmark]
        state.goal_lane, state.goal_station = mark.lane, mark.station
        if route.closed == 0:
            state.costs = drive.rows[route.landmark]
        elif state.fresh or route.closed != state.closed:
            state.costs = state.new_costs
    state.closed = route.closed
    outcome.left = _cost_to_go(graph, common, state, lane, station)
    state.stage = _OBSERVING
    if state.begins:
        outcome.counted, state.begins = outcome.reached, False
        return
    outcome.acted, outcome.refusals = state.order > 0, state.refused + (1 if state.refusal > 0 else 0)
    judge(world, episode)
    if common.pedals and has_lost_path(world):
        state.lost, state.stage = True, _LOST


@compiled
def _cost_to_go(graph: RoutingGraph, common: DrivingTown, state: DriveRecord, lane: int, station: float) -> float:
    """Returns the cost from a place to the current goal [m], infinite without a goal."""
    if state.goal_lane < 0:
        return math.inf
    return cost_from(graph.lanes, common.costs[state.costs], int(state.goal_lane), state.goal_station, lane, station)


# --- Shares of a thread -----------------------------------------------------------------------------------------------


@concurrent
def act_share(
    turns: NDArray[np.int64], home: int, town: TownArrays, exits: ExitArrays, worlds: WorldArrays,
    drivers: DriverArrays, drives: DriveArrays, frames: int, pedals: bool,
) -> None:  # fmt: skip
    """Calls `act` for the environments whose stage is `ACTING`, `MOVING`, `NO_SPACE` or `LOST`, until none is left.

    Args:
        turns: numbers of the environments, see `threads.take`; events are noted in the column `EVENTS`.
        home: number of the block that is this thread's own.
        town: arrays of the town.
        exits: exits of its junctions.
        worlds: arrays of all worlds.
        drivers: arrays of all drivers.
        drives: all decisions.
        frames: substeps of a decision.
        pedals: whether the drivers use throttle, steering and brake.
    """
    number = take(turns, home)
    while number >= 0:
        drive = row_of(drives, number)
        stage = drive.state[0].stage
        if stage == _ACTING or stage == _MOVING or stage == _NO_SPACE or stage == _LOST:
            act(town, exits, row_of(worlds, number), row_of(drivers, number), drive, frames, pedals)
            stage = drive.state[0].stage
            turns[home, EVENTS] |= _WAITS if stage == _MOVING or stage == _NO_SPACE else 0
            turns[home, EVENTS] |= _NEAR if drive.state[0].near else 0
        number = take(turns, home)


@concurrent
def guide_share(
    turns: NDArray[np.int64], home: int, town: TownArrays, exits: ExitArrays, tables: RouteTables,
    graph: RoutingGraph, searches: RouteSearch, common: DrivingTown, worlds: WorldArrays, drivers: DriverArrays,
    guidances: InstructorArrays, episodes: EpisodeArrays, drives: DriveArrays,
) -> None:  # fmt: skip
    """Guides, judges and observes according to the stage of each environment, until none is left.

    Args:
        turns: numbers of the environments, see `threads.take`; events are noted in the column `EVENTS`.
        home: number of the block that is this thread's own, and of its scratch space.
        town: arrays of the town.
        exits: exits of its junctions.
        tables: its lanes and exits for guidance.
        graph: its routing graph.
        searches: scratch space for route searches of each thread.
        common: data that all environments of the town share.
        worlds: arrays of all worlds.
        drivers: arrays of all drivers.
        guidances: arrays of all instructors.
        episodes: arrays of all episodes.
        drives: all decisions.
    """
    number = take(turns, home)
    while number >= 0:
        drive = row_of(drives, number)
        state = drive.state[0]
        if state.stage == _GUIDING or state.stage == _NO_COSTS or state.stage == _OBSERVING:
            world, driver, guidance = row_of(worlds, number), row_of(drivers, number), row_of(guidances, number)
            waited = state.stage == _NO_COSTS
            if state.stage == _GUIDING:
                look_for_moment(tables.lanes, guidance.marks, world, drive.plans[0])
                guide(tables, graph, row_of(searches, home), town, common, world, driver, guidance, drive)
            if state.stage == _GUIDING or waited:
                finish(graph, common, world, guidance, row_of(episodes, number), drive)
            if state.stage == _OBSERVING:
                look_out(town, exits, graph, common, world, driver, state)
            turns[home, EVENTS] |= _WAITS if state.stage == _NO_COSTS else 0
            turns[home, EVENTS] |= _IS_LOST if state.stage == _LOST else 0
            turns[home, EVENTS] |= _TOLD if state.told else 0
        number = take(turns, home)


@compiled
def look_out(
    town: TownArrays,
    exits: ExitArrays,
    graph: RoutingGraph,
    common: DrivingTown,
    world: WorldArrays,
    driver: DriverArrays,
    state: DriveRecord,
) -> None:
    """Writes the observation of a driver, which ends the decision."""
    if common.pedals:
        observe_path(world, driver, common.max_seconds)
    else:
        observe(town, exits, world, driver, graph.lanes, common.costs[state.costs], common.max_seconds)
    state.stage = _DONE
