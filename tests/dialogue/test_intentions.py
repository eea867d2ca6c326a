import pytest

from dorothie_gym.dialogue import CommunicativeFunction, Intention, Predicate, Proposition
from dorothie_gym.dialogue.intentions import TREE_ANSWERS
from dorothie_gym.ontology import ActionValue, DialogueMove, LandmarkName, ObjectClass, path_to


def test_every_move_is_reached_by_a_function_and_every_function_reaches_a_move():
    assert set(TREE_ANSWERS) == set(CommunicativeFunction)
    assert {function.move for function in CommunicativeFunction} == set(DialogueMove)


@pytest.mark.parametrize("function", CommunicativeFunction)
def test_moves_follow_from_the_tree_of_the_annotators(function):
    assert tuple(answer.label for _, answer in path_to(function.move)) == TREE_ANSWERS[function]


def test_commands_are_instructions_however_they_are_worded():
    left = Proposition.of(Predicate.WILL, action=ActionValue.J_TURN)
    assert Intention(function=CommunicativeFunction.REQUEST, content=left).act.move is DialogueMove.INSTRUCT


def test_what_is_left_out_of_the_words_is_no_slot():
    stands = Proposition.of(Predicate.STANDS, action=ActionValue.STOP)
    red = Proposition.of(Predicate.RED, object=ObjectClass.TRAFFIC_LIGHT)
    because = Proposition.of(Predicate.BECAUSE, effect=stands, cause=red)
    full = Intention(function=CommunicativeFunction.ANSWER, content=because)
    short = Intention(function=CommunicativeFunction.ANSWER, content=because, elided=frozenset({"effect"}))
    assert full.slots == {ActionValue.STOP, ObjectClass.TRAFFIC_LIGHT} and short.slots == {ObjectClass.TRAFFIC_LIGHT}
    assert short.content == because


def test_receipt_has_no_content():
    act = Intention(function=CommunicativeFunction.POSITIVE_FEEDBACK).act
    assert act.move is DialogueMove.ACKNOWLEDGE and not act.slots
    taken = Proposition.of(Predicate.GOAL, place=LandmarkName.KFC)
    assert Intention(function=CommunicativeFunction.ACCEPT, content=taken).act.move is DialogueMove.CONFIRM
