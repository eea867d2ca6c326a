"""Options of the scripted Ad-Wizard as text: "rate=4,spacing=12,bad_weather_time=120..240,kinds=roadblock+weather"."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Final, NamedTuple

from dorothie_gym.errors import did_you_mean
from dorothie_gym.policies.ad_wizard import KINDS, MOST_TRICKS, AdWizardConfig, Trick

RATE: Final = "rate"
"""Option with the average number of tricks in a session."""

TRICKS: Final = "kinds"
"""Option with the permitted tricks, joined by "+"."""


class OptionRange(NamedTuple):
    """Permitted values of an option: bounds, whether it is a whole number, and whether it is a range of two numbers."""

    low: float
    high: float
    whole: bool = False
    pair: bool = False


NUMBERS: Final[Mapping[str, OptionRange]] = MappingProxyType(
    {
        RATE: OptionRange(0.0, MOST_TRICKS),
        "first_at": OptionRange(0.0, 3600.0),
        "window": OptionRange(1.0, 3600.0),
        "spacing": OptionRange(0.0, 600.0),
        "expires_after": OptionRange(0.0, 3600.0),
        "roadblock_ahead": OptionRange(20.0, 300.0, pair=True),
        "roadblock_speed": OptionRange(0.0, 20.0),
        "roadblock_clearance": OptionRange(0.0, 200.0),
        "roadblock_time": OptionRange(1.0, 900.0),
        "most_roadblocks": OptionRange(0, 8, whole=True),
        "bad_weather_time": OptionRange(1.0, 900.0, pair=True),
        "crowd_ahead": OptionRange(20.0, 300.0, pair=True),
        "crowd_extent": OptionRange(5, 60, whole=True),
        "crowd_sizes": OptionRange(1, 12, whole=True, pair=True),
        "crowd_of_people": OptionRange(0.0, 1.0),
    }
)
"""Numeric options: the rate, and fields of `AdWizardConfig`."""


@dataclass(frozen=True, kw_only=True)
class AdWizardOptions:
    """Options of a `ScriptedAdWizard`; fields as its arguments."""

    rate: float = 2.5
    kinds: tuple[Trick, ...] = KINDS
    config: AdWizardConfig = field(default_factory=AdWizardConfig)


def parse_ad_wizard(text: str) -> AdWizardOptions:
    """Parses options of the scripted Ad-Wizard as they are given on a command line.

    Raises:
        ValueError: an option or a value is unknown, or out of range.
    """
    names, numbers, kinds = (*NUMBERS, TRICKS), dict[str, object](), KINDS
    for part in text.split(","):
        name, _, value = (piece.strip() for piece in part.partition("="))
        if name == TRICKS:
            kinds = _tricks(value)
        elif name in NUMBERS:
            numbers[name] = _number(name, value, NUMBERS[name])
        else:
            raise ValueError(
                f"there is no option {name!r} of the Ad-Wizard; {did_you_mean(name, names)}the options are "
                f"{', '.join(names)}, as in rate=4,spacing=12"
            )
    rate = numbers.pop(RATE, AdWizardOptions.rate)
    return AdWizardOptions(rate=rate, kinds=kinds, config=AdWizardConfig(**numbers))  # type: ignore[arg-type]


def _tricks(text: str) -> tuple[Trick, ...]:
    found = []
    for name in text.split("+"):
        if name not in tuple(Trick):
            raise ValueError(f"kinds has {name!r}; they must be of {', '.join(Trick)}, as in kinds=roadblock+weather")
        found.append(Trick(name))
    return tuple(found)


def _number(name: str, text: str, allowed: OptionRange) -> object:
    ends = text.split("..")
    try:
        values = [float(end) for end in ends]
    except ValueError:
        values = [math.nan]
    well = all(allowed.low <= value <= allowed.high and (not allowed.whole or value == int(value)) for value in values)
    if not well or values != sorted(values) or len(values) > (2 if allowed.pair else 1):
        kind = "whole number" if allowed.whole else "number"
        form = f"{kind} or a range such as {allowed.low:g}..{allowed.high:g}" if allowed.pair else kind
        raise ValueError(f"{name} is {text!r}; it must be a {form}, in {allowed.low:g}..{allowed.high:g}")
    plain = [int(value) if allowed.whole else value for value in values]
    return (plain[0], plain[-1]) if allowed.pair else plain[0]
