"""Sizes of the observation and action spaces, and text that fits them."""

from __future__ import annotations

import string
import unicodedata
from dataclasses import dataclass

from dorothie_gym.maps import Town

TEXT_CHARACTERS = string.ascii_letters + string.digits + string.punctuation + " \n"
"""What utterances, messages and stories may be written with."""

UTTERANCE_LENGTH = 160
MESSAGE_LENGTH = 240
STORY_LENGTH = 2400

METRES = 1024
"""Places on a lane are given in whole metres; no lane of a known town is longer than this [m]."""

REACH = 1e6
"""Bound of quantities that have no other: no coordinate [m], speed [m/s] or time [s] of a session comes near it."""

PERCENT = 101
"""Steps of a quantity that the Ad-Wizard sets, as a share of its range."""


@dataclass(frozen=True, kw_only=True)
class SpaceLimits:
    """How many of each thing an observation or action can name.

    The defaults hold the paper's four towns (at most 486 lanes, 33 junctions, 14 streets; appendix C) and ours.
    """

    lanes: int = 640
    junctions: int = 64
    streets: int = 32
    landmarks: int = 16
    subgoals: int = 8
    objects: int = 16
    exits: int = 8
    waypoints: int = 20
    spans: int = 4
    plan: int = 12
    props: int = 16

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if value < 1:
                raise ValueError(f"SpaceLimits.{name} is {value}; it must be at least 1")

    @classmethod
    def for_town(cls, town: Town) -> SpaceLimits:
        """The defaults, larger where a town needs it."""
        return cls(
            lanes=max(cls.lanes, len(town.lanes)),
            junctions=max(cls.junctions, len(town.junctions)),
            streets=max(cls.streets, len(town.streets)),
        )


_PLAIN = str.maketrans({"‘": "'", "’": "'", "“": '"', "”": '"', "–": "-", "—": "-", "…": "..."})
_KNOWN = frozenset(TEXT_CHARACTERS)


def plain_text(text: str, length: int) -> str:
    """The text in the characters of the text spaces, cut to a length: accents go, typographic marks become plain."""
    if text.isascii() and text.isprintable():
        return text[:length]
    spelt = unicodedata.normalize("NFKD", text.translate(_PLAIN))
    return "".join(c for c in spelt if c in _KNOWN)[:length]
