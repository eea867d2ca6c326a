"""SUMO on a grid of streets about as large as a town, as a reference (extra `sumo`)."""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from random import Random
from typing import Any

from dorothie_gym.bench.timing import cpu_seconds

STEP = 0.033
"""Length of a step: SUMO counts in whole milliseconds [s]."""

WARM_UP = 900
"""Steps before anything is measured."""

ROUTE = 400
"""Edges that each vehicle drives along; more than it can in any measurement."""

_SIZES = range(3, 30)


def prepare(lanes: int, length: float, vehicles: int, seed: int, substeps: int) -> Callable[[], float]:
    """Work for a process of its own: so many substeps, in seconds of CPU time.

    Vehicles follow random routes with SUMO's own defaults (Krauss, LC2013); every junction has lights, and nobody is on
    foot.

    Args:
        lanes: as many as the grid should have, those inside its junctions included.
        length: of all of them together [m].
        vehicles: how many drive.
        seed: of grid and routes.
        substeps: steps of 0.033 s in the work.

    Raises:
        ImportError: the extra `sumo` is not installed.
    """
    import libsumo

    with tempfile.TemporaryDirectory() as folder:
        grid = Path(folder) / "grid.net.xml"
        _grid(grid, lanes, length)
        command = ["sumo", "-n", str(grid), "--step-length", str(STEP), "--seed", str(seed), "--no-step-log", "true"]
        libsumo.start([*command, "--no-warnings", "true", "--time-to-teleport", "-1"])
    _fill(libsumo, vehicles, Random(seed))
    _run(libsumo, WARM_UP)
    return partial(cpu_seconds, partial(_run, libsumo, substeps))


def _grid(path: Path, lanes: int, length: float) -> None:
    """Writes a grid of single-lane streets both ways, with lights."""
    import sumo

    size = min(_SIZES, key=lambda n: abs(_lanes_of(n) - lanes))
    edges = 4 * size * (size - 1)
    command = [
        str(Path(sumo.SUMO_HOME) / "bin" / "netgenerate"), "--grid", f"--grid.number={size}",
        f"--grid.length={max(length / edges, 40.0):.0f}", "--default-junction-type=traffic_light",
        "--no-turnarounds=true", f"--output-file={path}",
    ]  # fmt: skip
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)


def _lanes_of(size: int) -> int:
    """Lanes of a grid of so many junctions each way: those of the streets, and those inside.

    A left turn across oncoming traffic has two lanes, before and behind where one waits.
    """
    inside, edge, corners = (size - 2) ** 2, 4 * (size - 2), 4
    return 4 * size * (size - 1) + 16 * inside + 7 * edge + 2 * corners


def _fill(libsumo: Any, vehicles: int, rng: Random) -> None:
    """Sends vehicles on random routes from random places."""
    following: dict[str, set[str]] = {}
    for lane in libsumo.lane.getIDList():
        if not lane.startswith(":"):
            targets = {libsumo.lane.getEdgeID(link[0]) for link in libsumo.lane.getLinks(lane)}
            following.setdefault(libsumo.lane.getEdgeID(lane), set()).update(targets)
    ways = {edge: sorted(targets) for edge, targets in following.items()}
    for number in range(vehicles):
        route = [rng.choice(sorted(ways))]
        while len(route) < ROUTE:
            route.append(rng.choice(ways[route[-1]]))
        libsumo.route.add(f"route {number}", route)
        libsumo.vehicle.add(f"vehicle {number}", f"route {number}", departPos="random_free")


def _run(libsumo: Any, substeps: int) -> None:
    for _ in range(substeps):
        libsumo.simulationStep()
