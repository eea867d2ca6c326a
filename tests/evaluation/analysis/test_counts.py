from __future__ import annotations

import pytest

from dorothie_gym.archive import Fold
from dorothie_gym.evaluation.analysis import Counts, Units
from dorothie_gym.evaluation.analysis.corpus_stats import effective_actions
from dorothie_gym.evaluation.analysis.diversity import plain, words_of
from dorothie_gym.ontology import ActionValue, LandmarkName, PhysicalAction, StreetName
from tests.evaluation.analysis.builders import CAR, HUMAN, M, act, car, did, drive, hazard, human, said

P = PhysicalAction


def counted(*parts: object, fold: Fold | None = None) -> Counts:
    session = drive(*parts)  # type: ignore[arg-type]  # parts of several types
    counts = Counts()
    counts.add(session, Units(session), fold)
    return counts


def test_words_are_compared_without_case_and_punctuation() -> None:
    assert words_of("Don’t stop: 7-Eleven, LEFT!") == ("don't", "stop", "7-eleven", "left")
    assert plain("Okay.") == plain("okay") and plain("...") == ""


def test_a_small_drive_counted_by_hand() -> None:
    counts = counted(
        human(1.0, "To the KFC, please.", M.INSTRUCT, LandmarkName.KFC),
        car(4.0, "Okay.", M.ACKNOWLEDGE),
        said(8.0, HUMAN, ("Yes,", act(M.CONFIRM)), ("left on Fuller", act(M.INSTRUCT, *_TURN)), seconds=2.0),
        car(12.0, "okay", M.ACKNOWLEDGE),
        did(13.0, P.J_TURN, angle=80.0),
        fold=Fold.TRAIN,
    ).to_json()
    assert counts == {
        "sessions": 1,
        "control_hours": pytest.approx(59.9667 / 3600, abs=1e-6),
        "audio_hours": pytest.approx(3.5 / 3600),
        "utterances": 4,
        "words": 4 + 1 + 4 + 1,
        "vocabulary": 9,
        "transactions": 1,
        "exchanges": 2,
        "moves": 5,
        "slot_values": 3,
        "physical_actions": 1,
        "folds": {"train": 1},
        "distinct_utterance_ratio": 0.75,
    }


_TURN = (ActionValue.J_TURN, StreetName.FULLER)


def test_speech_of_the_car_and_overlapping_speech_do_not_lengthen_the_audio() -> None:
    counts = counted(
        said(1.0, HUMAN, ("one", act(M.EXPLAIN)), seconds=2.0),
        said(2.0, HUMAN, ("two", act(M.EXPLAIN)), seconds=2.0),
        said(9.0, CAR, ("three", act(M.EXPLAIN)), seconds=2.0),
    )
    assert counts.audio_seconds == pytest.approx(3.0)


def test_ineffective_actions_and_stops_of_the_car_itself_are_not_counted() -> None:
    session = drive(
        did(1.0, P.START),
        did(2.0, P.LANE_FOLLOW),
        did(3.0, P.LANE_FOLLOW),
        hazard(4.0),
        did(5.0, P.LIGHT_CHANGE, up=True),
        did(6.0, P.LIGHT_CHANGE, up=True),
        did(7.0, P.LIGHT_CHANGE, up=False),
        did(8.0, P.SPEED_CHANGE, up=True),
        did(9.0, P.SPEED_CHANGE, up=True),
        did(10.0, P.STOP),
        did(11.0, P.STOP),
    )
    kept = [round(action.frame / 30) for action in effective_actions(session)]
    assert kept == [1, 2, 5, 7, 8, 9, 10]


def test_counts_of_a_session_without_speech() -> None:
    counts = counted().to_json()
    assert counts["utterances"] == counts["exchanges"] == counts["transactions"] == 0
    assert counts["distinct_utterance_ratio"] is None and counts["folds"] == {}
