"""Sound of the noise inside the car, of a level and spectrum that follow from the state of the car."""

from __future__ import annotations

import functools
import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.session.dialogue_channel import CabinState, noise_levels
from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.audio import SAMPLE_RATE, Samples

LONG_TERM_SLOPE: Final = -9.0
"""Slope of speech above 500 Hz [dB per octave], roughly that of Byrne et al., JASA 96, 1994."""


def cabin_noise(state: CabinState, length: int, rng: np.random.Generator) -> Samples:
    """Returns noise of a state at 16 kHz, of an A-weighted power of 1.

    Args:
        state: state of the car.
        length: number of samples.
        rng: source of randomness.
    """
    if length < 1:
        return np.empty(0, dtype=np.float32)
    padded = _fast_length(length)
    gain = _a_weighting(padded)
    levels = noise_levels(state)
    talk = levels.pop("talk", None)
    # independent steady sources are one source whose power spectrum is the sum of theirs
    power = sum(10.0 ** (level / 10.0) * np.square(_shape(name, padded, gain)) for name, level in levels.items())
    total = _coloured(np.sqrt(power), padded, rng)[:length]
    if talk is not None:
        voices = _coloured(_shape("talk", padded, gain), padded, rng)[:length] * _syllables(length, state.talkers, rng)
        total += voices * 10.0 ** (talk / 20.0)
    return (total / max(_weighted_rms(total), 1e-12)).astype(np.float32)


def mixed(speech: Samples, noise: Samples, ratio: float) -> Samples:
    """Returns speech with noise of an A-weighted ratio; louder than full scale is scaled down, not clipped.

    Args:
        speech: samples at 16 kHz (n,), float32.
        noise: samples at 16 kHz (n,) or longer.
        ratio: level of speech above that of noise [dB], where there is speech: pauses do not count.
    """
    if len(noise) < len(speech):
        raise ValueError(f"noise has {len(noise)} samples for {len(speech)} of speech; make it as long")
    noise = noise[: len(speech)]
    loudness, quiet = active_rms(speech), _weighted_rms(noise)
    if loudness == 0.0 or quiet == 0.0:
        return speech
    result = speech + noise * np.float32(loudness / quiet * 10.0 ** (-ratio / 20.0))
    return np.asarray(result / max(1.0, float(np.abs(result).max())), dtype=np.float32)


def active_rms(speech: Samples) -> float:
    """Returns the A-weighted root mean square of speech in blocks of 20 ms within 30 dB of the loudest."""
    weighted = _weighted(speech)
    step = SAMPLE_RATE // 50
    blocks = len(weighted) // step
    if not blocks:
        return float(np.sqrt(np.mean(np.square(weighted)))) if len(weighted) else 0.0
    power = np.square(weighted[: blocks * step].reshape(blocks, step)).mean(axis=1)
    return float(np.sqrt(power[power >= 1e-3 * power.max()].mean()))


def pink_noise(length: int, rng: np.random.Generator) -> Samples:
    """Returns noise with equal power in each octave, of a root mean square of 1, as tests of recognisers use it."""
    spectrum = np.fft.rfft(rng.standard_normal(length))
    noise = np.fft.irfft(spectrum / np.sqrt(np.maximum(np.arange(len(spectrum)), 1.0)), length)
    return np.asarray(noise / np.sqrt(np.mean(np.square(noise))), dtype=np.float32)


@functools.lru_cache(maxsize=64)
def _fast_length(length: int) -> int:
    """Returns the next length whose Fourier transform is fast; lengths of speech are often prime."""
    from scipy.fft import next_fast_len

    return int(next_fast_len(length, real=True))


def _coloured(shape: NDArray[np.float64], length: int, rng: np.random.Generator) -> NDArray[np.float64]:
    """Returns white noise filtered to an amplitude by frequency (length // 2 + 1,)."""
    return np.asarray(np.fft.irfft(shape * np.fft.rfft(rng.standard_normal(length)), length))


def _shape(name: str, length: int, gain: NDArray[np.float64]) -> NDArray[np.float64]:
    """Returns the amplitude of a source by frequency, of an A-weighted power of 1: corner and slope are set by hand."""
    corner, slope = {
        "idle": (60.0, -9.0),
        "road": (150.0, -9.0),
        "air": (300.0, -6.0),
        "rain": (2000.0, -3.0),
        "talk": (500.0, LONG_TERM_SLOPE),
    }[name]
    frequencies = np.fft.rfftfreq(length, 1.0 / SAMPLE_RATE)
    # a slope in dB per octave is a power of the frequency
    shape = np.maximum(frequencies / corner, 1.0) ** (slope / (20.0 * pm.log10(2.0)))
    shape[frequencies < 30.0] = 0.0
    return np.asarray(shape / math.sqrt(2.0 * float(np.square(shape * gain).sum()) / length))


def _syllables(length: int, talkers: int, rng: np.random.Generator) -> NDArray[np.float64]:
    """Returns an envelope with the rhythm of syllables, some 4 Hz, the shallower the more people talk.

    Noise of the spectrum and modulation of speech is usual in audiology (Dreschler et al., Audiology 40, 2001).
    """
    times = np.arange(length) / SAMPLE_RATE
    beats = sum(pn.sin(2.0 * np.pi * (rng.uniform(3.0, 5.0) * times + rng.uniform())) for _ in range(talkers))
    return np.asarray(1.0 + 0.9 * beats / talkers)


def _weighted(samples: NDArray[np.floating]) -> NDArray[np.float64]:
    """Returns samples at 16 kHz with A-weighting (IEC 61672-1)."""
    length = _fast_length(len(samples))
    spectrum = np.fft.rfft(np.asarray(samples, dtype=np.float64), length)
    return np.asarray(np.fft.irfft(spectrum * _a_weighting(length), length)[: len(samples)])


@functools.lru_cache(maxsize=16)
def _a_weighting(length: int) -> NDArray[np.float64]:
    """Returns the gain of A-weighting by frequency, for transforms of a length."""
    squared = np.square(np.fft.rfftfreq(length, 1.0 / SAMPLE_RATE))
    gain = (
        12194.0**2
        * squared**2
        / ((squared + 20.6**2) * np.sqrt((squared + 107.7**2) * (squared + 737.9**2)) * (squared + 12194.0**2))
    )
    return np.asarray(gain * 10.0 ** (2.0 / 20.0))


def _weighted_rms(samples: NDArray[np.floating]) -> float:
    """Returns the root mean square of samples with A-weighting, from their spectrum (Parseval)."""
    length = _fast_length(len(samples))
    power = np.square(np.abs(np.fft.rfft(np.asarray(samples, dtype=np.float64), length)) * _a_weighting(length))
    return math.sqrt(2.0 * float(power.sum()) / length / len(samples))
