from __future__ import annotations

import numpy as np
import pytest

from dorothie_gym.evaluation.analysis.intervals import wilson_interval
from dorothie_gym.evaluation.closed_loop import (
    METRICS,
    DrivingScore,
    MetException,
    MetricInterval,
    RecoverySeconds,
    Seconds,
    Success,
    figures_of,
    interval_of,
)
from dorothie_gym.evaluation.closed_loop.metrics import _weighted_medians
from dorothie_gym.ontology import ExceptionKind
from tests.evaluation.closed_loop.drives import record


def test_interval_of_a_share_is_about_as_wide_as_the_binomial() -> None:
    sessions = [record(success=k < 60) for k in range(100)]
    found = interval_of(Success(), sessions)
    assert found.mean == 0.6 and found.low is not None and found.high is not None
    wide = 2 * 1.96 * (0.6 * 0.4 / 100) ** 0.5
    assert found.low < 0.6 < found.high and found.high - found.low == pytest.approx(wide, abs=0.02)


def test_equal_sessions_give_equal_intervals() -> None:
    sessions = [record(seconds=float(k)) for k in range(17)]
    assert interval_of(Seconds(), sessions) == interval_of(Seconds(), sessions)


def test_errored_sessions_count_as_the_worst_and_not_at_all_in_time() -> None:
    sessions = [record(completion=1.0, seconds=80.0)] * 3
    figures = figures_of(sessions, errored=1)
    assert figures["success"].mean == figures[DrivingScore.key].mean == 0.75
    assert figures["seconds"].mean == 80.0 and figures["infraction_score"].mean == 1.0


def test_all_errored_is_no_success() -> None:
    figures = figures_of([], errored=3)
    assert figures["success"].mean == 0.0 and figures["seconds"] == MetricInterval(mean=None)


def test_one_session_has_no_interval() -> None:
    assert interval_of(Seconds(), [record(seconds=4.0)]) == MetricInterval(mean=4.0)


def test_every_metric_has_a_figure() -> None:
    assert set(figures_of([record()])) == {*(metric.key for metric in METRICS), RecoverySeconds.key}


def test_median_is_over_exceptions_and_drawn_by_session() -> None:
    def recovered(*seconds: float) -> tuple[MetException, ...]:
        return tuple(MetException(kind=ExceptionKind.WEATHER, met=1.0, seconds=each) for each in seconds)

    found = figures_of([record(exceptions=recovered(1.0, 2.0, 9.0)), record(exceptions=recovered(4.0))])
    assert found["recovery_seconds"] == MetricInterval(mean=3.0, low=2.0, high=4.0)  # of the one, of both, of the other


def test_weighted_medians_are_those_of_the_values_written_out() -> None:
    rng = np.random.default_rng(3)
    values = np.sort(rng.uniform(size=9))
    counts = rng.integers(0, 4, size=(50, 9)).astype(float)
    counts[:, 4] += 1.0
    expected = [np.median(np.repeat(values, row.astype(int))) for row in counts]
    assert np.allclose(_weighted_medians(values, counts), expected)


@pytest.mark.parametrize(("successes", "sessions"), [(4, 4), (0, 20), (20, 20), (3, 4), (57, 60)])
def test_interval_of_success_is_wilsons_and_never_collapses(successes: int, sessions: int) -> None:
    from scipy.stats import binomtest

    found = interval_of(Success(), [record(success=k < successes) for k in range(sessions)])
    expected = binomtest(successes, sessions).proportion_ci(method="wilson")
    assert (found.low, found.high) == pytest.approx((expected.low, expected.high), abs=1e-9)
    assert found.low is not None and found.high is not None and found.low < found.high


def test_no_share_collapses_where_all_sessions_are_alike() -> None:
    figures = figures_of([record(completion=1.0)] * 4)
    for metric in METRICS:
        figure = figures[metric.key]
        if metric.is_share and figure.mean in (0.0, 1.0):
            assert figure.low is not None and figure.high is not None
            assert figure.high - figure.low > 0.4, metric.key


def test_sessions_without_an_exception_are_no_trials_of_recovery() -> None:
    exceptions = (MetException(kind=ExceptionKind.WEATHER, met=1.0, seconds=2.0),)
    figures = figures_of([record(exceptions=exceptions)] * 3 + [record()] * 50)
    assert figures["exceptions_recovered"].low == pytest.approx(wilson_interval(3, 3)[0])
