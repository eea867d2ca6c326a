"""Folds of towns: no town is in two, and no series of training towns reaches those for tests."""

from __future__ import annotations

from itertools import chain

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dorothie_gym.errors import TownError
from dorothie_gym.maps import (
    DEFAULT_TOWN,
    DEVELOPMENT_TOWNS,
    FOLD_TOWNS,
    SEEN_TOWNS,
    TownFold,
    check_training_towns,
    fold_of,
    parse_series,
    town_names,
)


def test_every_town_is_in_one_fold() -> None:
    towns = list(chain.from_iterable(FOLD_TOWNS.values()))
    assert len(set(towns)) == len(towns)
    assert all(fold_of(town) is fold for fold, there in FOLD_TOWNS.items() for town in there)
    assert set(SEEN_TOWNS) | set(DEVELOPMENT_TOWNS) == set(town_names())


@pytest.mark.parametrize(
    ("name", "fold"),
    [
        ("generated:7,size=small", TownFold.SEEN),
        ("generated:799999999999", TownFold.SEEN),
        ("generated:800000000000,traffic=left", TownFold.VALIDATION),
        ("generated:900000000000,style=grid", TownFold.UNSEEN),
        ("generated:999999999999", TownFold.UNSEEN),
        ("generated", None),
        ("my_town.yaml", None),
    ],
)
def test_seed_of_a_generated_town_gives_its_fold(name: str, fold: TownFold | None) -> None:
    assert fold_of(name) is fold


@given(st.integers(0, 2**128))
def test_series_have_training_towns_only(seed: int) -> None:
    series = parse_series("generated,traffic=left")
    assert series is not None
    assert fold_of(series.name(seed)) is TownFold.SEEN


def test_town_of_those_who_name_none_is_one_to_train_in() -> None:
    assert fold_of(DEFAULT_TOWN) is TownFold.SEEN


def test_training_in_a_town_for_tests_is_refused_with_the_remedy() -> None:
    check_training_towns(("midtown", "brookside", "generated", "generated:5", "own.yaml"))
    with pytest.raises(TownError, match="for tests only; train in others, such as generated:SEED with a seed below"):
        check_training_towns(("midtown", "generated:900000000003,size=large"))
    with pytest.raises(TownError, match="for validation only"):
        check_training_towns(("generated:800000000000",))
