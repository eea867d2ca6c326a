"""Records of the ego's perception, its pose estimate, and the monitoring of its driving."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.sim.state.codes import Breach
from dorothie_gym.support.compilation.records import Flag, Float, Int32, Int64, UInt64


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


class LineMarkRecord:
    """State of a line for the ego: whether it has stood there; `near` is a scratch list of the lines nearby."""

    near: Int32
    stood: Flag


class WatchRecord:
    """Watch over the rules: breaches so far by `codes.Breach`, and the last frame of lasting ones."""

    counts: Annotated[NDArray[np.int64], "i8", (len(Breach),)]
    last: Annotated[NDArray[np.int64], "i8", (len(Breach),)]


class BreachRecord:
    """A breach of a rule by the ego, other than collisions."""

    frame: Int64
    x: Float  # of the car's middle [m]
    y: Float
    height: Float
    station: Float  # along the lane [m]
    kind: Int32  # `codes.Breach`
    lane: Int32  # lane that was left over its end, or the nearest one, -1 for none nearby
    signal: Int32  # id of the light or sign, -1 where there is none
