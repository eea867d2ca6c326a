"""Guidance on the last stretch to the goal, and answers to questions there."""

from dataclasses import replace

import numpy as np
import pytest

from dorothie_gym.maps.routing import LaneEntry
from dorothie_gym.ontology import ActionValue, DialogueAct, DialogueMove, LandmarkName, Role, Slot
from dorothie_gym.policies.participant.config import ParticipantConfig
from dorothie_gym.policies.participant.dialogue_update import listen
from dorothie_gym.policies.participant.failed_guidance import why_standing
from dorothie_gym.policies.participant.order_history import note_said
from dorothie_gym.policies.participant.turn_by_turn_guidance import guide
from dorothie_gym.policies.route_progress import RouteProgress
from dorothie_gym.policies.scripted_agent_limits import NUDGE_DISTANCE
from tests.policies.said import with_words
from tests.policies.test_repairs import Human

M = DialogueMove


class Guide(Human):
    """Participant that guides a car on the lane of the goal, some way before it."""

    def __init__(self, before: float, speed: float = 0.0) -> None:
        super().__init__()
        assert self.state.task.goal is not None
        self.state.set_guiding(True)
        self.put(self.state.task.goal.lane, self.state.task.goal.station - before, speed)

    def put(self, lane: int, station: float, speed: float) -> None:
        assert self.state.task.goal is not None
        where = self.env.town.lanes[lane]
        self.observation |= {
            "time": np.array([50.0]),
            "speed": np.array([speed]),
            "lane": np.int64(lane),
            "station": np.array([station]),
            "pose": np.array([*where.position(station), where.heading_at(station)]),
        }
        progress = RouteProgress.plan(self.env.town, (lane, station), self.state.task.goal.place)
        self.state.route = self.state.route.with_progress(progress)
        self.state.motion = replace(self.state.motion, standing_since=None if speed else 40.0)

    def says(self) -> list[ActionValue]:
        guide(self.state, self.view, self.rng)
        return [value for item in self.state.speech.queue for value in item.act.values(Slot.ACTION)]


def test_nudge_is_shorter_than_arrival_zone() -> None:
    rolls_on = 0.6  # what the car needs to stop, measured
    within = ParticipantConfig.arrived_within
    assert within - NUDGE_DISTANCE - rolls_on > -within


@pytest.mark.parametrize(("before", "counted"), [(4.0, False), (14.0, True), (26.0, False), (30.0, False)])
def test_distance_given_to_standing_car_does_not_pass_goal(before: float, counted: bool) -> None:
    """A few car lengths are counted; less is a bit, and more is up to a word to stop."""
    human = Guide(before)
    assert human.says() == [ActionValue.LANE_FOLLOW]
    distance = human.state.speech.queue[0].wording.distance
    assert (distance is not None) is counted
    if distance is not None:
        assert 0.5 * before < distance <= before


def test_arrival_question_before_goal_is_denied_with_nudge() -> None:
    human = Guide(4.0)
    human.hears(M.QUERY_YN)
    assert human.moves() == [M.REPLY_N, M.INSTRUCT]


@pytest.mark.parametrize(("before", "denied"), [(4.0, [M.REPLY_N, M.INSTRUCT]), (120.0, [M.REPLY_N]), (0.0, [])])
def test_wrong_arrival_as_the_reason_for_a_stop_is_denied(before: float, denied: list[DialogueMove]) -> None:
    human = Guide(before)
    assert human.state.task.goal is not None
    place = human.state.task.goal.name
    hears_answer(human, f"because we have reached {place.label}", place)
    assert human.moves()[: len(denied) or 1] == denied


def test_car_that_stands_because_it_does_not_know_the_way_is_told_the_way() -> None:
    human = Guide(1.0)
    lane = next(lane for lane in human.env.town.lanes if len(human.env.town.exits(lane.id)) > 1 and lane.length > 30.0)
    human.put(lane.id, lane.length - 12.0, 0.0)
    hears_answer(human, "because I don't know where to turn")
    (told,) = human.state.speech.queue
    assert told.act.move is M.INSTRUCT and ActionValue.START not in told.act.slots
    assert told.act.values(Slot.ACTION)


def test_car_that_waits_for_the_way_just_before_the_place_is_sent_straight_on() -> None:
    human = Guide(9.0)
    hears_answer(human, "because I need to know which way to go")
    (told,) = human.state.speech.queue
    assert told.act.values(Slot.ACTION) == (ActionValue.LANE_FOLLOW,)
    assert told.wording.distance is None, "a distance would make the car stop at the junction again"


def test_car_that_still_stands_at_a_former_errand_is_told_the_place_again() -> None:
    human = Guide(200.0)
    assert human.state.task.goal is not None
    other = next(name for name in (LandmarkName.SHELL, LandmarkName.KFC) if name is not human.state.task.goal.name)
    hears_answer(human, f"because we're at {other.label}", other)
    assert human.state.speech.queue[0].act.move is M.INSTRUCT
    assert human.state.task.goal.name in human.state.speech.queue[0].act.slots


def hears_answer(human: Guide, text: str, *values: LandmarkName) -> None:
    """Lets a participant who has asked why the car stands hear the answer."""
    human.state.speech = replace(human.state.speech, last=why_standing(human.state, human.view))
    raw = with_words(human.observation, Role.CO_WIZARD, text, DialogueAct.of(M.REPLY_W, *values))
    listen(human.state, replace(human.view, raw=raw), human.rng)


def test_car_that_does_not_move_is_asked_why_instead_of_being_told_a_third_time() -> None:
    human = Guide(14.0)
    told = []
    for _ in range(6):
        human.says()
        told.append(human.state.speech.queue[0].act)
        note_said(human.state, human.view, human.state.speech.queue[0])
        human.state.speech = replace(human.state.speech.cleared(), last_end=-100.0)
        human.observation["time"] = human.observation["time"] + 10.0
    further, why, start = (
        DialogueAct.of(move, action)
        for move, action in (
            (M.INSTRUCT, ActionValue.LANE_FOLLOW),
            (M.QUERY_W, ActionValue.STOP),
            (M.INSTRUCT, ActionValue.START),
        )
    )
    assert told == [further, further, why, further, start, why]


@pytest.mark.parametrize(("speed", "kept"), [(0.0, True), (6.0, False)])
def test_answers_are_dropped_before_the_stop_but_not_while_the_car_stands(speed: float, kept: bool) -> None:
    human = Guide(14.0, speed)
    human.hears(M.ALIGN)
    human.says()
    assert (M.ACKNOWLEDGE in human.moves()) is kept


def test_goal_question_right_after_announcement_is_not_answered() -> None:
    human = Human()
    human.observation["time"] = np.array([60.0])
    human.state.speech = replace(human.state.speech, last_end=58.0)  # the place was named in the last breath
    human.hears(M.QUERY_W, LandmarkName.QUERIED)
    assert human.moves() == []


@pytest.mark.parametrize("uptake", [True, False])
def test_acknowledged_instruction_is_not_acknowledged_again(uptake: bool) -> None:
    human = Human()
    human.state.style = replace(human.state.style, nods=1.0)
    turning = DialogueAct.of(M.EXPLAIN, ActionValue.J_TURN)
    acts = (DialogueAct.of(M.ACKNOWLEDGE), turning) if uptake else (turning,)
    raw = with_words(human.observation, Role.CO_WIZARD, "okay, turning left", *acts)
    listen(human.state, replace(human.view, raw=raw), human.rng)
    assert (M.ACKNOWLEDGE in human.moves()) is not uptake


def test_u_turn_leaves_enough_road_to_stop() -> None:
    human = Guide(1.0)
    longest = max(human.env.town.lanes, key=lambda lane: lane.length)
    goal = replace(human.state.task.goal, lane=longest.id, station=longest.length / 2)
    human.state.task = replace(human.state.task, goal=goal)
    run_up = human.state.config.run_up
    announced: dict[bool, list[bool]] = {True: [], False: []}
    for lane in human.env.town.lanes:
        for station in np.arange(2.0, lane.length - run_up - 15.0, 4.0):
            human.put(lane.id, float(station), 8.0)
            journey = human.state.route.progress
            assert journey is not None
            rest = journey.run_up()
            manoeuvre = journey.next_manoeuvre(float(station))
            if rest is None or rest[1] or manoeuvre is None or manoeuvre[1] > 12.0:
                continue
            if run_up / 2 < rest[0] < run_up + 5.0 or not journey.turns_round_on(lane.id):
                continue
            human.state.speech = human.state.speech.cleared()
            human.state.guidance = replace(human.state.guidance, step=None, u_turns=0)
            announced[rest[0] > run_up].append(ActionValue.U_TURN in human.says())
    assert announced[True] and all(announced[True])
    assert announced[False] and not any(announced[False])


def test_route_without_u_turn_has_no_run_up() -> None:
    human = Guide(10.0)
    assert human.state.route.progress is not None and human.state.route.progress.run_up() is None
    assert LaneEntry.U_TURN not in {leg.entry for leg in human.state.route.progress.legs}


@pytest.mark.parametrize(("behind", "speed", "said"), [(6.0, 6.0, [ActionValue.STOP]), (6.0, 4.0, []), (18.0, 6.0, [])])
def test_stop_that_is_not_heeded_is_repeated_shortly_behind_the_place(
    behind: float, speed: float, said: list[ActionValue]
) -> None:
    human = Guide(4.0, 6.0)
    human.state.style = replace(human.state.style, points_out=0.0)
    assert human.says() == [ActionValue.STOP]
    goal, progress = human.state.task.goal, human.state.route.progress
    assert goal is not None and progress is not None
    human.put(goal.lane, goal.station + behind, speed)
    followed = progress.followed(human.env.town, goal.lane, goal.station + behind)
    human.state.route = human.state.route.with_progress(followed)
    human.state.motion = human.state.motion.with_speed(6.0)
    human.state.speech = human.state.speech.cleared()
    human.observation["time"] = human.observation["time"] + 4.5
    assert human.says() == said


@pytest.mark.parametrize(("before", "stops"), [(9.6, True), (9.76, True), (11.0, False)])
def test_car_that_does_not_brake_is_stopped_in_time_although_the_place_was_announced(before, stops):
    human = Guide(32.0, speed=9.75)
    human.state.guidance = human.state.guidance.with_approach_announced(True).with_stop_text("stop here please")
    human.state.motion = replace(human.state.motion, speed=before)
    assert human.says() == ([ActionValue.STOP] if stops else [])
