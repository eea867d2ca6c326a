"""Accuracy and consistency of the localizer over many random drives."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np
import pytest
from filterpy.kalman import ExtendedKalmanFilter

from dorothie_gym.maps.model import Array
from dorothie_gym.sim.config import FRAME_RATE
from dorothie_gym.sim.sensing.localizer import (
    BIAS_SIGMA,
    BIAS_WALK,
    DEPARTURE_SIGMAS,
    FIX_EVERY,
    GPS_SIGMA,
    GYRO_NOISE,
    SCALE_SIGMA,
    SKID,
    SLIP,
    measure,
)
from dorothie_gym.sim.state.records import ODOMETRY_DRAWS
from tests.sim.sensing.odometer import CarriedLocalizer

RUNS = 400
SPEED = 30 / 3.6
WARM, FAULT, AFTER = 45.0, 30.0, 5.0
ELLIPSE_95 = 5.991
"""95 % of chi-square with 2 degrees of freedom."""

DT = 1.0 / FRAME_RATE


def drive(seconds: float, rng: np.random.Generator, speed: float = SPEED) -> Array:
    """Poses of every frame (n + 1, 3): straight blocks and turns of a quarter, as in a town."""
    frames = round(seconds * FRAME_RATE)
    rates = np.zeros(frames)
    k = 0
    while k < frames:
        k += int(rng.uniform(4.0, 12.0) * FRAME_RATE)
        turning = round(2.5 * FRAME_RATE)
        rates[k : k + turning] = float(rng.choice([-1.0, 1.0])) * math.pi / 2 / 2.5
        k += turning
    headings = rng.uniform(-math.pi, math.pi) + np.concatenate(([0.0], np.cumsum(rates * DT)))
    steps = speed * DT * np.column_stack((np.cos(headings[:-1]), np.sin(headings[:-1])))
    return np.column_stack((np.concatenate((np.zeros((1, 2)), np.cumsum(steps, axis=0))), headings))


@dataclass(frozen=True)
class Moment:
    """A fix time of a drive: when [s], what the estimate is off by (3,), and its covariance (3, 3)."""

    time: float
    error: Array
    covariance: Array

    @property
    def off(self) -> float:
        """Distance of the estimate from the car [m]."""
        return float(math.hypot(*self.error[:2]))

    def squared(self, dimensions: int) -> float:
        """Normalised squared error."""
        e, p = self.error[:dimensions], self.covariance[:dimensions, :dimensions]
        return float(e @ np.linalg.solve(p, e))


@functools.lru_cache(maxsize=1)
def drives() -> tuple[tuple[Moment, ...], ...]:
    """RUNS drives with GPS, half a minute without, and GPS again."""
    return tuple(one_drive(seed) for seed in range(RUNS))


def one_drive(seed: int) -> tuple[Moment, ...]:
    track = drive(WARM + FAULT + AFTER, np.random.default_rng([seed, 1]))
    localizer = CarriedLocalizer(*track[0], np.random.default_rng([seed, 2]))
    moments = []
    works_again = round((WARM + FAULT) * FRAME_RATE) + 1
    for k in range(FIX_EVERY, len(track), FIX_EVERY):
        time = k * DT
        off = WARM < time <= WARM + FAULT
        localizer.carry(track[k - FIX_EVERY : k + 1], k - FIX_EVERY, gps_from=works_again if off else 0)
        moments.append(Moment(time, localizer.pose - track[k], localizer.covariance))
    return tuple(moments)


def at(moments: tuple[Moment, ...], time: float) -> Moment:
    return min(moments, key=lambda moment: abs(moment.time - time))


def test_with_gps_the_error_is_under_a_metre() -> None:
    for moments in drives():
        errors = [moment.off for moment in moments if moment.time <= WARM]
        assert math.sqrt(np.mean(np.square(errors))) < 1.0


def test_filter_with_gps_is_consistent() -> None:
    squared = [moment.squared(3) for moments in drives() for moment in moments if 5.0 < moment.time <= WARM]
    # the mean of chi-square with 3 degrees of freedom is 3; errors half a second apart go together, runs do not
    assert np.mean(squared) == pytest.approx(3.0, abs=3.0 * math.sqrt(6.0 / RUNS))
    assert np.mean([value < 7.815 for value in squared]) == pytest.approx(0.95, abs=0.03)


def test_estimate_drifts_without_gps_and_covariance_covers_it() -> None:
    def spread(moments: tuple[Moment, ...], since: float) -> float:
        return float(np.trace(at(moments, WARM + since).covariance[:2, :2]))

    mean = [np.mean([spread(moments, since) for moments in drives()]) for since in (0.0, 10.0, 20.0, 30.0)]
    assert mean == sorted(mean)  # on its own a car that comes back the same way may get surer again
    for moments in drives():
        headings = [at(moments, WARM + since).covariance[2, 2] for since in (0.0, 10.0, 20.0, 30.0)]
        assert headings == sorted(headings)
        assert spread(moments, FAULT) > 2.0 * spread(moments, 0.0)
    assert np.mean([at(moments, WARM + FAULT).off for moments in drives()]) > 1.0


def test_after_half_a_minute_without_gps_the_car_is_within_the_ellipse() -> None:
    inside = [at(moments, WARM + FAULT).squared(2) <= ELLIPSE_95 for moments in drives()]
    assert np.mean(inside) >= 0.93


def test_gps_brings_the_estimate_back_within_five_seconds() -> None:
    assert all(at(moments, WARM + FAULT + AFTER).off < 1.0 for moments in drives())


def test_a_standing_car_does_not_drift() -> None:
    localizer = CarriedLocalizer(3.0, 4.0, 0.5, np.random.default_rng(0))
    before = localizer.pose
    for k in range(60):
        localizer.carry(np.tile([3.0, 4.0, 0.5], (16, 1)), 15 * k, gps_from=10_000)
    np.testing.assert_array_equal(localizer.pose, before)


def test_frames_may_be_bundled_in_any_way() -> None:
    track = drive(20.0, np.random.default_rng(4))
    found = []
    for bundle in (1, 7, 15, 60):
        localizer = CarriedLocalizer(*track[0], np.random.default_rng(9))
        for k in range(0, len(track) - 1, bundle):
            localizer.carry(track[k : k + bundle + 1], k, gps_from=200)
        found.append((localizer.pose.tobytes(), localizer.covariance.tobytes()))
    assert found == found[:1] * 4


def test_fixes_come_twice_a_second_and_not_before_gps_works() -> None:
    track, seen = drive(4.0, np.random.default_rng(4)), []
    for gps_from in (0, 61, 10_000):
        localizer = CarriedLocalizer(*track[0], np.random.default_rng(9))
        spreads = []
        for k in range(len(track) - 1):
            localizer.carry(track[k : k + 2], k, gps_from=gps_from)
            spreads.append(float(np.trace(localizer.covariance[:2, :2])))
        seen.append([k + 2 for k in range(len(spreads) - 1) if spreads[k + 1] < spreads[k]])
    assert seen == [[15, 30, 45, 60, 75, 90, 105, 120], [75, 90, 105, 120], []]


def test_estimates_are_copies() -> None:
    localizer = CarriedLocalizer(3.0, 4.0, 0.5, np.random.default_rng(0))
    localizer.pose[0], localizer.covariance[0, 0] = 99.0, 99.0
    np.testing.assert_array_equal(localizer.pose, [3.0, 4.0, 0.5])
    assert localizer.covariance[0, 0] < 1.0


class Reference(ExtendedKalmanFilter):  # type: ignore[misc]  # filterpy has no types
    """filterpy's filter over the same odometry."""

    def __init__(self, start: Array) -> None:
        super().__init__(dim_x=5, dim_z=2)
        self.x = np.array([*start, 1.0, 0.0])
        self.P = np.diag(np.square([*DEPARTURE_SIGMAS, SCALE_SIGMA, BIAS_SIGMA]))
        self.R = np.eye(2) * GPS_SIGMA**2

    def predict_x(self, u: Array = 0) -> None:
        self.x = self.moved

    def go(self, ahead: float, right: float, turn: float) -> None:
        x, y, heading, scale, bias = self.x
        walk = np.diag([0.0, 0.0, 0.0, 0.0, BIAS_WALK**2 * DT])
        if (ahead, right, turn) == (0.0, 0.0, 0.0):
            self.F, self.Q, self.moved = np.eye(5), walk, self.x
        else:
            along = np.array([math.cos(heading), math.sin(heading)])
            across = np.array([-along[1], along[0]])
            dx, dy = (ahead * along + right * across) / scale
            self.F = np.eye(5)
            self.F[0, 2:4], self.F[1, 2:4], self.F[2, 4] = (-dy, -dx / scale), (dx, -dy / scale), -DT
            self.Q = self.F @ walk @ self.F.T  # the bias wanders before it is used
            spread = SLIP**2 * np.outer(along, along) + SKID**2 * np.outer(across, across)
            self.Q[:2, :2] += math.hypot(ahead, right) / scale**3 * spread
            self.Q[2, 2] += GYRO_NOISE**2 * DT
            self.moved = np.array([x + dx, y + dy, heading + turn - bias * DT, scale, bias])
        self.predict()


def test_estimates_are_those_of_filterpy() -> None:
    track = drive(300.0, np.random.default_rng(11))
    track[3000:3600] = track[3000]  # stands for 20 s
    track[3600:, :] += track[3000] - track[3600]
    localizer, numbers = CarriedLocalizer(*track[0], np.random.default_rng(5)), np.random.default_rng(5)
    reference = Reference(track[0])
    scale, bias = numbers.standard_normal(2)
    truth = np.array([1.0 + SCALE_SIGMA * scale, BIAS_SIGMA * bias])
    draws = numbers.standard_normal((len(track) - 1, ODOMETRY_DRAWS + 2))
    for k in range(0, len(track) - 1, FIX_EVERY):
        gps_from = 5400 if 4500 <= k < 5400 else 0
        localizer.carry(track[k : k + FIX_EVERY + 1], k, gps_from=gps_from)
        for frame in range(k, k + FIX_EVERY):
            reference.go(*measure(track, frame, draws[frame], DT, truth))
        if k + FIX_EVERY >= gps_from:
            fix = track[k + FIX_EVERY, :2] + GPS_SIGMA * draws[k + FIX_EVERY - 1, ODOMETRY_DRAWS:]
            reference.update(fix, lambda _: np.eye(2, 5), lambda state: state[:2])
        np.testing.assert_allclose(localizer.pose, reference.x[:3], rtol=0.0, atol=1e-9)
        np.testing.assert_allclose(localizer.covariance, reference.P[:3, :3], rtol=0.0, atol=1e-9)


def test_estimates_are_the_same_for_the_same_seed_only() -> None:
    assert np.array_equal(one_drive(3)[-1].error, one_drive(3)[-1].error)
    assert not np.array_equal(one_drive(3)[-1].error, one_drive(4)[-1].error)


def test_covariance_stays_symmetric_and_positive() -> None:
    for moment in one_drive(0):
        np.testing.assert_array_equal(moment.covariance, moment.covariance.T)
        assert np.linalg.eigvalsh(moment.covariance)[0] > 0.0
