"""Sound of recorded sessions: the audio of utterances and of their spans, and all of it as one sound track."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.errors import SessionError
from dorothie_gym.support.audio import SAMPLE_RATE, Samples, read_audio
from dorothie_gym.support.copying import shared

if TYPE_CHECKING:
    from dorothie_gym.session.recording.events import UtteranceRecord
    from dorothie_gym.session.recording.session import Session


@shared
@dataclass(frozen=True, kw_only=True)
class AudioFile:
    """Audio file of a session.

    Attributes:
        path: the file.
        spans: numbers of the spans of the utterance that it holds, counted from 0; one, or in SDN's layout all.
    """

    path: Path
    spans: tuple[int, ...]


def audio_files(session: Session, utterance: UtteranceRecord) -> tuple[AudioFile, ...]:
    """Returns the audio files of an utterance in order; those that the folder lacks are left out."""
    paths = {Path(name).stem: path for name, path in session.audio.items()}  # SDN's logs give names without ending
    spans: dict[str, list[int]] = {}
    for number, move in enumerate(utterance.moves):
        spans.setdefault(Path(str(session.events[move.index].data.get("audio", ""))).stem, []).append(number)
    return tuple(AudioFile(path=paths[name], spans=tuple(numbers)) for name, numbers in spans.items() if name in paths)


def utterance_audio(session: Session, number: int, span: int | None = None) -> Samples:
    """Returns the audio of an utterance, or of one of its spans, at 16 kHz (n,).

    Args:
        session: the session.
        number: number of the utterance, as in its events.
        span: number of the span in the utterance, counted from 0; None for all.

    Raises:
        SessionError: there is no such utterance or span, or it has no audio.
        AudioError: a file is damaged.
        SpeechError: the extra `speech` is not installed.
    """
    found = {each.number: each for each in session.utterances()}
    if number not in found:
        known = f"0 to {max(found)}" if found else "none"
        raise SessionError(f"{session.name}: has no utterance {number} (numbers: {known})")
    utterance = found[number]
    if span is not None and not 0 <= span < len(utterance.moves):
        raise SessionError(
            f"{session.name}: utterance {number} has no span {span} (numbers: 0 to {len(utterance.moves) - 1})"
        )
    files = [each for each in audio_files(session, utterance) if span is None or span in each.spans]
    if not files:
        raise SessionError(
            f"{session.name}: utterance {number} has no audio; only spoken sessions have (docs/speech.md)"
        )
    if span is not None and len(files[0].spans) > 1:
        raise SessionError(
            f"{session.name}: the audio of utterance {number} is not divided into spans; ask for the whole utterance"
        )
    return np.concatenate([read_audio(each.path) for each in files])


def sound_track(session: Session, start: float, seconds: float) -> Samples:
    """Returns all audio of a session at the times at which it was spoken, at 16 kHz (n,), clipped to full scale.

    Args:
        session: the session.
        start: time of the first sample [s of the session].
        seconds: duration [s].

    Raises:
        AudioError: a file is damaged.
        SpeechError: the extra `speech` is not installed.
    """
    return mixed_track(_timed(session), start, seconds)


def mixed_track(spoken: Iterable[tuple[float, Samples]], start: float, seconds: float) -> Samples:
    """Returns pieces of audio at 16 kHz at their times, in one track (n,), clipped to full scale.

    Args:
        spoken: start of each piece [s of the session], and its samples.
        start: time of the first sample [s of the session].
        seconds: duration [s].
    """
    track = np.zeros(round(seconds * SAMPLE_RATE), dtype=np.float32)
    for begun, samples in spoken:
        first = round((begun - start) * SAMPLE_RATE)
        low, high = max(first, 0), min(first + len(samples), len(track))
        if low < high:
            track[low:high] += samples[low - first : high - first]
    return np.clip(track, -1.0, 1.0)


def _timed(session: Session) -> Iterator[tuple[float, Samples]]:
    """Yields the start of each audio file [s], and its samples; the spans of an utterance follow each other."""
    for utterance in session.utterances():
        begun = utterance.start
        for each in audio_files(session, utterance):
            samples = read_audio(each.path)
            yield begun, samples
            begun += len(samples) / SAMPLE_RATE
