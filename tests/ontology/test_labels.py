import pytest
from hypothesis import given
from hypothesis import strategies as st

from dorothie_gym.ontology import (
    LABEL_INDEX,
    LABELS,
    SLOT_SPANS,
    DialogueMove,
    LandmarkName,
    OntologyError,
    Slot,
    SlotValue,
    decode_slots,
    encode_slots,
    in_label_order,
)


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
def test_label_order_does_not_depend_on_the_order_given(values: list[SlotValue]) -> None:
    assert in_label_order(values) == LABELS


@given(st.lists(st.just(0), max_size=200).filter(lambda vector: len(vector) != 69))
def test_a_vector_of_another_length_is_refused(vector: list[int]) -> None:
    with pytest.raises(OntologyError, match=f"has {len(vector)} entries, expected 69"):
        decode_slots(vector)


def test_an_entry_that_is_no_bit_is_refused_by_place_and_name() -> None:
    vector = [0] * 69
    vector[37] = 2
    with pytest.raises(OntologyError, match=r"37 \(Landmark=KFC\) is 2"):
        decode_slots(vector)


def test_encoding_what_is_no_slot_value_is_refused() -> None:
    with pytest.raises(OntologyError, match="EXPLAIN"):
        encode_slots([LandmarkName.KFC, DialogueMove.EXPLAIN])  # type: ignore[list-item]
