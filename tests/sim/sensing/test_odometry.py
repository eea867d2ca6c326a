from __future__ import annotations

import numpy as np
import pytest

from dorothie_gym.maps.model import Array
from dorothie_gym.sim.sensing.localizer import BIAS_WALK, measure, reckon
from dorothie_gym.sim.state.records import LOCALIZER_STATES, ODOMETRY_DRAWS

DT = 1 / 30


def curve(frames: int = 90) -> Array:
    """A car that turns right at 8 m/s with a side slip."""
    headings = 0.7 + 0.4 * DT * np.arange(frames + 1)
    steps = 8.0 * DT * np.column_stack((np.cos(headings + 0.05), np.sin(headings + 0.05)))[:-1]
    return np.column_stack((np.concatenate((np.zeros((1, 2)), np.cumsum(steps, axis=0))), headings))


def exact(frames: int = 90) -> Array:
    return np.zeros((frames, ODOMETRY_DRAWS))


def dead_reckon(
    track: Array, draws: Array, truth: tuple[float, float], believed: tuple[float, float, float]
) -> tuple[Array, Array]:
    """Estimate (5,) and covariance (5, 5) at the end of a track that begins surely known.

    Args:
        track: true poses (n + 1, 3).
        draws: normal numbers (n, DRAWS).
        truth: scale and bias.
        believed: heading at the start, scale and bias.
    """
    mean, covariance, state = (
        np.array([0.0, 0.0, *believed]),
        np.zeros((LOCALIZER_STATES, LOCALIZER_STATES)),
        np.array(truth),
    )
    for k in range(len(draws)):
        reckon(mean, covariance, *measure(track, k, draws[k], DT, state), DT)
    return mean, covariance


def test_without_errors_dead_reckoning_finds_the_place() -> None:
    track = curve()
    mean, _ = dead_reckon(track, exact(), (1.0, 0.0), (0.7, 1.0, 0.0))
    np.testing.assert_allclose(mean[:3], track[-1])
    assert mean[2] - 0.7 == pytest.approx(0.4 * 3.0)
    np.testing.assert_array_equal(mean[3:], [1.0, 0.0])


def test_known_sensor_errors_are_compensated() -> None:
    track = curve()
    mean, _ = dead_reckon(track, exact(), (1.03, 0.02), (0.7, 1.03, 0.02))
    np.testing.assert_allclose(mean[:3], track[-1])


def test_unknown_sensor_errors_cause_drift() -> None:
    track = curve()
    (x, y, heading, *_), _ = dead_reckon(track, exact(), (1.03, 0.02), (0.7, 1.0, 0.0))
    assert np.hypot(x, y) == pytest.approx(1.03 * np.hypot(*track[-1, :2]), rel=0.01)
    assert heading - track[-1, 2] == pytest.approx(0.02 * 3.0)


@pytest.mark.parametrize("believed", [(0.7, 1.0, 0.0), (0.9, 1.02, 0.01)])
def test_covariance_follows_the_derivatives_of_dead_reckoning(believed: tuple[float, float, float]) -> None:
    track, truth = curve(), np.array([1.01, 0.005])

    def end(heading: float, scale: float, bias: float) -> Array:
        return dead_reckon(track, exact(), (1.01, 0.005), (heading, scale, bias))[0]

    jacobian, step = np.eye(LOCALIZER_STATES), 1e-6
    for k in range(3):
        up, down = list(believed), list(believed)
        up[k], down[k] = up[k] + step, down[k] - step
        jacobian[:, 2 + k] = (end(*up) - end(*down)) / (2 * step)
    root = np.random.default_rng(0).standard_normal((LOCALIZER_STATES, LOCALIZER_STATES))
    before = root @ root.T
    mean, covariance = np.array([0.0, 0.0, *believed]), before.copy()
    for k in range(90):
        reckon(mean, covariance, *measure(track, k, exact()[k], DT, truth), DT)
    own = dead_reckon(track, exact(), (1.01, 0.005), believed)[1]
    np.testing.assert_allclose(covariance - own, jacobian @ before @ jacobian.T, rtol=1e-6, atol=1e-6)


def test_a_standing_car_counts_neither_way_nor_turn() -> None:
    draws = np.random.default_rng(0).standard_normal((30, ODOMETRY_DRAWS))
    mean, covariance = dead_reckon(np.tile([1.0, 2.0, 0.3], (31, 1)), draws, (1.02, 0.01), (0.3, 1.0, 0.0))
    np.testing.assert_array_equal(mean, [0.0, 0.0, 0.3, 1.0, 0.0])
    assert covariance[4, 4] == pytest.approx(BIAS_WALK**2 * 1.0)
    assert not covariance[:4].any()


def test_covariance_matches_the_spread_of_dead_reckoning() -> None:
    track = curve(45)
    draws = np.random.default_rng(2).standard_normal((6000, 45, ODOMETRY_DRAWS))
    ends = np.array([dead_reckon(track, draw, (1.0, 0.0), (0.7, 1.0, 0.0))[0][:3] for draw in draws])
    covariance = dead_reckon(track, exact(45), (1.0, 0.0), (0.7, 1.0, 0.0))[1][:3, :3]
    found, spread = np.cov(ends.T), np.sqrt(np.diag(covariance))
    np.testing.assert_allclose(np.sqrt(np.diag(found)), spread, rtol=0.05)
    np.testing.assert_allclose(found, covariance, atol=0.05 * np.outer(spread, spread).max())
