"""Steps per second of `DuoWizardEnv`, against highway-env's `intersection-v0` and, where it is installed, SUMO."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from contextlib import ExitStack
from functools import partial
from importlib.util import find_spec
from typing import TYPE_CHECKING, Final

from benchmarks.timing import Figures, Progress, Worker, alternate, ignore_progress, machine, rounded
from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.ontology import AGENT_ROLES
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.spaces import noop
from dorothie_gym.sim.config import FRAME_RATE, WorldConfig
from dorothie_gym.support.processors import available_processors

if TYPE_CHECKING:
    from benchmarks.highway_reference import StockIntersection

WARM_UP_DECISIONS: Final = 60
"""Decisions before the measurement: 30 s."""

UNREACHED_TIME_LIMIT: Final = 86400.0
"""Time limit of measured sessions, which none of them reaches [s]."""

ENV, STOCK, SUMO = "DuoWizardEnv", "intersection-v0", "SUMO"
"""Names of the measured programs."""

NO_SUMO: Final = "SUMO is not installed; install dorothie-gym[sumo]"


class IdleSession:
    """Session in which no role acts: all three agents get complete observations, and the car follows its road.

    Args:
        town: name or file.
        vehicles: number of vehicles, as many as fit.
        pedestrians: number of pedestrians.
        seed: seed of the session.
    """

    def __init__(self, town: str, vehicles: int, pedestrians: int, seed: int) -> None:
        world = WorldConfig(vehicles=vehicles, pedestrians=pedestrians)
        self.env = DuoWizardEnv(town, config=EnvConfig(world=world, max_seconds=UNREACHED_TIME_LIMIT))
        self._actions = {str(role): noop(role, self.env.limits) for role in AGENT_ROLES}
        self.env.reset(seed=seed)
        self.seconds(WARM_UP_DECISIONS, time.process_time)

    def seconds(self, decisions: int, clock: Callable[[], float]) -> float:
        """Plays a number of decisions and returns the duration of the steps by a clock, without resets [s]."""
        spent = 0.0
        while decisions > 0:
            if not self.env.agents:
                self.env.reset()
            start = clock()
            while decisions > 0 and self.env.agents:
                self.env.step(self._actions)
                decisions -= 1
            spent += clock() - start
        return spent


def prepare(town: str, vehicles: int, pedestrians: int, seed: int, decisions: int) -> Callable[[], float]:
    """Returns the work of a worker process: a number of decisions, timed in wall-clock seconds."""
    session = IdleSession(town, vehicles, pedestrians, seed)
    return partial(session.seconds, decisions, time.perf_counter)


def measure(
    town: str = "northgate",
    *,
    vehicles: int = 30,
    pedestrians: int = 20,
    seed: int = 0,
    decisions: int = 400,
    stock_steps: int = 20,
    sumo_substeps: int = 3000,
    repeats: int = 7,
    progress: Progress = ignore_progress,
) -> Figures:
    """Measures all alternately: single-threaded programs in CPU seconds, two processes in wall-clock seconds.

    Args:
        town: name or file.
        vehicles: number of vehicles, 0 to 200, as many as fit.
        pedestrians: number of pedestrians, 0 to 200.
        seed: seed of the session.
        decisions: steps of a repetition, of half a second of simulated time each.
        stock_steps: steps of `intersection-v0` in a repetition.
        sumo_substeps: steps of SUMO in a repetition.
        repeats: number of repetitions.
        progress: callback for the progress.

    Raises:
        TownError: there is no such town, or its file is invalid.
        BenchmarkProcessError: a worker process ended early.
    """
    # imported here: the worker processes need none of the references
    from benchmarks.highway_reference import StockIntersection

    progress("town", 0.0)
    session = IdleSession(town, vehicles, pedestrians, seed)
    lanes = session.env.town.lanes
    world = session.env.session.world
    stock = StockIntersection(seed)
    substeps = round(FRAME_RATE / session.env.config.decision_frequency)
    with ExitStack() as stack:
        stack.callback(stock.close)
        works: dict[str, Callable[[], float]] = {
            ENV: lambda: session.seconds(decisions, time.process_time) / decisions,
            STOCK: partial(_stock_seconds, stock, stock_steps),
        }
        sumo = find_spec("libsumo") is not None and find_spec("sumo") is not None
        if sumo:
            progress("SUMO", 0.0)
            length = sum(lane.length for lane in lanes)
            settings = {"lanes": len(lanes), "length": length, "vehicles": vehicles, "seed": seed}
            worker = stack.enter_context(Worker("sumo_reference", **settings, substeps=sumo_substeps))
            worker.wait()
            works[SUMO] = lambda: worker.run() / sumo_substeps
        timings = alternate(works, repeats, lambda part, share: progress(part, 0.7 * share))
    scaling = _two_processes(town, vehicles, pedestrians, seed, decisions, repeats, progress)
    ours, theirs = timings[ENV], timings[STOCK]
    seconds = ours.rate * substeps / FRAME_RATE
    return {
        "town": session.env.town.name,
        "lanes": len(lanes),
        "vehicles": len(world.actors.vehicles),
        "pedestrians": len(world.actors.pedestrians),
        "seed": seed,
        "substeps_per_step": substeps,
        "steps_per_second": rounded(ours.rate),
        "best": rounded(ours.best),
        "spread": ours.spread,
        "simulated_seconds_per_second": rounded(seconds),
        "stock_steps_per_second": rounded(theirs.rate),
        "stock_spread": theirs.spread,
        "stock_simulated_seconds_per_second": rounded(theirs.rate * stock.seconds_per_step),
        "ratio": rounded(seconds / (theirs.rate * stock.seconds_per_step)),
        "sumo_substeps_per_second": rounded(timings[SUMO].rate) if sumo else None,
        "sumo_spread": timings[SUMO].spread if sumo else None,
        "sumo_missing": None if sumo else NO_SUMO,
        "two_processes_scaling": scaling,
        "repeats": repeats,
        "machine": machine(),
    }


def _stock_seconds(stock: StockIntersection, steps: int) -> float:
    """Returns the CPU time of a step of highway-env's environment, without resets [s]."""
    spent = 0.0
    for _ in range(steps):
        stock.prepare()
        start = time.process_time()
        stock.step()
        spent += time.process_time() - start
    return spent / steps


def _two_processes(
    town: str, vehicles: int, pedestrians: int, seed: int, decisions: int, repeats: int, progress: Progress
) -> float | None:
    """Returns the throughput of two processes relative to one; None on a single processor."""
    if available_processors() < 2:
        return None
    progress("two processes", 0.7)
    with ExitStack() as stack:
        one, other = (
            stack.enter_context(
                Worker("env", town=town, vehicles=vehicles, pedestrians=pedestrians, seed=seed + k, decisions=decisions)
            )
            for k in range(2)
        )
        one.wait()
        other.wait()
        ratios = []
        for turn in range(repeats):
            progress("two processes", 0.7 + 0.3 * turn / repeats)
            alone = one.run(), other.run()
            one.start()
            other.start()
            together = one.seconds(), other.seconds()
            ratios.append(sum(a / t for a, t in zip(alone, together, strict=True)))
    return round(statistics.median(ratios), 3)
