import numpy as np
import pytest

from dorothie_gym.errors import StoryboardError
from dorothie_gym.maps import load_town
from dorothie_gym.session.spaces.fields import STORY_LENGTH, plain_text
from dorothie_gym.tasks import bind, is_shipped_story, load_template, template_names

from .builders import parse, plain

STORE = ["P", "places.stores"]
REFUSED = {
    "unknown category": (
        plain({}, {}, variables=[["P", "places.hospital"]]),
        r"variables\.P: no landmark is of category 'places.hospital' \(P\); use one of places, people",
    ),
    "destination undefined": (
        plain({}, {"destination": "$Q"}, variables=[STORE]),
        r"subgoals\[1\]\.destination: 'Q' is no variable; define it, or use one of: P",
    ),
    "change undefined": (
        plain({"change": "x", "change_destination": "$Q"}, {}),
        r"subgoals\[0\]\.change_destination: 'Q' is no variable.*none",
    ),
    "destination is a dependent": (
        plain({}, {"destination": "$I"}, variables=[STORE], dependents=[["I", "P.items"]]),
        r"subgoals\[1\]\.destination: 'I' is no variable",
    ),
    "story undefined": (plain({}, {}, story="Go to $X."), "story: 'X' is no variable or dependent"),
    "description undefined": (plain({}, {"description": "$X"}), r"subgoals\[1\]\.description: 'X' is no variable"),
    "change text undefined": (plain({}, {"change": "$X"}), r"subgoals\[1\]\.change: 'X' is no variable"),
    "reason undefined": (plain({}, {"reason": "$X"}), r"subgoals\[1\]\.reason: 'X' is no variable"),
    "message undefined": (
        plain({"delete": True, "messages": {"delete": {"from": "Noor", "text": "$X"}}}, {}),
        r"subgoals\[0\]\.messages\.delete\.text: 'X' is no variable",
    ),
    "sender undefined": (
        plain({"delete": True, "messages": {"delete": {"from": "$X", "text": "Go."}}}, {}),
        r"subgoals\[0\]\.messages\.delete\.from: 'X' is no variable",
    ),
    "message of an exception that is not permitted": (
        plain({"delete": True, "messages": {"trigger": {"from": "Noor", "text": "Go."}}}, {}),
        r"subgoals\[0\]\.messages\.trigger: subgoal 0 has no `trigger`; add it, or remove the message",
    ),
    "message too long with the longest value": (
        plain(
            {"delete": True, "messages": {"delete": {"from": "Noor", "text": "Go. " * 50 + "$P " * 2}}},
            {},
            variables=[["P", "places.restaurants"]],
        ),
        r"subgoals\[0\]\.messages\.delete\.text: has up to 247 characters .* shorten it to 240",
    ),
    "dependent undefined": (plain({}, {}, dependents=[["I", "P.items"]]), r"dependents\.I: 'P' is no variable"),
    "hidden undefined": (plain({}, {}, hidden_from_co_wizard=["P"]), "hidden_from_wizard: 'P' is no variable"),
    "name defined twice": (
        plain({}, {}, variables=[STORE], dependents=[["P", "P.items"]]),
        r"dependents\.P: the name P is defined twice",
    ),
    "one subgoal": (plain({}), "subgoals: a template has at least 2 subgoals"),
    "no subgoal": (plain(), "subgoals: a template has at least 2 subgoals"),
    "seven live": (plain({}, {}, {}, {}, {}, {}, {}), "subgoals: at most 6 subgoals .* not 7"),
    "after out of range": (plain({}, {"after": [2]}), r"subgoals\[1\]\.after: there is no subgoal 2; use 0 to 1"),
    "after negative": (plain({}, {"after": [-1]}), r"subgoals\[1\]\.after: there is no subgoal -1"),
    "after itself": (plain({"after": [0]}, {}), r"subgoals\[0\]\.after: subgoal 0 refers to itself"),
    "deletable after out of range": (
        plain({"delete_after_subgoal": 9}, {}),
        r"subgoals\[0\]\.delete_after_subgoal: there is no subgoal 9",
    ),
    "after in a cycle": (
        plain({"after": [2]}, {"after": [0]}, {"after": [1]}, {}),
        r"subgoals\[0\]\.after: the subgoals 0, 1, 2 wait for one another in a cycle",
    ),
    "after the destination": (
        plain({"after": [1]}, {}),
        r"subgoals\[0\]\.after: subgoal 0 cannot come after subgoal 1: that is the destination",
    ),
    "after what is the destination until a trigger": (
        plain({"after": [1]}, {}, {"trigger": True}),
        r"subgoals\[0\]\.after: subgoal 0 cannot come after subgoal 1",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_inconsistent_template_raises_error(case):
    fields, message = REFUSED[case]
    with pytest.raises(StoryboardError, match="^storyboard test: " + message):
        parse(fields)


def test_after_may_refer_to_later_subgoal_that_is_never_final():
    assert parse(plain({"after": [1]}, {}, {})).subgoals[0].after == (1,)


def test_price_in_dollars_is_no_reference():
    assert parse(plain({}, {}, story="It costs $5.")).story == "It costs $5."


def test_kinds_of_places_that_the_ontology_lacks_are_listed():
    variables = [["A", "places.hospital"], ["B", "places.stores"], ["C", "places.airport"]]
    message = (
        r"variables\.A: no landmark is of category 'places.hospital' \(A\), 'places.airport' \(C\); use one of places,"
    )
    with pytest.raises(StoryboardError, match="^storyboard test: " + message):
        parse(plain({}, {}, variables=variables))


def test_every_subgoal_may_await_its_trigger():
    template = parse(plain({"trigger": True}, {"trigger": True}))
    assert [subgoal.trigger for subgoal in template.subgoals] == [True, True]


@pytest.mark.parametrize("name", template_names())
def test_stories_of_shipped_templates_are_recognised_and_others_are_not(name):
    template = load_template(name)
    board = bind(template, load_town("midtown").sites, np.random.default_rng(3))
    assert is_shipped_story(plain_text(board.story, STORY_LENGTH))
    assert not is_shipped_story("Another story. " + board.story)
