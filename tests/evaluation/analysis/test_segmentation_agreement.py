"""Agreement on the borders of exchanges and transactions; figures worked by hand."""

from __future__ import annotations

import pytest

from dorothie_gym.evaluation.analysis import UnitSpan, segmentation_agreement, segmentation_alpha
from dorothie_gym.evaluation.analysis.segmentation_agreement import sites_of


def units(text: str) -> list[UnitSpan]:
    """Returns spans of one word each, named by a letter: their unit; "-" is in none, "?" is not finished."""
    return [UnitSpan(1, None if unit in "-?" else ord(unit), unit != "?") for unit in text]


def test_borders_are_where_the_unit_changes_whatever_its_number() -> None:
    assert [site for (site,) in sites_of([units("aab-bb")])] == [False, True, True, True, False]
    found = segmentation_agreement([units("aabbcc")], [units("xxyyzz")])
    assert (found.kappa, found.similarity, found.sites, found.borders) == (1.0, 1.0, 5, (2, 2))


@pytest.mark.parametrize(
    ("first", "second", "similarity"),
    [
        # Words split into letters, as in the documentation of SegEval 2.0.11, by the same author.
        ("aabbccddd", "aabbbcddd", 1 - 0.5 / 3),  # au-to-ma-tic and au-tom-a-tic: two common, one near
        ("aaabbbbccdddd", "aaabbbbbccccc"[:12] + "c", 1 - 1.5 / 3),  # seg-men-ta-tion and seg-ment-ation
        ("aaa", "abb", 0.0),  # fun and f-un
        ("aab", "abb", 0.5),
        ("abba", "aabb", 1 - (0.5 + 1) / 2),  # the first of two neighbours is near, the second one missed
    ],
)
def test_similarity_counts_a_border_that_is_off_by_one_as_half(first: str, second: str, similarity: float) -> None:
    assert segmentation_agreement([units(first)], [units(second)]).similarity == pytest.approx(similarity)
    assert segmentation_agreement([units(second)], [units(first)]).similarity == pytest.approx(similarity)


def test_kappa_corrects_for_chance() -> None:
    found = segmentation_agreement([units("aabbb"), units("ccdd")], [units("aabbc"), units("cddd")])
    # Sites: 4 + 3. First: -X--, -X-; second: -X-X, X--. 4 of 7 agree, by chance (2/7)(3/7) + (5/7)(4/7) = 26/49.
    assert (found.sites, found.borders) == (7, (2, 3))
    assert found.kappa == pytest.approx((4 / 7 - 26 / 49) / (1 - 26 / 49))
    # One common border, one missed, one near in the other session.
    assert found.similarity == pytest.approx(1 - 1.5 / 3)


def test_spans_with_other_borders_meet_at_the_borders_of_both() -> None:
    first = [UnitSpan(2, 1), UnitSpan(3, 1), UnitSpan(1, 2)]
    second = [UnitSpan(3, 1), UnitSpan(2, 2), UnitSpan(1, 3)]
    assert list(sites_of([first, second])) == [(False, False), (False, True), (True, True)]
    with pytest.raises(ValueError, match=r"\[6, 5\] words"):
        list(sites_of([first, second[:2]]))


def test_spans_that_are_not_finished_and_sessions_without_borders_have_no_figures() -> None:
    found = segmentation_agreement([units("aab??b")], [units("aabbbc")])
    assert (found.sites, found.borders, found.kappa) == (2, (1, 1), 1.0)
    for text in ("aaa", "", "a"):
        none = segmentation_agreement([units(text)], [units(text)])
        assert none.kappa is None and none.similarity is None


def test_alpha_of_three_annotators_of_whom_one_did_not_judge_everything() -> None:
    pytest.importorskip("krippendorff", reason="needs the extra agreement")
    rows = [[units("aabb")], [units("aabb")], [units("abb?")]]
    # Sites: (-,-,X), (X,X,-), (-,-,missing): 5 of 8 marks are none, 3 are borders. Observed disagreement, of ordered
    # pairs over m - 1: 4/2 + 4/2 = 4; expected: 2 * 5 * 3 / 7. Alpha is 1 - 4 / (30/7).
    assert segmentation_alpha(rows) == pytest.approx(1 - 4 / (30 / 7))
    assert segmentation_alpha([[None], [units("ab")], [None]]) is None
