import copy

import pytest

from dorothie_gym.dialogue import load_lexicon
from dorothie_gym.dialogue.entity_recognition import find_names, nearest_name
from dorothie_gym.dialogue.lexicon import parse_lexicon, read_data, split_words
from dorothie_gym.errors import PhraseFileError
from dorothie_gym.ontology import LABELS, ActionValue, LandmarkName, StreetName


def test_every_spoken_value_is_recognised():
    lexicon = load_lexicon()
    for value in LABELS:
        if isinstance(value, ActionValue):
            continue
        for phrase in lexicon.forms(value, "say"):
            mentions, _ = find_names(split_words(f"well, {phrase}."))
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
        ("Murphin", StreetName.MURFIN),
        ("Bonisteal", StreetName.BONISTEEL),
        ("Hubbart", StreetName.HUBBARD),
        ("Panara", LandmarkName.PANERA),
    ],
)
def test_misspellings_are_understood(text, value):
    mentions, words = find_names(split_words(text))
    assert [mention.value for mention in mentions] == [value]
    assert words[-1].startswith("#")


def test_error_names_missing_value():
    data = copy.deepcopy(read_data("lexicon.yaml"))
    del data["Street"]["Baits"]
    with pytest.raises(PhraseFileError, match=r"Street\.Baits"):
        parse_lexicon(data)


def test_error_names_ambiguous_phrase():
    data = copy.deepcopy(read_data("lexicon.yaml"))
    data["Street"]["Baits"]["hear"] = ["Beal"]
    with pytest.raises(PhraseFileError, match="Beal"):
        parse_lexicon(data)


def test_error_names_unquoted_boolean():
    data = copy.deepcopy(read_data("lexicon.yaml"))
    data["Object"]["Pole"]["hear"] = [True]
    with pytest.raises(PhraseFileError, match=r"Object\.Pole\.hear"):
        parse_lexicon(data)


@pytest.mark.parametrize("text", ["the car is fully loaded", "sure thing", "step on it", "a plenty hearty mouthful"])
def test_ordinary_words_are_not_names(text):
    assert find_names(split_words(text))[0] == []


def test_word_unlike_all_names_is_not_matched():
    assert nearest_name("zyzzyva") is None


def test_error_names_invalid_cue_expression():
    data = copy.deepcopy(read_data("lexicon.yaml"))
    data["Action"]["Stop"]["hear"] = ["stop("]
    with pytest.raises(PhraseFileError, match=r"Action\.Stop\.hear"):
        parse_lexicon(data)
