from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dorothie_gym.dialogue import Direction, Wording, guess_act, guess_spans, word_act
from dorothie_gym.ontology import SLOT_VALUES, DialogueAct, DialogueMove, LandmarkName, Role, Slot, parse_act

SHARES = {Slot.ACTION: 0.4, Slot.LANDMARK: 0.4, Slot.STREET: 0.25, Slot.OBJECT: 0.12, Slot.STATUS: 0.15}


def random_act(rng: np.random.Generator) -> DialogueAct:
    """Draws a move with up to two values in each slot; Irrelevant has none."""
    move = DialogueMove(int(rng.integers(len(DialogueMove))))
    values = []
    for slot, share in SHARES.items():
        if move is not DialogueMove.IRRELEVANT and rng.random() < share:
            values += [SLOT_VALUES[slot][int(rng.integers(len(SLOT_VALUES[slot])))] for _ in range(rng.integers(1, 3))]
    return DialogueAct.of(move, *values)


def random_wording(rng: np.random.Generator) -> Wording:
    return Wording(
        direction=list(Direction)[int(rng.integers(4))] if rng.random() < 0.5 else None,
        ordinal=int(rng.integers(1, 10)) if rng.random() < 0.2 else None,
        faster=bool(rng.random() < 0.5) if rng.random() < 0.7 else None,
        lights=bool(rng.random() < 0.5) if rng.random() < 0.7 else None,
        speed=float(rng.integers(5, 90)) if rng.random() < 0.2 else None,
        distance=float(rng.integers(5, 300)) if rng.random() < 0.1 else None,
        here=bool(rng.random() < 0.1),
        past=list(LandmarkName)[int(rng.integers(1, 11))] if rng.random() < 0.1 else None,
    )


@pytest.mark.parametrize("speaker", [Role.PARTICIPANT, Role.CO_WIZARD])
def test_acts_are_recovered_from_generated_words(speaker):
    rng = np.random.default_rng(11)
    moves, values, recovered, surplus = Counter(), Counter(), Counter(), 0
    count = 1500
    for _ in range(count):
        act = random_act(rng)
        guess = guess_act(word_act(act, speaker, rng, random_wording(rng)))
        moves[act.move is guess.move] += 1
        for slot in (Slot.LANDMARK, Slot.STREET, Slot.ACTION):
            values[slot] += len(act.values(slot))
            recovered[slot] += sum(value in guess.slots for value in act.values(slot))
        # `past` and `dropped` name landmarks that the act does not carry.
        surplus += any(value not in act.slots for value in guess.slots if value.slot in (Slot.STREET, Slot.ACTION))
    assert moves[True] / count >= 0.9
    assert all(recovered[slot] / values[slot] >= 0.95 for slot in values), recovered
    assert surplus / count < 0.05


@pytest.mark.parametrize(
    ("text", "move", "slots"),
    [
        ("Could you take me to the KFC first?", "Instruct", {"Landmark": ["KFC"]}),
        ("left at the next one please", "Instruct", {"Action": ["JTurn"]}),
        ("Which way here?", "QueryW", {"Action": ["Queried"]}),
        ("Right.", "ReplyW", {"Action": ["JTurn"]}),
        ("Should I keep going?", "QueryYN", {"Action": ["LaneFollow"]}),
        ("hmm, not sure", "ReplyU", {}),
        ("You mean the house on Beal, right?", "Check", {"Landmark": ["House"], "Street": ["Beal"]}),
        ("That's it.", "Confirm", {}),
        ("Did you get that?", "Align", {}),
        ("I did.", "Acknowledge", {}),
        ("Sorry, say again?", "Confuse", {}),
        ("I said turn around.", "Clarify", {"Action": ["UTurn"]}),
        ("It’s on Murfin, past the SevenEleven.", "Explain", {"Street": ["Murfin"], "Landmark": ["SevenEleven"]}),
        ("a bit further", "Instruct", {"Action": ["LaneFollow"]}),
        ("Shall I find another way?", "QueryYN", {}),
        ("Taking Hubbard instead.", "Confirm", {"Street": ["Hubbard"]}),
        ("Actually we can skip the gas station.", "Explain", {"Landmark": ["Shell"], "Status": ["Abandoned"]}),
        ("Great, that's done.", "Explain", {"Status": ["Complete"]}),
        ("Where to next?", "QueryW", {"Landmark": ["Queried"]}),
        ("Do you see the person by the crossing?", "QueryYN", {"Object": ["Pedestrian"]}),
        ("why did we stop", "QueryW", {"Action": ["Stop"]}),
        ("Red light ahead.", "ReplyW", {"Object": ["TrafficLight"]}),
        ("No no, that was the wrong way.", "Explain", {}),
        ("Sorry, turning around.", "Acknowledge", {"Action": ["UTurn"]}),
        ("what a nice day", "Irrelevant", {}),
        ("TURN LEFT ON PLYMOUTH ROAD", "Instruct", {"Action": ["JTurn"], "Street": ["Plymouth"]}),
        ("at the stop sign turn left", "Instruct", {"Action": ["JTurn"], "Object": ["TrafficSign"]}),
        ("change to the left lane please", "Instruct", {"Action": ["LaneSwitch"]}),
        ("asdf qwer", "Irrelevant", {}),
        ("", "Irrelevant", {}),
    ],
)
def test_free_english_is_understood(text, move, slots):
    assert guess_act(text) == parse_act(move, slots)


@pytest.mark.parametrize(
    ("text", "after", "move"),
    [
        ("take a left", DialogueMove.QUERY_W, DialogueMove.REPLY_W),
        ("okay", DialogueMove.QUERY_YN, DialogueMove.REPLY_Y),
        ("yes", DialogueMove.CHECK, DialogueMove.CONFIRM),
        ("okay", DialogueMove.INSTRUCT, DialogueMove.ACKNOWLEDGE),
    ],
)
def test_previous_move_determines_the_move_of_an_answer(text, after, move):
    assert guess_act(text, after).move is move


@pytest.mark.parametrize(
    ("text", "moves"),
    [
        ("Yeah, then straight on to Fuller.", ["ReplyY", "Instruct"]),
        ("no, stop", ["ReplyN", "Instruct"]),
        ("I can hardly see, slow down.", ["Explain", "Instruct"]),
        ("Not Ikea, Coco. Turning around.", ["Confirm", "Explain"]),
        ("It's on Murfin, past the SevenEleven.", ["Explain"]),
        ("no, don't turn left", ["ReplyN"]),
        ("There's a barrier ahead. Shall I find another way?", ["Explain", "QueryYN"]),
        ("so to the Shell we still have that house for later", ["Instruct", "Explain"]),
        ("it's past the KFC also there's a bus in front of it", ["Explain", "Explain"]),
        ("the house we passed on the way to the Ikea", ["Explain"]),
        ("Turn left, did you get that?", ["Instruct", "Align"]),
        ("We are done here, so the Ikea next.", ["Explain", "Instruct"]),
        ("The house, on Beal, we'll do the Shell later.", ["Instruct", "Explain"]),
        ("Yes, that one.", ["Confirm"]),
        ("  ", []),
    ],
)
def test_one_utterance_may_contain_several_acts(text, moves):
    spans = guess_spans(text)
    assert [span.act.move.label for span in spans] == moves
    assert " ".join(span.text for span in spans) == text.strip()


@given(st.text(max_size=160), st.none() | st.sampled_from(DialogueMove))
def test_any_text_gets_acts(text, after):
    assert isinstance(guess_act(text, after), DialogueAct)
    assert all(span.text.strip() for span in guess_spans(text, after))


@pytest.mark.parametrize("greeting", ["Hello", "Hi", "hey", "Good morning", "Hello there", "Good evening,", "Hi,"])
@pytest.mark.parametrize("addressee", ["car", "dear car", "robot", "my friend", ""])
def test_a_greeting_is_small_talk_whoever_it_addresses(greeting, addressee):
    (span,) = guess_spans(f"{greeting} {addressee}".strip(" ,") + ".")
    assert span.act == DialogueAct(DialogueMove.IRRELEVANT)


@pytest.mark.parametrize("call", ["Hello?", "hello, hello?", "hello, anybody there?", "hey, are you listening?"])
def test_a_greeting_that_waits_for_an_answer_asks_for_attention(call):
    assert guess_spans(call)[0].act == DialogueAct(DialogueMove.ALIGN)


@pytest.mark.parametrize(
    ("text", "move", "slots"),
    [
        ("Thank you car", "Acknowledge", {}),
        ("hey car turn left", "Instruct", {"Action": ["JTurn"]}),
        ("Hello car, please turn left.", "Instruct", {"Action": ["JTurn"]}),
        ("Car, turn left.", "Instruct", {"Action": ["JTurn"]}),
        ("Hi car, can you hear me?", "Align", {}),
        ("Hey, a car!", "Explain", {"Object": ["Vehicles"]}),
        ("hey car ahead", "Explain", {"Object": ["Vehicles"]}),
        ("There is a car ahead.", "Explain", {"Object": ["Vehicles"]}),
    ],
)
def test_a_car_that_is_spoken_to_is_no_vehicle_in_sight(text, move, slots):
    (span,) = guess_spans(text)
    assert span.act == parse_act(move, slots)


@pytest.mark.parametrize(
    ("before", "text", "move"),
    [
        # answers without a word for yes or no, and behind interjections
        ("Should I stop here?", "you should", "ReplyY"),
        ("Should I stop here?", "it would not", "ReplyN"),
        ("Should I stop here?", "ah no no go on", "ReplyN"),
        ("Should I stop here?", "could be", "ReplyU"),
        ("Do you mean Beal?", "Beal, yes", "Confirm"),
        # signs that something was heard
        ("The road is closed.", "can't be helped", "Acknowledge"),
        ("Going to Ikea.", "all right, Ikea", "Acknowledge"),
        ("Take a left.", "left it is", "Confirm"),
        # corrections of what was announced
        ("I'm turning left.", "no, right", "Clarify"),
        ("I'm turning left.", "the other side", "Clarify"),
        ("I'm turning left.", "nobody said left", "Clarify"),
        # nothing was said before: these are orders
        ("", "not this one, the one after", "Instruct"),
        ("", "nothing over thirty please", "Instruct"),
        ("", "you needn't stop here", "Instruct"),
        ("", "I'd sooner we took Fuller", "Instruct"),
        ("", "one would be grateful to be let out", "Instruct"),
        ("", "it would spare my back if you went slower", "Instruct"),
        # questions
        ("", "is it on the left or on the right", "QueryW"),
        ("", "from which side do we come", "QueryW"),
        ("", "isn't that the Coco", "Check"),
        ("", "we're taking Beal aren't we", "Check"),
        ("", "can we see the bridge from here", "QueryYN"),
        # statements
        ("", "I feel sick", "Explain"),
        ("", "the speed limit is thirty here", "Explain"),
    ],
)
def test_wordings_of_passengers_have_their_moves(before, text, move):
    after = guess_spans(before)[-1].act.move if before else None
    assert guess_spans(text, after)[0].act.move.label == move
