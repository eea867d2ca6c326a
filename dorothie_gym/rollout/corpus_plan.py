"""Which sessions a corpus is made of: folds and towns as in the paper, a seed for each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

import numpy as np

from dorothie_gym.sessions import FOLDS, Fold
from dorothie_gym.world.town import SEEN_TOWNS, UNSEEN_TOWNS

PAPER_FOLDS: Final[Mapping[Fold, int]] = MappingProxyType(
    {Fold.TRAIN: 123, Fold.VAL_SEEN: 14, Fold.VAL_UNSEEN: 6, Fold.TEST_SEEN: 25, Fold.TEST_UNSEEN: 15}
)
"""Sessions of each fold of the original corpus, 183 in all (paper, section 4)."""

PAPER_SESSIONS: Final = sum(PAPER_FOLDS.values())

_UNSEEN: Final = frozenset((Fold.VAL_UNSEEN, Fold.TEST_UNSEEN))


@dataclass(frozen=True, kw_only=True)
class SessionPlan:
    """A session that a corpus is to have.

    Attributes:
        number: its number in the corpus, from 0.
        fold: where it belongs.
        town: name of its town.
        seed: everything in it follows from this.
    """

    number: int
    fold: Fold
    town: str
    seed: int

    @property
    def path(self) -> str:
        """Its folder within the corpus."""
        return f"{self.fold}/{self.number:04d}-{self.town}"


def plan_corpus(sessions: int, seed: int) -> tuple[SessionPlan, ...]:
    """Returns the sessions of a corpus; towns take turns within a fold.

    Args:
        sessions: how many; they are shared out among the folds as the paper's 183.
        seed: the seed of a session follows from it and from the session's number only.

    Raises:
        ValueError: there is to be no session, or the seed is negative.
    """
    if sessions < 1:
        raise ValueError(f"sessions is {sessions}; it must be at least 1")
    if seed < 0:
        raise ValueError(f"seed is {seed}; it must be at least 0")
    plans: list[SessionPlan] = []
    for fold, count in fold_sizes(sessions).items():
        towns = UNSEEN_TOWNS if fold in _UNSEEN else SEEN_TOWNS
        for k in range(count):
            number = len(plans)
            plans.append(SessionPlan(number=number, fold=fold, town=towns[k % len(towns)], seed=_seed(seed, number)))
    return tuple(plans)


def fold_sizes(sessions: int) -> dict[Fold, int]:
    """Returns how many of so many sessions each fold has: the paper's shares, by largest remainders."""
    shares = {fold: sessions * PAPER_FOLDS[fold] for fold in FOLDS}
    sizes = {fold: share // PAPER_SESSIONS for fold, share in shares.items()}
    by_remainder = sorted(FOLDS, key=lambda fold: -(shares[fold] % PAPER_SESSIONS))
    for fold in by_remainder[: sessions - sum(sizes.values())]:
        sizes[fold] += 1
    return sizes


def _seed(seed: int, number: int) -> int:
    return int(np.random.SeedSequence([seed, number]).generate_state(1)[0] >> 1)
