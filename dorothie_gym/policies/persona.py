"""Personas: lasting traits of the scripted speakers, drawn for a session or fixed by its settings."""

from __future__ import annotations

import enum
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from types import MappingProxyType
from typing import Final, TypeVar

import numpy as np

from dorothie_gym.errors import did_you_mean
from dorothie_gym.policies.speech_timing import Delivery
from dorothie_gym.support import portable_math as pm

_Style = TypeVar("_Style", bound=enum.StrEnum)


class Directions(enum.StrEnum):
    """Style in which a participant gives directions."""

    TURNS = "turns"
    """By turns, with ordinals and the names of streets."""
    LANDMARKS = "landmarks"
    """By landmarks, traffic lights and signs along the route, and by the look of the goal."""
    STREETS = "streets"
    """By the names of the streets to turn onto."""
    COMPASS = "compass"
    """By streets and points of the compass."""
    VAGUE = "vague"
    """Gives directions late and without details, so that the car must ask."""


class Driving(enum.StrEnum):
    """Driving style of a Co-Wizard."""

    GENTLE = "gentle"
    """Slowly, and slower before turns and places."""
    USUAL = "usual"
    BRISK = "brisk"
    """At the usual speed, without slowing down early."""


@dataclass(frozen=True, kw_only=True)
class Persona:
    """Lasting traits of a speaker. Without a unit, a trait is in [0, 1], and its average is 0.5.

    Attributes:
        talkativeness: amount of optional remarks.
        patience: tolerance of standstills and silence.
        politeness: from blunt to polite.
        certainty: rarity of hesitations, checks, and requests to repeat.
        knowledge: the participant's knowledge of the town: names of streets, and the route.
        attention: attention to weather, crowds and the route; below `INATTENTIVE`, the speaker makes no remarks on
            them.
        humour: amount of small talk.
        directions: style of giving directions (participant).
        driving: driving style (Co-Wizard).
        pace: speaking rate relative to the average.
        gap: median of the time before a reply [s].
        reaction: median of the time from the end of an instruction to pedal or button [s].
        pitch: pitch of the voice in spoken sessions relative to that of the synthesiser.
    """

    talkativeness: float = 0.5
    patience: float = 0.5
    politeness: float = 0.5
    certainty: float = 0.5
    knowledge: float = 0.5
    attention: float = 0.5
    humour: float = 0.5
    directions: Directions = Directions.TURNS
    driving: Driving = Driving.USUAL
    pace: float = 1.0
    gap: float = 0.3
    reaction: float = 0.75
    pitch: float = 0.92

    @property
    def ignores(self) -> bool:
        """Whether the speaker makes no remarks on the surroundings of the car."""
        return self.attention < INATTENTIVE

    @property
    def delivery(self) -> Delivery:
        """Timing of the speech."""
        return Delivery(
            pace=self.pace, gap=self.gap, pause=0.5 + 0.6 * self.patience, patience=2.0 + 2.0 * self.patience
        )

    @property
    def leanings(self) -> Mapping[str, float]:
        """Places of the traits of the wording in their ranges, see `draw_style`."""
        return {
            "register": self.politeness,
            "indirectness": self.politeness,
            "chattiness": self.talkativeness,
            "disfluency": 1.0 - self.certainty,
        }

    def draw_reaction(self, rng: np.random.Generator) -> float:
        """Draws the time from the end of an instruction to pedal or button [s]."""
        return self.reaction * pm.exp(REACTION_SPREAD * float(rng.standard_normal()))

    def to_json(self) -> dict[str, float | str]:
        """Returns the traits in JSON types."""
        return {name: value if isinstance(value, str) else round(value, 3) for name, value in asdict(self).items()}

    @classmethod
    def draw(cls, rng: np.random.Generator, given: Mapping[str, Trait] | None = None) -> Persona:
        """Draws a persona.

        Args:
            rng: source of randomness; the same numbers are drawn regardless of the arguments.
            given: values or ranges of the traits that are given.
        """
        drawn = {name: float(rng.random()) for name in SHARES}
        directions = _pick(rng, _MANNERS)
        driving = _pick(rng, {Driving.GENTLE: 0.3, Driving.USUAL: 0.45, Driving.BRISK: 0.25})
        for name, (median, spread, low, high) in _TIMES.items():
            drawn[name] = min(max(median * pm.exp(spread * float(rng.standard_normal())), low), high)
        # from a stream of its own, so that the other numbers stay those of sessions without voices
        drawn["pitch"] = round(float(rng.spawn(1)[0].uniform(*PITCHES)), 3)
        for name, trait in (given or {}).items():
            place = float(rng.random())
            if not isinstance(trait, str):
                drawn[name] = trait[0] + (trait[1] - trait[0]) * place
            elif name == "directions":
                directions = Directions(trait)
            else:
                driving = Driving(trait)
        return cls(directions=directions, driving=driving, **drawn)


Trait = str | tuple[float, float]
"""Value of a named trait, or range of a numeric one."""

_MANNERS: Final = MappingProxyType(
    {
        Directions.TURNS: 0.3,
        Directions.LANDMARKS: 0.3,
        Directions.STREETS: 0.15,
        Directions.COMPASS: 0.05,
        Directions.VAGUE: 0.2,
    }
)
"""Shares of the manners of giving directions; set by hand: people mostly go by turns and by what they see."""

REACTION_SPREAD: Final = 0.25
"""Standard deviation of the logarithm of one speaker's reaction times; set by hand."""

INATTENTIVE: Final = 0.08
"""Attention below which a speaker makes no remarks on the surroundings of the car."""

SHARES: Final = ("talkativeness", "patience", "politeness", "certainty", "knowledge", "attention", "humour")
"""Traits in [0, 1]."""

PITCHES: Final = (0.86, 0.97)
"""Range of the pitch of voices; set by hand. Above 1, the recogniser fails on short words: "stop" is recognised 8 times
of 8 at 0.9, 3 to 5 times at 1, and never at 1.1."""

_TIMES: Final[Mapping[str, tuple[float, float, float, float]]] = MappingProxyType(
    {
        # between-speaker spread set by hand; rates of short turns are lowered by `Delivery`
        "pace": (1.08, 0.1, 0.8, 1.4),
        # English: mean 236 ms over questions (Stivers et al., PNAS 106, 2009); planning takes 600 ms and more (Levinson
        # and Torreira, Frontiers in Psychology 6:731, 2015)
        "gap": (0.3, 0.35, 0.12, 0.9),
        # drivers brake 0.7 to 1.5 s after a signal, by how much it is expected (Green, Transportation Human Factors 2,
        # 2000)
        "reaction": (0.75, 0.2, 0.5, 1.4),
    }
)
"""Median, spread of the logarithm between speakers, minimum and maximum of the traits with a unit."""

_NAMED: Final[Mapping[str, type[enum.StrEnum]]] = MappingProxyType({"directions": Directions, "driving": Driving})


def parse_traits(text: str) -> dict[str, Trait]:
    """Parses traits as they are given on a command line: "talkativeness=0.8..1,directions=vague".

    Raises:
        ValueError: a trait or a value is unknown, or out of range.
    """
    found: dict[str, Trait] = {}
    names = [field.name for field in fields(Persona)]
    for part in text.split(","):
        name, _, value = (piece.strip() for piece in part.partition("="))
        if name not in names:
            raise ValueError(
                f"there is no trait {name!r}; {did_you_mean(name, names)}the traits are {', '.join(names)}, "
                "as in talkativeness=0.8..1,directions=vague"
            )
        found[name] = _named_value(name, value) if name in _NAMED else _range(name, value)
    return found


def _named_value(name: str, value: str) -> str:
    try:
        return _NAMED[name](value)
    except ValueError:
        raise ValueError(f"{name} is {value!r}; it must be one of {', '.join(_NAMED[name])}") from None


def _range(name: str, text: str) -> tuple[float, float]:
    low, high = (0.0, 1.0) if name in SHARES else PITCHES if name == "pitch" else _TIMES[name][2:]
    ends = text.split("..")
    try:
        first, last = float(ends[0]), float(ends[-1])
    except ValueError:
        first, last = math.nan, math.nan
    if len(ends) > 2 or not low <= first <= last <= high:
        raise ValueError(f"{name} is {text!r}; it must be a number or a range such as {low:g}..{high:g}, within these")
    return first, last


def within(low: float, high: float, trait: float, rng: np.random.Generator) -> float:
    """Returns a value in a range, determined to three quarters by a trait and otherwise by the individual speaker."""
    return low + (high - low) * (0.75 * trait + 0.25 * float(rng.random()))


def _pick(rng: np.random.Generator, shares: Mapping[_Style, float]) -> _Style:
    drawn = float(rng.random())
    for name, share in shares.items():
        drawn -= share
        if drawn < 0.0:
            return name
    return list(shares)[-1]
