from __future__ import annotations

import pytest

from dorothie_gym.evaluation.closed_loop import (
    METRICS,
    PENALTIES,
    SPL,
    AbandonedExchanges,
    ClarificationRate,
    DrivingScore,
    ExceptionsMet,
    ExceptionsRecovered,
    ExchangesPerSubgoal,
    GoalConditionSuccess,
    Infractions,
    InfractionScore,
    MetException,
    RecoverySeconds,
    RouteCompletion,
    Seconds,
    Success,
    TalkRecord,
    UtterancesPerSubgoal,
)
from dorothie_gym.ontology import ExceptionKind
from tests.evaluation.closed_loop.drives import record

MET = tuple(
    MetException(kind=ExceptionKind.WEATHER, met=met, seconds=seconds)
    for met, seconds in ((1.0, 4.0), (2.0, 10.0), (3.0, None), (None, None))
)


def test_success_is_the_share_of_sessions() -> None:
    assert Success().of([record(), record(), record(), record(success=False)]) == 0.75


def test_goals_are_a_mean_over_sessions() -> None:
    assert GoalConditionSuccess().of([record(live=4, reached=1), record(live=2, reached=1)]) == 0.375


def test_spl_weighs_success_by_the_way() -> None:
    assert SPL().of([record(shortest=300.0, driven=400.0)]) == 0.75
    assert SPL().of([record(shortest=300.0, driven=299.0)]) == 1.0
    assert SPL().of([record(shortest=300.0, driven=300.0, success=False)]) == 0.0
    assert SPL().of([record(shortest=None)]) is None


def test_completion_leaves_out_where_no_way_is() -> None:
    assert RouteCompletion().of([record(completion=0.5), record(completion=None), record(completion=0.0)]) == 0.25


@pytest.mark.parametrize(
    ("infractions", "score"),
    [
        ({}, 1.0),
        ({"pedestrian": 1}, 0.50),
        ({"vehicle": 2}, 0.36),
        ({"static": 1, "red_light": 1}, 0.455),
        ({"stop_sign": 1, "timeout": 1}, 0.56),
        ({"off_road": 3, "wrong_way": 1, "hit_by_others": 1}, 1.0),
    ],
)
def test_penalties_are_multiplied(infractions: dict[str, int], score: float) -> None:
    assert InfractionScore().of([record(infractions=infractions)]) == pytest.approx(score)


def test_penalties_are_those_of_the_leaderboard() -> None:
    assert sorted(PENALTIES.values()) == [0.5, 0.6, 0.65, 0.7, 0.7, 0.8]


def test_infractions_that_cost_something_are_counted() -> None:
    assert Infractions().of([record(infractions={"vehicle": 2, "off_road": 5}), record()]) == 1.0


def test_driving_score_is_completion_times_infraction_score_of_each_session() -> None:
    sessions = [record(completion=0.5, infractions={"pedestrian": 1}), record(completion=1.0)]
    assert DrivingScore().of(sessions) == pytest.approx((0.25 + 1.0) / 2)


def test_cost_of_talk_is_over_all_subgoals_and_exchanges() -> None:
    short = record(live=2, talk=TalkRecord(utterances=4, exchanges=2, abandoned=2, clarifications=0))
    long = record(live=4, talk=TalkRecord(utterances=20, exchanges=10, abandoned=1, clarifications=3))
    assert ExchangesPerSubgoal().of([short, long]) == 2.0
    assert UtterancesPerSubgoal().of([short, long]) == 4.0
    assert AbandonedExchanges().of([short, long]) == 0.25
    assert ClarificationRate().of([short, long]) == 0.25


def test_who_never_talks_has_no_rates() -> None:
    silent = record(talk=TalkRecord())
    assert AbandonedExchanges().of([silent]) is None and ClarificationRate().of([silent]) is None
    assert ExchangesPerSubgoal().of([silent]) == 0.0


def test_exceptions_are_met_recovered_from_and_timed() -> None:
    sessions = [record(exceptions=MET), record()]
    assert ExceptionsMet().of(sessions) == 1.5
    assert ExceptionsRecovered().of(sessions) == pytest.approx(2 / 3)
    assert RecoverySeconds().of(sessions) == 7.0
    assert RecoverySeconds().of([record()]) is None


def test_time_is_a_mean() -> None:
    assert Seconds().of([record(seconds=50.0), record(seconds=100.0)]) == 75.0


def test_every_metric_of_nothing_is_undefined() -> None:
    assert all(metric.of([]) is None for metric in METRICS)
    assert len({metric.key for metric in METRICS}) == len(METRICS)
