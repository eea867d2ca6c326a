from __future__ import annotations

import numpy as np
import pytest

from dorothie_gym.maps import Exit
from dorothie_gym.ontology import PhysicalAction, Role
from dorothie_gym.session.spaces import ExitColumn, SpaceLimits
from dorothie_gym.session.view_arrays import RoleArrays
from dorothie_gym.session.view_steps import SessionViews
from dorothie_gym.sim.world import World
from tests.sim.driving import network, world_at


def next_exits(world: World) -> tuple[tuple[Exit, ...], float]:
    """Finds the next junction with several exits by following the path lane by lane."""
    path, s = world.planner.path, world.planner.s
    here = path.index_at(s)
    for lane in path.lanes[here:].tolist():
        exits = world.town.exits(lane)
        if len(exits) > 1 and not world.town.lanes[lane].in_junction and any(way.junction_id >= 0 for way in exits):
            last = np.flatnonzero(path.lanes == lane)[-1]
            return exits, path.s[last] + (world.town.lanes[lane].length - path.stations[last]) - s
    return (), 0.0


@pytest.mark.parametrize("name", ["brookside", "northgate", "Town05"])
def test_options_and_lanes_ahead_are_those_of_the_path(name: str) -> None:
    town = network(name).town
    start = next(
        lane for lane in town.lanes if not lane.in_junction and lane.length > 60.0 and len(town.exits(lane.id)) > 1
    )
    world = world_at(name, start.id, 5.0)
    views, rng = SessionViews(world, RoleArrays(SpaceLimits(), observe_acts=True), 0), np.random.default_rng(4)
    observed = views.tables()
    counts = set()
    for _ in range(60):
        exits, distance = next_exits(world)
        assert world.planner.exits() == (exits, distance)
        counts.add(len(exits))
        views.observe((Role.CO_WIZARD, Role.AD_WIZARD))
        options, lanes = observed[Role.CO_WIZARD]["exits"], observed[Role.AD_WIZARD]["path_lanes"]
        waypoints = observed[Role.AD_WIZARD]["waypoints"]
        assert options[: len(exits), ExitColumn.LANE].tolist() == [way.lane for way in exits]
        assert options[: len(exits), ExitColumn.ANGLE].tolist() == [way.angle for way in exits]
        np.testing.assert_allclose(options[: len(exits), ExitColumn.DISTANCE], distance, rtol=0.0, atol=2.0)
        assert not options[len(exits) :].any()
        ahead = world.planner.lanes_ahead[:12]
        assert lanes[: len(ahead)].tolist() == [lane + 1 for lane in ahead]
        assert not lanes[len(ahead) :].any()
        path, s = world.planner.path, world.planner.s
        expected = [path.position_at(min(s + 5.0 * (k + 1), path.length)) for k in range(20)]
        np.testing.assert_allclose(waypoints, expected, rtol=0.0, atol=1e-9)
        if exits and world.planner.turn_ahead is None:
            angle = exits[int(rng.integers(len(exits)))].angle
            world.planner.command(PhysicalAction.J_TURN, angle, float(world.car.speed))
        world.step(30)
    assert len(counts - {0}) > 0
