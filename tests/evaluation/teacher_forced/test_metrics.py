from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from dorothie_gym.archive import DecisionPoint, InferencePoint, ufn_points
from dorothie_gym.archive.prediction_points import nfd_points
from dorothie_gym.evaluation.teacher_forced import (
    ActionAccuracy,
    ActionPredictions,
    ActPredictions,
    ArgumentAccuracy,
    ArgumentAccuracyPaper,
    JointAccuracy,
    JointAccuracyPaper,
    Metric,
    MoveAccuracy,
    SlotF1,
    SlotScorePaper,
    act_labels,
    action_labels,
)
from dorothie_gym.evaluation.teacher_forced.metrics import confusion_matrix, per_class_accuracy
from dorothie_gym.ontology import (
    LABELS,
    ActionValue,
    DialogueAct,
    DialogueMove,
    LandmarkName,
    PhysicalAction,
    Role,
    SlotValue,
    StreetName,
    decode_slots,
)
from tests.session.recording.builders import physical, session, utterance


def acts(*slots: Sequence[SlotValue], move: DialogueMove = DialogueMove.INSTRUCT) -> list[InferencePoint]:
    events = [
        event
        for i, values in enumerate(slots)
        for event in utterance(30 * (i + 1), Role.PARTICIPANT, i, ("word", DialogueAct.of(move, *values)))
    ]
    return list(ufn_points(session(events)))


def guesses(*slots: Sequence[SlotValue], moves: Sequence[DialogueMove] | None = None) -> ActPredictions:
    vectors = [DialogueAct.of(DialogueMove.INSTRUCT, *values).vector for values in slots]
    chosen = moves or [DialogueMove.INSTRUCT] * len(slots)
    return ActPredictions(
        moves=np.array([int(move) for move in chosen], dtype=np.int64),
        slots=np.array(vectors, dtype=np.bool_).reshape(-1, len(LABELS)),
    )


def decisions(*pairs: tuple[PhysicalAction, float | None]) -> list[DecisionPoint]:
    events = [physical(i + 1, action, angle) for i, (action, angle) in enumerate(pairs)]
    return list(nfd_points(session(events)))


def choices(*pairs: tuple[PhysicalAction, float]) -> ActionPredictions:
    return ActionPredictions(
        actions=np.array([action.nfd_class for action, _ in pairs], dtype=np.int64),
        angles=np.array([angle for _, angle in pairs], dtype=np.float64),
    )


KFC, IKEA = LandmarkName.KFC, LandmarkName.IKEA
TURN, STOP = ActionValue.J_TURN, ActionValue.STOP
FULLER = StreetName.FULLER
J, LF, ST = PhysicalAction.J_TURN, PhysicalAction.LANE_FOLLOW, PhysicalAction.STOP

TRUTH = [(KFC,), (TURN, FULLER), (), (TURN,)]
GUESS = [(IKEA,), (TURN, FULLER), (), (TURN, KFC)]
# Pairs: right TURN, FULLER, TURN (3); missed KFC (1); made up IKEA, KFC (2). Micro F1 = 6 / (6 + 3).


def test_move_accuracy_by_hand() -> None:
    predicted = guesses((), (), (), moves=[DialogueMove.INSTRUCT, DialogueMove.ALIGN, DialogueMove.INSTRUCT])
    assert MoveAccuracy().compute(predicted, acts((), (), ())) == pytest.approx(2 / 3)


def test_slot_f1_micro_by_hand() -> None:
    assert SlotF1().compute(guesses(*GUESS), acts(*TRUTH)) == pytest.approx(6 / 9)


def test_slot_f1_macro_is_the_mean_over_labels_that_occur() -> None:
    # KFC: 0 right, missed once, made up once: 0. TURN and FULLER: 1. IKEA does not occur.
    assert SlotF1(average="macro").compute(guesses(*GUESS), acts(*TRUTH)) == pytest.approx(2 / 3)


def test_slot_type_f1_counts_a_wrong_value_of_the_right_slot() -> None:
    # Right: Landmark; Action, Street; Action (4). Made up: Landmark at the last point (1).
    assert SlotF1(average="type").compute(guesses(*GUESS), acts(*TRUTH)) == pytest.approx(8 / 9)


def test_point_without_slots_counts_in_no_f1() -> None:
    more = SlotF1().compute(guesses(*GUESS, (), ()), acts(*TRUTH, (), ()))
    assert more == SlotF1().compute(guesses(*GUESS), acts(*TRUTH))
    assert math.isnan(SlotF1().compute(guesses((), ()), acts((), ())))


def test_slot_score_of_the_paper_counts_exact_matches_and_empty_ones_too() -> None:
    assert SlotScorePaper().compute(guesses(*GUESS), acts(*TRUTH)) == 0.5
    assert SlotScorePaper().compute(guesses((), (), (), ()), acts(*TRUTH)) == 0.25


def test_action_accuracy_by_hand() -> None:
    points = decisions((J, 90.0), (ST, None), (LF, None))
    assert ActionAccuracy().compute(choices((J, 0), (ST, 0), (ST, 0)), points) == pytest.approx(2 / 3)


@pytest.mark.parametrize(
    ("truth", "guess", "right", "right_in_paper"),
    [
        (90.0, 90.0, True, True),
        (90.0, 104.9, True, True),
        (90.0, 105.0, False, False),
        (90.0, 75.0, False, False),
        (179.0, -179.0, True, False),
        (-180.0, 179.0, True, False),
        (170.0, -174.0, False, False),
        (0.0, 0.0, True, True),
        (-90.0, 90.0, False, False),
    ],
)
def test_angle_is_right_below_fifteen_degrees_on_the_circle(
    truth: float, guess: float, right: bool, right_in_paper: bool
) -> None:
    points, predicted = decisions((J, truth)), choices((J, guess))
    assert ArgumentAccuracy().compute(predicted, points) == right
    assert JointAccuracy().compute(predicted, points) == right
    assert ArgumentAccuracy(wrap=False).compute(predicted, points) == right_in_paper
    assert JointAccuracyPaper().compute(predicted, points) == right_in_paper


def test_joint_needs_the_action_too() -> None:
    points = decisions((J, 0.0), (ST, None), (LF, None), (J, 45.0))
    predicted = choices((LF, 0), (ST, 0), (LF, 90), (J, 40))
    assert ArgumentAccuracy().compute(predicted, points) == 0.75
    assert JointAccuracy().compute(predicted, points) == 0.5


def test_unknown_angle_counts_in_no_argument_metric() -> None:
    points = decisions((J, None), (ST, None))
    predicted = choices((J, 90), (ST, 0))
    assert ArgumentAccuracy().compute(predicted, points) == 1.0
    assert JointAccuracy().compute(predicted, points) == 1.0
    assert ActionAccuracy().compute(predicted, points) == 1.0


@pytest.mark.parametrize("metric", [MoveAccuracy(), SlotF1(), SlotF1(average="macro"), SlotScorePaper()])
def test_no_points_give_no_number_for_acts(metric: Metric[Any, Any]) -> None:
    assert math.isnan(metric.compute(act_labels([]), []))


@pytest.mark.parametrize("metric", [ActionAccuracy(), ArgumentAccuracy(), JointAccuracy()])
def test_no_points_give_no_number_for_actions(metric: Metric[Any, Any]) -> None:
    assert math.isnan(metric.compute(action_labels([]), []))


def test_labels_themselves_score_one() -> None:
    points = acts(*TRUTH)
    for metric in (MoveAccuracy(), SlotF1(), SlotF1(average="macro"), SlotF1(average="type"), SlotScorePaper()):
        assert metric.compute(act_labels(points), points) == 1.0


def test_lengths_must_agree() -> None:
    with pytest.raises(ValueError, match="1 predictions for 2 points"):
        MoveAccuracy().compute(guesses(()), acts((), ()))


def test_predictions_out_of_range_are_refused() -> None:
    with pytest.raises(ValueError, match=r"moves must be .* 0\.\.14"):
        ActPredictions(moves=np.array([15]), slots=np.zeros((1, 69), dtype=np.bool_))
    with pytest.raises(ValueError, match="slots have shape"):
        ActPredictions(moves=np.array([1]), slots=np.zeros((1, 68), dtype=np.bool_))
    with pytest.raises(ValueError, match=r"actions must be .* 0\.\.5"):
        ActionPredictions(actions=np.array([6]), angles=np.zeros(1))
    with pytest.raises(ValueError, match="angles have shape"):
        ActionPredictions(actions=np.array([1]), angles=np.zeros(2))


@given(bits=arrays(np.bool_, st.tuples(st.just(2), st.integers(1, 6), st.just(len(LABELS))), elements=st.booleans()))
@settings(max_examples=40, deadline=None)
def test_f1_equals_scikit_learn(bits: np.ndarray[Any, np.dtype[np.bool_]]) -> None:
    metrics = pytest.importorskip("sklearn.metrics")
    truth, guess = bits
    if not truth.any():
        return
    points = acts(*(tuple(decode_slots([int(bit) for bit in row])) for row in truth))
    predicted = ActPredictions(moves=np.zeros(len(guess), dtype=np.int64), slots=guess)
    occurring = np.flatnonzero(truth.any(axis=0))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        micro = metrics.f1_score(truth, guess, average="micro", zero_division=0)
        macro = metrics.f1_score(truth, guess, average="macro", labels=occurring, zero_division=0)
    assert SlotF1().compute(predicted, points) == pytest.approx(micro)
    assert SlotF1(average="macro").compute(predicted, points) == pytest.approx(macro)


def test_confusion_has_labels_as_rows() -> None:
    matrix = confusion_matrix(np.array([0, 0, 1]), np.array([0, 1, 1]), 3)
    assert matrix.tolist() == [[1, 1, 0], [0, 1, 0], [0, 0, 0]]
    shares = per_class_accuracy(matrix)
    assert shares[:2].tolist() == [0.5, 1.0] and math.isnan(shares[2])


@given(pairs=st.lists(st.tuples(st.integers(0, 14), st.integers(0, 14)), min_size=1, max_size=30))
@settings(max_examples=40, deadline=None)
def test_accuracies_and_confusion_equal_scikit_learn(pairs: list[tuple[int, int]]) -> None:
    metrics = pytest.importorskip("sklearn.metrics")
    truth, guess = np.array(pairs, dtype=np.int64).T
    none = np.zeros((len(pairs), len(LABELS)), dtype=np.bool_)
    labels, predicted = ActPredictions(moves=truth, slots=none), ActPredictions(moves=guess, slots=none)
    assert MoveAccuracy().compute(predicted, labels) == pytest.approx(metrics.accuracy_score(truth, guess))
    matrix = confusion_matrix(truth, guess, 15)
    assert np.array_equal(matrix, metrics.confusion_matrix(truth, guess, labels=range(15)))
    occurring = np.unique(truth)
    recall = metrics.recall_score(truth, guess, average=None, labels=occurring, zero_division=0)
    assert per_class_accuracy(matrix)[occurring] == pytest.approx(recall)


@given(bits=arrays(np.bool_, st.tuples(st.just(2), st.integers(1, 6), st.just(len(LABELS))), elements=st.booleans()))
@settings(max_examples=30, deadline=None)
def test_slot_score_of_the_paper_equals_subset_accuracy_of_scikit_learn(
    bits: np.ndarray[Any, np.dtype[np.bool_]],
) -> None:
    metrics = pytest.importorskip("sklearn.metrics")
    moves = np.zeros(bits.shape[1], dtype=np.int64)
    labels, predicted = ActPredictions(moves=moves, slots=bits[0]), ActPredictions(moves=moves, slots=bits[1])
    assert SlotScorePaper().compute(predicted, labels) == pytest.approx(metrics.accuracy_score(bits[0], bits[1]))
    assert SlotScorePaper().compute(labels, labels) == 1.0


ANGLES = st.lists(st.tuples(st.integers(0, 5), st.floats(-180, 179.9)), min_size=1, max_size=12)


def driven(pairs: list[tuple[int, float]]) -> ActionPredictions:
    return ActionPredictions(
        actions=np.array([action for action, _ in pairs], dtype=np.int64),
        angles=np.array([angle for _, angle in pairs]),
    )


@given(truth=ANGLES, turns=st.integers(-3, 3), error=st.floats(-14.9, 14.9))
@settings(max_examples=60, deadline=None)
def test_full_turns_do_not_change_argument_accuracy(truth: list[tuple[int, float]], turns: int, error: float) -> None:
    labels = driven(truth)
    predicted = driven([(action, angle + error + 360.0 * turns) for action, angle in truth])
    assert ArgumentAccuracy().compute(predicted, labels) == JointAccuracy().compute(predicted, labels) == 1.0
    assert ArgumentAccuracyPaper().compute(predicted, labels) == JointAccuracyPaper().compute(predicted, labels)
    assert JointAccuracyPaper().compute(predicted, labels) == (1.0 if turns == 0 else 0.0)


@given(truth=ANGLES, guess=ANGLES)
@settings(max_examples=60, deadline=None)
def test_joint_accuracy_is_bounded_by_action_and_argument_accuracy(
    truth: list[tuple[int, float]], guess: list[tuple[int, float]]
) -> None:
    count = min(len(truth), len(guess))
    labels, predicted = driven(truth[:count]), driven(guess[:count])
    joint, action = JointAccuracy().compute(predicted, labels), ActionAccuracy().compute(predicted, labels)
    argument = ArgumentAccuracy().compute(predicted, labels)
    assert max(0.0, action + argument - 1.0) - 1e-9 <= joint <= min(action, argument)
    assert JointAccuracyPaper().compute(predicted, labels) <= joint, "wrapping can only forgive"


def test_points_and_their_labels_are_scored_alike() -> None:
    points, predicted = acts(*TRUTH), guesses(*GUESS)
    for metric in (MoveAccuracy(), SlotF1(), SlotScorePaper()):
        assert metric.compute(predicted, points) == metric.compute(predicted, act_labels(points))
