import pytest

from dorothie_gym.dialogue import WORDS_PER_SECOND, Span, Utterance, speech_seconds
from dorothie_gym.ontology import DialogueAct, DialogueMove, Role

STOP = Span("Stop.", DialogueAct.of(DialogueMove.INSTRUCT))
OKAY = Span("Okay.", DialogueAct.of(DialogueMove.ACKNOWLEDGE))


def test_speech_takes_its_words_at_the_rate():
    assert speech_seconds("turn left at the next") == pytest.approx(5 / WORDS_PER_SECOND)
    assert speech_seconds("turn left at the next", words_per_second=5.0) == pytest.approx(1.0)


@pytest.mark.parametrize("text", ["", "yes"])
def test_shortest_speech_outlasts_a_decision(text):
    assert speech_seconds(text) == pytest.approx(0.6)


def test_speaking_rate_must_be_positive():
    with pytest.raises(ValueError, match="words_per_second"):
        speech_seconds("yes", 0.0)


def test_utterance_joins_its_spans():
    utterance = Utterance(Role.PARTICIPANT, (OKAY, STOP), 1.0, 2.0)
    assert utterance.text == "Okay. Stop."
    assert [act.move for act in utterance.acts] == [DialogueMove.ACKNOWLEDGE, DialogueMove.INSTRUCT]


def test_blank_spans_and_impossible_utterances_are_refused():
    with pytest.raises(ValueError, match="blank"):
        Span("  ", STOP.act)
    with pytest.raises(ValueError, match="spans"):
        Utterance(Role.PARTICIPANT, (), 0.0, 1.0)
    with pytest.raises(ValueError, match="end"):
        Utterance(Role.PARTICIPANT, (STOP,), 2.0, 1.0)
    with pytest.raises(ValueError, match="exchange"):
        Utterance(Role.PARTICIPANT, (STOP,), 0.0, 1.0, (1, 2))
