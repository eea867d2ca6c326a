from __future__ import annotations

import numpy as np
import pytest
from sklearn.metrics import cohen_kappa_score

from dorothie_gym.errors import SessionError
from dorothie_gym.evaluation.analysis import agreement
from dorothie_gym.ontology import ActionValue, DialogueAct, LandmarkName
from dorothie_gym.session.recording import Event, Session
from tests.evaluation.analysis.builders import HUMAN, M, act, drive, said


def one(*spans: tuple[str, DialogueAct], start: float = 1.0) -> list[Event]:
    return said(start, HUMAN, *spans)


def labelled(*acts: DialogueAct, name: str = "a", **header: object) -> Session:
    """One utterance "word" for each act, three seconds apart."""
    parts = [one(("word", each), start=1.0 + 3.0 * k) for k, each in enumerate(acts)]
    return drive(*parts, **header)  # type: ignore[arg-type]  # parts and header fields of several types


GO, TELL, YES = act(M.INSTRUCT), act(M.EXPLAIN), act(M.REPLY_Y)


def test_kappa_of_moves_worked_by_hand() -> None:
    # Agreement 3 of 4; by chance (2/4)(3/4) + (2/4)(1/4) = 1/2; so (3/4 - 1/2) / (1 - 1/2) = 1/2.
    found = agreement(labelled(GO, GO, TELL, TELL), labelled(GO, GO, GO, TELL))
    assert found.moves == pytest.approx(0.5)
    assert (found.utterances, found.pieces) == (4, 4)


def test_kappa_of_slots_worked_by_hand() -> None:
    kfc, ikea = act(M.INSTRUCT, LandmarkName.KFC), act(M.INSTRUCT, LandmarkName.IKEA)
    # Two pieces of five slots: both leave 8 empty, agree on KFC, differ on Ikea. Agreement 9/10, by chance
    # (8/10)(8/10) + (1/10)(2/10) = 0.66; so 0.24 / 0.34.
    assert agreement(labelled(kfc, ikea), labelled(kfc, kfc)).slots == pytest.approx(0.24 / 0.34)


def test_kappa_is_that_of_scikit_learn() -> None:
    rng = np.random.default_rng(5)
    moves = [GO, TELL, YES, act(M.CHECK), act(M.IRRELEVANT)]
    first, second = (rng.integers(len(moves), size=40) for _ in range(2))
    second = np.where(rng.random(40) < 0.6, first, second)
    found = agreement(labelled(*(moves[k] for k in first)), labelled(*(moves[k] for k in second)))
    assert found.moves == pytest.approx(cohen_kappa_score(first, second)) and 0.3 < found.moves < 0.95


def test_an_annotation_agrees_with_itself() -> None:
    same = labelled(GO, act(M.EXPLAIN, LandmarkName.KFC, ActionValue.STOP), YES)
    found = agreement(same, same)
    assert found.moves == found.slots == pytest.approx(1.0)


def test_kappa_is_zero_at_chance_and_undefined_for_a_single_label() -> None:
    assert agreement(labelled(GO, GO, TELL, TELL), labelled(GO, TELL, GO, TELL)).moves == pytest.approx(0.0)
    found = agreement(labelled(GO, GO), labelled(GO, GO))
    assert found.moves is None and found.slots is None


def test_utterances_that_are_split_otherwise_are_compared_piece_by_piece() -> None:
    whole = drive(one(("Yes, turn left then stop.", GO)))
    split = drive(one(("Yes,", YES), ("turn left", GO), ("then stop.", TELL)))
    other = drive(one(("Yes, turn", YES), ("left then stop.", TELL)))
    assert agreement(whole, split).pieces == 3
    assert agreement(split, other).pieces == 4


@pytest.mark.parametrize(
    ("other", "message"),
    [
        (labelled(GO, seed=8), "seed is 7 in the one, 8 in the other"),
        (labelled(GO, town="elsewhere"), "town is 'crossing' in the one, 'elsewhere' in the other"),
        (labelled(GO, GO), "utterance 40 of participant is in one, and not in one"),
        (drive(one(("other words", GO))), "utterance 10 is 'word' in the one, 'other words' in the other"),
    ],
)
def test_annotations_of_different_sessions_are_refused(other: Session, message: str) -> None:
    with pytest.raises(SessionError, match="not the same session") as refused:
        agreement(labelled(GO), other)
    assert message in str(refused.value)


def test_silence_cannot_be_compared() -> None:
    with pytest.raises(SessionError, match="nothing to compare"):
        agreement(labelled(), labelled())


def test_spans_that_are_not_the_words_are_refused() -> None:
    broken = [
        Event(frame=e.frame, type=e.type, source=e.source, data={**e.data, "text": "quite other words"})
        for e in one(("yes", YES), ("left", GO))
    ]
    with pytest.raises(SessionError, match="utterance 10: the spans together are not the words"):
        agreement(drive(broken), drive(broken))
