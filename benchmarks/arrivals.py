"""Simulates people who come to a study in pairs, and compares ways to give them their roles.

python benchmarks/arrivals.py --studies 100

People come one by one, read and fill in pages for random times, and some leave at a random moment before their session.
A person who has been in the waiting room for the study file's time has waited in vain. Roles are given at the consent,
by number and free again after half an hour (as up to version 0.1); by the rules of the package, at the instructions; or
at pairing, which no study with instructions for each role can do, and which is the reference. The package's own
functions give roles, change them and form groups. Not a measurement of speed.
"""

from __future__ import annotations

import argparse
import heapq
import json
import tempfile
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import count
from pathlib import Path
from typing import Any, Final

import numpy as np
import yaml

from dorothie_gym.lab.studies.assignment import Assigner, Candidate, changed_role, match, needed_role
from dorothie_gym.lab.studies.stages import Stage
from dorothie_gym.lab.studies.study_file import read_study
from dorothie_gym.lab.studies.waiting_room import CERTAINTY, GONE_SECONDS, MOVABLE
from dorothie_gym.ontology import Role

PAGES: Final = {
    Stage.CONSENT: (30.0, 120.0),
    Stage.BEFORE: (40.0, 150.0),
    Stage.INSTRUCTIONS: (40.0, 120.0),
    Stage.TUTORIAL: (40.0, 130.0),
}
"""Shortest and longest time that people spend at the stages before the waiting room [s]; an assumption."""

FORMERLY_FREE: Final = 1800.0
"""Time after which the role of a person who had left was given to another person, up to version 0.1 [s]."""

WAYS: Final = "at consent", "package", "at pairing"


def two_roles(seed: int) -> Assigner:
    """Returns the slots of a study with two conditions for two people."""
    instructions = {"participant": "Tell the car where to go.", "co_wizard": "Drive the car."}
    content = {
        "title": "Arrivals",
        "contact": "-",
        "scenarios": [{"town": "brookside"}],
        "conditions": [{"name": name, "co_wizard": "human"} for name in ("one", "two")],
        "assignment": {"seed": seed},
        "consent": {"text": "-", "statements": ["-"]},
        "texts": {"instructions": instructions, "debriefing": "-"},
    }
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "study.yaml"
        file.write_text(yaml.safe_dump(content), encoding="utf-8")
        return Assigner(read_study(file))


@dataclass(eq=False)
class Visitor:
    """Person.

    Attributes:
        number: number in the order of arrival.
        leaves: time at which the person leaves [s]; infinite for one who stays.
        stage: present stage.
        since: time since which the person is there [s].
        role: role; None before.
        ticket: number by which roles were given formerly.
        done: whether the person plays, or has waited in vain.
        turn: number of changes of the role; entries that were planned before one do not happen.
    """

    number: int
    leaves: float
    stage: Stage = Stage.CONSENT
    since: float = 0.0
    role: Role | None = None
    ticket: int | None = None
    done: bool = False
    turn: int = 0

    def is_there(self, now: float, patience: float) -> bool:
        """Returns whether the person counts as present: has been away for less than `patience` [s]."""
        return not self.done and now < self.leaves + patience


@dataclass
class Outcome:
    """Counts of a simulated study.

    Attributes:
        played: people who played.
        in_vain: people who waited in vain.
        changed: changes of a role before the waiting room.
        conditions: groups of each condition.
        imbalance: largest difference between the conditions when a group began.
    """

    played: int = 0
    in_vain: int = 0
    changed: int = 0
    conditions: Counter[str] = field(default_factory=Counter)
    imbalance: int = 0

    @property
    def share_in_vain(self) -> float:
        """Share of the people in the waiting room who waited in vain."""
        return self.in_vain / max(1, self.in_vain + self.played)


class Arrivals:
    """Simulated study.

    Args:
        way: one of `WAYS`.
        seed: seed of people and assignment.
        people: number of people.
        every: mean time between two arrivals [s], which is exponentially distributed.
        drop_out: share of the people who leave before their session.
        patience: time of the waiting room [s].
    """

    def __init__(
        self, way: str, *, seed: int, people: int = 200, every: float = 90.0, drop_out: float = 0.3,
        patience: float = 300.0,
    ) -> None:  # fmt: skip
        self.way, self.patience = way, patience
        self.assigner, self.taken, self.outcome = two_roles(seed), set[int](), Outcome()
        self.visitors: list[Visitor] = []
        self._order, self._events = count(), list[tuple[float, int, Callable[[float], None]]]()
        drawn, now = np.random.default_rng(seed), 0.0
        self._again = np.random.default_rng([seed, 1])
        for number in range(people):
            times = [drawn.uniform(*PAGES[stage]) for stage in PAGES]
            leaves = now + drawn.uniform(0.0, sum(times)) if drawn.random() < drop_out else np.inf
            visitor = Visitor(number, leaves)
            self.visitors.append(visitor)
            self._plan(visitor, now, times)
            if np.isfinite(leaves):
                self._at(leaves + GONE_SECONDS + 0.1, self._mend)
            now += drawn.exponential(every)

    def run(self) -> Outcome:
        """Returns the outcome."""
        while self._events:
            now, _, happen = heapq.heappop(self._events)
            happen(now)
        return self.outcome

    def _at(self, now: float, happen: Callable[[float], None]) -> None:
        heapq.heappush(self._events, (now, next(self._order), happen))

    def _plan(self, visitor: Visitor, now: float, times: Sequence[float]) -> None:
        """Plans when a person enters the waiting room, and the last pages before it, after times at the pages [s]."""
        turn, ends = visitor.turn, now + np.cumsum(times)
        for stage, end in zip([*PAGES, Stage.LOBBY][-len(times) :], ends, strict=True):
            self._at(end, partial(self._enter, visitor, stage, turn))

    def _enter(self, visitor: Visitor, stage: Stage, turn: int, now: float) -> None:
        if visitor.turn != turn or visitor.done or now >= visitor.leaves:
            return
        if stage is Stage.BEFORE and self.way == "at consent":
            self._give_formerly(visitor, now)
        if stage is Stage.INSTRUCTIONS and self.way == "package":
            visitor.role = needed_role(self.assigner, self._there(now), self.taken, visitor.number)
        visitor.stage, visitor.since = stage, now
        self._mend(now)
        if stage is Stage.LOBBY:
            self._at(now + self.patience, lambda at: self._give_up(visitor))
            self._pair(now)

    def _give_formerly(self, visitor: Visitor, now: float) -> None:
        """Gives a role the first number that no person has who plays or left less than half an hour ago."""
        used = {each.ticket for each in self.visitors if each.done or now < each.leaves + FORMERLY_FREE}
        visitor.ticket = next(number for number in count() if number not in used)
        block, place = divmod(visitor.ticket, 2)
        visitor.role = self.assigner.shuffled((Role.PARTICIPANT, Role.CO_WIZARD), block)[place]

    def _there(self, now: float) -> list[Candidate]:
        found = [each for each in self.visitors if each.role is not None and each.is_there(now, GONE_SECONDS)]
        found.sort(key=lambda each: (list(CERTAINTY).index(each.stage), each.since))
        return [
            Candidate(
                name=str(each.number),
                role=each.role or Role.PARTICIPANT,
                certainty=CERTAINTY[each.stage],
                movable=each.stage in MOVABLE,
            )
            for each in found
        ]

    def _mend(self, now: float) -> None:
        change = changed_role(self.assigner, self._there(now), self.taken) if self.way == "package" else None
        if change is not None:
            visitor = self.visitors[int(change[0].name)]
            visitor.role, visitor.stage, visitor.since, visitor.turn = change[1], MOVABLE[0], now, visitor.turn + 1
            self._plan(visitor, now, [self._again.uniform(*PAGES[stage]) for stage in MOVABLE])
            self.outcome.changed += 1

    def _pair(self, now: float) -> None:
        lobby = [each for each in self.visitors if each.stage is Stage.LOBBY and each.is_there(now, 0.0)]
        lobby.sort(key=lambda each: each.since)
        if self.way == "at pairing":
            for each, role in zip(lobby, (Role.PARTICIPANT, Role.CO_WIZARD), strict=False):
                each.role = role
        waiting = [(str(each.number), each.role) for each in lobby if each.role is not None]
        for slot, group in match(self.assigner, waiting, self.taken):
            self.taken.add(slot.number)
            for name in group.values():
                self.visitors[int(name)].done = True
            outcome = self.outcome
            outcome.played += len(group)
            outcome.conditions[slot.conditions[0]] += 1
            counts = [outcome.conditions[name] for name in ("one", "two")]
            outcome.imbalance = max(outcome.imbalance, abs(counts[0] - counts[1]))

    def _give_up(self, visitor: Visitor) -> None:
        if not visitor.done:
            visitor.done, visitor.ticket = True, None
            self.outcome.in_vain += 1


def measure(way: str, studies: int, *, seed: int = 0, **settings: Any) -> dict[str, float]:
    """Returns means over simulated studies: share who waited in vain, changes of a role, largest imbalance.

    Args:
        way: one of `WAYS`.
        studies: number of studies.
        seed: seed of the first one; each further one has the next number.
        **settings: see `Arrivals`.
    """
    outcomes = [Arrivals(way, seed=seed + k, **settings).run() for k in range(studies)]
    return {
        "in_vain": round(float(np.mean([each.share_in_vain for each in outcomes])), 4),
        "changed": round(float(np.mean([each.changed for each in outcomes])), 2),
        "imbalance": max(each.imbalance for each in outcomes),
    }


def main() -> None:
    """Prints the figures of each way."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--studies", type=int, default=100, help="number of simulated studies")
    parser.add_argument(
        "--seed", type=int, default=0, help="seed of the first study; each further one has the next one"
    )
    parser.add_argument("--people", type=int, default=200)
    parser.add_argument("--every", type=float, default=90.0, help="mean time between two arrivals [s]")
    parser.add_argument("--drop-out", type=float, default=0.3)
    parser.add_argument("--json", action="store_true")
    asked = parser.parse_args()
    settings = {"seed": asked.seed, "people": asked.people, "every": asked.every, "drop_out": asked.drop_out}
    found = {way: measure(way, asked.studies, **settings) for way in WAYS}
    if asked.json:
        print(json.dumps(found))
        return
    for way, row in found.items():
        print(
            f"roles {way:<11} {row['in_vain']:6.1%} wait in vain, {row['changed']:.1f} changes of a role, "
            f"conditions differ by at most {row['imbalance']:.0f}"
        )


if __name__ == "__main__":
    main()
