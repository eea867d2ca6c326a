import pytest
from hypothesis import given
from hypothesis import strategies as st

from dorothie_gym.dialogue.numerals import cardinal, ordinal, read_cardinals, read_ordinal


@given(st.integers(0, 999))
def test_cardinals_are_read_back(number):
    assert read_cardinals(cardinal(number).replace("-", " ").split()) == [number]


@given(st.integers(1, 9))
def test_ordinals_are_read_back(number):
    assert read_ordinal(ordinal(number)) == number


def test_digits_and_several_numbers_are_read():
    assert read_cardinals(["30", "or", "forty", "five", "or", "2"]) == [30, 45, 2]
    assert read_ordinal("2nd") == 2
    assert read_ordinal("next") == 1
    assert read_ordinal("left") is None


@pytest.mark.parametrize("number", [0, 10])
def test_ordinals_end_at_nine(number):
    with pytest.raises(ValueError, match="1 to 9"):
        ordinal(number)
