"""Records of the bodies of a world, its clock and its lights; protocols of their common fields."""

from __future__ import annotations

from typing import Annotated, Protocol

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.sim.traffic.parameters import PLANNED
from dorothie_gym.support.compilation.records import Flag, Float, Int32, Int64


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

    x: Float  # position of its middle [m]
    y: Float
    heading: Float  # [rad]
    cos: Float
    sin: Float
    speed: Float  # [m/s]
    height: Float  # of the road under it [m]
    acceleration: Float  # present action: [m/s^2], and sine of the slip angle
    slip: Float
    desired: Float  # desired speed [m/s]
    length: Float  # [m]
    width: Float
    radius: Float  # half its diagonal [m]
    to_right: Float  # offset that it keeps in its lane [m]
    station: Float  # on the lane that it follows [m]
    lateral: Float
    own_station: Float  # on the closest lane [m]
    own_lateral: Float
    timer: Float  # since it last considered a lane change [s]
    standing: Float  # duration of its stand, its light not being red [s]
    stuck: Float  # the same less the time for which the light ahead was not green, also behind others [s]
    crash_age: Float  # since it crashed [s]
    odometer: Float  # distance driven [m]
    distance: Float  # from its front to the line before the next junction [m]
    seen: Float  # times at which it came near, asked, began to wait [s]
    asked: Float
    since: Float
    claim_since: Float  # [s]
    claim_asked: Float
    rerouted: Float  # time at which it last chose another way for lack of room on the planned one [s]
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
    aside: Float  # offset to the right of the middle of the way [m]
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


class PropRecord:
    """A thing on the road, and the lanes that it reaches into."""

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
    """Present phase of a light programme, which holds until a time [s]."""

    until: Float
    phase: Int32
