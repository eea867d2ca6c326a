"""The compiled watch finds what loops over all lanes and lines in plain Python find."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from dorothie_gym.maps import Town
from dorothie_gym.maps.model import Array, SignalKind
from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.sim.traffic.parameters import MAX_SUBSTEPS
from dorothie_gym.sim.traffic_rules import WorldEvent, WorldEventKind
from tests.sim.crossings import crossing, way_in
from tests.sim.driving import network
from tests.sim.state.plain_rules import LENGTH, PlainWatch, lawless_way
from tests.sim.state.trajectory_watch import TrajectoryWatch


def compare(roads: TownNetwork, poses: Array, decision: int, frame: int = 0) -> Counter[WorldEventKind]:
    """Breaches of a way that both watches agree on, cut into decisions."""
    compiled, plain = TrajectoryWatch(roads), PlainWatch(roads)
    count: Counter[WorldEventKind] = Counter()
    for k in range(0, len(poses) - 1, decision):
        stretch = poses[k : k + decision + 1]
        found, expected = compiled.look(stretch, frame + k), plain.look(stretch, frame + k)
        assert [without_station(event) for event in found] == [without_station(event) for event in expected]
        assert [event.data["station"] for event in found] == pytest.approx(
            [event.data["station"] for event in expected], abs=0.0101
        )
        count.update(event.kind for event in found)
    assert +Counter(compiled.infractions) == count
    return count


def without_station(event: WorldEvent) -> WorldEvent:
    return replace(event, data={**event.data, "station": None})


@pytest.mark.parametrize("name", ["brookside", "northgate", "Town02", "Town05"])
def test_breaches_equal_those_of_exhaustive_loops(name: str) -> None:
    roads, count = network(name), Counter[WorldEventKind]()
    for seed in range(3):
        rng = np.random.default_rng(seed)
        count += compare(
            roads, lawless_way(roads, rng, 450), int(rng.integers(1, MAX_SUBSTEPS + 1)), int(rng.integers(3000))
        )
    assert count[WorldEventKind.OFF_ROAD] > 0
    assert count[WorldEventKind.WRONG_WAY] > 0


@pytest.mark.slow
@pytest.mark.parametrize("name", ["brookside", "midtown", "northgate", "Town02", "Town05"])
def test_breaches_equal_those_of_exhaustive_loops_on_many_drives(name: str) -> None:
    roads, count = network(name), Counter[WorldEventKind]()
    for seed in range(100, 160):
        rng = np.random.default_rng(seed)
        count += compare(
            roads, lawless_way(roads, rng, 450), int(rng.integers(1, MAX_SUBSTEPS + 1)), int(rng.integers(3000))
        )
    lines = {signal.kind for signal in PlainWatch(roads).signals.values()}
    assert count[WorldEventKind.OFF_ROAD] > 10
    assert count[WorldEventKind.WRONG_WAY] > 10
    assert count[WorldEventKind.RED_LIGHT] > 0 or SignalKind.TRAFFIC_LIGHT not in lines


def passages(rng: np.random.Generator, count: int) -> Array:
    """Ways north over the line of the crossing at 12 m; on each the car stands once, somewhere before it or beside."""
    ways = []
    for _ in range(count):
        stands, beside = 12.0 + LENGTH / 2 + float(rng.uniform(-1.0, 5.0)), float(rng.normal(0.0, 1.2))
        y = np.concatenate((np.arange(30.0, stands, -0.3), np.full(5, stands), np.arange(stands, 4.0, -0.3)))
        poses = np.zeros((len(y), 6))
        poses[:, 0], poses[:, 1], poses[:, 2] = 2.0 + beside, y, -np.pi / 2
        poses[:, 3] = np.where(y == stands, 0.0, 9.0)
        ways.append(poses)
    return np.concatenate(ways)


def test_stands_at_stop_signs_equal_those_of_exhaustive_loops() -> None:
    roads, count = TownNetwork(crossing({"s": SignalKind.STOP})), Counter[WorldEventKind]()
    for seed in range(8):
        count += compare(roads, passages(np.random.default_rng(seed), 10), 1 + 2 * seed)
    assert 20 < count[WorldEventKind.STOP_SIGN] < 60


def test_lanes_too_wide_for_the_cells_are_searched_one_by_one() -> None:
    town = crossing()
    wide = replace(town.lanes[way_in("s")], widths=np.full_like(town.lanes[way_in("s")].widths, 15.0))
    lanes = [wide if lane.id == wide.id else lane for lane in town.lanes]
    roads = TownNetwork(Town(name="wide", lanes=lanes, links=town.links, junctions=town.junctions))
    poses = np.zeros((20, 6))
    poses[:, 0], poses[:, 1], poses[:, 2] = 2.0 + np.linspace(6.5, 8.3, 20), 60.0, -np.pi / 2
    assert compare(roads, poses, 5) == {WorldEventKind.OFF_ROAD: 1}
    assert compare(roads, poses[:10], 5) == {}
