import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dorothie_gym.errors import OntologyError
from dorothie_gym.ontology import ADAPTIVE_ACTIONS, EPISTEMIC_ACTIONS, NAVIGATION_ACTIONS, MentalAction, PhysicalAction


def test_ids_and_labels_are_those_of_sdn() -> None:
    names = "LaneFollow LaneSwitch UTurn JTurn Stop Start SpeedChange LightChange"
    assert [(int(action), action.label) for action in PhysicalAction] == list(enumerate(names.split(), start=1))


def test_groups_partition_all_actions() -> None:
    assert [int(action) for action in NAVIGATION_ACTIONS] == [1, 2, 3, 4, 5, 6]
    assert ADAPTIVE_ACTIONS == (PhysicalAction.SPEED_CHANGE,)
    assert EPISTEMIC_ACTIONS == (PhysicalAction.LIGHT_CHANGE,)


@pytest.mark.parametrize("action", NAVIGATION_ACTIONS)
def test_nfd_class_is_id_minus_one_and_invertible(action: PhysicalAction) -> None:
    assert action.nfd_class == action - 1
    assert PhysicalAction.from_nfd_class(action.nfd_class) is action


@pytest.mark.parametrize("action", [*ADAPTIVE_ACTIONS, *EPISTEMIC_ACTIONS])
def test_other_actions_have_no_nfd_class(action: PhysicalAction) -> None:
    with pytest.raises(OntologyError, match=action.label):
        _ = action.nfd_class


@pytest.mark.parametrize("index", [-1, 6])
def test_nfd_class_out_of_range_raises_error(index: int) -> None:
    with pytest.raises(OntologyError, match=str(index)):
        PhysicalAction.from_nfd_class(index)


@pytest.mark.parametrize("action", PhysicalAction)
def test_slot_value_has_the_same_label(action: PhysicalAction) -> None:
    assert action.slot_value.label == action.label


@pytest.mark.parametrize(
    ("action", "argument"),
    [
        (PhysicalAction.LANE_FOLLOW, None),
        (PhysicalAction.LANE_SWITCH, 90),
        (PhysicalAction.LANE_SWITCH, -90.0),
        (PhysicalAction.SPEED_CHANGE, -5),
        (PhysicalAction.LIGHT_CHANGE, True),
        (PhysicalAction.LIGHT_CHANGE, 0),
        (PhysicalAction.J_TURN, -180.0),
    ],
)
def test_specified_arguments_are_accepted(action: PhysicalAction, argument: float | None) -> None:
    action.check_argument(argument)


@pytest.mark.parametrize(
    ("action", "argument"),
    [
        (PhysicalAction.U_TURN, -180.0),
        (PhysicalAction.STOP, 0),
        (PhysicalAction.LANE_SWITCH, 45),
        (PhysicalAction.LANE_SWITCH, None),
        (PhysicalAction.J_TURN, None),
        (PhysicalAction.J_TURN, 180.0),
        (PhysicalAction.J_TURN, math.nan),
        (PhysicalAction.SPEED_CHANGE, 10),
        (PhysicalAction.LIGHT_CHANGE, 2),
    ],
)
def test_other_arguments_raise_error_with_domain(action: PhysicalAction, argument: float | None) -> None:
    with pytest.raises(OntologyError) as error:
        action.check_argument(argument)
    assert action.label in str(error.value) and action.argument.domain in str(error.value)


@given(st.floats(-180, 180, exclude_max=True))
def test_turn_accepts_every_angle(angle: float) -> None:
    PhysicalAction.J_TURN.check_argument(angle)


def test_mental_actions_and_their_arguments() -> None:
    assert {action.label: (int(action), action.arguments) for action in MentalAction} == {
        "PlanUpdate": (1, ("junctions",)),
        "GoalUpdate": (2, ("landmarks",)),
        "StatusUpdate": (3, ("landmark", "status")),
        "KnowledgeUpdate": (4, ("x", "y")),
        "Other": (5, ()),
    }
