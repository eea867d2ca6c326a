from __future__ import annotations

import json
import time

import pytest
from highway_env.vehicle.behavior import IDMVehicle

from benchmarks import env as bench
from benchmarks.env import NO_SUMO, IdleSession, measure
from benchmarks.highway_reference import StockIntersection

KEYS = [
    "town", "lanes", "vehicles", "pedestrians", "seed", "substeps_per_step", "steps_per_second", "best", "spread",
    "simulated_seconds_per_second", "stock_steps_per_second", "stock_spread", "stock_simulated_seconds_per_second",
    "ratio", "sumo_substeps_per_second", "sumo_spread", "sumo_missing", "two_processes_scaling", "repeats", "machine",
]  # fmt: skip


def test_figures_are_consistent(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bench, "find_spec", lambda name: None)
    monkeypatch.setattr(bench, "available_processors", lambda: 1)
    figures = measure("brookside", vehicles=2, pedestrians=1, decisions=2, stock_steps=1, repeats=2)
    assert list(figures) == KEYS and json.loads(json.dumps(figures)) == figures
    assert figures["substeps_per_step"] == 15
    assert (figures["vehicles"], figures["pedestrians"]) == (2, 1)
    simulated = figures["simulated_seconds_per_second"]
    assert simulated == pytest.approx(figures["steps_per_second"] / 2, rel=2e-3)
    assert figures["ratio"] == pytest.approx(simulated / figures["stock_simulated_seconds_per_second"], rel=2e-3)
    assert figures["stock_simulated_seconds_per_second"] == figures["stock_steps_per_second"] > 0.0  # one second each
    assert figures["sumo_substeps_per_second"] is None and figures["sumo_missing"] == NO_SUMO
    assert "dorothie-gym[sumo]" in NO_SUMO
    assert figures["two_processes_scaling"] is None


@pytest.mark.long
def test_two_processes_are_compared_with_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bench, "available_processors", lambda: 2)
    scaling = bench._two_processes("brookside", 0, 0, 0, 20, 1, lambda part, share: None)
    assert scaling is not None and 0.1 < scaling < 10.0


def test_sumo_worker_steps_a_grid() -> None:
    pytest.importorskip("libsumo", reason="the extra [sumo] is not installed")
    pytest.importorskip("sumo", reason="the extra [sumo] is not installed")
    from benchmarks.timing import Worker

    with Worker("sumo_reference", lanes=80, length=3000.0, vehicles=5, seed=0, substeps=50) as worker:
        worker.wait()
        assert worker.run() > 0.0


def test_idle_session_restarts_after_its_end() -> None:
    session = IdleSession("brookside", 0, 0, 0)
    session.env.agents = []
    assert session.seconds(3, time.perf_counter) > 0.0
    assert session.env.agents and session.env.session.world.time == 1.5


def test_stock_intersection_restarts_after_an_episode() -> None:
    stock = StockIntersection(seed=0)
    assert (stock.seconds_per_step, stock.substeps_per_step) == (1.0, 15)
    for _ in range(16):  # an episode lasts 13 steps at most
        stock.prepare()
        stock.step()
    assert stock.vehicles > 1
    stock.close()


def test_stock_intersection_restores_parameters_of_idm_vehicles() -> None:
    parameters = {name: value for name, value in vars(IDMVehicle).items() if name.isupper()}
    stock = StockIntersection(seed=0)
    assert vars(IDMVehicle)["COMFORT_ACC_MAX"] != parameters["COMFORT_ACC_MAX"]
    stock.close()
    assert {name: value for name, value in vars(IDMVehicle).items() if name.isupper()} == parameters
