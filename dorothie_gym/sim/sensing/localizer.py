"""Localization of the ego: odometry and GPS through an extended Kalman filter.

State: x, y, heading, scale of the odometer, bias of the gyro. Without GPS the two errors add up and the covariance
grows; with it they are learnt (Thrun, Burgard and Fox, Probabilistic Robotics, chapters 3 and 5). The tests compare
with filterpy's filter; it is not used here, since it takes thirty times as long as these compiled functions and rounds
differently, which would change recorded sessions.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.sim.config import FRAME_RATE
from dorothie_gym.sim.randomness import begin_stream, draw_normal
from dorothie_gym.sim.state.records import LOCALIZER_STATES, ODOMETRY_DRAWS
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation import compiled
from dorothie_gym.support.compilation.records import plain
from dorothie_gym.support.copying import CachedViews

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array
    from dorothie_gym.sim.state.record_views import ArrayHolder
    from dorothie_gym.sim.state.world_arrays import WorldArrays

SCALE_SIGMA = 0.02
"""Relative error of the odometer, constant for a car (tyre wear, pressure)."""

SLIP = 0.02
"""Error of the distance travelled by slip [m per root of m]."""

SKID = 0.01
"""The same across [m per root of m]."""

BIAS_SIGMA = math.radians(0.15)
"""Initial bias of the gyro [rad/s]."""

BIAS_WALK = math.radians(0.008)
"""Random walk of that bias [rad/s per root of s]."""

GYRO_NOISE = math.radians(0.05)
"""Angle random walk of the gyro [rad per root of s], that of a cheap micromechanical one."""

STANDS = 1e-3
"""Movement per frame below which the car stands and cannot turn [m]."""


@compiled
def measure(track: Array, k: int, draws: Array, dt: float, truth: Array) -> tuple[float, float, float]:
    """Returns the measurements of a frame.

    Args:
        track: true poses, x, y, heading and any further columns, of successive frames (n + 1, 3 or more) [m, m, rad].
        k: number of the frame: from pose k to k + 1.
        draws: normal numbers (ODOMETRY_DRAWS or more,).
        dt: time of a frame [s].
        truth: (2,) true scale of the odometer and true bias of the gyro [rad/s], whose random walk is continued.

    Returns:
        Movement ahead and to the right [m] and rotation [rad], all 0 if the car stands.
    """
    truth[1] += BIAS_WALK * math.sqrt(dt) * draws[0]
    dx, dy = track[k + 1, 0] - track[k, 0], track[k + 1, 1] - track[k, 1]
    way = math.sqrt(dx * dx + dy * dy)
    if way <= STANDS:
        return 0.0, 0.0, 0.0
    c, s, root = pm.cos(track[k, 2]), pm.sin(track[k, 2]), math.sqrt(way)
    ahead = (dx * c + dy * s) * truth[0] + SLIP * root * draws[2]
    right = (dy * c - dx * s) * truth[0] + SKID * root * draws[3]
    turn = track[k + 1, 2] - track[k, 2] + truth[1] * dt + GYRO_NOISE * math.sqrt(dt) * draws[1]
    return ahead, right, turn


@compiled
def reckon(mean: Array, covariance: Array, ahead: float, right: float, turn: float, dt: float) -> None:
    """Moves an estimate on by the measurements of a frame: the prediction of an extended Kalman filter.

    With F the derivatives of the new state by the old one, P becomes F P F^T + Q. Of F only seven numbers outside the
    diagonal are not 0, so that it is applied row by row, then column by column.

    Args:
        mean: (5,) see `sensing_records.LOCALIZER_STATES`; written.
        covariance: (5, 5) covariance of the state; written.
        ahead: movement ahead [m].
        right: [m].
        turn: [rad].
        dt: time of a frame [s].
    """
    p = covariance
    p[4, 4] += BIAS_WALK * BIAS_WALK * dt
    if ahead == 0.0 and right == 0.0:
        return
    scale = mean[3]
    ahead, right = ahead / scale, right / scale
    c, s = pm.cos(mean[2]), pm.sin(mean[2])
    dx, dy = ahead * c - right * s, ahead * s + right * c
    for j in range(LOCALIZER_STATES):
        p[0, j] -= dy * p[2, j] + dx / scale * p[3, j]
        p[1, j] += dx * p[2, j] - dy / scale * p[3, j]
        p[2, j] -= dt * p[4, j]
    for i in range(LOCALIZER_STATES):
        p[i, 0] -= dy * p[i, 2] + dx / scale * p[i, 3]
        p[i, 1] += dx * p[i, 2] - dy / scale * p[i, 3]
        p[i, 2] -= dt * p[i, 4]
    way = math.sqrt(dx * dx + dy * dy)
    slip, skid = SLIP * SLIP * way / (scale * scale), SKID * SKID * way / (scale * scale)
    p[0, 0] += slip * c * c + skid * s * s
    p[1, 1] += slip * s * s + skid * c * c
    p[0, 1] += (slip - skid) * c * s
    p[2, 2] += GYRO_NOISE * GYRO_NOISE * dt
    for i in range(1, LOCALIZER_STATES):  # keeps the matrix symmetric in spite of rounding
        for j in range(i):
            p[i, j] = p[j, i]
    mean[0] += dx
    mean[1] += dy
    mean[2] += turn - mean[4] * dt


# --- Localizer --------------------------------------------------------------------------------------------------------

GPS_SIGMA = 0.5
"""Standard deviation of a GPS fix along each axis [m]: a receiver with satellite-based augmentation."""

FIX_EVERY = FRAME_RATE // 2
"""Frames between two fixes."""

DEPARTURE_SIGMAS = (0.1, 0.1, 0.01)
"""Standard deviations of the place of departure [m, m, rad]."""


class Localizer(CachedViews):
    """Estimator of the ego's pose from its sensors: a view on the record of its world."""

    CACHED_VIEWS: ClassVar[Sequence[str]] = ("_record_of", "_own_record")

    _record_of: WorldArrays | None = None

    def __init__(self, holder: ArrayHolder) -> None:
        """Shows the estimate in `holder.arrays`, which may be replaced by others with more room."""
        self._holder = holder

    @property
    def _record(self) -> NDArray[np.void]:
        arrays: WorldArrays = self._holder.arrays
        if arrays is not self._record_of:
            self._record_of, self._own_record = arrays, plain(arrays.localizer)
        return self._own_record

    @property
    def pose(self) -> Array:
        """Estimate (x, y, heading) [m, m, rad]."""
        pose: Array = self._record["estimate"][0, :3].copy()
        return pose

    @property
    def covariance(self) -> Array:
        """Covariance (3, 3) of the estimate."""
        covariance: Array = self._record["covariance"][0, :3, :3].copy()
        return covariance

    def lose_gps(self, until: int) -> None:
        """Leaves the localizer without GPS before a frame."""
        self._record["gps_from"] = until


_FIRST_COVARIANCE = np.diag(np.square([*DEPARTURE_SIGMAS, SCALE_SIGMA, BIAS_SIGMA]))


def switch_on(world: WorldArrays, rng: np.random.Generator) -> None:
    """Begins to localize the ego of a world, where it is now.

    Args:
        world: arrays of the world.
        rng: source of the errors of its sensors, which continue the generator's numbers.
    """
    record, car = plain(world.localizer)[0], plain(world.vehicles)[0]
    scale, bias = rng.standard_normal(2)
    record["estimate"] = car["x"], car["y"], car["heading"], 1.0, 0.0
    record["covariance"] = _FIRST_COVARIANCE
    record["fix"], record["fixed_at"] = (car["x"], car["y"]), 0
    record["truth"] = 1.0 + SCALE_SIGMA * scale, BIAS_SIGMA * bias
    begin_stream(world.localizer[0], rng)


@compiled
def localize(world: WorldArrays, dt: float) -> None:
    """Updates the estimate with the odometry of each frame and a GPS fix every `FIX_EVERY` frames, errors added.

    The estimate does not depend on the number of frames per call: each frame draws the same numbers.

    Args:
        world: arrays of a world after a call of `sim.step.step`, with the poses of the ego in it.
        dt: time of a frame [s].
    """
    record, track, frames = world.localizer[0], world.poses, int(world.car[0].frames)
    for k in range(frames):
        for n in range(ODOMETRY_DRAWS + 2):
            record.draws[n] = draw_normal(record)
        ahead, right, turn = measure(track, k, record.draws, dt, record.truth)
        reckon(record.estimate, record.covariance, ahead, right, turn, dt)
        now = world.clock[0].frame - frames + k + 1
        if now % FIX_EVERY == 0 and now >= record.gps_from:
            for axis in range(2):
                fix = track[k + 1, axis] + GPS_SIGMA * record.draws[ODOMETRY_DRAWS + axis]
                record.fix[axis], record.fixed_at = fix, now
                correct(record.estimate, record.covariance, axis, fix)


@compiled
def correct(mean: Array, covariance: Array, axis: int, fix: float) -> None:
    """Updates an estimate with one coordinate of a GPS fix.

    The errors of a fix along the two axes are independent, so that the axes may be used one after the other.

    Args:
        mean: (5,) estimate; written.
        covariance: (5, 5) covariance of the state; written.
        axis: 0 for x, 1 for y.
        fix: measured coordinate [m].
    """
    p = covariance
    off, spread = fix - mean[axis], p[axis, axis] + GPS_SIGMA * GPS_SIGMA
    for i in range(LOCALIZER_STATES):
        mean[i] += p[i, axis] / spread * off
    for i in range(LOCALIZER_STATES):
        for j in range(LOCALIZER_STATES):
            if i != axis and j != axis:
                p[i, j] -= p[i, axis] * p[axis, j] / spread
    left = GPS_SIGMA * GPS_SIGMA / spread
    for i in range(LOCALIZER_STATES):
        if i != axis:
            p[i, axis] *= left
            p[axis, i] = p[i, axis]
    p[axis, axis] *= left
