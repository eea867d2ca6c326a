"""What the Co-Wizard says of orders: that they were carried out before, or that something holds it up."""

from dataclasses import replace

import numpy as np
import pytest

from dorothie_gym.dialogue import Predicate, guess_spans, understand
from dorothie_gym.maps.model import LinkType
from dorothie_gym.ontology import (
    ActionValue,
    DialogueAct,
    DialogueMove,
    LandmarkName,
    ObjectClass,
    PhysicalAction,
    StreetName,
)
from dorothie_gym.policies.co_wizard.acknowledgement import what_keeps
from dorothie_gym.policies.co_wizard.answers import answer_yes_no, asks_to_act
from dorothie_gym.policies.co_wizard.destinations import (
    aim,
    believed_destination,
    is_on_another_street,
    search_on,
    seek_street,
)
from dorothie_gym.policies.co_wizard.driving import drive
from dorothie_gym.policies.co_wizard.instructed_actions import OBEYED
from dorothie_gym.policies.co_wizard.intentions import Wish
from dorothie_gym.policies.co_wizard.plan_acceptance import take_plan
from dorothie_gym.policies.co_wizard.repairs import hear_wrong_way
from dorothie_gym.policies.co_wizard.repetition import note_order
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.policies.feasibility import can_switch_lane
from dorothie_gym.policies.heard_utterance import HeardUtterance
from dorothie_gym.policies.observation_parser import street_of
from dorothie_gym.sim.state.codes import Motion
from tests.policies.co_wizard.rides import Ride
from tests.policies.test_co_wizard import Talk
from tests.policies.test_reasons import DRIVING, on_the_way, view_of

A, M = ActionValue, DialogueMove


def remarks(talk: Talk) -> list[Predicate]:
    return [said.predicate for item in talk.state.speech.queue for said in item.meaning]


def order_u_turns(talk: Talk, *, carried_out: bool) -> list[Predicate]:
    """Orders three U-turns in a minute, to which the car commands one; it carries them out, or has no room."""
    for time in (100.0, 120.0, 140.0):
        note_order(talk.state, replace(view_of(talk, **DRIVING), time=time), A.U_TURN)
        talk.state.commands = talk.state.commands.after_manoeuvre(time + 1.0)
        if carried_out:
            talk.state.commands = talk.state.commands.manoeuvring(time + 2.0)
    return remarks(talk)


def test_third_order_is_remarked_on_if_the_others_were_carried_out():
    talk = on_the_way()
    talk.state.speech = talk.state.speech.cleared()
    assert order_u_turns(talk, carried_out=True)[:1] == [Predicate.TRIED]


def test_orders_that_the_car_could_not_carry_out_are_not_said_to_have_been():
    talk = on_the_way()
    talk.state.speech = talk.state.speech.cleared()
    assert Predicate.TRIED not in order_u_turns(talk, carried_out=False)


def test_lane_change_that_found_no_room_is_wanted_until_it_begins():
    ride = Ride(3, town="midtown")
    ride.run(3.0)
    state, town = ride.state, ride.env.town
    lane = next(lane.id for lane in town.lanes if can_switch_lane(town, lane.id, 5.0, LinkType.LANE_CHANGE_RIGHT))
    view = CoWizardView.read({**ride.observations["co_wizard"], **DRIVING}, town)
    view = replace(view, lane=lane, station=5.0, manoeuvre=None, choice=None)
    state.intentions = state.intentions.switching(Wish.SWITCH_RIGHT, 1e3)
    for number in range(3):
        command = drive(state, replace(view, time=50.0 + number))
        assert command is not None and command.action is PhysicalAction.LANE_SWITCH
    drive(state, replace(view, time=54.0, manoeuvre=PhysicalAction.LANE_SWITCH))
    assert state.intentions.wish is None


@pytest.mark.parametrize(
    ("hazard", "action", "says"),
    [
        (ObjectClass.VEHICLES, A.LANE_FOLLOW, True),
        (ObjectClass.STATIC, A.U_TURN, True),
        (ObjectClass.VEHICLES, A.STOP, False),
        (ObjectClass.TRAFFIC_LIGHT, A.J_TURN, False),
    ],
)
def test_car_that_is_held_up_says_by_what_when_it_is_told_to_drive_on(hazard, action, says):
    talk = on_the_way()
    view = replace(view_of(talk, **DRIVING), speed=0.0, motion=Motion.HAZARD, hazard=hazard)
    reason = what_keeps(talk.state, view, action)
    assert (reason is not None) is says
    if reason is not None:
        assert reason.meaning[0].predicate is Predicate.BECAUSE and hazard in reason.act.slots
        assert what_keeps(talk.state, view, action) is None, "it was just said"
    moving = replace(view, speed=5.0)
    assert what_keeps(talk.state, moving, action) is None


def test_wrong_way_is_checked_once_and_then_the_place_is_given_up():
    talk = on_the_way()
    asked = []
    for _ in range(2 * talk.state.config.contradictions):
        talk.state.speech = talk.state.speech.cleared()
        hear_wrong_way(talk.state, view_of(talk, **DRIVING))
        asked.append(M.CHECK in [item.act.move for item in talk.state.speech.queue])
    assert asked == [True, False, False, False]
    assert not talk.state.beliefs.exact, "the place of that name may be another one"


def test_house_is_checked_with_its_street():
    talk = on_the_way()
    view = view_of(talk, **DRIVING)
    house = next(mark for mark in view.landmarks if mark.name in (LandmarkName.HOUSE, LandmarkName.PERSON))
    aim(talk.state, view, house)
    assert believed_destination(talk.state, view).get("street") is house.street
    shop = next(mark for mark in view.landmarks if mark.name not in (LandmarkName.HOUSE, LandmarkName.PERSON))
    aim(talk.state, view, shop)
    assert believed_destination(talk.state, view).get("street") is None


def test_car_drives_to_its_destination_from_the_street_that_it_was_sent_to():
    talk = on_the_way()
    view, town = view_of(talk, **DRIVING), talk.env.town
    goal = talk.state.beliefs.stop_place
    streets = {street_of(view.raw, town, lane.id) for lane in town.lanes if not lane.in_junction}
    own = {street_of(view.raw, town, view.lane), street_of(view.raw, town, goal[0])}
    sought = next(
        street for street in sorted(streets - own, key=lambda name: name.value) if seek_street(talk.state, view, street)
    )
    way = talk.state.route.to_goal
    assert way.goal != goal and street_of(view.raw, town, way.goal[0]) is sought
    search_on(talk.state, view)
    assert talk.state.route.to_goal.goal == way.goal, "not there yet"
    lane, station = way.goal
    there = replace(view, lane=lane, station=station)
    talk.state.route = talk.state.route.with_progress(way.replanned(town, there.here))
    search_on(talk.state, there)
    assert talk.state.route.to_goal.goal == goal


def test_plan_that_leads_away_from_the_route_makes_the_car_check_its_destination():
    talk = on_the_way()
    view = view_of(talk, **DRIVING)
    assert not talk.state.route.to_goal.turns_round_first(talk.env.town, view.station)
    route, checks = talk.state.route, []
    for _ in range(talk.state.config.contradictions):
        talk.state.speech, talk.state.route = talk.state.speech.cleared(), route
        acts = (DialogueAct.of(M.INSTRUCT, A.U_TURN), DialogueAct.of(M.INSTRUCT, A.J_TURN))
        said = HeardUtterance(acts=acts, words=understand("turn around, and then take the second left"))
        take_plan(talk.state, view, said, np.random.default_rng(0))
        checks.append(M.CHECK in [item.act.move for item in talk.state.speech.queue])
    assert checks == [False, True]


def test_correction_of_the_street_of_a_house_is_taken_over():
    talk = on_the_way()
    view = view_of(talk, **DRIVING)
    house = next(mark for mark in view.landmarks if mark.name is LandmarkName.HOUSE)
    aim(talk.state, view, house)
    other = next(name for name in StreetName if name not in (house.street, StreetName.UNKNOWN, StreetName.QUERIED))
    assert is_on_another_street(talk.state, view, (other,))
    assert not is_on_another_street(talk.state, view, (house.street, other))
    assert not is_on_another_street(talk.state, view, ())


@pytest.mark.parametrize(
    ("words", "move"),
    [
        ("could aw please stop here?", "obeys"),
        ("cone you diego the next road to the right?", "asks back"),
        ("are you turning left?", "answers"),
        ("will it stop raining?", "answers"),
    ],
)
def test_misheard_request_is_not_answered_by_a_bare_no(words, move):
    talk = on_the_way()
    talk.state.speech = talk.state.speech.cleared()
    view, act = view_of(talk, **DRIVING), guess_spans(words)[0].act
    act = DialogueAct(M.QUERY_YN, act.slots)  # the words may also be taken for an order at once
    assert asks_to_act(act, understand(words)) is (move == "obeys")
    answer_yes_no(talk.state, view, act, understand(words), np.random.default_rng(0))
    refuses = [item.act.move for item in talk.state.speech.queue] == [M.REPLY_N]
    assert not refuses or move == "answers"


@pytest.mark.parametrize(("known", "nudges"), [(True, False), (False, True)])
def test_a_bit_further_is_no_order_to_a_car_that_waits_in_the_traffic_of_its_own_way(known, nudges):
    talk = on_the_way()
    view = replace(view_of(talk, **DRIVING), speed=0.0, choice=None)
    if not known:
        talk.state.beliefs = talk.state.beliefs.without_place()
    OBEYED[A.LANE_FOLLOW](talk.state, view, DialogueAct.of(M.INSTRUCT, A.LANE_FOLLOW), understand("a bit further"))
    assert (talk.state.intentions.nudge is not None) is nudges


def test_end_of_a_small_distance_far_from_the_destination_is_no_arrival():
    talk = on_the_way()
    view = view_of(talk, **DRIVING)
    talk.state.intentions = talk.state.intentions.nudged((view.lane, view.station + 0.2))
    stop = drive(talk.state, replace(view, speed=0.5))
    assert stop is not None and stop.action is PhysicalAction.STOP
    assert not talk.state.intentions.arrived and talk.state.intentions.halted


def test_house_that_the_car_is_guided_to_is_not_taken_for_another_one_on_its_map():
    talk = on_the_way()
    talk.state.beliefs = talk.state.beliefs.with_unknown_goal(LandmarkName.HOUSE)
    assert any(mark.name is LandmarkName.HOUSE for mark in view_of(talk, **DRIVING).landmarks)
    talk.say(M.INSTRUCT, LandmarkName.HOUSE, decisions=6)
    assert talk.state.beliefs.goal is LandmarkName.HOUSE and not talk.state.beliefs.exact
