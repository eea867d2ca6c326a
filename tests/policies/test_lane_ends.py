"""What the speakers make of a lane that ends, and how fast the car drives without being asked."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dorothie_gym.dialogue import Predicate, Proposition, Wording, word_act
from dorothie_gym.dialogue.dialogue_act_classifier import guess_spans
from dorothie_gym.dialogue.intentions import CommunicativeFunction as Function
from dorothie_gym.maps import load_town
from dorothie_gym.maps.town import Town
from dorothie_gym.ontology import ActionValue, DialogueMove, ObjectClass, Role, Slot
from dorothie_gym.policies.co_wizard.intentions import Intentions
from dorothie_gym.policies.co_wizard.proposition_truth import LANE_ENDS, reason_to_be_slow, reason_to_stand
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.policies.route_progress import default_lane_distance, lanes_ahead, next_choice
from dorothie_gym.policies.scripted_agent_limits import reach_at, usual_cruise
from dorothie_gym.policies.speech import intend
from dorothie_gym.sim.state.codes import Motion
from tests.maps.ending_lanes import ring
from tests.policies.test_reasons import on_the_way


@pytest.fixture
def tapers(tmp_path: Path) -> Town:
    return load_town(ring(tmp_path / "tapers.xodr"))


def ending(town: Town) -> int:
    return next(lane.id for lane in town.lanes if town.merge(lane.id) is not None)


def test_car_that_waits_to_leave_a_lane_gives_the_end_of_the_lane_as_reason(tapers: Town) -> None:
    talk, lane = on_the_way(), tapers.lanes[ending(tapers)]
    known = replace(talk.state.knowledge, town=tapers, halted=False, arrived=False)

    def seen(**changes: object) -> CoWizardView:
        observation = talk.observations["co_wizard"]
        nothing = {name: np.zeros_like(observation[name]) for name in ("exits", "landmarks", "guesses")}
        return CoWizardView.read({**observation, **nothing, **changes}, tapers)

    waiting = {"motion": np.int64(Motion.HAZARD), "hazard": np.int64(ObjectClass.VEHICLES.value), "speed": np.zeros(1)}
    here = {"lane": np.int64(lane.id), "station": np.full(1, lane.length - 30.0)}
    assert reason_to_stand(known, seen(**waiting, **here)) == LANE_ENDS
    assert reason_to_be_slow(known, seen(**waiting, **here)) == LANE_ENDS
    far = {"lane": np.int64(lane.id), "station": np.full(1, 10.0)}
    hinders = Proposition.of(Predicate.HINDERS, object=ObjectClass.VEHICLES)
    assert reason_to_stand(known, seen(**waiting, **far)) == hinders
    walker = {**waiting, "hazard": np.int64(ObjectClass.PEDESTRIAN.value)}
    assert reason_to_stand(known, seen(**walker, **here)).get("object") is ObjectClass.PEDESTRIAN


def test_lanes_ahead_lead_over_to_the_lane_beside(tapers: Town) -> None:
    lane = ending(tapers)
    beside = tapers.neighbour(lane, tapers.merge(lane))
    station = tapers.lanes[lane].length - 40.0
    assert lanes_ahead(tapers, lane, station, 80.0)[:2] == (lane, beside)
    place = tapers.lanes[beside].project(tapers.lanes[lane].position(station + 30.0))[0]
    distance = default_lane_distance(tapers, (lane, station), (beside, place), 80.0)
    assert distance == pytest.approx(30.0, abs=2.0)
    assert next_choice(tapers, lane, station) is None


def test_usual_speed_is_that_of_the_town_or_the_limit(tapers: Town) -> None:
    assert usual_cruise(load_town("northgate"), 0) == 40
    assert usual_cruise(load_town("northgate"), 0, pace=35) == 35
    assert usual_cruise(tapers, 0) == 50
    assert usual_cruise(tapers, 0, pace=35) == 45
    assert usual_cruise(tapers, 0, pace=45) == 50


def test_guidance_begins_earlier_only_at_speeds_that_slow_towns_do_not_have(tapers: Town) -> None:
    brookside = load_town("brookside")
    assert reach_at(110.0, 20.0, brookside) == 110.0
    assert reach_at(110.0, 8.0, tapers) == 110.0
    assert reach_at(110.0, 20.0, tapers) == pytest.approx(198.0)


def test_limit_has_no_effect_on_a_speed_that_was_asked_for() -> None:
    free = Intentions(speed=50, usual=50)
    assert free.on_lane(90).speed == 90
    assert free.with_asked_speed(60, 25, 0.0).on_lane(90).speed == 60
    slow = free.with_asked_speed(20, 25, 40.0).on_lane(90)
    assert (slow.speed, slow.usual) == (20, 90)


def test_end_of_a_lane_is_worded_as_a_cause_and_as_a_reason_for_a_switch() -> None:
    because = Proposition.of(Predicate.BECAUSE, effect=Proposition.of(Predicate.STANDS), cause=LANE_ENDS)
    answer = intend(Function.ANSWER, because, elided=("effect",), wording=Wording(topic="because"))
    reason = intend(Function.INFORM, LANE_ENDS, elided=("action",), wording=Wording(topic="lane_ends"))
    for seed in range(6):
        rng = np.random.default_rng(seed)
        assert "lane" in word_act(answer.act, Role.CO_WIZARD, rng, answer.wording).lower()
        assert "end" in word_act(reason.act, Role.PARTICIPANT, rng, reason.wording).lower()


def test_request_to_leave_a_lane_that_ends_is_understood() -> None:
    spans = guess_spans("get over to the left, this lane ends")
    assert [span.act.move for span in spans] == [DialogueMove.INSTRUCT, DialogueMove.EXPLAIN]
    assert spans[0].act.values(Slot.ACTION) == (ActionValue.LANE_SWITCH,)
