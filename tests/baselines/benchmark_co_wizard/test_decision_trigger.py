"""Triggers of decisions."""

from __future__ import annotations

from typing import Any

from dorothie_gym.baselines.benchmark_co_wizard.decision_trigger import DecisionTrigger, TriggerState
from dorothie_gym.ontology import ObjectClass, PhysicalAction
from dorothie_gym.policies.route_progress import Choice
from dorothie_gym.sim.state.codes import Motion
from tests.baselines.benchmark_co_wizard.observed import town, view

NOTHING, BOTH, DRIVES = DecisionTrigger(), DecisionTrigger(speaks=True, drives=True), DecisionTrigger(drives=True)


def junction(distance: float) -> Choice:
    """A crossing that far ahead [m]."""
    lane = next(lane.id for lane in town().lanes if len(town().exits(lane.id)) > 2)
    return Choice(lane=lane, distance=distance, exits=town().exits(lane))


def decided(*moments: dict[str, Any], heard: tuple[int, ...] = ()) -> list[DecisionTrigger]:
    """Returns the triggers at observations half a second apart, by default far from any junction."""
    watch, found = TriggerState(), []
    for number, changes in enumerate(moments):
        usual = {"time": 0.5 * number, "choice": None, "motion": Motion.DRIVING, "manoeuvre": None}
        occasion, watch = watch.look(view(**{**usual, **changes}), number in heard)
        found.append(occasion)
    return found


def test_no_decision_is_triggered_on_the_open_road():
    assert decided({}, {"choice": junction(120.0)}, {"choice": junction(41.0)}) == [NOTHING] * 3


def test_words_are_answered_and_acted_upon():
    assert decided({}, {}, {}, heard=(1,)) == [NOTHING, BOTH, NOTHING]


def test_a_junction_without_a_turn_is_decided_upon_once():
    near = [{"choice": junction(distance)} for distance in (45.0, 39.0, 33.0)]
    assert decided(*near) == [NOTHING, BOTH, NOTHING]
    turning = {"manoeuvre": PhysicalAction.J_TURN}
    assert decided(*({**moment, **turning} for moment in near)) == [NOTHING] * 3


def test_words_close_to_a_junction_are_about_it():
    assert decided({"choice": junction(30.0)}, {"choice": junction(25.0)}, heard=(0,)) == [BOTH, NOTHING]


def test_car_waiting_at_a_junction_decides_again():
    waits = {"choice": junction(1.0), "motion": Motion.WAITING}
    found = decided(*[waits] * 22)
    assert [number for number, occasion in enumerate(found) if occasion == BOTH] == [0, 20]


def test_a_hazard_is_decided_upon_when_it_begins_and_when_it_ends():
    hazard = {"hazard": ObjectClass.VEHICLES, "motion": Motion.HAZARD}
    assert decided({}, hazard, hazard, {}, {}) == [NOTHING, DRIVES, NOTHING, DRIVES, NOTHING]


def test_car_stopped_for_a_hazard_decides_again_without_braking():
    hazard, stands = {"hazard": ObjectClass.TRAFFIC_LIGHT, "motion": Motion.HAZARD}, {"motion": Motion.STOPPED}
    found = decided({}, hazard, *[stands] * 10)
    assert [number for number, occasion in enumerate(found) if occasion == DRIVES] == [1, 9]


def test_car_reaching_the_last_named_place_decides_once():
    watch, drives = TriggerState(), []
    for way in (60.0, 20.0, 12.0, 6.0, 1.0, None):  # at 6 m/s Stop takes about 9 m
        occasion, watch = watch.look(view(speed=6.0, choice=None, motion=Motion.DRIVING, manoeuvre=None), False, way)
        drives.append(occasion == DRIVES)
    assert drives == [False, False, True, False, False, False]


def test_nobody_stands_for_ever():
    found = decided({"motion": Motion.STOPPED}, *[{"motion": Motion.STOPPED}] * 41, heard=(1,))
    assert [number for number, occasion in enumerate(found) if occasion.drives] == [0, 1, 21, 41]


def test_navigation_decision_is_postponed_during_a_u_turn():
    turns = {"manoeuvre": PhysicalAction.U_TURN}
    assert decided(turns, turns, {}, {}, heard=(1,)) == [NOTHING, DecisionTrigger(speaks=True), DRIVES, NOTHING]
