"""Names of generated storyboards, such as `generated:7,stops=5`, and the storyboards that sessions draw from."""

from __future__ import annotations

import enum
import re
from dataclasses import dataclass
from typing import Final

from dorothie_gym.errors import StoryboardError
from dorothie_gym.support.copying import shared

PREFIX: Final = "generated:"
"""Start of the name of each generated storyboard."""

MOST_SEED: Final = 1_000_000_000_000
"""Seeds are smaller than this number."""

STOPS: Final = (2, 6)
"""Range of the number of stops, the subgoals at the start (paper, "Task Configuration")."""

_NAME: Final = re.compile(rf"{PREFIX}([0-9]{{1,24}})(?:,stops=([0-9]+))?")


class StoryboardSource(enum.StrEnum):
    """Storyboards from which a session draws its own."""

    SHIPPED = "shipped"
    """Those of the package."""
    GENERATED = "generated"
    """A new one for each session."""


@shared
@dataclass(frozen=True, kw_only=True)
class StoryboardSpecification:
    """What determines a generated storyboard.

    Attributes:
        seed: seed, from 0 to `MOST_SEED` - 1.
        stops: number of stops; None lets the seed choose.

    Raises:
        ValueError: a field is out of its range; names it.
    """

    seed: int
    stops: int | None = None

    def __post_init__(self) -> None:
        """Checks the fields."""
        if not 0 <= self.seed < MOST_SEED:
            raise ValueError(f"seed is {self.seed}; it must be from 0 to {MOST_SEED - 1}")
        if self.stops is not None and not STOPS[0] <= self.stops <= STOPS[1]:
            raise ValueError(f"stops is {self.stops}; it must be from {STOPS[0]} to {STOPS[1]}")

    def __str__(self) -> str:
        """Returns the name of the storyboard, always spelt in the same way."""
        return f"{PREFIX}{self.seed}" + ("" if self.stops is None else f",stops={self.stops}")


def is_generated(name: str) -> bool:
    """Returns whether a name is that of a generated storyboard, correct or not."""
    return name.startswith(PREFIX)


def parse_specification(name: str) -> StoryboardSpecification:
    """Returns the specification that a name states, such as `generated:7,stops=5`.

    Raises:
        StoryboardError: with the remedy.
    """
    found = _NAME.fullmatch(name)
    if found is None:
        raise StoryboardError(name, "name", f"write {PREFIX}SEED or {PREFIX}SEED,stops=N, such as {PREFIX}7,stops=5")
    try:
        return StoryboardSpecification(seed=int(found[1]), stops=None if found[2] is None else int(found[2]))
    except ValueError as error:
        raise StoryboardError(name, "name", str(error)) from None
