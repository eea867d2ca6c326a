"""Whisper from a user's folder, and flite."""

import hashlib
import shutil
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

from dorothie_gym.errors import SpeechError
from dorothie_gym.speech import WhisperRecognizer, find_recognizer, find_synthesizer
from dorothie_gym.speech.flite_synthesizer import FliteSynthesizer
from dorothie_gym.support.audio import resample


def test_weights_are_found_and_checked(tmp_path: Path) -> None:
    with pytest.raises(SpeechError, match=r"model.bin: there are no weights"):
        WhisperRecognizer(tmp_path, "0" * 64)
    (tmp_path / "model.bin").write_bytes(b"weights")
    with pytest.raises(SpeechError, match=r"model.bin: has the SHA-256 .*; these are other weights"):
        WhisperRecognizer(tmp_path, "0" * 64)


def test_words_of_whisper_become_spoken_words(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """faster-whisper and its weights are large; its answer is stood in for."""
    asked = {}

    class WhisperModel:
        def __init__(self, folder: str, **options: object) -> None:
            asked.update(options, folder=folder)

        def transcribe(self, audio: np.ndarray, **options: object) -> tuple[list[SimpleNamespace], None]:
            asked.update(options, samples=len(audio))
            words = [
                SimpleNamespace(word=" Turn", start=0.1, end=0.4, probability=0.9),
                SimpleNamespace(word=" KFC.", start=0.4, end=0.9, probability=0.5),
            ]
            return [SimpleNamespace(words=words)], None

    module = ModuleType("faster_whisper")
    module.WhisperModel = WhisperModel  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "faster_whisper", module)
    (tmp_path / "model.bin").write_bytes(b"weights")
    listener = WhisperRecognizer(tmp_path, hashlib.sha256(b"weights").hexdigest())
    found = listener.recognize(np.zeros(8000, np.float32), 8000, hints=["KFC", "Beal"])
    assert found.text == "turn k f c"
    assert [word.confidence for word in found.words] == [0.9, 0.5, 0.5, 0.5]
    assert (asked["local_files_only"], asked["hotwords"], asked["samples"]) == (True, "KFC Beal", 16000)


def test_missing_program_is_named() -> None:
    with pytest.raises(SpeechError, match=r"'no-flite' is not on the path; on Debian: apt-get install flite"):
        FliteSynthesizer("no-flite")


@pytest.mark.skipif(shutil.which("flite") is None, reason="needs the program flite")
def test_flite_is_recognised() -> None:
    speaker = find_synthesizer("flite")
    first = speaker.synthesize("Turn left at the next intersection.", voice="kal16")
    assert np.array_equal(first, speaker.synthesize("Turn left at the next intersection.", voice="kal16"))
    assert len(speaker.synthesize("Turn left.", rate=0.5)) > 1.5 * len(speaker.synthesize("Turn left."))
    assert "left" in find_recognizer().recognize(resample(first, speaker.sample_rate), 16000).text
