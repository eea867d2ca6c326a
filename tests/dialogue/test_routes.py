import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dorothie_gym.dialogue import (
    Anaphor,
    ConditionRelation,
    Direction,
    DrivingPlan,
    PlaceReference,
    PlanStep,
    StepAction,
    StepChange,
    StepCondition,
)
from dorothie_gym.errors import DorothieGymError
from dorothie_gym.ontology import LandmarkName, ObjectClass, StreetName

SIDES = st.sampled_from([Direction.LEFT, Direction.RIGHT])
PLACED = (StepAction.VISIT, StepAction.FOLLOW, StepAction.AVOID)


@st.composite
def places(draw: st.DrawFn) -> PlaceReference:
    fields = {
        "landmark": st.sampled_from(LandmarkName),
        "street": st.sampled_from(StreetName),
        "object": st.sampled_from(ObjectClass),
        "ordinal": st.integers(1, 9),
        "side": SIDES,
        "reference": st.sampled_from(Anaphor),
    }
    chosen = draw(st.sets(st.sampled_from(sorted(fields)), min_size=1))
    return PlaceReference(**{name: draw(fields[name]) for name in chosen})


@st.composite
def steps(draw: st.DrawFn) -> PlanStep:
    action = draw(st.sampled_from(StepAction))
    fields = {
        "ordinal": st.integers(1, 9),
        "distance": st.integers(1, 5000),
        "condition": st.builds(StepCondition, relation=st.sampled_from(ConditionRelation), place=places()),
        "side": SIDES,
        "speed": st.integers(5, 130),
    }
    if action in (StepAction.TURN, StepAction.LANE, StepAction.U_TURN):
        fields["direction"] = SIDES
    if action is not StepAction.LIGHTS:
        fields["change"] = st.sampled_from([StepChange.FASTER, StepChange.SLOWER])
    values = {name: draw(fields[name]) for name in draw(st.sets(st.sampled_from(sorted(fields))))}
    if action is StepAction.LIGHTS:
        values["change"] = draw(st.sampled_from([StepChange.ON, StepChange.OFF]))
    if action in PLACED:
        values["place"] = draw(places())
    return PlanStep(action=action, **values)


@given(st.lists(steps(), max_size=4))
def test_plans_survive_json_and_have_words(listed):
    plan = DrivingPlan(tuple(listed))
    assert DrivingPlan.from_json(json.loads(json.dumps(plan.to_json()))) == plan
    assert hash(DrivingPlan.from_json(plan.to_json())) == hash(plan)
    assert plan.describe().count(", then ") == max(len(listed) - 1, 0)
    assert all(step.describe().strip() for step in plan)


def test_a_plan_is_described_as_commands_in_order():
    at_kfc = StepCondition(relation=ConditionRelation.AT, place=PlaceReference(landmark=LandmarkName.KFC))
    lights = PlaceReference(object=ObjectClass.TRAFFIC_LIGHT, ordinal=2)
    plan = DrivingPlan.of(
        PlanStep(action=StepAction.TURN, direction=Direction.LEFT, condition=at_kfc),
        PlanStep(action=StepAction.TURN, direction=Direction.RIGHT, ordinal=2),
        PlanStep(action=StepAction.FOLLOW, place=PlaceReference(street=StreetName.HUBBARD), distance=200),
        PlanStep(
            action=StepAction.STOP,
            condition=StepCondition(relation=ConditionRelation.PAST, place=lights),
            side=Direction.RIGHT,
        ),
    )
    assert plan.describe() == (
        "turn left at the KFC, then take the second right, then follow Hubbard for 200 m, "
        "then stop just past the second traffic light on the right-hand side"
    )
    assert [place for step in plan for place in step.places] == [
        at_kfc.place,
        PlaceReference(street=StreetName.HUBBARD),
        lights,
    ]


@pytest.mark.parametrize(
    ("data", "named"),
    [
        ({}, "plan is {}; it must be an array"),
        ([{"direction": "left"}], "plan[0]: the field 'action' is missing"),
        ([{"action": "trun"}], "plan[0].action: there is no StepAction 'trun'; did you mean 'turn'?"),
        ([{"action": "turn", "direction": "straight"}], "plan[0].direction"),
        ([{"action": "turn", "ordinal": 0}], "plan[0].ordinal is 0; it must be a whole number of 1 to 9"),
        ([{"action": "turn", "ordinal": True}], "plan[0].ordinal is True"),
        ([{"action": "speed", "speed": 30.5}], "plan[0].speed is 30.5"),
        ([{"action": "stop", "conditon": {}}], "did you mean 'condition'?"),
        (
            [{"action": "stop", "condition": {"relation": "at", "place": {}}}],
            "condition.place: PlaceReference: no field",
        ),
        ([{"action": "stop", "condition": {"relation": "at"}}], "plan[0].condition: the field 'place' is missing"),
        ([{"action": "visit"}], "a step visit needs one"),
        ([{"action": "turn", "place": {"landmark": "KFC"}}], "put it into the condition"),
        ([{"action": "stop", "direction": "left"}], "PlanStep.direction: a step stop has none"),
        ([{"action": "lights"}], "a step lights cannot be None"),
        ([{"action": "visit", "place": {"landmark": "kfc"}}], "there is no LandmarkName 'kfc'; did you mean 'KFC'?"),
        ([{"action": "stop"}] * 25, "has 25 steps; at most 24"),
        ([3], "plan[0] is 3; it must be an object"),
    ],
)
def test_a_malformed_plan_is_refused_with_its_field_and_a_remedy(data, named):
    with pytest.raises(DorothieGymError) as raised:
        DrivingPlan.from_json(data)
    assert named in str(raised.value)
