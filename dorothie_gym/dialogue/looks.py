"""Looks of houses and people as speakers describe them: attributes, the phrases that state them, and their reading."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Final

from dorothie_gym.dialogue.realization_context import enumeration
from dorothie_gym.support.copying import shared

COLOURS: Final = (
    "black", "white", "gray", "brown", "beige", "red", "orange", "yellow", "green", "turquoise", "blue", "purple",
)  # fmt: skip
"""Everyday names of colours."""


@shared
@dataclass(frozen=True, kw_only=True)
class Appearance:
    """Visible attributes of a house or a person, in the order in which speakers prefer them; None where not stated.

    Attributes:
        facade: colour of the walls of a house.
        storeys: number of its storeys.
        roof: colour of its roof.
        garden: what is in front of it or beside it: "tree", "hedge", "fence" or "flowers".
        frames: colour of its window frames.
        coat: colour of the coat of a person.
        trousers: colour of the trousers.
    """

    facade: str | None = None
    storeys: int | None = None
    roof: str | None = None
    garden: str | None = None
    frames: str | None = None
    coat: str | None = None
    trousers: str | None = None

    @property
    def stated(self) -> dict[str, Any]:
        """Attributes that are stated, by name, in order of preference."""
        values = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        return {name: value for name, value in values.items() if value}

    def fits(self, other: Appearance) -> bool:
        """Returns whether `other` has every attribute that is stated here."""
        return all(getattr(other, name) == value for name, value in self.stated.items())

    def contradicts(self, other: Appearance) -> bool:
        """Returns whether an attribute is stated of both, and differently."""
        theirs = other.stated
        return any(theirs.get(name, value) != value for name, value in self.stated.items())

    def joined(self, later: Appearance) -> Appearance:
        """Returns what is stated here and later; what is stated later corrects it."""
        return Appearance(**{**self.stated, **later.stated})

    @property
    def features(self) -> tuple[str, ...]:
        """Noun phrases of the attributes: "a yellow facade", "two storeys"."""
        said = self.stated
        return tuple(
            _garden(value) if name == "garden" else _FEATURES[name].format(_article(value), value, _storeys(value))
            for name, value in said.items()
        )

    @property
    def listed(self) -> str:
        """Features as one phrase: "a yellow facade and two storeys"; empty without any."""
        return enumeration(self.features)

    @property
    def house(self) -> str:
        """Noun phrase of a house, "the yellow two-storey house with the black roof"; empty without a facade."""
        if self.facade is None:
            return ""
        size = f"{_COUNTS.get(self.storeys, self.storeys)}-storey " if self.storeys is not None else ""
        parts = [f"the {self.roof} roof"] if self.roof is not None else []
        parts += [f"the {_GARDENS[self.garden]}"] if self.garden is not None else []
        parts += [f"the {self.frames} window frames"] if self.frames is not None else []
        return f"the {self.facade} {size}house" + (f" with {enumeration(parts)}" if parts else "")


def distinguishing(target: Appearance, others: Sequence[Appearance]) -> Appearance:
    """Returns the attributes that tell a house or person from others: the incremental algorithm.

    Attributes are tried in the order of preference, and kept if they rule out one of the others that are left (Dale and
    Reiter, Cognitive Science 19, 1995). The first one, a colour, is always stated, as people do (Pechmann, Linguistics
    27, 1989), and because it tells the house from the other buildings of the street.

    Args:
        target: look of what is meant.
        others: looks of those that it could be mistaken for.
    """
    chosen: dict[str, Any] = {}
    left = list(others)
    for name, value in target.stated.items():
        remaining = [other for other in left if getattr(other, name) == value]
        if not chosen or len(remaining) < len(left):
            chosen[name], left = value, remaining
        if not left:
            break
    return Appearance(**chosen)


def read_look(text: str) -> Appearance:
    """Returns the attributes of a house or a person that a text states; none are stated where it describes nothing."""
    found: dict[str, Any] = {}
    words = text.casefold()
    for name, pattern in _PATTERNS.items():
        match = pattern.search(words)
        if match is None:
            continue
        value = next((group for group in match.groups() if group is not None), "")
        if name == "storeys":
            found[name] = _NUMBERS.get(value, 0)
        elif name == "garden":
            found[name] = next(kind for kind in _GARDENS if kind in match.group())
        else:
            found[name] = _SPELT.get(value, value)
    return Appearance(**found)


_GARDENS: Final = MappingProxyType(
    {
        "tree": "tree beside it",
        "hedge": "hedge along the front",
        "fence": "white picket fence",
        "flowers": "flowers along the front",
    }
)
_FEATURES: Final = MappingProxyType(
    {
        "facade": "{0} facade",
        "storeys": "{2}",
        "roof": "{0} roof",
        "frames": "{1} window frames",
        "coat": "{0} coat",
        "trousers": "{1} trousers",
    }
)
_NUMBERS: Final = MappingProxyType({"one": 1, "single": 1, "1": 1, "two": 2, "2": 2, "three": 3, "3": 3})
_COUNTS: Final[Mapping[object, str]] = MappingProxyType({1: "one", 2: "two", 3: "three"})
_SPELT: Final = MappingProxyType({"grey": "gray"})
_COLOUR: Final = f"({'|'.join((*COLOURS, 'grey'))})"
_SIZE: Final = r"(?:(?:one|single|two|three|[123])[- ]stor\w+ )?"
_PATTERNS: Final = MappingProxyType(
    {
        name: re.compile(pattern)
        for name, pattern in {
            "facade": rf"\b{_COLOUR} {_SIZE}(?:facade|walls?|front|house|building|one)\b"
            rf"|\b(?:house|building|facade|walls?) (?:is|are) {_COLOUR}\b",
            "storeys": r"\b(one|single|two|three|[123])[- ](?:stor(?:ey|eys|y|ies)|floors?)\b",
            "roof": rf"\b{_COLOUR} roof\b|\broof is {_COLOUR}\b",
            "garden": r"\b(?:a|the) (?:tree|hedge)\b|\b(?:a|the)(?: white)?(?: picket)? fence\b"
            r"|\bflowers (?:along|in)(?: the)? front\b",
            "frames": rf"\b{_COLOUR} (?:window frames|windows|frames)\b",
            "coat": rf"\b{_COLOUR} (?:coat|jacket)\b|\b(?:coat|jacket) is {_COLOUR}\b",
            "trousers": rf"\b{_COLOUR} (?:trousers|pants)\b",
        }.items()
    }
)


def _article(value: object) -> str:
    word = str(value)
    return f"{'an' if word[:1] in 'aeiou' else 'a'} {word}"


def _garden(kind: str) -> str:
    words = _GARDENS[kind]
    return words if kind == "flowers" else _article(words)


def _storeys(value: object) -> str:
    return f"{_COUNTS.get(value, value)} storey{'' if value == 1 else 's'}"
