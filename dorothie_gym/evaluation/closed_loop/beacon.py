"""Beacon of a sealed test: a text that nobody could know when a model was sealed, from which its scenarios are drawn.

Such a text is a later value of a public randomness beacon, or the word of an organiser. Numbers are drawn from it by
SHA-256 with whole numbers only, so that they are the same on every processor and in every version of Python. The bias
of the remainder is below 2**-192 for all draws here.
"""

from __future__ import annotations

import datetime
import hashlib
import unicodedata
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final, TypedDict

from dorothie_gym.errors import short_repr
from dorothie_gym.maps.generated.specification import FIRST_TEST_SEED, MOST_SEED, PREFIX
from dorothie_gym.support.copying import shared
from dorothie_gym.tasks.storyboard_specification import StoryboardSource

if TYPE_CHECKING:
    from dorothie_gym.session.config import EnvConfig

TOWNS: Final = 10
"""Number of towns of a sealed test; each is a generated one, from the seeds for tests."""

MOST_CHARACTERS: Final = 500
"""Longest text of a beacon."""

BEACON: Final = "beacon"
"""Field of `SessionHeader.extra` with the beacon of a session (`BeaconPage`)."""

_DOMAIN: Final = "dorothie_gym beacon 1"
"""Prefix of all texts that are hashed; another number stands for another derivation."""

_MOST_ROLLOUT_SEED: Final = 2**31


class BeaconPage(TypedDict):
    """Beacon in JSON types; fields as in `Beacon`."""

    text: str
    date: str


@shared
@dataclass(frozen=True, kw_only=True)
class Beacon:
    """Text from which the scenarios of a sealed test are drawn.

    Attributes:
        text: the text. Its Unicode normal form C is hashed, so that two spellings of one letter are the same.
        date: day on which it became known, as YYYY-MM-DD, in universal time.
    """

    text: str
    date: str

    def __post_init__(self) -> None:
        """Checks the fields."""
        if self.text != self.text.strip() or not self.text.isprintable() or not 0 < len(self.text) <= MOST_CHARACTERS:
            raise ValueError(
                f"beacon is {short_repr(self.text)}; give 1 to {MOST_CHARACTERS} printable characters, without spaces "
                "at either end"
            )
        check_date("beacon-date", self.date)

    @property
    def seed(self) -> int:
        """Seed of the rollout, from which the seeds of its scenarios follow."""
        return self._number("seed", 0) % _MOST_ROLLOUT_SEED

    @property
    def towns(self) -> tuple[str, ...]:
        """Names of the towns."""
        found: list[str] = []
        draw = 0
        while len(found) < TOWNS:
            name = f"{PREFIX}{FIRST_TEST_SEED + self._number('town', draw) % (MOST_SEED - FIRST_TEST_SEED)}"
            found += [name] if name not in found else []
            draw += 1
        return tuple(found)

    def turn(self, scenario: int, partners: int) -> int:
        """Returns the index of the partner of a scenario: in each round all partners play, in a drawn order.

        Args:
            scenario: number of the scenario, from 0.
            partners: number of partners in the pool.
        """
        round_number, place = divmod(scenario, partners)
        draws = [(self._number("partner", round_number * partners + k), k) for k in range(partners)]
        return sorted(draws)[place][1]

    def to_json(self) -> BeaconPage:
        """Returns the fields in JSON types."""
        return {"text": self.text, "date": self.date}

    @classmethod
    def from_json(cls, page: BeaconPage) -> Beacon:
        """Parses the output of `to_json`; raises `ValueError` if a field is malformed."""
        return cls(text=page["text"], date=page["date"])

    def _number(self, purpose: str, index: int) -> int:
        """Returns a draw: SHA-256 of prefix, text, purpose and index, as a whole number below 2**256."""
        text = unicodedata.normalize("NFC", self.text)
        content = "\0".join((_DOMAIN, text, purpose, str(index)))
        return int.from_bytes(hashlib.sha256(content.encode()).digest(), "big")


def sealed_config(config: EnvConfig) -> EnvConfig:
    """Returns the settings of a tier in a sealed test: storyboards are generated, since shipped ones are known."""
    return config if config.talk is not None else replace(config, storyboards=StoryboardSource.GENERATED)


def check_date(name: str, date: str) -> None:
    """Raises `ValueError` unless a text is a date in the form YYYY-MM-DD.

    Args:
        name: name of the date, for the message.
        date: the text.
    """
    try:
        same = datetime.date.fromisoformat(date).isoformat() == date
    except ValueError:
        same = False
    if not same:
        raise ValueError(f"{name} is {short_repr(date)}; write it as YYYY-MM-DD, such as 2026-11-30")
