"""The scripted Co-Wizard remembers what the participant tells about an errand, and comes back to it."""

from __future__ import annotations

import numpy as np
import pytest

from dorothie_gym.dialogue import Predicate
from dorothie_gym.ontology import DialogueAct, DialogueMove, GoalStatus, LandmarkName, Role
from dorothie_gym.policies.co_wizard.errand_memory import arrival_reminder, kept_for_later, note_owner, remember
from dorothie_gym.policies.co_wizard.state import CoWizardState
from dorothie_gym.policies.heard_utterance import heard_utterance
from tests.policies.said import with_words
from tests.policies.test_acknowledgement import start

TO_COCO = DialogueAct.of(DialogueMove.INSTRUCT, LandmarkName.COCO)
REASON = DialogueAct.of(DialogueMove.EXPLAIN)


def after(text: str, *acts: DialogueAct, recalls: float = 1.0) -> CoWizardState:
    state, view = start(recalls=recalls)
    heard = heard_utterance(with_words(dict(view.raw), Role.PARTICIPANT, text, *acts), Role.PARTICIPANT)
    assert heard is not None
    state.beliefs = state.beliefs.with_unknown_goal(LandmarkName.COCO)
    remember(state, heard, np.random.default_rng(0))
    return state


@pytest.mark.parametrize(
    ("text", "item", "person"),
    [
        ("I have to buy a mango smoothie for Amina, so take me to Coco", "a mango smoothie", "Amina"),
        ("I need to fetch a parcel for Mr. Lindqvist, go to Coco", None, "Mr. Lindqvist"),
        ("take me to Coco, I want to buy two iced coffees", "two iced coffees", None),
    ],
)
def test_thing_and_person_are_remembered(text, item, person):
    told = after(text, REASON, TO_COCO).beliefs.told
    assert [said.predicate for said in told] == [Predicate.PURPOSE]
    assert told[0].get("person") == person and (item is None or told[0].get("item") == item)


def test_nothing_is_remembered_of_a_plain_order_or_of_small_talk():
    assert not after("take me to Coco on Duffield", TO_COCO).beliefs.told
    chat = DialogueAct.of(DialogueMove.IRRELEVANT)
    assert not after("I want to eat a pizza with my cousin", chat).beliefs.told
    over = DialogueAct.of(DialogueMove.EXPLAIN, LandmarkName.COCO, GoalStatus.COMPLETE)
    assert not after("Coco is done, I have to thank Amina", over).beliefs.told


def test_what_was_told_is_repeated_by_those_who_recall():
    words = "I have to buy a mango smoothie for Amina, so take me to Coco"
    assert [item.act.move for item in after(words, REASON, TO_COCO).speech.queue] == [DialogueMove.ACKNOWLEDGE]
    assert after(words, REASON, TO_COCO, recalls=0.0).speech.idle


def test_errand_is_mentioned_on_arrival_and_when_it_is_put_off():
    state = after("I have to buy a mango smoothie for Amina, so take me to Coco", REASON, TO_COCO)
    (reminder,) = arrival_reminder(state, np.random.default_rng(1))
    assert reminder.meaning[0].get("item") == "a mango smoothie"
    later = kept_for_later(state, LandmarkName.COCO)
    assert GoalStatus.PENDING in later.act.slots and later.meaning[0].get("item") == "a mango smoothie"
    assert kept_for_later(state, LandmarkName.KFC).meaning[0].predicate is Predicate.TASK


@pytest.mark.parametrize(
    ("text", "owner"),
    [
        ("To Mateo's house on Duffield", "Mateo"),
        ("go to Mrs. Tamm's house please", "Mrs. Tamm"),
        ("my sister's house is next", "your sister"),
        ("take me to the house on Beal", None),
    ],
)
def test_owner_of_the_house_is_taken_up(text, owner):
    state, view = start(recalls=0.0)
    house = DialogueAct.of(DialogueMove.INSTRUCT, LandmarkName.HOUSE)
    heard = heard_utterance(with_words(dict(view.raw), Role.PARTICIPANT, text, house), Role.PARTICIPANT)
    assert heard is not None
    note_owner(state, view, heard)
    assert state.beliefs.owner == owner
