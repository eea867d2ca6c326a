"""Mono audio as float32 samples: checks, conversion of the sample rate, and FLAC and WAV files."""

from __future__ import annotations

import functools
import hashlib
import io
import wave
from math import gcd
from pathlib import Path
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.errors import AudioError, short_repr
from dorothie_gym.support.input_files import raising, read_file
from dorothie_gym.support.optional_modules import speech_module

Samples: TypeAlias = NDArray[np.float32]
"""Mono audio (n,), float32, full scale is 1."""

SAMPLE_RATE: Final = 16000
"""Sample rate of recognisers and recordings [Hz]; telephone wideband, that of most speech corpora and models."""

LOWEST_RATE: Final = 8000
HIGHEST_RATE: Final = 96000
"""Sample rates that are converted [Hz]."""

LONGEST: Final = 60.0
"""Longest audio that is recognised or read at once [s]; the longest span has 160 characters, some 12 s."""

_LARGEST_FILE: Final = 4 * round(LONGEST) * HIGHEST_RATE * 2
"""Largest audio file that is opened [bytes]: `LONGEST` of stereo in 32 bits at the highest rate."""


def checked_samples(samples: NDArray[np.generic], sample_rate: int, where: str = "audio") -> Samples:
    """Returns audio as float32 samples within full scale.

    Args:
        samples: (n,) floating-point numbers, full scale is 1, or integers, full scale is that of their type. Several
            channels (n, c) are averaged.
        sample_rate: their rate [Hz].
        where: name of the audio for messages.

    Raises:
        AudioError: the audio is empty, too long, not finite, or of another form, or the rate is not supported.
    """
    if not LOWEST_RATE <= sample_rate <= HIGHEST_RATE:
        raise AudioError(
            f"{where}: has {short_repr(sample_rate)} samples per second; {LOWEST_RATE} to {HIGHEST_RATE} are supported"
        )
    values = np.asarray(samples)
    if not values.size:
        raise AudioError(f"{where}: is empty")
    if values.ndim not in (1, 2):
        raise AudioError(f"{where}: has the shape {values.shape}; it must be (samples,) or (samples, channels)")
    if len(values) > LONGEST * sample_rate:
        seconds = len(values) / sample_rate
        raise AudioError(f"{where}: is {seconds:.0f} s long; at most {LONGEST:.0f} s are taken at once, so cut it")
    if np.issubdtype(values.dtype, np.signedinteger):
        values = values / -float(np.iinfo(values.dtype).min)
    elif not np.issubdtype(values.dtype, np.floating):
        raise AudioError(f"{where}: holds {values.dtype}; it must hold floating-point numbers or signed integers")
    if values.ndim == 2:
        values = values.mean(axis=1)
    if not np.isfinite(values).all():
        raise AudioError(f"{where}: holds samples that are no finite numbers")
    return np.clip(values, -1.0, 1.0).astype(np.float32)


def trimmed(samples: Samples, sample_rate: int, margin: float = 0.05) -> Samples:
    """Returns audio without the silence (40 dB below its loudest 10 ms) before and after it.

    Args:
        samples: (n,) float32.
        sample_rate: their rate [Hz].
        margin: silence that is kept on both sides [s].
    """
    step = sample_rate // 100
    blocks = len(samples) // step
    if not blocks:
        return samples
    energy = np.square(samples[: blocks * step].reshape(blocks, step)).mean(axis=1)
    loud = np.flatnonzero(energy > 1e-4 * energy.max())
    if not len(loud):
        return samples
    first, last = int(loud[0]) * step - round(margin * sample_rate), (int(loud[-1]) + 1) * step
    return samples[max(first, 0) : last + round(margin * sample_rate)]


def resample(samples: Samples, sample_rate: int, wanted: int = SAMPLE_RATE) -> Samples:
    """Returns audio at another rate, by a polyphase filter (`scipy.signal.resample_poly`).

    Args:
        samples: (n,) float32.
        sample_rate: their rate [Hz].
        wanted: sample rate of the result [Hz].
    """
    if sample_rate == wanted:
        return samples
    from scipy.signal import resample_poly

    divisor = gcd(sample_rate, wanted)
    return np.asarray(resample_poly(samples, wanted // divisor, sample_rate // divisor), dtype=np.float32)


def to_pcm(samples: Samples) -> NDArray[np.int16]:
    """Returns samples as 16-bit integers (n,)."""
    return np.asarray(np.rint(np.clip(samples, -1.0, 1.0) * 32767.0), dtype=np.int16)


def encode_flac(samples: Samples, sample_rate: int = SAMPLE_RATE) -> bytes:
    """Returns audio as a FLAC file of 16 bits; equal samples give equal bytes. No samples give a file without frames.

    Raises:
        SpeechError: the extra `speech` is not installed.
    """
    buffer, pcm = io.BytesIO(), to_pcm(samples)
    _soundfile().write(buffer, pcm if len(pcm) else np.zeros(1, np.int16), sample_rate, format="FLAC", subtype="PCM_16")
    return buffer.getvalue() if len(pcm) else _without_frames(buffer.getvalue())


_STREAM_INFO: Final = 42
"""Size of the marker of FLAC and of its first block, with the header of the block [bytes] (RFC 9639, section 8.2)."""


def _without_frames(flac: bytes) -> bytes:
    """Returns a FLAC file of the same rate without samples, which libsndfile does not write: its first block only."""
    info = bytearray(flac[:_STREAM_INFO])
    info[4] |= 0x80  # the last block
    info[12:18] = bytes(6)  # no smallest and largest frame
    info[21] &= 0xF0
    info[22:26] = bytes(4)  # number of samples, 36 bits
    info[26:] = hashlib.md5(b"", usedforsecurity=False).digest()  # of the samples
    return bytes(info)


def _has_no_frames(content: bytes) -> bool:
    """Returns whether a FLAC file states no number of samples and ends after its last block of metadata."""
    if content[:4] != b"fLaC" or len(content) < _STREAM_INFO or content[21] & 0x0F or any(content[22:26]):
        return False
    place, last = 4, False
    while not last and place + 4 <= len(content):
        last = bool(content[place] & 0x80)
        place += 4 + int.from_bytes(content[place + 1 : place + 4], "big")
    return last and place == len(content)


def encode_wav(samples: Samples, sample_rate: int = SAMPLE_RATE) -> bytes:
    """Returns audio as a WAV file of 16 bits, without the extra `speech`."""
    buffer = io.BytesIO()
    with wave.open(buffer, "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(2)
        file.setframerate(sample_rate)
        file.writeframes(to_pcm(samples).astype("<i2").tobytes())
    return buffer.getvalue()


def read_audio(path: Path | str, sample_rate: int = SAMPLE_RATE) -> Samples:
    """Returns the audio of a FLAC or WAV file at a rate; several channels are averaged, and a file may be empty.

    Args:
        path: the file.
        sample_rate: rate of the result [Hz].

    Raises:
        AudioError: the file is missing or damaged, longer than `LONGEST`, or of an unsupported rate.
        SpeechError: the extra `speech` is not installed.
    """
    soundfile, path = _soundfile(), Path(path)
    try:
        with raising(AudioError):
            content = read_file(path, _LARGEST_FILE)
    except OSError as error:
        raise AudioError(f"{path}: cannot be read: {error.strerror}") from error
    if _has_no_frames(content):  # libsndfile takes it for a stream of unknown length
        return np.zeros(0, np.float32)
    try:
        with soundfile.SoundFile(io.BytesIO(content)) as file:
            if not file.frames:
                return np.zeros(0, np.float32)
            if file.frames > LONGEST * file.samplerate:
                raise AudioError(
                    f"{path}: is {file.frames / file.samplerate:.0f} s long; at most {LONGEST:.0f} s are read at once"
                )
            rate, samples = int(file.samplerate), file.read(dtype="float32", always_2d=True)
    except soundfile.LibsndfileError as error:
        raise AudioError(f"{path}: cannot be read as audio: {error.error_string.splitlines()[0]}") from error
    return resample(checked_samples(samples, rate, str(path)), rate, sample_rate)


@functools.cache
def _soundfile() -> Any:
    return speech_module("soundfile")
