import pytest

from dorothie_gym.ontology import OntologyError
from dorothie_gym.ontology.vocabulary import Vocabulary, normalise


def test_case_space_and_punctuation_do_not_count() -> None:
    assert normalise(" Seven_Eleven ") == normalise("SevenEleven") == normalise("seven-eleven")


def test_one_spelling_for_two_members_is_refused() -> None:
    with pytest.raises(OntologyError, match="belongs to 1 and to 2"):
        Vocabulary("number", [("one", 1), ("ONE", 2)])


def test_a_spelling_of_punctuation_only_is_refused() -> None:
    with pytest.raises(OntologyError, match="no letter"):
        Vocabulary("number", [("--", 1)])


def test_spellings_are_shown_as_written() -> None:
    assert dict(Vocabulary("number", [("One", 1), ("un", 1)]).spellings) == {"One": 1, "un": 1}
