"""Folds of towns: those to train in, to develop in, to choose models in, and those for tests."""

from __future__ import annotations

import enum
from collections.abc import Mapping, Sequence
from types import MappingProxyType

from dorothie_gym.errors import TownError
from dorothie_gym.maps.generated.specification import (
    FIRST_TEST_SEED,
    FIRST_VALIDATION_SEED,
    PREFIX,
    is_generated,
    parse_specification,
)

SEEN_TOWNS: tuple[str, ...] = ("midtown", "millbrook", "northgate")
"""Training towns (in the paper: CARLA's Town01, Town03 and Town05)."""

DEVELOPMENT_TOWNS: tuple[str, ...] = ("brookside",)
"""Towns in which nothing shipped was trained, but policies and settings were developed and compared."""

VALIDATION_TOWNS: tuple[str, ...] = tuple(f"{PREFIX}{FIRST_VALIDATION_SEED + k}" for k in range(20))
"""Towns for the choice of models and settings."""

UNSEEN_TOWNS: tuple[str, ...] = tuple(f"{PREFIX}{FIRST_TEST_SEED + k}" for k in range(50))
"""Towns for tests only: no policy is trained, chosen or tuned in them (in the paper: CARLA's Town02)."""

DEFAULT_TOWN = "millbrook"
"""Town of environments and commands that name none: one to train in."""


class TownFold(enum.StrEnum):
    """Purpose of a town: training, choice of models, or tests."""

    SEEN = "seen"
    DEVELOPMENT = "development"
    VALIDATION = "validation"
    UNSEEN = "unseen"


FOLD_TOWNS: Mapping[TownFold, tuple[str, ...]] = MappingProxyType(
    {
        TownFold.SEEN: SEEN_TOWNS,
        TownFold.DEVELOPMENT: DEVELOPMENT_TOWNS,
        TownFold.VALIDATION: VALIDATION_TOWNS,
        TownFold.UNSEEN: UNSEEN_TOWNS,
    }
)
"""Towns of each fold, in the order in which sessions play them. Other generated towns also belong to a fold."""


def fold_of(name: str) -> TownFold | None:
    """Returns the fold of a town: of a shipped one by its name, of a generated one by its seed; None for other towns.

    Raises:
        TownError: the name is one of a generated town, but wrong.
    """
    if is_generated(name):
        seed = parse_specification(name).seed
        if seed >= FIRST_TEST_SEED:
            return TownFold.UNSEEN
        return TownFold.VALIDATION if seed >= FIRST_VALIDATION_SEED else TownFold.SEEN
    return next((fold for fold, towns in FOLD_TOWNS.items() if name in towns), None)


def check_training_towns(names: Sequence[str]) -> None:
    """Checks that no town is one for validation or tests.

    Raises:
        TownError: a town is.
    """
    for name in names:
        fold = fold_of(name)
        if fold in (TownFold.VALIDATION, TownFold.UNSEEN):
            reason = f"is for {'tests' if fold is TownFold.UNSEEN else 'validation'} only; train in others"
            raise TownError(name, "town", f"{reason}, such as generated:SEED with a seed below {FIRST_VALIDATION_SEED}")
