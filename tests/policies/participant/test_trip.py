"""The participant refers to the trip, ends an approach by what stands there, and corrects the car in good time."""

from __future__ import annotations

import copy
import itertools
from dataclasses import replace

import numpy as np
import pytest

from dorothie_gym.dialogue import DrivingPlan, Predicate, understand, word_acts
from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.dialogue.looks import read_look
from dorothie_gym.maps.whereabouts import is_on_right
from dorothie_gym.ontology import ActionValue, DialogueAct, DialogueMove, LandmarkName, Role
from dorothie_gym.policies.participant.approach_end import ending
from dorothie_gym.policies.participant.early_corrections import contradicts_turn, correct_early
from dorothie_gym.policies.participant.target_hints import looks_remark
from dorothie_gym.policies.participant.trip_memory import TripMemory
from dorothie_gym.policies.participant.trip_talk import recollection, trip_questions, trip_remarks
from dorothie_gym.policies.participant.unprompted_remarks import _chat_options
from dorothie_gym.policies.place_looks import look_of
from tests.policies.participant.test_route_description import Drive

P = Predicate


def driven(memory: TripMemory, *points: tuple[float, float]) -> TripMemory:
    for number, point in enumerate(points):
        memory = memory.moved(point, 1.0 * number, standing=False)
    return memory


@pytest.fixture
def drive() -> Drive:
    drive = Drive("brookside", 1)
    mark = drive.view.landmarks[0]
    drive.state.task = replace(drive.state.task, goal=mark, announced=True)
    drive.state.style = replace(drive.state.style, recalls=1.0, corrects=1.0)
    return drive


def said(remarks) -> str:
    spans = word_acts(
        [one.act for one in remarks], Role.PARTICIPANT, np.random.default_rng(1), [one.wording for one in remarks]
    )
    return " ".join(span.text for span in spans)


# --- what happened on the trip ----------------------------------------------------------------------------------------


def test_a_place_is_passed_once_the_car_has_left_it_behind(drive: Drive) -> None:
    mark = drive.view.landmarks[0]
    there = driven(TripMemory(), (mark.x - 200.0, mark.y), (mark.x, mark.y + 10.0))
    assert not there.has_passed(mark)
    beyond = driven(there, (mark.x + 200.0, mark.y))
    assert beyond.has_passed(mark)
    assert not beyond.after_stop(mark).has_passed(mark)
    assert not driven(TripMemory(), (mark.x - 200.0, mark.y + 200.0), (mark.x + 200.0, mark.y + 200.0)).has_passed(mark)


def test_what_was_passed_is_recalled_once(drive: Drive) -> None:
    mark, rng = drive.view.landmarks[0], np.random.default_rng(0)
    assert recollection(drive.state, drive.view, rng) == ()
    drive.state.trip = driven(TripMemory(), (mark.x, mark.y), (mark.x + 300.0, mark.y))
    remarks = recollection(drive.state, drive.view, rng)
    assert [content.predicate for content in remarks[0].meaning] == [P.PASSED]
    assert recollection(drive.state, drive.view, rng) == ()


def test_only_a_stop_close_by_is_recalled(drive: Drive) -> None:
    mark = drive.view.landmarks[0]
    for away, recalled in ((60.0, True), (400.0, False)):
        stop = replace(mark, row=99, name=LandmarkName.SHELL, x=mark.x + away)
        drive.state.trip = TripMemory(stops=(stop,))
        assert bool(recollection(drive.state, drive.view, np.random.default_rng(0))) is recalled


def test_a_long_wait_is_remarked_on_when_it_is_over(drive: Drive) -> None:
    now = drive.view.time

    def topics(memory: TripMemory) -> list[str]:
        drive.state.trip = memory
        return [item.wording.topic for remarks in trip_remarks(drive.state, drive.view) for item in remarks]

    standing = TripMemory().moved((0.0, 0.0), now - 40.0, standing=True)
    assert "feels_relieved" not in topics(standing)
    assert "feels_relieved" in topics(standing.moved((1.0, 0.0), now - 2.0, standing=False))
    brief = TripMemory().moved((0.0, 0.0), now - 5.0, standing=True).moved((1.0, 0.0), now - 2.0, standing=False)
    assert "feels_relieved" not in topics(brief)


def test_questions_about_the_trip_are_understood(drive: Drive) -> None:
    for (question,) in trip_questions(drive.state, drive.view):
        asked = question.meaning[0].predicate
        for seed in range(8):
            text = word_acts([question.act], Role.PARTICIPANT, np.random.default_rng(seed), [question.wording])[0].text
            heard = understand(text)
            answerable = heard.asked is not None and heard.asked.predicate in (asked, P.ARRIVES_IN)
            assert answerable or any(status.label == "Queried" for status in heard.statuses), text


# --- end of an approach -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("town", "seed"), [*itertools.product(("brookside", "midtown"), (1, 3, 6))])
def test_what_is_said_of_the_end_of_an_approach_is_true_and_no_order(town: str, seed: int) -> None:
    drive = Drive(town, seed)
    for mark in drive.view.landmarks:
        drive.state.task = replace(drive.state.task, goal=mark, told=frozenset())
        for remark in ending(drive.state, drive.view, np.random.default_rng(seed)):
            side = next(content.get("side") for content in remark.meaning if content.get("side") is not None)
            assert (side is Direction.RIGHT) is is_on_right(drive.town, mark.lane, mark.x, mark.y)
            text = said([remark])
            looks = [content for content in remark.meaning if content.predicate is P.LOOKS]
            for _ in looks:
                assert read_look(text).fits(look_of(drive.town, mark))
            steps = understand(f"turn left. {text}").plan
            seeking = steps.steps[1:] if mark.name in (LandmarkName.HOUSE, LandmarkName.PERSON) else ()
            assert steps.steps[: len(steps) - len(seeking)] == understand("turn left").plan.steps, text


@pytest.mark.parametrize(
    "words", ["by the lights", "next to the stop sign", "close to the Shell", "just at the corner"]
)
def test_where_something_stands_is_no_condition_of_the_turn_before(words: str) -> None:
    turn = understand("take the second left").plan
    assert understand(f"take the second left. it's on the right, {words}").plan == turn


def test_an_order_behind_a_statement_is_still_one() -> None:
    plan = understand("it's on the right, by the lights turn left").plan
    assert plan != DrivingPlan()


# --- corrections in good time -----------------------------------------------------------------------------------------


@pytest.fixture
def turning() -> Drive:
    """Participant who guides the car to a left or right turn just ahead, which has been announced."""
    drive = Drive("brookside", 1)
    for _, steps in drive.ways(drive.state.style.manner):
        sides = [one for one in steps if one.wording.direction in (Direction.LEFT, Direction.RIGHT)]
        if not sides or len(steps[0].keys) != 1 or steps[0] is not sides[0]:
            continue
        key = steps[0].keys[0]
        drive.state.set_guiding(True)
        drive.state.style = replace(drive.state.style, corrects=1.0)
        drive.state.guidance = replace(drive.state.guidance, step=key)
        length = drive.town.lanes[key[1]].length
        drive.view = replace(drive.view, lane=key[1], station=length - 12.0, speed=13.0, time=30.0)
        drive.state.motion = replace(drive.state.motion, speed=13.0)
        drive.state.route = drive.state.route.with_progress(
            drive.state.route.to_goal.replanned(drive.town, drive.view.place)
        )
        return drive
    raise AssertionError("no way of this session begins with a turn")


def test_a_car_too_fast_for_its_turn_is_corrected_once(turning: Drive) -> None:
    correct_early(turning.state, turning.view, np.random.default_rng(0))
    (remark,) = turning.state.speech.queue
    assert remark.act == DialogueAct.of(DialogueMove.CLARIFY, ActionValue.J_TURN)
    turning.state.speech = turning.state.speech.cleared()
    correct_early(turning.state, turning.view, np.random.default_rng(0))
    assert not turning.state.speech.queue


def test_a_car_that_was_just_told_has_time_to_obey(turning: Drive) -> None:
    turning.state.guidance = replace(turning.state.guidance, step_at=turning.view.time - 2.0)
    correct_early(turning.state, turning.view, np.random.default_rng(0))
    assert not turning.state.speech.queue


def test_the_look_of_a_place_is_stated_once(drive: Drive) -> None:
    site = drive.town.sites[4]
    house = replace(drive.view.landmarks[0], name=LandmarkName.HOUSE, x=site.position[0], y=site.position[1])
    features = []
    for seed in range(6):
        for remark in looks_remark(drive.state, drive.view, house, np.random.default_rng(seed)):
            features.append(read_look(str(remark.meaning[0].get("feature"))))
    assert len(features) >= 3
    assert all(one != other for one, other in itertools.combinations(features, 2))


@pytest.mark.parametrize("change", [{"speed": 6.0}, {"standing": True}])
def test_a_car_that_can_turn_is_left_alone(turning: Drive, change: dict[str, object]) -> None:
    speed = 0.0 if "standing" in change else 6.0
    view = replace(turning.view, speed=speed)
    turning.state.motion = replace(turning.state.motion, speed=speed)
    correct_early(turning.state, view, np.random.default_rng(0))
    assert not turning.state.speech.queue


def test_a_turn_announced_to_the_other_side_is_contradicted(turning: Drive) -> None:
    act = DialogueAct.of(DialogueMove.EXPLAIN, ActionValue.J_TURN)
    wanted = turning.state.route.to_goal.next_crossing(turning.town, turning.view.station)
    assert wanted is not None
    other = "right" if wanted.direction is Direction.LEFT else "left"
    same = understand(f"I'm turning {wanted.direction}")
    assert not contradicts_turn(turning.state, turning.view, act, same)
    assert contradicts_turn(turning.state, turning.view, act, understand(f"I'm turning {other}"))
    (remark,) = turning.state.speech.queue
    assert remark.wording.direction is wanted.direction
    assert understand(said([remark])).direction is wanted.direction


# --- remarks that are unrelated to the errands ------------------------------------------------------------------------


def test_a_hurried_passenger_asks_for_no_other_speed_when_one_was_just_asked_for(drive: Drive) -> None:
    drive.state.guidance = replace(drive.state.guidance, guiding=False)
    hurrying = []
    for seed in range(60):
        state, view = copy.deepcopy(drive.state), replace(drive.view, speed=8.0)
        [remark, *_] = _chat_options(state, view, np.random.default_rng(seed))[0]
        if state.conversation.hurried:
            hurrying.append((seed, remark))
    assert hurrying
    for seed, remark in hurrying:
        state = copy.deepcopy(drive.state)
        state.speech = replace(state.speech, said=(remark,))
        options = _chat_options(state, replace(drive.view, speed=8.0), np.random.default_rng(seed))
        assert any(not one.meaning for of in options for one in of) and not state.conversation.hurried
