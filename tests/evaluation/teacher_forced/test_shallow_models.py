"""Shallow models learn from their own inputs and from nothing else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dorothie_gym.archive import Task
from dorothie_gym.errors import SessionError
from dorothie_gym.evaluation.teacher_forced.features import Columns, PointTable, columns_of, points
from dorothie_gym.evaluation.teacher_forced.predictions import ActionPredictions, ActPredictions
from dorothie_gym.evaluation.teacher_forced.shallow_models import SHALLOW, BoostedTrees, WordRegression
from dorothie_gym.ontology import DialogueAct, DialogueMove, LandmarkName, PhysicalAction, Role
from dorothie_gym.session.recording import Event
from tests.session.recording.builders import physical, session, utterance

TO_KFC = DialogueAct.of(DialogueMove.INSTRUCT, LandmarkName.KFC)
TO_IKEA = DialogueAct.of(DialogueMove.INSTRUCT, LandmarkName.IKEA)
OKAY = DialogueAct.of(DialogueMove.ACKNOWLEDGE)
WHERE = DialogueAct.of(DialogueMove.QUERY_W)
LEFT, RIGHT = 90.0, -90.0


def exchange(number: int, *, words: bool = True) -> list[Event]:
    """The participant names one of two places; the Co-Wizard answers and turns by the place."""
    frame, kfc = 60 * number + 30, number % 2 == 0
    said = ("To the KFC", TO_KFC) if kfc else ("To the Ikea", TO_IKEA)
    answered = ("Okay.", OKAY) if kfc else ("Where is it?", WHERE)
    if not words:
        said, answered = ("Something", said[1]), ("Something", answered[1])
    return [
        *utterance(frame, Role.PARTICIPANT, 2 * number, said),
        *utterance(frame + 15, Role.CO_WIZARD, 2 * number + 1, answered),
        physical(frame + 30, PhysicalAction.J_TURN, angle=LEFT if kfc else RIGHT),
    ]


def talk(*, words: bool = True) -> Columns:
    events = [event for number in range(60) for event in exchange(number, words=words)]
    return columns_of(session(events, 60 * 61))


def fitted(name: str, columns: Columns, task: Task) -> tuple[PointTable, ActPredictions | ActionPredictions]:
    table = points(columns, task)
    model = SHALLOW[name](0)
    model.fit(columns, table, table)
    return table, model.predict(columns, table)


@pytest.mark.parametrize("name", list(SHALLOW))
def test_a_rule_of_the_dialogue_is_learned(name: str) -> None:
    columns = talk()
    table, acts = fitted(name, columns, Task.RFN)
    assert isinstance(acts, ActPredictions)
    assert acts.moves.tolist() == table.label_move.tolist()
    table, actions = fitted(name, columns, Task.NFD)
    assert isinstance(actions, ActionPredictions)
    assert actions.angles.tolist() == table.label_angle.tolist()


def test_slot_values_are_read_from_the_words() -> None:
    table, acts = fitted("tfidf", talk(), Task.UFN)
    assert isinstance(acts, ActPredictions)
    assert np.array_equal(acts.slots, table.label_slots)


def test_boosted_trees_read_no_words() -> None:
    columns = talk()
    table = points(columns, Task.RFN)
    model = BoostedTrees()
    model.fit(columns, table, table)
    silent = talk(words=False)
    given, other = model.predict(columns, table), model.predict(silent, points(silent, Task.RFN))
    assert isinstance(given, ActPredictions) and isinstance(other, ActPredictions)
    assert given.moves.tolist() == other.moves.tolist()


def test_word_regression_reads_words_alone() -> None:
    columns = talk()
    table = points(columns, Task.RFN)
    model = WordRegression()
    model.fit(columns, table, table)
    acts = replace(columns.moves, move=np.zeros_like(columns.moves.move), slots=np.zeros_like(columns.moves.slots))
    other = replace(columns, moves=acts)
    given, same = model.predict(columns, table), model.predict(other, table)
    assert isinstance(given, ActPredictions) and isinstance(same, ActPredictions)
    assert given.moves.tolist() == same.moves.tolist()


@pytest.mark.parametrize("name", list(SHALLOW))
def test_without_training_points_there_is_an_error(name: str) -> None:
    columns = columns_of(session([]))
    table = points(columns, Task.UFN)
    with pytest.raises(SessionError, match="no training points of the task ufn"):
        SHALLOW[name](0).fit(columns, table, table)


@pytest.mark.parametrize("name", list(SHALLOW))
def test_one_class_in_training_is_predicted_everywhere(name: str) -> None:
    columns = columns_of(session([physical(60 * k + 30, PhysicalAction.START) for k in range(9)], 600))
    table, actions = fitted(name, columns, Task.NFD)
    assert isinstance(actions, ActionPredictions)
    assert actions.actions.tolist() == table.label_action.tolist() and not actions.angles.any()
