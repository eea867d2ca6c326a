"""Recognition by Whisper through faster-whisper, with weights from a folder of the user; nothing is downloaded."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from dorothie_gym.errors import SpeechError
from dorothie_gym.speech.recognizer import Hypothesis, Recognition, RecognizedWord
from dorothie_gym.speech.spoken_form import spoken_words
from dorothie_gym.support.audio import SAMPLE_RATE, Samples, checked_samples, resample
from dorothie_gym.support.optional_modules import speech_module

WEIGHTS_FILE: Final = "model.bin"
"""File with the weights in a folder for faster-whisper (CTranslate2's format)."""


class WhisperRecognizer:
    """Recogniser by a Whisper model.

    Args:
        folder: folder with `model.bin`, `config.json`, `tokenizer.json` and the vocabulary, as faster-whisper reads it.
        sha256: expected hash of `model.bin`, in hexadecimal digits.
        threads: threads of the processor.

    Raises:
        SpeechError: faster-whisper or the weights are missing, or the hash is another one.
    """

    def __init__(self, folder: Path | str, sha256: str, *, threads: int = 1) -> None:
        check_weights(Path(folder), sha256)
        module = speech_module("faster_whisper", extra="")
        try:
            self._model: Any = module.WhisperModel(
                str(folder), device="cpu", compute_type="int8", cpu_threads=threads, local_files_only=True
            )
        except (RuntimeError, ValueError, OSError) as error:
            raise SpeechError(f"{folder}: cannot be loaded as a Whisper model: {error}") from error

    def recognize(self, samples: Samples, sample_rate: int, *, hints: Sequence[str] = ()) -> Recognition:
        """Returns the words of an audio; see `Recognizer.recognize`. Its one hypothesis has the weight 1."""
        audio = resample(checked_samples(samples, sample_rate), sample_rate, SAMPLE_RATE)
        segments, _ = self._model.transcribe(
            audio,
            language="en",
            beam_size=5,
            temperature=0.0,
            condition_on_previous_text=False,
            word_timestamps=True,
            hotwords=" ".join(hints) or None,
        )
        found = [word for segment in segments for word in segment.words or ()]
        words = tuple(
            RecognizedWord(text=text, start=float(word.start), end=float(word.end), confidence=float(word.probability))
            for word in found
            for text in spoken_words(word.word)
        )
        text = " ".join(word.text for word in words)
        return Recognition(text=text, words=words, hypotheses=(Hypothesis(text=text, weight=1.0),) if text else ())


def check_weights(folder: Path, sha256: str) -> None:
    """Raises `SpeechError` if the weights in a folder are missing or have another hash."""
    path = folder / WEIGHTS_FILE
    if not path.is_file():
        raise SpeechError(f"{path}: there are no weights; put a folder for faster-whisper there")
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while block := file.read(2**20):
            digest.update(block)
    if digest.hexdigest() != sha256.lower():
        raise SpeechError(f"{path}: has the SHA-256 {digest.hexdigest()}, not {sha256}; these are other weights")
