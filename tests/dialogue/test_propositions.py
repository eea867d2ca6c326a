import enum
import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dorothie_gym.dialogue import ASKED, Predicate, Proposition, encode_meaning, find_meaning, read_meaning
from dorothie_gym.dialogue.propositions import PARAMETERS
from dorothie_gym.ontology import ActionValue, GoalStatus, LandmarkName, ObjectClass, StreetName


def values(kind: object, depth: int) -> st.SearchStrategy:
    if kind == "proposition":
        return propositions(depth + 1)
    if kind is bool:
        return st.booleans()
    if kind is int:
        return st.integers(-(10**6), 10**6)
    if kind is str:
        return st.text(max_size=20).filter(lambda text: text != "?")
    assert isinstance(kind, type) and issubclass(kind, enum.Enum)
    return st.sampled_from(list(kind)) | st.just(ASKED)


@st.composite
def propositions(draw: st.DrawFn, depth: int = 0) -> Proposition:
    predicate = draw(st.sampled_from(list(Predicate)))
    kinds = {name: kind for name, kind in PARAMETERS[predicate].items() if kind != "proposition" or depth < 2}
    chosen = draw(st.sets(st.sampled_from(sorted(kinds)))) if kinds else set()
    arguments = {name: draw(values(kinds[name], depth)) for name in chosen}
    return Proposition.of(predicate, negated=draw(st.booleans()), **arguments)


@given(st.lists(propositions(), max_size=3))
def test_propositions_survive_writing_and_reading(said):
    text = encode_meaning(said)
    assert find_meaning(text) == tuple(said)
    assert text.isascii() and "\n" not in text
    assert read_meaning(json.loads(text or "[]")) == tuple(said)


@pytest.mark.parametrize(
    "text", ["nonsense", "{}", "[1]", '[{"predicate":"flies"}]', "[" * 5000, '[{"predicate":"red","at":1}]']
)
def test_text_that_holds_no_propositions_has_no_meaning(text):
    assert find_meaning(text) is None


@pytest.mark.parametrize(
    ("data", "told"),
    [
        ({"predicate": "arrive_in"}, "did you mean 'arrives_in'"),
        ({"predicate": "sees", "object": "Pedestrain"}, "did you mean 'Pedestrian'"),
        ({"predicate": "sees", "colour": "red"}, "its arguments: object, place"),
        ({"predicate": "arrives_in", "seconds": True}, r"\[0\].seconds is True"),
        ({"predicate": "red", "negated": "no"}, "negated is 'no'"),
        ({"predicate": "because", "cause": {"predicate": "sees", "object": 4}}, r"cause.object"),
    ],
)
def test_malformed_propositions_are_refused_with_their_place(data, told):
    with pytest.raises(ValueError, match=told):
        read_meaning([data])


def test_arguments_give_the_slots_of_an_act():
    located = Proposition.of(Predicate.LOCATED, place=LandmarkName.KFC, street=StreetName.BEAL)
    assert located.slots() == {LandmarkName.KFC, StreetName.BEAL}
    assert located.without("place").slots() == {StreetName.BEAL}
    effect = Proposition.of(Predicate.STANDS, action=ActionValue.STOP)
    cause = Proposition.of(Predicate.RED, object=ObjectClass.TRAFFIC_LIGHT)
    assert Proposition.of(Predicate.BECAUSE, effect=effect, cause=cause).slots() == {
        ActionValue.STOP,
        ObjectClass.TRAFFIC_LIGHT,
    }


def test_open_questions_ask_for_the_slot_that_is_left_open():
    assert Proposition.of(Predicate.GOAL, place=ASKED).slots() == {LandmarkName.QUERIED}
    assert Proposition.of(Predicate.TASK, place=LandmarkName.KFC, status=ASKED).slots() == {
        LandmarkName.KFC,
        GoalStatus.QUERIED,
    }
    assert Proposition.of(Predicate.ARRIVES_IN, seconds=ASKED).slots() == frozenset()


def test_order_of_arguments_does_not_matter():
    first = Proposition.of(Predicate.LOCATED, place=LandmarkName.KFC, street=StreetName.BEAL)
    assert first == Proposition.of(Predicate.LOCATED, street=StreetName.BEAL, place=LandmarkName.KFC)
    assert first.opposite.opposite == first != first.opposite
