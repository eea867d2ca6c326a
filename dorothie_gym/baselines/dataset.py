"""Dataset of a corpus: its points as tensors, its texts as vectors and as byte pairs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Final, Self

import numpy as np
import torch
from torch import Tensor

from dorothie_gym.archive.corpus import Corpus, Fold
from dorothie_gym.baselines.encoders import text_encoder
from dorothie_gym.baselines.encoders.byte_pairs import BytePairs
from dorothie_gym.baselines.encoders.encoder import TextEncoder, text_table
from dorothie_gym.baselines.point_tensors import TASKS, TRAIN, Examples
from dorothie_gym.baselines.sound_inputs import SoundInputs
from dorothie_gym.errors import CheckpointError, SessionError
from dorothie_gym.evaluation.teacher_forced.features.corpus_columns import build
from dorothie_gym.evaluation.teacher_forced.features.point_table import PointTable, points
from dorothie_gym.evaluation.teacher_forced.features.sight import Sight, VisibleBoxes
from dorothie_gym.maps.catalogue import find_town
from dorothie_gym.session.recording.trajectory import FRAMES_PER_TENTH
from dorothie_gym.support.user_cache import cache_folder

if TYPE_CHECKING:
    from dorothie_gym.baselines.model_entries import Objects, Sound
    from dorothie_gym.baselines.vision.detected_boxes import DetectedBoxes
    from dorothie_gym.evaluation.teacher_forced.features.batch import BatchSpec
    from dorothie_gym.evaluation.teacher_forced.features.columns import Columns

_TABLES: Final = "texts"


def sight_of(objects: Objects, detector: Path | None = None) -> Sight | None:
    """Returns a source of objects; None for the record.

    Args:
        objects: the source.
        detector: folder of the trained detector, for "detections".

    Raises:
        CheckpointError: there is no such training, or it cannot be used.
    """
    if objects == "record":
        return None
    if objects == "boxes":
        return VisibleBoxes()
    if detector is None:
        raise CheckpointError("models of detections need the folder of a trained detector; give --detector")
    from dorothie_gym.baselines.vision.detected_boxes import DetectedBoxes  # here: it needs transformers

    return DetectedBoxes(detector)


class Dataset:
    """Dataset of a corpus. Vectors of texts are kept in the user's cache.

    Attributes:
        hubert: folder with the weights of HuBERT, for models that hear by it; None without one.

    Args:
        columns: the corpus.
        encoder: encoder of its texts.
        cache: folder for vectors of texts; None for no cache.
        corpus: folder of the corpus, if it may be read again for objects of another source.
        sight: source of the objects; None for the record.
    """

    def __init__(
        self,
        columns: Columns,
        encoder: TextEncoder,
        cache: Path | None = None,
        corpus: Path | str | None = None,
        sight: Sight | None = None,
    ):
        self.columns = columns
        self.encoder = encoder
        self._cache, self._corpus, self._sight = cache, corpus, sight
        self._others: dict[tuple[Objects, Path | None], Dataset] = {}
        self._examples: dict[tuple[str, BatchSpec], Examples] = {}
        self._sounds: dict[Sound, SoundInputs] = {}
        self.hubert: Path | None = None

    @classmethod
    def load(cls, corpus: Path | str, encoder: str = "auto") -> Self:
        """Reads a corpus.

        Args:
            corpus: its folder.
            encoder: name of the encoder of its texts, see `text_encoder`.

        Raises:
            SessionError: it cannot be read, or lacks a fold.
            EncoderError: the encoder is unknown, or its requirements are missing.
        """
        cache = cache_folder()
        return cls(build(corpus), text_encoder(encoder), None if cache is None else cache / _TABLES, corpus)

    def seeing(
        self, objects: Objects, on_session: Callable[[], object] | None = None, detector: Path | None = None
    ) -> Dataset:
        """Returns the dataset with the objects of another source; this dataset itself if that is the record.

        Args:
            objects: the source.
            on_session: called after each session whose pictures were drawn.
            detector: folder of the trained detector, for "detections".

        Raises:
            SessionError: the corpus cannot be read again.
            CheckpointError: the detector is missing or cannot be used.
        """
        sight = sight_of(objects, detector)
        if sight is None:
            return self
        if (objects, detector) not in self._others:
            if self._corpus is None:
                raise SessionError("the dataset has no corpus whose pictures could be drawn")
            columns = build(self._corpus, sight=sight, on_session=on_session)
            self._others[objects, detector] = Dataset(columns, self.encoder, self._cache, self._corpus, sight)
        return self._others[objects, detector]

    def about(self) -> dict[str, object]:
        """Returns the identity of the features in JSON types; part of every checkpoint and every result."""
        return {"corpus": self.columns.content, "encoder": self.encoder.id}

    def tables(self, fold: str) -> tuple[PointTable, ...]:
        """Returns the points of a fold, task by task.

        Raises:
            SessionError: the fold has no points.
        """
        found = tuple(points(self.columns, task, Fold(fold)) for task in TASKS)
        if not any(len(table) for table in found):
            folds = sorted({fold or "none" for fold in self.columns.sessions.folds})
            raise SessionError(
                f"the corpus has no points in the fold {fold!r} (its folds: {', '.join(folds)}); training needs train, "
                "val and test, as `dorothie-gym generate` makes them"
            )
        return found

    def examples(self, fold: str, spec: BatchSpec, *, queries: bool = False, sound: Sound | None = None) -> Examples:
        """Returns the points of a fold as tensors; computed once.

        Args:
            fold: the fold.
            spec: sizes.
            queries: whether the inputs have the queries of the detector (N, q, d) at the last look, under "detector".
            sound: encoder of the sound of the current utterances (N, ...), under "current_sound"; None for no sound.
        """
        if (fold, spec) not in self._examples:
            self._examples[fold, spec] = Examples.gather(self.columns, self.tables(fold), spec)
        found = self._examples[fold, spec]
        more: dict[str, Tensor] = {"detector": self._queries(fold)} if queries else {}
        if sound is not None:
            more["current_sound"] = self.sounds(sound).at(self.columns, self.tables(fold))
        return replace(found, inputs={**found.inputs, **more}) if more else found

    def sounds(self, sound: Sound) -> SoundInputs:
        """Returns the encoder of the sounds of the corpus, made once.

        Raises:
            EncoderError: the encoder's package or weights are missing.
            SessionError: the dataset has no corpus that could be read again.
        """
        if sound not in self._sounds:
            self._sounds[sound] = SoundInputs(Path(self._root), sound, self.hubert)
        return self._sounds[sound]

    @property
    def _root(self) -> Path | str:
        """Folder of the corpus; raises `SessionError` if there is none."""
        if self._corpus is None:
            raise SessionError("the dataset has no corpus whose sound and pictures could be read")
        return self._corpus

    @property
    def detector(self) -> DetectedBoxes:
        """Detector that finds the objects; raises `ValueError` if they have another source."""
        from dorothie_gym.baselines.vision.detected_boxes import DetectedBoxes  # here: it needs transformers

        if not isinstance(self._sight, DetectedBoxes):
            raise ValueError("the objects of this dataset are not those of a detector; there are no queries")
        return self._sight

    def _queries(self, fold: str) -> Tensor:
        """Returns the queries (N, q, d) at the last look of all points of a fold, float16; 0 if there is none."""
        columns, detector, tables = self.columns, self.detector, self.tables(fold)
        session = np.concatenate([table.session for table in tables])
        start, stop = (
            np.concatenate([getattr(table, name) for table in tables]).astype(np.int64)
            for name in ("frames_start", "frames_stop")
        )
        look = np.where(stop > start, columns.frames.look[np.maximum(stop - 1, 0)], -1)
        found = torch.zeros(len(session), *detector.query_shape, dtype=torch.float16)
        entries = {entry.name: entry for entry in Corpus.load(self._root).entries}
        for number in np.unique(session[look >= 0]).tolist():
            entry = entries[columns.sessions.names[number]]
            played = entry.load()
            town = find_town(played.header.town, entry.maps)
            if town is None or not len(played.scene.actors) or not len(played.trajectory):
                continue
            frames, values = detector.queries(played, town)
            rows = np.flatnonzero((session == number) & (look >= 0))
            tenths, wanted = frames // FRAMES_PER_TENTH, columns.looks.tenth[look[rows]]
            place = np.searchsorted(tenths, wanted).clip(max=max(len(tenths) - 1, 0))
            known = tenths[place] == wanted if len(tenths) else np.zeros(len(rows), dtype=np.bool_)
            found[torch.from_numpy(rows[known])] = torch.from_numpy(values[place[known]])
        return found

    @cached_property
    def vectors(self) -> Tensor:
        """Vectors of all texts (n, dim), float32."""
        return torch.from_numpy(text_table(self.encoder, self.columns.texts, self._cache).copy())

    def byte_pairs(self, vocabulary: int) -> BytePairs:
        """Returns the byte pairs learned from the training sessions."""
        columns = self.columns
        trained = np.flatnonzero([fold.split("/")[0] == TRAIN for fold in columns.sessions.folds])
        said = columns.utterances
        rows = np.unique(said.text[np.isin(said.session, trained)])
        return BytePairs.train([columns.texts[row] for row in rows if row >= 0], vocabulary)

    def tokens(self, texts: Sequence[str] | None, pairs: BytePairs, length: int) -> Tensor:
        """Returns the byte pairs of texts (n, length), int64; of all texts of the corpus if `texts` is None."""
        return torch.from_numpy(pairs.table(self.columns.texts if texts is None else texts, length)).long()
