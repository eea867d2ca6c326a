"""How fast the traffic kernel steps a world: against highway-env's own road on the same network and vehicles."""

import json
import platform
import statistics
import time
from collections.abc import Callable
from typing import Annotated, Any

import numpy as np
import typer
from highway_env.road.lane import PolyLaneFixedWidth, StraightLane
from highway_env.road.road import Road, RoadNetwork
from highway_env.vehicle.behavior import IDMVehicle
from rich.console import Console
from rich.table import Table

from dorothie_gym.ontology import PropKind
from dorothie_gym.world.kernel import (
    Kind,
    TownArrays,
    WorldArrays,
    add_prop,
    empty_world,
    populate,
    step,
    town_arrays,
)
from dorothie_gym.world.network import TownNetwork
from dorothie_gym.world.town import Lane, load_town

DT = 1.0 / 30.0
REPEATS = 7
CALLS = 60
SUBSTEPS = 15
WARM_UP = 900
PROPS = 4
POINTS_APART = 2.0
STRAIGHT = 0.02


def main(
    town: Annotated[str, typer.Argument(help="name or file of a town")] = "northgate",
    vehicles: Annotated[int, typer.Option(help="vehicles, a tenth of them cyclists")] = 30,
    pedestrians: Annotated[int, typer.Option(help="people on foot")] = 20,
    stock_substeps: Annotated[int, typer.Option(help="substeps of highway-env's road")] = 6,
    seed: Annotated[int, typer.Option(help="of places and speeds")] = 0,
    as_json: Annotated[bool, typer.Option("--json")] = False,
) -> None:
    """Times both in turns, in CPU seconds, and prints the median and the best of seven runs."""
    network = TownNetwork(load_town(town))
    arrays = town_arrays(network)
    world = crowd(network, arrays, vehicles, pedestrians, seed)
    road = stock_road(network, world)
    step(arrays, world, WARM_UP, DT)
    kernel, stock = [], []
    for _ in range(REPEATS):
        kernel.append(cpu_seconds(lambda: run(arrays, world)) / (CALLS * SUBSTEPS))
    for _ in range(3):
        stock.append(cpu_seconds(lambda: run_stock(road, stock_substeps)) / stock_substeps)
    result: dict[str, Any] = {
        "town": network.town.name,
        "lanes": len(network.town.lanes),
        "vehicles": int((world.vehicles.kind != Kind.EMPTY).sum()),
        "pedestrians": pedestrians,
        "props": int(world.props.present.sum()),
        "substeps_per_second": round(1.0 / statistics.median(kernel)),
        "substeps_per_second_best": round(1.0 / min(kernel)),
        "stock_substeps_per_second": round(1.0 / statistics.median(stock), 2),
        "ratio": round(statistics.median(stock) / statistics.median(kernel)),
        "spread": round((max(kernel) - min(kernel)) / statistics.median(kernel), 3),
        "bytes_per_world": world.nbytes,
        "machine": platform.processor() or platform.machine(),
    }
    if as_json:
        print(json.dumps(result))
        return
    table = Table("figure", "value")
    for name, value in result.items():
        table.add_row(name, str(value))
    Console().print(table)


def crowd(network: TownNetwork, arrays: TownArrays, vehicles: int, pedestrians: int, seed: int) -> WorldArrays:
    """A world with everything on: cars and cyclists, people, lights and signs, and a few props beside the middle."""
    world = empty_world(arrays, vehicles=vehicles, pedestrians=pedestrians, seed=seed)
    populate(network, arrays, world, seed=seed, vehicles=vehicles, pedestrians=pedestrians)
    rng = np.random.default_rng(seed)
    wide = [k for k, lane in enumerate(arrays.lanes) if lane.junction < 0 and max(lane.left, lane.right) >= 0]
    for lane in rng.choice(wide, size=min(PROPS, len(wide)), replace=False) if wide else ():
        station = 0.5 * network.town.lanes[int(lane)].length
        place = network.town.lanes[int(lane)].position(station)
        if np.hypot(world.vehicles.x - place[0], world.vehicles.y - place[1]).min() > 20.0:
            add_prop(network, arrays, world, PropKind.TRAFFIC_CONE, int(lane), station)
    return world


def stock_road(network: TownNetwork, world: WorldArrays) -> Road:
    """highway-env's own network, lanes and IDM vehicles at the same places, and nothing else."""
    plain = RoadNetwork()
    for index, lane in network.lanes_dict().items():
        plain.add_lane(index[0], index[1], stock_lane(lane.town_lane))
    road = Road(network=plain, np_random=np.random.default_rng(0))
    for vehicle in world.vehicles[world.vehicles.kind != Kind.EMPTY]:
        place = np.array([float(vehicle.x), float(vehicle.y)])
        road.vehicles.append(
            IDMVehicle(road, place, heading=float(vehicle.heading), speed=5.0, target_speed=float(vehicle.desired))
        )
    return road


def stock_lane(lane: Lane) -> Any:
    """A straight lane, or one through points 2 m apart."""
    bend = float(np.ptp(lane.headings))
    if bend < STRAIGHT:
        return StraightLane(lane.points[0, :2], lane.points[-1, :2], speed_limit=lane.speed_limit)
    stations = np.linspace(0.0, lane.length, max(int(lane.length / POINTS_APART) + 1, 3))
    points = [tuple(lane.position(float(s))) for s in stations]
    return PolyLaneFixedWidth(points, speed_limit=lane.speed_limit)


def run(arrays: TownArrays, world: WorldArrays) -> None:
    for _ in range(CALLS):
        step(arrays, world, SUBSTEPS, DT)


def run_stock(road: Road, substeps: int) -> None:
    for _ in range(substeps):
        road.act()
        road.step(DT)


def cpu_seconds(work: Callable[[], object]) -> float:
    """CPU time of a piece of work: other programs on the machine do not count."""
    start = time.process_time()
    work()
    return time.process_time() - start


if __name__ == "__main__":
    typer.run(main)
