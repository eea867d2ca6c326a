"""Assignment of conditions and roles: balance, order, and free numbers after dropouts."""

from __future__ import annotations

import random
from collections import Counter
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dorothie_gym.ontology import Role
from dorothie_gym.studies.assignment import Assigner, balanced_latin_square, first_free, match
from dorothie_gym.studies.study import Study
from dorothie_gym.studies.study_file import read_study
from tests.studies.content import SOLO, STUDY, write_study

BOTH = Role.PARTICIPANT, Role.CO_WIZARD


@given(st.integers(1, 9))
def test_each_condition_follows_each_other_one_equally_often(size: int) -> None:
    rows = balanced_latin_square(size)
    assert all(sorted(row) == list(range(size)) for row in rows)
    for column in zip(*rows, strict=True):
        assert len(set(Counter(column).values())) == 1 and len(set(column)) == size
    pairs = Counter((row[k], row[k + 1]) for row in rows for k in range(size - 1))
    assert len(pairs) == size * (size - 1) and len(set(pairs.values())) <= 1


def study(tmp_path: Path, **changes: object) -> Study:
    return read_study(write_study(tmp_path, {**STUDY, **changes}))


def test_each_block_has_each_condition_once_and_the_seed_decides_the_order(tmp_path: Path) -> None:
    def orders(seed: int) -> list[tuple[str, ...]]:
        assigner = Assigner(study(tmp_path, assignment={"seed": seed}))
        return [assigner.slot(number).conditions for number in range(20)]

    first = orders(1)
    for block in range(10):
        assert sorted(first[2 * block : 2 * block + 2]) == [("exact",), ("noisy",)]
    assert first == orders(1) != orders(2)


def test_each_condition_meets_each_scenario_equally_often(tmp_path: Path) -> None:
    for method in ("block_randomisation", "balanced_latin_square"):
        assigner = Assigner(study(tmp_path, assignment={"method": method}))
        met = Counter(
            (condition, scenario.storyboard, place)
            for number in range(2 * assigner.block_size)
            for place, (condition, scenario) in enumerate(
                zip(assigner.slot(number).conditions, assigner.slot(number).scenarios, strict=True)
            )
        )
        assert len(set(met.values())) == 1 and len(met) == (4 if method == "block_randomisation" else 8)


def test_no_person_meets_a_scenario_twice_in_a_latin_square(tmp_path: Path) -> None:
    assigner = Assigner(study(tmp_path, assignment={"method": "balanced_latin_square"}))
    for number in range(8):
        slot = assigner.slot(number)
        assert len({scenario.storyboard for scenario in slot.scenarios}) == 2
        assert len(set(slot.seeds)) == 2


def test_roles_are_shared_out_in_pairs(tmp_path: Path) -> None:
    assigner = Assigner(study(tmp_path))
    roles = [assigner.role(number) for number in range(40)]
    assert all(set(roles[k : k + 2]) == set(BOTH) for k in range(0, 40, 2))
    assert len({tuple(roles[k : k + 2]) for k in range(0, 40, 2)}) == 2, "in random order"


@given(st.integers(0, 2**32))
def test_balance_is_kept_when_groups_drop_out(seed: int) -> None:
    drawn, taken, lost = random.Random(seed), set[int](), 0
    for _ in range(60):
        number = first_free(taken)
        if drawn.random() < 0.3:
            lost += 1
        else:
            taken.add(number)
    assert taken == set(range(60 - lost))


def test_people_are_matched_with_the_one_who_has_waited_longest(tmp_path: Path) -> None:
    assigner = Assigner(study(tmp_path))
    waiting = [("a", Role.PARTICIPANT), ("b", Role.PARTICIPANT), ("c", Role.CO_WIZARD)]
    assert match(assigner, waiting[:2], set()) == []
    ((slot, group),) = match(assigner, waiting, {0, 1})
    assert slot.number == 2 and group == {Role.PARTICIPANT: "a", Role.CO_WIZARD: "c"}


def test_conditions_for_one_person_do_not_keep_those_for_two_waiting(tmp_path: Path) -> None:
    mixed = [{"name": "alone"}, {"name": "pair", "co_wizard": "human"}]
    assigner = Assigner(study(tmp_path, conditions=mixed))
    alone = next(number for number in (0, 1) if assigner.slot(number).conditions == ("alone",))
    waiting = [("a", Role.PARTICIPANT), ("b", Role.PARTICIPANT), ("c", Role.CO_WIZARD)]
    groups = {slot.conditions[0]: group for slot, group in match(assigner, waiting, set())}
    assert groups["pair"][Role.CO_WIZARD] == "c"
    assert set(groups["alone"].values()) | set(groups["pair"].values()) == {"a", "b", "c"}
    assert [slot.number for slot, _ in match(assigner, waiting[:1], {1 - alone})] == [alone]
    roles = Counter(assigner.role(number) for number in range(30))
    assert roles == {Role.PARTICIPANT: 20, Role.CO_WIZARD: 10}


@pytest.mark.parametrize("content", [SOLO, STUDY])
def test_a_slot_that_is_taken_again_is_the_same(tmp_path: Path, content: dict[str, object]) -> None:
    read = read_study(write_study(tmp_path, content))
    assert [Assigner(read).slot(k) for k in range(9)] == [Assigner(read).slot(k) for k in range(9)]
