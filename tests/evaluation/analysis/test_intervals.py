from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from dorothie_gym.evaluation.analysis.intervals import Estimate


def test_half_width_by_hand() -> None:
    # Mean 0.5, standard deviation 0.1, t(0.975, 2) = 4.3027: 4.3027 x 0.1 / sqrt(3).
    estimate = Estimate.of({0: 0.4, 1: 0.5, 2: 0.6})
    assert estimate.mean == pytest.approx(0.5)
    assert estimate.half_width == pytest.approx(0.24841, abs=1e-5)


def test_one_seed_has_no_interval_and_none_has_no_mean() -> None:
    assert (Estimate.of({3: 0.4}).mean, Estimate.of({3: 0.4}).half_width) == (0.4, None)
    assert Estimate.of({}).to_json() == {"mean": None, "half_width": None, "seeds": 0, "values": {}}


def test_a_seed_without_a_figure_does_not_count() -> None:
    assert Estimate.of({0: 0.4, 1: math.nan}).seeds == 1


def test_differences_are_paired_over_the_seeds_that_both_have() -> None:
    # Both vary by seed, but always by the same: the difference is sure.
    difference = Estimate.of({0: 0.5, 1: 0.9, 2: 0.1}).minus(Estimate.of({0: 0.4, 1: 0.8, 7: 0.0}))
    assert difference.seeds == 2
    assert difference.mean == pytest.approx(0.1) and difference.half_width == pytest.approx(0.0)


@given(values=st.lists(st.floats(0, 1), min_size=2, max_size=8).filter(lambda v: max(v) - min(v) > 1e-3))
def test_interval_equals_that_of_scipy(values: list[float]) -> None:
    estimate = Estimate.of(dict(enumerate(values)))
    low, high = stats.t.interval(0.95, len(values) - 1, loc=sum(values) / len(values), scale=stats.sem(values))
    assert estimate.mean is not None and estimate.half_width is not None
    assert estimate.mean - estimate.half_width == pytest.approx(low)
    assert estimate.mean + estimate.half_width == pytest.approx(high)
