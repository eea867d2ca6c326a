"""Audio: checks, sample rates and files."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import soundfile

from dorothie_gym.errors import AudioError
from dorothie_gym.support.audio import checked_samples, encode_flac, encode_wav, read_audio, resample, trimmed


def tone(seconds: float, rate: int, frequency: float = 440.0) -> np.ndarray:
    return (0.5 * np.sin(2 * np.pi * frequency * np.arange(round(seconds * rate)) / rate)).astype(np.float32)


@pytest.mark.parametrize("rate", [8000, 11025, 22050, 44100, 48000, 96000])
def test_rates_from_8_to_96_khz_are_converted(rate: int) -> None:
    heard = resample(checked_samples(tone(0.5, rate), rate), rate)
    assert len(heard) == pytest.approx(8000, abs=1)
    spectrum = np.abs(np.fft.rfft(heard))
    assert np.argmax(spectrum) * 16000 / len(heard) == pytest.approx(440, abs=3)


def test_flac_keeps_samples_within_16_bits(tmp_path: Path) -> None:
    path = tmp_path / "a.flac"
    path.write_bytes(encode_flac(tone(0.3, 16000)))
    assert np.abs(read_audio(path) - tone(0.3, 16000)).max() < 1e-4


def test_stereo_integers_are_averaged_at_full_scale() -> None:
    stereo = np.stack([np.full(100, 2**14), np.zeros(100)], axis=1).astype(np.int16)
    assert checked_samples(stereo, 16000) == pytest.approx(np.full(100, 0.25))


@pytest.mark.parametrize(
    ("samples", "rate", "message"),
    [
        (np.zeros(0, np.float32), 16000, "is empty"),
        (np.zeros(61 * 16000, np.float32), 16000, "is 61 s long"),
        (np.array([0.0, np.nan], np.float32), 16000, "no finite numbers"),
        (np.zeros(10, np.float32), 4000, "has 4000 samples per second; 8000 to 96000"),
        (np.zeros(10, np.uint8), 16000, "holds uint8"),
    ],
)
def test_unusable_audio_is_refused(samples: np.ndarray, rate: int, message: str) -> None:
    with pytest.raises(AudioError, match=message):
        checked_samples(samples, rate)


@pytest.mark.parametrize("rate", [8000, 16000, 44100, 96000])
@pytest.mark.parametrize("encode", [encode_flac, encode_wav])
def test_no_samples_are_a_file_that_is_read(encode: Callable[..., bytes], rate: int, tmp_path: Path) -> None:
    path = tmp_path / "a"
    path.write_bytes(encode(np.zeros(0, np.float32), rate))
    assert path.stat().st_size == {encode_flac: 42, encode_wav: 44}[encode]
    found = read_audio(path)
    assert (found.shape, found.dtype) == ((0,), np.float32)


def test_flac_without_samples_states_its_rate_and_the_hash_of_nothing() -> None:
    content = encode_flac(np.zeros(0, np.float32), 44100)
    bits = int.from_bytes(content[18:26], "big")
    assert content[:8] == b"fLaC\x80\x00\x00\x22"
    assert (bits >> 44, (bits >> 41 & 7) + 1, (bits >> 36 & 31) + 1, bits & (1 << 36) - 1) == (44100, 1, 16, 0)
    assert content[26:].hex() == "d41d8cd98f00b204e9800998ecf8427e"


def test_flac_that_was_cut_behind_its_metadata_is_damaged_not_empty(tmp_path: Path) -> None:
    whole, path = encode_flac(tone(0.3, 16000)), tmp_path / "a.flac"
    end, last = 4, False
    while not last:
        last = bool(whole[end] & 0x80)
        end += 4 + int.from_bytes(whole[end + 1 : end + 4], "big")
    for cut in (end, 42):
        path.write_bytes(whole[:cut])
        with pytest.raises(AudioError, match=r"a\.flac"):
            read_audio(path)


def test_damaged_missing_and_long_files_are_refused(tmp_path: Path) -> None:
    whole = encode_flac(tone(1.0, 16000))
    path = tmp_path / "a.flac"
    path.write_bytes(b"no audio at all")
    with pytest.raises(AudioError, match=r"a.flac: cannot be read as audio"):
        read_audio(path)
    path.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(AudioError, match=r"a.flac"):
        read_audio(path)
    with pytest.raises(AudioError, match=r"none.flac: cannot be read: No such file"):
        read_audio(tmp_path / "none.flac")
    soundfile.write(path, np.zeros(3600 * 8000, np.int16), 8000)  # an hour
    with pytest.raises(AudioError, match=r"is 3600 s long; at most 60 s are read at once"):
        read_audio(path)


def test_silence_around_speech_is_cut() -> None:
    silence = np.zeros(8000, np.float32)
    assert len(trimmed(np.concatenate([silence, tone(0.5, 16000), silence]), 16000)) == pytest.approx(9600, abs=320)
    assert len(trimmed(silence, 16000)) in (0, 8000)
