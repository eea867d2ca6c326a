from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dorothie_gym.archive import Task
from dorothie_gym.errors import PredictionError
from dorothie_gym.evaluation.analysis import Handled
from dorothie_gym.evaluation.teacher_forced import (
    ActionPredictions,
    CorpusLabels,
    TaskPredictions,
    labels_of,
    score_runs,
)
from tests.evaluation.teacher_forced.corpora import corpus, oracle


@pytest.fixture(scope="module")
def labels(tmp_path_factory: pytest.TempPathFactory) -> CorpusLabels:
    return labels_of(corpus(tmp_path_factory.mktemp("corpus")))


@pytest.fixture(scope="module")
def one(tmp_path_factory: pytest.TempPathFactory) -> CorpusLabels:
    """The labels of a single session: 4 UfN, 3 RfN and 5 NfD points."""
    return labels_of(corpus(tmp_path_factory.mktemp("one"), ("test/seen",)))


def test_a_perfect_oracle_has_everything_right(labels: CorpusLabels) -> None:
    (run,) = score_runs(labels, oracle(labels))
    for part in ("seen", "unseen", "all"):
        assert len(run.parts[part].metrics) == 18
        assert set(run.parts[part].metrics.values()) == {1.0}
    assert run.parts["all"].points == {Task.UFN: 8, Task.RFN: 6, Task.NFD: 10}


def test_labels_shifted_by_two_points_score_as_computed_by_hand(one: CorpusLabels) -> None:
    (run,) = score_runs(one, oracle(one, shift=2))
    metrics = run.parts["seen"].metrics
    # UfN: Instruct(KFC), ReplyY, Instruct(Fuller, JTurn), Explain(Complete); said: the last two, then the first two.
    assert metrics["ufn_move_accuracy"] == 0.5
    assert metrics["ufn_slot_f1"] == metrics["ufn_slot_f1_paper"] == 0.0
    # RfN: Acknowledge, Explain(JTurn), Acknowledge; said: Explain(JTurn), Acknowledge, Acknowledge.
    assert metrics["rfn_move_accuracy"] == metrics["rfn_slot_f1_paper"] == pytest.approx(1 / 3)
    # NfD: Start, JTurn 88, UTurn, JTurn -179, Stop; said: JTurn -179, Stop, Start, JTurn 88, UTurn.
    assert metrics["nfd_action_accuracy"] == 0.2
    assert metrics["nfd_argument_accuracy"] == 0.4
    assert metrics["nfd_joint_accuracy"] == 0.0
    matrix = run.parts["seen"].confusion[Task.NFD]
    assert matrix.sum() == 5 and np.trace(matrix) == 1


def test_angle_off_by_a_full_turn_is_right_except_in_the_papers_protocol(one: CorpusLabels) -> None:
    nfd = oracle(one)[2]
    assert isinstance(nfd.predicted, ActionPredictions)
    turned = ActionPredictions(actions=nfd.predicted.actions, angles=nfd.predicted.angles + 358.0)
    (run,) = score_runs(one, [replace(nfd, predicted=turned)])
    metrics = run.parts["seen"].metrics
    assert metrics["nfd_joint_accuracy"] == metrics["nfd_argument_accuracy"] == 1.0
    assert metrics["nfd_joint_accuracy_paper"] == metrics["nfd_argument_accuracy_paper"] == 0.0


def test_rows_may_come_in_any_order(labels: CorpusLabels) -> None:
    given = oracle(labels)[0]
    order = np.random.default_rng(0).permutation(len(given.events))
    mixed = replace(
        given, sessions=given.sessions[order], events=given.events[order], predicted=given.predicted.take(order)
    )
    (run,) = score_runs(labels, [mixed])
    assert run.parts["all"].metrics["ufn_move_accuracy"] == 1.0


def test_points_are_divided_by_handled_exception(labels: CorpusLabels) -> None:
    (run,) = score_runs(labels, oracle(labels))
    for part in ("seen", "unseen"):
        for task, count in run.parts[part].points.items():
            assert sum(run.handled[part, kind].points[task] for kind in Handled) == count
    assert run.handled["seen", Handled.NONE].metrics["ufn_move_accuracy"] == 1.0


def test_seeds_and_models_are_scored_apart(labels: CorpusLabels) -> None:
    runs = score_runs(labels, [*oracle(labels, seed=1), *oracle(labels, seed=2, shift=1), *oracle(labels, "other")])
    assert [(run.model, run.seed) for run in runs] == [("oracle", 1), ("oracle", 2), ("other", 0)]
    assert [run.parts["all"].metrics["nfd_joint_accuracy"] for run in runs] == [1.0, 0.0, 1.0]


def cut(given: TaskPredictions, rows: slice) -> TaskPredictions:
    taken = np.arange(len(given.events))[rows]
    return replace(
        given, sessions=given.sessions[rows], events=given.events[rows], predicted=given.predicted.take(taken)
    )


def test_error_of_missing_point_names_point_and_remedy(labels: CorpusLabels) -> None:
    given = cut(oracle(labels)[0], slice(2, None))
    truth = labels.tasks[Task.UFN]
    first = f"2 of 8 points have no row, the first is session of-test-seen, event {truth.events[0]}; predict them, or"
    with pytest.raises(PredictionError, match=first):
        score_runs(labels, [given])


def test_a_point_that_the_model_leaves_out_is_counted_and_not_scored(labels: CorpusLabels) -> None:
    whole = oracle(labels)[0]
    left_out = {(str(whole.sessions[0]), int(whole.events[0])): "too long"}
    (run,) = score_runs(labels, [replace(cut(whole, slice(1, None)), left_out=left_out)])
    assert run.parts["all"].points == {Task.UFN: 7} and run.parts["all"].metrics["ufn_move_accuracy"] == 1.0
    assert [(skipped.session, skipped.reason) for skipped in run.left_out] == [("of-test-seen", "too long")]


def test_sessions_of_other_folds_are_passed_over_and_unknown_ones_refused(labels: CorpusLabels) -> None:
    given = oracle(labels)[0]
    more = {
        "events": np.append(given.events, 1),
        "predicted": given.predicted.take(np.append(np.arange(len(given.events)), 0)),
    }
    (run,) = score_runs(labels, [replace(given, sessions=np.append(given.sessions, "of-train"), **more)])
    assert run.ignored == 1
    with pytest.raises(PredictionError, match="session nowhere: .* has no such session; .* like of-test-seen"):
        score_runs(labels, [replace(given, sessions=np.append(given.sessions, "nowhere"), **more)])


def test_error_of_event_without_point_names_the_nearest_points(one: CorpusLabels) -> None:
    given = oracle(one)[0]
    events = given.events.copy()
    events[1] = 400
    last = given.events.tolist()[-3:]
    words = f"event 400: is no point of ufn; .* its nearest points are events {', '.join(map(str, last))}"
    with pytest.raises(PredictionError, match=words):
        score_runs(one, [replace(given, events=events)])


def test_a_point_with_two_rows_is_refused(one: CorpusLabels) -> None:
    given = oracle(one)[0]
    events = given.events.copy()
    events[1] = events[0]
    with pytest.raises(PredictionError, match="a point has two rows"):
        score_runs(one, [replace(given, events=events)])


def test_a_model_and_seed_that_come_twice_are_refused(one: CorpusLabels) -> None:
    with pytest.raises(PredictionError, match="model oracle, seed 0, ufn: is given twice; leave one out"):
        score_runs(one, [*oracle(one), *oracle(one)])
