"""Names of generated towns: `generated:SEED`, optionally with size, style and side of the traffic."""

from __future__ import annotations

import enum
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NoReturn, TypedDict

from dorothie_gym.errors import TownError, did_you_mean
from dorothie_gym.maps.driving_side import DrivingSide

SERIES = "generated"
"""Name of the series of all generated towns."""
PREFIX = f"{SERIES}:"
"""Start of the name of each generated town."""
MOST_SEED = 1_000_000_000_000
"""Seeds are smaller than this number."""
FIRST_VALIDATION_SEED = 800_000_000_000
"""Towns of this and higher seeds are not in series: they are for the choice of models."""
FIRST_TEST_SEED = 900_000_000_000
"""Towns of this and higher seeds are for tests only."""

_SEED = re.compile("[0-9]{1,12}")
_NEXT_NAME = re.compile(r",(?!\s*(?:size|style|traffic|lights)\s*=)")


class TownSize(enum.StrEnum):
    """Size of a generated town: about 8, 16 or 28 junctions."""

    SMALL = "small"
    MEDIUM = "medium"
    LARGE = "large"


class TownStyle(enum.StrEnum):
    """Plan of the streets of a generated town."""

    GRID = "grid"
    ORGANIC = "organic"
    RADIAL = "radial"
    MIXED = "mixed"


@dataclass(frozen=True, kw_only=True)
class TownSpecification:
    """Specification of a generated town: all that determines it.

    Attributes:
        seed: seed, from 0 to `MOST_SEED` - 1.
        size: size; None lets the seed choose.
        style: plan of the streets; None lets the seed choose.
        traffic: side of the road on which vehicles drive; with traffic on the left, a town is the mirror image of the
            one with traffic on the right.
    """

    seed: int
    size: TownSize | None = None
    style: TownStyle | None = None
    traffic: DrivingSide = DrivingSide.RIGHT

    def __post_init__(self) -> None:
        """Checks the seed."""
        if not 0 <= self.seed < MOST_SEED:
            raise ValueError(f"seed is {self.seed}; it must be from 0 to {MOST_SEED - 1}")

    def __str__(self) -> str:
        """Returns the name of the town, always spelt in the same way."""
        side = None if self.traffic is DrivingSide.RIGHT else self.traffic
        options = (("size", self.size), ("style", self.style), ("traffic", side))
        return f"{PREFIX}{self.seed}" + "".join(f",{key}={value}" for key, value in options if value is not None)


@dataclass(frozen=True, kw_only=True)
class TownSeries:
    """Generated towns of one size, style and side of the traffic, one for each seed, without those for tests.

    Attributes:
        size: size; None lets the seed choose.
        style: plan of the streets; None lets the seed choose.
        traffic: side of the road on which vehicles drive.
    """

    size: TownSize | None = None
    style: TownStyle | None = None
    traffic: DrivingSide = DrivingSide.RIGHT

    def name(self, seed: int) -> str:
        """Returns the name of the town of a seed; seeds from `FIRST_VALIDATION_SEED` on begin with 0 again."""
        return str(replace(self._first, seed=seed % FIRST_VALIDATION_SEED))

    @property
    def _first(self) -> TownSpecification:
        return TownSpecification(seed=0, size=self.size, style=self.style, traffic=self.traffic)

    def pool(self, count: int) -> tuple[str, ...]:
        """Returns the names of the first towns."""
        return tuple(self.name(seed) for seed in range(count))


def parse_series(name: object) -> TownSeries | None:
    """Returns the series that a name states, such as `generated` or `generated,size=small`; None for another name.

    Raises:
        TownError: with the remedy.
    """
    first, *options = name.split(",") if isinstance(name, str) else [""]
    return TownSeries(**_read_options(str(name), options)) if first == SERIES else None


def split_names(text: str) -> list[str]:
    """Returns the names in a list with commas; the options of a town belong to its name."""
    parts = [part.strip() for part in _NEXT_NAME.split(text)]
    return [part for part in parts if part]


def is_generated(name: str) -> bool:
    """Returns whether a name is that of a generated town, correct or not."""
    return name.startswith(PREFIX)


def parse_specification(name: str) -> TownSpecification:
    """Returns the specification that a name states, such as `generated:7,size=small,style=grid`.

    Raises:
        TownError: with the remedy.
    """
    seed, *options = name.removeprefix(PREFIX).split(",")
    if not is_generated(name) or not _SEED.fullmatch(seed):
        _fail(name, f"its seed is {seed!r}; write a whole number from 0 to {MOST_SEED - 1}, such as 'generated:7'")
    return TownSpecification(seed=int(seed), **_read_options(name, options))


class _Options(TypedDict, total=False):
    size: TownSize
    style: TownStyle
    traffic: DrivingSide


def _read_options(name: str, options: Sequence[str]) -> _Options:
    values = _Options()
    for option in options:
        key, equals, value = option.partition("=")
        if not equals or key not in _OPTIONS:
            known = ", ".join(f"{each}=..." for each in _OPTIONS)
            _fail(name, f"unknown option {option!r}; {did_you_mean(key, _OPTIONS)}known are {known}")
        if key in values:
            _fail(name, f"{key!r} is there twice; remove one")
        members = [str(member) for member in _OPTIONS[key]]
        if value not in members:
            _fail(name, f"{key} is {value!r}; {did_you_mean(value, members)}known are {', '.join(members)}")
        values[key] = _OPTIONS[key](value)  # type: ignore[literal-required]  # `key` is one of them
    return values


_OPTIONS: dict[str, type[TownSize] | type[TownStyle] | type[DrivingSide]] = {
    "size": TownSize,
    "style": TownStyle,
    "traffic": DrivingSide,
}


def _fail(name: str, reason: str) -> NoReturn:
    raise TownError(name, "town", reason)
