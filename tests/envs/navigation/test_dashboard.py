"""Dashboard of the pictures: what it shows can be read back from the pixels."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from dorothie_gym.envs.navigation.dashboard import (
    GOAL_COLOUR,
    HEIGHT,
    PANEL,
    WIDTH,
    Readings,
    draw_dashboard,
    icon_of,
    rows_of_dashboard,
    show_dashboard,
)
from dorothie_gym.maps import DrivingSide
from dorothie_gym.ontology import ActionValue
from dorothie_gym.policies.navigation.observation_fields import SECTORS
from tests.envs.dashboard_reader import distance_on, instruction_on, planned_on, speed_on, wanted_on

TURNS = [(ActionValue.J_TURN, sector) for sector in range(len(SECTORS))]
SWITCHES = [(ActionValue.LANE_SWITCH, 6), (ActionValue.LANE_SWITCH, 2)]
OTHERS = [(action, None) for action in (ActionValue.U_TURN, ActionValue.STOP, ActionValue.START)]
INSTRUCTIONS = [*TURNS, *SWITCHES, *OTHERS]


@pytest.mark.parametrize("instruction", INSTRUCTIONS)
def test_icon_tells_the_instruction_and_its_direction(instruction: tuple[ActionValue, int | None]) -> None:
    panel = draw_dashboard(Readings(action=instruction[0], sector=instruction[1], distance=20.0))
    assert instruction_on(panel) == instruction
    assert planned_on(panel) is None


def test_icons_are_told_apart_by_many_pixels() -> None:
    drawn = [draw_dashboard(Readings(action=action, sector=sector)) for action, sector in INSTRUCTIONS]
    for one, other in itertools.combinations(drawn, 2):
        assert (one != other).any(axis=-1).sum() >= 20


def test_planned_manoeuvre_stands_beside_the_instruction() -> None:
    panel = draw_dashboard(
        Readings(action=ActionValue.STOP, planned=ActionValue.J_TURN, planned_sector=6, distance=20.0)
    )
    assert (instruction_on(panel), planned_on(panel)) == ((ActionValue.STOP, None), (ActionValue.J_TURN, 6))


@pytest.mark.parametrize("distance", [0.4, 3.3, 27.9, 61.0, 100.0])
def test_gauges_tell_distances_before_and_behind_the_place(distance: float) -> None:
    tolerance = 0.1 if distance < 28.0 else 0.3
    before = draw_dashboard(Readings(action=ActionValue.STOP, distance=distance))
    behind = draw_dashboard(Readings(action=ActionValue.STOP, distance=-distance))
    assert distance_on(before) == pytest.approx(distance, abs=tolerance)
    assert distance_on(behind) == pytest.approx(-distance, abs=tolerance)


def test_gauges_tell_the_speed_and_the_one_that_is_asked_for() -> None:
    for speed, wanted in ((0.0, 11.1), (7.3, 5.0), (25.0, 25.0)):
        panel = draw_dashboard(Readings(speed=speed, wanted=wanted))
        assert speed_on(panel) == pytest.approx(speed, abs=0.1)
        assert wanted_on(panel) == pytest.approx(wanted, abs=0.1)


def test_needle_points_to_the_goal() -> None:
    places = {"ahead": (90.0, 0.0), "right": (0.0, 90.0), "behind": (-90.0, 0.0), "left": (0.0, -90.0)}
    found = {}
    for name, goal in places.items():
        icon = draw_dashboard(Readings(goal=goal))[1:12, 1:12]
        rows, columns = np.nonzero((icon == GOAL_COLOUR).all(axis=-1))
        found[name] = (np.sign(5 - rows.mean().round()), np.sign(columns.mean().round() - 5))
    assert found == {"ahead": (1, 0), "right": (0, 1), "behind": (-1, 0), "left": (0, -1)}


def test_steering_wheel_shows_its_side() -> None:
    left, right = (draw_dashboard(Readings(steering=steering)) for steering in (-0.5, 0.5))
    colour = (left != right).any(axis=-1).any(axis=0).nonzero()[0]
    middle = (colour.min() + colour.max()) / 2.0
    lit = (left[10] != PANEL).any(axis=-1).nonzero()[0].mean(), (right[10] != PANEL).any(axis=-1).nonzero()[0].mean()
    assert lit[0] < middle < lit[1]


@pytest.mark.parametrize(("height", "width"), [(84, 84), (8, 8), (60, 160), (320, 480), (168, 84)])
def test_dashboard_takes_a_seventh_of_a_picture_and_leaves_the_rest(height: int, width: int) -> None:
    picture = np.full((height, width, 3), 200, np.uint8)
    show_dashboard(picture, Readings(action=ActionValue.STOP, distance=50.0, speed=10.0))
    rows = rows_of_dashboard(height)
    assert rows == pytest.approx(height / 7, abs=1.0)
    assert (picture[: height - rows] == 200).all()
    assert (picture[height - rows :] != 200).any(axis=-1).all()


def test_dashboard_of_a_larger_picture_is_the_small_one_enlarged() -> None:
    picture = np.zeros((7 * 2 * HEIGHT, 2 * WIDTH, 3), np.uint8)
    readings = Readings(action=ActionValue.J_TURN, sector=3, distance=40.0, speed=9.0, wanted=11.0, limit=13.9)
    show_dashboard(picture, readings)
    np.testing.assert_array_equal(picture[-2 * HEIGHT :][::2, ::2], draw_dashboard(readings))


def test_a_u_turn_leads_away_from_the_side_of_the_traffic() -> None:
    panels = [draw_dashboard(Readings(action=ActionValue.U_TURN, traffic=side)) for side in DrivingSide]
    (right, left) = (icon_of(ActionValue.U_TURN, None, side) for side in DrivingSide)
    np.testing.assert_array_equal(left, right[:, ::-1])
    assert not np.array_equal(*panels)
