"""Assignment of conditions and roles: balance, order, and free numbers after dropouts."""

from __future__ import annotations

import itertools
import random
from collections import Counter
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dorothie_gym.lab.studies.assignment import (
    Assigner,
    Candidate,
    balanced_latin_square,
    changed_role,
    match,
    needed_role,
)
from dorothie_gym.lab.studies.study import Study
from dorothie_gym.lab.studies.study_file import read_study
from dorothie_gym.ontology import Role
from tests.lab.studies.content import SOLO, STUDY, write_study

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


def there(*roles: Role, movable: bool = False) -> list[Candidate]:
    return [Candidate(name=str(k), role=role, movable=movable) for k, role in enumerate(roles)]


def test_a_person_gets_the_role_that_those_who_are_there_lack(tmp_path: Path) -> None:
    assigner = Assigner(study(tmp_path))
    for number in range(20):
        assert needed_role(assigner, there(BOTH[0]), set(), number) is BOTH[1]
        assert needed_role(assigner, there(BOTH[1]), {0, 1}, number) is BOTH[0]
        assert needed_role(assigner, there(BOTH[0], BOTH[0], BOTH[1]), {3}, number) is BOTH[1]
    first = [needed_role(assigner, [], set(), number) for number in range(200)]
    assert 60 < first.count(BOTH[0]) < 140, "in random order"
    assert first == [needed_role(assigner, [], set(), number) for number in range(200)]


def test_a_substitute_is_on_the_way_for_the_partner_who_may_still_leave(tmp_path: Path) -> None:
    assigner = Assigner(study(tmp_path))
    waits = Candidate(name="a", role=BOTH[0])
    reads = Candidate(name="b", role=BOTH[1], certainty=0.8)
    assert {needed_role(assigner, [waits, reads], set(), number) for number in range(20)} == {BOTH[1]}


def test_a_role_changes_only_if_one_more_group_can_then_begin(tmp_path: Path) -> None:
    assigner = Assigner(study(tmp_path))
    waits, reads = there(BOTH[0])[0], Candidate(name="r", role=BOTH[0], movable=True)
    assert changed_role(assigner, [waits, reads], set()) == (reads, BOTH[1])
    assert changed_role(assigner, there(BOTH[0], BOTH[0]), {2}) is None, "who has read the instructions keeps the role"
    assert changed_role(assigner, [*there(*BOTH), reads], set()) is None
    assert changed_role(assigner, there(*BOTH, movable=True), set()) is None
    late = Candidate(name="l", role=BOTH[0], movable=True)
    assert changed_role(assigner, [waits, reads, late], set()) == (late, BOTH[1]), "the one who has read least"


def test_roles_of_conditions_for_one_and_for_two_people_are_filled_in_their_order(tmp_path: Path) -> None:
    mixed = [{"name": "alone"}, {"name": "pair", "co_wizard": "human"}]
    assigner = Assigner(study(tmp_path, conditions=mixed))
    given = Counter[Role]()
    taken: set[int] = set()
    waiting: list[Candidate] = []
    for number in range(60):
        role = needed_role(assigner, waiting, taken, number)
        given[role] += 1
        waiting.append(Candidate(name=str(number), role=role))
        for slot, group in match(assigner, [(each.name, each.role) for each in waiting], taken):
            taken.add(slot.number)
            waiting = [each for each in waiting if each.name not in group.values()]
    assert given == {Role.PARTICIPANT: 40, Role.CO_WIZARD: 20} and taken == set(range(40)) and not waiting


@given(st.integers(0, 2**32))
def test_balance_is_kept_when_groups_drop_out(seed: int) -> None:
    drawn, taken, lost = random.Random(seed), set[int](), 0
    for _ in range(60):
        number = next(number for number in itertools.count() if number not in taken)
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


@pytest.mark.parametrize("content", [SOLO, STUDY])
def test_a_slot_that_is_taken_again_is_the_same(tmp_path: Path, content: dict[str, object]) -> None:
    read = read_study(write_study(tmp_path, content))
    assert [Assigner(read).slot(k) for k in range(9)] == [Assigner(read).slot(k) for k in range(9)]
