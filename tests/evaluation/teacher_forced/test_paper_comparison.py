from __future__ import annotations

import pytest

from dorothie_gym.evaluation.analysis.intervals import Estimate
from dorothie_gym.evaluation.teacher_forced import COLUMNS, ModelVerdict, above, findings, paper_figures
from dorothie_gym.evaluation.teacher_forced.paper_comparison import (
    FULL,
    NO_HISTORY,
    NO_MAP,
    NO_UTTERANCE,
    OTHER_ABLATIONS,
    TUNED,
    paper_figure,
    paper_name,
)

NOISE = (-0.01, 0.0, 0.01)


class Table:
    """Returns figures of models: 0.6 with a little noise over three seeds, unless given."""

    def __init__(self, means: dict[tuple[str, str], float], seeds: int = 3) -> None:
        self.means = means
        self.seeds = seeds

    def __call__(self, model: str, part: str, metric: str) -> Estimate:
        mean = self.means.get((model, metric), self.means.get((model, ""), 0.6))
        # Noise of another order in each model: differences of equals are not zero everywhere.
        turn = len(model) % 3
        return Estimate.of({k: mean + NOISE[(k + turn) % 3] / 4 for k in range(self.seeds)})


def verdicts(table: Table) -> list[ModelVerdict]:
    return [finding.verdict for finding in findings(table, "seen")]


def test_findings_that_appear_hold() -> None:
    table = Table(
        {
            (NO_HISTORY, ""): 0.3,
            (TUNED, ""): 0.8,
            (TUNED, "nfd_joint_accuracy"): 0.2,
            ("TOTO (- Current Utterance)", "ufn_move_accuracy"): 0.5,
        }
    )
    assert verdicts(table) == [ModelVerdict.HOLDS] * 4


def test_differences_the_other_way_do_not_hold() -> None:
    table = Table({(NO_HISTORY, ""): 0.9, (TUNED, ""): 0.3, (NO_MAP, ""): 0.2, (OTHER_ABLATIONS[3], ""): 0.9})
    assert verdicts(table) == [ModelVerdict.FAILS] * 4


def test_claims_without_difference_are_undecided_except_hardly_any() -> None:
    assert verdicts(Table({})) == [
        ModelVerdict.UNDECIDED,
        ModelVerdict.UNDECIDED,
        ModelVerdict.UNDECIDED,
        ModelVerdict.HOLDS,
    ]


def test_one_seed_decides_nothing() -> None:
    assert verdicts(Table({(NO_HISTORY, ""): 0.1}, seeds=1)) == [ModelVerdict.UNDECIDED] * 4


def test_claims_about_missing_models_are_not_tested() -> None:
    found = findings(lambda model, part, metric: Estimate.of({}), "seen")
    assert [finding.verdict for finding in found] == [ModelVerdict.UNTESTED] * 4


def test_history_is_compared_with_the_ablation_of_lowest_score() -> None:
    rival = "TOTO (- GT Transcript)"
    (history, *_) = findings(Table({(NO_HISTORY, ""): 0.3, (rival, ""): 0.2}), "seen")
    assert history.verdict is ModelVerdict.FAILS
    claim = history.claims[1]
    assert (claim.higher, claim.lower, claim.verdict) == (rival, NO_HISTORY, ModelVerdict.FAILS)


def test_claims_name_counterparts_of_the_papers_models_and_columns_of_its_table() -> None:
    for finding in findings(Table({}), "seen"):
        for claim in finding.claims:
            for model in (claim.higher, claim.lower):  # the paper removes the sound of the utterance only
                assert model == NO_UTTERANCE or paper_name(model) in paper_figures()
            assert claim.metric in COLUMNS


def test_models_and_rows_of_the_paper_have_its_figures_in_any_case() -> None:
    for name in ("Objects Only", "objects only", "deformable-detr only"):
        assert paper_name(name) == "Deformable-DETR Only"
        assert paper_figure(name, "seen", "nfd_action_accuracy") == paper_figure(
            "Deformable-DETR Only", "seen", "nfd_action_accuracy"
        )
    assert paper_name("Objects Only (oracle boxes)") is None


def test_the_papers_figures_are_shares() -> None:
    toto = paper_figures()[FULL]["unseen"]
    assert toto["nfd_joint_accuracy"].mean == pytest.approx(0.411)
    assert len(paper_figures()) == 16


def test_a_model_is_above_another_if_it_is_in_every_figure() -> None:
    table = Table({("mine", ""): 0.8, ("other", ""): 0.8, ("other", "rfn_slot_f1"): 0.6})
    assert above(table, "seen", "mine", FULL).verdict is ModelVerdict.HOLDS
    assert above(table, "seen", "other", FULL).verdict is ModelVerdict.UNDECIDED
    assert above(table, "seen", "other", FULL, ("ufn_move_accuracy",)).verdict is ModelVerdict.HOLDS
    assert above(table, "seen", FULL, "mine").verdict is ModelVerdict.FAILS
