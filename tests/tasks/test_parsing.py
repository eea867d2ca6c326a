import json
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dorothie_gym.errors import StoryboardError
from dorothie_gym.tasks import bind, load_template, parse_template, template_names
from dorothie_gym.tasks.parsing import read_json

from .builders import grid_places, parse, plain, templates

VALUES = st.recursive(
    st.none() | st.booleans() | st.integers(-99, 99) | st.text(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(), inner, max_size=4),
)


def test_trailing_commas_are_accepted():
    assert read_json('{"a": [1, 2,], "b": {"c": 3 ,\n},\n}', "t") == {"a": [1, 2], "b": {"c": 3}}


def test_raw_line_breaks_in_strings_are_kept():
    assert read_json('{"a": "one\n two"}', "t") == {"a": "one\n two"}


def test_commas_inside_strings_are_kept():
    assert read_json(r'{"a": "x,]", "b": "\",}"}', "t") == {"a": "x,]", "b": '",}'}


@given(VALUES)
def test_strict_json_is_parsed_unchanged(value):
    assert read_json(json.dumps(value), "t") == value
    assert read_json(json.dumps(value, indent=1, ensure_ascii=False), "t") == value


@pytest.mark.parametrize("text", ["[,]", "{,}", "[1,,]", '{"a":,}', "", "{", '{"a": "'])
def test_malformed_json_raises_error(text):
    with pytest.raises(StoryboardError, match="column"):
        read_json(text, "t")


def test_json_error_contains_line_and_column_of_the_file():
    with pytest.raises(StoryboardError, match=r"storyboard picnic: line 3, column 8: not JSON"):
        read_json('{\n "a": [1,],\n "b" : : 2\n}', "picnic")


def test_duplicate_field_raises_error():
    with pytest.raises(StoryboardError, match="story.: is given twice"):
        read_json('{"story": "a", "story": "b"}', "t")


def test_deep_nesting_raises_error():
    with pytest.raises(StoryboardError, match="nested too deeply"):
        read_json("[" * 200_000, "t")


PAPER = Path(__file__).parents[2] / "../shared/paper/dorothie.tex"
VERBATIM = re.compile(r"\\begin\{verbatim\}(.*?)\\end\{verbatim\}", re.DOTALL)


def printed_template() -> str:
    """Returns the template printed in the paper, joined from its two parts."""
    if not PAPER.exists():
        pytest.skip("the paper's text is not beside the repository")
    text = PAPER.read_text(encoding="utf-8")
    start = text.index(r"\paragraph{Task Configuration}")
    main, hidden = VERBATIM.findall(text, start)[:2]
    return main.rstrip().removesuffix("}") + hidden.strip().removeprefix("{")


@pytest.mark.parametrize("seed", range(20))
def test_template_printed_in_paper_loads_and_binds(seed):
    template = parse_template(printed_template(), "paper")
    assert len(template.subgoals) == 3 and len(template.dependents) == 3
    storyboard = bind(template, grid_places(24), np.random.default_rng(seed))
    places = [storyboard.landmarks[subgoal.landmark] for subgoal in storyboard.subgoals]
    assert {place.name.label for place in places[:2]} == {"Ikea", "SevenEleven"}
    assert places[2].name.label == "House" and places[2].hidden
    assert sum(landmark.hidden for landmark in storyboard.landmarks) == 1
    assert "$" not in storyboard.story and "\n" not in storyboard.story


def test_package_has_at_least_thirty_templates():
    assert len(template_names()) >= 30


def test_package_templates_have_two_to_six_live_subgoals():
    numbers = {sum(not subgoal.trigger for subgoal in load_template(name).subgoals) for name in template_names()}
    assert numbers == {2, 3, 4, 5, 6}


@pytest.mark.parametrize("name", template_names())
def test_every_subgoal_of_the_package_has_a_reason_and_a_message_for_each_exception(name):
    for subgoal in load_template(name).subgoals:
        assert subgoal.reason, subgoal
        exceptions = (subgoal.trigger, subgoal.delete, subgoal.change)
        messages = (subgoal.messages.trigger, subgoal.messages.delete, subgoal.messages.change)
        assert list(map(bool, exceptions)) == list(map(bool, messages)), subgoal


@pytest.mark.parametrize("name", template_names())
def test_every_template_of_the_package_starts_with_two_to_six_subgoals(name):
    template = load_template(name)
    assert template.name == name
    assert 2 <= sum(not subgoal.trigger for subgoal in template.subgoals) <= 6


def test_package_templates_use_every_feature():
    subgoals = [subgoal for name in template_names() for subgoal in load_template(name).subgoals]
    for feature in ("after", "trigger", "delete", "change", "change_destination", "delete_after_subgoal", "leaves"):
        assert len({getattr(subgoal, feature) for subgoal in subgoals}) > 1, feature
    assert sum(bool(load_template(name).hidden) for name in template_names()) >= 5


@given(templates())
@settings(max_examples=60, deadline=None)
def test_valid_templates_are_parsed(fields):
    template = parse(fields)
    assert [subgoal.destination for subgoal in template.subgoals] == [row["destination"] for row in fields["subgoals"]]
    assert set(template.hidden) == set(fields["hidden_from_wizard"])


def test_template_is_named_for_file_stem(tmp_path):
    path = tmp_path / "mine.json"
    path.write_text(json.dumps(plain({}, {})), encoding="utf-8-sig")
    assert load_template(path) == load_template(str(path))
    assert load_template(path).name == "mine"


def test_error_for_unknown_name_lists_known_names():
    with pytest.raises(StoryboardError, match=r"storyboard nonesuch: name: .*school_run"):
        load_template("nonesuch")


def test_error_names_missing_file(tmp_path):
    path = tmp_path / "none.json"
    with pytest.raises(StoryboardError, match=f"{re.escape(str(path))}: file: cannot be read .No such file"):
        load_template(path)


def test_folder_as_template_raises_error(tmp_path):
    with pytest.raises(StoryboardError, match="file: cannot be read"):
        load_template(tmp_path)


def test_file_of_other_encoding_raises_error(tmp_path):
    path = tmp_path / "bytes.json"
    path.write_bytes(b"{\xff}")
    with pytest.raises(StoryboardError, match=r"not UTF-8 text .byte 1"):
        load_template(path)


def test_error_in_file_names_path(tmp_path):
    path = tmp_path / "bad.json"
    path.write_text('{"story": 5}', encoding="utf-8")
    with pytest.raises(StoryboardError) as caught:
        load_template(path)
    assert caught.value.template == str(path)
    assert caught.value.field == "story"


def test_names_are_normalised_to_ontology_spelling():
    template = parse(plain({"destination": "Seven Eleven"}, {"destination": "burger king"}))
    assert [subgoal.destination for subgoal in template.subgoals] == ["SevenEleven", "BurgerKing"]


def test_both_hidden_fields_are_read_with_and_without_dollar_sign():
    fields = plain({}, {}, variables=[["A", "people"], ["B", "places.residential"]])
    template = parse(fields | {"hidden_from_wizard": ["$A"], "hidden_from_co_wizard": ["B", "A"]})
    assert template.hidden == ("A", "B")


def test_messages_are_read_and_filled_with_the_values_of_the_town():
    fields = plain(
        {
            "destination": "$P",
            "description": "Buy $I at $P",
            "reason": "$P is cheap",
            "delete": True,
            "messages": {"delete": {"from": "the boss of $P", "by": "radio call", "text": "$P is closed, so go home."}},
        },
        {},
        variables=[["P", "places.cafe"]],
        dependents=[["I", "P.menuitems"]],
    )
    subgoal = bind(parse(fields), grid_places(24), np.random.default_rng(0)).subgoals[0]
    assert subgoal.reason == "Coco is cheap"
    assert subgoal.messages.trigger is None and subgoal.messages.change is None
    assert str(subgoal.messages.delete) == "Radio call from the boss of Coco: Coco is closed, so go home."


def test_message_is_a_text_message_by_default():
    message = {"from": "Noor", "text": "The shop is closed, so come home."}
    template = parse(plain({"delete": True, "messages": {"delete": message}}, {}))
    assert str(template.subgoals[0].messages.delete).startswith("Text message from Noor: ")


def test_delete_after_subgoal_permits_deletion():
    template = parse(plain({}, {"delete_after_subgoal": 0}, {}))
    assert template.subgoals[1].delete and template.subgoals[1].delete_after_subgoal == 0


def test_delete_after_as_flag_removes_landmark():
    subgoal = parse(plain({"delete_after_subgoal": True}, {})).subgoals[0]
    assert (subgoal.leaves, subgoal.delete, subgoal.delete_after_subgoal) == (True, False, None)


MALFORMED = {
    "top is a list": ([], "template: must be an object"),
    "no story": ({"subgoals": []}, "story: is missing or empty"),
    "story of blanks": (plain({}, {}, story=" \n"), "story: is missing or empty"),
    "story is a number": (plain({}, {}, story=3), r"story: must be a text, not a number \(3\)"),
    "unknown field": (plain({}, {}, hiden=[]), "hiden: unknown field; the fields are story"),
    "subgoals is an object": (plain(subgoals={}), "subgoals: must be a list, not an object"),
    "subgoal is a text": (plain(subgoals=["KFC"]), r"subgoals\[0\]: must be an object"),
    "unknown subgoal field": (plain({}, {"afer": []}), r"subgoals\[1\]\.afer: unknown field"),
    "no destination": (plain({}, {"destination": None}), r"subgoals\[1\]\.destination: must be a text, not null"),
    "empty destination": (plain({}, {"destination": ""}), r"subgoals\[1\]\.destination: is missing"),
    "destination is nothing": (plain({}, {"destination": "Moon"}), r"subgoals\[1\]\.destination: 'Moon' is neither"),
    "unknown type": (plain({}, {"type": "fly"}), r"subgoals\[1\]\.type: 'fly' is no type"),
    "after is a number": (plain({}, {"after": 0}), r"subgoals\[1\]\.after: must be a list, not a number"),
    "after holds a text": (plain({}, {"after": ["0"]}), r"subgoals\[1\]\.after: must be a list of subgoal numbers"),
    "after holds a flag": (plain({}, {"after": [True]}), r"subgoals\[1\]\.after: must be a list of subgoal numbers"),
    "trigger is a text": (plain({"trigger": "yes"}, {}), r"subgoals\[0\]\.trigger: must be true or false, not a text"),
    "change without text": (plain({"change_destination": "Coco"}, {}), r"subgoals\[0\]\.change: is missing beside"),
    "change to nothing": (
        plain({"change": "x", "change_destination": "Moon"}, {}),
        r"subgoals\[0\]\.change_destination: 'Moon' is neither",
    ),
    "delete after a text": (plain({"delete_after_subgoal": "1"}, {}), r"subgoals\[0\]\.delete_after_subgoal: must be"),
    "reason is a number": (plain({"reason": 4}, {}), r"subgoals\[0\]\.reason: must be a text, not a number"),
    "reason with because": (plain({"reason": "because of me"}, {}), r"subgoals\[0\]\.reason: must be a clause"),
    "reason with a full stop": (plain({}, {"reason": "It rains."}), r"subgoals\[1\]\.reason: must be a clause"),
    "messages is a text": (plain({"messages": "Go"}, {}), r"subgoals\[0\]\.messages: must be an object in braces"),
    "unknown kind of message": (
        plain({"messages": {"add": {}}}, {}),
        r"subgoals\[0\]\.messages\.add: unknown field; the fields are trigger, delete, change",
    ),
    "message is a text": (
        plain({"messages": {"delete": "Go"}}, {}),
        r"subgoals\[0\]\.messages\.delete: must be an object in braces",
    ),
    "message without sender": (
        plain({"delete": True, "messages": {"delete": {"text": "Go home."}}}, {}),
        r"subgoals\[0\]\.messages\.delete\.from: is missing or empty",
    ),
    "message without text": (
        plain({"delete": True, "messages": {"delete": {"from": "Noor"}}}, {}),
        r"subgoals\[0\]\.messages\.delete\.text: is missing or empty",
    ),
    "sender with a colon": (
        plain({"delete": True, "messages": {"delete": {"from": "Noor: work", "text": "Go."}}}, {}),
        r"subgoals\[0\]\.messages\.delete\.from: 'Noor: work' contains a colon",
    ),
    "message by unknown means": (
        plain({"delete": True, "messages": {"delete": {"from": "Noor", "by": "pigeon", "text": "Go."}}}, {}),
        r"subgoals\[0\]\.messages\.delete\.by: 'pigeon' is no way of sending a message; use one of call, text message",
    ),
    "variable is a text": (plain({}, {}, variables=["P1"]), r"variables\[0\]: must be \[\"NAME\", \"category\"\]"),
    "variable is no name": (plain({}, {}, variables=[["1 P", "people"]]), r"variables\[0\]: '1 P' is no name"),
    "category is empty": (plain({}, {}, variables=[["P", " "]]), r"variables\[0\]: P has an empty category"),
    "dependent without attribute": (plain({}, {}, dependents=[["I", "P1"]]), r"dependents\.I: 'P1' must read"),
    "hidden holds a number": (plain({}, {}, hidden_from_wizard=[1]), "hidden_from_wizard: must be a list of variables"),
}


@pytest.mark.parametrize("case", MALFORMED)
def test_malformed_template_raises_error_with_field_and_reason(case):
    fields, message = MALFORMED[case]
    with pytest.raises(StoryboardError, match="^storyboard test: " + message):
        parse_template(json.dumps(fields), "test")
