"""Agreement of annotators who split utterances differently; figures worked by hand."""

from __future__ import annotations

import math

import pytest

from dorothie_gym.evaluation.analysis import LabelledSpan, agreement_of, alpha_of
from dorothie_gym.evaluation.analysis.span_agreement import nominal_alpha
from dorothie_gym.ontology import LandmarkName
from tests.evaluation.analysis.builders import M, act

pytest.importorskip("krippendorff", reason="needs the extra agreement")

GO, TELL, YES = act(M.INSTRUCT), act(M.EXPLAIN), act(M.REPLY_Y)


def spans(*parts: tuple[int, object]) -> list[LabelledSpan]:
    return [LabelledSpan(words, label) for words, label in parts]  # type: ignore[arg-type]


def test_equal_marks_agree_completely() -> None:
    marks = [spans((2, GO), (3, TELL)), spans((1, YES))]
    found = agreement_of(marks, marks)
    assert (found.moves, found.moves_of_equal_spans, found.spans, found.equal_spans, found.utterances) == (
        1.0,
        1.0,
        1.0,
        3,
        2,
    )


def test_kappa_of_equal_spans_leaves_out_the_others() -> None:
    first = [spans((2, GO)), spans((2, GO)), spans((2, TELL)), spans((2, TELL)), spans((4, GO))]
    second = [spans((2, GO)), spans((2, GO)), spans((2, GO)), spans((2, TELL)), spans((2, YES), (2, YES))]
    found = agreement_of(first, second)
    # Four equal spans, three agree; by chance (2/4)(3/4) + (2/4)(1/4) = 1/2; so (3/4 - 1/2) / (1 - 1/2) = 1/2.
    assert found.moves_of_equal_spans == pytest.approx(0.5)
    # Six pieces, three agree; by chance GO (4/6)(3/6) + TELL (2/6)(1/6) + YES 0 = 14/36; so (1/2 - 7/18) / (11/18).
    assert found.pieces == 6 and found.moves == pytest.approx((1 / 2 - 7 / 18) / (11 / 18))
    # Four equal spans of five and six.
    assert found.spans == pytest.approx(8 / 11)


def test_unfinished_utterances_are_missing() -> None:
    first = [spans((2, GO)), spans((2, GO), (1, None)), spans((1, TELL))]
    second = [spans((2, GO)), spans((3, TELL)), spans((1, TELL))]
    found = agreement_of(first, second)
    assert (found.utterances, found.pieces, found.moves) == (2, 2, 1.0)


def test_nothing_in_common_gives_no_figures() -> None:
    found = agreement_of([spans((1, None))], [spans((1, GO))])
    assert (found.moves, found.spans, found.pieces, found.moves_of_equal_spans) == (None, None, 0, None)


def test_other_words_are_refused() -> None:
    with pytest.raises(ValueError, match="words"):
        agreement_of([spans((2, GO))], [spans((3, GO))])
    with pytest.raises(ValueError, match="equally many"):
        agreement_of([spans((2, GO))], [])


def test_alpha_worked_by_hand() -> None:
    # Units AA, AB, BB: coincidences A-A 2, A-B 1, B-A 1, B-B 2; n = 6, n_A = n_B = 3.
    # Observed disagreement 2/6; expected 2 * 3 * 3 / (6 * 5) = 18/30; alpha = 1 - (1/3) / (3/5) = 4/9.
    assert nominal_alpha([["A", "A"], ["A", "B"], ["B", "B"]]) == pytest.approx(4 / 9)
    found = alpha_of(
        [[spans((1, GO)), spans((1, GO)), spans((1, TELL))], [spans((1, GO)), spans((1, TELL)), spans((1, TELL))]]
    )
    assert found.moves == pytest.approx(4 / 9) and found.pieces == 3


def test_alpha_of_four_annotators_with_missing_values_is_the_published_one() -> None:
    # Krippendorff, "Computing Krippendorff's alpha-reliability" (2011), example with four observers: nominal 0.743.
    ratings = [
        [1, 2, 3, 3, 2, 1, 4, 1, 2, None, None, None],
        [1, 2, 3, 3, 2, 2, 4, 1, 2, 5, None, 3],
        [None, 3, 3, 3, 2, 3, 4, 2, 2, 5, 1, None],
        [1, 2, 3, 3, 2, 4, 4, 1, 2, 5, 1, None],
    ]
    units = [[None if row[k] is None else str(row[k]) for row in ratings] for k in range(12)]
    assert nominal_alpha(units) == pytest.approx(0.743, abs=5e-4)


def test_alpha_of_three_annotators_counts_pieces_that_two_have_judged() -> None:
    first = [spans((4, GO)), spans((1, TELL)), None]
    second = [spans((2, GO), (2, TELL)), spans((1, TELL)), spans((1, GO))]
    third = [spans((4, GO)), spans((1, None)), None]
    found = alpha_of([first, second, third])
    # Pieces GGG, GTG, TT (third missing). G-T coincidences: 2 * 2 / 2 = 2 of 8 values; n_G = 5, n_T = 3.
    # Expected 2 * 5 * 3 / 7; alpha = 1 - 2 / (30/7).
    assert found.pieces == 3 and found.moves == pytest.approx(1 - 2 / (30 / 7))


def test_alpha_is_undefined_for_one_label() -> None:
    found = alpha_of([[spans((1, GO))], [spans((1, GO))]])
    assert found.moves is None and found.slots is None


def test_alpha_of_slots_compares_sets_of_values() -> None:
    kfc, none = act(M.INSTRUCT, LandmarkName.KFC), act(M.INSTRUCT)
    same = alpha_of([[spans((1, kfc)), spans((1, none))], [spans((1, kfc)), spans((1, none))]])
    other = alpha_of([[spans((1, kfc)), spans((1, none))], [spans((1, none)), spans((1, kfc))]])
    assert same.slots == 1.0
    assert other.slots is not None and math.isfinite(other.slots) and other.slots < 0.0
