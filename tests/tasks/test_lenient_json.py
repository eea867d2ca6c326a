import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dorothie_gym.tasks import StoryboardError
from dorothie_gym.tasks.lenient_json import read_json

VALUES = st.recursive(
    st.none() | st.booleans() | st.integers(-99, 99) | st.text(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(), inner, max_size=4),
)


def test_trailing_commas_are_accepted():
    assert read_json('{"a": [1, 2,], "b": {"c": 3 ,\n},\n}', "t") == {"a": [1, 2], "b": {"c": 3}}


def test_raw_line_breaks_in_strings_are_kept():
    assert read_json('{"a": "one\n two"}', "t") == {"a": "one\n two"}


def test_commas_inside_strings_are_left_alone():
    assert read_json(r'{"a": "x,]", "b": "\",}"}', "t") == {"a": "x,]", "b": '",}'}


@given(VALUES)
def test_json_proper_reads_as_ever(value):
    assert read_json(json.dumps(value), "t") == value
    assert read_json(json.dumps(value, indent=1, ensure_ascii=False), "t") == value


@pytest.mark.parametrize("text", ["[,]", "{,}", "[1,,]", '{"a":,}', "", "{", '{"a": "'])
def test_what_is_no_json_even_so_is_refused(text):
    with pytest.raises(StoryboardError, match="line 1, column"):
        read_json(text, "t")


def test_the_error_tells_line_and_column_of_the_file():
    with pytest.raises(StoryboardError, match=r"storyboard picnic: line 3, column 8: not JSON"):
        read_json('{\n "a": [1,],\n "b" : : 2\n}', "picnic")


def test_a_field_given_twice_is_refused():
    with pytest.raises(StoryboardError, match="story: this field is given twice"):
        read_json('{"story": "a", "story": "b"}', "t")


def test_endless_nesting_is_refused():
    with pytest.raises(StoryboardError, match="nested too deeply"):
        read_json("[" * 200_000, "t")
