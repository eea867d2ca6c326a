from dorothie_gym.ontology import DialogueUnit, UnitEnd


def test_only_a_transaction_can_be_interrupted() -> None:
    assert [unit for unit in DialogueUnit if UnitEnd.INTERRUPTED in unit.ends] == [DialogueUnit.TRANSACTION]


def test_both_units_can_be_abandoned() -> None:
    assert all(UnitEnd.ABANDONED in unit.ends for unit in DialogueUnit)
