import re

import pytest

from dorothie_gym.dialogue.move_cues import move_cues
from dorothie_gym.dialogue.nlu import _propositions, understand
from dorothie_gym.dialogue.pattern_index import PatternIndex, bits, required_parts
from tests.dialogue.annotated_utterances import read_annotated

SENTENCES = [span for name in ("dev", "people_dev") for item in read_annotated(name) for span in item.spans]


@pytest.mark.parametrize(
    ("pattern", "parts"),
    [
        (r"\bspeed limit\b", {"speed"}),
        (r"\b(fog|mist)\b", {"fog", "mist"}),
        (r"colou?red", {"colo"}),
        (r"(very )?fast", {"fast"}),
        (r"(?!never)always|rain{2}", {"always", "rai"}),
        (r"x*|fog", None),
        (r"[abc]+", None),
        (r"(?P<name>fog)", None),
        (r"(?i:fog)", None),
        ("", None),
    ],
)
def test_required_parts_occur_in_every_match(pattern, parts):
    assert required_parts(pattern) == (None if parts is None else frozenset(parts))


def test_index_names_the_patterns_that_can_match():
    index = PatternIndex([re.compile(r"\bfog\w*"), None, re.compile(r"\w+ing\b"), re.compile(r"^.$")])
    assert list(bits(index.possible(["foggy", "morning"]))) == [0, 2, 3]
    assert list(bits(index.possible(["rain"]))) == [3]


def test_index_loses_no_match_of_the_cues():
    rules = move_cues().rules
    tables = [
        ([rule.masked for rule in rules], "masked"),
        ([rule.acted for rule in rules], "acted"),
        ([pattern for pattern, _ in _propositions("questions", "asks")[0]], "masked"),
        ([pattern for pattern, _ in _propositions("statements", "says")[0]], "masked"),
    ]
    for patterns, field in tables:
        index, matched = PatternIndex(patterns), 0
        for sentence in SENTENCES:
            words = getattr(understand(sentence), field).strip(" ,?")
            possible = index.possible(words.split())
            found = [number for number, pattern in enumerate(patterns) if pattern is not None and pattern.search(words)]
            assert all(possible >> number & 1 for number in found), (words, found)
            matched += len(found)
        assert matched
