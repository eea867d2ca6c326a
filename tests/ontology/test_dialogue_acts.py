import pickle

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dorothie_gym.errors import OntologyError
from dorothie_gym.ontology import (
    LABEL_INDEX,
    LABELS,
    SLOT_SPANS,
    ActionValue,
    DialogueAct,
    DialogueMove,
    DialogueUnit,
    GoalStatus,
    LandmarkName,
    Slot,
    SlotValue,
    StreetName,
    UnitEnd,
    decode_slots,
    encode_slots,
    in_label_order,
    parse_act,
)


def test_ids_run_from_0_to_14_in_sdn_order() -> None:
    spec = (
        "Irrelevant Instruct Explain Align Check QueryYN QueryW Acknowledge Confuse "
        "Clarify Confirm ReplyY ReplyN ReplyU ReplyW"
    )
    assert [(int(move), move.label) for move in DialogueMove] == list(enumerate(spec.split()))


def test_move_is_found_by_number_and_survives_pickling() -> None:
    assert DialogueMove(5) is DialogueMove.QUERY_YN
    assert pickle.loads(pickle.dumps(DialogueMove.REPLY_U)) is DialogueMove.REPLY_U


def test_spans_are_those_of_sdn_with_status_before_landmark() -> None:
    assert {slot: (span.start, span.stop) for slot, span in SLOT_SPANS.items()} == {
        Slot.ACTION: (0, 10),
        Slot.STREET: (10, 27),
        Slot.STATUS: (27, 33),
        Slot.LANDMARK: (33, 45),
        Slot.OBJECT: (45, 69),
    }


def test_spans_hold_the_values_of_their_slot() -> None:
    for slot, span in SLOT_SPANS.items():
        assert {value.slot for value in LABELS[span]} == {slot}


def test_index_is_the_inverse_of_labels() -> None:
    assert [LABEL_INDEX[value] for value in LABELS] == list(range(69))


@given(st.frozensets(st.sampled_from(LABELS)))
def test_decoding_undoes_encoding(values: frozenset[SlotValue]) -> None:
    vector = encode_slots(values)
    assert len(vector) == 69 and sum(vector) == len(values)
    assert decode_slots(vector) == values


@given(st.lists(st.integers(0, 1), min_size=69, max_size=69))
def test_encoding_undoes_decoding(vector: list[int]) -> None:
    assert list(encode_slots(decode_slots(vector))) == vector


@given(st.permutations(LABELS))
def test_label_order_is_independent_of_argument_order(values: list[SlotValue]) -> None:
    assert in_label_order(values) == LABELS


@given(st.lists(st.just(0), max_size=200).filter(lambda vector: len(vector) != 69))
def test_vector_of_wrong_length_raises_error(vector: list[int]) -> None:
    with pytest.raises(OntologyError, match=f"has {len(vector)} entries, expected 69"):
        decode_slots(vector)


def test_error_names_index_and_label_of_invalid_entry() -> None:
    vector = [0] * 69
    vector[37] = 2
    with pytest.raises(OntologyError, match=r"37 \(Landmark=KFC\) is 2"):
        decode_slots(vector)


def test_encoding_other_objects_raises_error() -> None:
    with pytest.raises(OntologyError, match="EXPLAIN"):
        encode_slots([LandmarkName.KFC, DialogueMove.EXPLAIN])  # type: ignore[list-item]  # a wrong type on purpose


acts = st.builds(DialogueAct, st.sampled_from(DialogueMove), st.frozensets(st.sampled_from(LABELS)))


def test_values_of_slot_are_ordered_by_id() -> None:
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


def test_move_given_as_number_raises_error() -> None:
    with pytest.raises(OntologyError, match=r"DialogueAct.move"):
        DialogueAct(1)  # type: ignore[arg-type]  # a wrong type on purpose


def test_slots_other_than_frozenset_raise_error() -> None:
    with pytest.raises(OntologyError, match=r"DialogueAct.of"):
        DialogueAct(DialogueMove.EXPLAIN, [LandmarkName.KFC])  # type: ignore[arg-type]  # a wrong type on purpose


def test_slot_of_other_type_raises_error() -> None:
    with pytest.raises(OntologyError, match="'KFC'"):
        DialogueAct.of(DialogueMove.EXPLAIN, "KFC")  # type: ignore[arg-type]  # a wrong type on purpose


def test_only_transactions_can_be_interrupted() -> None:
    assert [unit for unit in DialogueUnit if UnitEnd.INTERRUPTED in unit.ends] == [DialogueUnit.TRANSACTION]


def test_both_units_can_be_abandoned() -> None:
    assert all(UnitEnd.ABANDONED in unit.ends for unit in DialogueUnit)
