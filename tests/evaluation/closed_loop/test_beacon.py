"""Draws from the text of a beacon: stored values, which hold on every processor and in every version of Python."""

from __future__ import annotations

import os
import subprocess
import sys
from collections import Counter

import pytest

from dorothie_gym.evaluation.closed_loop import Beacon, RolloutSettings, sealed_config
from dorothie_gym.evaluation.tiers import ROUGH, TIERS
from dorothie_gym.maps import load_town
from dorothie_gym.maps.folds import UNSEEN_TOWNS, TownFold, fold_of
from dorothie_gym.ontology import Role
from dorothie_gym.policies import find_player
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.tasks import StoryboardSource

BEACON = Beacon(text="a word of an organiser", date="2026-12-01")

SEED = 555596999

TOWNS = (
    "generated:969167271397",
    "generated:984122543555",
    "generated:984904820140",
    "generated:992388306441",
    "generated:994891854660",
    "generated:937864564764",
    "generated:945608043767",
    "generated:934363280290",
    "generated:933535516710",
    "generated:949723038750",
)

TURNS = [0, 1, 2, 1, 2, 0, 2, 0, 1]

SEEDS = [1023962525, 520404350, 819050604]


def plans_of(beacon: Beacon) -> tuple[tuple[str, int, str], ...]:
    pool = tuple(find_player(name, Role.PARTICIPANT) for name in ROUGH.participants[:2])
    settings = RolloutSettings(
        towns=beacon.towns, seed=beacon.seed, sessions=12, pool=pool, config=sealed_config(ROUGH.config), beacon=beacon
    )
    return tuple((plan.town, plan.seed, str(plan.participant and plan.participant.name)) for plan in settings.plans())


def test_the_draws_are_the_stored_ones() -> None:
    assert BEACON.seed == SEED
    assert BEACON.towns == TOWNS
    assert [BEACON.turn(scenario, 3) for scenario in range(9)] == TURNS
    assert [seed for _, seed, _ in plans_of(BEACON)][:3] == SEEDS


def test_the_draws_do_not_depend_on_the_hash_seed_of_python() -> None:
    code = "from tests.evaluation.closed_loop.test_beacon import BEACON; print(BEACON.seed, *BEACON.towns)"
    outputs = {
        subprocess.run(
            [sys.executable, "-c", code],
            env={**os.environ, "PYTHONHASHSEED": seed},
            check=True,
            capture_output=True,
            text=True,
        ).stdout
        for seed in ("1", "2")
    }
    assert outputs == {f"{BEACON.seed} {' '.join(BEACON.towns)}\n"}


def test_another_text_gives_other_scenarios_and_another_date_does_not() -> None:
    other = Beacon(text="another word", date=BEACON.date)
    assert other.seed != BEACON.seed and not {*other.towns} & {*BEACON.towns}
    assert plans_of(Beacon(text=BEACON.text, date="2027-01-01")) == plans_of(BEACON)


def test_towns_are_distinct_ones_for_tests_that_nobody_has_listed() -> None:
    for text in ("one", "two", "7F3A"):
        towns = Beacon(text=text, date="2026-12-01").towns
        assert len({*towns}) == 10 and not {*towns} & {*UNSEEN_TOWNS}
        assert {fold_of(town) for town in towns} == {TownFold.UNSEEN}
    assert load_town(BEACON.towns[0]).name == BEACON.towns[0]


def test_all_partners_play_in_each_round_and_their_order_is_drawn() -> None:
    turns = [BEACON.turn(scenario, 3) for scenario in range(30)]
    rounds = [tuple(turns[first : first + 3]) for first in range(0, 30, 3)]
    assert all(sorted(each) == [0, 1, 2] for each in rounds)
    assert len({*rounds}) > 1
    assert Counter(partner for *_, partner in plans_of(BEACON)) == {ROUGH.participants[0]: 6, ROUGH.participants[1]: 6}


def test_spellings_of_one_letter_are_the_same() -> None:
    assert Beacon(text="Z\u00fcrich", date="2026-12-01").seed == Beacon(text="Zu\u0308rich", date="2026-12-01").seed


@pytest.mark.parametrize(
    ("text", "date", "message"),
    [
        ("", "2026-12-01", "beacon is ''"),
        (" word", "2026-12-01", "without spaces"),
        ("two\nlines", "2026-12-01", "printable"),
        ("w" * 501, "2026-12-01", "500"),
        ("word", "1.12.2026", "write it as YYYY-MM-DD"),
        ("word", "2026-02-30", "write it as YYYY-MM-DD"),
        ("word", "20261201", "write it as YYYY-MM-DD"),
    ],
)
def test_a_malformed_beacon_is_refused(text: str, date: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Beacon(text=text, date=date)


def test_towns_and_seed_of_a_rollout_are_those_of_its_beacon() -> None:
    with pytest.raises(ValueError, match="not those of the beacon"):
        RolloutSettings(towns=BEACON.towns, seed=BEACON.seed + 1, beacon=BEACON)


def test_storyboards_of_a_sealed_test_are_generated() -> None:
    for tier in TIERS.values():
        config = sealed_config(tier.config)
        assert (config.storyboards is StoryboardSource.GENERATED) is (tier.config.talk is None)
        assert sealed_config(config) == config
    with pytest.raises(ValueError, match="shipped storyboards, which are known"):
        RolloutSettings(towns=BEACON.towns, seed=BEACON.seed, beacon=BEACON)
    given = RolloutSettings(towns=BEACON.towns, seed=BEACON.seed, beacon=BEACON, config=sealed_config(EnvConfig()))
    assert given.config.record()["storyboards"] == "generated"
