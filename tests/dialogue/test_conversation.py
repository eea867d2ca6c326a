import pytest

from dorothie_gym.dialogue import WORDS_PER_SECOND, Conversation, Span, Utterance, speech_seconds
from dorothie_gym.ontology import DialogueAct, DialogueMove, Role

STOP = Span("Stop.", DialogueAct.of(DialogueMove.INSTRUCT))
OKAY = Span("Okay.", DialogueAct.of(DialogueMove.ACKNOWLEDGE))


def test_speech_duration_follows_speaking_rate():
    assert speech_seconds("turn left at the next") == pytest.approx(5 / WORDS_PER_SECOND)
    assert speech_seconds("turn left at the next", words_per_second=5.0) == pytest.approx(1.0)


@pytest.mark.parametrize("text", ["", "yes"])
def test_shortest_speech_is_longer_than_decision_interval(text):
    assert speech_seconds(text) == pytest.approx(0.6)


def test_speaking_rate_must_be_positive():
    with pytest.raises(ValueError, match="words_per_second"):
        speech_seconds("yes", 0.0)


def test_utterance_joins_its_spans():
    utterance = Utterance(Role.PARTICIPANT, (OKAY, STOP), 1.0, 2.0)
    assert utterance.text == "Okay. Stop."
    assert [act.move for act in utterance.acts] == [DialogueMove.ACKNOWLEDGE, DialogueMove.INSTRUCT]


def test_blank_spans_and_invalid_utterances_raise_error():
    with pytest.raises(ValueError, match="blank"):
        Span("  ", STOP.act)
    with pytest.raises(ValueError, match="spans"):
        Utterance(Role.PARTICIPANT, (), 0.0, 1.0)
    with pytest.raises(ValueError, match="end"):
        Utterance(Role.PARTICIPANT, (STOP,), 2.0, 1.0)
    with pytest.raises(ValueError, match="exchange"):
        Utterance(Role.PARTICIPANT, (STOP,), 0.0, 1.0, (1, 2))


PARTICIPANT, CO_WIZARD = Role.PARTICIPANT, Role.CO_WIZARD


def span(text: str, move: DialogueMove = DialogueMove.INSTRUCT) -> Span:
    return Span(text, DialogueAct.of(move))


def test_utterance_is_delivered_at_its_end():
    talk = Conversation(words_per_second=2.5)
    assert talk.say(PARTICIPANT, span("turn left at the next"), 10.0) is None  # 5 words: 2 s
    assert talk.speaking(PARTICIPANT, 10.5) == pytest.approx(1.5)
    assert talk.deliver(11.5) == []
    (heard,) = talk.deliver(12.0)
    assert (heard.start, heard.end, heard.text) == (10.0, 12.0, "turn left at the next")
    assert talk.deliver(12.5) == []
    assert talk.speaking(PARTICIPANT, 12.0) == 0.0


def test_one_word_per_decision_makes_one_utterance():
    talk = Conversation()
    talk.say(PARTICIPANT, span("yes", DialogueMove.REPLY_Y), 0.0)  # until 0.6 s
    assert talk.deliver(0.5) == []
    talk.say(PARTICIPANT, span("stop"), 0.5)
    assert talk.deliver(1.0) == []
    (heard,) = talk.deliver(1.5)
    assert heard.end == pytest.approx(1.2)
    assert [act.move for act in heard.acts] == [DialogueMove.REPLY_Y, DialogueMove.INSTRUCT]


def test_pause_begins_new_utterance():
    talk = Conversation()
    talk.say(PARTICIPANT, span("yes"), 0.0)
    assert len(talk.deliver(1.0)) == 1
    talk.say(PARTICIPANT, span("stop"), 1.0)
    assert talk.in_air(PARTICIPANT).start == 1.0


def test_undelivered_utterance_is_continued():
    talk = Conversation()
    talk.say(PARTICIPANT, span("yes"), 0.0)
    talk.say(PARTICIPANT, span("stop"), 2.0)
    (heard,) = talk.deliver(2.6)
    assert (heard.start, heard.end) == (0.0, pytest.approx(2.6))


def test_overlapping_utterances_are_delivered_by_start_then_role():
    talk = Conversation()
    talk.say(CO_WIZARD, span("which way"), 0.0)
    talk.say(PARTICIPANT, span("left now"), 0.0)
    assert [heard.speaker for heard in talk.deliver(1.0)] == [PARTICIPANT, CO_WIZARD]
    talk.say(CO_WIZARD, span("should I keep going straight on"), 1.0)
    talk.say(PARTICIPANT, span("stop"), 1.5)
    assert [heard.speaker for heard in talk.deliver(2.5)] == [PARTICIPANT]
    assert [heard.speaker for heard in talk.deliver(3.5)] == [CO_WIZARD]


def test_late_delivery_keeps_order_of_starts():
    talk = Conversation()
    talk.say(CO_WIZARD, span("okay"), 0.0)
    talk.say(PARTICIPANT, span("stop"), 0.5)
    assert [heard.speaker for heard in talk.deliver(5.0)] == [CO_WIZARD, PARTICIPANT]


def test_too_many_acts_in_utterance_raise_error_with_reason():
    talk = Conversation(max_spans=2)
    assert talk.say(PARTICIPANT, span("left"), 0.0) is None
    assert talk.say(PARTICIPANT, span("left"), 0.5) is None
    reason = talk.say(PARTICIPANT, span("left"), 1.0)
    assert reason is not None and "participant" in reason and "2" in reason
    assert len(talk.deliver(2.0)[0].spans) == 2
    assert talk.say(PARTICIPANT, span("left"), 2.0) is None


@pytest.mark.parametrize("arguments", [{"words_per_second": 0.0}, {"max_spans": 0}])
def test_error_names_argument_out_of_range(arguments):
    with pytest.raises(ValueError, match=next(iter(arguments))):
        Conversation(**arguments)
