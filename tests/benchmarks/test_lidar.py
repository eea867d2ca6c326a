from __future__ import annotations

import json
from pathlib import Path

import pytest

from benchmarks.lidar import measure
from benchmarks.report import lidar_report
from benchmarks.report_chart import draw


@pytest.mark.long
def test_rows_are_the_turns_that_are_asked_for(tmp_path: Path) -> None:
    figures = measure("brookside", turns=((4, 36), (8, 72)), vehicles=3, pedestrians=2, repeats=1)
    assert json.loads(json.dumps(figures)) == figures
    assert [(row["channels"], row["columns"]) for row in figures["rows"]] == [(4, 36), (8, 72)]
    for row in figures["rows"]:
        assert 0.0 < row["milliseconds"] <= row["milliseconds_worst"] and 0.2 < row["returns"] <= 1.0
    assert figures["places"] == 9 and figures["embree"]["milliseconds"] > 0.0
    report = lidar_report(figures)
    assert "turns of 4 x 36 rays per second" in report.headline and len(report.rows) == 3
    draw(report, tmp_path / "chart.png")
    assert (tmp_path / "chart.png").is_file()
