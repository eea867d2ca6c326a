"""Speed of the closest-lane lookup: the grid index against highway-env's scan, on the same points."""

import json
import statistics
import time
from collections.abc import Callable
from typing import Annotated

import numpy as np
import typer
from highway_env.road.road import RoadNetwork
from rich.console import Console
from rich.table import Table

from dorothie_gym.maps import load_town
from dorothie_gym.sim.network.network import TownNetwork

REPEATS = 5


def main(
    town: Annotated[str, typer.Argument(help="name or file of a town")] = "brookside",
    points: Annotated[int, typer.Option(help="number of lookups per run")] = 300,
    as_json: Annotated[bool, typer.Option("--json")] = False,
) -> None:
    """Times both on random places near the roads and prints medians of five runs."""
    network = TownNetwork(load_town(town))
    rng = np.random.default_rng(0)
    lanes = network.town.lanes
    places = []
    for lane in (lanes[int(k)] for k in rng.integers(len(lanes), size=points)):
        station = float(rng.uniform(0.0, lane.length))
        places.append((lane.position(station, float(rng.normal(0.0, 2.0))), lane.heading_at(station)))

    def index() -> list[object]:
        return [network.get_closest_lane_index(position, heading) for position, heading in places]

    def scan() -> list[object]:
        return [RoadNetwork.get_closest_lane_index(network, position, heading) for position, heading in places]

    assert index() == scan(), "the index and the scan disagree"
    fast, slow = seconds(index) / points, seconds(scan) / points
    result = {
        "town": network.town.name,
        "lanes": len(lanes),
        "index_microseconds": round(fast * 1e6, 2),
        "scan_microseconds": round(slow * 1e6, 2),
        "ratio": round(slow / fast, 1),
    }
    if as_json:
        print(json.dumps(result))
        return
    table = Table("town", "lanes", "index [us]", "highway-env's scan [us]", "ratio")
    table.add_row(*(str(value) for value in result.values()))
    Console().print(table)


def seconds(work: Callable[[], object]) -> float:
    """Returns the median time of a function [s]."""
    times = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


if __name__ == "__main__":
    typer.run(main)
