from __future__ import annotations

import json
import time
from typing import Any

import pytest

from benchmarks.report import sessions_report
from benchmarks.session_costs import OTHER, PARTS, STAGES, PartTimes
from benchmarks.sessions import HERE, ROOT, builds, measure, run
from benchmarks.timing import BenchmarkProcessError
from dorothie_gym.ontology import Role

SETTINGS = {"towns": ["brookside"], "seeds": [7], "co_wizard": "scripted", "record": True, "max_seconds": 30.0}


def busy(seconds: float) -> None:
    end = time.process_time() + seconds
    while time.process_time() < end:
        pass


def test_time_within_another_part_counts_for_itself_alone() -> None:
    times = PartTimes(by_role=False)
    inner = times.timed("inner", busy)
    with times.within("outer"):
        inner(0.5)  # not counted
    times.counting = True
    with times.within("outer"):
        busy(0.02)
        inner(0.05)
        busy(0.02)
    assert 0.04 <= times.seconds["outer"] < 0.09
    assert 0.05 <= times.seconds["inner"] < 0.09


@pytest.mark.long
def test_parts_of_a_session_add_up() -> None:
    found = run(ROOT, {**SETTINGS, "parts": True})
    assert found["decisions"] == 60 and found["simulated_seconds"] == 30.0 and not found["missing"]
    assert sum(found["parts"].values()) == pytest.approx(found["seconds"], rel=0.05)
    assert {*PARTS, *map(str, Role), OTHER} - {str(Role.AGENT)} <= set(found["parts"])
    for role in STAGES:
        assert any(part.startswith(f"{role}: ") for part in found["parts"]), role


@pytest.mark.slow
def test_figures_of_this_build_are_consistent() -> None:
    figures = measure(["brookside"], co_wizards=["scripted"], sessions=1, max_seconds=30.0, repeats=1)
    assert json.loads(json.dumps(figures)) == figures
    (row,) = figures["rows"]
    assert row["theirs"] is row["ratio"] is None
    assert row["ours"]["decisions"] == 60
    hour = 7200 / row["ours"]["decisions_per_second"]
    assert row["ours"]["seconds_per_hour"] == pytest.approx(hour, rel=0.01)
    report = sessions_report(figures)
    assert [each.reference for each in report.rows] == [False]


def test_other_revisions_are_unpacked_beside_this_build() -> None:
    with builds("HEAD") as folders:
        other = folders["HEAD"]
        assert folders[HERE] == ROOT and (other / "dorothie_gym" / "errors.py").is_file()
        assert not (other / "benchmarks").exists()
    assert not other.exists()


@pytest.mark.parametrize("revision", ["no-such-revision"])
def test_unknown_revisions_are_refused(revision: str) -> None:
    with pytest.raises(BenchmarkProcessError, match="git ended with code"), builds(revision):
        pass


def test_report_names_both_builds() -> None:
    found: dict[str, Any] = {
        "decisions": 100, "decisions_per_second": 800.0, "best": 820.0, "spread": 0.01, "seconds_per_hour": 9.0,
        "milliseconds_by_part": {"hearing": 0.5, "physics": 0.1}, "missing_parts": [],
        "megabytes_per_session": 1.2,
    }  # fmt: skip
    machine = {
        "processor": "P", "cores": 2, "system": "S", "python": "3", "numba": "1", "numpy": "2", "highway_env": "1",
    }  # fmt: skip
    rows = [{"co_wizard": "scripted", "ours": found, "theirs": {**found, "decisions_per_second": 400.0}, "ratio": 2.0}]
    figures = {
        "towns": ["midtown"],
        "sessions": 4,
        "recorded": False,
        "at_once": 32,
        "against": "v1",
        "rows": rows,
        "machine": machine,
    }
    report = sessions_report(figures)
    assert [(each.value, each.reference) for each in report.rows] == [(800.0, False), (400.0, True)]
    assert "2 times the decisions per second of v1" in report.notes[0]
    assert "1.2 MB a session" in report.notes[0] and "32 at once" in report.setting
    assert "hearing 500" in report.notes[1]


@pytest.mark.long
def test_sessions_at_once_have_as_many_decisions_as_one_by_one() -> None:
    settings = {**SETTINGS, "seeds": [5000, 5001], "max_seconds": 10.0, "parts": False, "at_once": 2}
    found = run(ROOT, settings)
    assert found["decisions"] == 40 and found["megabytes"] > 0.0
