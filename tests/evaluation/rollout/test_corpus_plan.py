from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dorothie_gym.archive import FOLDS, PAPER_FOLDS
from dorothie_gym.errors import TownError
from dorothie_gym.evaluation.rollout import plan_corpus
from dorothie_gym.evaluation.rollout.corpus_generation import UNSEEN_FOLDS, fold_sizes
from dorothie_gym.maps import (
    SEEN_TOWNS,
    UNSEEN_TOWNS,
    VALIDATION_TOWNS,
)


def test_folds_of_183_sessions_are_the_papers() -> None:
    assert [fold_sizes(183)[fold] for fold in FOLDS] == [123, 14, 6, 25, 15]


@given(st.integers(1, 5000))
def test_other_numbers_are_shared_out_in_proportion(sessions: int) -> None:
    sizes = fold_sizes(sessions)
    assert sum(sizes.values()) == sessions
    assert all(abs(sizes[fold] - sessions * PAPER_FOLDS[fold] / 183) < 1 for fold in FOLDS)


def test_unseen_folds_share_no_town_with_training_and_all_seen_towns_occur() -> None:
    plans = plan_corpus(183, 0)
    for plan in plans:
        assert plan.town in UNSEEN_FOLDS.get(plan.fold, SEEN_TOWNS)
        assert plan.path.startswith(f"{plan.fold}/")
    assert {plan.town for plan in plans if plan.fold == "train"} == set(SEEN_TOWNS)
    assert len({plan.path for plan in plans}) == 183


def test_seed_of_a_session_follows_from_the_corpus_seed_and_its_number_alone() -> None:
    few, many, other = plan_corpus(10, 3), plan_corpus(500, 3), plan_corpus(500, 4)
    assert [plan.seed for plan in few] == [plan.seed for plan in many[:10]]
    assert len({plan.seed for plan in (*many, *other)}) == 1000


@pytest.mark.parametrize(("sessions", "seed", "named"), [(0, 0, "sessions is 0"), (5, -1, "seed is -1")])
def test_impossible_corpora_are_refused(sessions: int, seed: int, named: str) -> None:
    with pytest.raises(ValueError, match=named):
        plan_corpus(sessions, seed)


def test_seen_folds_mix_given_towns_and_unseen_ones_keep_theirs() -> None:
    plans = plan_corpus(183, 0, ("midtown", "generated,size=small"))
    for plan in plans:
        assert plan.town in UNSEEN_FOLDS.get(plan.fold, ("midtown", "generated,size=small"))
        assert not set(plan.path.split("/")[1]) & set(":,=")
    assert [plan.seed for plan in plans] == [plan.seed for plan in plan_corpus(183, 0)]
    with pytest.raises(ValueError, match="towns is empty"):
        plan_corpus(5, 0, ())


def test_models_are_chosen_and_tested_in_different_towns() -> None:
    assert UNSEEN_FOLDS == {"val/unseen": VALIDATION_TOWNS, "test/unseen": UNSEEN_TOWNS}
    tested = {plan.town for plan in plan_corpus(183, 0) if plan.fold == "test/unseen"}
    assert len(tested) == 15


@pytest.mark.parametrize("towns", [VALIDATION_TOWNS, UNSEEN_TOWNS, ("midtown", "generated:950000000000,size=small")])
def test_towns_for_validation_and_tests_are_not_trained_in(towns: tuple[str, ...]) -> None:
    with pytest.raises(TownError, match="only; train in others"):
        plan_corpus(20, 0, towns)
