import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dorothie_gym.dialogue import MAX_CHARACTERS, Direction, LexiconError, Wording, word_act
from dorothie_gym.dialogue.grammar import parse_grammar
from dorothie_gym.dialogue.lexicon import read_data
from dorothie_gym.ontology import (
    LABELS,
    ActionValue,
    DialogueAct,
    DialogueMove,
    GoalStatus,
    LandmarkName,
    Role,
    StreetName,
)

wordings = st.builds(
    Wording,
    direction=st.none() | st.sampled_from(Direction),
    ordinal=st.none() | st.integers(1, 9),
    faster=st.none() | st.booleans(),
    lights=st.none() | st.booleans(),
    speed=st.none() | st.floats(0, 9e4),
    distance=st.none() | st.floats(0, 9e4),
    here=st.booleans(),
    past=st.none() | st.sampled_from(LandmarkName),
    dropped=st.none() | st.sampled_from(LandmarkName),
    topic=st.none() | st.sampled_from(["fog", "detour", "changed", "where", "no such topic"]),
)
acts = st.builds(
    DialogueAct,
    st.sampled_from(DialogueMove),
    st.frozensets(st.sampled_from(LABELS), max_size=4) | st.frozensets(st.sampled_from(LABELS), max_size=len(LABELS)),
)


def words(act: DialogueAct, speaker: Role = Role.PARTICIPANT, seed: int = 0, **particulars: object) -> str:
    return word_act(act, speaker, np.random.default_rng(seed), Wording(**particulars))


@settings(max_examples=500, deadline=None)
@given(acts, st.sampled_from(Role), wordings, st.integers(0, 2**32))
def test_every_act_of_every_speaker_has_words(act, speaker, wording, seed):
    text = word_act(act, speaker, np.random.default_rng(seed), wording)
    assert 1 <= len(text) <= MAX_CHARACTERS
    assert text == text.strip()
    assert re.fullmatch(r"[A-Za-z0-9 ,.?'-]+", text), text
    assert not re.search(r"  |,,|\?\.|\.\.|,\?", text), text


def test_all_labels_at_once_are_said_in_part():
    for move in DialogueMove:
        for speaker in Role:
            assert len(words(DialogueAct(move, frozenset(LABELS)), speaker)) <= MAX_CHARACTERS


def test_wording_is_a_function_of_act_and_seed():
    act = DialogueAct.of(DialogueMove.INSTRUCT, LandmarkName.KFC, StreetName.BAITS)
    assert [words(act, seed=seed) for seed in range(20)] == [words(act, seed=seed) for seed in range(20)]
    assert len({words(act, seed=seed) for seed in range(20)}) > 3


@pytest.mark.parametrize("move", [DialogueMove.INSTRUCT, DialogueMove.REPLY_W])
@pytest.mark.parametrize("direction", ["left", "right", "straight", "back"])
def test_a_turn_says_its_direction(move, direction):
    for seed in range(20):
        for speaker in (Role.PARTICIPANT, Role.CO_WIZARD):
            assert (
                direction in words(DialogueAct.of(move, ActionValue.J_TURN), speaker, seed, direction=direction).lower()
            )


def test_particulars_are_said():
    act = DialogueAct.of
    turn = act(DialogueMove.INSTRUCT, ActionValue.J_TURN)
    speed = act(DialogueMove.EXPLAIN, ActionValue.SPEED_CHANGE)
    lights = act(DialogueMove.INSTRUCT, ActionValue.LIGHT_CHANGE)
    change = act(DialogueMove.INSTRUCT, LandmarkName.COCO, LandmarkName.IKEA, GoalStatus.ABANDONED, GoalStatus.ONGOING)
    for seed in range(10):
        assert "second" in words(turn, seed=seed, direction="right", ordinal=2)
        assert "twenty-five" in words(speed, Role.CO_WIZARD, seed, faster=False, speed=25.0)
        assert "off" in words(lights, seed=seed, lights=False)
        forgotten, taken = words(change, seed=seed, dropped=LandmarkName.IKEA).lower().split(",")[:2]
        assert "ikea" in forgotten and "coco" in taken


def test_a_topic_picks_its_templates():
    for seed in range(10):
        text = words(DialogueAct.of(DialogueMove.EXPLAIN), seed=seed, topic="wrong_way")
        assert "wrong" in text
    assert words(DialogueAct.of(DialogueMove.EXPLAIN), topic="nothing we know of")


def test_the_car_speaks_in_whole_sentences():
    for seed in range(20):
        text = words(DialogueAct.of(DialogueMove.ACKNOWLEDGE, LandmarkName.KFC), Role.CO_WIZARD, seed)
        assert text[0].isupper() and text.endswith(".")


def test_talk_is_brief():
    rng = np.random.default_rng(0)
    act = DialogueAct.of
    common = [
        act(DialogueMove.INSTRUCT, ActionValue.J_TURN),
        act(DialogueMove.INSTRUCT, LandmarkName.KFC),
        act(DialogueMove.ACKNOWLEDGE),
        act(DialogueMove.CONFIRM),
        act(DialogueMove.EXPLAIN, ActionValue.STOP),
    ]
    counts = [
        len(word_act(act, speaker, rng, Wording(direction="left")).split())
        for act in common
        for speaker in (Role.PARTICIPANT, Role.CO_WIZARD)
        for _ in range(50)
    ]
    assert 2.0 < np.mean(counts) < 6.0


@pytest.mark.parametrize(
    "fields", [{"direction": "up"}, {"ordinal": 0}, {"ordinal": 10}, {"speed": -1.0}, {"distance": 1e9}]
)
def test_wording_names_the_field_that_is_out_of_range(fields):
    with pytest.raises(ValueError, match=next(iter(fields))):
        Wording(**fields)


def test_a_grammar_that_leaves_a_speaker_without_words_is_refused():
    data = read_data("grammar.yaml")
    data["moves"]["Explain"] = [{"who": "participant", "say": ["look"]}]
    with pytest.raises(LexiconError, match="Explain has no template without slots for co_wizard"):
        parse_grammar(data)


def test_an_unknown_gap_is_named():
    data = read_data("grammar.yaml")
    data["moves"]["Explain"].append({"say": ["the {weather} is fine"]})
    with pytest.raises(LexiconError, match="weather"):
        parse_grammar(data)


def test_an_unknown_value_is_named():
    data = read_data("grammar.yaml")
    data["moves"]["Explain"].append({"when": {"Street": "Elm"}, "say": ["on Elm"]})
    with pytest.raises(LexiconError, match="Elm"):
        parse_grammar(data)
