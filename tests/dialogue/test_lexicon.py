import copy

import pytest

from dorothie_gym.dialogue import LexiconError, load_lexicon
from dorothie_gym.dialogue.lexicon import parse_lexicon, read_data, split_words
from dorothie_gym.ontology import LABELS, ActionValue, LandmarkName, StreetName


def test_every_value_that_is_said_is_understood_as_itself():
    lexicon = load_lexicon()
    for value in LABELS:
        if isinstance(value, ActionValue):
            assert lexicon.actions[value].manners["plain"]["do"]
            continue
        for phrase in lexicon.forms(value, "say"):
            mentions, _ = lexicon.find(split_words(f"well, {phrase}."))
            assert [mention.value for mention in mentions] == [value], phrase


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("the Seven-Eleven", LandmarkName.SEVEN_ELEVEN),
        ("the 7-11", LandmarkName.SEVEN_ELEVEN),
        ("a GAS STATION", LandmarkName.SHELL),
        ("Plimouth Road", StreetName.PLYMOUTH),
        ("Bonnie Steel", StreetName.BONISTEEL),
        ("Haywrd", StreetName.HAYWARD),
    ],
)
def test_spellings_and_slips_are_understood(text, value):
    mentions, words = load_lexicon().find(split_words(text))
    assert [mention.value for mention in mentions] == [value]
    assert words[-1].startswith("#")


def test_a_missing_value_is_named():
    data = copy.deepcopy(read_data("lexicon.yaml"))
    del data["Street"]["Baits"]
    with pytest.raises(LexiconError, match=r"Street\.Baits"):
        parse_lexicon(data)


def test_an_ambiguous_phrase_is_named():
    data = copy.deepcopy(read_data("lexicon.yaml"))
    data["Street"]["Baits"]["hear"] = ["Beal"]
    with pytest.raises(LexiconError, match="Beal"):
        parse_lexicon(data)


def test_an_unquoted_boolean_is_named():
    data = copy.deepcopy(read_data("lexicon.yaml"))
    data["Object"]["Pole"]["hear"] = [True]
    with pytest.raises(LexiconError, match=r"Object\.Pole\.hear"):
        parse_lexicon(data)
