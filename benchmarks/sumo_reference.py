"""SUMO on a grid of streets about as large as a town, as a reference (extra `sumo`)."""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from random import Random
from types import ModuleType
from typing import Final

from benchmarks.timing import cpu_seconds

STEP_SECONDS: Final = 0.033
"""Length of a step: SUMO counts in whole milliseconds [s]."""

WARM_UP_STEPS: Final = 900
"""Steps before the measurement: 30 s."""

ROUTE_EDGES: Final = 400
"""Edges of each vehicle's route; more than it can pass in any measurement."""

_SIZES = range(3, 30)


def prepare(lanes: int, length: float, vehicles: int, seed: int, substeps: int) -> Callable[[], float]:
    """Returns the work of a worker process: a number of steps, timed in CPU seconds.

    Vehicles follow random routes with SUMO's own defaults (Krauss, LC2013); every junction has traffic lights, and
    there are no pedestrians.

    Args:
        lanes: approximate number of lanes of the grid, including those inside its junctions.
        length: total length of the lanes [m].
        vehicles: number of vehicles.
        seed: seed of grid and routes.
        substeps: number of steps of the work.

    Raises:
        ImportError: the extra `sumo` is not installed.
    """
    import libsumo

    with tempfile.TemporaryDirectory() as folder:
        grid = Path(folder) / "grid.net.xml"
        _write_grid(grid, lanes, length)
        options = ["--step-length", str(STEP_SECONDS), "--seed", str(seed), "--no-step-log", "true"]
        libsumo.start(["sumo", "-n", str(grid), *options, "--no-warnings", "true", "--time-to-teleport", "-1"])
    _add_vehicles(libsumo, vehicles, Random(seed))
    _run(libsumo, WARM_UP_STEPS)
    return partial(cpu_seconds, partial(_run, libsumo, substeps))


def _write_grid(path: Path, lanes: int, length: float) -> None:
    """Writes a grid of single-lane streets in both directions, with traffic lights."""
    import sumo

    size = min(_SIZES, key=lambda n: abs(_lanes_of(n) - lanes))
    edges = 4 * size * (size - 1)
    command = [
        str(Path(sumo.SUMO_HOME) / "bin" / "netgenerate"),
        "--grid",
        f"--grid.number={size}",
        f"--grid.length={max(length / edges, 40.0):.0f}",
        "--default-junction-type=traffic_light",
        "--no-turnarounds=true",
        f"--output-file={path}",
    ]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)


def _lanes_of(size: int) -> int:
    """Returns the number of lanes of a grid of `size` x `size` junctions: those of the streets, and those inside.

    A left turn across oncoming traffic has two lanes: before and after the waiting position.
    """
    inside, edge, corners = (size - 2) ** 2, 4 * (size - 2), 4
    return 4 * size * (size - 1) + 16 * inside + 7 * edge + 2 * corners


def _add_vehicles(libsumo: ModuleType, vehicles: int, rng: Random) -> None:
    """Adds vehicles with random routes from random edges."""
    following: dict[str, set[str]] = {}
    for lane in libsumo.lane.getIDList():
        if not lane.startswith(":"):
            targets = {libsumo.lane.getEdgeID(link[0]) for link in libsumo.lane.getLinks(lane)}
            following.setdefault(libsumo.lane.getEdgeID(lane), set()).update(targets)
    successors = {edge: sorted(targets) for edge, targets in following.items()}
    for number in range(vehicles):
        route = [rng.choice(sorted(successors))]
        while len(route) < ROUTE_EDGES:
            route.append(rng.choice(successors[route[-1]]))
        libsumo.route.add(f"route {number}", route)
        libsumo.vehicle.add(f"vehicle {number}", f"route {number}", departPos="random_free")


def _run(libsumo: ModuleType, substeps: int) -> None:
    for _ in range(substeps):
        libsumo.simulationStep()
