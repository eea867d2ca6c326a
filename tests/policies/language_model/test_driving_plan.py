"""The plan on the Co-Wizard's page: written or taken over by the model, shown step by step, and counted down."""

from __future__ import annotations

import pytest

from dorothie_gym.dialogue import Direction
from dorothie_gym.ontology import MentalAction, Role
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.policies.language_model.driving_plan import planned_junctions
from dorothie_gym.policies.language_model.role_interface import NOTE_LENGTH
from dorothie_gym.policies.road_ahead import RoadAhead
from dorothie_gym.session.recording.events import EventType
from tests.policies.language_model.test_pages import Drive

SEVERAL = "left, then right at the second traffic light, then stop"


def steps_of(page: str) -> list[str]:
    """The steps that a page shows."""
    found: list[str] = []
    for line in page.partition("\nYour plan:\n")[2].split("\n"):
        if not line.startswith("- "):
            break
        found.append(line[2:])
    return found


def hear(drive: Drive, words: str) -> str:
    """The page after an utterance of the passenger."""
    drive.state = drive.turns.attend({**drive.seen(), "participant_text": words}, drive.state)
    return drive.turns.page(drive.seen(), drive.state)[0]


def updates(drive: Drive, steps: int = 1) -> list[list[int]]:
    """Junctions of each update of the plan that the session records in some decisions."""
    found: list[list[int]] = []
    for _ in range(steps):
        drive.step()
        data = [event.data for event in drive.engine.session.events if event.type is EventType.BELIEF_UPDATE]
        found += [list(each["junctions"]) for each in data if each["action"] == MentalAction.PLAN_UPDATE.label]
    return found


def test_plan_of_an_answer_is_shown_step_by_step_until_it_is_dropped() -> None:
    drive = Drive(Role.CO_WIZARD)
    assert not steps_of(drive.page())
    drive.answer(plan="left, then straight on, then stop at the KFC")
    expected = ["turn left", "go straight on", "stop at the KFC"]
    assert steps_of(drive.page()) == expected
    for words in ("", "keep"):
        drive.answer(plan=words)
        assert steps_of(drive.page()) == expected
    drive.answer(plan="none")
    assert not steps_of(drive.page())


def test_steps_that_the_passenger_asks_for_are_told_and_taken_over() -> None:
    drive = Drive(Role.CO_WIZARD)
    drive.page()
    page = hear(drive, SEVERAL)
    told = "- In steps: turn left, then turn right at the second traffic light, then stop"
    assert told in page.split("\n") and not steps_of(page)
    drive.answer(plan="as asked")
    assert steps_of(drive.page()) == told.partition(": ")[2].split(", then ")
    assert "In steps" not in hear(drive, "turn left")  # a single order says it all
    assert "In steps" not in hear(drive, "what a lovely day")


def test_words_without_a_step_are_named_and_leave_the_plan_as_it_is() -> None:
    drive = Drive(Role.CO_WIZARD)
    drive.page()
    drive.answer(plan="right")
    drive.answer(plan="be a good driver")
    page = drive.page()
    assert 'Your plan "be a good driver" has no steps; write them like "left, then' in page
    assert steps_of(page) == ["turn right"]
    drive.answer()
    assert "has no steps" not in drive.page()
    drive.answer(plan="as asked")
    assert 'Your plan "as asked" has no steps' in drive.page()


def first_way(drive: Drive, direction: Direction) -> str:
    """The choice of an exit of the next junction in a direction; empty if there is none."""
    word = "straight" if direction is Direction.STRAIGHT else direction.value
    lines = [line[2:] for line in drive.page().split("\n") if line.startswith("- JTurn") and f": {word}," in line]
    return lines[0].partition(":")[0] if lines else ""


@pytest.mark.parametrize(("plan", "left"), [("{way}, then stop", ["stop"]), ("{other}, then stop", ["", "stop"])])
def test_step_leaves_the_page_when_the_car_has_carried_it_out(plan: str, left: list[str]) -> None:
    drive = Drive(Role.CO_WIZARD, 4)
    for _ in range(120):
        drive.step()
        ways = [way for way in Direction if way in (Direction.LEFT, Direction.RIGHT) and first_way(drive, way)]
        if ways and first_way(drive, ways[0]) in drive.page().rpartition("You can drive: ")[2].split(", "):
            break
    way = ways[0]
    other = Direction.RIGHT if way is Direction.LEFT else Direction.LEFT
    words = {"way": f"turn {way.value}", "other": f"turn {other.value}"}
    drive.answer(plan=plan.format(**words), drive=first_way(drive, way))
    assert len(steps_of(drive.page())) == 2
    street = drive.engine.session.world.planner.lane
    for _ in drive.run(60.0):
        crossed = drive.engine.session.world.planner.lane
        if crossed != street and not drive.engine.town.lanes[crossed].in_junction:
            break
    drive.step()
    drive.page()
    page = drive.page()
    assert steps_of(page) == [step or words["other"] for step in left]


def test_junctions_of_the_plan_are_sent_as_an_update() -> None:
    drive = Drive(Role.CO_WIZARD, 4)
    view = CoWizardView.read(drive.seen(), drive.engine.town)
    crossings = RoadAhead.straight_on(drive.engine.town, view.here).crossings
    drive.page()
    drive.answer(plan="straight on across two junctions")
    assert updates(drive) == [[crossing.junction for crossing in crossings[:2]]]
    drive.answer(plan="straight on across two junctions")
    assert not updates(drive)  # unchanged
    assert planned_junctions(drive.engine.town, view.here, ()) == ()


def test_route_to_a_goal_is_sent_as_an_update() -> None:
    drive = Drive(Role.CO_WIZARD)
    page = drive.page()
    place = page.partition("Places on your map:\n- ")[2].partition(", on ")[0]
    drive.answer(goal=place)
    sent = updates(drive, 4)
    progress = drive.state.memory.navigator.route.progress  # type: ignore[attr-defined]
    assert sent == [list(progress.route.junctions(drive.engine.town))]


@pytest.mark.parametrize("role", [Role.CO_WIZARD, Role.PARTICIPANT, Role.AD_WIZARD])
def test_note_is_kept_extended_and_replaced(role: Role) -> None:
    drive = Drive(role)
    drive.page()
    for words, expected in (
        ("two errands", "two errands"),
        ("keep", "two errands"),
        ("add: the House first", "two errands; the House first"),
        ("done", "done"),
        ("add: " + "x" * (NOTE_LENGTH - 10), "done; " + "x" * (NOTE_LENGTH - 10)),
        ("add: late", "x" * (NOTE_LENGTH - 10) + "; late"),
    ):
        drive.answer(note=words)
        assert f"Your note: {expected}\n" in drive.page()
    drive.answer(note="")
    assert "Your note" not in drive.page()
