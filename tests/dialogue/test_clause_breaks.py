import pytest
from hypothesis import given
from hypothesis import strategies as st

from dorothie_gym.dialogue import guess_spans, understand
from dorothie_gym.dialogue.clause_breaks import with_breaks


@pytest.mark.parametrize(
    ("text", "broken"),
    [
        # a subject with its verb
        ("take the next right it's past the bank", "take the next right, it's past the bank"),
        ("slow down I can't find my seat belt", "slow down, I can't find my seat belt"),
        ("stop over there my brother's waiting", "stop over there, my brother's waiting"),
        ("pull in please our bags are wet", "pull in please, our bags are wet"),
        # an imperative
        ("we're nearly there turn left", "we're nearly there, turn left"),
        ("the Shell is on the right drop us there", "the Shell is on the right, drop us there"),
        ("go back take the other road", "go back, take the other road"),
        ("that's great just drop me here", "that's great, just drop me here"),
        # a verb before its subject
        ("we forgot the cake can you turn around", "we forgot the cake, can you turn around"),
        # words that take something back
        ("go to the Coco hang on a second make that the KFC", "go to the Coco, hang on a second, make that the KFC"),
        # answers and calls
        ("no I want the other one", "no, I want the other one"),
        ("sorry could you go left", "sorry, could you go left"),
        # tags, which ask
        ("that was the Ikea wasn't it", "that was the Ikea, wasn't it?"),
        ("this is Murfin right", "this is Murfin, right?"),
    ],
)
def test_commas_stand_between_clauses(text: str, broken: str) -> None:
    assert with_breaks(text) == broken


@pytest.mark.parametrize(
    "text",
    [
        "when you see the KFC turn left",
        "the place we are going to",
        "I hope you know the way",
        "what time do we arrive",
        "could you please take me to the Panera",
        "take the next right and then stop",
        "no need to hurry",
        "take the second on the right",
        "I was wondering if you could stop here",
        "turn left, then right at the lights",
        "that is it",
        "go",
        "",
    ],
)
def test_one_clause_has_no_comma(text: str) -> None:
    assert with_breaks(text) == text


def test_initial_no_is_no_answer_where_nothing_was_asked() -> None:
    assert with_breaks("no don't stop", answering=False) == "no don't stop"
    assert with_breaks("no don't stop") == "no, don't stop"


@pytest.mark.parametrize(
    ("bare", "marked"),
    [
        ("slow down there's a dog turn right at the lights", "Slow down, there's a dog. Turn right at the lights."),
        ("left at the KFC then stop I need some air", "Left at the KFC, then stop, I need some air."),
        ("we've gone too far go back to Beal", "We've gone too far, go back to Beal."),
        ("my house is on the left let me out there", "My house is on the left, let me out there."),
    ],
)
def test_speech_without_marks_is_read_like_text_with_marks(bare: str, marked: str) -> None:
    assert understand(bare).plan == understand(marked).plan
    values = [frozenset(value for span in guess_spans(text) for value in span.act.slots) for text in (bare, marked)]
    assert values[0] == values[1]
    assert guess_spans(bare)[0].act.move is guess_spans(marked)[0].act.move


@given(st.text(max_size=120))
def test_words_stay_the_same(text: str) -> None:
    broken = with_breaks(text)
    assert len(broken.split()) == len(text.split())
    assert all(after.startswith(before) for before, after in zip(text.split(), broken.split(), strict=True))
    assert " ".join(span.text for span in guess_spans(text)) == " ".join(text.split())
