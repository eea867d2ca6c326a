"""Answers of the participant to questions about arrivals, and to those of which nothing is understood."""

from dataclasses import replace

import numpy as np

from dorothie_gym.dialogue import Predicate
from dorothie_gym.ontology import DialogueAct, DialogueMove, LandmarkName, Role, StreetName
from dorothie_gym.policies.participant.dialogue_update import listen
from tests.policies.said import with_words
from tests.policies.test_repairs import Human

M = DialogueMove


def hears(human: Human, text: str, move: DialogueMove, *, standing: bool = False) -> None:
    human.observation["speed"] = np.array([0.0 if standing else 8.0])
    raw = with_words(human.observation, Role.CO_WIZARD, text, DialogueAct.of(move))
    listen(human.state, replace(human.view, raw=raw), human.rng)


def test_question_whether_it_is_there_right_after_an_errand_is_about_that_errand():
    human = Human()
    human.state.task = human.state.task.after_finishing(LandmarkName.SHELL, human.view.time - 2.0)
    hears(human, "is this it?", M.QUERY_YN, standing=True)
    (answer,) = human.state.speech.queue
    assert answer.act.move is M.REPLY_Y
    (said,) = answer.meaning
    assert said.predicate is Predicate.ARRIVED and said.get("place") is LandmarkName.SHELL


def test_errand_of_long_ago_is_not_what_the_question_means():
    human = Human()
    human.state.task = human.state.task.after_finishing(LandmarkName.SHELL, human.view.time - 60.0)
    hears(human, "is this it?", M.QUERY_YN, standing=True)
    assert M.REPLY_N in human.moves()


def test_open_question_of_which_nothing_is_understood_is_asked_back_once():
    human = Human()
    hears(human, "what alice is them", M.QUERY_W)
    assert human.moves() == [M.CONFUSE]
    (asked_back,) = human.state.speech.queue
    human.state.speech = replace(human.state.speech.cleared(), last=asked_back)
    hears(human, "what alice is them", M.QUERY_W)
    assert human.moves()[0] is M.REPLY_W


def test_wrong_street_is_corrected_even_if_the_place_was_misheard():
    for right in (False, True):
        human = Human()
        goal = human.state.task.destination
        others = (name for name in StreetName if name not in (goal.street, StreetName.UNKNOWN, StreetName.QUERIED))
        street = goal.street if right else next(others)
        raw = with_words(human.observation, Role.CO_WIZARD, "did you mean that", DialogueAct.of(M.CHECK, street))
        listen(human.state, replace(human.view, raw=raw), human.rng)
        assert (human.moves()[0] is M.CONFIRM) is right
