"""Resumable run of a training in a folder: the part that reinforcement learning and self-play share."""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Final, Generic, Self, TypeAlias, TypeVar

import torch

from dorothie_gym.baselines.rl.settings import Page
from dorothie_gym.errors import ModelFileError, one_line
from dorothie_gym.files import write_atomically
from dorothie_gym.input_files import MAX_MODEL_JSON, parse_json, raising, read_text

PROGRESS: Final = "progress.jsonl"
"""File of a run with a line for each evaluation."""

CURVE: Final = "curve.png"
"""File of a run with the learning curve."""

BEST: Final = "best"
"""Folder in a run with the best model so far."""

CLONED: Final = "cloned.json"
"""File of a run with the result of its warm start."""


@dataclass(frozen=True, kw_only=True)
class RunEvaluation(ABC):
    """Evaluation after a number of steps and a duration of training [s]."""

    steps: int
    seconds: float

    @abstractmethod
    def as_json(self) -> Page:
        """Returns the evaluation in JSON types."""

    @classmethod
    @abstractmethod
    def from_json(cls, page: Page) -> Self:
        """Reads the output of `as_json`."""


Evaluation = TypeVar("Evaluation", bound=RunEvaluation)

OnProgress: TypeAlias = Callable[[int, int, Evaluation | None], None]
"""Callback with the number of steps done, their total, and a new evaluation if there is one."""

OnStage: TypeAlias = Callable[[str, int, int], None]
"""Callback for the warm start: name of the stage, number of its steps done, and their total."""


def ignore_stage(stage: str, done: int, total: int) -> None:
    """Ignores the progress of a warm start."""


@dataclass(frozen=True, kw_only=True)
class TrainingResult(Generic[Evaluation]):
    """Result of a training.

    Attributes:
        folder: folder of the training.
        rows: evaluations, in order.
        steps: number of steps, with those before the resumption.
        seconds: duration of the training without evaluations [s].
        finished: whether all steps were done.
    """

    folder: Path
    rows: tuple[Evaluation, ...]
    steps: int
    seconds: float
    finished: bool


class Run(Generic[Evaluation]):
    """Run of a training in a folder.

    Attributes:
        folder: folder of the run: models, `PROGRESS`, `CURVE`, TensorBoard logs.
        rows: evaluations so far.
        seconds: duration of the training without evaluations [s].
    """

    def __init__(self, folder: Path, on_progress: OnProgress[Evaluation] | None, on_stage: OnStage) -> None:
        """Prepares a run and limits torch to one thread.

        Args:
            folder: folder of the run.
            on_progress: callback for the progress, or None.
            on_stage: callback for the progress of a warm start.
        """
        self.folder = folder
        self.rows: list[Evaluation] = []
        self.seconds = 0.0
        self._on_progress = on_progress or (lambda done, total, row: None)
        self._on_stage = on_stage
        torch.set_num_threads(1)  # small networks: more threads only wait for each other

    def _log_folder(self) -> Path | None:
        """Returns the folder for TensorBoard; None if TensorBoard is not installed."""
        return self.folder / "tensorboard" if find_spec("tensorboard") is not None else None

    def _read_rows(self, kind: type[Evaluation]) -> list[Evaluation]:
        path = self.folder / PROGRESS
        with raising(ModelFileError):
            lines = read_text(path, MAX_MODEL_JSON).splitlines() if path.exists() else []
            pages = [parse_json(line, f"{path}, line {number}") for number, line in enumerate(lines, start=1)]
        try:
            return [kind.from_json(page) for page in pages if isinstance(page, dict)]
        except (KeyError, TypeError, ValueError) as error:
            raise ModelFileError(f"{path}: is no learning curve of this version ({one_line(repr(error))})") from None

    def _write_rows(self) -> None:
        lines = "".join(json.dumps(row.as_json()) + "\n" for row in self.rows)
        write_atomically(self.folder / PROGRESS, lines)

    def _write_cloned(self, results: Mapping[str, object]) -> None:
        write_atomically(self.folder / CLONED, json.dumps(results, indent=1) + "\n")

    def _result(self, steps: int, *, finished: bool) -> TrainingResult[Evaluation]:
        return TrainingResult(
            folder=self.folder, rows=tuple(self.rows), steps=steps, seconds=self.seconds, finished=finished
        )
