from __future__ import annotations

import math

import numpy as np
import pytest

from dorothie_gym.session.beliefs import PlaceEstimate, about, near, refined

STREET = np.column_stack((np.arange(-200.0, 201.0, 10.0), np.zeros(41)))
ELLIPSE_95 = 5.991


def deviations(place: PlaceEstimate) -> tuple[float, float]:
    (xx, _), (_, yy) = place.covariance
    return math.sqrt(xx), math.sqrt(yy)


def test_street_gives_elongated_estimate() -> None:
    place = about(None, STREET, 15.0)
    assert place.mean == pytest.approx((0.0, 0.0))
    assert deviations(place) == pytest.approx((math.hypot(118.3, 15.0), 15.0), rel=0.01)


def test_two_streets_give_estimate_at_their_corner() -> None:
    crossing = STREET[:, ::-1] + [60.0, 0.0]
    place = about(about(None, STREET, 15.0), crossing, 15.0)
    assert place.mean == pytest.approx((60.0, 0.0), abs=3.0)
    assert max(deviations(place)) < 16.0


def test_slanting_street_correlates_axes() -> None:
    slanting = np.column_stack((STREET[:, 0], STREET[:, 0]))
    (xx, xy), (_, yy) = about(None, slanting, 15.0).covariance
    assert xy > 0.9 * math.sqrt(xx * yy)


def test_statement_about_street_narrows_estimate_across_it_only() -> None:
    before = near(30.0, 20.0, 25.0)
    after = about(before, STREET, 15.0)
    assert abs(after.mean[1]) < 10.0
    assert after.mean[0] == pytest.approx(30.0, abs=1.0)
    assert deviations(after)[1] < 15.0
    assert deviations(after)[0] == pytest.approx(25.0, abs=1.0)


def test_two_landmarks_of_a_name_stay_possible() -> None:
    both = about(None, np.array([[-100.0, 0.0], [100.0, 0.0]]), 20.0)
    assert deviations(both)[0] > 100.0
    estimate = about(near(80.0, 0.0, 30.0), np.array([[-100.0, 0.0], [100.0, 0.0]]), 20.0)
    assert estimate.mean[0] == pytest.approx(94.0, abs=2.0)


def test_marks_refine_each_other() -> None:
    place = near(0.0, 0.0, 20.0)
    for _ in range(3):
        place = refined(place, near(6.0, 0.0, 20.0))
    assert place.mean == pytest.approx((4.5, 0.0))
    assert deviations(place) == pytest.approx((10.0, 10.0))


def test_moved_mark_outweighs_earlier_mark() -> None:
    place = refined(near(0.0, 0.0, 20.0), near(30.0, 0.0, 20.0), drift=20.0)
    assert 15.0 < place.mean[0] < 30.0


@pytest.mark.parametrize("statement", ["mark", "street"])
def test_contradicting_statement_replaces_estimate(statement: str) -> None:
    before = near(0.0, 500.0, 20.0)
    after = refined(before, near(0.0, 0.0, 20.0)) if statement == "mark" else about(before, STREET, 15.0)
    assert after == (near(0.0, 0.0, 20.0) if statement == "mark" else about(None, STREET, 15.0))


def test_estimate_without_points_raises_error() -> None:
    with pytest.raises(ValueError, match="at least one point"):
        about(None, np.zeros((0, 2)), 10.0)


def test_coverage_of_ellipse_equals_its_probability() -> None:
    """Statements about a street and a neighbouring landmark, in either order, and a mark."""
    rng = np.random.default_rng(0)
    inside = []
    for _ in range(400):
        truth = np.array([rng.uniform(-180.0, 180.0), 0.0]) + rng.normal(0.0, 15.0, 2)
        landmark = truth + rng.normal(0.0, 30.0, 2)
        mark = truth + rng.normal(0.0, 20.0, 2)
        place = about(None, STREET, 15.0)
        place = about(place, landmark[None], 30.0)
        place = refined(place, near(float(mark[0]), float(mark[1]), 20.0))
        inside.append(place.distance(float(truth[0]), float(truth[1])) <= ELLIPSE_95)
    assert np.mean(inside) == pytest.approx(0.95, abs=0.035)
