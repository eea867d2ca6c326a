"""Substeps per second of a world with all actors, against highway-env's own road on the same map."""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable
from functools import partial
from typing import Final

import numpy as np

from benchmarks.timing import Figures, Progress, alternate, cpu_seconds, ignore_progress, machine, rounded
from dorothie_gym.maps import load_town
from dorothie_gym.ontology import PropKind
from dorothie_gym.sim.batch.worlds import alone, step_batch_of_one
from dorothie_gym.sim.config import FRAME_RATE
from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.sim.population import add_prop, populate
from dorothie_gym.sim.state.codes import Kind, Walk
from dorothie_gym.sim.state.town_arrays import TownArrays, town_arrays
from dorothie_gym.sim.state.world_arrays import WorldArrays, empty_world

SUBSTEPS: Final = 15
"""Substeps of a call: a decision of half a second."""

WARM_UP_SUBSTEPS: Final = 900
"""Substeps before the measurement: 30 s, in which traffic forms queues at the lights."""

PROP_CLEARANCE: Final = 20.0
"""Least distance of a prop from any vehicle [m]."""

KERNEL, STOCK = "compiled simulation", "highway-env's road"
"""Names of the measured programs."""

_COPIES = 8


def measure(
    town: str = "northgate",
    *,
    vehicles: int = 30,
    pedestrians: int = 20,
    props: int = 4,
    seed: int = 0,
    calls: int = 600,
    stock_substeps: int = 6,
    repeats: int = 7,
    progress: Progress = ignore_progress,
) -> Figures:
    """Measures both alternately, in CPU seconds.

    Args:
        town: name or file.
        vehicles: number of vehicles, as many as fit, a tenth of them cyclists.
        pedestrians: number of pedestrians.
        props: number of props, in the middle of lanes with a neighbouring lane.
        seed: seed of positions and destinations.
        calls: calls of the simulation in a repetition, of `SUBSTEPS` each.
        stock_substeps: substeps of highway-env's road in a repetition.
        repeats: number of repetitions.
        progress: callback for the progress.

    Raises:
        TownError: there is no such town, or its file is invalid.
    """
    progress("town", 0.0)
    network = TownNetwork(load_town(town))
    arrays = town_arrays(network)
    world = crowd(network, arrays, vehicles=vehicles, pedestrians=pedestrians, props=props, seed=seed)
    progress("warming up", 0.0)
    batch = alone(world)
    step_batch_of_one(arrays, batch, WARM_UP_SUBSTEPS, 1.0 / FRAME_RATE)
    timings = alternate(
        {
            KERNEL: lambda: cpu_seconds(partial(_run, arrays, batch, calls)) / (calls * SUBSTEPS),
            STOCK: _stock_work(network, world, stock_substeps),
        },
        repeats,
        progress,
    )
    kernel, stock = timings[KERNEL], timings[STOCK]
    kinds = world.vehicles["kind"]
    return {
        "town": network.town.name,
        "lanes": len(network.town.lanes),
        "vehicles": int((kinds != Kind.EMPTY).sum()),
        "cyclists": int((kinds == Kind.CYCLIST).sum()),
        "pedestrians": int((world.pedestrians["state"] != Walk.EMPTY).sum()),
        "props": int(world.props["present"].sum()),
        "seed": seed,
        "substeps_per_second": rounded(kernel.rate),
        "best": rounded(kernel.best),
        "spread": kernel.spread,
        "stock_substeps_per_second": rounded(stock.rate),
        "stock_best": rounded(stock.best),
        "stock_spread": stock.spread,
        "ratio": rounded(stock.median / kernel.median),
        "bytes_per_world": bytes_per_world(world),
        "repeats": repeats,
        "machine": machine(),
    }


def crowd(
    network: TownNetwork, arrays: TownArrays, *, vehicles: int, pedestrians: int, props: int, seed: int
) -> WorldArrays:
    """Returns a world with cars, cyclists, pedestrians, lights and signs, and props that the traffic has to pass."""
    world = empty_world(arrays, vehicles=vehicles, pedestrians=pedestrians, props=props, seed=seed)
    populate(network, arrays, world, seed=seed, vehicles=vehicles, pedestrians=pedestrians)
    lanes = network.town.lanes
    wide = [k for k, lane in enumerate(arrays.lanes) if lane.junction < 0 and max(lane.left, lane.right) >= 0]
    placed = 0
    for lane in np.random.default_rng(seed).permutation(wide).tolist():
        if placed == props:
            break
        station = 0.5 * lanes[lane].length
        x, y = lanes[lane].position(station)
        if np.hypot(world.vehicles["x"] - x, world.vehicles["y"] - y).min(initial=np.inf) > PROP_CLEARANCE:
            add_prop(network, arrays, world, PropKind.TRAFFIC_CONE, lane, station)
            placed += 1
    return world


def bytes_per_world(world: WorldArrays) -> int:
    """Returns the memory of one more such world in the same town, including Python's own objects [bytes]."""
    tracemalloc.start()
    try:
        before = tracemalloc.get_traced_memory()[0]
        copies = [world.copy() for _ in range(_COPIES)]
        return (tracemalloc.get_traced_memory()[0] - before) // len(copies)
    finally:
        tracemalloc.stop()


def _run(arrays: TownArrays, batch: WorldArrays, calls: int) -> None:
    for _ in range(calls):
        step_batch_of_one(arrays, batch, SUBSTEPS, 1.0 / FRAME_RATE)


def _stock_work(network: TownNetwork, world: WorldArrays, substeps: int) -> Callable[[], float]:
    """Returns the measurement of a substep of highway-env's road with the same vehicles."""
    # imported here: highway-env is slow to import
    from benchmarks.highway_reference import run_stock, stock_road

    road = stock_road(network, world)
    return lambda: cpu_seconds(partial(run_stock, road, substeps, 1.0 / FRAME_RATE)) / substeps
