"""Generated towns: equal for a seed, without faults, and like real towns in the figures of their streets."""

from __future__ import annotations

import hashlib
from itertools import product
from pathlib import Path
from statistics import mean

import pytest

from dorothie_gym.maps import DrivingSide, check_town, load_town, mirrored
from dorothie_gym.maps.catalogue import find_town, import_report
from dorothie_gym.maps.generated.generate import generate
from dorothie_gym.maps.generated.specification import TownSize, TownSpecification, TownStyle, parse_specification
from dorothie_gym.maps.model import SignalKind
from dorothie_gym.maps.site_inference import connected_sites
from dorothie_gym.maps.yaml import read_yaml_town
from dorothie_gym.session.spaces.fields import SpaceLimits
from tests.maps.generated.street_statistics import street_statistics
from tests.maps.same_town import town_bits

KINDS = [(size, style) for size, style in product(TownSize, TownStyle)]


@pytest.mark.parametrize(("size", "style"), KINDS)
def test_town_has_no_fault_and_fits_the_spaces(size: TownSize, style: TownStyle) -> None:
    name = f"generated:3,size={size},style={style}"
    town = load_town(name)
    assert town.name == name
    assert check_town(town) == ()
    assert import_report(name) == ()
    assert SpaceLimits.for_town(town) == SpaceLimits()
    assert len(town.streets) <= 14
    assert len(connected_sites(town)) == len(town.sites) == 24


def test_text_of_a_town_is_always_the_same() -> None:
    texts = [generate(TownSpecification(seed=11, size=size, style=style))[0] for size, style in KINDS]
    digest = hashlib.sha256("".join(texts).encode()).hexdigest()
    assert digest == "a6dc3f98bd18c9f5821e88dcc9f9454254285fff837f2895e7085baebf2f99c3", (
        "generated towns have changed: say so in the changelog"
    )


@pytest.mark.parametrize("name", ["generated:5,size=small", "generated:5,size=small,traffic=left"])
def test_text_of_a_town_is_a_town_file(tmp_path: Path, name: str) -> None:
    specification = parse_specification(name)
    file = tmp_path / "own.yaml"
    file.write_text(generate(specification)[0])
    assert town_bits(read_yaml_town(file)) == town_bits(load_town(str(specification)))


@pytest.mark.parametrize("options", ["", ",size=large,style=grid", ",size=small,style=radial"])
def test_town_with_traffic_on_the_left_is_the_mirror_image_of_the_other(options: str) -> None:
    name = f"generated:11{options}"
    right, left = load_town(name), load_town(f"{name},traffic=left")
    assert (right.traffic, left.traffic) == (DrivingSide.RIGHT, DrivingSide.LEFT)
    assert left.name == f"{name},traffic=left" and check_town(left) == ()
    assert town_bits(left)[1:] == town_bits(mirrored(right))[1:]  # all but the name
    assert find_town(left.name, None) is left


def test_seeds_give_different_towns() -> None:
    texts = {generate(TownSpecification(seed=seed, size=TownSize.SMALL))[0].split("junctions:")[1] for seed in range(6)}
    assert len(texts) == 6


def test_recorded_name_gives_the_town() -> None:
    assert find_town("generated:5,size=small", None) is load_town("generated:5,size=small")


@pytest.mark.parametrize(
    ("name", "parts"),
    [
        ("generated:2,size=large,style=grid", ("roundabout:", "one_way: true", "median:", "turn_lanes:", ", -5]")),
        ("generated:3,size=medium", (", 5.5]",)),
    ],
)
def test_towns_have_what_towns_have(name: str, parts: tuple[str, ...]) -> None:
    """One has a tunnel below another street, roundabouts, an avenue and a one-way pair, the other a bridge."""
    text = generate(parse_specification(name))[0]
    for part in (*parts, "lights:", "stops:", "yields:", "crosswalks:"):
        assert part in text, part
    kinds = {signal.kind for signal in load_town(name).signals}
    assert kinds == {SignalKind.TRAFFIC_LIGHT, SignalKind.STOP, SignalKind.YIELD}


@pytest.mark.parametrize("style", TownStyle)
def test_streets_are_like_those_of_real_towns(style: TownStyle) -> None:
    """The ranges are those of docs/towns.md."""
    found = [
        street_statistics(generate(TownSpecification(seed=seed, size=size, style=style))[1])
        for seed, size in product(range(2), (TownSize.MEDIUM, TownSize.LARGE))
    ]
    for each in found:
        assert 3.0 <= each.degree <= 3.9
        assert 90.0 <= each.block <= 170.0
        assert 1.0 <= each.circuity <= 1.15
        assert 2.0 <= each.entropy <= 3.584
    entropy = mean(each.entropy for each in found)
    assert entropy < 2.6 if style is TownStyle.GRID else entropy > 2.6
    assert 0.1 <= mean(each.four_way for each in found) <= 0.75
