from __future__ import annotations

import pytest

from benchmarks.timing import BenchmarkProcessError, Timing, Worker, alternate, cpu_seconds, machine, rounded


def test_median_best_and_spread_of_repeats() -> None:
    timing = Timing((0.4, 0.1, 0.2, 0.3, 1.0))
    assert timing.median == 0.3
    assert timing.rate == pytest.approx(1 / 0.3)
    assert timing.best == 10.0
    assert timing.spread == pytest.approx((0.4 - 0.2) / 0.3, abs=1e-3)
    assert Timing((2.0,)).spread == 0.0


@pytest.mark.parametrize("seconds", [(), (0.1, 0.0)])
def test_timing_without_duration_is_refused(seconds: tuple[float, ...]) -> None:
    with pytest.raises(ValueError, match=r"Timing\.seconds"):
        Timing(seconds)


def test_functions_alternate_and_progress_grows() -> None:
    done: list[str] = []
    reported: list[tuple[str, float]] = []

    def work(name: str, seconds: float) -> float:
        done.append(name)
        return seconds

    timings = alternate(
        {"one": lambda: work("one", 1.0), "two": lambda: work("two", 2.0)}, 3, lambda *part: reported.append(part)
    )
    assert done == ["one", "two"] * 3 == [name for name, _ in reported]
    assert timings["one"].seconds == (1.0,) * 3 and timings["two"].median == 2.0
    shares = [share for _, share in reported]
    assert shares == sorted(shares) and shares[0] == 0.0 and shares[-1] < 1.0


def test_cpu_time_grows_with_work() -> None:
    assert cpu_seconds(lambda: sum(range(200_000))) > cpu_seconds(lambda: None) >= 0.0


def test_machine_lists_processor_and_versions() -> None:
    facts = machine()
    assert list(facts) == ["processor", "cores", "system", "python", "numba", "numpy", "highway_env"]
    assert all(facts.values()) and isinstance(facts["cores"], int)


def test_rounded_keeps_four_digits() -> None:
    assert [rounded(v) for v in (123456.0, 3.14159, 0.00123456)] == [123500.0, 3.142, 0.001235]


def test_worker_that_fails_to_start_reports_the_reason() -> None:
    with Worker("no_such_job") as worker, pytest.raises(BenchmarkProcessError, match="No module named .*no_such_job"):
        worker.wait()
