"""Statements that are put into a played session are found to be true or false."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dorothie_gym.dialogue import ASKED, Direction, Predicate, Proposition
from dorothie_gym.evaluation.analysis.truth_checks.checks import TalkChecks, check_session
from dorothie_gym.evaluation.analysis.truth_checks.session_world import SessionWorld
from dorothie_gym.evaluation.analysis.truth_checks.truth import agrees, is_right_cause, is_true
from dorothie_gym.maps.catalogue import find_town
from dorothie_gym.ontology import ActionValue, GoalStatus, LandmarkName, ObjectClass, PhysicalAction, Role, StreetName
from dorothie_gym.session.recording import ActionRecord, EventType
from dorothie_gym.session.recording.header import LandmarkRow
from dorothie_gym.sim.config import FRAME_RATE
from tests.evaluation.analysis.builders import M, car, drive, human
from tests.evaluation.teacher_forced.features.played import play

P = Predicate
STANDS = Proposition.of(P.STANDS, action=ActionValue.STOP)


@pytest.fixture(scope="module")
def world(tmp_path_factory: pytest.TempPathFactory) -> SessionWorld:
    session = play(tmp_path_factory.mktemp("played") / "one", seed=3, seconds=240.0)
    town = find_town("brookside", None)
    assert town is not None
    return SessionWorld(session, town)


def told(world: SessionWorld, said: Proposition, time: float) -> bool | None:
    return is_true(world, said, time, Role.CO_WIZARD)


def test_street_of_the_car_is_known(world):
    time = next(time for time in np.arange(5.0, 200.0) if world.street(time) is not None)
    name = next(street for street in StreetName if street.label == world.street(time))
    other = next(street for street in StreetName if street.label not in {world.street(time - k) for k in (0, 2, 4)})
    assert told(world, Proposition.of(P.ON_STREET, street=name), time) is True
    assert told(world, Proposition.of(P.ON_STREET, street=other), time) is False
    assert told(world, Proposition.of(P.ON_STREET, street=other, negated=True), time) is True


def test_arrival_times_are_compared_with_the_arrival(world):
    event = next(event for event in world.changes if event.data.get("cause") == "arrival")
    place = next(name for name in LandmarkName if name.label == event.data["landmark"])
    before = [other.time for other in world.changes if other.time < event.time]
    asked_at = max([event.time - 60.0, *(time + 0.1 for time in before)])
    left = event.time - asked_at
    assert told(world, Proposition.of(P.ARRIVES_IN, place=place, seconds=round(left)), asked_at) is True
    assert told(world, Proposition.of(P.ARRIVES_IN, place=place, seconds=round(3.0 * left) + 30), asked_at) is False
    assert told(world, Proposition.of(P.ARRIVES_IN, place=place, seconds=ASKED), asked_at) is None


def test_arrival_is_true_once_the_errand_is_done_and_false_on_the_way(world):
    event = next(event for event in world.changes if event.data.get("cause") == "arrival")
    place = next(name for name in LandmarkName if name.label == event.data["landmark"])
    arrived = Proposition.of(P.ARRIVED, place=place)
    assert told(world, arrived, event.time + 5.0) is True
    assert told(world, arrived.opposite, event.time + 5.0) is False
    assert (
        told(world, arrived, next(t for t in np.arange(event.time - 10.0, 0.0, -1.0) if world.speed(t) > 4.0)) is False
    )


@pytest.mark.parametrize(
    ("claimed", "actual", "right"), [(60, 85, True), (60, 95, False), (10, 2, True), (200, 120, False), (120, 90, True)]
)
def test_times_agree_within_half_as_much_again(claimed, actual, right):
    assert agrees(claimed, actual) is right


def test_standstill_is_explained_by_what_the_car_braked_for_only(world):
    stops = world.session.of_type(EventType.HAZARD_STOP)
    stop = next(stop for stop in stops if any(world.stands(stop.time + k) for k in range(1, 6)))
    time = next(stop.time + k for k in range(1, 6) if world.stands(stop.time + k))
    kind = next(kind for kind in ObjectClass if kind.label == stop.data["reason"])
    others = (ObjectClass.STATIC, ObjectClass.PEDESTRIAN, ObjectClass.VEHICLES)
    other = next(other for other in others if other.label not in world.hazards(time, 8.0))
    assert is_right_cause(world, Proposition.of(P.HINDERS, object=kind), STANDS, time) is True
    assert is_right_cause(world, Proposition.of(P.HINDERS, object=other), STANDS, time) is False


def test_reason_for_standing_is_wrong_while_the_car_drives(world):
    driving = next(t for t in np.arange(10.0, 200.0) if all(world.speed(t + k) > 4.0 for k in (-4, -1, 0, 1, 4)))
    assert is_right_cause(world, Proposition.of(P.RED), STANDS, driving) is False


def test_order_is_a_reason_only_after_it_was_given(world):
    order = next(move for move in world.session.moves(Role.PARTICIPANT) if move.act.values(ActionValue.STOP.slot))
    action = order.act.values(ActionValue.STOP.slot)[0]
    cause = Proposition.of(P.TOLD, action=action)
    assert is_right_cause(world, cause, None, order.end + 1.0) is True
    assert is_right_cause(world, cause, None, order.start - 90.0) is False


def test_lights_and_hidden_places(world):
    assert told(world, Proposition.of(P.LIGHTS_ON), 0.0) is False
    for row in world.session.header.landmarks:
        name = next(name for name in LandmarkName if name.label == row["name"])
        if len(world.landmarks(name)) == 1:
            assert told(world, Proposition.of(P.KNOWS, place=name), 10.0) is not row["hidden"]


def test_announced_turn_is_true_if_the_car_turns_to_that_side(world):
    turns = [taken for taken in world.session.physical_actions if taken.action is PhysicalAction.J_TURN]
    turn = next(taken for taken in turns if taken.angle is not None and abs(taken.angle) > 45.0)
    side = Direction.LEFT if turn.angle > 0.0 else Direction.RIGHT
    before = turn.frame / FRAME_RATE - 5.0
    announced = Proposition.of(P.WILL, action=ActionValue.J_TURN, direction=side)
    assert told(world, announced, before) is True
    assert told(world, Proposition.of(P.WILL, action=ActionValue.LANE_FOLLOW), before) is None
    calm = [
        t
        for t in np.arange(5.0, 150.0)
        if not any(0.0 <= u.frame / FRAME_RATE - t + 6.0 <= 66.0 for u in u_turns(world))
    ]
    assert all(told(world, Proposition.of(P.WILL, action=ActionValue.U_TURN), time) is not True for time in calm)


def u_turns(world: SessionWorld) -> list[ActionRecord]:
    return [taken for taken in world.session.physical_actions if taken.action is PhysicalAction.U_TURN]


def test_status_of_a_task_follows_the_record(world):
    event = next(event for event in world.changes if event.data.get("cause") == "arrival")
    name = next(name for name in LandmarkName if name.label == event.data["landmark"])
    done = Proposition.of(P.TASK, place=name, status=GoalStatus.COMPLETE)
    open_task = Proposition.of(P.TASK, place=name, status=GoalStatus.PENDING)
    assert told(world, done, event.time - 1.0) is False and told(world, done, event.time + 1.0) is True
    assert told(world, open_task, event.time - 1.0) is True
    assert told(world, Proposition.of(P.GOAL, place=name), event.time - 1.0) is True
    later = [number for number, row in enumerate(world.session.header.subgoals) if row["trigger"]]
    tasks = {world.session.header.landmarks[row["landmark"]]["name"] for row in world.session.header.subgoals}
    foreign = next(row for row in world.session.header.landmarks if row["name"] not in tasks)
    assert not later and told(world, Proposition.of(P.GOAL, place=name_of(foreign)), event.time - 1.0) is False


def test_goal_that_the_car_believes_in_counts_as_its_statement_only(world):
    update = next(e for e in world.session.of_type(EventType.BELIEF_UPDATE) if e.data.get("landmarks"))
    name = next(name for name in LandmarkName if name.label == update.data["landmarks"][0])
    assert world.believed_goal(update.time) is name
    first = world.session.of_type(EventType.BELIEF_UPDATE)[0]
    assert world.believed_goal(first.time - 0.1) is None
    assert told(world, Proposition.of(P.GOAL, negated=True), first.time - 0.1) is True, "it has no destination yet"


def test_nearer_place_has_the_shorter_way(world):
    single = [row for row in world.session.header.landmarks if len(world.landmarks(name_of(row))) == 1]
    ways = sorted((world.way_to(20.0, row), name_of(row).value, name_of(row)) for row in single)
    near, far = ways[0][2], ways[-1][2]
    assert ways[-1][0] > ways[0][0] + 50.0
    assert told(world, Proposition.of(P.NEARER, place=near, landmark=far), 20.0) is True
    assert told(world, Proposition.of(P.NEARER, place=far, landmark=near), 20.0) is False


def name_of(row: LandmarkRow) -> LandmarkName:
    return next(name for name in LandmarkName if name.label == row["name"])


def checked(world: SessionWorld, move: str, *meaning: Proposition) -> TalkChecks:
    """Returns the figures of the played session if its only statement is made in its middle."""
    event = next(event for event in world.session.events if event.type is EventType.DIALOGUE_MOVE)
    rows = [said.to_json() for said in meaning]
    said = replace(event, data={**event.data, "move": move, "slots": {}, "meaning": rows, "start": 100.0, "end": 101.0})
    rest = [other for other in world.session.events if other.type is not EventType.DIALOGUE_MOVE]
    checks = TalkChecks()
    check_session(
        checks, replace(world.session, events=tuple(sorted([*rest, said], key=lambda e: e.frame))), world.town
    )
    return checks


def test_false_statements_lower_the_figures(world):
    lights = Proposition.of(P.LIGHTS_ON)
    on = world.lights_on(100.0)
    assert checked(world, "Explain", lights if on else lights.opposite).share("truth") == 1.0
    wrong = checked(world, "ReplyN", lights.opposite if on else lights)
    assert wrong.share("truth") == wrong.share("yes_no_answers") == 0.0
    assert checked(world, "QueryYN", lights).share("truth") is None  # a question states nothing


def arrival_claims(world: SessionWorld, time: float, place: LandmarkName) -> float | None:
    """The share of right claims of arrival if the only utterance of the played session is one."""
    said = car(time, "we're here", M.EXPLAIN, meaning=[Proposition.of(P.ARRIVED, place=place).to_json()])
    rest = [other for other in world.session.events if other.type is not EventType.DIALOGUE_MOVE]
    events = tuple(sorted([*rest, *said], key=lambda event: event.frame))
    checks = TalkChecks()
    check_session(checks, replace(world.session, events=events), world.town)
    return checks.share("arrival_claims")


def test_claim_of_arrival_is_compared_with_the_place(world):
    rows = world.session.header.landmarks
    far = next(name_of(row) for row in rows if world.arrived_at(100.0, name_of(row)) is False)
    assert arrival_claims(world, 100.0, far) == 0.0
    event = next(event for event in world.changes if event.data.get("cause") == "arrival")
    there = next(name for name in LandmarkName if name.label == event.data["landmark"])
    assert arrival_claims(world, event.time + 1.0, there) == 1.0


def test_shares_come_with_the_number_of_their_cases(world):
    rows = checked(world, "Explain", Proposition.of(P.LIGHTS_ON)).to_json()
    assert rows["truth_n"] == 1 and rows["causes"] is None and rows["causes_n"] == 0
    assert rows["loops_n"] == 1 and isinstance(rows["exceptions"], dict)


def exchange(question: Proposition, answer: Proposition) -> float | None:
    asked = human(3.0, "?", M.QUERY_YN, meaning=[question.to_json()])
    replied = car(6.0, ".", M.REPLY_W, meaning=[answer.to_json()])
    checks = TalkChecks()
    check_session(checks, drive(asked, replied), None)
    return checks.share("relevance")


def test_answers_are_about_what_was_asked():
    close, lights = Proposition.of(P.CLOSE, place=LandmarkName.KFC), Proposition.of(P.LIGHTS_ON)
    time = Proposition.of(P.ARRIVES_IN, seconds=ASKED)
    assert exchange(close, close.opposite) == 1.0
    assert exchange(close, lights) == 0.0
    assert exchange(close, Proposition.of(P.CLOSE, place=LandmarkName.IKEA)) == 0.0
    assert exchange(time, Proposition.of(P.ARRIVES_IN, place=LandmarkName.KFC, seconds=30)) == 1.0
    assert exchange(STANDS, Proposition.of(P.BECAUSE, effect=STANDS, cause=Proposition.of(P.RED))) == 1.0


def test_command_prints_every_figure(tmp_path: Path, world):
    import json

    from typer.testing import CliRunner

    from dorothie_gym.cli import app

    world.session.save(tmp_path / "one")
    found = CliRunner().invoke(app, ["stats", str(tmp_path), "--talk", "--json"])
    assert found.exit_code == 0, found.output
    rows = json.loads(found.stdout)
    for name in ("truth", "causes", "arrival_times", "yes_no_answers", "relevance", "exceptions", "loops"):
        assert name in rows and f"{name}_n" in rows
    assert rows["sessions"] == 1 and rows["truth_n"] > 0
