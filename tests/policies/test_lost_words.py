"""What is lost by mishearing is asked for: nobody agrees to words that make no order, question or name."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dorothie_gym.dialogue import understand
from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.ontology import ActionValue, DialogueAct, DialogueMove, LandmarkName, ObjectClass, Role
from dorothie_gym.ontology.world_exceptions import WeatherParameter
from dorothie_gym.policies.co_wizard.acknowledgement import acknowledge
from dorothie_gym.policies.co_wizard.errand_memory import note_friend
from dorothie_gym.policies.co_wizard.proposals import probable_way
from dorothie_gym.policies.co_wizard.small_remarks import sign_of_statement
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.policies.heard_utterance import HeardUtterance
from dorothie_gym.policies.notable_conditions import JUST_HEARD, Noticed, notice
from dorothie_gym.policies.observation_parser import street_of
from dorothie_gym.policies.participant.answer_parts import addition
from dorothie_gym.policies.participant.dialogue_update import listen
from dorothie_gym.policies.participant.unprompted_remarks import _knows_how_far
from tests.policies.co_wizard.rides import Ride
from tests.policies.participant.test_answers import hears
from tests.policies.said import with_words
from tests.policies.test_repairs import Human

M, A = DialogueMove, ActionValue
PEOPLE = ObjectClass.PEDESTRIAN


def answers(words: str, before: str = "take me to the Shell") -> list[DialogueMove]:
    """What the car says to some words while it drives."""
    ride = Ride(4)
    ride.say(before, seconds=6.0)
    ride.said.clear()
    ride.say(words, seconds=4.0)
    return ride.moves


# --- the car ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("words", ["we-turn", "go up to fairly-five", "speed up to five"])
def test_an_order_whose_content_was_lost_is_asked_for(words: str) -> None:
    assert answers(words)[:1] == [M.CONFUSE]


@pytest.mark.parametrize("words", ["turn left", "take the second right", "speed up to fifty", "slow down to five"])
def test_an_order_that_is_whole_is_not_asked_for(words: str) -> None:
    assert M.CONFUSE not in answers(words)


def driver(seed: int = 4) -> tuple[Ride, CoWizardView]:
    ride = Ride(seed)
    ride.run(2.0)
    return ride, CoWizardView.read(ride.observations["co_wizard"], ride.env.town)


def words_of(ride: Ride, view: CoWizardView, action: ActionValue, text: str) -> list[M]:
    state, rng = ride.state.next_decision()
    state.style = replace(state.style, echoes=1.0, checks=0.0)
    state.speech = state.speech.cleared()
    acknowledge(state, view, action, understand(text), rng, answers=False)
    return [item.act.move for item in state.speech.queue if item.act.slots]


def test_what_comes_later_is_not_said_to_be_done_now() -> None:
    ride, view = driver()
    assert not words_of(ride, replace(view, speed=0.0), A.SPEED_CHANGE, "slow down to twenty")
    assert words_of(ride, replace(view, speed=9.0), A.SPEED_CHANGE, "slow down to twenty")
    assert not words_of(ride, view, A.J_TURN, "take the third right")
    assert words_of(ride, view, A.J_TURN, "turn right")


def test_a_way_is_proposed_only_for_a_reason() -> None:
    ride, view = driver()
    state, choice = ride.state, view.choice
    assert choice is not None
    state.beliefs = replace(state.beliefs, streets=())
    assert probable_way(state, view, choice) is None
    for way in choice.exits:
        street = street_of(view.raw, state.town, way.lane)
        state.beliefs = replace(state.beliefs, streets=(street,))
        found = probable_way(state, view, choice)
        assert found is None or street_of(view.raw, state.town, found.lane) is street


@pytest.mark.parametrize(("text", "friend"), [("my friend Tunde on Baits", "Tunde"), ("my friend And on Baits", None)])
def test_a_particle_is_nobodys_name(text: str, friend: str | None) -> None:
    ride, _ = driver()
    act = DialogueAct.of(M.INSTRUCT, LandmarkName.PERSON)
    note_friend(ride.state, HeardUtterance(acts=(act,), words=understand(text)))
    assert ride.state.beliefs.friend == friend


def test_an_apology_is_no_news() -> None:
    apology = sign_of_statement(understand("sorry, I keep sending you back and forth"), sees=True)
    assert apology.wording.topic == "ordered"
    assert sign_of_statement(understand("she has two suitcases"), sees=True).wording.topic == "told"


def test_who_shall_say_when_is_not_asked_for_the_way() -> None:
    ride, _ = driver()
    ride.say("keep going for now, I'll tell you when", seconds=6.0)
    assert ride.state.dialogue.sent_on_at > 0.0
    ride.say("turn left", seconds=4.0)
    assert ride.state.dialogue.sent_on_at < 0.0


# --- both -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("text", ["there are so people here", "lots of pedestrians now"])
def test_a_remark_on_a_crowd_is_recognised_by_its_object(text: str) -> None:
    assert [kind for kind, _ in Noticed().after_hearing(understand(text), 5.0).crowds] == [PEOPLE]


def test_a_question_or_an_order_is_no_remark_on_a_crowd() -> None:
    for text in ("do you see that pedestrian?", "stop for the pedestrian"):
        assert not Noticed().after_hearing(understand(text), 5.0).crowds


def test_nobody_repeats_at_once_what_the_other_has_said_of_the_weather() -> None:
    clouds = WeatherParameter.CLOUDINESS
    weather = np.array([{WeatherParameter.SUN_ALTITUDE_ANGLE: 60.0}.get(each, 0.0) for each in WeatherParameter])
    noticed = Noticed().with_change(clouds, high=True).after_hearing(understand("the clouds are"), 20.0)
    for time, silent in ((22.0, True), (22.0 + JUST_HEARD, False)):
        seen = {"weather": weather, "time": np.array([time])}
        said, _ = notice(noticed, seen, (), np.random.default_rng(0), chance=1.0, handled=())
        assert (said is None) is silent


# --- the participant --------------------------------------------------------------------------------------------------


def is_asked(human: Human, text: str, asked: ActionValue | LandmarkName) -> None:
    raw = with_words(human.observation, Role.CO_WIZARD, text, DialogueAct.of(M.CHECK, asked))
    listen(human.state, replace(human.view, raw=raw), human.rng)


def test_a_speed_that_was_not_asked_for_is_denied_with_the_place() -> None:
    human = Human()
    is_asked(human, "so you want me to go faster, right?", A.SPEED_CHANGE)
    assert human.moves() == [M.REPLY_N, M.INSTRUCT]


def test_a_choice_is_not_answered_with_yes() -> None:
    human = Human()
    is_asked(human, "do you mean before or after the Panera?", LandmarkName.PANERA)
    (said,) = human.state.speech.queue
    assert said.act.move is M.INSTRUCT and human.state.task.destination.name in said.act.slots


def test_nothing_is_added_about_a_place_that_was_not_named() -> None:
    human = Human()
    human.state.style = replace(human.state.style, reasons=1.0)
    human.state.set_guiding(True)
    for announced in (True, False):
        human.state.task = replace(human.state.task, announced=announced)
        found = [addition(human.state, human.view, np.random.default_rng(seed)) for seed in range(20)]
        assert any(found) is announced


def test_a_car_that_knows_the_way_is_not_guided() -> None:
    for text, guided in (("yes, I know where it is", False), ("it's not on my map", True)):
        human = Human()
        human.state.task = replace(human.state.task, described=False)
        human.state.set_guiding(True)
        hears(human, text, M.REPLY_Y)
        assert human.state.guidance.guiding is guided


def test_the_time_that_was_just_told_is_not_asked_for() -> None:
    human = Human()
    human.state.task = replace(human.state.task, announced_at=human.view.time - 100.0)
    assert not _knows_how_far(human.state, human.view)
    hears(human, "about a minute and a half", M.EXPLAIN)
    assert _knows_how_far(human.state, human.view)


def test_a_question_for_the_way_before_the_place_was_named_is_answered_with_the_place() -> None:
    human = Human()
    human.state.task = replace(human.state.task, announced=False)
    is_asked(human, "left?", A.J_TURN)
    (said,) = human.state.speech.queue
    assert human.state.task.destination.name in said.act.slots
    assert Direction.LEFT is not said.wording.direction
