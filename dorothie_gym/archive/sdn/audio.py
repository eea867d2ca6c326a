"""Audio files of recorded utterances, FLAC or WAV, and durations from their headers.

Only the first bytes of a file are read, and no sample is decoded, so that no audio library is needed.
"""

from __future__ import annotations

import stat
import struct
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from dorothie_gym.session.recording.validation import ReadReport

AUDIO_FOLDERS: Final = ("utterance", "audio")
"""Folders of a session with its utterances, in the release and in the sample layout."""

_ENDINGS: Final = (".flac", ".wav")
_HEADER: Final = 64 * 1024
"""Bytes of a file that are read; the chunks before a WAV file's samples are shorter."""

MAX_DURATION: Final = 600.0
"""Longest duration of an utterance that is taken from a file [s]; no session has a longer one."""

_STREAM_INFO: Final = 38
"""Bytes of a FLAC file up to the number of samples and its checksum: block header and STREAMINFO (RFC 9639)."""


class AudioFiles:
    """Audio files of a session.

    Attributes:
        paths: the files by name.

    Args:
        folder: folder of the session.
        report: receives the files without a readable header.
    """

    def __init__(self, folder: Path, report: ReadReport) -> None:
        self._folders = [folder / name for name in AUDIO_FOLDERS if (folder / name).is_dir()]
        self.paths: Mapping[str, Path] = {
            path.name: path
            for parent in self._folders
            for path in sorted(parent.iterdir())
            if path.suffix in _ENDINGS and path.is_file()
        }
        self._report = report
        self._known: dict[str, tuple[str, float] | None] = {}

    def find(self, name: str | None, frame: int) -> tuple[str, float] | None:
        """Returns name and duration [s] of the audio of an utterance; None without a file.

        Args:
            name: name of the file in the log; None without one.
            frame: frame of the utterance, which names the files of the sample layout.
        """
        stem = str(frame) if name is None else Path(name).stem
        if not stem or not self._folders or not stem.replace("_", "").replace("-", "").isalnum():
            return None
        if stem not in self._known:
            paths = (folder / (stem + ending) for folder in self._folders for ending in _ENDINGS)
            found = ((path.name, self._duration(path)) for path in paths)
            self._known[stem] = next(((file, length) for file, length in found if length is not None), None)
        return self._known[stem]

    def _duration(self, path: Path) -> float | None:
        try:
            if not stat.S_ISREG(path.stat().st_mode):
                return None
            size = path.stat().st_size
            with path.open("rb") as file:
                head = file.read(_HEADER)
        except (OSError, ValueError):
            return None
        duration = _flac_duration(head) if path.suffix == ".flac" else _wav_duration(head, size)
        if duration is None or not 0.0 < duration <= MAX_DURATION:
            self._report.repair(f"{path.parent.name}: audio files without a usable header were not used")
            return None
        return duration


def _flac_duration(head: bytes) -> float | None:
    """Returns the duration of a FLAC file [s]; None if its header does not give one."""
    if head[:3] == b"ID3" and len(head) >= 10:  # a tag that some programs put in front; its size has 7 bits per byte
        size = sum(byte << shift for byte, shift in zip(head[6:10], (21, 14, 7, 0), strict=True))
        head = head[10 + size :]
    if head[:4] != b"fLaC" or head[4:5] not in (b"\x00", b"\x80") or len(head) < 4 + _STREAM_INFO:
        return None
    bits = int.from_bytes(head[18:26], "big")  # sample rate (20 bits), channels (3), bits per sample (5), samples (36)
    rate, samples = bits >> 44, bits & ((1 << 36) - 1)
    return samples / rate if rate and samples else None


def _wav_duration(head: bytes, size: int) -> float | None:
    """Returns the duration of a WAV file of `size` bytes [s]; None if its header does not give one."""
    if head[:4] != b"RIFF" or head[8:12] != b"WAVE":
        return None
    place, bytes_per_second = 12, 0
    while place + 8 <= len(head):
        name, length = head[place : place + 4], struct.unpack_from("<I", head, place + 4)[0]
        if name == b"fmt " and place + 24 <= len(head):
            bytes_per_second = struct.unpack_from("<I", head, place + 16)[0]
        if name == b"data":  # a recorder that was stopped leaves a wrong length
            length = min(length, size - place - 8)
            return length / bytes_per_second if bytes_per_second else None
        place += 8 + length + length % 2
    return None
