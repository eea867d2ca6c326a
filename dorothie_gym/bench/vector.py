"""Throughput of many worlds by number of threads, and of `Town-v0` in each of Gymnasium's vector modes."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np

from dorothie_gym.maps import load_town
from dorothie_gym.sim.batch.worlds import VectorWorld
from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.sim.population import populate
from dorothie_gym.sim.state.town_arrays import town_arrays
from dorothie_gym.sim.state.world_arrays import empty_world

DT = 1.0 / 30.0
SUBSTEPS = 15
WARM_UP = 300


def measure(
    town: str = "northgate",
    *,
    worlds: int = 64,
    vehicles: int = 30,
    pedestrians: int = 20,
    threads: int = 2,
    repeats: int = 9,
    calls: int = 20,
    environments: int = 8,
    steps: int = 200,
) -> dict[str, Any]:
    """Steps the same worlds by one thread and by several, in turns, and environments in three ways.

    Args:
        town: name or file of a town.
        worlds: how many.
        vehicles: in each.
        pedestrians: in each.
        threads: how many are compared with one.
        repeats: measurements of each.
        calls: of 15 substeps in a measurement.
        environments: `Town-v0` so many times over; 0 to leave this comparison out.
        steps: of these in a measurement.

    Returns:
        `threads`, `scaling` (how many times faster they are than one, in wall time; the median of the repeats) and its
        `spread` (between the quartiles), `processors` (that the threads were given on average: less than `threads` on a
        machine that others use, and then `scaling` says little), `substeps_per_second` and
        `substeps_per_second_one_thread`, `locked` (share of time outside the compiled loops, in which alone a thread
        may hold the interpreter's lock), and the steps per second of all environments together:
        `vector_steps_per_second`, `sync_steps_per_second`, `async_steps_per_second`.
    """
    one, many = _worlds(town, worlds, vehicles, pedestrians, threads)
    single, several, processors = [], [], []
    for _ in range(repeats):
        single.append(_seconds(lambda: _run(one, calls)))
        used = time.process_time()
        several.append(_seconds(lambda: _run(many, calls)))
        processors.append((time.process_time() - used) / several[-1])
    ratios = [a / b for a, b in zip(single, several, strict=True)]
    low, _, high = statistics.quantiles(ratios, n=4)
    idle = statistics.median(_seconds(lambda: one.step(0, DT)) for _ in range(repeats * calls))
    done = worlds * calls * SUBSTEPS
    found = {
        "town": town,
        "worlds": worlds,
        "vehicles": vehicles,
        "pedestrians": pedestrians,
        "threads": many.threads,
        "scaling": round(statistics.median(ratios), 3),
        "spread": round(high - low, 3),
        "processors": round(statistics.median(processors), 3),
        "substeps_per_second": round(done / statistics.median(several)),
        "substeps_per_second_one_thread": round(done / statistics.median(single)),
        "locked": round(many.threads * idle * calls / statistics.median(several), 5),
    }
    many.close()
    return found | (environment_speeds(environments, steps) if environments else {})


def environment_speeds(environments: int = 8, steps: int = 200, repeats: int = 3) -> dict[str, float]:
    """Steps per second of `Town-v0`, all environments together, in each of Gymnasium's ways, taken in turns.

    Args:
        environments: how many.
        steps: in a measurement.
        repeats: measurements of each; the median counts.
    """
    modes = {"vector": "vector_entry_point", "sync": "sync", "async": "async"}
    made = {
        name: gymnasium.make_vec("dorothie_gym/Town-v0", environments, vectorization_mode=mode)
        for name, mode in modes.items()
    }
    idle = np.ones(environments, dtype=np.int64)
    speeds: dict[str, list[float]] = {name: [] for name in modes}
    for env in made.values():
        env.reset(seed=0)
        env.step(idle)
    for _ in range(repeats):
        for name, env in made.items():
            wanted = steps if name == "vector" else max(steps // 10, 1)
            seconds = _seconds(lambda env=env, wanted=wanted: [env.step(idle) for _ in range(wanted)])  # type: ignore[misc]
            speeds[name].append(environments * wanted / seconds)
    for env in made.values():
        env.close()
    return {f"{name}_steps_per_second": round(statistics.median(values), 1) for name, values in speeds.items()}


def _worlds(town: str, count: int, vehicles: int, pedestrians: int, threads: int) -> tuple[VectorWorld, VectorWorld]:
    """The same worlds twice, for one thread and for several, some seconds after their beginning."""
    network = TownNetwork(load_town(town))
    arrays = town_arrays(network)
    room = empty_world(arrays, vehicles=vehicles, pedestrians=pedestrians)
    one, many = (VectorWorld(arrays, room, count, threads=wanted) for wanted in (1, threads))
    for number in range(count):
        world = empty_world(arrays, vehicles=vehicles, pedestrians=pedestrians, seed=number)
        populate(network, arrays, world, seed=number, vehicles=vehicles, pedestrians=pedestrians)
        one.put(number, world)
        many.put(number, world)
    for worlds in (one, many):
        worlds.step(WARM_UP, DT)
    return one, many


def _run(worlds: VectorWorld, calls: int) -> None:
    for _ in range(calls):
        worlds.step(SUBSTEPS, DT)


def _seconds(work: Callable[[], object]) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start
