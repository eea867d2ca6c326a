"""Records of a world: bodies, clock and lights; path, plan and control of the ego, its perception and its driving."""

from __future__ import annotations

from typing import Annotated, Protocol

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.sim.state.codes import Breach
from dorothie_gym.sim.traffic.parameters import CLOSED, GOALS, PLANNED
from dorothie_gym.support.compilation.records import Flag, Float, Int32, Int64, UInt64


class SweepRecord:
    """Direction of the path at a point around the ego, and the sweep of the ego's corners to either side of it [m]."""

    cos: Float
    sin: Float
    left: Float
    right: Float


class EgoRecord:
    """Control of the ego, the vehicle of the kind `Kind.DRIVEN`."""

    first: Int32  # stretch of the path that the motion control follows: its first point, and the one after its last
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
    roadblock: Float  # distance from its centre to a prop on the path [m], or infinite
    sweeping: Flag  # whether it is in a U-turn, and the remaining points of that
    sweep_first: Int32
    sweep_last: Int32
    closed: Annotated[NDArray[np.int32], "i4", (CLOSED,)]  # junctions needed for a U-turn, and when requested
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
    attentive: Flag  # whether its brakes act only on bodies in view for a time (`WorldConfig.braking`)
    attention: Int64  # that time [frames]
    sent: Float  # way for which it passes red lights and stop signs, because it has just been started [m]
    events: Int32  # rows of `events`, `breaches` and `trace` in use
    breaches: Int32
    frames: Int32


class PlanRecord:
    """Plan of the ego: its manoeuvre, and its place on the whole path.

    The fields after `points` follow from the path and `EgoRecord.s`; `manoeuvres.find_place` sets them.
    """

    version: Int64  # number of paths laid so far
    written: Int64  # version of the path in `WorldArrays.sweeps`; 0: none, or with other goals
    written_until: Float  # end of the stretch on that lane [m]
    action: Int32  # manoeuvre planned or in progress: a `PhysicalAction` or 0
    angle: Int32  # its angle [degrees], positive left
    end: Float  # distance along the path at which it ends [m]
    early: Flag  # whether a lane that ends is left as soon as possible
    connector: Int32  # connector and lane of the planned turn
    exit: Int32
    held: Flag  # whether the ego stands by the action Stop
    lights: Flag  # whether the headlights are on
    cruise: Float  # desired speed [km/h]
    follows: Flag  # whether that is the speed limit of the lane, until another speed is set
    manual: Flag  # whether an outside driver gives throttle, steer and brake
    throttle: Float
    steer: Float
    brake: Float
    goals: Int32  # rows of `goals` and `seen_props` in use
    props: Int32
    open_end: Flag  # whether the path ends where a turn must be chosen, or at the end of the map
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
    turn_at: Float  # start of its connector along the path [m], or infinite
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


# --- Perception, pose estimate and watch ------------------------------------------------------------------------------
# Records of the ego's perception, its pose estimate, and the monitoring of its driving.


class SeenRecord:
    """A perceived body."""

    distance2: Float  # square of its perceived distance [m^2]
    x: Float  # perceived place [m]
    y: Float
    heading: Float
    cos: Float
    sin: Float
    speed: Float
    length: Float
    width: Float
    height: Float  # of the road under it [m]
    kind: Int32  # `ObjectClass`
    key: Int32
    body: Int32  # row in the array of its `Group`
    group: Int32
    hidden: Flag  # whether a vehicle hides it from the sensors of the brakes (`ego.attention`)


class EyeRecord:
    """Visibility: the fields of `visibility.Visibility`, and the seed of errors and misses."""

    seed: Int64
    sight: Float  # range within which nothing is missed [m]
    fog: Float
    fog_start: Float
    rain: Float
    light: Float
    lamps: Float
    clarity: Float
    clear: Flag  # whether all within `visibility.CLEAR_SIGHT` is seen without errors


ODOMETRY_DRAWS = 4
"""Normal random numbers that a frame of odometry takes: for the bias, the gyro, the slip and the skid."""

LOCALIZER_STATES = 5
"""States of the localizer: x, y [m], heading [rad], scale of the odometer, bias of the gyro [rad/s]."""


class LocalizerRecord:
    """Pose estimate of the ego, and the errors of its sensors: the true ones, and the stream of further ones."""

    estimate: Annotated[NDArray[np.float64], "f8", (LOCALIZER_STATES,)]
    covariance: Annotated[NDArray[np.float64], "f8", (LOCALIZER_STATES, LOCALIZER_STATES)]
    truth: Annotated[NDArray[np.float64], "f8", (2,)]  # true scale of the odometer and bias of the gyro [rad/s]
    draws: Annotated[NDArray[np.float64], "f8", (ODOMETRY_DRAWS + 2,)]  # of the last frame: odometry, and a fix
    state_high: UInt64  # `RandomStream`
    state_low: UInt64
    step_high: UInt64
    step_low: UInt64
    gps_from: Int64  # frame before which there is no GPS
    fix: Annotated[NDArray[np.float64], "f8", (2,)]  # the last fix: x, y [m]; at first the place of departure
    fixed_at: Int64  # its frame


class LineMarkRecord:
    """State of a stop line for the ego: whether it has stood there; `near` is a scratch list of the lines nearby."""

    near: Int32
    stood: Flag


class WatchRecord:
    """State of the rule checks: infractions so far by `codes.Breach`, and the last frame of continuing ones."""

    counts: Annotated[NDArray[np.int64], "i8", (len(Breach),)]
    last: Annotated[NDArray[np.int64], "i8", (len(Breach),)]


class BreachRecord:
    """An infraction by the ego other than a collision."""

    frame: Int64
    x: Float  # of the car's centre [m]
    y: Float
    height: Float
    station: Float  # along the lane [m]
    kind: Int32  # `codes.Breach`
    lane: Int32  # lane that the ego left over its end, or the nearest one, -1 for none nearby
    signal: Int32  # id of the light or sign, -1 if there is none


# --- Bodies, clock and lights -----------------------------------------------------------------------------------------
# Records of the bodies of a world, its clock and its lights; protocols of their common fields.


class RandomBody(Protocol):
    """A record with the state of its own random numbers."""

    random: int


class RandomStream(Protocol):
    """A record with a stream of random numbers, PCG64: state and increment of 128 bits, by halves."""

    state_high: int
    state_low: int
    step_high: int
    step_low: int


class PlacedBody(Protocol):
    """A record of a vehicle, pedestrian, prop or perceived body: its place and heading."""

    x: float
    y: float
    heading: float
    cos: float
    sin: float
    height: float
    key: int


class SizedBody(PlacedBody, Protocol):
    """For a vehicle, prop or perceived body, also its outline."""

    length: float
    width: float


class VehicleRecord:
    """A car or cyclist; a free row has the kind `Kind.EMPTY`."""

    x: Float  # position of its centre [m]
    y: Float
    heading: Float  # [rad]
    cos: Float
    sin: Float
    speed: Float  # [m/s]
    height: Float  # of the road under it [m]
    acceleration: Float  # current action: [m/s^2], and sine of the slip angle
    slip: Float
    desired: Float  # desired speed [m/s]
    length: Float  # [m]
    width: Float
    radius: Float  # half its diagonal [m]
    to_right: Float  # offset to the right that it keeps in its lane [m]
    station: Float  # on the lane that it follows [m]
    lateral: Float
    own_station: Float  # on the closest lane [m]
    own_lateral: Float
    timer: Float  # since it last considered a lane change [s]
    standing: Float  # time for which it has stood while its light was not red [s]
    stuck: Float  # the same without the time for which the light ahead was not green, also in a queue [s]
    crash_age: Float  # since it crashed [s]
    odometer: Float  # distance driven [m]
    distance: Float  # from its front to the line before the next junction [m]
    seen: Float  # times at which it came near, requested admission, began to wait [s]
    asked: Float
    since: Float
    claim_since: Float  # [s]
    claim_asked: Float
    rerouted: Float  # time at which it last chose another route for lack of room on the planned one [s]
    random: Int64
    lane: Int32  # the closest lane
    segment: Int32  # the closest segment of the lane that it follows
    planned: Int32  # number of lanes in its plan
    plan: Annotated[NDArray[np.int32], "i4", (PLANNED,)]  # lanes ahead; the first is the one that it follows
    approach: Int32  # connector that it announced, and the lane before
    approach_lane: Int32
    claim: Int32  # connector that it was granted, and the one that it is on
    inside: Int32
    kind: Int32  # `Kind`
    wait: Int32  # `Wait`
    key: Int32  # identifies the body; a respawned one gets a new key
    stood: Flag  # whether it has stood at the stop line
    crashed: Flag
    blocked: Flag  # whether a prop is next ahead
    touched: Flag  # whether the ego has touched it
    view_since: Int64  # first and last frame in which the sensors of the ego's brakes had it in view, see `attention`
    view_last: Int64


class PedestrianRecord:
    """A pedestrian; a free row has the state `Walk.EMPTY`."""

    x: Float
    y: Float
    heading: Float
    cos: Float
    sin: Float
    speed: Float
    height: Float
    station: Float  # along the footway or crosswalk [m]
    direction: Float  # 1 or -1
    pace: Float  # desired speed [m/s]
    aside: Float  # offset to the right of the centre of the footway [m]
    waited: Float
    odometer: Float
    far: Float  # while straying: distance to the other side of the road [m]
    staying: Float  # duration without progress [s], and the place where it began [m]
    left_x: Float
    left_y: Float
    crash_age: Float  # since it was touched [s]
    random: Int64
    walk: Int32
    segment: Int32
    crossing: Int32
    mouth: Int32
    state: Int32  # `Walk`
    key: Int32
    crashed: Flag
    view_since: Int64  # as in `VehicleRecord`
    view_last: Int64


class PropRecord:
    """A body on the road, and the lanes that it reaches into."""

    x: Float
    y: Float
    heading: Float
    cos: Float
    sin: Float
    height: Float
    length: Float
    width: Float
    radius: Float
    station: Annotated[NDArray[np.float64], "f8", (4,)]
    lane: Annotated[NDArray[np.int32], "i4", (4,)]
    key: Int32
    present: Flag
    view_since: Int64  # as in `VehicleRecord`
    view_last: Int64


class NodeRecord:
    """A body in the list of a lane, ordered by station."""

    station: Float
    speed: Float
    cos: Float
    sin: Float
    half_length: Float
    lane: Int32
    next: Int32
    before: Int32
    body: Int32


class ClockRecord:
    """Time and counters of a world; the seeds of all bodies are drawn from `random`."""

    time: Float  # [s]
    frame: Int64  # substeps
    collisions: Int64  # collisions of vehicles
    run_over: Int64  # pedestrians touched
    random: Int64
    towed: Int64  # vehicles respawned
    keys: Int64  # keys given
    straying: Int64  # pedestrians straying over a road now


class LampRecord:
    """Current phase of a light programme, which holds until a time [s]."""

    until: Float
    phase: Int32
