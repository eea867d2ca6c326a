"""Assignment of conditions, scenarios and seeds to groups, and of roles to people.

Conditions are an endless sequence of shuffled blocks, of which entry n depends on the seed and n only. Groups take the
first free number. The number of a group that drops out is free again, so that balance is kept across dropouts and
restarts. Roles depend on the people present: each person gets the role that the next group lacks (`needed_role`).
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from typing import Final, TypeVar

import numpy as np

from dorothie_gym.lab.studies.study import Method, Scenario, Study
from dorothie_gym.ontology.roles import Role

_T = TypeVar("_T")

_CONDITIONS, _ROLES = 0, 1
"""Numbers of the two random streams of a study."""


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """Person who has a role and plays no session yet.

    Attributes:
        name: id of the participant.
        role: role.
        certainty: share of people in the same position who come to a session.
        movable: whether the role can still be changed.
    """

    name: str
    role: Role
    certainty: float = 1.0
    movable: bool = False


@dataclass(frozen=True, kw_only=True)
class Slot:
    """Sessions planned for one group of people.

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
    """Slots of groups by number.

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

    def shuffled(self, roles: Sequence[Role], number: int) -> list[Role]:
        """Returns roles in the random order of the person with a number."""
        order = np.random.default_rng([self._study.assignment.seed, _ROLES, number]).permutation(len(roles))
        return [roles[k] for k in order]

    def _entry(self, rows: Sequence[_T], number: int, stream: int) -> _T:
        block, place = divmod(number, len(rows))
        order = np.random.default_rng([self._study.assignment.seed, stream, block]).permutation(len(rows))
        return rows[int(order[place])]


MOST_SLOTS: Final = 100_000
"""Maximum number of slots of a study."""


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
    return [(slot, group) for slot, group in _form(assigner, waiting, taken) if len(group) == len(slot.people)]


def _form(
    assigner: Assigner, waiting: Sequence[tuple[str, Role]], taken: Collection[int]
) -> list[tuple[Slot, dict[Role, str]]]:
    """Returns the free slots up to the last one that has a person, with their people."""
    slots, groups, free = list[Slot](), list[dict[Role, str]](), _free(taken)
    for person, role in waiting:
        k = 0
        while k == len(slots) or role not in slots[k].people or role in groups[k]:
            if k == len(slots):
                slots.append(assigner.slot(next(free)))
                groups.append({})
            else:
                k += 1
        groups[k][role] = person
    return list(zip(slots, groups, strict=True))


def _free(taken: Collection[int]) -> Iterator[int]:
    return (number for number in range(MOST_SLOTS) if number not in taken)


def needed_role(assigner: Assigner, there: Sequence[Candidate], taken: Collection[int], number: int) -> Role:
    """Returns the role for a person: one that is missing in the first group that the people present do not fill.

    Of several, it is the one with the fewest people who are certain to come, so that a substitute is available; of
    equal ones a random one.

    Args:
        assigner: slots of the study.
        there: people present who have a role, the nearest to a session first.
        taken: numbers of slots that other groups have.
        number: number of the person, which seeds random choices.
    """
    formed = _form(assigner, [(each.name, each.role) for each in there], taken)
    lacking = next((slot for slot, group in formed if len(group) < len(slot.people)), None)
    if lacking is None:
        lacking, group = assigner.slot(next(_free({*taken, *(slot.number for slot, _ in formed)}))), dict[Role, str]()
    else:
        group = next(group for slot, group in formed if slot is lacking)
    sure = {role: sum(each.certainty for each in there if each.role is role) for role in lacking.people}
    open_roles = assigner.shuffled([role for role in lacking.people if role not in group], number)
    return min(open_roles, key=lambda role: round(sure[role], 6))


def changed_role(
    assigner: Assigner, there: Sequence[Candidate], taken: Collection[int]
) -> tuple[Candidate, Role] | None:
    """Returns a person whose role should change, and the new role: one more group can then be formed.

    Args:
        assigner: slots of the study.
        there: see `needed_role`; of the people who can change, the last one does.
        taken: numbers of slots that other groups have.

    Returns:
        None if no change of one person forms another group.
    """
    people = [(each.name, each.role) for each in there]
    formed = _form(assigner, people, taken)
    complete = sum(len(group) == len(slot.people) for slot, group in formed)
    lacking = {role for slot, group in formed for role in slot.people if role not in group}
    for k in range(len(there) - 1, -1, -1):
        for role in sorted(lacking - {there[k].role}) if there[k].movable else ():
            if len(match(assigner, [*people[:k], (there[k].name, role), *people[k + 1 :]], taken)) > complete:
                return there[k], role
    return None
