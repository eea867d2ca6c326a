import numpy as np

from dorothie_gym.dialogue import CommunicativeFunction, Predicate, Proposition, draw_style
from dorothie_gym.ontology import DialogueMove, LandmarkName, ObjectClass, Role
from dorothie_gym.policies.speech import SpeechState, intend, remark
from dorothie_gym.policies.speech_timing import Delivery

RNG = np.random.default_rng(0)


def voice() -> SpeechState:
    return SpeechState(role=Role.PARTICIPANT)


def test_question_is_followed_by_silence_for_answer():
    speaker = voice().plan(remark(DialogueMove.QUERY_W), remark(DialogueMove.EXPLAIN))
    first, speaker = speaker.speak(0.0, 0.0, RNG)
    assert first is not None and first.act.move is DialogueMove.QUERY_W
    silent, speaker = speaker.speak(speaker.last_end + 0.1, 0.0, RNG)
    assert silent is None
    spoken, _ = speaker.speak(speaker.last_end + Delivery().patience + 0.1, 0.0, RNG)
    assert spoken is not None


def test_answer_ends_silence():
    _, speaker = voice().plan(remark(DialogueMove.QUERY_W), remark(DialogueMove.EXPLAIN)).speak(0.0, 0.0, RNG)
    spoken, _ = speaker.heard_other(2.0).speak(2.0, 0.0, RNG)
    assert spoken is not None


def test_joined_remarks_follow_without_pause():
    two = voice().plan(remark(DialogueMove.REPLY_N), remark(DialogueMove.INSTRUCT, LandmarkName.KFC, joined=True))
    _, speaker = two.speak(0.0, 0.0, RNG)
    spoken, _ = speaker.speak(0.5, 0.4, RNG)
    assert spoken is not None and "KFC" in spoken.text


def test_speaker_does_not_interrupt_own_utterance():
    _, speaker = voice().plan(remark(DialogueMove.EXPLAIN), remark(DialogueMove.EXPLAIN)).speak(0.0, 0.0, RNG)
    spoken, _ = speaker.speak(0.5, 1.0, RNG)
    assert spoken is None


def test_expired_remark_is_dropped_with_joined_ones():
    late = voice().plan(remark(DialogueMove.EXPLAIN, expires=1.0), remark(DialogueMove.INSTRUCT, joined=True))
    spoken, speaker = late.speak(2.0, 0.0, RNG)
    assert spoken is None and speaker.idle


def test_joined_remark_is_worded_with_previous_one():
    two = voice().plan(remark(DialogueMove.REPLY_N), remark(DialogueMove.INSTRUCT, LandmarkName.KFC, joined=True))
    first, speaker = two.speak(0.0, 0.0, np.random.default_rng(4))
    second, _ = speaker.speak(0.5, 0.4, np.random.default_rng(9))
    again, _ = speaker.speak(0.5, 0.4, np.random.default_rng(1))
    assert first is not None and second is not None
    assert first.text.endswith(",") or first.text.endswith(".")
    assert second == again  # the words were settled with those of the first


def test_wording_depends_on_speaker_style():
    plans = (
        remark(DialogueMove.INSTRUCT, LandmarkName.KFC),
        remark(DialogueMove.IRRELEVANT),
        remark(DialogueMove.ALIGN),
    )
    said = set()
    for seed in range(12):
        style = draw_style(Role.PARTICIPANT, np.random.default_rng(seed))
        speakers = [SpeechState(role=Role.PARTICIPANT, style=style).plan(plan) for plan in plans]
        said.add(tuple(speaker.speak(0.0, 0.0, np.random.default_rng(3))[0] for speaker in speakers))
    assert len(said) > 5


def test_statement_that_the_other_one_has_just_made_is_dropped():
    crowd = intend(CommunicativeFunction.INFORM, Proposition.of(Predicate.CROWDED, object=ObjectClass.PEDESTRIAN))
    slow = intend(CommunicativeFunction.REQUEST, Proposition.of(Predicate.WILL), joined=True)
    state = SpeechState(role=Role.PARTICIPANT).plan(crowd, slow)
    assert state.without_told(Proposition.of(Predicate.FAILED)).queue == state.queue
    (left,) = state.without_told(Proposition.of(Predicate.CROWDED)).queue
    assert left.act == slow.act and not left.joined
