"""Plans are confirmed, corrected, and answered with a reason and an offer where the map contradicts them."""

from __future__ import annotations

from typing import Any

import pytest

from dorothie_gym.dialogue import Predicate
from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.dialogue.nlu import understand
from dorothie_gym.ontology import (
    ActionValue,
    DialogueAct,
    DialogueMove,
    LandmarkName,
    ObjectClass,
    Slot,
    StreetName,
)
from dorothie_gym.policies.co_wizard.plan_acceptance import planned_acts, take_plan
from dorothie_gym.policies.co_wizard.state import CoWizardState
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.policies.heard_utterance import HeardUtterance
from dorothie_gym.policies.policy import replace
from tests.policies.co_wizard.rides import Ride

Step = dict[str, Any]
RING = 4


def turn(direction: str, **more: Any) -> Step:
    return {"action": "turn", "direction": direction, **more}


def at(relation: str, **place: Any) -> Step:
    return {"relation": relation, "place": place}


def heard(*steps: Step, seed: int = RING, text: str = "as I say", seconds: float = 6.0) -> Ride:
    ride = Ride(seed)
    ride.run(2.0)
    ride.order(*steps, text=text)
    ride.run(seconds)
    return ride


def test_plan_is_confirmed_in_words_with_its_meaning() -> None:
    ride = heard(turn("left", ordinal=2), turn("right", condition=at("after", object="TrafficLight")), seconds=3.0)
    said = ride.said[0]
    assert said.act.move is DialogueMove.CONFIRM
    assert "the second left, then right after" in said.text.lower()
    assert said.act.values(Slot.OBJECT) == (ObjectClass.TRAFFIC_LIGHT,)
    assert [content.predicate for content in said.meaning] == [Predicate.WILL] * 2


def test_missing_turn_is_answered_with_the_reason_and_a_question() -> None:
    ride = heard(turn("right"))
    assert [speech.act.move for speech in ride.said[:2]] == [DialogueMove.EXPLAIN, DialogueMove.QUERY_W]
    assert ride.said[0].meaning[0].predicate is Predicate.POSSIBLE and ride.said[0].meaning[0].negated
    assert not ride.state.plan.steps


def test_steps_before_a_contradiction_are_kept() -> None:
    ride = Ride(RING)
    ride.run(2.0)
    ride.order(turn("left"), turn("left", ordinal=9))
    assert len(ride.state.plan.steps) == 1
    ride.run(5.0)
    assert DialogueMove.CONFIRM in ride.moves and DialogueMove.EXPLAIN in ride.moves


def test_landmark_on_another_road_is_offered() -> None:
    ride = Ride(RING)
    ride.run(2.0)
    marks = ride.marks()
    away = next(name for name, place in marks.items() if ride.road.distance_to(*place) is None)
    ride.order(turn("left", condition=at("at", landmark=away.label)))
    ride.run(5.0)
    assert ride.moves[:2] == [DialogueMove.EXPLAIN, DialogueMove.QUERY_YN]
    assert ride.said[0].meaning[0].predicate in (Predicate.LOCATED, Predicate.BEHIND)
    ride.say("yes please", seconds=4.0)
    assert ride.state.beliefs.goal is away and ride.state.beliefs.exact


def test_landmark_that_is_not_on_the_map_is_said_to_be_unknown() -> None:
    ride = Ride(RING)
    shown = set(ride.marks())
    hidden = next(name for name in LandmarkName if name not in shown and name.label not in ("Unknown", "Queried"))
    ride.order(turn("left", condition=at("at", landmark=hidden.label)))
    ride.run(5.0)
    assert ride.said[0].meaning[0].predicate is Predicate.KNOWS and ride.said[0].meaning[0].negated
    assert ride.moves[1] is DialogueMove.INSTRUCT  # "tell me when we're there"


def test_street_that_does_not_cross_is_offered_and_looked_for() -> None:
    ride = Ride(2)
    ride.run(2.0)
    lanes, names = ride.env.town.lanes, ride.env.scenario.street_names
    onto = {names[lanes[way.lane].street] for crossing in ride.road.crossings for way in crossing.exits}
    onto.add(names[lanes[ride.here[0]].street])
    away = next(name for name in names if name not in onto)
    ride.order(turn("left", condition=at("at", street=away.label)))
    ride.run(5.0)
    assert ride.moves[:2] == [DialogueMove.EXPLAIN, DialogueMove.QUERY_YN]
    ride.say("yes", seconds=4.0)
    progress = ride.state.route.progress
    assert progress is not None and names[lanes[progress.goal[0]].street] is away


def test_speed_above_the_limit_is_answered_with_the_limit() -> None:
    ride = heard({"action": "speed", "speed": 120}, seconds=5.0)
    limit = round(3.6 * ride.env.town.lanes[ride.here[0]].speed_limit)
    stated = [content for speech in ride.said for content in speech.meaning if content.get("limit") is True]
    assert stated and stated[0].get("speed") == limit


def test_then_continues_a_plan() -> None:
    ride = heard(turn("left", ordinal=2), turn("right"), seconds=1.0)
    ride.order(turn("left"), text="and then left")
    assert [step.direction for step in ride.state.plan.steps] == ["left", "right", "left"]


def test_new_plan_replaces_the_old_one() -> None:
    ride = heard(turn("left", ordinal=2), turn("right"), seconds=1.0)
    ride.order(turn("left"), turn("left"))
    assert [step.direction for step in ride.state.plan.steps] == ["left", "left"]


def test_turn_that_repairs_corrects_the_present_step() -> None:
    ride = Ride(2)
    ride.order(turn("left", ordinal=1, condition=at("after", ordinal=1)), turn("left"))
    ride.say("no, not left, turn right", seconds=6.0)
    assert [step.direction for step in ride.state.plan.steps] == ["right", "left"]
    ride.run(80.0)
    assert "right" in ride.turns()


def test_other_turn_replaces_the_plan() -> None:
    ride = heard(turn("left", ordinal=3), turn("right"), seconds=1.0)
    ride.say("turn right at the next junction", seconds=5.0)
    assert not ride.state.plan.steps


def test_new_destination_ends_a_plan() -> None:
    ride = heard(turn("left", ordinal=3), turn("right"), seconds=1.0)
    ride.say("let's go to the KFC", seconds=5.0)
    assert ride.state.beliefs.goal is LandmarkName.KFC and not ride.state.plan.steps


@pytest.mark.parametrize("words", ["Could you pull over?", "could you stop here please", "can you turn around"])
def test_request_in_the_form_of_a_question_is_obeyed(words: str) -> None:
    ride = Ride(RING)
    ride.run(6.0)
    ride.say(words, seconds=12.0)
    done = ride.state.intentions.halted or ride.state.dialogue.u_turn_instructed_at > 0.0
    assert done and ride.said
    bare = [speech for speech in ride.said if speech.act.move is DialogueMove.REPLY_N and not speech.act.slots]
    assert not bare


def test_questions_are_asked_by_name_of_the_next_step() -> None:
    ride = heard(turn("left", ordinal=3), turn("right"), seconds=3.0)
    ride.said.clear()
    ride.say("what's the next turn?", seconds=5.0)
    assert ride.said[0].act.move is DialogueMove.REPLY_W
    assert "third left" in ride.said[0].text or "second left" in ride.said[0].text
    assert ActionValue.J_TURN in ride.said[0].act.values(Slot.ACTION)


@pytest.mark.parametrize("words", ["could you pull in and let me out?", "I want to get out here, please"])
def test_stop_on_request_is_announced(words: str) -> None:
    ride = Ride(RING)
    ride.run(5.0)
    ride.said.clear()
    ride.say(words, seconds=10.0)
    assert ride.speed < 0.1
    assert any(ActionValue.STOP in speech.act.values(Slot.ACTION) for speech in ride.said)
    assert not ride.env.town.lanes[ride.here[0]].in_junction


def test_car_told_to_stop_in_a_junction_stops_behind_it() -> None:
    ride = Ride(RING)
    ride.order(turn("left", ordinal=2))
    lanes = ride.env.town.lanes
    while not lanes[ride.here[0]].in_junction:
        ride.step()
    ride.order({"action": "stop"})
    ride.run(12.0)
    assert ride.speed < 0.1 and not lanes[ride.here[0]].in_junction


def test_car_drives_back_to_the_start() -> None:
    ride = Ride(RING)
    begin = ride.position
    ride.run(10.0)
    ride.order({"action": "visit", "place": {"reference": "start"}})
    for _ in range(500):
        ride.step()
        if ride.state.intentions.arrived:
            break
    assert ((ride.position[0] - begin[0]) ** 2 + (ride.position[1] - begin[1]) ** 2) ** 0.5 < 15.0


def test_way_back_begins_with_a_turn_and_adds_nothing_to_a_destination() -> None:
    back: Step = {"action": "follow", "place": {"reference": "way_we_came"}}
    turned = heard(back)
    assert any(speech.act.values(Slot.ACTION) == (ActionValue.U_TURN,) for speech in turned.said), turned.words
    driven = heard({"action": "visit", "place": {"landmark": "House"}}, back)
    assert all(ActionValue.U_TURN not in speech.act.values(Slot.ACTION) for speech in driven.said), driven.words
    assert driven.said


def test_greeting_with_a_question_is_answered() -> None:
    ride = Ride(RING)
    ride.run(5.0)
    ride.said.clear()
    ride.say("hello, how are you?", seconds=5.0)
    assert DialogueMove.REPLY_W in ride.moves and DialogueMove.CONFUSE not in ride.moves


def acts_of_plan(state: CoWizardState, text: str, *acts: DialogueAct) -> frozenset[int]:
    return planned_acts(state, HeardUtterance(acts=acts, words=understand(text)))


def test_single_orders_and_destinations_are_no_plans() -> None:
    state = Ride(RING).state
    for text, *values in (
        ("turn left", ActionValue.J_TURN),
        ("stop here", ActionValue.STOP),
        ("take me to the house on Hubbard", LandmarkName.HOUSE, StreetName.HUBBARD),
    ):
        assert not acts_of_plan(state, text, DialogueAct.of(DialogueMove.INSTRUCT, *values)), text


def test_yes_and_question_are_no_plans() -> None:
    state = Ride(RING).state
    assert not acts_of_plan(state, "yes, go ahead", DialogueAct.of(DialogueMove.REPLY_Y))
    assert not acts_of_plan(state, "may I ask why we drive so slowly?", DialogueAct.of(DialogueMove.QUERY_W))


def test_guidance_to_a_place_off_the_map_is_left_to_single_orders() -> None:
    order = DialogueAct.of(DialogueMove.INSTRUCT, ActionValue.LANE_FOLLOW)
    state = Ride(RING).state
    assert acts_of_plan(state, "left at the KFC, then right", order)
    guided = replace(state, beliefs=state.beliefs.with_unknown_goal(LandmarkName.HOUSE))
    assert not acts_of_plan(guided, "go straight for sixty meters", order)
    assert acts_of_plan(guided, "left at the KFC, then right", order)


def test_wait_until_a_place_goes_on_to_it() -> None:
    ride = heard({"action": "wait", "condition": at("until", landmark="KFC")}, turn("left", ordinal=1), seconds=50.0)
    assert ride.turns()[-1] == "left" and not ride.state.plan.steps


def test_place_without_a_name_on_the_map_is_declined_with_a_question() -> None:
    ride = Ride(RING)
    ride.say("take me to the airport please", seconds=6.0)
    assert ride.moves[:2] == [DialogueMove.EXPLAIN, DialogueMove.QUERY_W]
    assert ride.said[0].meaning[0].predicate is Predicate.KNOWS and ride.said[0].meaning[0].negated


@pytest.mark.parametrize(
    ("words", "first"),
    [
        ("go ahead and take the second left, then stop at the lights", "left"),
        ("Yo, go ahead and turn left, then take the second right", "left"),
        ("go straight ahead, then take the second left", "straight"),
    ],
)
def test_go_ahead_and_opens_an_order_and_is_none(words: str, first: str) -> None:
    ride = Ride(RING)
    ride.run(2.0)
    updated, rng = ride.state.next_decision()
    view = CoWizardView.read(ride.observations["co_wizard"], ride.env.town)
    acts = (DialogueAct.of(DialogueMove.INSTRUCT),)
    take_plan(updated, view, HeardUtterance(acts=acts, words=understand(words)), rng)
    meant = [content for item in updated.speech.queue for content in item.meaning]
    said = meant[0].get("action") if meant else None
    assert said is (ActionValue.LANE_FOLLOW if first == "straight" else ActionValue.J_TURN)


def test_added_errand_waits_behind_the_present_one() -> None:
    ride = Ride(2)
    first, second = (name for name in sorted(ride.marks(), key=lambda name: name.value)[:2])
    ride.say(f"take me to {first.label}")
    ride.say(f"oh and {second.label} after that")
    visited = [step.place.landmark for step in ride.state.plan.steps if step.place is not None]
    assert ride.state.beliefs.goal is first and visited == [first, second]
    ride.say(f"no, forget {second.label}")
    assert ride.state.beliefs.goal is first


@pytest.mark.parametrize("words", ["left side please", "on the left"])
def test_side_told_afterwards_belongs_to_the_stop(words: str) -> None:
    ride = Ride(RING)
    ride.order({"action": "stop", "condition": {"relation": "before", "place": {"object": "TrafficLight"}}})
    ride.say(words, seconds=4.0)
    present = ride.state.plan.present
    assert present is not None and present.condition is not None and present.side is Direction.LEFT


def test_permission_to_go_on_moves_a_car_that_waits() -> None:
    ride = Ride(RING)
    ride.say("stop here please", seconds=10.0)
    assert ride.speed < 0.5
    ride.say("okay got it you can go on", seconds=8.0)
    assert ride.speed > 2.0


def test_instructions_in_words_are_never_misheard_on_purpose() -> None:
    """Faults of hearing are acted where acts are observed, and there only."""
    asked = []
    for seed in range(12):
        ride = Ride(seed)
        ride.say("turn left please", seconds=5.0)
        asked += [speech.act.move for speech in ride.said]
    assert DialogueMove.CONFUSE not in asked


def test_change_to_a_missing_lane_is_refused_and_the_plan_stays() -> None:
    ride = Ride(RING)
    ride.order(turn("left", ordinal=2), turn("right"))
    planned = ride.state.plan.steps
    ride.order({"action": "lane", "direction": "left"}, text="get over to the left")
    assert ride.state.plan.steps == planned != ()
    ride.run(6.0)
    refused = [content for speech in ride.said for content in speech.meaning if content.predicate is Predicate.POSSIBLE]
    assert any(content.negated for content in refused)


def test_slowness_asked_for_on_the_way_back_to_a_place_lasts_while_the_car_turns_round() -> None:
    ride = Ride(RING)
    ride.state.intentions = ride.state.intentions.with_asked_speed(15, 30, 50.0)
    before = ride.state.intentions.slow_until
    ride.say("make a u-turn", seconds=20.0)
    assert ride.state.intentions.slow_until > before
