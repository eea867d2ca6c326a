from dataclasses import replace

import numpy as np
import pytest

from dorothie_gym.dialogue import Direction, Predicate, Proposition, understand, word_act
from dorothie_gym.maps.town import LightColour
from dorothie_gym.ontology import ActionValue, DialogueAct, DialogueMove, ObjectClass, PhysicalAction, Role, Slot
from dorothie_gym.policies.co_wizard.answers import answer_open
from dorothie_gym.policies.co_wizard.driving import drive, end_red_light_rest, rest
from dorothie_gym.policies.co_wizard.instructed_actions import OBEYED, do_stop
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.sim.state.codes import Motion
from tests.policies.test_co_wizard import Talk

M = DialogueMove

DRIVING = {"motion": np.int64(Motion.DRIVING), "hazard": np.int64(0), "speed": np.full(1, 8.0)}


def on_the_way() -> Talk:
    talk = Talk()
    talk.state = replace(talk.state, style=replace(talk.state.style, mishears=0.0, checks=0.0, careful=1.0))
    talk.say(M.INSTRUCT, talk.landmarks(hidden=False)[0].name, decisions=6)
    assert talk.state.beliefs.exact
    talk.state.speech = talk.state.speech.cleared()
    return talk


def view_of(talk: Talk, **changes) -> CoWizardView:
    return CoWizardView.read({**talk.observations["co_wizard"], **changes}, talk.env.town)


def answer(talk: Talk, view: CoWizardView, *values) -> DialogueAct:
    act = DialogueAct.of(M.QUERY_W, *values)
    answer_open(talk.state, view, act, understand(""), np.random.default_rng(0))
    return talk.state.speech.queue[0].act


def test_standstill_is_explained_by_hazard():
    talk = on_the_way()
    hazard = {"motion": np.int64(Motion.HAZARD), "hazard": np.int64(ObjectClass.PEDESTRIAN.value), "speed": np.zeros(1)}
    assert answer(talk, view_of(talk, **hazard), ActionValue.STOP).slots == {ObjectClass.PEDESTRIAN}


def test_stop_for_red_light_is_remembered_as_reason():
    talk = on_the_way()
    red = Proposition.of(Predicate.RED, object=ObjectClass.TRAFFIC_LIGHT)
    since = view_of(talk).time - 9.0
    talk.state.standstill = replace(talk.state.standstill, since=since).with_reason(red, since)
    stopped = view_of(talk, motion=np.int64(Motion.STOPPED), speed=np.zeros(1))
    assert answer(talk, stopped, ActionValue.STOP).slots == {ObjectClass.TRAFFIC_LIGHT}


def test_reason_for_a_stop_is_told_in_the_past_when_the_car_drives_again():
    talk = on_the_way()
    red, now = Proposition.of(Predicate.RED, object=ObjectClass.TRAFFIC_LIGHT), view_of(talk).time
    stood = replace(talk.state.standstill, since=None, until=now - 5.0)
    talk.state.standstill = stood.with_reason(red, now - 12.0)
    driving = view_of(talk, **DRIVING)
    assert answer(talk, driving, ActionValue.STOP).slots == {ObjectClass.TRAFFIC_LIGHT}
    reply = talk.state.speech.queue[0]
    (because,) = reply.meaning
    assert because.predicate is Predicate.BECAUSE and because.get("cause") == red
    assert because.get("at") == round(now - 12.0), "when the reason held"
    text = word_act(reply.act, Role.CO_WIZARD, np.random.default_rng(0), reply.wording)
    assert "was red" in text.lower()


def where_it_was_sent(talk: Talk) -> CoWizardView:
    """Lets the car stand where it was told to drive on to, with a goal that is not on its map."""
    talk.state.beliefs = talk.state.beliefs.without_place()
    talk.state.intentions = talk.state.intentions.stopped_at_place(arrived=True, sent_on=True)
    talk.state.standstill = replace(talk.state.standstill, since=0.0)
    return view_of(talk, motion=np.int64(Motion.STOPPED), speed=np.zeros(1))


def test_car_that_went_as_far_as_told_does_not_claim_that_it_has_arrived():
    talk = on_the_way()
    stopped = where_it_was_sent(talk)
    answer(talk, stopped, ActionValue.STOP)
    reply = talk.state.speech.queue[0]
    (because,) = reply.meaning
    assert because.get("cause") == Proposition.of(Predicate.TOLD, action=ActionValue.LANE_FOLLOW)
    texts = [word_act(reply.act, Role.CO_WIZARD, np.random.default_rng(k), reply.wording) for k in range(6)]
    assert all("far" in text for text in texts), texts


@pytest.mark.parametrize(("text", "predicate"), [("we're here", Predicate.ARRIVED), ("stop here", Predicate.TOLD)])
def test_reason_for_an_instructed_stop_is_what_was_said(text: str, predicate: Predicate):
    talk = on_the_way()
    do_stop(talk.state, view_of(talk, **DRIVING), DialogueAct.of(M.INSTRUCT, ActionValue.STOP), understand(text))
    talk.state.standstill = replace(talk.state.standstill, since=view_of(talk).time)
    answer(talk, view_of(talk, motion=np.int64(Motion.STOPPED), speed=np.zeros(1)), ActionValue.STOP)
    (because,) = talk.state.speech.queue[0].meaning
    cause = because.get("cause")
    assert isinstance(cause, Proposition) and cause.predicate is predicate


def test_car_that_waits_for_the_way_asks_again_when_it_is_told_to_start():
    talk = on_the_way()
    talk.state.dialogue = talk.state.dialogue.after_asking_way(7, view_of(talk).time)
    waiting = view_of(talk, motion=np.int64(Motion.WAITING), speed=np.zeros(1))
    OBEYED[ActionValue.START](talk.state, waiting, DialogueAct.of(M.INSTRUCT, ActionValue.START), understand("go"))
    assert talk.state.dialogue.asked_lane == -1


@pytest.mark.parametrize(("text", "crosses"), [("drive on for nine meters", True), ("go two meters further", False)])
def test_car_crosses_the_junction_before_it_when_it_is_told_to_go_farther_than_that(text: str, crosses: bool):
    talk = on_the_way()
    view = view_of(talk, speed=np.zeros(1))
    assert view.choice is not None and 3.0 < view.choice.distance < 8.0
    talk.state.intentions = talk.state.intentions.directed(None).halting()
    act = DialogueAct.of(M.INSTRUCT, ActionValue.LANE_FOLLOW)
    OBEYED[ActionValue.LANE_FOLLOW](talk.state, view, act, understand(text))
    directive = talk.state.intentions.directive
    assert (directive is not None and directive.direction is Direction.STRAIGHT) is crosses
    assert (talk.state.intentions.nudge is None) is crosses
    assert not talk.state.intentions.halted


def test_stop_long_ago_is_not_explained_by_its_reason():
    talk = on_the_way()
    red, now = Proposition.of(Predicate.RED, object=ObjectClass.TRAFFIC_LIGHT), view_of(talk).time
    stood = replace(talk.state.standstill, since=None, until=now - 300.0)
    talk.state.standstill = stood.with_reason(red, now - 310.0)
    answer(talk, view_of(talk, **DRIVING), ActionValue.STOP)
    (said,) = talk.state.speech.queue[0].meaning
    assert said == Proposition.of(Predicate.STANDS, action=ActionValue.STOP, negated=True)


def test_u_turn_is_explained_by_goal():
    talk = on_the_way()
    assert talk.state.beliefs.goal in answer(talk, view_of(talk), ActionValue.U_TURN).slots


def test_question_about_objects_names_objects_in_sight():
    talk = on_the_way()
    view = view_of(talk)
    reply = answer(talk, view, ObjectClass.QUERIED)
    seen = {thing.kind for thing in view.objects} or {ObjectClass.ROAD}
    assert reply.move is M.REPLY_W and set(reply.values(Slot.OBJECT)) <= seen


def test_question_about_plan_names_turns_or_streets():
    talk = on_the_way()
    reply = answer(talk, view_of(talk), ActionValue.QUERIED)
    assert reply.move is M.REPLY_W
    assert reply.values(Slot.ACTION) or reply.values(Slot.STREET)


@pytest.mark.parametrize("colour", [LightColour.RED, LightColour.GREEN])
def test_car_rests_at_red_light_until_green(colour):
    talk = on_the_way()
    town = talk.env.town
    lit = [lane for lane in town.lanes if town.light(lane.id, 0.0) is not None]
    begin = int(view_of(talk).time) + 5  # by then the driver has reacted to what it was told
    times = range(begin, begin + 200)
    lane, time = next((lane, time) for time in times for lane in lit if town.light(lane.id, float(time)) is colour)
    talk.state.standstill = replace(talk.state.standstill, since=time - 3.0)
    talk.state.route = talk.state.route.with_progress(None)
    talk.state.intentions = talk.state.intentions.directed(None)
    at_light = {
        "motion": np.int64(Motion.HAZARD),
        "hazard": np.int64(ObjectClass.TRAFFIC_LIGHT.value),
        "speed": np.zeros(1),
        "time": np.array([float(time)]),
        "lane": np.int64(lane.id),
        "station": np.array([lane.length - 4.0]),
        "exits": np.zeros_like(talk.observations["co_wizard"]["exits"]),
    }
    view = view_of(talk, **at_light)
    rest(talk.state, view, np.random.default_rng(0))
    assert talk.state.commands.rest_until == time + talk.state.config.red_light_time
    end_red_light_rest(talk.state, view)
    red = colour is LightColour.RED
    assert (talk.state.commands.rest_until > time) is red
    done = drive(talk.state, view)
    assert (done is not None and done.action is PhysicalAction.STOP) is red
