import pickle

import pytest

from dorothie_gym.errors import OntologyError
from dorothie_gym.ontology.labelled_enums import Vocabulary, complete, normalise, unknown_spelling
from dorothie_gym.ontology.roles import Role


def test_look_up_ignores_case_space_and_punctuation() -> None:
    assert normalise(" Seven_Eleven ") == normalise("SevenEleven") == normalise("seven-eleven")


def test_one_spelling_for_two_members_raises_error() -> None:
    with pytest.raises(OntologyError, match="belongs to 1 and to 2"):
        Vocabulary("number", [("one", 1), ("ONE", 2)])


def test_spelling_of_punctuation_only_raises_error() -> None:
    with pytest.raises(OntologyError, match="neither letters"):
        Vocabulary("number", [("--", 1)])


def test_spellings_are_shown_as_written() -> None:
    assert dict(Vocabulary("number", [("One", 1), ("un", 1)]).spellings) == {"One": 1, "un": 1}


def test_error_names_text_vocabulary_and_nearest_spelling() -> None:
    message = str(unknown_spelling("instrukt", "dialogue move", ["Explain", "Instruct"]))
    assert "'instrukt'" in message and "dialogue move" in message and "'Instruct'" in message


def test_error_shows_spelling_even_if_none_is_similar() -> None:
    assert "'Explain'" in str(unknown_spelling("%%%", "dialogue move", ["Explain"]))


def test_error_for_non_text_names_the_type() -> None:
    assert "int" in str(unknown_spelling(3, "dialogue move", ["Explain"]))


def test_error_is_a_value_error_and_survives_pickling() -> None:
    error = pickle.loads(pickle.dumps(OntologyError("message")))
    assert isinstance(error, ValueError) and str(error) == "message"


def test_long_text_is_truncated_in_comparison_and_error() -> None:
    for text in ("a" * 100_000, ["a"] * 100_000):
        assert len(str(unknown_spelling(text, "slots", ["Action", "Street"]))) < 250


def test_table_without_a_member_names_table_file_and_member() -> None:
    known = {role: str(role) for role in Role if role is not Role.AD_WIZARD}
    with pytest.raises(OntologyError, match=r"^SEATS of dorothie_gym/lab/seats\.py has no entry for Role\.AD_WIZARD;"):
        complete(known, Role, "SEATS", "dorothie_gym.lab.seats")


def test_complete_table_keeps_its_order_and_cannot_be_written() -> None:
    table = complete({role: str(role) for role in reversed(Role)}, Role, "SEATS", "dorothie_gym.lab.seats")
    assert list(table) == list(reversed(Role))
    with pytest.raises(TypeError):
        table[Role.AGENT] = ""  # type: ignore[index]
