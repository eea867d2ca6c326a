"""What is said fits what was asked and what has been named: repairs, hints, messages, people, and silence that ends."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dorothie_gym.dialogue import Predicate, Proposition, understand, word_act
from dorothie_gym.dialogue.realization_context import Wording
from dorothie_gym.ontology import ActionValue, DialogueAct, DialogueMove, GoalStatus, LandmarkName, Role
from dorothie_gym.policies.co_wizard.answers import answer_yes_no
from dorothie_gym.policies.co_wizard.destinations import postpone
from dorothie_gym.policies.co_wizard.proposition_truth import believes
from dorothie_gym.policies.co_wizard.unprompted_remarks import take_initiative
from dorothie_gym.policies.participant.dialogue_update import listen
from dorothie_gym.policies.participant.messages import message_remark
from dorothie_gym.policies.participant.target_hints import hint, is_in_mind
from dorothie_gym.policies.speech import remark
from dorothie_gym.sim.state.codes import Motion
from tests.policies.said import with_words
from tests.policies.test_co_wizard import Talk
from tests.policies.test_reasons import DRIVING, on_the_way, view_of
from tests.policies.test_repairs import Human

M = DialogueMove


def say_again(talk: Talk) -> None:
    talk.say(M.CONFUSE, decisions=14)


def test_what_was_not_understood_is_said_again_and_not_an_earlier_remark():
    talk = on_the_way()
    arrived = remark(M.EXPLAIN, LandmarkName.IKEA, wording=Wording(topic="arrived"))
    talk.state.speech = replace(talk.state.speech, said=(arrived, remark(M.ACKNOWLEDGE)), last=remark(M.ACKNOWLEDGE))
    before = len(talk.actions)
    say_again(talk)
    spoken = [action.speech.act for action in talk.actions[before:] if action.speech]
    assert spoken and spoken[0] == DialogueAct.of(M.ACKNOWLEDGE)


def test_order_of_two_places_is_not_asked_where_both_were_just_named():
    talk = on_the_way()
    goal = talk.state.beliefs.goal
    assert goal is not None
    other = next(name for name in (LandmarkName.KFC, LandmarkName.IKEA) if name is not goal)
    talk.state.style = replace(talk.state.style, offers=0.0)
    asked = 0
    for seed in range(20):
        talk.state.speech = replace(talk.state.speech.cleared(), heard=frozenset({goal, other}))
        postpone(talk.state, view_of(talk, **DRIVING), other, np.random.default_rng(seed))
        asked += any(item.act.move is M.QUERY_W for item in talk.state.speech.queue)
    assert asked == 0


def test_house_that_is_not_on_the_map_is_not_known_although_another_house_is():
    talk = on_the_way()
    view, house = view_of(talk, **DRIVING), LandmarkName.HOUSE
    talk.state.beliefs = talk.state.beliefs.with_unknown_goal(house)
    assert believes(talk.state.knowledge, view, Proposition.of(Predicate.KNOWS, place=house)) is False


def test_question_whether_a_place_is_known_replaces_the_remark_that_it_is_not():
    talk = on_the_way()
    house = LandmarkName.HOUSE
    talk.state.beliefs = talk.state.beliefs.with_unknown_goal(house)
    unknown = Proposition.of(Predicate.KNOWS, negated=True, place=house)
    no_map = replace(remark(M.EXPLAIN, house, GoalStatus.UNKNOWN), meaning=(unknown,))
    talk.state.speech = talk.state.speech.cleared().plan(no_map)
    words = understand("is that on your map?")
    view = view_of(talk, **DRIVING)
    answer_yes_no(talk.state, view, DialogueAct.of(M.QUERY_YN), words, np.random.default_rng(0))
    queue = talk.state.speech.queue
    assert queue[0].act.move is M.REPLY_N
    assert not any(item.act.move is M.EXPLAIN and GoalStatus.UNKNOWN in item.act.slots for item in queue)


@pytest.mark.parametrize("motion", [Motion.WAITING, Motion.DRIVING])
def test_car_that_creeps_up_to_a_place_asks_for_the_way_when_it_waits_at_a_junction(motion):
    talk = on_the_way()
    state = talk.state
    state.beliefs = state.beliefs.without_place()
    state.route = state.route.with_progress(None)
    state.intentions = state.intentions.creeping_up()
    state.dialogue = replace(state.dialogue, asked_at=-100.0, heard_at=-100.0)
    lane = next(lane.id for lane in talk.env.town.lanes if len(talk.env.town.exits(lane.id)) > 1)
    station = np.full(1, talk.env.town.lanes[lane].length - 5.0)
    standing = {"motion": np.int64(motion), "speed": np.zeros(1), "lane": np.int64(lane), "station": station}
    view = replace(view_of(talk, hazard=np.int64(0), **standing), time=60.0, speaking=0.0)
    take_initiative(state, view, np.random.default_rng(0))
    asks = any(item.act.move in (M.QUERY_W, M.QUERY_YN, M.CHECK) for item in state.speech.queue)
    assert asks is (motion is Motion.WAITING)


def test_question_whether_one_is_heard_has_another_answer_than_whether_it_was_understood():
    assert understand("Are you still there?").about_hearing and understand("can you hear me?").about_hearing
    assert not understand("did you get that?").about_hearing
    topics = []
    for words in ("Are you still there?", "did you get that?"):
        human = Human()
        human.observation = with_words(human.observation, Role.CO_WIZARD, words, DialogueAct.of(M.ALIGN))
        listen(human.state, human.view, human.rng)
        topics.append(human.state.speech.queue[0].wording.topic)
    assert topics == ["hears", "align"]


def test_places_are_called_it_only_after_they_were_named():
    human = Human()
    goal = human.state.task.goal
    assert goal is not None
    human.state.set_guiding(True)
    human.state.speech = replace(human.state.speech.cleared(), said=(), heard=frozenset())
    assert not is_in_mind(human.state, human.view)
    hints = [item for seed in range(30) for item in hint(human.state, human.view, np.random.default_rng(seed))]
    about_place = [item for item in hints if item.meaning[0].predicate in (Predicate.LOOKS, Predicate.LOCATED)]
    assert about_place and all(goal.name in item.act.slots for item in about_place)
    human.state.speech = replace(human.state.speech, heard=frozenset({goal.name}))
    assert is_in_mind(human.state, human.view) is (goal.name is not LandmarkName.PERSON)


def test_message_is_told_with_its_sender_and_its_reason():
    human = Human()
    goal = human.state.task.goal
    assert goal is not None
    text = "Call from Mrs. Tamm's son: Mother has been baking since four, so please bring her a coffee."
    human.observation["message"] = text
    human.state.config = replace(human.state.config, tells_message=1.0)
    (told,) = message_remark(human.state, human.view, goal, human.rng)
    assert told.meaning[0].get("person") == "Mrs. Tamm's son"
    words = word_act(told.act, Role.PARTICIPANT, np.random.default_rng(0), told.wording)
    assert "Mrs. Tamm's son" in words and "baking since four" in words
    human.observation["message"] = ""
    assert message_remark(human.state, human.view, goal, human.rng) == ()


def test_reason_for_a_standstill_is_dropped_when_the_car_drives_again():
    talk = on_the_way()
    because = Proposition.of(
        Predicate.BECAUSE, effect=Proposition.of(Predicate.STANDS), cause=Proposition.of(Predicate.RED)
    )
    reason = replace(remark(M.EXPLAIN, ActionValue.STOP), meaning=(because,))
    talk.state.speech = talk.state.speech.cleared().plan(reason)
    take_initiative(talk.state, view_of(talk, **DRIVING), np.random.default_rng(0))
    assert reason not in talk.state.speech.queue
