"""Utterances of a session as annotators read them: speakers, words and times, without any label."""

from __future__ import annotations

import hashlib
import itertools
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple, Self

from dorothie_gym.errors import SessionError
from dorothie_gym.ontology.roles import Role

if TYPE_CHECKING:
    from dorothie_gym.session.recording.session import Session

SPEAKERS = (Role.PARTICIPANT, Role.CO_WIZARD)
"""Speakers whose utterances are annotated."""


class UtteranceId(NamedTuple):
    """Identity of an utterance in its session: speaker and number."""

    speaker: Role
    number: int

    def __str__(self) -> str:
        return f"utterance {self.number} of {self.speaker.value}"


@dataclass(frozen=True, kw_only=True)
class SourceLine:
    """Utterance to be annotated.

    Attributes:
        id: speaker and number.
        words: words, split at white space; one empty word for an utterance without words.
        start, end: start and end [s].
        offset: number of words of all utterances before.
    """

    id: UtteranceId
    words: tuple[str, ...]
    start: float
    end: float
    offset: int

    def text(self, first: int, count: int) -> str:
        """Returns `count` words, starting with word `first`."""
        return " ".join(self.words[first : first + count])


@dataclass(frozen=True)
class SourceText:
    """Utterances of participant and Co-Wizard of a session, in the order of the record.

    Attributes:
        session: name of the session.
        lines: the utterances.
    """

    session: str
    lines: tuple[SourceLine, ...]

    @classmethod
    def of(cls, session: Session) -> Self:
        """Returns the text of a session; raises `SessionError` if it has no utterances."""
        said = [utterance for utterance in session.utterances() if utterance.speaker in SPEAKERS]
        if not said:
            raise SessionError(f"session {session.name}: nobody speaks in it; there is nothing to annotate")
        words = [tuple(utterance.text.split()) or ("",) for utterance in said]
        offsets = itertools.accumulate((len(each) for each in words), initial=0)
        return cls(
            session.name,
            tuple(
                SourceLine(
                    id=UtteranceId(utterance.speaker, utterance.number),
                    words=each,
                    start=utterance.start,
                    end=max(utterance.start, utterance.end),
                    offset=offset,
                )
                for utterance, each, offset in zip(said, words, offsets, strict=False)
            ),
        )

    @cached_property
    def by_id(self) -> dict[UtteranceId, SourceLine]:
        """The utterances by speaker and number."""
        return {line.id: line for line in self.lines}

    @cached_property
    def digest(self) -> str:
        """SHA-256 of speakers and words, in hexadecimal digits; the numbers of utterances do not take part."""
        content = "\n".join(f"{line.id.speaker.value}: {' '.join(line.words)}" for line in self.lines)
        return hashlib.sha256(content.encode("utf-8", "surrogatepass")).hexdigest()

    def check_same(self, other: SourceText) -> None:
        """Raises `SessionError` if another text has other speakers or words; names the first difference."""
        for mine, others in itertools.zip_longest(self.lines, other.lines):
            if mine is None or others is None:
                raise SessionError(
                    f"{other.session} has {len(other.lines)} utterances, and {self.session} has {len(self.lines)}; "
                    "they are not the same session"
                )
            if (mine.id.speaker, mine.words) != (others.id.speaker, others.words):
                raise SessionError(
                    f"{other.session} and {self.session} are not the same session: {others.id} is "
                    f"{' '.join(others.words)!r} in the one, {mine.id} is {' '.join(mine.words)!r} in the other"
                )
