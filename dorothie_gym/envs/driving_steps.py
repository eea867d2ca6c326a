"""Decisions of many navigation environments at once (compiled): from the driver's action to observation and reward.

A decision has two halves, because rare events between them are Python's: `act` carries out the action and steps the
physics; `guide` lets the instructor speak, judges the episode, and observes. Where a half cannot go on alone, it says
so in `DriveRecord.stage`.
"""

from __future__ import annotations

import enum
import math
from typing import TYPE_CHECKING, Final, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.compilation import compiled, concurrent
from dorothie_gym.compilation.by_reference import by_reference, gives_row
from dorothie_gym.compilation.records import Flag, Float, Int32, RecordArray
from dorothie_gym.envs.episode import EpisodeArrays, judge
from dorothie_gym.maps.model import Array
from dorothie_gym.maps.route_arrays import RouteSearch
from dorothie_gym.maps.routing_graph import RoutingGraph
from dorothie_gym.ontology import ARRIVAL_DISTANCE, SPEED_STEP, DialogueMove
from dorothie_gym.policies.navigation.actions import (
    FIRST_TURN,
    LEFT,
    RIGHT,
    NavigationAction,
    prepares,
    turn_angle,
)
from dorothie_gym.policies.navigation.cost_to_go import cost_from
from dorothie_gym.policies.navigation.driver_view import DriverArrays
from dorothie_gym.policies.navigation.guidance_steps import attend, instruct
from dorothie_gym.policies.navigation.instructor_arrays import InstructorArrays
from dorothie_gym.policies.navigation.junction_exits import ExitArrays
from dorothie_gym.policies.navigation.observation_vector import observe
from dorothie_gym.policies.route_tables import RouteTables
from dorothie_gym.sim.batch.threads import take
from dorothie_gym.sim.config import FRAME_RATE
from dorothie_gym.sim.ego.briefing import note_props
from dorothie_gym.sim.ego.feasibility import may_change_cruise
from dorothie_gym.sim.ego.limits import EGO_STANDING
from dorothie_gym.sim.ego.manoeuvres import command
from dorothie_gym.sim.network.centre_lines import position_on
from dorothie_gym.sim.sensing.perception import switch_lamps
from dorothie_gym.sim.state.codes import J_TURN, LANE_FOLLOW, LANE_SWITCH, START, STOP, U_TURN, Refusal
from dorothie_gym.sim.step import step

if TYPE_CHECKING:
    from dorothie_gym.sim.state.town_arrays import TownArrays
    from dorothie_gym.sim.state.world_arrays import WorldArrays

CRUISE_LIMIT: Final = 100
"""Refusal of a cruise speed out of its range; the other codes are those of `codes.Refusal`."""

NEAR_WAYPOINT: Final = ARRIVAL_DISTANCE + 1e-6
"""Distance within which Python looks whether the ego has arrived [m]."""

_NOTHING, _FOLLOW, _SWITCH_LEFT, _SWITCH_RIGHT, _ROUND, _STOP, _START, _FASTER, _SLOWER, _LIGHTS = (
    int(action) for action in NavigationAction if action < FIRST_TURN
)
_INSTRUCT = int(DialogueMove.INSTRUCT.value)
_may_change_cruise = compiled(may_change_cruise)


class Stage(enum.IntEnum):
    """Progress of a decision."""

    DONE = 0
    """The half is done."""
    ACTING = 1
    """The action is still to be carried out."""
    NO_SPACE = 2
    """The path does not fit into the arrays: to be repeated with longer ones, see `world_arrays.lengthened`."""
    NO_COSTS = 3
    """The costs to the goal are missing, because a roadblock has been seen."""


_DONE, _ACTING, _NO_SPACE, _NO_COSTS = map(int, Stage)


class DriveRecord:
    """Decision of an environment."""

    speed: Float  # of the ego at its beginning [m/s]
    since: Float  # time of its beginning [s]
    goal_station: Float  # goal that progress is measured to [m]
    goal_lane: Int32  # -1 for none
    costs: Int32  # row of the costs to it
    new_costs: Int32  # row of the costs that were missing
    closed: Int32  # number of closed places that these costs know
    landmark: Int32  # landmark of the goal, -1 for none
    action: Int32  # `NavigationAction`
    stage: Int32  # `Stage`
    refusal: Int32  # `codes.Refusal` or `CRUISE_LIMIT`
    refused: Int32  # belief updates that were refused before
    acted: Flag  # whether a physical action was chosen
    halfway: Flag  # whether the action is carried out, and only the physics is to be repeated
    near: Flag  # whether the ego stands near a waypoint
    said: Flag  # whether an instruction was given at this decision
    fresh: Flag  # whether the goal has changed at this decision


@by_reference
class DriveArrays(NamedTuple):
    """Decision of an environment in arrays, or of each of a batch.

    Attributes:
        state: (1,) the decision.
        rows: int32 (landmarks,) row of the costs to each landmark, without roadblocks.
        waypoints: (landmarks, 2) places where the ego arrives [m].
    """

    state: RecordArray[DriveRecord]
    rows: NDArray[np.int32]
    waypoints: Array


@by_reference
class DrivingTown(NamedTuple):
    """What all environments of a town share, besides its arrays.

    Attributes:
        sectors: int32 sector of each exit of the route tables, or -1.
        costs: (rows, cells + lanes) costs to goals, see `cost_to_go.cost_from`.
        frames: substeps of a decision.
        max_seconds: time limit of an episode [s].
    """

    sectors: NDArray[np.int32]
    costs: Array
    frames: int
    max_seconds: float


T = TypeVar("T")


@gives_row
def row_of(batch: T, number: int) -> T:
    """Returns a row of each array of a named tuple: views, of the same types as those of a single environment."""
    row: T = type(batch)._make(array[number] for array in batch)  # type: ignore[attr-defined]  # of named tuples
    return row


# --- Action and physics -----------------------------------------------------------------------------------------------


@compiled
def act(town: TownArrays, world: WorldArrays, driver: DriverArrays, drive: DriveArrays, frames: int) -> None:
    """Carries out the action of a decision and steps the physics, as far as Python is not needed."""
    state = drive.state[0]
    if not state.halfway:
        state.speed, state.since = world.vehicles[0].speed, world.clock[0].frame / FRAME_RATE
        refusal = carry_out(town, world, driver, state)
        if refusal == Refusal.NO_SPACE:
            state.stage = _NO_SPACE
            return
        state.refusal, state.halfway = refusal, True
    if step(town, world, frames, 1.0 / FRAME_RATE) == Refusal.NO_SPACE:
        state.stage = _NO_SPACE
        return
    state.halfway, state.stage, state.near = False, _DONE, False
    ego = world.vehicles[0]
    if ego.speed <= EGO_STANDING:
        for k in range(len(drive.waypoints)):
            dx, dy = drive.waypoints[k, 0] - ego.x, drive.waypoints[k, 1] - ego.y
            state.near = state.near or dx * dx + dy * dy <= NEAR_WAYPOINT * NEAR_WAYPOINT


@compiled
def carry_out(town: TownArrays, world: WorldArrays, driver: DriverArrays, state: DriveRecord) -> int:
    """Carries out a navigation action; returns `codes.Refusal` or `CRUISE_LIMIT`."""
    number, plan = int(state.action), world.plan[0]
    state.acted = number != _NOTHING and not prepares(driver, number)
    if not state.acted:
        return Refusal.NONE
    if number == _LIGHTS:
        plan.lights = not plan.lights
        switch_lamps(world.eye[0], plan.lights)
        return Refusal.NONE
    if number == _FASTER or number == _SLOWER:
        if not _may_change_cruise(plan.cruise, number == _FASTER):
            return CRUISE_LIMIT
        plan.cruise += SPEED_STEP if number == _FASTER else -SPEED_STEP
        return Refusal.NONE
    order, angle = LANE_FOLLOW, 0
    if number >= FIRST_TURN:
        order, angle = J_TURN, turn_angle(driver, number - FIRST_TURN)
    elif number == _SWITCH_LEFT or number == _SWITCH_RIGHT:
        order, angle = LANE_SWITCH, LEFT if number == _SWITCH_LEFT else RIGHT
    elif number == _ROUND:
        order = U_TURN
    elif number == _STOP:
        order = STOP
    elif number == _START:
        order = START
    return command(town, world, order, angle, world.vehicles[0].speed)


# --- Guidance, reward and observation ---------------------------------------------------------------------------------


@compiled
def guide(
    town: TownArrays, exits: ExitArrays, tables: RouteTables, graph: RoutingGraph, search: RouteSearch,
    common: DrivingTown, world: WorldArrays, driver: DriverArrays, guidance: InstructorArrays, drive: DriveArrays,
) -> None:  # fmt: skip
    """Lets the instructor speak after the physics; `NO_COSTS` if the costs to the goal are missing.

    Args:
        town: arrays of the town.
        exits: exits of its junctions.
        tables: its lanes and exits for guidance.
        graph: its routing graph.
        search: scratch space for route searches.
        common: what all environments of the town share.
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
    state.stage = _DONE
    if route.landmark >= 0 and route.closed > 0 and (state.fresh or route.closed != state.closed):
        state.stage = _NO_COSTS


@compiled
def note_seen(world: WorldArrays) -> None:
    """Notes the props that the ego sees, if there are any."""
    for k in range(len(world.props)):
        if world.props[k].present:
            note_props(world, int(world.clock[0].frame))
            return
    world.plan[0].props = 0


@compiled
def finish(
    town: TownArrays, exits: ExitArrays, graph: RoutingGraph, common: DrivingTown, world: WorldArrays,
    driver: DriverArrays, guidance: InstructorArrays, episode: EpisodeArrays, drive: DriveArrays, begins: bool,
) -> None:  # fmt: skip
    """Measures progress, judges the episode unless it begins, and observes; see `guide`."""
    state, route, outcome, plan = drive.state[0], guidance.route[0], episode.state[0], world.plan[0]
    last, lane, station = outcome.left, int(plan.lane), plan.station
    if not begins:
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
    if begins:
        outcome.counted = outcome.reached
    else:
        outcome.acted, outcome.refusals = state.acted, state.refused + (1 if state.refusal > 0 else 0)
        judge(world, episode)
    observe(town, exits, world, driver, graph.lanes, common.costs[state.costs], common.max_seconds)


@compiled
def _cost_to_go(graph: RoutingGraph, common: DrivingTown, state: DriveRecord, lane: int, station: float) -> float:
    """Returns the cost from a place to the present goal [m], infinite without one."""
    if state.goal_lane < 0:
        return math.inf
    return cost_from(graph.lanes, common.costs[state.costs], int(state.goal_lane), state.goal_station, lane, station)


# --- Shares of a thread -----------------------------------------------------------------------------------------------


@concurrent
def act_share(
    turns: NDArray[np.int64], home: int, town: TownArrays, worlds: WorldArrays, drivers: DriverArrays,
    drives: DriveArrays, frames: int,
) -> None:  # fmt: skip
    """Calls `act` for the environments whose stage is `ACTING` or `NO_SPACE`, until all are taken.

    Args:
        turns: numbers of the environments, see `threads.take`.
        home: number of the block that is this thread's own.
        town: arrays of the town.
        worlds: arrays of all worlds.
        drivers: arrays of all drivers.
        drives: all decisions.
        frames: substeps of a decision.
    """
    number = take(turns, home)
    while number >= 0:
        drive = row_of(drives, number)
        if drive.state[0].stage != _DONE:
            act(town, row_of(worlds, number), row_of(drivers, number), drive, frames)
        number = take(turns, home)


@concurrent
def guide_share(
    turns: NDArray[np.int64], home: int, town: TownArrays, exits: ExitArrays, tables: RouteTables,
    graph: RoutingGraph, searches: RouteSearch, common: DrivingTown, worlds: WorldArrays, drivers: DriverArrays,
    guidances: InstructorArrays, episodes: EpisodeArrays, drives: DriveArrays, playing: NDArray[np.int8],
) -> None:  # fmt: skip
    """Calls `guide` and `finish` for the environments that play, until all are taken.

    Args:
        turns: numbers of the environments, see `threads.take`.
        home: number of the block that is this thread's own, and of its scratch space.
        town: arrays of the town.
        exits: exits of its junctions.
        tables: its lanes and exits for guidance.
        graph: its routing graph.
        searches: scratch space for route searches of each thread.
        common: what all environments of the town share.
        worlds: arrays of all worlds.
        drivers: arrays of all drivers.
        guidances: arrays of all instructors.
        episodes: arrays of all episodes.
        drives: all decisions.
        playing: int8 (environments,) `PLAYS`, `BEGINS` or 0; those whose stage is `NO_COSTS` need `finish` only.
    """
    number = take(turns, home)
    while number >= 0:
        if playing[number] > 0:
            world, driver, drive = row_of(worlds, number), row_of(drivers, number), row_of(drives, number)
            guidance, search = row_of(guidances, number), row_of(searches, home)
            waited = drive.state[0].stage == _NO_COSTS
            if not waited:
                guide(town, exits, tables, graph, search, common, world, driver, guidance, drive)
            if waited or drive.state[0].stage == _DONE:
                drive.state[0].stage = _DONE
                episode = row_of(episodes, number)
                finish(town, exits, graph, common, world, driver, guidance, episode, drive, playing[number] == BEGINS)
        number = take(turns, home)


PLAYS, BEGINS = 1, 2
"""Environments that play a decision, and those whose episode begins."""
