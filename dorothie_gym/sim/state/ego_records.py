"""Records of the ego: path, plan, control and event log."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.sim.traffic.parameters import CLOSED, GOALS, PLANNED
from dorothie_gym.support.compilation.records import Flag, Float, Int32, Int64


class SweepRecord:
    """Direction of the path at a point around the ego, and the sweep of the ego's corners to either side of it [m]."""

    cos: Float
    sin: Float
    left: Float
    right: Float


class EgoRecord:
    """Control of the ego, the vehicle of the kind `Kind.DRIVEN`."""

    first: Int32  # stretch of the path that the motion control follows: its first point, and the one behind its last
    points: Int32
    at: Int32  # the point at or before the ego
    s: Float  # distance along the path, and offset to its right [m]
    offset: Float
    stop_at: Float  # place of a stop at the path's end [m]; infinite where the path continues
    runs: Int32  # number of lanes along the path, and the one of the ego
    run: Int32
    run_lane: Annotated[NDArray[np.int32], "i4", (PLANNED,)]
    run_first: Annotated[NDArray[np.int32], "i4", (PLANNED,)]  # the first point on each
    action: Int32  # manoeuvre: a `PhysicalAction` or 0
    action_end: Float  # end of the manoeuvre [m]
    cruise: Float  # desired speed [m/s]
    held: Flag  # whether it stops by the action Stop
    hold_speed: Float  # speed of a stop in progress [m/s]; -1 for none
    goals: Int32  # places along the path to approach slowly [m]
    goal: Annotated[NDArray[np.float64], "f8", (GOALS,)]
    lateral_sum: Float  # state of the controllers
    lateral_last: Float
    speed_sum: Float
    throttle: Float
    steer: Float
    brake: Float
    manual: Flag  # whether these three are given, not found by the controllers
    before: Float  # speed at the start of the substep [m/s]
    friction: Float  # share of the dry road's grip
    wind: Float  # strength in [0, 1]
    wind_heading: Float  # direction to which it blows [rad]
    wind_phase: Annotated[NDArray[np.float64], "f8", (3,)]  # phases of its gusts [rad]
    roadblock: Float  # distance from its middle to a prop on the path [m], or infinite
    sweeping: Flag  # whether it is in a U-turn, and the points of it that are left
    sweep_first: Int32
    sweep_last: Int32
    closed: Annotated[NDArray[np.int32], "i4", (CLOSED,)]  # junctions that it needs for a U-turn, and when asked
    closed_at: Annotated[NDArray[np.float64], "f8", (CLOSED,)]
    kind: Int32  # limit of its speed: `ObjectClass` or 0, gap [m], speed [m/s] and key of the body
    gap: Float
    ahead_speed: Float
    other: Int32
    tight: Flag  # whether the limit is met in a manoeuvre, and whether it is a line
    line: Flag
    hazard: Int32  # hazard stop in progress: `ObjectClass` or 0, gap [m], key, first and last frame
    hazard_gap: Float
    hazard_key: Int32
    hazard_since: Int64
    hazard_seen: Int64
    stopped_until: Int64  # frame up to which it stands after a collision, and length of such stands [frames]
    collision_stop: Int64
    collisions: Int64  # number of collisions by its own fault
    events: Int32  # rows of `events`, `breaches` and `trace` in use
    breaches: Int32
    frames: Int32


class PlanRecord:
    """Plan of the ego: its manoeuvre, and its place on the whole path.

    The fields after `points` follow from the path and `EgoRecord.s`; `manoeuvres.find_place` sets them.
    """

    version: Int64  # number of paths laid so far
    written: Int64  # version of the path in `WorldArrays.sweeps`; 0: none, or with other goals
    written_until: Float  # end of the stretch of it there [m]
    action: Int32  # manoeuvre planned or under way: a `PhysicalAction` or 0
    angle: Int32  # its angle [degrees], positive left
    end: Float  # distance along the path at which it ends [m]
    connector: Int32  # connector and lane of the planned turn
    exit: Int32
    held: Flag  # whether the ego stands by the action Stop
    lights: Flag  # whether the head lights are on
    cruise: Float  # desired speed [km/h]
    manual: Flag  # whether an outside driver gives throttle, steer and brake
    throttle: Float
    steer: Float
    brake: Float
    goals: Int32  # rows of `goals` and `seen_props` in use
    props: Int32
    open_end: Flag  # whether the path ends where a turn has to be chosen, or at the end of the map
    points: Int32  # number of points of the path
    length: Float  # its length [m]
    limit: Float  # speed limit at its first point [m/s]
    at: Int32  # point at or before the ego
    lane: Int32  # lane of the ego, station [m], height [m], and whether it is off the centre lines
    station: Float
    height: Float
    off_line: Flag
    choice: Int32  # lane before the next junction with a choice, or -1, and its end along the path [m]
    choice_at: Float
    turning: Flag  # whether the planned turn has not begun
    turn_at: Float  # beginning of its connector along the path [m], or infinite
    steps: Int32  # rows of `steps` in use
    needed: Int32  # points of the path that is being laid; 0: a list of `steps` is too long
    last_x: Float  # the last point of a piece of path, which may be left out [m]
    last_y: Float


class CoursePointRecord:
    """A point of the whole path; its height is that of its lane there."""

    s: Float  # distance along the path [m]
    x: Float
    y: Float
    heading: Float  # unwrapped [rad]
    station: Float  # along its lane [m]; during a U-turn that of its end
    speed: Float  # speed that curves, limits and the path's end allow [m/s]; the limit while the path is being laid
    lane: Int32
    manoeuvre: Flag  # whether the path leaves the centre lines here: lane switch or U-turn


class LaneStepRecord:
    """A lane of a plan, or of the search for one."""

    lane: Int32
    before: Int32  # in a search: the row that it was reached from, or -1
    changes: Int32  # in a search: lane changes up to here
    change: Flag  # whether it is entered from the side


class GoalRecord:
    """Place where the ego is expected to stop."""

    station: Float
    lane: Int32


class EventRecord:
    """An event of the ego, with class, key and row of the counterpart."""

    frame: Int64
    code: Int32  # `EventCode`
    kind: Int32
    key: Int32
    body: Int32
    own: Flag  # whether a collision is the ego's own fault
    value: Float  # gap [m], duration [frames] or speed [m/s]
    x: Float
    y: Float
    station: Float
    lane: Int32


TRACE = ("frame", "x", "y", "heading", "speed", "throttle", "steer", "brake", "lane", "offset")
"""Columns of the ego's trajectory."""

POSE = ("x", "y", "heading", "speed", "height", "turning")
"""Columns of the ego's poses: place [m], heading [rad], speed [m/s], height of the road [m], 1 during a U-turn."""
