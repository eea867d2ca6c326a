import pytest

from dorothie_gym.dialogue import guess_spans
from dorothie_gym.dialogue.signs import behind_signs, is_mere_sign
from dorothie_gym.ontology import DialogueMove


@pytest.mark.parametrize(
    ("text", "rest"),
    [
        ("oh dear, turn around", "turn around"),
        ("for goodness sake just stop", "just stop"),
        ("ooh look stop here", "stop here"),
        ("hang on a minute, go back", "go back"),
        ("turn left", ""),
        ("oh dear", ""),
    ],
)
def test_what_follows_interjections(text: str, rest: str) -> None:
    assert behind_signs(text, DialogueMove.EXPLAIN).endswith(rest) if rest else not behind_signs(text, None)


def test_yes_and_no_are_signs_where_nothing_was_asked() -> None:
    assert behind_signs("yeah go left", None) == "go left"
    assert behind_signs("yeah go left", DialogueMove.QUERY_YN) == ""
    assert behind_signs("no more turns", None) == "", "the no belongs to what follows"
    assert behind_signs("no, turn left", None) == "", "with a comma it answers"


def test_mere_signs() -> None:
    assert is_mere_sign("Oh, look") and is_mere_sign("goodness me")
    assert not is_mere_sign("oh look left") and not is_mere_sign("")


@pytest.mark.parametrize(
    ("text", "after", "move"),
    [
        ("oh, that bus nearly hit us", None, DialogueMove.EXPLAIN),
        ("oh my days stop the car", None, DialogueMove.INSTRUCT),
        ("sorry can we turn back", None, DialogueMove.INSTRUCT),
        ("goodness, where are we", None, DialogueMove.QUERY_W),
        ("yeah follow this road", None, DialogueMove.INSTRUCT),
        ("oh, I see", DialogueMove.EXPLAIN, DialogueMove.ACKNOWLEDGE),
        ("sorry, my mistake", DialogueMove.EXPLAIN, DialogueMove.ACKNOWLEDGE),
        ("no, straight on", DialogueMove.QUERY_YN, DialogueMove.REPLY_N),
    ],
)
def test_move_is_that_of_what_follows(text: str, after: DialogueMove | None, move: DialogueMove) -> None:
    assert guess_spans(text, after)[0].act.move is move
