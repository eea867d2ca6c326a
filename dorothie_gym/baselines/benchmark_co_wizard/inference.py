"""Predictions of a trained model in a session in progress."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import torch

from dorothie_gym.archive.visibility import Task
from dorothie_gym.baselines.checkpoints import ModelCard, restore, sha256_of
from dorothie_gym.baselines.dataset import Dataset
from dorothie_gym.baselines.encoders import text_encoder
from dorothie_gym.baselines.encoders.byte_pairs import BytePairs
from dorothie_gym.baselines.model_entries import stored_row
from dorothie_gym.baselines.model_zoo import build_model, refresh_text_tables
from dorothie_gym.baselines.point_tensors import Examples, Inputs, Labels, Predicted
from dorothie_gym.baselines.toto.config import TOTOConfig
from dorothie_gym.errors import CheckpointError, DorothieGymError, ModelFileError, one_line
from dorothie_gym.evaluation.teacher_forced.features.point_table import PointTable, points
from dorothie_gym.evaluation.teacher_forced.features.session_columns import town_graph
from dorothie_gym.support.input_files import MAX_WEIGHTS, check_file, raising

if TYPE_CHECKING:
    from dorothie_gym.baselines.benchmark_co_wizard.history import History
    from dorothie_gym.baselines.encoders.encoder import TextEncoder, Vectors
    from dorothie_gym.baselines.toto.model import TOTO
    from dorothie_gym.evaluation.teacher_forced.features.columns import Columns
    from dorothie_gym.maps.town import Town

_TOWNS: Final = 4
"""Maximum number of towns for which prepared models are kept."""

_TEXTS: Final = 1 << 16


class BenchmarkModel:
    """Trained benchmark model.

    Args:
        description: its model card.
        folder: folder of its weights.

    Raises:
        ValueError: the weights or the text encoder differ from the model card, or are missing.
    """

    def __init__(self, description: ModelCard, folder: Path):
        self.description = description
        self.weights = folder / description.weights
        self.row = stored_row(description.row)
        self.config = TOTOConfig.from_json(description.config)
        if self.config.detector is not None:
            raise ValueError(f"{folder}: reads the queries of a detector, which are known of recorded sessions only")
        with raising(ModelFileError):
            if self.weights.exists():
                check_file(self.weights, MAX_WEIGHTS)
        if not self.weights.exists() or sha256_of(self.weights) != description.weights_sha256:
            raise ValueError(f"{self.weights}: is missing, or differs from the trained weights; train the model again")
        if 4 * self.config.weights_at_least > self.weights.stat().st_size:
            raise ModelFileError(f"{folder}: field 'config' asks for more weights than {self.weights.name} has")
        encoder = text_encoder(description.encoder)
        if encoder.id != description.encoder_id:
            raise ValueError(f"{folder}: was trained with the encoder {description.encoder_id}; here is {encoder.id}")
        self.encoder: TextEncoder = _OneByOne(encoder)
        self.pairs = None if description.merges is None else BytePairs(description.merges)
        self.in_town = lru_cache(maxsize=_TOWNS)(self._in_town)

    @classmethod
    @lru_cache(maxsize=8)
    def load(cls, path: Path) -> BenchmarkModel:
        """Reads a model, once in a process.

        Raises:
            ModelFileError: as above, or the description cannot be read.
        """
        card = ModelCard.read(path)
        try:
            return cls(card, path if path.is_dir() else path.parent)
        except DorothieGymError:
            raise
        except ValueError as error:
            raise ModelFileError(f"{path}: {one_line(error)}") from None

    def _in_town(self, town: Town) -> TownModel:
        return TownModel(self, town)


class TownModel:
    """Trained model in a town. Equal histories give equal answers, in any order of calls."""

    def __init__(self, trained: BenchmarkModel, town: Town):
        self._trained = trained
        self._graph = town_graph(town.name, town)
        self._model: TOTO | None = None
        self._texts: tuple[str, ...] = ()

    def answer(self, history: History, task: Task, *, last: int = 1) -> Predicted:
        """Returns the prediction at one of the last points of a history (B = 1).

        Args:
            history: the history, which contains the point.
            task: the task.
            last: place of the point among those of the task, counted from the end; 1 for the last.
        """
        with _one_thread(), torch.inference_mode():
            model, inputs, labels = self._encoded(history, task, last)
            return model.predict(inputs, labels.task)

    def decisions(self, history: History, allowed: Sequence[bool]) -> Iterator[Predicted]:
        """Yields the navigation decisions at the last NfD point of a history, the most likely first (B = 1 each).

        Args:
            history: the history, which contains the point.
            allowed: (6,) navigation actions that may be predicted; each is predicted once.
        """
        with _one_thread(), torch.inference_mode():
            model, inputs, labels = self._encoded(history, Task.NFD, 1)
        mask = torch.tensor([list(allowed)])
        while bool(mask.any()):
            with _one_thread(), torch.inference_mode():
                predicted = model.predict(inputs, labels.task, mask)
            yield predicted
            mask[0, int(predicted.action)] = False

    def _encoded(self, history: History, task: Task, last: int) -> tuple[TOTO, Inputs, Labels]:
        """Returns the model with the texts of a history, and inputs and labels of one of its last points."""
        columns = history.encoded.columns(self._graph)
        table = points(columns, task)
        model = self._ready(columns)
        examples = Examples.gather(columns, [_only(table, len(table) - last)], model.spec)
        return model, examples.inputs, examples.labels

    def _ready(self, columns: Columns) -> TOTO:
        """Returns the model with the texts of the history."""
        trained = self._trained
        if self._model is not None and self._texts == columns.texts:
            return self._model
        self._texts = columns.texts
        material = _LiveMaterial(columns, trained.encoder, trained.pairs)
        if self._model is None:
            model = build_model(trained.row, trained.config, material, trained.description.spread)
            try:
                restore(trained.weights, model)
            except CheckpointError as error:
                raise ModelFileError(str(error)) from None
            self._model = model.eval()
        else:
            refresh_text_tables(self._model, material)
        return self._model


def _only(table: PointTable, row: int) -> PointTable:
    """Returns a table of one point of a table."""
    columns: dict[str, Any] = {
        name: value[row : row + 1] for name, value in vars(table).items() if isinstance(value, np.ndarray)
    }
    return replace(table, **columns, skipped=())


class _LiveMaterial(Dataset):
    """Dataset of a history, with the byte pairs of the training sessions."""

    def __init__(self, columns: Columns, encoder: TextEncoder, pairs: BytePairs | None):
        super().__init__(columns, encoder)
        self._pairs = pairs

    def byte_pairs(self, vocabulary: int) -> BytePairs:
        """Returns the byte pairs that the model was trained with."""
        if self._pairs is None:
            raise ValueError("the model reads pieces of words, but its description has none; train it again")
        return self._pairs


class _OneByOne:
    """Encodes each text alone, once: in a batch its vector would differ in the last digits."""

    def __init__(self, encoder: TextEncoder):
        self.name, self.id, self.dim = encoder.name, encoder.id, encoder.dim
        self._vector = lru_cache(maxsize=_TEXTS)(lambda text: encoder.encode([text])[0])

    def encode(self, texts: Sequence[str]) -> Vectors:
        """Returns the vectors of texts, float32 (n, dim)."""
        if not texts:
            return np.zeros((0, self.dim), dtype=np.float32)
        return np.stack([self._vector(text) for text in texts])


@contextmanager
def _one_thread() -> Iterator[None]:
    """Limits torch to one thread: sums then do not depend on the number of cores, and small models are faster."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)
