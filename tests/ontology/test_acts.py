import pickle

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dorothie_gym.ontology import (
    LABELS,
    ActionValue,
    DialogueAct,
    DialogueMove,
    GoalStatus,
    LandmarkName,
    OntologyError,
    Slot,
    SlotValue,
    StreetName,
    decode_slots,
    parse_act,
)

acts = st.builds(DialogueAct, st.sampled_from(DialogueMove), st.frozensets(st.sampled_from(LABELS)))


def test_values_of_a_slot_come_by_id() -> None:
    act = DialogueAct.of(DialogueMove.INSTRUCT, LandmarkName.KFC, LandmarkName.COCO, StreetName.FULLER)
    assert act.values(Slot.LANDMARK) == (LandmarkName.COCO, LandmarkName.KFC)
    assert act.values(Slot.OBJECT) == ()


def test_text_lists_slots_in_vector_order() -> None:
    act = DialogueAct.of(DialogueMove.INSTRUCT, LandmarkName.IKEA, GoalStatus.ABANDONED, ActionValue.U_TURN)
    assert str(act) == "Instruct(Action=UTurn, Status=Abandoned, Landmark=Ikea)"
    assert str(DialogueAct(DialogueMove.ACKNOWLEDGE)) == "Acknowledge()"


@given(acts)
def test_labels_are_read_back(act: DialogueAct) -> None:
    assert parse_act(act.move.label, act.slot_labels()) == act


@given(acts)
def test_vector_holds_the_values(act: DialogueAct) -> None:
    assert decode_slots(act.vector) == act.slots


@given(acts)
def test_act_survives_pickling(act: DialogueAct) -> None:
    again = pickle.loads(pickle.dumps(act))
    assert again == act and hash(again) == hash(act)


@given(acts)
def test_values_of_all_slots_together_are_the_slots(act: DialogueAct) -> None:
    values: list[SlotValue] = [value for slot in Slot for value in act.values(slot)]
    assert frozenset(values) == act.slots and len(values) == len(act.slots)


def test_a_move_given_as_number_is_refused() -> None:
    with pytest.raises(OntologyError, match="DialogueAct.move"):
        DialogueAct(1)  # type: ignore[arg-type]


def test_slots_that_are_no_frozenset_are_refused() -> None:
    with pytest.raises(OntologyError, match="DialogueAct.of"):
        DialogueAct(DialogueMove.EXPLAIN, [LandmarkName.KFC])  # type: ignore[arg-type]


def test_a_stranger_among_the_slots_is_refused() -> None:
    with pytest.raises(OntologyError, match="'KFC'"):
        DialogueAct.of(DialogueMove.EXPLAIN, "KFC")  # type: ignore[arg-type]
