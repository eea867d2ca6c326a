from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from benchmarks.report import Report, env_report, import_report, number, vector_report, world_report
from benchmarks.report_chart import CHART_DPI, CHART_WIDTH, draw
from benchmarks.timing import machine

WORLD = {
    "town": "northgate", "lanes": 484, "vehicles": 30, "cyclists": 1, "pedestrians": 20, "props": 4,
    "substeps_per_second": 120300.0, "best": 128600.0, "spread": 0.047, "stock_substeps_per_second": 3.325,
    "stock_best": 3.465, "stock_spread": 0.041, "ratio": 36170.0, "bytes_per_world": 34184,
}  # fmt: skip
ENV = {
    "town": "northgate", "lanes": 484, "vehicles": 30, "pedestrians": 20, "substeps_per_step": 15,
    "steps_per_second": 4400.0, "best": 4600.0, "spread": 0.1, "simulated_seconds_per_second": 2200.0,
    "stock_steps_per_second": 35.0, "stock_spread": 0.2, "stock_simulated_seconds_per_second": 35.0, "ratio": 62.9,
    "sumo_substeps_per_second": 33000.0, "sumo_spread": 0.04, "sumo_missing": None, "two_processes_scaling": 1.93,
}  # fmt: skip
VECTOR = {
    "town": "northgate", "worlds": 64, "vehicles": 30, "pedestrians": 20, "threads": 2, "scaling": 1.94,
    "spread": 0.02, "processors": 1.98, "substeps_per_second": 221000, "substeps_per_second_one_thread": 114000,
    "vector_steps_per_second": 31000.0, "sync_steps_per_second": 1300.0, "async_steps_per_second": 800.0,
}  # fmt: skip
IMPORT = {
    "town": "brookside",
    "seconds": {"package": 0.07, "first_environment": 1.3, "first_step": 1.6},
    "highway_env_seconds": 0.6,
    "ratio": 2.167,
    "spread": 0.02,
    "package_spread": 0.1,
    "highway_env_spread": 0.1,
}


def reported(report: Any, figures: dict[str, Any], **changes: Any) -> Report:
    made: Report = report({**figures, "machine": machine(), **changes})
    return made


def test_world_report_states_ratio_and_real_time() -> None:
    report = reported(world_report, WORLD)
    assert report.headline == "36,170 times highway-env's own road on the same map, 4,010 times real time"
    assert "30 vehicles (1 cyclist among them), 20 pedestrians, 4 props" in report.setting
    assert [(row.value, row.reference) for row in report.rows] == [(3.325, True), (120300.0, False)]
    assert report.mark is not None and report.mark.value == 30
    assert report.notes == ("memory of one more world in the same town: 33 KiB",)


def test_environment_report_is_in_simulated_time() -> None:
    report = reported(env_report, ENV)
    assert [row.value for row in report.rows] == [35.0, 1100.0, 2200.0]
    assert report.rows[-1].best == pytest.approx(2300.0)
    assert report.notes[-1] == "throughput of two processes: 1.93 times that of one"


def test_environment_report_lists_missing_measurements() -> None:
    report = reported(
        env_report,
        ENV,
        sumo_substeps_per_second=None,
        sumo_spread=None,
        sumo_missing="no SUMO",
        two_processes_scaling=None,
    )
    assert [row.value for row in report.rows] == [35.0, 2200.0]
    assert report.notes[-2:] == ("two processes were not measured on a single core", "no SUMO")


def test_vector_report_compares_several_threads_with_one() -> None:
    report = reported(vector_report, VECTOR)
    assert report.headline == "throughput of 2 threads: 1.94 times that of one"
    assert "64 worlds" in report.setting and "AsyncVectorEnv" in report.notes[-1]
    bare = {key: value for key, value in VECTOR.items() if not key.endswith("_steps_per_second")}
    assert len(reported(vector_report, bare).notes) == 1


def test_number_has_three_digits_or_whole_units() -> None:
    assert [number(value) for value in (128571.4, 99.94, 3.385, 0.0621)] == ["128,571", "99.9", "3.38", "0.0621"]


@pytest.mark.parametrize(
    ("report", "figures"),
    [(world_report, WORLD), (env_report, ENV), (vector_report, VECTOR), (import_report, IMPORT)],
    ids=["world", "env", "vector", "import"],
)
def test_chart_fits_its_texts(report: Any, figures: dict[str, Any], tmp_path: Path) -> None:
    pygame = pytest.importorskip("pygame")
    path = tmp_path / "chart.png"
    draw(reported(report, figures), path)
    picture = pygame.image.load(str(path))
    assert picture.get_width() == CHART_WIDTH * CHART_DPI
    for x, y in ((0, 0), (picture.get_width() - 1, 0), (0, picture.get_height() - 1)):
        assert picture.get_at((x, y)) == picture.get_at((3, 3)), "no text crosses the edge"
    assert path.stat().st_size < 150_000
