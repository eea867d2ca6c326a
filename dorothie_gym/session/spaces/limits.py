"""Sizes of the observation and action spaces, equal for all towns by default, and text normalisation."""

from __future__ import annotations

import string
import unicodedata
from collections.abc import Iterable
from dataclasses import dataclass

from dorothie_gym.maps.town import Town
from dorothie_gym.support.copying import shared
from dorothie_gym.tasks.storyboard import MESSAGE_LENGTH as MESSAGE_LENGTH

TEXT_CHARACTERS = string.ascii_letters + string.digits + string.punctuation + " \n"
"""Permitted characters of utterances, messages and stories."""

UTTERANCE_LENGTH = 160
"""Greatest length of one span of an utterance [characters]."""

MEANING_LENGTH = 640
"""Greatest length of the propositions of one span, as JSON [characters]."""

STORY_LENGTH = 2400
"""Greatest length of a story [characters]."""

LANE_METRES = 1024
"""Number of positions on a lane, in whole metres; no lane of a known town is longer [m]."""

UNBOUNDED = 1e6
"""Bound of quantities without a natural bound; far beyond all positions [m], speeds [m/s] and times [s]."""

PERCENT = 101
"""Number of steps of a share in percent, 0 to 100."""


@shared
@dataclass(frozen=True, kw_only=True)
class SpaceLimits:
    """Numbers of rows and ids in observation and action spaces.

    The defaults cover the four towns of the paper (at most 486 lanes, 33 junctions, 14 streets; appendix C) and ours:
    a policy trained in one town can act in another.

    Attributes:
        lanes: number of lane ids.
        junctions: number of junction indices.
        streets: number of street indices.
        landmarks: rows of `landmarks`.
        subgoals: rows of `subgoals`.
        objects: rows of `objects`.
        exits: rows of `exits`.
        waypoints: rows of `waypoints`.
        spans: spans of an utterance.
        plan: junctions of a plan, and lanes of a path.
        props: rows of `props`.

    Raises:
        ValueError: if a size is below 1; names the field.
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
        """Returns the default sizes, enlarged where the town needs it."""
        return cls.for_towns((town,))

    @classmethod
    def for_towns(cls, towns: Iterable[Town]) -> SpaceLimits:
        """Returns the default sizes, enlarged where one of the towns needs it."""
        towns = tuple(towns)
        return cls(
            lanes=max(cls.lanes, *(len(town.lanes) for town in towns)),
            junctions=max(cls.junctions, *(len(town.junctions) for town in towns)),
            streets=max(cls.streets, *(len(town.streets) for town in towns)),
        )


_PLAIN = str.maketrans({"‘": "'", "’": "'", "“": '"', "”": '"', "–": "-", "—": "-", "…": "..."})
_KNOWN = frozenset(TEXT_CHARACTERS)


def plain_text(text: str, length: int) -> str:
    """Returns text in `TEXT_CHARACTERS`, truncated to `length`; accents are removed, typographic marks replaced."""
    if text.isascii() and text.isprintable():
        return text[:length]
    spelt = unicodedata.normalize("NFKD", text.translate(_PLAIN))
    return "".join(c for c in spelt if c in _KNOWN)[:length]
