"""Files of a resumable run of a training in a folder."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Final, TypeAlias

import torch
from stable_baselines3.common.logger import Logger, configure

from dorothie_gym.baselines.rl.evaluation import EpisodeStatistics
from dorothie_gym.baselines.rl.resumption import CHECKPOINT, Checkpoint, Tensors, read_checkpoint, write_checkpoint
from dorothie_gym.baselines.rl.settings import Page, TrainingSettings
from dorothie_gym.errors import ModelFileError, one_line
from dorothie_gym.policies.policy import DESCRIPTION
from dorothie_gym.support.files import write_atomically
from dorothie_gym.support.input_files import checked, raising

PROGRESS: Final = "progress.jsonl"
"""File of a run with a line for each evaluation."""

CURVE: Final = "curve.png"
"""File of a run with the learning curve."""

BEST: Final = "best"
"""Folder in a run with the best model so far."""

CLONED: Final = "cloned.json"
"""File of a run with the result of its warm start."""


@dataclass(frozen=True, kw_only=True)
class TrainingEvaluation:
    """Evaluation of a model over episodes, after a number of steps and a duration of training [s]."""

    steps: int
    seconds: float
    outcome: EpisodeStatistics

    def as_json(self) -> Page:
        """Returns the evaluation in JSON types."""
        return {"steps": self.steps, "seconds": self.seconds, **asdict(self.outcome)}

    @classmethod
    def from_json(cls, page: Page) -> TrainingEvaluation:
        """Reads the output of `as_json`."""
        outcome = {name: value for name, value in page.items() if name not in ("steps", "seconds")}
        return cls(
            steps=int(page["steps"]),
            seconds=float(page["seconds"]),
            outcome=checked(outcome, EpisodeStatistics, "evaluation"),
        )


OnProgress: TypeAlias = Callable[[int, int, TrainingEvaluation | None], None]
"""Callback with the number of steps done, their total, and a new evaluation if there is one."""

OnStage: TypeAlias = Callable[[str, int, int], None]
"""Callback for the warm start: name of the stage, number of its steps done, and their total."""


def ignore_stage(stage: str, done: int, total: int) -> None:
    """Ignores the progress of a warm start."""


@dataclass(frozen=True, kw_only=True)
class TrainingResult:
    """Result of a training.

    Attributes:
        folder: folder of the training.
        rows: evaluations, in order.
        steps: number of steps, with those before the resumption.
        seconds: duration of the training without evaluations [s].
        finished: whether all steps were done.
    """

    folder: Path
    rows: tuple[TrainingEvaluation, ...]
    steps: int
    seconds: float
    finished: bool


class Run:
    """Run of a training in a folder.

    Attributes:
        folder: folder of the run: models, `PROGRESS`, `CURVE`, TensorBoard logs.
        rows: evaluations so far.
        steps: number of steps at the last checkpoint.
        seconds: duration of the training without evaluations [s].
    """

    def __init__(self, folder: Path, on_progress: OnProgress | None, on_stage: OnStage) -> None:
        """Prepares a run and limits torch to one thread.

        Args:
            folder: folder of the run.
            on_progress: callback for the progress, or None.
            on_stage: callback for the progress of a warm start.
        """
        self.folder = folder
        self.rows: list[TrainingEvaluation] = []
        self.steps, self.seconds = 0, 0.0
        self._on_progress = on_progress or (lambda done, total, row: None)
        self._on_stage = on_stage
        torch.set_num_threads(1)  # small networks: more threads only wait for each other

    def _read_checkpoint(self, settings: TrainingSettings) -> Checkpoint | None:
        """Returns the checkpoint in the folder after reading rows and time from it; None if there is no run yet.

        Args:
            settings: settings of the run.

        Raises:
            SettingsError: the run there has other settings.
            ModelFileError: the checkpoint is damaged, or there is a model without one.
        """
        found = read_checkpoint(self.folder)
        if found is None:
            if (self.folder / DESCRIPTION).exists():
                raise ModelFileError(
                    f"{self.folder}: has no {CHECKPOINT}, from which the training of the model there could go on; "
                    "choose another folder"
                )
            return None
        with raising(ModelFileError):
            settings.check_resumable(checked(found.page.get("settings"), TrainingSettings, found.path), self.folder)
        try:
            self.rows = [TrainingEvaluation.from_json(row) for row in found.page["rows"]]
            self.seconds, self.steps = float(found.page["seconds"]), int(found.page["steps"])
        except (KeyError, TypeError, ValueError) as error:
            raise ModelFileError(f"{found.path}: is no run of this version ({one_line(repr(error))})") from None
        return found

    def _write_checkpoint(self, settings: TrainingSettings, steps: int, page: Page, tensors: Tensors) -> None:
        """Writes the checkpoint after a number of steps; a run that is resumed there writes all later files again."""
        rows = [row.as_json() for row in self.rows]
        own: Page = {"settings": settings.as_json(), "steps": steps, "seconds": self.seconds, "rows": rows}
        write_checkpoint(self.folder, {**own, **page}, tensors)
        self.steps = steps

    def _make_logger(self, name: str) -> Logger:
        """Returns a logger for TensorBoard, if that is installed; it replaces records after the last checkpoint."""
        if find_spec("tensorboard") is None:
            return Logger(None, [])
        from tensorboard.compat.proto.event_pb2 import Event, SessionLog

        logger = configure(str(self.folder / "tensorboard" / name), ["tensorboard"])
        again = Event(step=self.steps + 1 if self.steps else 0, session_log=SessionLog(status=SessionLog.START))
        logger.output_formats[0].writer.file_writer.add_event(again)  # type: ignore[attr-defined]  # TensorBoard's
        return logger

    def _write_rows(self) -> None:
        lines = "".join(json.dumps(row.as_json()) + "\n" for row in self.rows)
        write_atomically(self.folder / PROGRESS, lines)

    def _write_cloned(self, results: Mapping[str, object]) -> None:
        write_atomically(self.folder / CLONED, json.dumps(results, indent=1) + "\n")

    def _result(self, *, finished: bool) -> TrainingResult:
        return TrainingResult(
            folder=self.folder, rows=tuple(self.rows), steps=self.steps, seconds=self.seconds, finished=finished
        )
