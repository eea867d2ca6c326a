"""Parts of observations and action masks that change at every decision, for many sessions at once (compiled)."""

from __future__ import annotations

import enum
import math
from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar, Final

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.ontology.actions import PhysicalAction
from dorothie_gym.ontology.roles import AGENT_ROLES, Role
from dorothie_gym.session.spaces.observations import ExitColumn, Observation
from dorothie_gym.session.view_arrays import (
    AdWizardArrays,
    CoWizardArrays,
    MaskArrays,
    ParticipantArrays,
    RoleArrays,
    RowView,
    TurnOptions,
    turn_options,
)
from dorothie_gym.sim.batch.threads import take, turns_of
from dorothie_gym.sim.config import FRAME_RATE
from dorothie_gym.sim.ego.limits import may_change_cruise
from dorothie_gym.sim.ego.manoeuvres import find_feasible
from dorothie_gym.sim.ego.motion_control import motion_of
from dorothie_gym.sim.ego.path_builder import SEARCH, last_point_before, progress_on_path
from dorothie_gym.sim.network.lane_lookup import closest_lane, wrap_radians
from dorothie_gym.sim.sensing.perception import see
from dorothie_gym.sim.state.codes import Feasible
from dorothie_gym.sim.state.world_arrays import WorldArrays, world_of
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation import compiled, concurrent, fixed
from dorothie_gym.support.compilation.records import RecordArray
from dorothie_gym.support.copying import CachedViews

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array
    from dorothie_gym.sim.state.records import CoursePointRecord
    from dorothie_gym.sim.state.town_arrays import TownArrays
    from dorothie_gym.sim.state.world_arrays import WorldArrays
    from dorothie_gym.sim.world import World

WAYPOINT_SPACING: Final = 5.0
"""Distance between the observed waypoints of the planned path [m]."""


class Wanted(enum.IntFlag):
    """Observations and masks that are written; masks are those of the Co-Wizard."""

    PARTICIPANT = 1
    CO_WIZARD = 2
    AD_WIZARD = 4
    MASKS = 8


EVERYTHING: Final = int(Wanted.PARTICIPANT | Wanted.CO_WIZARD | Wanted.AD_WIZARD | Wanted.MASKS)
"""Flags of all observations and masks."""

_PARTICIPANT, _CO_WIZARD, _AD_WIZARD, _MASKS = map(int, Wanted)
_LANE_FOLLOW, _LANE_SWITCH, _U_TURN, _J_TURN, _STOP, _START, _SPEED_CHANGE = (
    int(getattr(PhysicalAction, name).value)
    for name in ("LANE_FOLLOW", "LANE_SWITCH", "U_TURN", "J_TURN", "STOP", "START", "SPEED_CHANGE")
)
_MAY_FOLLOW, _MAY_SWITCH_LEFT, _MAY_SWITCH_RIGHT, _MAY_TURN_ROUND, _MAY_TURN = map(int, Feasible)
_DISTANCE, _ANGLE = int(ExitColumn.DISTANCE), int(ExitColumn.ANGLE)
_STRAIGHT: Final = 180
"""Row of the angle 0 in the mask of angles."""

_may_change_cruise = compiled(may_change_cruise)


@concurrent
def observe_share(
    turns: NDArray[np.int64], home: int, town: TownArrays, options: TurnOptions, worlds: WorldArrays,
    participants: ParticipantArrays, co_wizards: CoWizardArrays, ad_wizards: AdWizardArrays, masks: MaskArrays,
    wanted: int,
) -> None:  # fmt: skip
    """Writes the observations and masks of sessions, until all sessions of the batch have been taken.

    Args:
        turns: numbers of the sessions, see `threads.take`; shared by all threads that work on them.
        home: number of the block that is this thread's own.
        town: arrays of the town.
        options: exits after its lanes.
        worlds: arrays of the worlds of all sessions.
        participants: observations, written.
        co_wizards: observations, written.
        ad_wizards: observations, written.
        masks: masks, written.
        wanted: flags of `Wanted`.
    """
    number = take(turns, home)
    while number >= 0:
        world = world_of(worlds, number)
        if wanted & (_PARTICIPANT | _CO_WIZARD):
            write_objects(world, participants.objects[number], co_wizards.objects[number])
        if wanted & _PARTICIPANT:
            observe_as_participant(world, participants, number)
        if wanted & _CO_WIZARD:
            observe_as_co_wizard(town, options, world, co_wizards, number)
        if wanted & _AD_WIZARD:
            observe_as_ad_wizard(world, ad_wizards, number)
        if wanted & _MASKS:
            write_masks(town, options, world, masks.physical[number], masks.angle[number])
        number = take(turns, home)


@compiled
def write_objects(world: WorldArrays, objects: Array, believed: Array) -> None:
    """Writes the bodies that the ego perceives as rows of `ObjectColumn`, zeros after them.

    Args:
        world: arrays of the world.
        objects: table that is written (m, 8): perceived bodies at their places relative to the true pose.
        believed: table that is written (m, 8): at their places relative to the estimated pose. Distance and bearing
            in both tables are relative to the ego.
    """
    car, belief = world.vehicles[0], world.localizer[0]
    turn = belief.estimate[2] - car.heading
    cosine, sine = pm.cos(turn), pm.sin(turn)
    count = see(
        world.vehicles, world.pedestrians, world.props, world.seen, world.eye[0], car.x, car.y, world.clock[0].frame, 0
    )
    for row in range(len(objects)):
        if row >= count:
            for column in range(objects.shape[1]):
                objects[row, column] = believed[row, column] = 0.0
            continue
        body = world.seen[row]
        dx, dy = body.x - car.x, body.y - car.y
        distance, bearing = math.sqrt(dx * dx + dy * dy), wrap_radians(pm.atan2(dy, dx) - car.heading)
        for table in (objects, believed):
            table[row, 0], table[row, 3], table[row, 4] = body.kind, distance, bearing
            table[row, 5], table[row, 6], table[row, 7] = body.length, body.width, body.speed
        objects[row, 1], objects[row, 2] = body.x, body.y
        believed[row, 1] = belief.estimate[0] + dx * cosine - dy * sine
        believed[row, 2] = belief.estimate[1] + dx * sine + dy * cosine


@compiled
def write_lanes(course: RecordArray[CoursePointRecord], count: int, here: int, table: NDArray[np.int64]) -> None:
    """Writes the lanes of a path after a point, in order without repetition, as 1 + lane index, padded with zeros."""
    row, last = 0, -1
    for k in range(here, count):
        if row == len(table):
            return
        if course[k].lane != last:
            last = course[k].lane
            table[row] = last + 1
            row += 1
    table[row:] = 0


@compiled
def write_waypoints(
    course: RecordArray[CoursePointRecord], count: int, start: float, spacing: float, table: Array
) -> None:
    """Writes points of a path ahead of a place on it; before its start, the path is extended straight.

    Args:
        course: points of the path.
        count: number of points.
        start: distance along the path [m].
        spacing: distance between successive points, and from the start to the first [m].
        table: table that is written: positions (m, 2) [m].
    """
    end = count - 1
    for row in range(len(table)):
        at = start + (row + 1) * spacing
        if at < 0.0:
            table[row, 0] = course[0].x + at * pm.cos(course[0].heading)
            table[row, 1] = course[0].y + at * pm.sin(course[0].heading)
            continue
        at = min(at, course[end].s)
        k = min(last_point_before(course, count, at), end - 1)
        one, two = course[k], course[k + 1]
        t = min(max((at - one.s) / (two.s - one.s), 0.0), 1.0)
        table[row, 0] = one.x + t * (two.x - one.x)
        table[row, 1] = one.y + t * (two.y - one.y)


@compiled
def observe_as_participant(world: WorldArrays, views: ParticipantArrays, number: int) -> None:
    """Writes an observation of the participant without objects: true pose and place.

    Args:
        world: arrays of the world.
        views: observations, one row of which is written.
        number: the row.
    """
    car, plan = world.vehicles[0], world.plan[0]
    views.time[number, 0], views.speed[number, 0] = world.clock[0].frame / FRAME_RATE, car.speed
    views.pose[number, 0], views.pose[number, 1], views.pose[number, 2] = car.x, car.y, car.heading
    views.lane[number], views.station[number, 0], views.lights[number] = plan.lane, plan.station, plan.lights
    views.sight[number, 0] = world.eye[0].sight


@compiled
def observe_as_co_wizard(
    town: TownArrays, options: TurnOptions, world: WorldArrays, views: CoWizardArrays, number: int
) -> None:
    """Writes an observation of the Co-Wizard without objects: estimated pose and place, driving, and turn options.

    Distances on the map have the error of the estimated place.

    Args:
        town: arrays of the town.
        options: exits after its lanes.
        world: arrays of the world.
        views: observations, one row of which is written.
        number: the row.
    """
    car, control, plan, belief = world.vehicles[0], world.car[0], world.plan[0], world.localizer[0]
    views.time[number, 0], views.speed[number, 0] = world.clock[0].frame / FRAME_RATE, car.speed
    x, y, heading = belief.estimate[0], belief.estimate[1], belief.estimate[2]
    views.pose[number, 0], views.pose[number, 1], views.pose[number, 2] = x, y, heading
    for i in range(3):
        for j in range(3):
            views.pose_covariance[number, i, j] = belief.covariance[i, j]
    lane, station, _, _ = closest_lane(
        town, x, y, heading, pm.cos(heading), pm.sin(heading), car.height, int(plan.lane)
    )
    views.lane[number], views.station[number, 0] = lane, min(max(station, 0.0), town.lanes[lane].length)
    views.sight[number, 0] = world.eye[0].sight
    views.cruise_speed[number, 0], views.lights[number], views.motion[number] = (
        plan.cruise,
        plan.lights,
        motion_of(world),
    )
    views.hazard[number] = control.hazard
    views.hazard_distance[number, 0] = max(control.hazard_gap, 0.0) if control.hazard > 0 else 0.0
    views.manoeuvre[number], views.manoeuvre_angle[number, 0] = plan.action, plan.angle
    error = pm.hypot(x - car.x, y - car.y)
    progress = progress_on_path(world.course, int(plan.points), x, y, control.s, SEARCH + 2.0 * error)
    write_waypoints(world.course, int(plan.points), progress, WAYPOINT_SPACING, views.waypoints[number])
    exits = views.exits[number]
    first, count = 0, 0
    if plan.choice >= 0:
        first = options.first[plan.choice]
        count = options.first[plan.choice + 1] - first
    for row in range(len(exits)):
        for column in range(exits.shape[1]):
            exits[row, column] = options.rows[first + row, column] if row < count else 0.0
        if row < count:
            exits[row, _DISTANCE] = max(plan.choice_at - control.s - (progress - control.s), 0.0)


@compiled
def observe_as_ad_wizard(world: WorldArrays, views: AdWizardArrays, number: int) -> None:
    """Writes an observation of the Ad-Wizard: true pose, place and path.

    Args:
        world: arrays of the world.
        views: observations, one row of which is written.
        number: the row.
    """
    car, control, plan = world.vehicles[0], world.car[0], world.plan[0]
    views.time[number, 0], views.speed[number, 0] = world.clock[0].frame / FRAME_RATE, car.speed
    views.pose[number, 0], views.pose[number, 1], views.pose[number, 2] = car.x, car.y, car.heading
    views.lane[number], views.station[number, 0], views.motion[number] = plan.lane, plan.station, motion_of(world)
    points = int(plan.points)
    write_waypoints(world.course, points, control.s, WAYPOINT_SPACING, views.waypoints[number])
    write_lanes(world.course, points, last_point_before(world.course, points, control.s), views.path_lanes[number])


@compiled
def write_masks(
    town: TownArrays, options: TurnOptions, world: WorldArrays, physical: NDArray[np.int8], angle: NDArray[np.int8]
) -> None:
    """Writes the masks of the Co-Wizard's physical actions and of their angles.

    Args:
        town: arrays of the town.
        options: exits after its lanes.
        world: arrays of the world.
        physical: (n,) mask that is written; actions that are always possible are left as they are.
        angle: (360,) mask that is written.
    """
    plan = world.plan[0]
    feasible = find_feasible(town, world, world.vehicles[0].speed)
    left, right = feasible & _MAY_SWITCH_LEFT > 0, feasible & _MAY_SWITCH_RIGHT > 0
    first, count = 0, 0
    if feasible & _MAY_TURN > 0 and plan.choice >= 0:
        first = options.first[plan.choice]
        count = options.first[plan.choice + 1] - first
    physical[_LANE_FOLLOW] = feasible & _MAY_FOLLOW > 0
    physical[_LANE_SWITCH] = left or right
    physical[_U_TURN] = feasible & _MAY_TURN_ROUND > 0
    physical[_J_TURN] = count > 0
    physical[_STOP], physical[_START] = not plan.held, plan.held
    physical[_SPEED_CHANGE] = _may_change_cruise(plan.cruise, True) or _may_change_cruise(plan.cruise, False)
    for k in range(len(angle)):
        angle[k] = k == _STRAIGHT
    planned = plan.turning and not plan.held
    for k in range(first, first + count):
        degrees = int(options.rows[k, _ANGLE])
        angle[degrees + _STRAIGHT] = not (planned and degrees == plan.angle)
    if left:
        angle[90 + _STRAIGHT] = 1
    if right:
        angle[-90 + _STRAIGHT] = 1


# --- Row of a session -------------------------------------------------------------------------------------------------
# Row of a session in the arrays of observations and masks.

_observe_share = fixed(observe_share)
_FLAGS = dict(zip(AGENT_ROLES, map(int, (Wanted.PARTICIPANT, Wanted.CO_WIZARD, Wanted.AD_WIZARD)), strict=True))
_SESSION_MASKS = int(Wanted.MASKS)


class SessionViews(CachedViews):
    """Row of a session in the arrays of observations and masks, which compiled code fills in.

    Attributes:
        world: world of the session.
        arrays: arrays of all sessions.
        row: number of the row.
    """

    CACHED_VIEWS: ClassVar[Sequence[str]] = ("_call", "_called_with", "_views")

    _called_with: WorldArrays | None = None

    def __init__(self, world: World, arrays: RoleArrays, row: int) -> None:
        self.world, self.arrays, self.row = world, arrays, row

    @property
    def most_props(self) -> int:
        """Maximum number of props."""
        return len(self.arrays.observations[Role.AD_WIZARD].arrays["props"][self.row])

    def observe(self, roles: Sequence[Role]) -> None:
        """Writes the part of observations that changes at every decision."""
        self.write(sum([_FLAGS[role] for role in roles]))

    def find_feasible(self) -> None:
        """Writes the masks of the Co-Wizard's physical actions."""
        self.write(_SESSION_MASKS)

    def write(self, wanted: int) -> None:
        """Writes values that change at every decision; `wanted` are flags of `view_steps.Wanted`."""
        arrays = self.world.sensing_arrays
        if arrays is not self._called_with:
            town = self.world.actors.town_arrays, turn_options(self.world.town)
            self._called_with = arrays
            self._call = turns_of(1, 1), 0, *town, self.world.batch, *self.arrays.written_row(self.row)
        self._call[0][0, 0] = 0
        _observe_share(*self._call, wanted)

    @cached_property
    def _views(self) -> dict[Role, RowView]:
        return {role: RowView(self.arrays, role, self.row) for role in AGENT_ROLES}

    def view(self, role: Role) -> Observation:
        """Returns the observation of a role as views of the row, see `RowView`."""
        return self._views[role].refreshed()

    def renew(self, role: Role, *fields: str) -> None:
        """Renews fields of the view after Python has written them."""
        if "_views" in self.__dict__:
            self._views[role].renew(fields)

    def tables(self) -> dict[Role, Observation]:
        """Returns the arrays of the row, by role and field."""
        return {
            role: {name: array[self.row] for name, array in buffer.arrays.items() if array.ndim > 1}
            for role, buffer in self.arrays.observations.items()
        }

    def set_text(self, role: Role, field: str, text: str) -> None:
        """Writes a text of an observation."""
        self.arrays.texts[role][field][self.row] = text
        self.renew(role, field)
