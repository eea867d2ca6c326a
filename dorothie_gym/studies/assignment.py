"""Assignment of conditions, scenarios, seeds and roles: endless sequences of shuffled blocks.

Entry n of a sequence depends on the seed and n only. Groups, and people, take the first free number. The number of a
group or person that drops out is free again, so that balance is kept across dropouts and restarts.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import count
from typing import Final, TypeVar

import numpy as np

from dorothie_gym.ontology import Role
from dorothie_gym.studies.study import Method, Scenario, Study

_T = TypeVar("_T")

_CONDITIONS, _ROLES = 0, 1
"""Numbers of the two random streams of a study."""


@dataclass(frozen=True, kw_only=True)
class Slot:
    """Sessions that one group of people is to play.

    Attributes:
        number: number of the slot.
        people: roles that people play.
        conditions: names of the conditions of its sessions, in order.
        scenarios: towns and storyboards of its sessions.
        seeds: seeds of its sessions.
    """

    number: int
    people: tuple[Role, ...]
    conditions: tuple[str, ...]
    scenarios: tuple[Scenario, ...]
    seeds: tuple[int, ...]


def balanced_latin_square(size: int) -> list[list[int]]:
    """Returns a square in which each pair of neighbours occurs equally often in both orders (Williams, 1949).

    Args:
        size: number of conditions.

    Returns:
        `size` rows of 0..size-1 if `size` is even; otherwise twice as many, as no square of odd size is balanced.
    """
    first = [0]
    for k in range(1, size):
        first.append((first[-1] + (k if k % 2 else -k)) % size)
    rows = [[(entry + shift) % size for entry in first] for shift in range(size)]
    return rows if size % 2 == 0 else rows + [row[::-1] for row in rows]


class Assigner:
    """Slots of groups, and roles of people, by number.

    Args:
        study: the study.
    """

    def __init__(self, study: Study) -> None:
        self._study = study
        names = [condition.name for condition in study.conditions]
        if study.assignment.method is Method.LATIN_SQUARE:
            self._rows = [[names[k] for k in row] for row in balanced_latin_square(len(names))]
        else:
            self._rows = [[name] for name in names]
        crews = [study.condition(row[0]).people for row in self._rows]
        self._roles = list(crews[0]) if len(set(crews)) == 1 else [role for crew in crews for role in crew]

    @property
    def block_size(self) -> int:
        """Number of slots of a block."""
        return len(self._rows)

    def slot(self, number: int) -> Slot:
        """Returns a slot.

        Scenarios take turns: within a group by session, and between blocks. Each condition meets all of them equally
        often. A slot that is taken again has the same seeds.
        """
        study, block = self._study, number // len(self._rows)
        row = self._entry(self._rows, number, _CONDITIONS)
        turns = range(len(row))
        return Slot(
            number=number,
            people=study.condition(row[0]).people,
            conditions=tuple(row),
            scenarios=tuple(study.scenarios[(block + k) % len(study.scenarios)] for k in turns),
            seeds=tuple(study.assignment.seed + number * len(row) + k for k in turns),
        )

    def role(self, number: int) -> Role:
        """Returns the role of the person with a number."""
        return self._entry(self._roles, number, _ROLES)

    def _entry(self, rows: Sequence[_T], number: int, stream: int) -> _T:
        block, place = divmod(number, len(rows))
        order = np.random.default_rng([self._study.assignment.seed, stream, block]).permutation(len(rows))
        return rows[int(order[place])]


def first_free(taken: Collection[int]) -> int:
    """Returns the smallest number that is not taken."""
    return next(number for number in count() if number not in taken)


MOST_SLOTS: Final = 100_000
"""Most slots of a study."""


def match(
    assigner: Assigner, waiting: Sequence[tuple[str, Role]], taken: Collection[int]
) -> list[tuple[Slot, dict[Role, str]]]:
    """Returns the groups that can begin: free slots whose roles all have a person who waits.

    Each person goes to the first free slot that lacks the person's role.

    Args:
        assigner: slots of the study.
        waiting: people who wait and their roles, the longest waiting first.
        taken: numbers of slots that other groups have.
    """
    forming: dict[int, dict[Role, str]] = {}
    slots: dict[int, Slot] = {}
    for person, role in waiting:
        for number in range(MOST_SLOTS):
            if number in taken:
                continue
            slot = slots.setdefault(number, assigner.slot(number))
            group = forming.setdefault(number, {})
            if role in slot.people and role not in group:
                group[role] = person
                break
    return [
        (slots[number], group) for number, group in sorted(forming.items()) if len(group) == len(slots[number].people)
    ]
