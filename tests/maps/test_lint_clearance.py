"""Lanes across kerbs and overlapping lanes; faults are made as in `test_lint`."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from dorothie_gym.maps.lint import FaultKind, check_town
from dorothie_gym.maps.model import Sidewalk
from tests.maps.damaged_towns import (
    RIGHT,
    STRAIGHT,
    a_connector,
    a_street,
    brookside,
    bulge,
    eight,
    near,
    only,
    pushed,
    rebuilt,
    ring,
    with_lane,
)

from .yaml_plans import TIGHT_RAMPS, compiled, star


class TestKerbs:
    def test_a_turn_that_cuts_the_corner(self) -> None:
        turn = brookside().lanes[a_connector(RIGHT).target]
        (fault,) = only(check_town(with_lane(brookside(), pushed(turn, bulge(2.0)))), FaultKind.KERB)
        assert fault.lanes == (turn.id,) and "corner" in fault.message
        assert near(fault, turn.position(0.5 * turn.length), within=3.5)

    def test_another_turns_corner_is_a_kerb_too(self) -> None:
        way = a_connector(STRAIGHT)
        turn = brookside().lanes[way.target]
        (fault,) = only(check_town(with_lane(brookside(), pushed(turn, bulge(6.0)))), FaultKind.KERB)
        assert fault.lanes == (turn.id,) and "corner" in fault.message

    def test_a_way_off_the_ground_of_a_junction_with_three_arms(self) -> None:
        town = brookside()
        junction = next(j for j in town.junctions if len(j.connectors) == 6)
        middle = np.mean([town.lanes[k].position(0.5 * town.lanes[k].length) for k in junction.connectors], axis=0)
        straight = next(
            town.lanes[link.target]
            for link in town.links
            if link.target in junction.connectors
            and link.type is STRAIGHT
            and town.lanes[link.target].project(middle)[1] < 0
        )
        # The arm that goes off is on the side of the middle, so the other side of this lane is a kerb.
        (fault,) = only(check_town(with_lane(town, pushed(straight, bulge(3.0)))), FaultKind.KERB)
        assert fault.lanes == (straight.id,) and "ground" in fault.message

    @pytest.mark.parametrize(
        "text",
        [
            star({0: "lanes: 3, median: 8", 45: "", 90: "", 180: ""}),
            star({0: "lanes: 3", 90: "lanes: 2, median: 4", 180: "", 270: "", 315: "lanes: 2, median: 4"}),
            star({45: "", 90: "lanes: 3", 135: "", 225: "", 315: "lanes: 2"}),
            TIGHT_RAMPS,
        ],
        ids=["mouth far behind its neighbours", "mouth far before its neighbour", "both", "ramps"],
    )
    def test_mouths_of_one_junction_may_lie_at_very_different_distances(self, tmp_path: Path, text: str) -> None:
        assert check_town(compiled(tmp_path, text)) == ()

    def test_a_turn_that_cuts_the_corner_of_a_junction_with_five_arms(self, tmp_path: Path) -> None:
        town = compiled(tmp_path, star({0: "lanes: 2, median: 4", 72: "", 144: "lanes: 2", 216: "", 288: "lanes: 2"}))
        junction = max(town.junctions, key=lambda junction: len(junction.connectors))
        ways = [town.lanes[k] for k in junction.connectors]
        turns = [way for way in ways if math.radians(100.0) < way.headings[-1] - way.headings[0] < math.radians(115.0)]
        assert len(turns) == 5
        for turn in turns:
            (fault,) = only(check_town(with_lane(town, pushed(turn, bulge(2.0)))), FaultKind.KERB)
            assert fault.lanes == (turn.id,) and "corner" in fault.message

    @pytest.mark.parametrize(("offset", "faulty"), [(1.75 + 1.0, False), (1.5, True)])
    def test_a_lane_that_runs_over_a_pavement(self, offset: float, faulty: bool) -> None:
        street = a_street()
        beside = pushed(street, lambda s, length: np.full(len(s), offset))
        path = Sidewalk(id=0, points=beside.points, width=2.0)
        faults = check_town(rebuilt(brookside(), sidewalks=[path]))
        if faulty:
            assert street.id in {lanes for fault in only(faults, FaultKind.KERB) for lanes in fault.lanes}
        else:
            assert faults == ()

    def test_a_pavement_on_a_bridge_is_no_fault(self) -> None:
        street = a_street()
        path = Sidewalk(id=0, points=street.points + np.array([0.0, 0.0, 6.0]), width=2.0)
        assert check_town(rebuilt(brookside(), sidewalks=[path])) == ()


class TestSpace:
    def test_lanes_in_the_same_place(self) -> None:
        town = ring()
        moved = with_lane(town, pushed(town.lanes[1], bulge(-0.9)))  # the outer lane is on the left of the inner one
        (fault,) = only(check_town(moved), FaultKind.OVERLAP)
        assert fault.lanes == (0, 1) and "0.9 m" in fault.message

    def test_a_crossing_without_a_junction(self) -> None:
        (fault,) = only(check_town(eight(0.0)), FaultKind.OVERLAP)
        assert fault.lanes == (0, 2) and near(fault, np.zeros(2), within=4.0)

    def test_a_connector_that_runs_over_a_lane_of_another_street(self) -> None:
        (fault,) = only(check_town(eight(0.0, crossing=0)), FaultKind.OVERLAP)
        assert "a car on lane 0 runs" in fault.message and "into lane 2" in fault.message

    @pytest.mark.parametrize("crossing", [None, 0])
    @pytest.mark.parametrize(("height", "faulty"), [(2.0, True), (3.8, True), (4.2, False)])
    def test_a_bridge_too_low_to_pass_under(self, height: float, faulty: bool, crossing: int | None) -> None:
        faults = check_town(eight(height, crossing=crossing))
        if faulty:
            (fault,) = only(faults, FaultKind.CLEARANCE)
            assert fault.lanes == (0, 2) and near(fault, np.zeros(2), within=6.0)
        else:
            assert faults == ()
