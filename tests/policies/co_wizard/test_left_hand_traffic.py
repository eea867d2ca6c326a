"""Sides of the road in left-hand traffic: lanes to change to, and words for them."""

from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.maps import DrivingSide
from dorothie_gym.policies.co_wizard.intentions import Wish


def test_a_lane_change_without_a_side_leads_to_the_faster_lane() -> None:
    assert Wish.switch(None, DrivingSide.RIGHT) is Wish.SWITCH_LEFT
    assert Wish.switch(None, DrivingSide.LEFT) is Wish.SWITCH_RIGHT


def test_a_lane_change_goes_to_the_side_that_was_said() -> None:
    for side in DrivingSide:
        assert Wish.switch(Direction.LEFT, side) is Wish.SWITCH_LEFT
        assert Wish.switch(Direction.RIGHT, side) is Wish.SWITCH_RIGHT
