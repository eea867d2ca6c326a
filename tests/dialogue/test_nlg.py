import re
import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dorothie_gym.dialogue import (
    MAX_CHARACTERS,
    Direction,
    Register,
    SpeakerStyle,
    Wording,
    WordingContext,
    draw_style,
    understand,
    word_act,
    word_acts,
)
from dorothie_gym.dialogue.grammar import VOICES, parse_grammar
from dorothie_gym.dialogue.phrases import read_talk_files
from dorothie_gym.errors import PhraseFileError
from dorothie_gym.ontology import (
    LABELS,
    ActionValue,
    DialogueAct,
    DialogueMove,
    GoalStatus,
    LandmarkName,
    ObjectClass,
    Role,
    StreetName,
)
from tests.dialogue.talk_corpus import session

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


def test_act_with_all_labels_is_worded_in_part():
    for move in DialogueMove:
        for speaker in Role:
            assert len(words(DialogueAct(move, frozenset(LABELS)), speaker)) <= MAX_CHARACTERS


def test_wording_depends_on_act_and_seed_only():
    act = DialogueAct.of(DialogueMove.INSTRUCT, LandmarkName.KFC, StreetName.BAITS)
    assert [words(act, seed=seed) for seed in range(20)] == [words(act, seed=seed) for seed in range(20)]
    assert len({words(act, seed=seed) for seed in range(20)}) > 3


@pytest.mark.parametrize("move", [DialogueMove.INSTRUCT, DialogueMove.REPLY_W])
@pytest.mark.parametrize("direction", ["left", "right", "straight", "back"])
def test_turn_names_direction(move, direction):
    for seed in range(20):
        for speaker in (Role.PARTICIPANT, Role.CO_WIZARD):
            assert (
                direction in words(DialogueAct.of(move, ActionValue.J_TURN), speaker, seed, direction=direction).lower()
            )


def test_wording_details_are_realised():
    act = DialogueAct.of
    turn = act(DialogueMove.INSTRUCT, ActionValue.J_TURN)
    speed = act(DialogueMove.EXPLAIN, ActionValue.SPEED_CHANGE)
    lights = act(DialogueMove.INSTRUCT, ActionValue.LIGHT_CHANGE)
    change = act(DialogueMove.INSTRUCT, LandmarkName.COCO, LandmarkName.IKEA, GoalStatus.ABANDONED, GoalStatus.ONGOING)
    for seed in range(10):
        assert "second" in words(turn, seed=seed, direction="right", ordinal=2)
        assert "twenty-five" in words(speed, Role.CO_WIZARD, seed, faster=False, speed=25.0)
        assert "off" in words(lights, seed=seed, lights=False)
        heard = understand(words(change, seed=seed, dropped=LandmarkName.IKEA))
        assert heard.dropped == (LandmarkName.IKEA,) and LandmarkName.COCO in heard.landmarks, heard.text


def test_topic_selects_templates():
    for seed in range(10):
        text = words(DialogueAct.of(DialogueMove.EXPLAIN), seed=seed, topic="wrong_way")
        assert "wrong" in text
    assert words(DialogueAct.of(DialogueMove.EXPLAIN), topic="nothing we know of")


def test_co_wizard_speaks_in_whole_sentences():
    for seed in range(20):
        text = words(DialogueAct.of(DialogueMove.ACKNOWLEDGE, LandmarkName.KFC), Role.CO_WIZARD, seed)
        assert text[0].isupper() and text.endswith(".")


def test_utterances_are_brief():
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
def test_error_names_wording_field_out_of_range(fields):
    with pytest.raises(ValueError, match=next(iter(fields))):
        Wording(**fields)


def without_section(name: str, head: str) -> dict[str, str]:
    """Returns the talk files without the sections of a head."""
    texts = read_talk_files()
    sections = re.split(r"(?m)^(?===)", texts[name])
    texts[name] = "".join(section for section in sections if not section.startswith(head))
    return texts


def test_grammar_without_words_for_a_speaker_raises_error():
    texts = without_section("20_initiating.talk", "== Align co_wizard")
    with pytest.raises(PhraseFileError, match="Align has no template without slots for co_wizard"):
        parse_grammar(texts)


def test_grammar_without_words_for_an_action_raises_error():
    with pytest.raises(PhraseFileError, match="doing UTurn"):
        parse_grammar(without_section("00_actions.talk", "== doing UTurn"))


@pytest.mark.parametrize(
    "head", ["== prop dumpster", "== Explain topic=less_wetness", "== Explain co_wizard topic=failed_gps"]
)
def test_grammar_without_words_for_a_member_of_the_world_names_the_section(head):
    section = head.replace(" co_wizard", "")
    with pytest.raises(PhraseFileError, match=f"dialogue/data/talk: there is no section `{section}`"):
        parse_grammar(without_section("36_surroundings.talk", head))


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        ("== Explain\nthe {weather} is fine", "weather"),
        ("== Explain Street=Elm\non Elm", "Elm"),
        ("== Explain\n<nothing> knows", "nothing"),
        ("== Explain\n(left|right", "missing"),
        ("== Explain\ngo ({street}|left)", "lines of their own"),
        ("== Shout\nhey", "Shout"),
        ("== do Fly\nfly", "Fly"),
        ("hello", "precedes the first section"),
    ],
)
def test_error_names_faulty_line_and_file(line, reason):
    with pytest.raises(PhraseFileError, match=rf"new\.talk.*{reason}"):
        parse_grammar({**read_talk_files(), "new.talk": line})


def test_acts_of_one_utterance_are_joined():
    acts = [
        DialogueAct.of(DialogueMove.REPLY_Y),
        DialogueAct.of(DialogueMove.INSTRUCT, ActionValue.J_TURN),
        DialogueAct.of(DialogueMove.INSTRUCT, ActionValue.STOP),
    ]
    for seed in range(30):
        rng = np.random.default_rng(seed)
        spans = word_acts(acts, Role.PARTICIPANT, rng, [None, Wording(direction="left"), None])
        assert [span.act for span in spans] == acts
        text = " ".join(span.text for span in spans)
        assert len(text) <= MAX_CHARACTERS
        assert "left" in spans[1].text
        # a continuation in lower case follows a comma, not a full stop
        assert not re.search(r"\. [a-z]", text), text


@settings(max_examples=200, deadline=None)
@given(st.lists(acts, min_size=1, max_size=4), st.sampled_from(Role), st.integers(0, 2**32))
def test_any_acts_fit_into_an_utterance(said, speaker, seed):
    rng = np.random.default_rng(seed)
    spans = word_acts(said, speaker, rng, style=draw_style(speaker, rng), scene=WordingContext(exception=True))
    assert [span.act for span in spans] == said
    assert all(len(span.text) <= MAX_CHARACTERS for span in spans)


def test_number_of_contexts_must_equal_number_of_acts():
    with pytest.raises(ValueError, match="2 for 1 acts"):
        word_acts([DialogueAct.of(DialogueMove.CONFIRM)], Role.PARTICIPANT, np.random.default_rng(0), [None, None])


def test_mentioned_values_are_replaced_by_references():
    act = DialogueAct.of(DialogueMove.INSTRUCT, StreetName.BEAL)
    style = SpeakerStyle(anaphora=1.0)
    scene = WordingContext(mentioned=frozenset({StreetName.BEAL}))
    for seed in range(20):
        text = word_act(act, Role.PARTICIPANT, np.random.default_rng(seed), style=style, scene=scene)
        assert "Beal" not in text and re.search("that street|same street|that road", text.lower()), text
        text = word_act(act, Role.PARTICIPANT, np.random.default_rng(seed), style=style)
        assert "Beal" in text


@pytest.mark.slow
def test_wording_is_fast():
    acts = [act for item in session(0, 200) for act in (span.act for span in item.spans)]
    rng = np.random.default_rng(0)
    style = draw_style(Role.PARTICIPANT, rng)
    for act in acts:
        word_act(act, Role.PARTICIPANT, rng, style=style)
    start = time.process_time()
    for act in acts:
        word_act(act, Role.PARTICIPANT, rng, style=style)
    assert (time.process_time() - start) / len(acts) < 100e-6


@pytest.mark.parametrize("move", [DialogueMove.EXPLAIN, DialogueMove.QUERY_YN, DialogueMove.CONFIRM])
def test_verbs_agree_with_plural_objects(move):
    texts = []
    for seed in range(300):
        rng = np.random.default_rng(seed)
        act = DialogueAct.of(move, ObjectClass.RAIL_TRACK)
        texts.append(word_act(act, Role.CO_WIZARD, rng))
    about_tracks = [text for text in texts if "tracks" in text]
    assert len(about_tracks) > 10
    assert not any(
        re.search(r"tracks (is|was|has|blocks)\b|\bthere's some\b|\bis some\b", text) for text in about_tracks
    )


def test_long_spans_keep_what_they_say():
    acts = [DialogueAct.of(DialogueMove.INSTRUCT, ActionValue.J_TURN, StreetName.BONISTEEL)] * 4
    wordings = [Wording(direction="left", ordinal=2)] * 4
    for seed in range(40):
        rng = np.random.default_rng(seed)
        spans = word_acts(acts, Role.PARTICIPANT, rng, wordings, style=draw_style(Role.PARTICIPANT, rng))
        assert all("left" in span.text.lower() and "Bonisteel" in span.text for span in spans), spans


def test_requests_in_the_form_of_questions_end_with_a_question_mark():
    style = SpeakerStyle(register=Register.POLITE, indirectness=1.0)
    act = DialogueAct.of(DialogueMove.INSTRUCT, ActionValue.U_TURN)
    texts = {word_act(act, Role.PARTICIPANT, np.random.default_rng(seed), style=style) for seed in range(200)}
    asked = [text for text in texts if text.startswith(("Could you", "Would you"))]
    assert asked and all(text.endswith("?") for text in asked)


def test_car_does_not_call_the_friends_of_its_rider_its_own():
    act = DialogueAct.of(DialogueMove.ACKNOWLEDGE, LandmarkName.PERSON)
    said = {
        role: " ".join(word_act(act, role, np.random.default_rng(seed)).lower() for seed in range(80))
        for role in VOICES
    }
    assert "my friend" in said[Role.PARTICIPANT] and "your friend" not in said[Role.PARTICIPANT]
    assert "your friend" in said[Role.CO_WIZARD] and "my friend" not in said[Role.CO_WIZARD]


def test_house_is_called_by_its_owner_only_if_it_is_the_present_destination():
    scene = WordingContext(owner="Mateo")
    later = DialogueAct.of(DialogueMove.EXPLAIN, LandmarkName.HOUSE, GoalStatus.PENDING)
    for act, named in ((DialogueAct.of(DialogueMove.INSTRUCT, LandmarkName.HOUSE), True), (later, False)):
        rng = np.random.default_rng(0)
        texts = [word_acts([act], Role.PARTICIPANT, rng, scene=scene)[0].text for _ in range(40)]
        assert any("Mateo's house" in text for text in texts) is named
