"""The Co-Wizard carries the steps of a plan out in order, each at its place."""

from __future__ import annotations

import math
import pickle
from typing import Any

import pytest

from dorothie_gym.dialogue import DrivingPlan
from dorothie_gym.ontology import LandmarkName, ObjectClass
from dorothie_gym.policies.co_wizard.view import CoWizardView
from tests.policies.co_wizard.rides import Ride

Step = dict[str, Any]
RING = 4
"""Seed of a session in brookside that begins on the ring road: junctions to the left, the first with lights."""


def turn(direction: str, **more: Any) -> Step:
    return {"action": "turn", "direction": direction, **more}


def at(relation: str, **place: Any) -> Step:
    return {"relation": relation, "place": place}


def driven(seed: int, *steps: Step, seconds: float = 90.0) -> Ride:
    ride = Ride(seed)
    ride.run(2.0)
    ride.order(*steps)
    ride.run(seconds)
    return ride


def ahead_of(ride: Ride, name: LandmarkName) -> float:
    """Returns how far a landmark lies ahead of the car along its heading [m]."""
    x, y = ride.marks()[name]
    _, _, heading = ride.observations["participant"]["pose"]
    return (x - ride.position[0]) * math.cos(heading) + (y - ride.position[1]) * math.sin(heading)


@pytest.mark.parametrize(
    ("steps", "turns"),
    [
        ([turn("left", ordinal=2), turn("right")], ["straight", "left", "right"]),
        ([{"action": "straight", "ordinal": 2}, turn("left")], ["straight", "straight", "left"]),
        ([turn("left", condition=at("after", object="TrafficLight"))], ["straight", "left"]),
        ([turn("left", condition=at("at", object="TrafficLight")), turn("left")], ["left", "left"]),
        ([turn("left", condition=at("after", ordinal=2))], ["straight", "straight", "left"]),
    ],
    ids=["ordinals", "straight", "after lights", "at lights", "after junctions"],
)
def test_steps_are_driven_in_order(steps: list[Step], turns: list[str]) -> None:
    ride = driven(RING, *steps)
    assert ride.turns()[: len(turns)] == turns
    assert not ride.state.plan.steps


def test_turn_waits_for_its_landmark() -> None:
    ride = Ride(RING)
    name = LandmarkName.PANERA
    distance = ride.road.distance_to(*ride.marks()[name])
    nearest = min(ride.road.crossings, key=lambda crossing: abs(crossing.distance + 12.0 - (distance or 0.0)))
    before = ride.road.crossings.index(nearest)
    ride.order(turn("left", condition=at("at", landmark=name.label)))
    ride.run(90.0)
    assert before > 1
    assert ride.turns() == ["straight"] * before + ["left"]


@pytest.mark.parametrize(("relation", "low", "high"), [("at", -12, 12), ("past", -35, 0), ("before", 0, 30)])
def test_car_stops_relative_to_landmark(relation: str, low: float, high: float) -> None:
    ride = driven(RING, {"action": "stop", "condition": at(relation, landmark="KFC"), "side": "right"}, seconds=60.0)
    assert ride.speed < 0.1
    assert low <= ahead_of(ride, LandmarkName.KFC) <= high
    assert "right-hand side" in ride.words


def test_plan_goes_on_after_a_stop_of_its_own() -> None:
    ride = driven(RING, {"action": "stop", "condition": at("at", landmark="KFC")}, turn("left"), seconds=60.0)
    assert ride.speed < 0.1 and len(ride.state.plan.steps) == 1
    ride.say("okay, drive on", seconds=40.0)
    assert ride.turns()[-1] == "left" and not ride.state.plan.steps


def test_interrupted_plan_is_continued() -> None:
    ride = driven(RING, turn("left", ordinal=3), seconds=8.0)
    ride.say("stop here", seconds=12.0)
    assert ride.speed < 0.1 and ride.state.plan.steps
    ride.say("drive on", seconds=70.0)
    assert ride.turns()[:3] == ["straight", "straight", "left"]


def test_u_turn_waits_for_its_place_and_plan_goes_on() -> None:
    ride = driven(2, {"action": "u_turn", "condition": at("seen", landmark="Shell")}, turn("left"), seconds=140.0)
    heading = [ride.env.town.lanes[lane].heading_at(station) for lane, station in ride.lanes]
    assert any(math.cos(later - now) < -0.9 for now, later in zip(heading, heading[16:], strict=False))
    assert ride.turns()[-1] == "left"


def test_speed_and_lights_wait_for_their_place() -> None:
    slower: Step = {"action": "speed", "change": "slower", "condition": at("before", object="TrafficLight")}
    faster: Step = {"action": "speed", "change": "faster", "condition": at("after", object="TrafficLight")}
    ride = Ride(RING)
    ride.order(slower, faster, {"action": "lights", "change": "on"})
    cruise = [float(ride.observations["co_wizard"]["cruise_speed"][0])]
    for _ in range(100):
        ride.step()
        cruise.append(float(ride.observations["co_wizard"]["cruise_speed"][0]))
    assert min(cruise) <= cruise[0] - 8.0 and cruise[-1] >= cruise[0] - 3.0
    assert int(ride.observations["co_wizard"]["lights"]) == 1


def test_step_at_sight_of_an_object_waits_for_it() -> None:
    ride = Ride(RING)
    ride.order({"action": "stop", "condition": at("seen", object="Vehicles")})
    sightings = []
    for _ in range(120):
        view = CoWizardView.read(ride.observations["co_wizard"], ride.env.town)
        sightings += [thing.distance < 40.0 for thing in view.objects if thing.kind is ObjectClass.VEHICLES]
        ride.step()
        if ride.state.intentions.halted:
            break
    assert ride.state.intentions.halted and any(sightings)


def test_what_is_everywhere_is_not_waited_for() -> None:
    ride = Ride(RING)
    ride.order({"action": "stop", "condition": at("seen", object="SideWalk")})
    for _ in range(40):
        ride.step()
    assert ride.state.intentions.halted and ride.speed < 0.5


def test_errands_are_visited_in_the_order_of_the_plan() -> None:
    ride = Ride(2)
    first, second = (name for name in sorted(ride.marks(), key=lambda name: name.value)[:2])
    ride.order(*({"action": "visit", "place": {"landmark": name.label}} for name in (second, first)))
    assert ride.state.beliefs.goal is second
    ride.run(2.0)
    x, y = ride.marks()[second]
    for _ in range(400):
        ride.step()
        if ride.state.intentions.arrived:
            break
    assert math.hypot(ride.position[0] - x, ride.position[1] - y) < 45.0
    ride.say("all done here", seconds=6.0)
    assert ride.state.beliefs.goal is first


def test_route_keeps_off_a_street() -> None:
    ride = Ride(2)
    ride.run(2.0)
    lanes, names = ride.env.town.lanes, ride.env.scenario.street_names
    place = max(ride.marks(), key=lambda name: math.dist(ride.marks()[name], ride.position))
    ride.order(
        {"action": "visit", "place": {"landmark": place.label}}, {"action": "visit", "place": {"landmark": place.label}}
    )
    legs = ride.state.route.to_goal.legs
    here = lanes[legs[0].lane].street
    crossed = {lanes[leg.lane].street for leg in legs[1:-1] if not lanes[leg.lane].in_junction} - {here, -1}
    last = lanes[legs[-1].lane].street
    avoided = next(iter(sorted(crossed - {last})))
    ride.order({"action": "avoid", "place": {"street": names[avoided].label}})
    ride.run(6.0)
    then = {lanes[leg.lane].street for leg in ride.state.route.to_goal.legs if not lanes[leg.lane].in_junction}
    assert avoided not in then
    assert names[avoided].label in ride.words


def test_street_off_the_road_is_looked_for_and_followed() -> None:
    ride = Ride(2)
    ride.run(2.0)
    lanes, names = ride.env.town.lanes, ride.env.scenario.street_names
    onto = {lanes[way.lane].street for crossing in ride.road.crossings for way in crossing.exits}
    away = next(index for index in range(len(names)) if index not in onto and index != lanes[ride.here[0]].street)
    ride.order({"action": "follow", "place": {"street": names[away].label}})
    for _ in range(240):
        ride.step()
        if names[lanes[ride.here[0]].street] is names[away]:
            return
    pytest.fail("the car did not come to the street")


def test_state_of_a_plan_can_be_stored() -> None:
    ride = driven(RING, turn("left", ordinal=2), turn("right"), seconds=20.0)
    stored = pickle.loads(pickle.dumps(ride.state.plan))
    assert stored == ride.state.plan and stored.steps
    assert DrivingPlan(stored.steps).to_json()


def test_step_does_not_change_the_given_plan() -> None:
    ride = driven(RING, turn("left", ordinal=2), seconds=5.0)
    before = ride.state.plan
    ride.policy.step(ride.observations["co_wizard"], ride.state)
    assert ride.state.plan is before
