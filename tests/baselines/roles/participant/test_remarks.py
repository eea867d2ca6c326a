import json

import pytest

from dorothie_gym.baselines.roles.participant.remarks import (
    STOP_FORM,
    check_form,
    filled,
    form_of,
    is_no,
    is_yes,
    sources_of,
)
from dorothie_gym.dialogue import CommunicativeFunction as Function
from dorothie_gym.dialogue import Direction, Predicate, Proposition, Wording
from dorothie_gym.ontology import ActionValue, DialogueMove, LandmarkName, ObjectClass, StreetName
from dorothie_gym.policies import act_builders
from dorothie_gym.policies.participant.order_wording import order
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.speech import intend

LEFT = {"manoeuvre": ActionValue.J_TURN, "turn": Direction.LEFT, "onto": StreetName.BEAL}
ERRAND = Proposition.of(Predicate.PURPOSE, place=LandmarkName.KFC, purpose="buy a newspaper", person="my sister")


@pytest.mark.parametrize(
    ("remark", "available"),
    [
        (order(DialogueMove.INSTRUCT, ActionValue.J_TURN, Wording(direction=Direction.LEFT)), LEFT),
        (
            intend(Function.REQUEST, act_builders.destination(LandmarkName.KFC, StreetName.BEAL)),
            {"goal": LandmarkName.KFC, "goal_street": StreetName.BEAL},
        ),
        (
            intend(Function.INFORM, ERRAND, elided=("place",), wording=Wording(topic="purpose")),
            {"goal": LandmarkName.KFC, "@purpose": "buy a newspaper", "@person": "my sister"},
        ),
        (order(DialogueMove.INSTRUCT, ActionValue.LANE_FOLLOW, Wording(distance=21.5)), {"rest": 22.0}),
        (intend(Function.NEGATIVE_FEEDBACK), {}),
    ],
)
def test_remark_survives_being_taken_apart_and_filled_in_again(remark, available):
    form = form_of(remark, available)
    check_form(form)
    again = filled(form, available)
    assert (again.act, again.meaning, again.wording.topic) == (remark.act, remark.meaning, remark.wording.topic)


def test_turn_is_that_of_the_route_at_the_moment():
    form = form_of(order(DialogueMove.INSTRUCT, ActionValue.J_TURN, Wording(direction=Direction.LEFT)), LEFT)
    assert sources_of(form) == {"manoeuvre", "turn"}
    again = filled(form, {**LEFT, "turn": Direction.RIGHT})
    assert again.wording.direction is Direction.RIGHT
    assert again.meaning[0].get("direction") is Direction.RIGHT


def test_answer_takes_up_what_was_asked():
    yes = intend(Function.AFFIRMATIVE_ANSWER, Proposition.of(Predicate.SEES, object=ObjectClass.VEHICLES))
    form = form_of(yes, {"said_object": ObjectClass.VEHICLES, "turn": Direction.LEFT})
    assert sources_of(form) == {"said_object"}
    again = filled(form, {"said_object": ObjectClass.PEDESTRIAN})
    assert again.act.slots == {ObjectClass.PEDESTRIAN}


def test_texts_of_the_story_are_no_part_of_forms():
    remark = intend(Function.INFORM, ERRAND, elided=("place",))
    form = form_of(remark, {"goal": LandmarkName.KFC, "@purpose": "buy a newspaper", "@person": "my sister"})
    assert "newspaper" not in form and sources_of(form) == {"goal", "@purpose", "@person"}
    assert form_of(remark, {"goal": LandmarkName.KFC}) is None
    assert filled(form, {"goal": LandmarkName.KFC, "@person": "Anton"}) is None


def test_urgency_is_kept():
    stop = order(DialogueMove.INSTRUCT, ActionValue.STOP, urgent=True)
    assert filled(form_of(stop, {}), {}).urgent
    assert not filled(form_of(replace(stop, urgent=False), {}), {}).urgent


@pytest.mark.parametrize("form", ["[]", '{"move":"Instruct"}', json.dumps({"move": "Sing", "slots": []})])
def test_what_is_no_form_is_refused(form):
    with pytest.raises((ValueError, LookupError, TypeError)):
        check_form(form)


def test_form_of_the_stop_needs_nothing():
    check_form(STOP_FORM)
    assert sources_of(STOP_FORM) == frozenset()


@pytest.mark.parametrize(
    ("function", "says"),
    [
        (Function.AFFIRMATIVE_ANSWER, (True, False)),
        (Function.CONFIRM, (True, False)),
        (Function.NEGATIVE_ANSWER, (False, True)),
        (Function.INFORM, (False, False)),
    ],
)
def test_yes_and_no_are_told_by_the_move(function, says):
    form = form_of(intend(function, Proposition.of(Predicate.RIGHT_WAY)), {})
    assert (is_yes(form), is_no(form)) == says
    assert not is_yes(STOP_FORM) and not is_no("")
