from collections import Counter

import numpy as np
import pytest

from dorothie_gym.dialogue import Register, SpeakerStyle, draw_style, word_act
from dorothie_gym.ontology import ActionValue, DialogueAct, DialogueMove, LandmarkName, Role


def texts(style: SpeakerStyle, move: DialogueMove, *values: object, times: int = 300) -> list[str]:
    rng = np.random.default_rng(5)
    return [word_act(DialogueAct.of(move, *values), Role.PARTICIPANT, rng, style=style) for _ in range(times)]


def test_styles_vary_by_session_and_depend_on_seed_only():
    drawn = [draw_style(Role.PARTICIPANT, np.random.default_rng(seed)) for seed in range(40)]
    assert drawn == [draw_style(Role.PARTICIPANT, np.random.default_rng(seed)) for seed in range(40)]
    assert {style.register for style in drawn} == set(Register)
    assert len({style.idiolect for style in drawn}) == 40


def test_chatty_speakers_use_more_words_than_terse_ones():
    terse = texts(SpeakerStyle(chattiness=0.0, indirectness=0.0), DialogueMove.INSTRUCT, LandmarkName.KFC)
    chatty = texts(SpeakerStyle(chattiness=1.0, indirectness=1.0), DialogueMove.INSTRUCT, LandmarkName.KFC)
    assert np.mean([len(text.split()) for text in chatty]) > np.mean([len(text.split()) for text in terse]) + 1


def test_polite_and_slangy_registers_differ_in_words():
    polite = " ".join(texts(SpeakerStyle(register=Register.POLITE), DialogueMove.INSTRUCT, ActionValue.STOP)).lower()
    slangy = " ".join(texts(SpeakerStyle(register=Register.SLANGY), DialogueMove.INSTRUCT, ActionValue.STOP)).lower()
    assert "gotta" in slangy and "gotta" not in polite
    assert polite.count("please") > 2 * slangy.count("please")


def test_speakers_have_favourite_words():
    def favourites(idiolect: int) -> list[str]:
        style = SpeakerStyle(habit=0.7, idiolect=idiolect, chattiness=0.0)
        return [text for text, _ in Counter(texts(style, DialogueMove.REPLY_Y)).most_common(1)]

    assert len({favourites(idiolect)[0] for idiolect in range(1, 2**20, 100003)}) > 3


def test_hesitations_and_repairs_are_optional():
    smooth = texts(SpeakerStyle(), DialogueMove.INSTRUCT, LandmarkName.KFC)
    rough = texts(SpeakerStyle(disfluency=1.0, repairs=1.0), DialogueMove.INSTRUCT, LandmarkName.KFC)
    assert sum("I mean" in text or "no wait" in text for text in rough) > 30
    assert not any("I mean" in text or "no wait" in text for text in smooth)


def test_vocative_is_used_sometimes():
    named = texts(SpeakerStyle(address="captain", addressing=0.5), DialogueMove.ACKNOWLEDGE)
    assert 0.3 < sum("captain" in text for text in named) / len(named) < 0.7


@pytest.mark.parametrize("fields", [{"chattiness": 1.5}, {"repairs": -0.1}, {"habit": 1.0}, {"idiolect": -1}])
def test_error_names_trait_out_of_range(fields):
    with pytest.raises(ValueError, match=next(iter(fields))):
        SpeakerStyle(**fields)
