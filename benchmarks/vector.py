"""Throughput of a batch of worlds by number of threads, and of `Navigation-v0` in each of Gymnasium's vector modes."""

from __future__ import annotations

import statistics
import time
from functools import partial
from typing import Final

import gymnasium
import numpy as np
from numpy.typing import NDArray

from benchmarks.timing import Figures, Progress, ignore_progress, machine, wall_seconds
from benchmarks.world import SUBSTEPS
from dorothie_gym.maps import load_town
from dorothie_gym.sim.batch.worlds import VectorWorld
from dorothie_gym.sim.config import FRAME_RATE
from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.sim.population import populate
from dorothie_gym.sim.state.town_arrays import town_arrays
from dorothie_gym.sim.state.world_arrays import empty_world

DT: Final = 1.0 / FRAME_RATE
"""Length of a substep [s]."""

BATCH_WARM_UP_SUBSTEPS: Final = 300
"""Substeps before the measurement: 10 s."""


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
    progress: Progress = ignore_progress,
) -> Figures:
    """Steps the same worlds with one thread and with several, alternately, and environments in three vector modes.

    Args:
        town: name or file of a town.
        worlds: number of worlds.
        vehicles: number of vehicles in each.
        pedestrians: number of pedestrians in each.
        threads: number of threads to compare with one.
        repeats: number of repetitions.
        calls: calls of `SUBSTEPS` each in a repetition.
        environments: number of `Navigation-v0` environments; 0 omits this comparison.
        steps: steps of these in a repetition.
        progress: callback for the progress.

    Returns:
        `threads`, `scaling` (speed relative to one thread in wall-clock time; median of the repetitions) and its
        `spread` (interquartile range), `processors` (mean number of processors available to the threads; if it is
        below `threads`, other programs disturb the measurement of `scaling`), `substeps_per_second` and
        `substeps_per_second_one_thread`, `locked` (share of time outside the compiled loops, where a thread may hold
        the interpreter lock), and the steps per second of all environments together: `vector_steps_per_second`,
        `sync_steps_per_second`, `async_steps_per_second`.
    """
    progress("threads and environments", 0.0)
    one, many = _worlds(town, worlds, vehicles, pedestrians, threads)
    single, several, processors = [], [], []
    for _ in range(repeats):
        single.append(wall_seconds(partial(_run, one, calls)))
        used = time.process_time()
        several.append(wall_seconds(partial(_run, many, calls)))
        processors.append((time.process_time() - used) / several[-1])
    ratios = [a / b for a, b in zip(single, several, strict=True)]
    low, _, high = statistics.quantiles(ratios, n=4)
    idle = statistics.median(wall_seconds(lambda: one.step(0, DT)) for _ in range(repeats * calls))
    done = worlds * calls * SUBSTEPS
    figures: Figures = {
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
        "machine": machine(),
    }
    many.close()
    return figures | (environment_speeds(environments, steps) if environments else {})


def environment_speeds(environments: int = 8, steps: int = 200, repeats: int = 3) -> dict[str, float]:
    """Returns the steps per second of several `Navigation-v0` in each of Gymnasium's vector modes, alternately.

    Args:
        environments: number of environments.
        steps: steps of a repetition.
        repeats: number of repetitions; the median counts.
    """
    modes = {"vector": "vector_entry_point", "sync": "sync", "async": "async"}
    made = {
        name: gymnasium.make_vec("dorothie_gym/Navigation-v0", environments, vectorization_mode=mode)
        for name, mode in modes.items()
    }
    idle = np.zeros(environments, dtype=np.int64)
    speeds: dict[str, list[float]] = {name: [] for name in modes}
    for env in made.values():
        env.reset(seed=0)
        env.step(idle)
    for _ in range(repeats):
        for name, env in made.items():
            count = steps if name == "vector" else max(steps // 10, 1)
            seconds = wall_seconds(partial(_step_idle, env, idle, count))
            speeds[name].append(environments * count / seconds)
    for env in made.values():
        env.close()
    return {f"{name}_steps_per_second": round(statistics.median(values), 1) for name, values in speeds.items()}


def _worlds(town: str, count: int, vehicles: int, pedestrians: int, threads: int) -> tuple[VectorWorld, VectorWorld]:
    """Returns the same worlds twice, for one thread and for several, after the warm-up."""
    network = TownNetwork(load_town(town))
    arrays = town_arrays(network)
    template = empty_world(arrays, vehicles=vehicles, pedestrians=pedestrians)
    one, many = (VectorWorld(arrays, template, count, threads=number) for number in (1, threads))
    for number in range(count):
        world = empty_world(arrays, vehicles=vehicles, pedestrians=pedestrians, seed=number)
        populate(network, arrays, world, seed=number, vehicles=vehicles, pedestrians=pedestrians)
        one.put(number, world)
        many.put(number, world)
    for worlds in (one, many):
        worlds.step(BATCH_WARM_UP_SUBSTEPS, DT)
    return one, many


def _run(worlds: VectorWorld, calls: int) -> None:
    for _ in range(calls):
        worlds.step(SUBSTEPS, DT)


def _step_idle(env: gymnasium.vector.VectorEnv, idle: NDArray[np.int64], count: int) -> None:
    for _ in range(count):
        env.step(idle)
