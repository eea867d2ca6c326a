"""Repairs end: neither side asks for the same thing in the same way again."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

from dorothie_gym.dialogue import Direction, Wording, WordingContext, guess_spans, word_act, word_acts
from dorothie_gym.dialogue.conversation import resembles_request_to_repeat
from dorothie_gym.maps.catalogue import load_town
from dorothie_gym.ontology import ActionValue, DialogueAct, DialogueMove, LandmarkName, Role
from dorothie_gym.policies.participant.contradictory_orders import own_up
from dorothie_gym.policies.participant.dialogue_update import listen
from dorothie_gym.policies.participant.state import NUDGED, GuidanceState
from dorothie_gym.policies.route_progress import RouteProgress
from dorothie_gym.policies.route_state import WORN_OUT, RouteState, section
from dorothie_gym.policies.speech import SpeechState, remark
from tests.policies.said import with_words
from tests.policies.test_co_wizard import Talk
from tests.policies.test_mishearing import says
from tests.policies.test_repairs import Human

M, A = DialogueMove, ActionValue


def after(human: Human, *moves: DialogueMove) -> None:
    """Lets the participant have just said acts with these moves."""
    said = tuple(remark(move) for move in moves)
    speech = human.state.speech
    for item in said:
        _, speech = replace(speech, queue=(item,), quiet_until=0.0).speak(human.view.time, 0.0, human.rng)
    human.state.speech = replace(speech, queue=(), quiet_until=0.0)


# --- the Co-Wizard ----------------------------------------------------------------------------------------------------


def test_second_failure_is_narrowed_and_the_third_stops_the_car():
    talk = Talk()
    says(talk, M.INSTRUCT, "to that place", talk.landmarks(hidden=True)[0].name, decisions=10)
    talk.actions.clear()
    for _ in range(3):
        talk.state.speech = replace(talk.state.speech, other=M.INSTRUCT)
        says(talk, M.INSTRUCT, "slot tee", decisions=10)
    asked = [action.speech for action in talk.actions if action.speech]
    moves = [speech.act.move for speech in asked]
    assert moves.count(M.CONFUSE) == 1, [speech.text for speech in asked]
    texts = [speech.text for speech in asked]
    assert len(set(texts)) == len(texts), "no turn in the same words"


def test_what_is_not_answered_by_what():
    talk = Talk()
    says(talk, M.IRRELEVANT, "slot to")
    assert M.CONFUSE in talk.moves()
    talk.actions.clear()
    says(talk, M.CONFUSE, "what?")
    assert talk.moves() and M.CONFUSE not in talk.moves()


def test_garbled_what_is_taken_for_one():
    assert resembles_request_to_repeat("calm again?") and resembles_request_to_repeat("sorry, one more time?")
    assert not resembles_request_to_repeat("left at the next corner")
    talk = Talk()
    says(talk, M.INSTRUCT, "to that place", talk.landmarks(hidden=False)[0].name, decisions=10)
    talk.actions.clear()
    talk.state.speech = replace(talk.state.speech, last_end=talk.state.speech.last_end + 60.0)  # it has just spoken
    says(talk, M.QUERY_YN, "cold you pardon?", decisions=4)
    assert M.CONFUSE not in talk.moves()


def test_misheard_request_is_not_refused():
    talk = Talk()
    says(talk, M.INSTRUCT, "to that place", talk.landmarks(hidden=False)[0].name, decisions=6)
    talk.actions.clear()
    says(talk, M.QUERY_YN, "could you grow strayed?")
    assert talk.moves() and M.REPLY_N not in talk.moves()


# --- the participant --------------------------------------------------------------------------------------------------


def test_participant_repeats_once_then_takes_another_way_then_leaves_it():
    human = Human()
    after(human, M.QUERY_YN)
    human.hears(M.CONFUSE)
    assert human.moves()[0] is M.QUERY_YN, "repeated"
    human.state.speech = replace(human.state.speech.cleared(), repairs=1)
    human.hears(M.CONFUSE)
    assert human.moves() and human.moves()[0] not in (M.QUERY_YN, M.CONFUSE), "another way"
    human.state.speech = replace(human.state.speech.cleared(), repairs=2)
    human.hears(M.CONFUSE)
    assert not human.moves(), "left to the car"


def test_participant_says_where_to_go_instead_of_asking_twice():
    human = Human()
    human.observation = with_words(human.observation, Role.CO_WIZARD, "watch is teh slot?", DialogueAct(M.QUERY_W))
    listen(human.state, human.view, human.rng)
    assert human.moves() == [M.CONFUSE]
    after(human, M.CONFUSE)
    listen(human.state, human.view, human.rng)
    assert human.moves() and M.CONFUSE not in human.moves()


def test_asking_back_is_allowed_once_in_a_repair_and_not_in_reply():
    speech = SpeechState(role=Role.PARTICIPANT)
    assert speech.may_ask_back(10.0)
    assert not replace(speech, other=M.CONFUSE).may_ask_back(10.0)
    asked = replace(speech, asked_back=1, last_end=10.0)
    assert not asked.may_ask_back(12.0) and asked.may_ask_back(40.0)


@pytest.mark.parametrize("move", [M.CONFUSE, M.QUERY_W, M.INSTRUCT])
def test_words_just_said_are_not_said_again(move):
    rng = np.random.default_rng(3)
    speech = SpeechState(role=Role.PARTICIPANT)
    act = remark(move) if move is M.CONFUSE else remark(move, A.QUERIED if move is M.QUERY_W else A.U_TURN)
    texts: list[str] = []
    for number in range(40):
        said, speech = replace(speech, queue=(act,), quiet_until=0.0, last_end=0.0).speak(20.0 * number, 0.0, rng)
        texts.append(said.text.lower())
    assert not any(one == two for one, two in itertools.pairwise(texts)), texts


# --- plans that did not work ------------------------------------------------------------------------------------------


def test_small_distances_count_until_the_car_has_moved():
    guidance = GuidanceState()
    for left in (20.0, 19.0, 18.4):
        guidance = guidance.after_nudging(10.0, left)
    assert guidance.nudges == 3, "the car has hardly moved"
    assert guidance.after_nudging(20.0, 20.0 - NUDGED - 1.0).nudges == 1


def test_section_that_was_driven_twice_is_spared():
    town = load_town("midtown")
    start, goal = (0, 1.0), (40, 5.0)
    state = RouteState(progress=RouteProgress.plan(town, start, goal))
    ends = {section(town, start[0]), section(town, goal[0])}
    inner = [leg.lane for leg in state.to_goal.legs if not town.lanes[leg.lane].in_junction]
    again = next(lane for lane in inner if section(town, lane) not in ends)
    elsewhere = next(
        lane.id for lane in town.lanes if not lane.in_junction and lane.road_id != town.lanes[again].road_id
    )
    for _ in range(WORN_OUT - 1):
        state = state.entering(town, again).entering(town, elsewhere)
    once = state.replanned(town, start)
    assert any(section(town, leg.lane) == section(town, again) for leg in once.to_goal.legs)
    twice = state.entering(town, again).replanned(town, start)
    assert twice.to_goal.legs
    assert not any(section(town, leg.lane) == section(town, again) for leg in twice.to_goal.legs)
    assert not twice.for_new_goal().worn, "another errand may use it"


def turn(direction: Direction):
    return remark(M.INSTRUCT, A.J_TURN, wording=Wording(direction=direction))


def test_contrary_order_is_given_with_a_word_of_why():
    human = Human()
    human.state.speech = replace(human.state.speech, said=(turn(Direction.LEFT),), last_end=human.view.time - 2.0)
    human.state.say(turn(Direction.RIGHT))
    own_up(human.state, human.view)
    assert human.moves() == [M.EXPLAIN, M.INSTRUCT]
    assert human.state.speech.queue[0].wording.topic == "changed_mind" and human.state.speech.queue[1].joined
    human.state.speech = replace(human.state.speech.cleared(), queue=(turn(Direction.LEFT),))
    own_up(human.state, human.view)
    assert human.moves() == [M.INSTRUCT], "the same order again"


def test_excuse_and_order_are_understood_together():
    for words in ("sorry, change of plan, turn left", "sorry, scratch that, take the next left"):
        acts = [span.act for span in guess_spans(words)]
        assert any(act.move is M.INSTRUCT and A.J_TURN in act.slots for act in acts), words


# --- names ------------------------------------------------------------------------------------------------------------


def test_destination_is_always_named_by_its_owner():
    rng, act = np.random.default_rng(1), DialogueAct.of(M.INSTRUCT, LandmarkName.HOUSE)
    scene = WordingContext(owner="Mateo")
    texts = [word_acts([act], Role.PARTICIPANT, rng, scene=scene)[0].text for _ in range(60)]
    assert all("Mateo" in text for text in texts)


def test_person_is_a_friend_or_a_passenger_in_orders_and_a_name_otherwise():
    rng, act = np.random.default_rng(1), DialogueAct.of(M.INSTRUCT, LandmarkName.PERSON)
    aunt = WordingContext(passenger="Aunt Mei")
    texts = [word_acts([act], Role.PARTICIPANT, rng, scene=aunt)[0].text for _ in range(20)]
    assert all("our passenger Aunt Mei" in text for text in texts)
    assert all(LandmarkName.PERSON in guess_spans(text)[0].act.slots for text in texts)
    both = WordingContext(passenger="Priya", friend="Priya")
    assert all("my friend Priya" in word_acts([act], Role.PARTICIPANT, rng, scene=both)[0].text for _ in range(20))
    picked = Wording(topic="pick_up")
    assert all("pick up Priya" in word_act(act, Role.PARTICIPANT, rng, picked, scene=both) for _ in range(20))
