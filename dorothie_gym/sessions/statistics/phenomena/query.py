"""What a query of a phenomenon is."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TypeAlias

from dorothie_gym.ontology import Role
from dorothie_gym.sessions.statistics.phenomena.talk import Talk, Turn

HUMAN, CAR = Role.PARTICIPANT, Role.CO_WIZARD


@dataclass(frozen=True)
class Finding:
    """An occurrence: the turn that it begins with, and which of the phenomenon's forms it has."""

    turn: Turn
    form: str


Query: TypeAlias = Callable[[Talk], Iterator[Finding]]


@dataclass(frozen=True, kw_only=True)
class Phenomenon:
    """Something that talk between people and cars has (spec of the dialogue).

    Attributes:
        number: 1 to 24, as in the spec.
        title: a few words.
        cause: what has to happen for it to be possible, in words.
        has_cause: whether it happened, read from acts, texts and events of the world.
        find: its occurrences, each with its form.
        forms: the forms that `find` tells apart.
    """

    number: int
    title: str
    cause: str
    has_cause: Callable[[Talk], bool]
    find: Query
    forms: tuple[str, ...]


def both_speak(talk: Talk) -> bool:
    """Whether both sides say something."""
    return {HUMAN, CAR} <= {turn.speaker for turn in talk.turns}
