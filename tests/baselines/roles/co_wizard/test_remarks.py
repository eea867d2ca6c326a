import pytest

from dorothie_gym.baselines.roles.co_wizard.remarks import check_form, form_of
from dorothie_gym.baselines.roles.learned_role.remark_forms import filled, sources_of, topic_of
from dorothie_gym.dialogue import CommunicativeFunction as Function
from dorothie_gym.dialogue import Direction, Predicate, Proposition, Wording
from dorothie_gym.ontology import ActionValue, DialogueMove, LandmarkName, ObjectClass, StreetName
from dorothie_gym.policies import act_builders
from dorothie_gym.policies.speech import intend

RED = Proposition.of(
    Predicate.BECAUSE,
    effect=Proposition.of(Predicate.STANDS, action=ActionValue.STOP),
    cause=Proposition.of(Predicate.RED, object=ObjectClass.TRAFFIC_LIGHT),
)
LEFT = act_builders.action(ActionValue.J_TURN, direction=Direction.LEFT, street=StreetName.BEAL)


@pytest.mark.parametrize(
    ("remark", "available"),
    [
        (intend(Function.POSITIVE_FEEDBACK, act_builders.destination(LandmarkName.KFC)), {"goal": LandmarkName.KFC}),
        (intend(Function.ANSWER, RED, elided=("effect",), wording=Wording(topic="because")), {}),
        (intend(Function.INFORM, LEFT, wording=Wording(direction=Direction.LEFT)), {"to_left": StreetName.BEAL}),
        (intend(Function.SET_QUESTION, act_builders.destination(LandmarkName.QUERIED)), {}),
        (
            intend(Function.ANSWER, Proposition.of(Predicate.ARRIVES_IN, place=LandmarkName.COCO, seconds=42)),
            {"goal": LandmarkName.COCO, "seconds": 42},
        ),
    ],
)
def test_remark_survives_being_taken_apart_and_filled_in_again(remark, available):
    form = form_of(remark, available)
    check_form(form)
    again = filled(form, available)
    assert (again.act, again.meaning, again.wording.topic) == (remark.act, remark.meaning, remark.wording.topic)


def test_names_are_taken_from_where_they_are_now():
    form = form_of(intend(Function.ACCEPT, act_builders.destination(LandmarkName.KFC)), {"goal": LandmarkName.KFC})
    assert LandmarkName.KFC.name not in form
    again = filled(form, {"goal": LandmarkName.IKEA})
    assert again.act.slots == {LandmarkName.IKEA}
    assert again.meaning == (act_builders.destination(LandmarkName.IKEA),)


def test_remark_without_a_source_cannot_be_said():
    remark = intend(Function.ACCEPT, act_builders.destination(LandmarkName.KFC))
    assert form_of(remark, {"goal": LandmarkName.IKEA}) is None
    form = form_of(remark, {"place0": LandmarkName.KFC})
    assert sources_of(form) == {"place0"}
    assert filled(form, {"goal": LandmarkName.KFC}) is None


def test_topic_is_the_predicate_or_else_the_move():
    assert topic_of(intend(Function.INFORM, LEFT)) == "will"
    assert topic_of(intend(Function.NEGATIVE_FEEDBACK)) == DialogueMove.CONFUSE.label
