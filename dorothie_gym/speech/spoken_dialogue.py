"""Spoken dialogue of a session: synthesis, noise in the car, crosstalk, and recognition."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from dorothie_gym.dialogue.asr_channel import UNCLASSIFIED, OpenMoves
from dorothie_gym.dialogue.conversation import SHORTEST_SPAN, Span, Utterance
from dorothie_gym.dialogue.dialogue_act_classifier import guess_act
from dorothie_gym.ontology.roles import Role
from dorothie_gym.session.dialogue_channel import CabinState, signal_to_noise
from dorothie_gym.speech.backends import find_recognizer, find_synthesizer
from dorothie_gym.speech.cabin_noise import cabin_noise, mixed
from dorothie_gym.speech.spoken_form import spoken_words
from dorothie_gym.speech.spoken_understanding import audible, readable
from dorothie_gym.speech.synthesizer import Voice, say
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.audio import SAMPLE_RATE, Samples
from dorothie_gym.support.copying import shared

if TYPE_CHECKING:
    from dorothie_gym.ontology.dialogue_acts import DialogueMove
    from dorothie_gym.speech.recognizer import Recognition

VOICE_RATE: Final = 3.6
"""Speaking rate of the synthesised voice [words/s], by which the rate of a session is divided; measured on 150 spans of
sessions, without silence around them (`python -m benchmarks speech`)."""

PITCHES: Final = {Role.PARTICIPANT: (0.86, 0.97), Role.CO_WIZARD: (0.92, 0.96)}
"""Ranges from which the pitch of a speaker without a voice of its own is drawn; set by hand, see `policies.persona`."""

DISTINCT: Final = 0.03
"""Minimum difference in pitch between the speakers, set by hand. Smaller ones are hard to hear between utterances."""

CROSSTALK: Final = -15.0
"""Level of the other speaker's voice at a speaker's microphone, where both talk [dB]; set by hand."""

MARGIN: Final = 0.2
"""Time before and after a span in which the recogniser hears only noise [s]."""


@shared
@dataclass(frozen=True, eq=False)
class SpokenSpan:
    """Audio of a span.

    Attributes:
        start: time of its first sample [s of the session].
        samples: the voice alone at 16 kHz (n,), float32.
    """

    start: float
    samples: Samples


class SpokenDialogue:
    """Voices of a session and their recognition.

    Attributes:
        recordings: audio of the spans that were delivered last, with noise, at 16 kHz, by file name.
    """

    def __init__(self, seed: np.random.SeedSequence, *, words_per_second: float, classify: bool) -> None:
        """Begins without an utterance.

        Args:
            seed: seed of voices and noise.
            words_per_second: speaking rate of the session [words/s].
            classify: as in `dialogue.Recogniser`.

        Raises:
            SpeechError: the extra `speech` is not installed.
        """
        find_synthesizer()  # reported before the first word
        find_recognizer()
        self._rng = np.random.default_rng(seed)
        self._voices = {role: Voice(pitch=round(self._rng.uniform(*PITCHES[role]), 2)) for role in PITCHES}
        self._rate = words_per_second / VOICE_RATE
        self._classify = classify
        self._open = OpenMoves()
        self._spans: dict[Role, list[SpokenSpan]] = {role: [] for role in PITCHES}
        self._over: dict[Role, list[SpokenSpan]] = {role: [] for role in PITCHES}
        self.recordings: dict[str, Samples] = {}

    def give_voices(self, pitches: Mapping[Role, float]) -> None:
        """Gives speakers a pitch of their own; moves the Co-Wizard's if it is too close to the participant's.

        Args:
            pitches: pitch relative to that of the synthesiser, by role; other roles keep theirs.

        Raises:
            ValueError: a pitch is out of the range of `Voice`.
        """
        self._voices |= {role: Voice(pitch=round(pitch, 2)) for role, pitch in pitches.items() if role in self._voices}
        own, other = (self._voices[role].pitch for role in (Role.CO_WIZARD, Role.PARTICIPANT))
        if round(abs(own - other), 2) < DISTINCT:
            low, high = PITCHES[Role.PARTICIPANT]
            moved = other + DISTINCT if other + DISTINCT <= high else max(other - DISTINCT, low)
            self._voices[Role.CO_WIZARD] = Voice(pitch=round(moved, 2))

    def speak(self, role: Role, text: str, pace: float) -> Samples:
        """Returns a text spoken by a role, at 16 kHz, padded with silence to `SHORTEST_SPAN`.

        Args:
            role: the speaker.
            text: the text.
            pace: speaking rate relative to that of the session.
        """
        seed = int(self._rng.integers(2**31))
        samples = say(find_synthesizer(), text, self._voices[role], rate=pace * self._rate, seed=seed)
        silence = max(round(SHORTEST_SPAN * SAMPLE_RATE) - len(samples), 0)
        return np.concatenate([samples, np.zeros(silence, dtype=np.float32)])

    def begin(self, role: Role, samples: Samples, end: float) -> None:
        """Records a span that a role has begun and that ends at a time [s]."""
        self._spans[role].append(SpokenSpan(end - len(samples) / SAMPLE_RATE, samples))

    @staticmethod
    def seconds(samples: Samples) -> float:
        """Returns the duration of audio [s]."""
        return len(samples) / SAMPLE_RATE

    @staticmethod
    def audio_name(utterance: int, span: int) -> str:
        """Returns the name of the file with the audio of a span; spans are counted from 0."""
        return f"utterance_{utterance}_{span}.flac"

    def hear(self, utterance: Utterance, number: int, cabin: CabinState) -> Utterance:
        """Returns the recognition of a completed utterance, and keeps its audio in `recordings`.

        A span without word errors has the speaker's act; otherwise the act is parsed from the words.

        Args:
            utterance: spoken utterance; calls follow the order of utterance ends.
            number: number of the utterance in the session.
            cabin: state of the car at its end.
        """
        role = utterance.speaker
        spoken, self._spans[role] = self._spans[role], []
        after = self._open.answered_by(utterance)
        spans = []
        for place, (span, audio) in enumerate(zip(utterance.spans, spoken, strict=True)):
            heard = self._recognised(role, audio, cabin, self.audio_name(number, place))
            spans.append(self._read(span, heard, after if place == 0 else None))
        self._over[role] = spoken
        self._open.note(utterance)
        return replace(utterance, spans=tuple(spans))

    def _recognised(self, role: Role, audio: SpokenSpan, cabin: CabinState, name: str) -> Recognition:
        margin = round(MARGIN * SAMPLE_RATE)
        voice = np.zeros(len(audio.samples) + 2 * margin, dtype=np.float32)
        voice[margin:-margin] = audio.samples + self._crosstalk(role, audio)
        mixture = mixed(voice, cabin_noise(cabin, len(voice), self._rng), signal_to_noise(cabin))
        self.recordings[name] = mixture[margin:-margin]
        return find_recognizer().recognize(mixture, SAMPLE_RATE)

    def _crosstalk(self, role: Role, audio: SpokenSpan) -> Samples:
        """Returns the other speaker's simultaneous speech, at its level at this speaker's microphone."""
        found = np.zeros(len(audio.samples), dtype=np.float32)
        for other in self._spans:
            if other is not role:
                for span in (*self._over[other], *self._spans[other]):
                    _add(found, span.samples, round((span.start - audio.start) * SAMPLE_RATE))
        return found * np.float32(pm.power(10.0, CROSSTALK / 20.0))

    def _read(self, span: Span, heard: Recognition, after: DialogueMove | None) -> Span:
        words = audible(heard)
        text = readable(words)
        if words.split() == spoken_words(span.text):
            return Span(text, span.act)
        return Span(text, guess_act(text, after) if self._classify else UNCLASSIFIED)


def _add(target: Samples, samples: Samples, offset: int) -> None:
    """Adds samples to others at an offset, which may be negative or beyond the end."""
    first, last = max(offset, 0), min(offset + len(samples), len(target))
    if first < last:
        target[first:last] += samples[first - offset : last - offset]
