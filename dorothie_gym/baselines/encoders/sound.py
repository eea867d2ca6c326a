"""Encoders of sound: log-mel spectra, a small convolution over them, and Google's speech embedding."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn import functional as F

from dorothie_gym.errors import EncoderError
from dorothie_gym.support.installation import pip_install

if TYPE_CHECKING:
    from dorothie_gym.baselines.encoders.encoder import Vectors

RATE: Final = 16000
"""Samples per second of all sounds."""

WINDOW: Final = 400
HOP: Final = 320
"""Samples of a frame, and from frame to frame: 25 and 20 ms."""

BANDS: Final = 32
"""Number of mel bands."""

MEL_FRAMES: Final = 256
"""Number of frames of a spectrum, 5.1 s; later sound is truncated."""

_LOWEST, _HIGHEST = 60.0, 7600.0
_FLOOR: Final = 1e-7
_STRETCHES: Final = 4
"""Equal stretches of an utterance over which vectors are pooled, so that their order is kept."""

_EMBEDDING_PACKAGE: Final = "pyopen_wakeword"
_CHUNK: Final = 1280
_EMBEDDING: Final = 96
_SILENCE: Final = 16000
"""Silence before a sound with which the speech embedding begins: a window has 0.8 s."""


def log_mel(sound: NDArray[np.float32]) -> NDArray[np.float32]:
    """Returns the log-mel spectrum of a sound (frames, 32), natural logarithm, with mean 0 in each band.

    Args:
        sound: float32 (samples,) in [-1, 1] at 16 kHz; shorter than a frame, it is filled up with zeros.
    """
    filled = np.pad(np.asarray(sound, dtype=np.float32), (0, max(WINDOW - len(sound), 0)))
    frames = np.lib.stride_tricks.sliding_window_view(filled, WINDOW)[::HOP]
    power = np.square(np.abs(np.fft.rfft(frames * np.hanning(WINDOW), 512, axis=1)))
    levels = np.log(power @ _filters().T + _FLOOR)
    return np.asarray(levels - levels.mean(axis=0), dtype=np.float32)


@cache
def _filters() -> NDArray[np.float64]:
    """Returns triangular filters (32, 257), equally wide on the mel scale (2595 log10(1 + f / 700))."""
    ends = 2595.0 * np.log10(1.0 + np.array([_LOWEST, _HIGHEST]) / 700.0)
    corners = 700.0 * (10.0 ** (np.linspace(float(ends[0]), float(ends[1]), BANDS + 2) / 2595.0) - 1.0)
    frequencies = np.linspace(0.0, RATE / 2.0, 257)
    rising = (frequencies - corners[:-2, None]) / np.diff(corners)[:-1, None]
    falling = (corners[2:, None] - frequencies) / np.diff(corners)[1:, None]
    return np.asarray(np.clip(np.minimum(rising, falling), 0.0, None))


def mel_table(sounds: Sequence[NDArray[np.float32]]) -> NDArray[np.float16]:
    """Returns the log-mel spectra of sounds, float16 (n, 256, 32): cut, or filled with zeros; zeros for no samples."""
    table = np.zeros((len(sounds), MEL_FRAMES, BANDS), dtype=np.float16)
    for row, sound in zip(table, sounds, strict=True):
        if len(sound):
            levels = log_mel(sound)[:MEL_FRAMES]
            row[: len(levels)] = levels
    return table


class SoundReader(nn.Module):
    """Small convolution over log-mel spectra, trained with the rest of a model.

    Args:
        width: numbers of a vector.
        dropout: share of values dropped.
    """

    def __init__(self, width: int, dropout: float = 0.1):
        super().__init__()
        self.first = nn.Conv1d(BANDS, 64, 5, stride=2, padding=2)
        self.second = nn.Conv1d(64, 64, 5, stride=2, padding=2)
        self.dropout = nn.Dropout(dropout)
        self.out = nn.Linear(2 * _STRETCHES * 64, width)

    def forward(self, spectra: Tensor) -> Tensor:
        """Returns vectors of sounds (n, width).

        Args:
            spectra: (n, frames, 32), zeros after the last frame.
        """
        spectra = spectra.to(self.out.weight.dtype)
        lengths = (spectra != 0).any(-1).sum(1)  # (n,)
        seen = F.gelu(self.second(F.gelu(self.first(spectra.transpose(1, 2) / 2.0)))).transpose(1, 2)  # (n, T, 64)
        lengths = (lengths + 3).div(4, rounding_mode="floor").clamp(min=1)
        place = torch.arange(seen.shape[1], device=seen.device)  # (T,)
        stretch = (place * _STRETCHES).div(lengths[:, None], rounding_mode="floor")  # (n, T); 4 or more after it
        parts = []
        for number in range(_STRETCHES):
            inside = (stretch == number).unsqueeze(-1)  # (n, T, 1)
            mean = (seen * inside).sum(1) / inside.sum(1).clamp(min=1)
            parts += [mean, seen.masked_fill(~inside, -1.0).amax(1)]
        vectors: Tensor = self.out(self.dropout(torch.cat(parts, dim=-1)))
        return vectors


class SpeechEmbeddingEncoder:
    """Google's speech embedding (Lin et al., ICASSP 2020) with frozen weights, from the package pyopen-wakeword.

    A vector holds the means of the 96 numbers over the four quarters of an utterance.

    Raises:
        EncoderError: the package is not installed.
    """

    name: ClassVar[str] = "speech-embedding"
    dim: ClassVar[int] = _STRETCHES * _EMBEDDING

    def __init__(self) -> None:
        try:
            import pyopen_wakeword
        except ImportError:
            raise EncoderError(
                f"encoder speech-embedding: its weights are not installed; run: {pip_install('sound')}"
            ) from None
        self._kind: Any = pyopen_wakeword.OpenWakeWordFeatures
        models = Path(str(pyopen_wakeword.__file__)).parent / "models"
        digest = hashlib.sha256()
        for file in ("melspectrogram.tflite", "embedding_model.tflite"):
            digest.update((models / file).read_bytes())
        self.id = f"{self.name}-{digest.hexdigest()[:16]}"

    def encode(self, sounds: Sequence[NDArray[np.float32]]) -> Vectors:
        """Returns the vectors of sounds, float32 (n, 384); zeros for one without samples.

        Args:
            sounds: float32 (samples,) in [-1, 1] at 16 kHz each.
        """
        table = np.zeros((len(sounds), self.dim), dtype=np.float32)
        for row, sound in zip(table, sounds, strict=True):
            if len(sound):
                row[:] = np.concatenate([part.mean(axis=0) for part in self._quarters(sound)])
        return table

    def _quarters(self, sound: NDArray[np.float32]) -> list[NDArray[np.float32]]:
        features = self._kind.from_builtin()  # a new one remembers no earlier sound
        features.new_audio_samples = _SILENCE  # instead of 8 s, which take a hundred times as long as a word
        samples = np.rint(np.clip(sound, -1.0, 1.0) * 32767.0).astype("<i2")
        samples = np.pad(samples, (0, -len(samples) % _CHUNK))
        found = [
            vectors.reshape(-1, _EMBEDDING)
            for start in range(0, len(samples), _CHUNK)
            for vectors in features.process_streaming(samples[start : start + _CHUNK].tobytes())
        ]
        features.close()
        heard = np.concatenate(found)[-max(len(samples) // _CHUNK, _STRETCHES) :]
        return np.array_split(heard, _STRETCHES)
