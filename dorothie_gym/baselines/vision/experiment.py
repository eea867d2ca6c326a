"""Trainings of the vision models on a corpus, and the table of their figures next to the paper's."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Final, TypeAlias

import torch

from dorothie_gym._version import __version__
from dorothie_gym.archive.corpus import Corpus
from dorothie_gym.baselines import checkpoints
from dorothie_gym.baselines.trainer import BEST_FILE
from dorothie_gym.baselines.vision.detector import DetectorConfig
from dorothie_gym.baselines.vision.frames import FrameSampling, FrameSet, OnFrames, load_frames
from dorothie_gym.baselines.vision.object_learner import LEAST_PIXELS, ObjectLearner, detected_boxes, object_figures
from dorothie_gym.baselines.vision.pixel_learner import PixelLearner, pixel_scores
from dorothie_gym.baselines.vision.predicted_pixels import with_predictions
from dorothie_gym.baselines.vision.segformer import SegFormer, SegFormerConfig
from dorothie_gym.baselines.vision.trained import load_segformer, stored_config
from dorothie_gym.baselines.vision.training import OnStep, train_learner
from dorothie_gym.errors import SessionError, one_line
from dorothie_gym.support.files import write_atomically

MODELS: Final = ("segformer", "detr")
"""Commands of the vision models."""

RESULT_FILE: Final = "result.json"
PIXELS_FOLDER: Final = "pixels"

PAPER: Final[Mapping[str, Mapping[str, float]]] = {
    "segformer": {"miou": 0.656, "macc": 0.716, "aacc": 0.971},
    "detr": {"ap50": 0.714, "ap50_95": 0.413},
}
"""Figures of the paper (appendix C, table of the vision models)."""

TESTS: Final = {"seen": "test/seen", "unseen": "test/unseen"}
"""Folds of the figures; those of unseen towns come second."""

TESTED: Final = 300
"""Maximum number of pictures of a fold that are tested, evenly chosen."""

_OBJECT_SPACING, _OBJECT_WAIT, _OBJECT_MOST = 4.0, 4.0, 60  # pictures with objects are rare

OnStage: TypeAlias = Callable[[str, int, int], None]
"""Called with the name of a stage, and the numbers of its finished and of all parts."""


@dataclass(frozen=True, kw_only=True)
class VisionExperiment:
    """Training of a vision model on a corpus.

    Attributes:
        corpus: folder of the corpus.
        model: "segformer" or "detr".
        size: "small" or "paper".
        seed: seed of weights, order and changes of the pictures.
        out: parent of the folders of all trainings.
        inputs: classes and depths that the detector reads: "predicted" by the SegFormer of this size and seed in
            `out`, or "true".
        device: where it is trained: "cpu", "cuda", ...
        epochs: number of epochs; None for that of the size.
    """

    corpus: Path
    model: str
    size: str
    seed: int
    out: Path
    inputs: str = "predicted"
    device: str = "cpu"
    epochs: int | None = None

    @property
    def folder(self) -> Path:
        """Folder of the training."""
        name = f"{self.size}-true-pixels" if self.model == "detr" and self.inputs == "true" else self.size
        return self.out / self.model / name / f"seed-{self.seed}"

    @property
    def reads_predictions(self) -> bool:
        """Whether a SegFormer must be trained first."""
        return self.model == "detr" and self.inputs == "predicted"

    @property
    def segformer(self) -> Path:
        """Folder of the SegFormer whose predictions the detector reads."""
        return self.out / "segformer" / self.size / f"seed-{self.seed}"


def check_experiment(job: VisionExperiment) -> None:
    """Raises `ValueError` if a setting is unknown, or the device is missing; `CheckpointError` as in the run."""
    config_of(job.model, job.size)
    if job.inputs not in ("predicted", "true"):
        raise ValueError(f"there are no inputs {job.inputs!r}; choose from predicted, true")
    try:
        torch.empty(1, device=torch.device(job.device))
    except (RuntimeError, AssertionError) as error:
        raise ValueError(f"the device {job.device!r} cannot be used ({one_line(error)}); choose another") from None
    if job.reads_predictions:
        stored_config(job.segformer, SegFormerConfig)


def run_vision_experiment(
    job: VisionExperiment, *, workers: int = 1, on_stage: OnStage = lambda stage, done, planned: None
) -> dict[str, object]:
    """Trains and tests a vision model, or reads an earlier result; returns the result in JSON types.

    Args:
        job: the training.
        workers: number of processes that draw pictures.
        on_stage: called as it proceeds.

    Raises:
        CheckpointError: its folder holds another training, or the SegFormer of a detector is missing.
        SessionError: the corpus lacks a fold or its surroundings.
        OSError: a folder cannot be written.
    """
    threads = torch.get_num_threads()
    torch.set_num_threads(1)  # equal seeds give equal weights, regardless of the number of processors
    try:
        return _run(job, workers, on_stage)
    finally:
        torch.set_num_threads(threads)


def _run(job: VisionExperiment, workers: int, on_stage: OnStage) -> dict[str, object]:
    device = torch.device(job.device)
    config: SegFormerConfig | DetectorConfig = config_of(job.model, job.size)
    if job.epochs is not None:
        config = replace(config, epochs=job.epochs)
    reader = None
    if job.reads_predictions:
        reader = load_segformer(job.segformer, device)
    drawn: OnFrames = lambda done, planned: on_stage("pictures of sessions", done, planned)  # noqa: E731
    folds = load_frames(Corpus.load(job.corpus), sampling_of(config), workers=workers, on_session=drawn)
    _check_folds(folds, job.corpus)
    if reader is not None:
        folds = _predicted(folds, reader, job.segformer / PIXELS_FOLDER, on_stage)
    training = folds["train"]
    validation = FrameSet([session for fold in ("val/seen", "val/unseen") for session in folds[fold].sessions])
    learner: PixelLearner | ObjectLearner
    if isinstance(config, SegFormerConfig):
        learner = PixelLearner(config, training, validation, job.seed, device)
    else:
        learner = ObjectLearner(config, training, validation, job.seed, device)
    about = {
        "model": job.model,
        "version": __version__,
        "pictures": [training.key, validation.key],
        "inputs": job.inputs,
    }
    if reader is not None:
        about["segformer"] = checkpoints.sha256_of(job.segformer / BEST_FILE)
    stepped: OnStep = lambda done, planned, loss: on_stage(f"steps, loss {loss:.3f}", done, planned)  # noqa: E731
    epochs = train_learner(learner, job.folder, seed=job.seed, about=about, clock=time.process_time, on_step=stepped)
    on_stage("tests", 0, len(TESTS))
    tested = {}
    for number, (name, fold) in enumerate(TESTS.items()):
        tested[name] = _test(learner, folds[fold])
        on_stage("tests", number + 1, len(TESTS))
    result: dict[str, object] = {
        "model": job.model, "size": job.size, "seed": job.seed, "inputs": job.inputs, "device": job.device,
        "version": __version__, "pictures": {fold: len(pictures) for fold, pictures in folds.items()},
        "epochs": [asdict(epoch) for epoch in epochs], "best_epoch": epochs[-1].best,
        "processor_seconds": round(epochs[-1].seconds, 1), "test": tested, "paper": dict(PAPER[job.model]),
        "config": config.to_json(), "folder": str(job.folder),
    }  # fmt: skip
    write_atomically(job.folder / RESULT_FILE, json.dumps(result) + "\n")
    return result


def config_of(model: str, size: str) -> SegFormerConfig | DetectorConfig:
    """Returns the settings of a model; raises `ValueError` for an unknown size."""
    if size not in ("small", "paper"):
        raise ValueError(f"there is no config {size!r}; choose from small, paper")
    if model == "segformer":
        return SegFormerConfig.small() if size == "small" else SegFormerConfig.paper()
    return DetectorConfig.small() if size == "small" else DetectorConfig.paper()


def sampling_of(config: SegFormerConfig | DetectorConfig) -> FrameSampling:
    """Returns the choice of pictures for a model; a detector learns and is tested on pictures with an object."""
    if isinstance(config, SegFormerConfig):
        return FrameSampling(width=config.width, height=config.height)
    return FrameSampling(
        width=config.width,
        height=config.height,
        spacing=_OBJECT_SPACING,
        wait=_OBJECT_WAIT,
        most=_OBJECT_MOST,
        pixels=LEAST_PIXELS,
    )


def _check_folds(folds: Mapping[str, FrameSet], corpus: Path) -> None:
    for fold in ("train", "val/seen", "val/unseen", *TESTS.values()):
        if not len(folds.get(fold, ())):
            raise SessionError(f"{corpus}: has no picture in the fold {fold}; `dorothie-gym generate` makes all folds")


def _predicted(
    folds: Mapping[str, FrameSet], reader: SegFormer, folder: Path, on_stage: OnStage
) -> dict[str, FrameSet]:
    planned, done = sum(len(pictures.sessions) for pictures in folds.values()), 0

    def on_session() -> None:
        nonlocal done
        done += 1
        on_stage("predicted classes and depths of sessions", done, planned)

    return {fold: with_predictions(pictures, reader, folder, on_session) for fold, pictures in folds.items()}


def _test(learner: PixelLearner | ObjectLearner, pictures: FrameSet) -> dict[str, object]:
    """Returns the figures of a model on pictures, in JSON types."""
    if isinstance(learner, PixelLearner):
        scores = pixel_scores(learner.model, pictures, most=TESTED)
        classes = {kind.name.lower(): round(value, 4) for kind, value in scores.overlaps.items()}
        return {**_known(scores.figures()), "iou": classes}
    return _known(object_figures(detected_boxes(learner.model, pictures, most=TESTED)))


def _known(figures: Mapping[str, float]) -> dict[str, object]:
    """Returns figures in JSON types: None if there is none."""
    return {name: None if math.isnan(value) else round(value, 5) for name, value in figures.items()}
