"""Names of generated towns."""

from __future__ import annotations

import pytest

from dorothie_gym.errors import TownError
from dorothie_gym.maps.generated.specification import (
    TownSeries,
    TownSize,
    TownSpecification,
    TownStyle,
    parse_series,
    parse_specification,
    split_names,
)


@pytest.mark.parametrize(
    "name",
    ["generated:0", "generated:7,size=small", "generated:7,size=large,style=organic", "generated:7,traffic=left"],
)
def test_name_of_a_specification_is_the_name_that_was_read(name: str) -> None:
    assert str(parse_specification(name)) == name


def test_options_are_read_in_any_order_and_spelt_in_one() -> None:
    found = parse_specification("generated:12,style=grid,size=medium")
    assert found == TownSpecification(seed=12, size=TownSize.MEDIUM, style=TownStyle.GRID)
    assert str(found) == "generated:12,size=medium,style=grid"
    assert str(parse_specification("generated:12,traffic=left,size=small")) == "generated:12,size=small,traffic=left"
    assert str(parse_specification("generated:12,traffic=right")) == "generated:12"


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("generated:", "seed"),
        ("generated:-1", "seed"),
        ("generated:1.5", "seed"),
        ("generated:1000000000000", "seed"),
        ("generated:1,size=huge", "known are small, medium, large"),
        ("generated:1,stile=grid", "did you mean 'style'"),
        ("generated:1,style", "unknown option"),
        ("generated:1,size=small,size=small", "twice"),
        ("generated:1,traffic=both", "known are right, left"),
    ],
)
def test_wrong_name_is_refused_with_the_remedy(name: str, reason: str) -> None:
    with pytest.raises(TownError, match=reason):
        parse_specification(name)


def test_series_names_a_town_for_each_seed() -> None:
    series = parse_series("generated,size=small")
    assert series == TownSeries(size=TownSize.SMALL)
    assert series is not None
    assert series.name(5) == "generated:5,size=small"
    assert series.pool(2) == ("generated:0,size=small", "generated:1,size=small")
    assert parse_specification(series.name(10**30)).seed < 10**12


@pytest.mark.parametrize("name", ["brookside", "generated:1", "my/generated.yaml", ""])
def test_other_names_are_no_series(name: str) -> None:
    assert parse_series(name) is None


def test_options_of_a_generated_town_stay_with_its_name_in_a_list() -> None:
    assert split_names("midtown, generated:1,size=small,style=grid,seen,,generated") == [
        "midtown", "generated:1,size=small,style=grid", "seen", "generated",
    ]  # fmt: skip
