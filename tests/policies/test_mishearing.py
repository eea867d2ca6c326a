"""Misheard words are noticed and repaired."""

from dataclasses import replace

import numpy as np
import pytest

from dorothie_gym.dialogue import AsrChannel, Wording, understand
from dorothie_gym.ontology import (
    ActionValue,
    DialogueAct,
    DialogueMove,
    GoalStatus,
    LandmarkName,
    ObjectClass,
    PhysicalAction,
    Role,
)
from dorothie_gym.policies.co_wizard.repairs import check_goal, expects_stop, note_contradiction
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.policies.participant.dialogue_update import listen
from dorothie_gym.policies.speech import IN_A_ROW, remark
from dorothie_gym.session.spaces import Speech
from tests.policies.said import with_words
from tests.policies.test_co_wizard import Talk
from tests.policies.test_repairs import Human

M = DialogueMove


def says(talk: Talk, move: DialogueMove, text: str, *values, decisions: int = 8) -> None:
    talk.step(Speech(act=DialogueAct.of(move, *values), text=text))
    for _ in range(decisions):
        talk.step()


def test_words_without_sense_are_asked_for_again() -> None:
    talk = Talk()
    says(talk, M.IRRELEVANT, "slot to")
    assert M.CONFUSE in talk.moves()


def test_first_words_without_sense_are_asked_for_again_however_long() -> None:
    talk = Talk()
    says(talk, M.IRRELEVANT, "take me to the tea jack first", decisions=14)
    assert M.CONFUSE in talk.moves()


def test_small_talk_on_the_way_is_no_reason_to_ask() -> None:
    talk = Talk()
    says(talk, M.INSTRUCT, "to that place", talk.landmarks(hidden=False)[0].name, decisions=6)
    says(talk, M.IRRELEVANT, "we used to come here every summer when I was little")
    assert M.CONFUSE not in talk.moves()


def test_inaudible_words_are_asked_for_once_and_then_narrowed() -> None:
    talk = Talk()
    says(talk, M.INSTRUCT, "to that place", talk.landmarks(hidden=False)[0].name, decisions=6)
    for _ in range(3):
        says(talk, M.EXPLAIN, "it's better if we ... road", decisions=14)
    assert talk.moves()[-2:] == [M.CONFUSE, M.CHECK], "asked once, narrowed once, and left"


def test_inaudible_words_are_asked_for_again_after_a_silence() -> None:
    talk = Talk()
    says(talk, M.INSTRUCT, "to that place", talk.landmarks(hidden=False)[0].name, decisions=6)
    speech = replace(talk.state.speech, asked_back=2, last_end=40.0)
    assert not speech.may_ask_back(now=40.0 + IN_A_ROW - 0.1)
    assert speech.may_ask_back(now=40.0 + IN_A_ROW)
    talk.state.speech = replace(talk.state.speech, asked_back=2, last_end=-IN_A_ROW)
    says(talk, M.EXPLAIN, "it's better if we ... road", decisions=14)
    assert talk.moves().count(M.CONFUSE) == 1 and talk.state.speech.asked_back == 1


def test_stop_is_obeyed_although_the_rest_is_inaudible() -> None:
    talk = Talk()
    says(talk, M.INSTRUCT, "stop ...", ActionValue.STOP, decisions=4)
    assert M.CONFUSE not in talk.moves()


def test_participant_asks_for_inaudible_words() -> None:
    human = Human()
    human.observation = with_words(human.observation, Role.CO_WIZARD, "... not going ...", DialogueAct(M.EXPLAIN))
    listen(human.state, human.view, human.rng)
    assert human.moves() == [M.CONFUSE]


def test_question_that_was_not_understood_is_asked_again() -> None:
    human = Human()
    question = remark(M.QUERY_YN, ObjectClass.VEHICLES)
    human.state.speech = replace(human.state.speech, last=question, said=(question,), last_end=human.view.time)
    human.hears(M.CONFUSE)
    assert human.moves()[0] is M.QUERY_YN


@pytest.mark.parametrize(("hidden", "stops"), [(True, True), (False, False)])
def test_only_a_guided_car_takes_a_shout_without_sense_for_a_stop(hidden: bool, stops: bool) -> None:
    talk = Talk()
    says(talk, M.INSTRUCT, "to that place", talk.landmarks(hidden=hidden)[0].name, decisions=6)
    assert talk.state.beliefs.exact is not hidden
    driving = replace(CoWizardView.read(talk.observations["co_wizard"], talk.env.town), speed=8.0)
    assert expects_stop(talk.state, driving, understand("soup right here")) is stops
    assert not expects_stop(talk.state, replace(driving, speed=0.0), understand("soup right here"))


def test_destination_that_instructions_contradict_is_checked() -> None:
    talk = Talk()
    place = talk.landmarks(hidden=False)[0].name
    says(talk, M.INSTRUCT, "to that place", place, decisions=6)
    view, state = CoWizardView.read(talk.observations["co_wizard"], talk.env.town), talk.state
    assert state.route.progress is not None and not state.route.progress.turns_round_first(state.town, view.station)
    state.speech = state.speech.cleared()
    checked = []
    for _ in range(state.config.contradictions):
        assert not checked
        note_contradiction(state, view, ActionValue.U_TURN, understand("turn around"))
        check_goal(state, view)
        checked = [item.act for item in state.speech.queue]
    assert checked == [DialogueAct.of(M.CHECK, place)]


def test_errand_that_is_revived_is_corrected() -> None:
    human = Human()
    dropped = human.another_place()
    given_up = remark(M.INSTRUCT, dropped, GoalStatus.ABANDONED)
    human.state.speech = replace(human.state.speech, said=(given_up,))
    human.hears(M.ACKNOWLEDGE, dropped)
    clarified = [item.act for item in human.state.speech.queue if item.act.move is M.CLARIFY]
    assert human.state.task.goal is not None
    assert clarified and human.state.task.goal.name in clarified[0].slots


def test_errand_that_is_given_up_in_turn_is_not_corrected() -> None:
    human = Human()
    dropped = human.another_place()
    human.state.speech = replace(human.state.speech, said=(remark(M.INSTRUCT, dropped, GoalStatus.ABANDONED),))
    human.hears(M.ACKNOWLEDGE, dropped, GoalStatus.ABANDONED)
    assert M.CLARIFY not in human.moves()


def test_stop_that_was_not_understood_is_repeated_as_it_was() -> None:
    human = Human()
    stop = remark(M.INSTRUCT, ActionValue.STOP)
    human.state.speech = replace(human.state.speech, last=stop, said=(stop,), last_end=human.view.time)
    human.hears(M.CONFUSE)
    assert human.state.speech.queue[0].act == stop.act


def test_place_that_is_mentioned_to_an_idle_car_is_checked() -> None:
    talk = Talk()
    place = next(mark.name for mark in talk.landmarks(hidden=False) if mark.name is not LandmarkName.UNKNOWN)
    says(talk, M.EXPLAIN, "text is that place", place)
    assert talk.state.beliefs.goal is place and M.CHECK in talk.moves()


def test_car_stops_for_an_indirect_command() -> None:
    talk = Talk()
    for _ in range(4):
        talk.step()
    talk.say(M.EXPLAIN, ActionValue.STOP, wording=Wording(), decisions=4)
    assert PhysicalAction.STOP in talk.physical()


def test_rare_words_are_misheard_more_often() -> None:
    channel, rng = AsrChannel(rate=0.1), np.random.default_rng(0)
    lost = {word: sum(channel.transcribe(word, rng) != word for _ in range(600)) for word in ("turquoise", "please")}
    assert lost["turquoise"] > 1.2 * lost["please"]
