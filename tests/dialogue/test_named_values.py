import pytest

from dorothie_gym.dialogue import guess_act, guess_spans
from dorothie_gym.ontology import ActionValue, GoalStatus, LandmarkName, ObjectClass


def values(text: str) -> frozenset[object]:
    return frozenset(value for span in guess_spans(text) for value in span.act.slots)


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("mind the children on the road", True),
        ("there's somebody walking in front of us", True),
        ("wait for that lady", True),
        ("the kids are getting hungry", False),
        ("somebody in here needs a break", False),
        ("could you let the children out", False),
    ],
)
def test_people_in_the_car_are_no_pedestrians(text: str, named: bool) -> None:
    assert (ObjectClass.PEDESTRIAN in values(text)) is named


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("follow that van", True),
        ("there's heavy traffic ahead", True),
        ("keep your vehicle on the right", False),
        ("you are in the bus lane", False),
        ("I used to ride my bicycle here", False),
    ],
)
def test_own_vehicle_is_no_other_one(text: str, named: bool) -> None:
    assert (ObjectClass.VEHICLES in values(text)) is named


@pytest.mark.parametrize(
    "text",
    [
        "change lanes, the right one",
        "take the lane which is on the right",
        "move one lane over to the left",
        "the right lane, not the left",
        "my house is on the left",
        "pull up at the left-hand kerb",
        "stop on the right side please",
    ],
)
def test_sides_and_lanes_are_no_turns(text: str) -> None:
    assert ActionValue.J_TURN not in values(text)


@pytest.mark.parametrize(
    ("text", "status"),
    [
        ("only the KFC is left", GoalStatus.PENDING),
        ("there's still the Panera left to do", GoalStatus.PENDING),
        ("later on turn left", None),
        ("scratch that, take me to the Ikea", None),
        ("add the Coco, please", None),
        ("cross the Shell off the list, it's done", GoalStatus.COMPLETE),
        ("drop the Ikea, we'll go to the Coco", GoalStatus.ABANDONED),
    ],
)
def test_status_is_that_of_errands(text: str, status: GoalStatus | None) -> None:
    found = {value for value in values(text) if isinstance(value, GoalStatus)}
    assert found == (set() if status is None else {status})


@pytest.mark.parametrize(
    "text", ["pick my brother up at the Shell", "grab Monika from the Shell", "get the boys from the Shell first"]
)
def test_people_who_are_fetched(text: str) -> None:
    assert {LandmarkName.PERSON, LandmarkName.SHELL} <= guess_act(text).slots
