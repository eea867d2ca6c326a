from __future__ import annotations

from dorothie_gym.evaluation.analysis import Handled, Profiles, Units, handling, handling_of_events
from dorothie_gym.ontology import (
    ActionValue,
    DialogueMove,
    GoalStatus,
    LandmarkName,
    ObjectClass,
    PhysicalAction,
    Role,
    Slot,
)
from dorothie_gym.session.recording import Event
from tests.evaluation.analysis.builders import M, car, did, drive, exception, human


def kinds(*parts: list[Event]) -> list[Handled]:
    units = Units(drive(*parts, seconds=240.0))
    found = handling(units)
    return [found[unit.id] for unit in units.exchanges]


def test_slowing_down_after_fog_handles_it_and_before_does_not() -> None:
    slow = (M.INSTRUCT, ActionValue.SPEED_CHANGE)
    fog = exception(20.0, "weather", parameter="fog_density", value=80.0)
    assert kinds(human(5.0, "slower", *slow), fog, human(30.0, "slower", *slow)) == [
        Handled.NONE,
        Handled.ENVIRONMENTAL,
    ]


def test_exchange_long_after_an_exception_does_not_handle_it() -> None:
    fog = exception(1.0, "weather", parameter="fog_density", value=80.0)
    assert kinds(fog, human(90.0, "slower", M.INSTRUCT, ActionValue.SPEED_CHANGE)) == [Handled.NONE]


def test_a_roadblock_is_handled_when_it_is_met_and_so_is_the_question_that_follows() -> None:
    # The car drives east at 6 m/s: it is within 60 m of x = 1000 after 157 s.
    talk = kinds(
        exception(1.0, "place_prop", x=1000.0, y=0.0),
        car(100.0, "a fence beside us", M.EXPLAIN, ObjectClass.STATIC),
        car(160.0, "the road is shut", M.EXPLAIN, ObjectClass.STATIC),
        car(166.0, "what now", M.QUERY_W, ActionValue.QUERIED),
        car(200.0, "left here", M.QUERY_YN, ActionValue.J_TURN),
    )
    assert talk == [Handled.NONE, Handled.ENVIRONMENTAL, Handled.ENVIRONMENTAL, Handled.NONE]


def test_talk_of_the_place_of_a_new_task_handles_it() -> None:
    added = exception(1.0, "task_trigger", subgoal=1, landmark="Ikea", status="Ongoing")
    new, old = (M.INSTRUCT, LandmarkName.IKEA), (M.INSTRUCT, LandmarkName.KFC)
    assert kinds(added, human(5.0, "ikea", *new), human(30.0, "kfc", *old)) == [Handled.TASK, Handled.NONE]


def test_profiles_are_means_over_units_by_speaker() -> None:
    profiles = Profiles()
    profiles.add(
        Units(
            drive(
                exception(1.0, "task_delete", landmark="KFC", status="Abandoned"),
                human(5.0, "skip it", M.INSTRUCT, LandmarkName.KFC, GoalStatus.ABANDONED),
                car(8.0, "skipped", M.CONFIRM, LandmarkName.KFC),
                human(30.0, "left", M.INSTRUCT, ActionValue.J_TURN),
            )
        )
    )
    task, none = profiles.exchanges[Handled.TASK], profiles.exchanges[Handled.NONE]
    assert (task.units, none.units, profiles.exchanges[Handled.ENVIRONMENTAL].units) == (1, 1, 0)
    assert task.mean_move(Role.CO_WIZARD, DialogueMove.CONFIRM) == 1.0
    assert task.mean_slot(Role.PARTICIPANT, Slot.STATUS) == 1.0 and none.mean_slot(Role.PARTICIPANT, Slot.STATUS) == 0.0
    assert profiles.transactions.units == 2, "after what is given up, a command begins something else"
    assert profiles.transactions.mean_move(Role.PARTICIPANT, DialogueMove.INSTRUCT) == 1.0


def test_an_action_belongs_to_the_exchange_that_was_heard_last_and_not_long_ago() -> None:
    stop = PhysicalAction.STOP
    session = drive(
        exception(20.0, "weather", parameter="fog_density", value=80.0),
        did(29.0, stop),
        human(30.0, "slower", M.INSTRUCT, ActionValue.SPEED_CHANGE),  # over at 31.5 s
        *(did(time, stop) for time in (31.5, 31.6, 41.5, 41.6)),
        seconds=240.0,
    )
    found = handling_of_events(Units(session))
    assert [found[move.index] for move in session.moves()] == [Handled.ENVIRONMENTAL]
    assert [found[action.index] for action in session.physical_actions] == [
        Handled.NONE,
        Handled.NONE,  # utterances that end in the frame of the action are not visible yet
        Handled.ENVIRONMENTAL,
        Handled.ENVIRONMENTAL,
        Handled.NONE,
    ]
