"""Talk that a stranger finds sensible: signs, names, distances, and what is repeated."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from dorothie_gym.dialogue import Predicate, Proposition, Wording, understand, word_act, word_acts
from dorothie_gym.dialogue.looks import read_look
from dorothie_gym.dialogue.realization_context import WordingContext
from dorothie_gym.dialogue.speaker_style import SpeakerStyle
from dorothie_gym.ontology import ActionValue, DialogueAct, DialogueMove, GoalStatus, LandmarkName, ObjectClass, Role
from dorothie_gym.policies.co_wizard.answer_merging import in_one_breath, still_due
from dorothie_gym.policies.co_wizard.beliefs import BeliefState
from dorothie_gym.policies.co_wizard.places_ahead import JUST_AHEAD, distance_ahead
from dorothie_gym.policies.co_wizard.small_remarks import passes_over
from dorothie_gym.policies.participant.messages import _HERE, _POINTS
from dorothie_gym.policies.participant.unprompted_remarks import _passenger
from dorothie_gym.policies.speech import remark
from dorothie_gym.tasks.purposes import Purpose

M = DialogueMove
A = ActionValue
PERSON, HOUSE, KFC = LandmarkName.PERSON, LandmarkName.HOUSE, LandmarkName.KFC


def worded(move: DialogueMove, *values, topic: str | None = None, count: int = 40, role=Role.PARTICIPANT, **scene):
    rng, act = np.random.default_rng(5), DialogueAct.of(move, *values)
    context = WordingContext(**scene)
    return {word_act(act, role, rng, Wording(topic=topic), scene=context).lower() for _ in range(count)}


# --- distances --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("metres", "heard"), [(5.0, range(4, 6)), (9.0, range(8, 11)), (14.0, range(13, 15)), (4.0, range(4, 5))]
)
def test_short_ways_are_said_in_car_lengths_that_the_car_understands(metres, heard):
    rng, act = np.random.default_rng(2), DialogueAct.of(M.INSTRUCT, A.LANE_FOLLOW)
    for _ in range(20):
        text = word_act(act, Role.PARTICIPANT, rng, Wording(distance=metres))
        assert "meter" not in text and "car length" in text
        assert understand(text).distance in heard, text


def test_place_just_ahead_has_a_distance_for_a_guided_car():
    guided = SimpleNamespace(beliefs=BeliefState(goal=HOUSE))
    assert distance_ahead(guided, understand("Mateo's house is just up ahead")) == JUST_AHEAD
    assert distance_ahead(guided, understand("Mateo's house is forty meters ahead")) == 40.0
    assert distance_ahead(guided, understand("Mateo's house has a red roof")) is None
    knows = SimpleNamespace(beliefs=BeliefState(goal=HOUSE, exact=True))
    assert distance_ahead(knows, understand("Mateo's house is just up ahead")) is None


def test_place_ahead_is_announced_without_metres():
    close = worded(M.EXPLAIN, HOUSE, topic="ahead", owner="Mateo")
    assert close and not any("meter" in text for text in close)


# --- people -----------------------------------------------------------------------------------------------------------


def test_person_that_is_picked_up_is_named():
    for text in worded(M.INSTRUCT, PERSON, topic="pick_up", passenger="Lin", friend="Lin"):
        assert "pick up lin" in text
        assert PERSON in understand(text.replace("lin", "Lin")).landmarks, text


@pytest.mark.parametrize("topic", ["here_person", "passed_just_person", "passed_again_person"])
def test_person_is_no_it(topic):
    for text in worded(M.EXPLAIN, topic=topic):
        assert not {"it", "it's"} & set(text.replace(",", "").split()), text


@pytest.mark.parametrize(
    ("person", "named"),
    [
        ("Lin", "Lin"),
        ("Uncle Sandro", "Uncle Sandro"),
        ("Rosa's brother Nilo", "Nilo"),
        ("Ayumi's mother", "Ayumi's mother"),
    ],
)
def test_name_that_follows_pick_up(person, named):
    assert _passenger(Purpose(text="Pick up somebody", action="pick up somebody", person=person)) == named


# --- messages ---------------------------------------------------------------------------------------------------------


def test_reason_of_a_message_is_told_from_the_place_of_the_listener():
    assert _HERE.sub("there", "nobody here can leave the desk") == "nobody there can leave the desk"
    assert _POINTS.search("this wall is no place to sit") is not None


# --- the car ----------------------------------------------------------------------------------------------------------


def talking(*queue):
    state = SimpleNamespace(said=[])
    state.speech = SimpleNamespace(queue=queue)
    state.dialogue = SimpleNamespace(with_proposal=lambda _: state.dialogue)
    state.say = state.said.extend
    return state


def test_own_remarks_come_after_the_answer_and_not_to_one_who_has_not_understood():
    wet, yes = remark(M.EXPLAIN), remark(M.REPLY_Y)
    answers, own = still_due(talking(wet, yes), [DialogueAct.of(M.EXPLAIN)])
    assert (answers, own) == ((yes,), (wet,))
    assert still_due(talking(wet, yes), [DialogueAct.of(M.CONFUSE)]) == ((yes,), ())


def test_small_talk_and_repetitions_are_left_out_beside_an_answer():
    taken, joke = remark(M.CONFIRM, KFC), remark(M.IRRELEVANT)
    assert [item.act.move for item in in_one_breath([joke, taken])] == [M.CONFIRM]
    assert [item.act.move for item in in_one_breath([joke])] == [M.IRRELEVANT]
    assert len(in_one_breath([taken, taken])) == 1
    check, sign = remark(M.CHECK, KFC), remark(M.ACKNOWLEDGE, KFC)
    assert [item.act.move for item in in_one_breath([check, sign])] == [M.CHECK]


@pytest.mark.parametrize("text", ["well, that took a while", "that's the last one on the list", "so far so good"])
def test_remarks_in_passing_need_no_okay(text):
    state = SimpleNamespace(said=[], speech=SimpleNamespace(last=None))
    state.say = state.said.append
    assert passes_over(state, understand(text), np.random.default_rng(0))
    assert all(item.act.move is M.ACKNOWLEDGE for item in state.said)


def test_only_a_single_thing_is_nothing_else():
    several = worded(M.REPLY_W, ObjectClass.VEHICLES, topic="sees", role=Role.CO_WIZARD)
    assert not any("nothing else" in text or "just" in text.split() for text in several)


def test_look_of_another_person_is_forgotten():
    beliefs = BeliefState(goal=PERSON).with_look(read_look("somebody in a green coat"))
    assert beliefs.look is not None and beliefs.without_look().look is None


# --- words ------------------------------------------------------------------------------------------------------------


def test_now_is_said_once():
    rng = np.random.default_rng(8)
    acts = [DialogueAct.of(M.ACKNOWLEDGE), DialogueAct.of(M.INSTRUCT, A.SPEED_CHANGE)]
    for _ in range(300):
        spans = word_acts(acts, Role.PARTICIPANT, rng, [None, Wording(faster=False, speed=20)])
        words = spans[1].text.lower().replace(",", "").split()
        assert words.count("now") < 2, spans[1].text


def test_address_is_said_once_in_a_breath():
    rng, style = np.random.default_rng(8), SpeakerStyle(address="pal", addressing=0.9)
    acts = [DialogueAct.of(M.EXPLAIN, GoalStatus.COMPLETE), DialogueAct.of(M.INSTRUCT, KFC)]
    for _ in range(100):
        text = " ".join(span.text for span in word_acts(acts, Role.PARTICIPANT, rng, style=style)).lower()
        assert text.count("pal") < 2, text


def test_red_light_or_sign_is_not_in_the_way():
    stands = Proposition.of(Predicate.STANDS, action=A.STOP)
    cause = Proposition.of(Predicate.HINDERS, object=ObjectClass.TRAFFIC_SIGN)
    because = Proposition.of(Predicate.BECAUSE, effect=stands, cause=cause)
    rng, act = np.random.default_rng(1), DialogueAct.of(M.EXPLAIN, A.STOP, ObjectClass.TRAFFIC_SIGN)
    for _ in range(20):
        text = word_act(act, Role.CO_WIZARD, rng, Wording(topic="because_standing", content=because))
        assert "in the way" not in text
