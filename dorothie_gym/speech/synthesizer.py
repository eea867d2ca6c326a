"""Speech synthesis: protocol of the synthesisers, voices, and the choice of one by name."""

from __future__ import annotations

import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Protocol

import numpy as np

from dorothie_gym.errors import SpeechError, did_you_mean, short_repr
from dorothie_gym.support.copying import shared

if TYPE_CHECKING:
    from dorothie_gym.support.audio import Samples

SLOWEST, FASTEST = 0.5, 2.0
"""Range of relative speaking rates; beyond it, synthesisers drop or smear sounds."""

LOWEST_PITCH, HIGHEST_PITCH = 0.8, 1.25
"""Range of the pitch of a voice relative to that of the synthesiser; beyond it, voices sound distorted."""

LONGEST_TEXT: Final = 1000
"""Longest text that is synthesised at once [characters]."""


class Synthesizer(Protocol):
    """Speech synthesiser; equal arguments give equal samples.

    Attributes:
        sample_rate: rate of the samples [Hz].
        voices: names of the voices; the first is the default.
    """

    sample_rate: int
    voices: Sequence[str]

    def synthesize(self, text: str, *, voice: str = "", rate: float = 1.0, seed: int = 0) -> Samples:
        """Returns a spoken text.

        Args:
            text: English text, at most `LONGEST_TEXT` characters.
            voice: name of a voice; empty for the default.
            rate: speaking rate relative to that of the voice, `SLOWEST` to `FASTEST`.
            seed: seed of the noise that is part of a voice; synthesisers without randomness ignore it.

        Returns:
            Samples (n,), float32, full scale is 1; none for a text without words.

        Raises:
            SpeechError: there is no such voice, the text is in a script that no voice reads, or a program or server
                failed.
            ValueError: text or rate are out of range.
        """
        ...


@shared
@dataclass(frozen=True, kw_only=True)
class Voice:
    """Voice of a speaker.

    Attributes:
        name: voice of the synthesiser; empty for its default.
        rate: speaking rate relative to that of the voice.
        pitch: factor on pitch and formants, by a change of the sample rate: 0.9 for a larger speaker.

    Raises:
        ValueError: a field is out of its range.
    """

    name: str = ""
    rate: float = 1.0
    pitch: float = 1.0

    def __post_init__(self) -> None:
        if not SLOWEST <= self.rate <= FASTEST:
            raise ValueError(f"Voice.rate is {self.rate}; it must be in {SLOWEST}..{FASTEST}")
        if not LOWEST_PITCH <= self.pitch <= HIGHEST_PITCH:
            raise ValueError(f"Voice.pitch is {self.pitch}; it must be in {LOWEST_PITCH}..{HIGHEST_PITCH}")


def check_request(text: str, rate: float) -> None:
    """Raises `ValueError` if a text is too long or a relative rate out of range."""
    if len(text) > LONGEST_TEXT:
        raise ValueError(f"text has {len(text)} characters; at most {LONGEST_TEXT} are synthesised at once")
    if not SLOWEST <= rate <= FASTEST:
        raise ValueError(f"rate is {rate}; it must be in {SLOWEST}..{FASTEST}")


def check_script(text: str, synthesizer: str) -> None:
    """Raises `SpeechError` if a text has letters that are not Latin: English voices leave them out without a sound."""
    foreign = next(
        (c for c in unicodedata.normalize("NFKC", text) if c.isalpha() and "LATIN" not in unicodedata.name(c, "")), None
    )
    if foreign is not None:
        raise SpeechError(f"{synthesizer} speaks English and has no voice for {foreign!r} in {short_repr(text)}")


def chosen_voice(voice: str, voices: Sequence[str], synthesizer: str) -> str:
    """Returns a voice, or the default for an empty name; raises `SpeechError` if there is none with the name."""
    if not voice and voices:
        return voices[0]
    if voice not in voices:
        raise SpeechError(
            f"{synthesizer} has no voice {voice!r}: {did_you_mean(voice, voices)}choose one of {', '.join(voices)}"
        )
    return voice


def say(
    synthesizer: Synthesizer,
    text: str,
    voice: Voice | None = None,
    *,
    rate: float = 1.0,
    seed: int = 0,
    sample_rate: int = 16000,
) -> Samples:
    """Returns a text as spoken by a voice with its rate and pitch, at a sample rate.

    Args:
        synthesizer: the synthesiser.
        text: as in `Synthesizer.synthesize`.
        voice: the voice; the default one if None.
        rate: further factor on the rate; the product is limited to `SLOWEST` to `FASTEST`.
        seed: as in `Synthesizer.synthesize`.
        sample_rate: rate of the result [Hz].

    Returns:
        Samples (n,), float32.
    """
    from scipy.signal import resample_poly

    voice = voice or Voice()
    # a higher pitch comes from playing a slower speech faster
    speed = min(max(rate * voice.rate / voice.pitch, SLOWEST), FASTEST)
    samples = synthesizer.synthesize(text, voice=voice.name, rate=speed, seed=seed)
    if not len(samples):
        return samples
    shift = round(100 * voice.pitch)
    return np.asarray(resample_poly(samples, 100 * sample_rate, shift * synthesizer.sample_rate), dtype=np.float32)
