"""The path of the ego against formulas of NumPy, and against the map's own measurements."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from dorothie_gym.maps import Town
from dorothie_gym.maps.model import Array
from dorothie_gym.ontology import PhysicalAction
from dorothie_gym.sim.ego.ego_controller import LocalPlanner
from dorothie_gym.sim.ego.limits import HALF_LENGTH, LATERAL_ACCELERATION, PROFILE_BRAKING, U_TURN_SPEED
from dorothie_gym.sim.ego.path import Path
from dorothie_gym.sim.state.world_arrays import WorldArrays
from dorothie_gym.sim.world import World
from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.support import portable_math as pm
from tests.sim.driving import network, on_lane

TOWNS = ["brookside", "Town01"]


def planners(name: str) -> Iterator[LocalPlanner]:
    """Yields planners with turns, lane switches and U-turns from all lanes of a town."""
    roads = network(name)
    for lane in roads.town.lanes:
        planner = on_lane(roads, lane.id, 0.3 * lane.length).ego.planner
        for action, angle in (
            (PhysicalAction.LANE_SWITCH, 90),
            (PhysicalAction.U_TURN, 0),
            (PhysicalAction.J_TURN, -90),
        ):
            planner.command(action, angle, 5.0)
            yield planner


@pytest.mark.parametrize("name", TOWNS)
def test_headings_of_a_path_are_those_of_its_steps(name: str) -> None:
    for path in (planner.path for planner in planners(name)):
        steps = np.diff(path.points, axis=0).tolist()
        directions = np.unwrap([pm.atan2(dy, dx) for dx, dy in steps])
        middles = (path.s[:-1] + path.s[1:]) / 2
        assert path.headings[1:-1].tolist() == np.interp(path.s, middles, directions)[1:-1].tolist()
        for end, inner in ((0, 1), (-1, -2)):
            rate = (directions[inner] - directions[end]) / (middles[inner] - middles[end])
            assert path.headings[end] == pytest.approx(directions[end] + rate * (path.s[end] - middles[end]), abs=1e-9)


def limits_along(path: Path, town: Town) -> Array:
    """Returns the speed limit at each point of a path (n,) [m/s]: in a manoeuvre the lower one of its two lanes."""
    assert not path.manoeuvre[0]
    limits = np.array([town.lanes[lane].speed_limit for lane in path.lanes])
    entered = limits.copy()  # limit of the lane before the manoeuvre
    for k in np.flatnonzero(path.manoeuvre):
        entered[k] = entered[k - 1] if path.manoeuvre[k - 1] and path.lanes[k - 1] == path.lanes[k] else limits[k - 1]
    return np.minimum(limits, entered)


@pytest.mark.parametrize("name", TOWNS)
def test_speeds_of_a_path_follow_its_curves_limits_and_end(name: str) -> None:
    for planner in planners(name):
        path = planner.path
        curvatures = np.abs(np.gradient(path.headings, path.s))
        bends = np.convolve(np.pad(curvatures, 1, mode="edge"), np.full(3, 1 / 3), mode="valid")
        squared = np.minimum(
            limits_along(path, network(name).town) ** 2, LATERAL_ACCELERATION / np.maximum(bends, 1e-4)
        )
        squared = np.where(path.manoeuvre & (bends > 0.1), np.minimum(squared, U_TURN_SPEED**2), squared)
        if planner.waits_at_end:
            squared[path.s >= path.length - HALF_LENGTH - 0.8] = 0.0
        # each point allows v^2 + 2 a d at a distance d before it
        before = path.s[None, :] - path.s[:, None]
        allowed = np.where(before >= 0.0, squared[None, :] + 2.0 * PROFILE_BRAKING * before, np.inf).min(axis=1)
        np.testing.assert_allclose(path.speeds**2, np.maximum(allowed, 0.0), rtol=0.0, atol=1e-6)


@pytest.mark.parametrize("name", TOWNS)
def test_points_of_a_path_lie_on_its_lanes_and_their_distances_add_up(name: str) -> None:
    town, kinds = network(name).town, set()
    for planner in planners(name):
        path = planner.path
        kinds.add(planner.manoeuvre[0])
        np.testing.assert_array_equal(path.s[1:], np.cumsum(pn.hypot(*np.diff(path.points, axis=0).T)))
        for k in np.flatnonzero(~path.manoeuvre)[::7]:
            lane = town.lanes[path.lanes[k]]
            assert path.points[k].tolist() == lane.position(path.stations[k]).tolist()
    assert {PhysicalAction.U_TURN, PhysicalAction.J_TURN} <= kinds


def test_path_stays_the_same_object_until_it_is_replaced() -> None:
    roads = network("brookside")
    world = on_lane(roads, 3, 5.0)
    path = world.planner.path
    points = path.points.copy()
    world.step(15)
    assert world.planner.path is path
    assert world.planner.command(PhysicalAction.U_TURN, 0, 0.0) is None
    assert world.planner.path is not path
    assert isinstance(world.planner.path, Path)
    np.testing.assert_array_equal(path.points, points)


def cramped(world: World) -> None:
    """Leaves no room for paths in the arrays of a world, as if the town had lanes of many kilometres."""
    arrays: WorldArrays = world.actors.arrays
    used = int(arrays.plan[0].points)
    world.actors.arrays = arrays._replace(course=arrays.course[:used].copy(), steps=arrays.steps[:1].copy())


@pytest.mark.parametrize("name", ["brookside", "Town05"])
def test_room_for_the_path_grows_as_it_is_needed(name: str) -> None:
    roads = network(name)
    lane = next(lane for lane in roads.town.lanes if len(roads.town.exits(lane.id)) > 1 and lane.length > 60.0)
    one, other = (on_lane(roads, lane.id, 5.0) for _ in range(2))
    rng = np.random.default_rng(3)
    for _ in range(60):
        cramped(other)
        exits, _ = one.planner.exits()
        action, angle = PhysicalAction.J_TURN, exits[int(rng.integers(len(exits)))].angle if exits else 0
        if rng.random() < 0.3:
            action = PhysicalAction(int(rng.integers(1, 4)))
        answers = {world.ego.apply(action, angle=angle) for world in (one, other)}
        assert len(answers) == 1
        for world in (one, other):
            world.step(15)
        assert one.planner.path.points.tolist() == other.planner.path.points.tolist()
        assert (one.planner.s, one.planner.lane) == (other.planner.s, other.planner.lane)
        assert one.car.position.tolist() == other.car.position.tolist()
