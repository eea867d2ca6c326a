from __future__ import annotations

import math

import numpy as np
import pytest

from dorothie_gym.ontology import PhysicalAction
from dorothie_gym.sim.ego.path import Path
from tests.sim.driving import network, on_lane


def paths(name: str) -> list[Path]:
    """Returns paths with turns, lane switches and U-turns from all lanes of a town."""
    roads, found = network(name), []
    for lane in roads.town.lanes:
        planner = on_lane(roads, lane.id, 0.3 * lane.length).ego.planner
        for action, angle in (
            (PhysicalAction.LANE_SWITCH, 90), (PhysicalAction.U_TURN, 0), (PhysicalAction.J_TURN, -90),
        ):  # fmt: skip
            planner.command(action, angle, 5.0)
            found.append(planner.path)
    return found


@pytest.mark.parametrize("name", ["brookside", "Town01"])
def test_headings_of_a_path_are_those_of_the_c_library_on_every_processor(name: str) -> None:
    for path in paths(name):
        steps = np.diff(path.points, axis=0).tolist()
        directions = np.unwrap([math.atan2(dy, dx) for dx, dy in steps])  # NumPy's own arctan2 depends on the processor
        middles = (path.s[:-1] + path.s[1:]) / 2
        assert path.headings[1:-1].tolist() == np.interp(path.s, middles, directions)[1:-1].tolist()
        for end, inner in ((0, 1), (-1, -2)):
            rate = (directions[inner] - directions[end]) / (middles[inner] - middles[end])
            assert path.headings[end] == pytest.approx(directions[end] + rate * (path.s[end] - middles[end]), abs=1e-9)


@pytest.mark.parametrize("name", ["brookside", "Town01"])
def test_curvatures_of_a_path_are_gradients_of_its_headings(name: str) -> None:
    for path in paths(name):
        if len(set(np.diff(path.s).tolist())) > 1:  # NumPy has another formula for even spacing
            assert path.curvatures.tolist() == np.gradient(path.headings, path.s).tolist()
