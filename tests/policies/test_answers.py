"""Answers of the scripted Co-Wizard depend on what is asked, and on what it believes."""

from dataclasses import replace

import numpy as np
import pytest

from dorothie_gym.dialogue import CommunicativeFunction, Predicate, Proposition, act_of, understand, word_act
from dorothie_gym.maps.routing import router
from dorothie_gym.ontology import DialogueMove, ObjectClass, Role
from dorothie_gym.policies.co_wizard.answers import answer_open, answer_yes_no
from dorothie_gym.policies.co_wizard.proposition_truth import seconds_to_goal
from dorothie_gym.policies.policy import replace as changed
from dorothie_gym.policies.speech import Remark, intend
from dorothie_gym.policies.travel_time import CruiseSpeed, travel_time
from tests.policies.test_reasons import DRIVING, on_the_way, view_of

M = DialogueMove
YES, NO, UNSURE = M.REPLY_Y, M.REPLY_N, M.REPLY_U


def reply(question: str, *, to_goal: float | None = None, known: bool = True, **changes) -> Remark:
    """Returns the first remark of the answer of a car on its way, perhaps with so many metres to go."""
    talk = on_the_way()
    view = view_of(talk, **{**DRIVING, **changes})
    if to_goal is not None:
        progress = talk.state.route.progress
        assert progress is not None
        talk.state.config = replace(talk.state.config, close_distance=progress.left(view.station) + 100.0 - to_goal)
    if not known:
        talk.state.beliefs = talk.state.beliefs.without_place()
        talk.state.route = talk.state.route.with_progress(None)
    words = understand(question)
    act = act_of(words)
    answer = answer_yes_no if act.move is M.QUERY_YN else answer_open
    answer(talk.state, view, act, words, np.random.default_rng(0))
    return talk.state.speech.queue[0]


@pytest.mark.parametrize(
    ("question", "close", "far"),
    [("Are we close?", YES, NO), ("Is it far?", NO, YES), ("Are we nearly there?", YES, NO)],
)
def test_answer_about_the_distance_depends_on_the_question_and_the_distance(question, close, far):
    assert reply(question, to_goal=50.0).act.move is close
    assert reply(question, to_goal=500.0).act.move is far
    assert reply(question, known=False).act.move is UNSURE


@pytest.mark.parametrize(
    ("question", "found", "lost"),
    [("Do you know where we are?", YES, NO), ("Are we lost?", NO, YES)],
)
def test_answer_about_the_position_depends_on_its_variance(question, found, lost):
    assert reply(question, pose_covariance=np.diag([1.0, 1.0, 0.01])).act.move is found
    assert reply(question, pose_covariance=np.diag([90.0, 90.0, 0.5])).act.move is lost


def test_car_knows_the_way_to_places_on_its_map_only():
    assert reply("Do you know the way?").act.move is YES
    assert reply("Do you know the way?", known=False).act.move is NO


def test_what_is_not_in_sight_is_denied_with_the_proposition():
    answer = reply(
        "Do you see the pedestrian?", objects=np.zeros_like(on_the_way().observations["co_wizard"]["objects"])
    )
    assert answer.act.move is NO
    assert answer.meaning == (Proposition.of(Predicate.SEES, object=ObjectClass.PEDESTRIAN, negated=True),)


def test_yes_and_no_are_worded_by_what_was_asked():
    rng = np.random.default_rng(3)
    for question in ("Are we lost?", "Are we close?", "Is it safe?"):
        answer = reply(question, pose_covariance=np.diag([1.0, 1.0, 0.01]))
        text = word_act(answer.act, Role.CO_WIZARD, rng, answer.wording)
        assert understand(text).affirms is (answer.act.move is YES), text


def test_time_to_the_goal_is_that_of_the_route():
    answer = reply("How long will it take?")
    (arrival,) = answer.meaning
    talk = on_the_way()
    view = view_of(talk, **DRIVING)
    assert arrival.get("seconds") == seconds_to_goal(talk.state.knowledge, view)
    assert arrival.get("place") is talk.state.beliefs.goal
    assert reply("How long will it take?", known=False).act.move is UNSURE


def test_travel_time_grows_with_the_way_and_includes_red_lights():
    talk = on_the_way()
    progress, town = talk.state.route.progress, talk.env.town
    assert progress is not None and progress.route is not None
    times = [travel_time(town, progress, view_of(talk).station, float(now), 8.0) for now in range(0, 120, 10)]
    assert min(times) >= progress.route.length / 8.0
    halfway = progress.legs[len(progress.legs) // 2]
    later = progress.replanned(town, (halfway.lane, halfway.start))
    assert travel_time(town, later, halfway.start, 0.0, 8.0) < max(times)
    slow, usual, fast = (travel_time(town, progress, 0.0, 0.0, 5.0, CruiseSpeed(now)) for now in (20.0, 40.0, 55.0))
    assert 1.3 * usual < slow < 2.2 * usual and fast == usual, "lights and junctions cost the same at any speed"
    for_a_while = travel_time(town, progress, 0.0, 0.0, 5.0, CruiseSpeed(20.0, 40.0, until=10.0))
    assert usual < for_a_while < slow
    nowhere = changed(progress, route=None)
    assert travel_time(town, nowhere, 0.0, 0.0, 8.0) == float("inf")
    assert router(town).route(view_of(talk).here, progress.goal) is not None


def test_questions_of_the_participant_are_understood_as_they_are_meant():
    rng = np.random.default_rng(0)
    asked = [Proposition.of(Predicate.CLOSE), Proposition.of(Predicate.CLOSE, negated=True)]
    asked += [Proposition.of(Predicate.LOCALISED), Proposition.of(Predicate.LOCALISED, negated=True)]
    asked += [Proposition.of(predicate) for predicate in (Predicate.SAFE, Predicate.VISIBILITY, Predicate.HAS_ROUTE)]
    asked.append(Proposition.of(Predicate.RIGHT_WAY))
    for question in asked:
        item = intend(CommunicativeFunction.PROPOSITIONAL_QUESTION, question)
        for _ in range(20):
            text = word_act(item.act, Role.PARTICIPANT, rng, item.wording)
            assert understand(text).asked == question, text


@pytest.mark.parametrize("question", ["When do ugh get there?", "why did you turn aunt?", "How will you chat there?"])
def test_question_of_which_nothing_was_understood_is_asked_again(question):
    assert reply(question).act.move is M.CONFUSE


@pytest.mark.parametrize("question", ["where are we?", "what street is this?"])
def test_question_for_the_street_is_answered_by_it(question):
    (said,) = reply(question).meaning
    assert said.predicate is Predicate.ON_STREET
