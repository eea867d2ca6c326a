"""Feasible actions for predicted actions and angles."""

from __future__ import annotations

from dataclasses import replace

import pytest

from dorothie_gym.baselines.benchmark_co_wizard.action_feasibility import FeasibleAction, feasible_action
from dorothie_gym.dialogue import Direction
from dorothie_gym.maps import load_town
from dorothie_gym.maps.model import LinkType
from dorothie_gym.ontology import NAVIGATION_ACTIONS, PhysicalAction
from dorothie_gym.policies.route_progress import Choice
from dorothie_gym.session.spaces import Physical
from dorothie_gym.sim.state.codes import Motion
from tests.baselines.benchmark_co_wizard.observed import town, view

TURN, SWITCH, ROUND = PhysicalAction.J_TURN, PhysicalAction.LANE_SWITCH, PhysicalAction.U_TURN
FOLLOW, STOP, START = PhysicalAction.LANE_FOLLOW, PhysicalAction.STOP, PhysicalAction.START


def crossing() -> Choice:
    """A junction with a way to the left, straight on and to the right."""
    for lane in town().lanes:
        exits = town().exits(lane.id)
        if {way.type for way in exits} == {LinkType.LEFT, LinkType.STRAIGHT, LinkType.RIGHT}:
            return Choice(lane=lane.id, distance=30.0, exits=exits)
    raise AssertionError("brookside has crossings")


@pytest.mark.parametrize(
    ("angle", "direction"),
    [(90.0, Direction.LEFT), (75.0, Direction.LEFT), (3.0, Direction.STRAIGHT), (-110.0, Direction.RIGHT)],
)
def test_a_turn_takes_the_exit_nearest_to_its_angle_left_positive(angle, direction):
    deed = feasible_action(TURN, angle, view(choice=crossing()), town())
    assert deed is not None and deed.physical is not None
    assert deed.direction is direction and deed.physical.action is TURN
    assert any(way.angle == deed.physical.angle for way in crossing().exits)


def test_planned_turn_is_not_repeated():
    way = crossing().exits[0]
    planned = {"choice": crossing(), "manoeuvre": TURN, "angle": float(way.angle)}
    assert feasible_action(TURN, way.angle, view(**planned), town()).physical is None
    stopped = feasible_action(TURN, way.angle, view(**planned, motion=Motion.STOPPED), town())
    assert stopped.physical == Physical(action=TURN, angle=way.angle)


def test_where_no_junction_is_ahead_there_is_no_turn():
    assert feasible_action(TURN, 90.0, view(choice=None), town()) is None


@pytest.mark.parametrize(("side", "angle"), [(LinkType.LANE_CHANGE_LEFT, 90), (LinkType.LANE_CHANGE_RIGHT, -90)])
def test_a_lane_switch_goes_to_the_side_of_its_angle_where_there_is_a_lane(side, angle):
    wide = load_town("midtown")
    lanes = [lane for lane in wide.lanes if lane.length > 40.0 and not lane.in_junction]
    there = next(lane for lane in lanes if wide.neighbour(lane.id, side) is not None)
    none = next(lane for lane in lanes if wide.neighbour(lane.id, side) is None)
    deed = feasible_action(SWITCH, float(angle), view(lane=there.id, station=5.0), wide)
    assert deed is not None and deed.physical == Physical(action=SWITCH, angle=angle)
    assert feasible_action(SWITCH, float(angle), view(lane=none.id, station=5.0), wide) is None
    assert feasible_action(SWITCH, float(angle), view(lane=there.id, station=there.length - 5.0), wide) is None


def test_the_car_follows_its_lane_by_itself_but_not_across_a_junction():
    assert feasible_action(FOLLOW, 0.0, view(motion=Motion.DRIVING, manoeuvre=None), town()) == FeasibleAction(
        physical=None
    )
    for changes in ({"motion": Motion.STOPPED, "choice": None}, {"motion": Motion.DRIVING, "manoeuvre": TURN}):
        assert feasible_action(FOLLOW, 0.0, view(**changes), town()).physical == Physical(action=FOLLOW)
    assert feasible_action(FOLLOW, 0.0, view(motion=Motion.WAITING), town()) is None


def test_car_standing_before_a_junction_needs_a_turn():
    near = replace(crossing(), distance=3.0)
    stands = view(motion=Motion.STOPPED, choice=near, manoeuvre=None, speed=0.0)
    assert feasible_action(START, 0.0, stands, town()) is feasible_action(FOLLOW, 0.0, stands, town()) is None
    assert feasible_action(TURN, 0.0, stands, town()).physical is not None
    planned = view(motion=Motion.STOPPED, choice=near, manoeuvre=TURN, speed=0.0)
    assert feasible_action(START, 0.0, planned, town()).physical == Physical(action=START)


def test_start_needs_a_stopped_car_and_stop_a_moving_one():
    stands, drives = view(motion=Motion.STOPPED, choice=None), view(motion=Motion.DRIVING)
    assert feasible_action(START, 0.0, stands, town()).physical == Physical(action=START)
    assert feasible_action(STOP, 0.0, drives, town()).physical == Physical(action=STOP)
    assert feasible_action(START, 0.0, drives, town()) is feasible_action(STOP, 0.0, stands, town()) is None


def test_the_car_turns_round_from_the_leftmost_lane_only():
    wide, left = load_town("midtown"), LinkType.LANE_CHANGE_LEFT
    inner = next(lane for lane in wide.lanes if wide.neighbour(lane.id, left) is not None and lane.length > 30.0)
    assert feasible_action(ROUND, 0.0, view(lane=inner.id, station=10.0, speed=0.0), wide) is None
    outer = inner.id
    while (beside := wide.neighbour(outer, left)) is not None:
        outer = beside
    deed = feasible_action(ROUND, 0.0, view(lane=outer, station=10.0, speed=0.0), wide)
    assert deed is not None and deed.physical == Physical(action=ROUND) and deed.direction is Direction.BACK


def test_something_can_always_be_done():
    for motion in Motion:
        for choice in (None, crossing()):
            now = view(motion=motion, choice=choice, manoeuvre=None)
            assert any(feasible_action(action, 0.0, now, town()) is not None for action in NAVIGATION_ACTIONS)
