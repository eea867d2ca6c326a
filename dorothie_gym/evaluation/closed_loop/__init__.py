"""Agents in the loop: what is measured of sessions that they drive and talk in, and tables over many."""

from dorothie_gym.evaluation.closed_loop.intervals import Interval, figures_of, interval_of
from dorothie_gym.evaluation.closed_loop.metrics import (
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
    Metric,
    RecoverySeconds,
    RouteCompletion,
    Seconds,
    Success,
    UtterancesPerSubgoal,
)
from dorothie_gym.evaluation.closed_loop.plan import RolloutPlan, RolloutSettings, parse_towns
from dorothie_gym.evaluation.closed_loop.record import SessionRecord, measure
from dorothie_gym.evaluation.closed_loop.recovery import MetException, met_exceptions
from dorothie_gym.evaluation.closed_loop.results import RolloutError, RolloutResult, Row, read_result
from dorothie_gym.evaluation.closed_loop.running import roll_out
from dorothie_gym.evaluation.closed_loop.talk import TalkRecord, talk_of
from dorothie_gym.evaluation.closed_loop.task import TaskRecord, task_after, task_at_end

__all__ = [
    "AbandonedExchanges",
    "ClarificationRate",
    "DrivingScore",
    "ExceptionsMet",
    "ExceptionsRecovered",
    "ExchangesPerSubgoal",
    "GoalConditionSuccess",
    "InfractionScore",
    "Infractions",
    "Interval",
    "METRICS",
    "MetException",
    "Metric",
    "PENALTIES",
    "RecoverySeconds",
    "RolloutError",
    "RolloutPlan",
    "RolloutResult",
    "RolloutSettings",
    "RouteCompletion",
    "Row",
    "SPL",
    "Seconds",
    "SessionRecord",
    "Success",
    "TalkRecord",
    "TaskRecord",
    "UtterancesPerSubgoal",
    "figures_of",
    "interval_of",
    "measure",
    "met_exceptions",
    "parse_towns",
    "read_result",
    "roll_out",
    "talk_of",
    "task_after",
    "task_at_end",
]
