"""Synthesis by the program flite, where the system has it (Debian: package flite)."""

from __future__ import annotations

import io
import shutil
import subprocess
import tempfile
import wave
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np

from dorothie_gym.errors import SpeechError, one_line
from dorothie_gym.speech.synthesizer import check_request, check_script, chosen_voice
from dorothie_gym.support.audio import LONGEST, Samples, checked_samples

_TIMEOUT: Final = 30.0
"""Time that the program may take [s]; a sentence takes less than 0.1 s."""


class FliteSynthesizer:
    """Synthesiser by flite; its voices have 8 or 16 kHz and are returned at 16 kHz.

    Args:
        program: name or path of the program.

    Raises:
        SpeechError: there is no such program, or it has no voice.
    """

    def __init__(self, program: str = "flite") -> None:
        found = shutil.which(program)
        if found is None:
            raise SpeechError(f"the program {program!r} is not on the path; on Debian: apt-get install flite")
        self._program = found
        listed = self._run("-lv").decode(errors="replace")
        self.voices: Sequence[str] = tuple(sorted(listed.partition(":")[2].split(), key=lambda name: name != "rms"))
        if not self.voices:
            raise SpeechError(f"{found} lists no voices: {one_line(listed)}")
        self.sample_rate = 16000

    def synthesize(self, text: str, *, voice: str = "", rate: float = 1.0, seed: int = 0) -> Samples:
        """Returns a spoken text; see `Synthesizer.synthesize`."""
        check_request(text, rate)
        check_script(text, "flite")
        voice = chosen_voice(voice, self.voices, "flite")
        if not any(letter.isalnum() for letter in text):
            return np.empty(0, dtype=np.float32)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "speech.wav"
            # "-t" with a leading space: a text that begins with a hyphen is no option
            self._run(
                "-voice", voice, "--setf", f"duration_stretch={1.0 / rate:.4f}", "-t", f" {text}", "-o", str(path)
            )
            return _read_wav(path.read_bytes(), self.sample_rate)

    def _run(self, *arguments: str) -> bytes:
        try:
            done = subprocess.run([self._program, *arguments], capture_output=True, timeout=_TIMEOUT, check=True)
        except (OSError, subprocess.SubprocessError) as error:
            raise SpeechError(f"{self._program} failed: {one_line(error)}") from error
        return done.stdout


def _read_wav(content: bytes, wanted: int) -> Samples:
    """Returns the samples of a WAV file of 16 bits at a rate."""
    from dorothie_gym.support.audio import resample

    with wave.open(io.BytesIO(content)) as file:
        rate = file.getframerate()
        samples = np.frombuffer(file.readframes(int(LONGEST * rate)), dtype="<i2")
    return resample(checked_samples(samples, rate, "flite"), rate, wanted)
