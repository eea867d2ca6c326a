import functools
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dorothie_gym.session.spaces.fields import STORY_LENGTH, plain_text
from dorothie_gym.tasks import Channel, TaskState, bind, load_template, parse_template, template_names
from dorothie_gym.tasks.purposes import (
    find_items,
    in_first_person,
    read_message,
    read_people,
    read_purpose,
    read_purposes,
)

from .builders import grid_places
from .test_parsing import printed_template

SEEDS = range(2)


@functools.cache
def boards():
    """Returns all shipped storyboards, bound several times."""
    return [
        bind(load_template(name), grid_places(24), np.random.default_rng(seed))
        for name in template_names()
        for seed in SEEDS
    ]


def words(text):
    return re.findall(r"[\w-]+", in_first_person(text).lower())


def parts(purpose):
    found = (purpose.action, purpose.place, purpose.person, purpose.reason, *purpose.items)
    return [part for part in found if part is not None]


EXAMPLES = {
    "Buy a newspaper at 7-Eleven for Mateo's mother, because she has to stay with the guests": (
        "buy a newspaper for Mateo's mother", "at 7-Eleven", "Mateo's mother", ("a newspaper",),
        "she has to stay with the guests",
    ),
    "Pick up Lin": ("pick up Lin", None, "Lin", (), None),
    "Stop at Ikea to choose a new mattress": ("choose a new mattress", "at Ikea", None, (), None),
    "Arrive at Kofi's house": (None, "at Kofi's", "Kofi", (), None),
    "Take lunch to Mrs. Silva's house": ("take lunch to Mrs. Silva's", "to Mrs. Silva's", "Mrs. Silva", (), None),
    "Bring the child to Coco": ("bring the child to Coco", "to Coco", "the child", (), None),
    "Meet your boss for a bubble tea at Coco": (
        "meet my boss for a bubble tea", "at Coco", "my boss", ("a bubble tea",), None,
    ),
    "Have dinner at the house of Ingrid's brother Olav instead, because her oven has broken": (
        "have dinner", "at the house of Ingrid's brother Olav", "Ingrid's brother Olav", (), "her oven has broken",
    ),
    "Take it to Bashir at the house of the pianist": (
        "take it to Bashir at the house of the pianist", "at the house of the pianist", "the pianist", (), None,
    ),
    "Sing at the house of your old teacher Mina on Baits": (
        "sing on Baits", "at the house of my old teacher Mina", "my old teacher Mina", (), None,
    ),
    "The queue at KFC is too long: meet the others at Qdoba": (
        "meet the others", "at Qdoba", "the others", (), "the queue at KFC is too long",
    ),
    "You need to pick up the spare key from Mrs. Petrova's house.": (
        "pick up the spare key", "from Mrs. Petrova's", "Mrs. Petrova", ("the spare key",), None,
    ),
    "Please go to the Burger King and get a veggie burger": (
        "get a veggie burger", "to the Burger King", None, ("a veggie burger",), None,
    ),
    "Shop": ("shop", None, None, (), None),
    "Leilani is sent home early: drive her to her house": (
        "drive her to her house", "to her house", None, (), "Leilani is sent home early",
    ),
}  # fmt: skip


@pytest.mark.parametrize("text", EXAMPLES)
def test_purpose_is_read_from_the_description(text):
    found = read_purpose(text)
    assert (found.action, found.place, found.person, found.items, found.reason) == EXAMPLES[text]


@pytest.mark.parametrize("text", ["", "KFC", "The garden of the neighbours", "Tunde is late", "12 o'clock, sharp"])
def test_what_is_no_instruction_has_no_action(text):
    assert read_purpose(text).action is None


def test_every_errand_of_the_shipped_storyboards_is_read():
    for board in boards():
        state = TaskState(board)
        for i, subgoal in enumerate(board.subgoals):
            for text in (state.description(i), subgoal.change):
                if text is None:
                    continue
                found = read_purpose(text)
                assert found.reason, text
                assert found.action or found.person, text
                assert found.items == find_items(text) or not find_items(text), text
                assert found.action is None or not re.search(r"\byour?\b", found.action), text
                assert not set(words(" ".join(parts(found)))) - set(words(text)), text


@pytest.mark.parametrize("text", ["Visit Mrs. Adeyemi at her house", "Read the letter to Mrs. Adeyemi at her house"])
def test_house_of_the_person_named_before_is_hers(text):
    assert read_purpose(text).owner == "Mrs. Adeyemi"


def test_the_purpose_leaves_out_the_place():
    for board in boards():
        state = TaskState(board)
        for i, subgoal in enumerate(board.subgoals):
            found, label = read_purpose(state.description(i)), board.landmarks[subgoal.landmark].label
            if label in state.description(i):
                assert found.action is not None and label not in found.action
                assert found.place is not None and found.place.endswith(label)


def test_purposes_are_those_of_the_lines():
    tasks = "Pick up Yusuf\nBuy a bubble tea at Coco"
    assert [purpose.action for purpose in read_purposes(tasks)] == ["pick up Yusuf", "buy a bubble tea"]
    assert read_purposes("") == ()


@given(st.text(max_size=80) | st.lists(st.sampled_from(" ".join(EXAMPLES).split()), max_size=14).map(" ".join))
@settings(max_examples=300, deadline=None)
def test_any_text_is_read_and_nothing_is_invented(text):
    found = read_purpose(text)
    assert not set(words(" ".join(parts(found)))) - set(words(found.text)) - {"i", "me"}
    assert len(read_message(text).text) <= len(text)
    assert all(name.split()[-1] in text for name in read_people(text))


PEOPLE = {
    "birthday_tea": {"Mateo"},
    "school_run": {"Yusuf", "Lin"},
    "house_calls": {"Mr. Lindqvist", "Mrs. Adeyemi", "Ruth"},
    "community_picnic": {"Senora Ruiz"},
    "guest_from_kyoto": {"Haruto", "Mrs. Bauer"},
    "surprise_party": {"Agnieszka", "Samuel"},
    "sunday_lunch": {"Nonna Lucia", "Uncle Sandro"},
    "dog_walker": {"Bruno", "Greta", "Mila", "Thabo", "Elif"},
    "local_news": {"Mayor Dlamini", "Arvid"},
}


@pytest.mark.parametrize("name", PEOPLE)
@pytest.mark.parametrize("seed", SEEDS)
def test_people_of_a_story_are_found(name, seed):
    board = bind(load_template(name), grid_places(24), np.random.default_rng(seed))
    lines = [subgoal.description for subgoal in board.subgoals]
    texts = (plain_text(text, STORY_LENGTH) for text in (board.story, *lines))
    assert set(read_people(*texts)) == PEOPLE[name]


def test_landmarks_streets_and_days_are_no_people():
    story = (
        "On Monday drive from Ikea to Burger King. Take Hubbard past the KFC, or Broadway. Come from Kyoto on Sunday."
    )
    assert read_people(story) == ()


def test_every_story_of_the_package_names_somebody_whose_errand_it_is():
    for board in boards():
        people = read_people(board.story, *(subgoal.description for subgoal in board.subgoals))
        assert people, board.story
        assert not [name for name in people if name.lower() in {"ikea", "shell", "coco", "panera", "qdoba", "kfc"}]


def test_every_message_of_the_package_has_a_sender_and_a_reason():
    for board in boards():
        people = read_people(board.story)
        for subgoal in board.subgoals:
            for kind, message in subgoal.messages.given():
                found = read_message(str(message), people)
                assert found.channel is message.channel and found.text == message.text
                assert found.sender == in_first_person(message.sender)
                assert found.reason and len(found.reason.split()) >= 3, f"{board.name} {kind}: {message}"
                assert not set(words(found.reason)) - set(words(message.text))


@pytest.mark.parametrize(
    ("message", "sender", "reason"),
    [
        ("Call from Priya: The train was early, so please hurry.", "Priya", "the train was early"),
        ("Text message from your sister: Your cat is fine, so stay away.", "my sister", "my cat is fine"),
        ("Your friend texts: could you bring milk, because the shop is closed?", "my friend", "the shop is closed"),
        ("Note from Lin: I am ill, so do not come.", "Lin", None),
        ("E-mail from the depot: Please skip Ikea.", "the depot", None),
        ("Change of plan: The queue at KFC is too long: meet the others at Coco", None, "the queue at KFC is too long"),
        ("New on your list: Buy tea at Coco, because Noor is thirsty", None, "Noor is thirsty"),
    ],
)
def test_sender_and_reason_of_a_message_are_read(message, sender, reason):
    found = read_message(message)
    assert (found.sender, found.reason) == (sender, reason)


def test_channel_of_a_message_is_read():
    assert read_message("Voice message from Noor: Come home.").channel is Channel.VOICE_MESSAGE
    assert read_message("Come home.").channel is None


@pytest.mark.parametrize(
    ("text", "spoken"),
    [
        ("you have earned a break", "I have earned a break"),
        ("Mateo will not start without you", "Mateo will not start without me"),
        ("it has been on your list", "it has been on my list"),
        ("you are late", "I am late"),
        ("you all leave from there", "we all leave from there"),
        ("the trailer is heavier than you thought", "the trailer is heavier than I thought"),
        ("Agnieszka must not see you come", "Agnieszka must not see me come"),
    ],
)
def test_texts_are_said_in_the_first_person(text, spoken):
    assert in_first_person(text) == spoken


def test_template_printed_in_paper_is_read():
    template = parse_template(printed_template(), "paper")
    board = bind(template, grid_places(24), np.random.default_rng(0))
    first, second, third = (read_purpose(subgoal.description) for subgoal in board.subgoals)
    assert first.action is not None and first.action.startswith("pick up ") and len(first.items) == 2
    assert len(second.items) == 1 and second.place in {"from Ikea", "from 7-Eleven"}
    assert third.action is None and third.person == "Annabel" and third.place == "at Annabel's"
    assert read_people(board.story) == ("Annabel",)


@pytest.mark.parametrize(
    ("line", "owner"),
    [
        ("Take Hanh to Emil's house", "Emil"),
        ("Pick up Biscuit at your sister's house", "my sister"),
        ("Take Leilani to her house", "Leilani"),
        ("Buy a lamp at Ikea for Mateo", None),
    ],
)
def test_owner_of_the_house_is_read(line, owner):
    assert read_purpose(line).owner == owner
