"""Recordings of spoken turns as the audio of dialogue moves: the field `audio` of the events of a session."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from dorothie_gym.session.recording.events import Event, EventType

if TYPE_CHECKING:
    from dorothie_gym.ontology.roles import Role


class SpanRecordings:
    """Names of the recordings of spans that people have said and that have not ended yet.

    The engine does not know about recordings. A span is found by its speaker and words when its utterance
    ends; spans with equal words end in the order in which they were said.
    """

    def __init__(self) -> None:
        self._said: dict[Role, deque[tuple[str, str | None]]] = {}

    def say(self, role: Role, text: str, audio: str | None) -> None:
        """Records a span.

        Args:
            role: speaker.
            text: words.
            audio: name of the recording of its turn; None for a typed one.
        """
        self._said.setdefault(role, deque()).append((text, audio))

    def named(self, events: Sequence[Event]) -> tuple[Event, ...]:
        """Returns events in which the dialogue moves that were spoken into a microphone name their recordings."""
        return tuple(self._named(events))

    def _named(self, events: Sequence[Event]) -> Iterator[Event]:
        for event in events:
            audio = self._take(event.source, str(event.data["span"])) if _is_said(event) else None
            yield event if audio is None else replace(event, data={**event.data, "audio": audio})

    def _take(self, role: Role, text: str) -> str | None:
        """Returns and removes the recording of the first span with these words; also removes earlier, refused ones.

        A span of a policy has none.
        """
        said = self._said.get(role, deque())
        if all(words != text for words, _ in said):
            return None
        while True:
            words, audio = said.popleft()
            if words == text:
                return audio


def _is_said(event: Event) -> bool:
    return event.type is EventType.DIALOGUE_MOVE
