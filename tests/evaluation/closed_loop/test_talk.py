from __future__ import annotations

from dorothie_gym.evaluation.closed_loop import TalkRecord, talk_of
from tests.evaluation.analysis.builders import M, car, drive, human


def test_talk_is_counted_with_its_repairs() -> None:
    session = drive(
        human(1.0, "turn left", M.INSTRUCT),
        car(3.0, "sorry", M.CONFUSE),
        human(5.0, "left please", M.CLARIFY),
        car(7.0, "okay", M.ACKNOWLEDGE),
        human(30.0, "stop there", M.INSTRUCT),  # nobody answers
    )
    assert talk_of(session) == TalkRecord(utterances=5, exchanges=2, abandoned=1, clarifications=2)


def test_silence_costs_nothing() -> None:
    assert talk_of(drive()) == TalkRecord()
