"""Claims of the paper about people and cars, on dialogues that fulfil them and on dialogues that do not."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from dorothie_gym.evaluation.analysis import CLAIMS, BehaviourVerdict, verdicts_of
from dorothie_gym.ontology import ActionValue, DialogueMove, GoalStatus, LandmarkName, ObjectClass
from dorothie_gym.session.recording import Event, Session
from tests.evaluation.analysis.builders import M, car, drive, exception, human

A, KFC, IKEA = ActionValue, LandmarkName.KFC, LandmarkName.IKEA

FOG = exception(50.0, "weather", parameter="fog_density", value=80.0)
ADDED = exception(120.0, "task_trigger", subgoal=1, landmark="Ikea", status="Ongoing")


def ordinary(start: float, turns: int) -> list[Event]:
    """Exchanges in which nothing is out of the ordinary: a command, and `turns` answers to it."""
    answers = [event for k in range(turns) for event in car(start + 2 + 2 * k, "right", M.ACKNOWLEDGE)]
    return [*human(start, "left", M.INSTRUCT, A.J_TURN), *answers]


def as_in_the_paper(quiet: int = 3) -> Session:
    return drive(
        *(ordinary(2.0 + 12.0 * k, 1 + k % 2) for k in range(quiet)),
        FOG,
        car(54.0, "this fog", M.EXPLAIN, ObjectClass.SKY, A.SPEED_CHANGE),
        car(56.0, "shall I slow down", M.QUERY_YN, A.SPEED_CHANGE),
        human(58.0, "yes", M.REPLY_Y),
        ADDED,
        human(124.0, "Ikea is new", M.INSTRUCT, IKEA, GoalStatus.PENDING),
        car(127.0, "before the other", M.CHECK),
        human(129.0, "Ikea last", M.INSTRUCT, IKEA, GoalStatus.PENDING),
        car(132.0, "Ikea last", M.CONFIRM, IKEA),
        seconds=240.0,
    )


def verdicts(sessions: Sequence[Session]) -> dict[str, BehaviourVerdict]:
    return {verdict.claim.name: verdict for verdict in verdicts_of(sessions, resamples=200)}


def test_every_claim_holds_of_talk_as_the_paper_describes_it() -> None:
    found = verdicts([as_in_the_paper(quiet) for quiet in (3, 4, 3, 4, 3, 4)])
    assert [name for name, verdict in found.items() if not verdict.holds] == []
    assert list(found) == [claim.name for claim in CLAIMS]


def test_no_claim_about_exceptions_holds_without_exchanges_that_handle_them() -> None:
    talk = [ordinary(2.0 + 12.0 * k, 1) for k in range(4)]
    around = [
        human(54.0, "slower", M.INSTRUCT, A.SPEED_CHANGE),
        car(56.0, "right", M.ACKNOWLEDGE),
        car(124.0, "Ikea", M.EXPLAIN, IKEA),
        human(127.0, "right", M.ACKNOWLEDGE),
    ]
    found = verdicts([drive(*talk, FOG, ADDED, *around, seconds=240.0)] * 4)
    # the rule itself finds the names of the car, and a mention of speed is an action
    assert [name for name, verdict in found.items() if verdict.holds] == [
        "human_mostly_instructs",
        "car_mostly_grounds",
    ]
    assert all(verdict.difference is not None for verdict in found.values())


def test_a_difference_is_of_means_over_exchanges() -> None:
    session = drive(
        ordinary(2.0, 1),
        human(20.0, "hm", M.EXPLAIN),
        FOG,
        human(60.0, "so much fog", M.EXPLAIN, ObjectClass.SKY),
        seconds=200.0,
    )
    found = verdicts([session])["environmental_human_instructs_less"]
    assert found.difference == pytest.approx(0.5)  # one Instruct in two ordinary exchanges, none in the other
    assert (found.low, found.high, found.holds) == (None, None, False), "one session tells of no interval"


def test_the_interval_is_that_of_sessions_drawn_with_replacement() -> None:
    sessions = [as_in_the_paper(quiet) for quiet in range(4)]
    first, again = verdicts_of(sessions, resamples=500, seed=1), verdicts_of(sessions, resamples=500, seed=1)
    assert first == again
    assert first != verdicts_of(sessions, resamples=500, seed=2)
    for verdict in first:
        assert verdict.low is not None and verdict.difference is not None and verdict.high is not None
        assert verdict.low <= verdict.difference <= verdict.high


def test_comparison_without_exceptions_is_undefined() -> None:
    found = verdicts([drive(ordinary(2.0, 1))] * 3)
    assert {name for name, verdict in found.items() if verdict.difference is not None} == {
        "human_mostly_instructs",
        "car_mostly_grounds",
    }
    assert not any(np.isnan(v.difference) for v in found.values() if v.difference is not None)
    assert all(v.difference is None and not v.holds for v in verdicts_of([]))


def test_a_verdict_is_json() -> None:
    (first, *_) = verdicts_of([as_in_the_paper()] * 2, resamples=10)
    assert list(first.to_json()) == ["name", "title", "difference", "low", "high", "holds"]
    assert first.claim.title.startswith("participant") and DialogueMove.INSTRUCT.label in first.claim.title
