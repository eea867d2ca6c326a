"""Sound of the current utterances of a corpus's points as inputs of models."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from dorothie_gym.archive.corpus import Corpus
from dorothie_gym.archive.sound import audio_files
from dorothie_gym.archive.visibility import Task
from dorothie_gym.baselines.encoders.pretrained import HubertEncoder
from dorothie_gym.baselines.encoders.sound import BANDS, MEL_FRAMES, SpeechEmbeddingEncoder, mel_table
from dorothie_gym.errors import EncoderError, SessionError
from dorothie_gym.support.audio import read_audio

if TYPE_CHECKING:
    from dorothie_gym.baselines.encoders.encoder import SpeechEncoder
    from dorothie_gym.baselines.model_entries import Sound
    from dorothie_gym.evaluation.teacher_forced.features.columns import Columns
    from dorothie_gym.evaluation.teacher_forced.features.point_table import PointTable
    from dorothie_gym.session.recording.session import Session


class SoundInputs:
    """Sound of current utterances.

    Args:
        corpus: folder of a spoken corpus.
        sound: the encoder.
        hubert: folder with the weights of HuBERT.

    Attributes:
        id: name, version and weights of the encoder.
        dim: numbers of a vector; of a frame of a spectrum.

    Raises:
        EncoderError: the encoder's package or weights are missing.
    """

    def __init__(self, corpus: Path, sound: Sound, hubert: Path | None = None):
        self._corpus = corpus
        self._encoder: SpeechEncoder | None = None if sound == "log-mel" else _encoder(sound, hubert)
        self.id = f"log-mel-1-{MEL_FRAMES}x{BANDS}" if self._encoder is None else self._encoder.id
        self.dim = BANDS if self._encoder is None else self._encoder.dim

    def at(self, columns: Columns, tables: Sequence[PointTable]) -> Tensor:
        """Returns the sound of the current utterance at points: spectra (N, 256, 32) float16, or vectors (N, dim).

        Points of other tasks than UfN, which have no current utterance, have zeros.

        Args:
            columns: the corpus.
            tables: points, task by task.

        Raises:
            SessionError: no utterance of the points has audio.
            AudioError: an audio file is damaged.
            SpeechError: the extra `speech` is not installed.
        """
        names = {entry.name: entry for entry in Corpus.load(self._corpus).entries}
        count = sum(map(len, tables))
        shape = (MEL_FRAMES, BANDS) if self._encoder is None else (self.dim,)
        found = np.zeros((count, *shape), dtype=np.float16 if self._encoder is None else np.float32)
        start, heard = 0, 0
        for table in tables:
            if table.task is Task.UFN:
                for number in np.unique(table.session).tolist():
                    rows = np.flatnonzero(table.session == number)
                    sounds = _sounds(names[columns.sessions.names[number]].load(), table.event[rows].tolist())
                    heard += sum(len(sound) > 0 for sound in sounds)
                    found[start + rows] = self._encode(sounds)
            start += len(table)
        if count and not heard:
            raise SessionError(f"{self._corpus}: has no audio; generate it with --speech")
        return torch.from_numpy(found)

    def _encode(self, sounds: Sequence[NDArray[np.float32]]) -> NDArray[np.floating]:
        return mel_table(sounds) if self._encoder is None else self._encoder.encode(sounds)


def _encoder(sound: Sound, hubert: Path | None) -> SpeechEncoder:
    if sound == "speech-embedding":
        return SpeechEmbeddingEncoder()
    if hubert is None:
        raise EncoderError("models of HuBERT need the folder of its weights; give --hubert")
    return HubertEncoder(hubert)


def _sounds(session: Session, events: Sequence[int]) -> list[NDArray[np.float32]]:
    """Returns the sound of the utterance of each event; without samples for one without audio."""
    utterances = {move.index: each for each in session.utterances() for move in each.moves}
    read: dict[int, NDArray[np.float32]] = {}
    for event in events:
        utterance = utterances[event]
        if utterance.number not in read:
            files = audio_files(session, utterance)
            parts = [read_audio(each.path) for each in files]
            read[utterance.number] = np.concatenate(parts) if parts else np.empty(0, dtype=np.float32)
    return [read[utterances[event].number] for event in events]
