"""Timely completion, Pass^3 and sub-scores."""

from __future__ import annotations

import numpy as np
import pytest

from dorothie_gym.evaluation.closed_loop import AllTrials, RolloutResult, RolloutRow, TimelyCompletion
from dorothie_gym.evaluation.closed_loop.metrics import figures_of
from dorothie_gym.evaluation.closed_loop.results import result_from_json, worst_partner
from dorothie_gym.evaluation.closed_loop.session_record import SessionRecord
from dorothie_gym.evaluation.closed_loop.sub_scores import (
    MAX_BRAKING,
    ConductRecord,
    ExchangesAgainstReference,
    Truth,
    UnansweredQuestions,
    comfort_of,
)
from dorothie_gym.session.scenario import ReferenceDrive
from dorothie_gym.sim.config import FRAME_RATE
from tests.evaluation.closed_loop.drives import record

REFERENCE = ReferenceDrive(seconds=200.0, exchanges=12, subgoals=4)
SETTINGS = {
    "participant": "scripted",
    "co_wizard": "scripted",
    "ad_wizard": "scripted",
    "towns": ["brookside"],
    "sessions_planned": 3,
    "seed": 0,
    "config": {"max_seconds": 900.0, "word_error_rate": 0.05},
}


@pytest.mark.parametrize(
    ("seconds", "completion", "infractions", "score"),
    [
        (100.0, 1.0, {}, 1.0),
        (400.0, 1.0, {}, 1.0),
        (800.0, 1.0, {}, 0.5),
        (800.0, 0.5, {"red_light": 1}, 0.175),
        (400.0, 0.8, {"timeout": 1}, 0.56),
    ],
)
def test_timely_completion_is_the_product(
    seconds: float, completion: float, infractions: dict[str, int], score: float
) -> None:
    driven = record(seconds=seconds, completion=completion, infractions=infractions, reference=REFERENCE)
    assert TimelyCompletion().of([driven]) == pytest.approx(score)


def test_sessions_without_a_reference_have_no_timely_completion() -> None:
    assert TimelyCompletion().of([record()]) is None
    assert figures_of([record()], errored=1)["timely_completion"].mean is None
    assert figures_of([record(reference=REFERENCE, seconds=300.0)], errored=1)["timely_completion"].mean == 0.5


def test_exchanges_are_compared_with_the_reference() -> None:
    talk = record(reference=REFERENCE, live=2).talk
    assert ExchangesAgainstReference().of([record(reference=REFERENCE, live=2)]) == talk.exchanges / 2 / 3.0


def test_answers_and_truth_are_shares_of_questions_and_statements() -> None:
    sessions = [
        record(conduct=ConductRecord(questions=4, unanswered=1, statements=10, true_statements=9)),
        record(conduct=ConductRecord(questions=4, unanswered=3)),
        record(),
    ]
    assert UnansweredQuestions().of(sessions) == 0.5
    assert Truth().of(sessions) == 0.9


def rows(*trials: tuple[int, int, bool]) -> tuple[RolloutRow, ...]:
    return tuple(
        RolloutRow(number=n, town="brookside", seed=seed, trial=trial, record=record(success=success))
        for n, (seed, trial, success) in enumerate(trials)
    )


def test_pass_3_needs_three_successes_of_one_scenario() -> None:
    result = RolloutResult(
        settings=SETTINGS,
        rows=rows((1, 0, True), (1, 1, True), (1, 2, True), (2, 0, True), (2, 1, False), (2, 2, True), (3, 0, True)),
    )
    figure = result.figures()[AllTrials.key]
    assert figure.mean == 0.5
    assert figure.low is not None and figure.high is not None and 0.0 < figure.low < 0.5 < figure.high < 1.0


def test_without_trials_there_is_no_pass_3() -> None:
    assert RolloutResult(settings=SETTINGS, rows=rows((1, 0, True))).figures()[AllTrials.key].mean is None


def test_results_with_tiers_are_read_back() -> None:
    driven: SessionRecord = record(reference=REFERENCE, conduct=ConductRecord(questions=1, moving=2.5))
    result = RolloutResult(
        settings=SETTINGS,
        rows=(RolloutRow(number=0, town="brookside", seed=1, trial=2, participant="silent", record=driven),),
    )
    again = result_from_json(result.to_json(), "here")  # type: ignore[arg-type]
    assert again.rows == result.rows


def test_the_worst_partner_has_the_lowest_timely_completion() -> None:
    made = [
        RolloutRow(
            number=n, town="brookside", seed=n, participant=name, record=record(reference=REFERENCE, completion=c)
        )
        for n, (name, c) in enumerate((("one", 0.9), ("two", 0.2), ("one", 0.1), ("two", 0.7)))
    ]
    result = RolloutResult(settings=SETTINGS, rows=tuple(made))
    assert worst_partner(result.per_partner()) == "two"
    assert worst_partner({}) is None


def test_gentle_driving_is_comfortable_and_a_hard_stop_is_not() -> None:
    seconds = np.arange(0, 20 * FRAME_RATE) / FRAME_RATE
    gentle = np.minimum(1.5 * seconds, 10.0)
    moving, uncomfortable, brakings = comfort_of(gentle)
    assert moving == pytest.approx(19.5, abs=0.6) and uncomfortable == 0.0 and brakings == 0
    hard = np.where(seconds < 15.0, gentle, np.maximum(10.0 - (MAX_BRAKING + 2.0) * (seconds - 15.0), 0.0))
    _, uncomfortable, brakings = comfort_of(hard)
    assert brakings == 1 and uncomfortable > 0.5


def test_a_standing_car_has_no_discomfort() -> None:
    assert comfort_of(np.zeros(300)) == (0.0, 0.0, 0)
    assert comfort_of(np.zeros(10)) == (0.0, 0.0, 0)
