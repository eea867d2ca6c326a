import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dorothie_gym.dialogue import Direction, Predicate, Wording, understand, word_act
from dorothie_gym.ontology import ActionValue, DialogueAct, DialogueMove, LandmarkName, ObjectClass, Role, StreetName

MOVES = [DialogueMove(number) for number in range(1, 15) if number != DialogueMove.REPLY_N]


@pytest.mark.parametrize("move", MOVES, ids=lambda move: move.label)
@pytest.mark.parametrize("direction", Direction)
def test_the_direction_and_place_of_every_generated_turn_are_understood(move, direction):
    extras = (
        (),
        (LandmarkName.KFC,),
        (StreetName.BAITS,),
        (LandmarkName.HOUSE, StreetName.DIVISION),
        (ObjectClass.STATIC,),
    )
    rng = np.random.default_rng(3)
    for extra in extras:
        for ordinal in (None, 1, 2, 3):
            for speaker in (Role.PARTICIPANT, Role.CO_WIZARD):
                for here in (False, True):
                    wording = Wording(direction=direction, ordinal=ordinal, here=here)
                    text = word_act(DialogueAct.of(move, ActionValue.J_TURN, *extra), speaker, rng, wording)
                    heard = understand(text)
                    assert heard.direction == direction, text
                    assert heard.ordinal == ordinal, text
                    assert ActionValue.J_TURN in heard.actions, text


def test_a_generated_refusal_denies_the_direction():
    rng = np.random.default_rng(0)
    act = DialogueAct.of(DialogueMove.REPLY_N, ActionValue.J_TURN)
    for _ in range(20):
        heard = understand(word_act(act, Role.CO_WIZARD, rng, Wording(direction="left")))
        assert heard.direction is None
        assert heard.affirms is False


@pytest.mark.parametrize(
    ("text", "direction"),
    [
        ("Right.", "right"),
        ("left?", "left"),
        ("turn right here", "right"),
        ("turn right now", "right"),
        ("make a RIGHT at the light", "right"),
        ("no, right", "right"),
        ("don’t turn right, go left", "left"),
        ("not left, right", "right"),
        ("go straight ahead", "straight"),
        ("turn around", "back"),
        ("make a u-turn", "back"),
        ("You mean the house on Beal, right?", None),
        ("you know the way right?", None),
        ("pull over right there", None),
        ("that's right, on Fuller", None),
        ("all right", None),
        ("we left the KFC already", None),
        ("what's left?", None),
        ("Go around over Hubbard.", None),
    ],
)
def test_directions_are_distinguished_from_other_senses_of_left_and_right(text, direction):
    assert understand(text).direction == direction


@pytest.mark.parametrize(
    ("text", "ordinal"),
    [
        ("take the second right", 2),
        ("left at the next one please", 1),
        ("the one after the next, on the right", 2),
        ("turn left at the 3rd traffic light", 3),
        ("take me to the KFC first", None),
        ("where to next?", None),
    ],
)
def test_ordinals_count_opportunities(text, ordinal):
    assert understand(text).ordinal == ordinal


def test_route_has_several_turns():
    heard = understand("Left on Baits, then second right.")
    assert [(turn.direction, turn.ordinal) for turn in heard.turns] == [("left", None), ("right", 2)]
    assert heard.streets == (StreetName.BAITS,)


def test_speeds_lights_and_distances_are_understood():
    assert understand("I can hardly see, slow down").faster is False
    assert understand("speed up a little").faster is True
    assert understand("Slowing to twenty-five.").speed == 25
    assert understand("drive at 30 km an hour").speed == 30
    assert understand("can you switch your lights on").lights is True
    assert understand("turn off the headlights").lights is False
    assert understand("turn off the headlights").actions == (ActionValue.LIGHT_CHANGE,)
    assert understand("stop in fifty meters").distance == 50
    assert understand("stop in fifty meters").speed is None


def test_references_are_understood():
    assert understand("It’s on Murfin, past the SevenEleven.").past == (LandmarkName.SEVEN_ELEVEN,)
    assert understand("Forget Ikea, we go to Coco instead.").dropped == (LandmarkName.IKEA,)
    assert understand("not the KFC").dropped == (LandmarkName.KFC,)
    assert understand("After.").order == "after"
    assert understand("let's do Shell after all").order is None
    assert understand("a bit further").further
    assert understand("then roll forward a bit").further and understand("a touch further, pal").further
    assert not understand("keep going").further and not understand("further straight on").further
    assert understand("stop here").here
    assert understand("yeah, then straight on").affirms is True
    assert understand("hmm, not sure").affirms is None


@pytest.mark.parametrize("faster", [True, False])
@pytest.mark.parametrize("lights", [True, False])
def test_generated_particulars_are_understood(faster, lights):
    rng = np.random.default_rng(1)
    wording = Wording(faster=faster, lights=lights, speed=35.0)
    for move in (DialogueMove.INSTRUCT, DialogueMove.EXPLAIN, DialogueMove.QUERY_YN):
        for speaker in (Role.PARTICIPANT, Role.CO_WIZARD):
            heard = understand(word_act(DialogueAct.of(move, ActionValue.SPEED_CHANGE), speaker, rng, wording))
            assert (heard.faster, heard.speed) == (faster, 35), heard.text
            heard = understand(word_act(DialogueAct.of(move, ActionValue.LIGHT_CHANGE), speaker, rng, wording))
            assert heard.lights is lights, heard.text


@given(st.text(max_size=160))
def test_any_text_is_parsed(text):
    assert understand(text).text == text


def test_every_way_to_offer_a_detour_asks_for_consent_to_another_way():
    rng = np.random.default_rng(0)
    act = DialogueAct.of(DialogueMove.QUERY_YN)
    texts = {word_act(act, Role.CO_WIZARD, rng, Wording(topic="detour")) for _ in range(80)}
    assert len(texts) > 6
    for text in texts:
        asked = understand(text).asked
        assert asked is not None and asked.predicate is Predicate.WILL, text
    assert understand("should I go around the block?").asked is None
