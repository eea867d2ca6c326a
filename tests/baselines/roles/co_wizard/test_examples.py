from dataclasses import replace

import pytest

from dorothie_gym.baselines.roles.co_wizard.decision import CoWizardPercept, blank_inputs, listening_inputs, perceive
from dorothie_gym.baselines.roles.co_wizard.examples import correcting_example
from dorothie_gym.baselines.roles.co_wizard.memory import GoalEvent, Update, WorkingMemory
from dorothie_gym.baselines.roles.co_wizard.teacher import Lesson
from dorothie_gym.baselines.roles.learned_role.dagger_sessions import observed
from dorothie_gym.baselines.roles.learned_role.decision import Attention
from dorothie_gym.ontology import LandmarkName, Role
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.session.spaces import CoWizardAction
from tests.baselines.roles.learned_role.test_utterance_inputs import heard


@pytest.fixture(scope="module")
def percept() -> CoWizardPercept:
    engine = SessionEngine("midtown")
    engine.reset(seed=3)
    return perceive(observed(engine, Role.CO_WIZARD), Attention(memory=WorkingMemory(town=engine.town)), None)


def goal_to_learn(
    percept: CoWizardPercept, own: LandmarkName, right: LandmarkName, text: str, *, on_map: bool = True
) -> int | None:
    """What a player whose goal is `own` is to do with it when it hears a text while the teacher aims at `right`."""
    rows = {mark.name: mark.row for mark in percept.view.landmarks}
    player = replace(percept.memory, goal=own, goal_mark=rows[own])
    led = replace(percept.memory, goal=right, goal_mark=rows[right] if on_map else -1)
    now = replace(percept, memory=player, utterances=(heard(text),), heard=True)
    lesson = Lesson(
        update=Update(values=player.values, fresh=(False, False, False)),
        physical=None,
        remarks=(),
        queued=False,
        ready=True,
        action=CoWizardAction(),
    )
    found = correcting_example(now, listening_inputs(now, queued=False), blank_inputs(), led, lesson)
    return None if found is None else found.goal


def two_places(percept: CoWizardPercept) -> tuple[LandmarkName, LandmarkName]:
    one, two, *_ = (mark.name for mark in percept.view.landmarks if mark.name is not LandmarkName.HOUSE)
    return one, two


def test_player_with_the_teachers_goal_keeps_it(percept: CoWizardPercept) -> None:
    one, _ = two_places(percept)
    assert goal_to_learn(percept, one, one, "Turn left.") is None  # nothing differs


def test_wrong_goal_is_given_up_when_only_directions_are_heard(percept: CoWizardPercept) -> None:
    one, two = two_places(percept)
    assert goal_to_learn(percept, one, two, "Please turn around.") == GoalEvent.CLEAR
    assert goal_to_learn(percept, one, one, "Please turn around.", on_map=False) == GoalEvent.DOUBT


def test_goal_that_is_named_again_is_taken(percept: CoWizardPercept) -> None:
    one, two = two_places(percept)
    listening = listening_inputs(replace(percept, heard=True, utterances=(heard("Turn left."),)), queued=False)
    row = next(mark.row for mark in percept.view.landmarks if mark.name is two)
    assert goal_to_learn(percept, one, two, f"No, go to the {two}.") == len(GoalEvent) + listening.rows.index(row)
    off_map = goal_to_learn(percept, one, two, f"No, go to the {two}.", on_map=False)
    assert off_map == GoalEvent.OFF_MAP_FIRST
