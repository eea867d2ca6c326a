"""Simulated arrivals of a study in pairs: few wait in vain, and conditions stay balanced."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def arrivals() -> ModuleType:
    path = Path(__file__).parents[3] / "benchmarks" / "arrivals.py"
    spec = importlib.util.spec_from_file_location("arrivals", path)
    assert spec is not None and spec.loader is not None
    module = sys.modules["arrivals"] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_hardly_more_people_wait_in_vain_than_if_roles_were_given_at_pairing(arrivals: ModuleType) -> None:
    found = {way: arrivals.measure(way, 60) for way in arrivals.WAYS}
    assert found["package"]["in_vain"] <= 1.2 * found["at pairing"]["in_vain"], found
    assert found["at consent"]["in_vain"] > 2.5 * found["package"]["in_vain"], found
    assert found["package"]["imbalance"] <= 1 and found["package"]["changed"] < 8, found


@pytest.mark.parametrize(("every", "drop_out"), [(30.0, 0.3), (90.0, 0.0), (90.0, 0.6), (200.0, 0.3)])
def test_the_package_is_never_much_worse_than_the_reference(
    arrivals: ModuleType, every: float, drop_out: float
) -> None:
    ways = "package", "at pairing"
    found = {way: arrivals.measure(way, 15, every=every, drop_out=drop_out) for way in ways}
    assert found["package"]["in_vain"] <= 1.25 * found["at pairing"]["in_vain"] + 0.01, found
    assert found["package"]["imbalance"] <= 1, found
