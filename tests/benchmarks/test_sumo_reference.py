from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.sumo_reference import _lanes_of, _write_grid


@pytest.mark.parametrize("size", [3, 5])
def test_number_of_lanes_equals_that_of_sumo(size: int, tmp_path: Path) -> None:
    pytest.importorskip("sumo", reason="the extra [sumo] is not installed")
    path = tmp_path / "grid.net.xml"
    _write_grid(path, _lanes_of(size), 40.0 * 4 * size * (size - 1))
    assert path.read_text(encoding="utf-8").count("<lane ") == _lanes_of(size)
