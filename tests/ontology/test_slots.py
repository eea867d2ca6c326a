import copy
import pickle

import pytest

from dorothie_gym.ontology import LABELS, SLOT_VALUES, ActionValue, GoalStatus, LandmarkName, Slot, SlotValue


def test_slot_ids_are_those_of_sdn() -> None:
    assert [slot.label for slot in Slot] == ["Null", "Action", "Street", "Landmark", "Status", "Object"]
    assert [int(slot) for slot in Slot] == [0, 1, 2, 3, 4, 5]


@pytest.mark.parametrize("slot", Slot, ids=lambda slot: slot.label)
def test_values_are_numbered_from_zero_and_know_their_slot(slot: Slot) -> None:
    assert [value.value for value in SLOT_VALUES[slot]] == list(range(len(SLOT_VALUES[slot])))
    assert all(value.slot is slot for value in SLOT_VALUES[slot])


def test_numbers_of_values_per_slot() -> None:
    assert [len(SLOT_VALUES[slot]) for slot in Slot] == [0, 10, 17, 12, 6, 24]


def test_values_of_different_slots_are_never_equal() -> None:
    assert ActionValue.UNKNOWN != GoalStatus.UNKNOWN  # type: ignore[comparison-overlap]  # the comparison of two vocabularies is the test
    assert len(set(LABELS)) == 69


def test_all_values_hash_differently_and_by_number() -> None:
    assert len({hash(value) for value in LABELS}) == 69
    assert hash(LandmarkName.KFC) == 32 * 3 + 4


@pytest.mark.parametrize("value", [ActionValue.J_TURN, LandmarkName.KFC])
def test_value_is_identical_after_pickle_and_copy(value: SlotValue) -> None:
    assert pickle.loads(pickle.dumps(value)) is value
    assert copy.deepcopy(value) is value
