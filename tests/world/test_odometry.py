from __future__ import annotations

import numpy as np
import pytest

from dorothie_gym.world.odometry import DRAWS, dead_reckon, process_noise
from dorothie_gym.world.town.model import Array

DT = 1 / 30


def curve(frames: int = 90) -> Array:
    """A car that turns right at 8 m/s with a side slip."""
    headings = 0.7 + 0.4 * DT * np.arange(frames + 1)
    steps = 8.0 * DT * np.column_stack((np.cos(headings + 0.05), np.sin(headings + 0.05)))[:-1]
    return np.column_stack((np.concatenate((np.zeros((1, 2)), np.cumsum(steps, axis=0))), headings))


def exact(frames: int = 90) -> Array:
    return np.zeros((frames, DRAWS))


def test_without_errors_dead_reckoning_finds_the_place() -> None:
    track = curve()
    east, south, turned, length, moving, *_ = dead_reckon(track, exact(), DT, 1.0, 0.0, 0.7, 1.0, 0.0)
    assert (east, south) == pytest.approx(tuple(track[-1, :2]))
    assert turned == pytest.approx(0.4 * 3.0)
    assert (length, moving) == pytest.approx((24.0, 3.0))


def test_known_errors_are_taken_out() -> None:
    track = curve()
    east, south, turned, *_ = dead_reckon(track, exact(), DT, 1.03, 0.02, 0.7, 1.03, 0.02)
    assert (east, south) == pytest.approx(tuple(track[-1, :2]))
    assert turned == pytest.approx(1.2)


@pytest.mark.parametrize("believed", [(0.7, 1.0, 0.0), (0.9, 1.02, 0.01)])
def test_moments_are_the_derivatives_that_the_filter_takes_them_for(believed: tuple[float, float, float]) -> None:
    def reckon(heading: float, scale: float, bias: float) -> Array:
        return dead_reckon(curve(), exact(), DT, 1.01, 0.005, heading, scale, bias)

    east, south, _, _, moving, east_moment, south_moment, _ = reckon(*believed)
    scale = believed[1]
    expected = np.array([[-south, -east / scale, south_moment], [east, -south / scale, -east_moment], [0, 0, -moving]])
    step = 1e-6
    for k in range(3):
        up, down = list(believed), list(believed)
        up[k], down[k] = up[k] + step, down[k] - step
        np.testing.assert_allclose((reckon(*up) - reckon(*down))[:3] / (2 * step), expected[:, k], rtol=1e-6, atol=1e-7)


def test_a_standing_car_counts_neither_way_nor_turn() -> None:
    draws = np.random.default_rng(0).standard_normal((30, DRAWS))
    result = dead_reckon(np.tile([1.0, 2.0, 0.3], (31, 1)), draws, DT, 1.02, 0.01, 0.3, 1.0, 0.0)
    assert not result[:7].any()
    noise = process_noise(0.0, 0.0, 0.0, 0.0, 1.0)
    assert noise[4, 4] > 0.0
    assert not noise[:4, :4].any()


def test_process_noise_has_the_spread_of_what_dead_reckoning_makes() -> None:
    track = curve(45)
    draws = np.random.default_rng(1).standard_normal((4000, 45, DRAWS))
    ends = np.array([dead_reckon(track, draw, DT, 1.0, 0.0, 0.7, 1.0, 0.0)[:3] for draw in draws])
    east, south, turned, length, moving = dead_reckon(track, exact(45), DT, 1.0, 0.0, 0.7, 1.0, 0.0)[:5]
    noise = process_noise(east, south, length, moving, moving)[:3, :3]
    np.testing.assert_allclose(np.sqrt(np.diag(np.cov(ends.T))), np.sqrt(np.diag(noise)), rtol=0.12)
    assert turned == pytest.approx(0.4 * 1.5)
