"""Synthesis by hibari-tts: one neural American voice inside the package, on one processor core."""

from __future__ import annotations

import functools
import hashlib
import re
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any, Final

import numpy as np

from dorothie_gym.errors import SpeechError
from dorothie_gym.speech.synthesizer import check_request, check_script, chosen_voice
from dorothie_gym.support.audio import Samples, trimmed
from dorothie_gym.support.optional_modules import speech_module

VOICE: Final = "heart"
"""The voice in the package. Its others would be downloaded and are not offered."""

MODEL_SHA256: Final = "5f70741d4e900f4e85d0037498736cc1b3e1b9a63a13546a5da1e63abf4fccd8"
"""Hash of the voice's model in hibari-tts 0.2.1. The package has a single author, so other bytes are refused."""

RMS: Final = 0.06
"""Root mean square to which speech is scaled, about -24 dB of full scale, so that loudness does not vary by text."""

_CAPITALS: Final = re.compile(r"\b(?=[A-Z]*[AEIOUY])[A-Z]{3,}\b")


class HibariSynthesizer:
    """Synthesiser by hibari-tts (Apache-2.0).

    Raises:
        SpeechError: the extra `speech` is not installed, or the voice's model is not the expected one.
    """

    def __init__(self) -> None:
        module = speech_module("hibari")
        model = Path(str(files(module))) / "assets" / "hibari.onnx"
        if not model.is_file() or hashlib.sha256(model.read_bytes()).hexdigest() != MODEL_SHA256:
            raise SpeechError(
                f"{model}: is not the model of hibari-tts 0.2.1; pip install --force-reinstall hibari-tts==0.2.1"
            )
        self._speaker: Any = module.Hibari(voice=VOICE, model=str(model), threads=1)
        self.sample_rate: int = int(module.SAMPLE_RATE)
        self.voices: Sequence[str] = (VOICE,)

    def synthesize(self, text: str, *, voice: str = "", rate: float = 1.0, seed: int = 0) -> Samples:
        """Returns a spoken text; see `Synthesizer.synthesize`."""
        check_request(text, rate)
        check_script(text, "hibari")
        chosen_voice(voice, self.voices, "hibari")
        if not any(letter.isalnum() for letter in text):
            return np.empty(0, dtype=np.float32)
        samples = np.asarray(self._speaker(_as_word(text), speed=rate, seed=seed), dtype=np.float32)
        samples = trimmed(samples, self.sample_rate)
        loudness = float(np.sqrt(np.mean(np.square(samples)))) if len(samples) else 0.0
        return samples * np.float32(RMS / loudness) if loudness > 0 else samples

    @functools.lru_cache(maxsize=4096)  # noqa: B019  # one synthesiser lives as long as its process
    def phonemes(self, text: str) -> str:
        """Returns the phonemes of a text, in the International Phonetic Alphabet with letters for diphthongs."""
        return " ".join(self._speaker.phonemize(_as_word(text)))


def _as_word(text: str) -> str:
    """Returns a text with capitals that form a word in lower case: hibari spells "IKEA", but reads "Ikea"."""
    return _CAPITALS.sub(lambda found: found[0].capitalize(), text)


@functools.cache
def hibari() -> HibariSynthesizer:
    """Returns the synthesiser, the same one for every call of a process: loading its voice takes time.

    Raises:
        SpeechError: the extra `speech` is not installed.
    """
    return HibariSynthesizer()
