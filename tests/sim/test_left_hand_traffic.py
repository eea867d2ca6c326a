"""Traffic on the left: what happens in the mirror image of a town is the mirror image of what happens in the town."""

import numpy as np
import pytest

from dorothie_gym.maps import LinkType, Town, load_town, mirrored
from dorothie_gym.ontology import PhysicalAction
from dorothie_gym.sim.config import WorldConfig
from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.sim.population import populate
from dorothie_gym.sim.state.codes import Kind
from dorothie_gym.sim.state.town_arrays import town_arrays
from dorothie_gym.sim.state.world_arrays import empty_world
from dorothie_gym.sim.world import World
from tests.sim.driving import on_lane

MIRROR = np.array([1.0, -1.0])


@pytest.fixture(scope="module")
def pair() -> tuple[Town, Town]:
    town = load_town("brookside")
    return town, mirrored(town)


def _places(rows: np.ndarray) -> np.ndarray:
    return np.column_stack((rows["x"], rows["y"])).astype(float)


@pytest.mark.parametrize("seed", [1, 2])
def test_traffic_cyclists_and_pedestrians_are_mirrored(pair: tuple[Town, Town], seed: int) -> None:
    config = WorldConfig(vehicles=14, pedestrians=20)
    departure = pair[0].sites[0].lane, pair[0].sites[0].station
    worlds = [World(town, config, seed=np.random.SeedSequence(seed), departure=departure) for town in pair]
    for _ in range(24):
        for world in worlds:
            world.step(15)
        one, other = (world.actors.arrays for world in worlds)
        np.testing.assert_allclose(_places(other.vehicles), _places(one.vehicles) * MIRROR, atol=0.05)
        np.testing.assert_allclose(_places(other.pedestrians), _places(one.pedestrians) * MIRROR, atol=0.05)


def test_cyclists_ride_at_the_kerb_on_the_left(pair: tuple[Town, Town]) -> None:
    network = TownNetwork(pair[1])
    arrays = town_arrays(network)
    world = empty_world(arrays, vehicles=6, pedestrians=0)
    populate(network, arrays, world, seed=1, vehicles=6, pedestrians=0, cyclists=1.0)
    cyclists = [row for row in world.vehicles if row.kind == Kind.CYCLIST]
    assert len(cyclists) == 6 and all(row.own_lateral < -0.5 for row in cyclists)
    assert all(pair[1].neighbour(int(row.lane), LinkType.LANE_CHANGE_LEFT) is None for row in cyclists)


def test_u_turns_go_to_the_right(pair: tuple[Town, Town]) -> None:
    roads = [TownNetwork(town) for town in pair]
    tried = 0
    for lane in pair[0].lanes:
        if lane.in_junction or lane.length < 40.0:
            continue
        worlds = [on_lane(network, lane.id, 15.0) for network in roads]
        answers = [world.ego.planner.command(PhysicalAction.U_TURN, 0, 0.0) for world in worlds]
        assert answers[0] == (answers[1] and answers[1].replace("rightmost", "leftmost"))
        if answers[0] is None:
            tried += 1
            paths = [_places(world.actors.arrays.course[: world.actors.arrays.plan[0].points]) for world in worlds]
            np.testing.assert_allclose(paths[1], paths[0] * MIRROR, atol=1e-6)
    assert tried > 5


def test_the_refusal_of_a_u_turn_names_the_innermost_lane() -> None:
    image = mirrored(load_town("midtown"))
    outer = next(
        lane
        for lane in image.lanes
        if not lane.in_junction and lane.length > 40.0 and image.neighbour(lane.id, image.traffic.to_middle) is not None
    )
    world = on_lane(TownNetwork(image), outer.id, 15.0)
    assert world.ego.planner.command(PhysicalAction.U_TURN, 0, 0.0) == "a U-turn begins on the rightmost lane"
