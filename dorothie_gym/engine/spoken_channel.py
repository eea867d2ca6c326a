"""What a session asks of spoken words: voices, the noise around them, and what is recognised."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Protocol

from dorothie_gym.dialogue.conversation import Utterance
from dorothie_gym.engine.cabin import CabinState
from dorothie_gym.ontology.roles import Role

if TYPE_CHECKING:
    from dorothie_gym.audio import Samples


class SpokenChannel(Protocol):
    """Voices of a session and what is recognised of them (`speech.spoken_dialogue`).

    Attributes:
        recordings: audio of the spans that were delivered last, with noise, at 16 kHz, by file name.
    """

    recordings: dict[str, Samples]

    def give_voices(self, pitches: Mapping[Role, float]) -> None:
        """Gives speakers a pitch of their own, relative to that of the synthesiser, by role."""

    def speak(self, role: Role, text: str, pace: float) -> Samples:
        """Returns a text as a role says it, at 16 kHz (n,), at a rate relative to that of the session."""

    def begin(self, role: Role, samples: Samples, end: float) -> None:
        """Notes a span that a role has begun and that ends at a time [s]."""

    def seconds(self, samples: Samples) -> float:
        """Returns the duration of audio [s]."""

    def audio_name(self, utterance: int, span: int) -> str:
        """Returns the name of the file with the audio of a span; spans are counted from 0."""

    def hear(self, utterance: Utterance, number: int, cabin: CabinState) -> Utterance:
        """Returns what is recognised of an utterance that is over, the number-th of the session, in a car's noise."""
