"""Supervised training of models: epochs with early stopping, resumable after an interruption with equal results."""

from __future__ import annotations

import hashlib
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final, Protocol, cast

import torch
from torch import Tensor, nn

from dorothie_gym.baselines import checkpoints
from dorothie_gym.baselines.gradients import backpropagate
from dorothie_gym.baselines.point_tensors import Examples, Inputs, Labels, Predicted
from dorothie_gym.errors import CheckpointError

if TYPE_CHECKING:
    from dorothie_gym.evaluation.teacher_forced.features.batch import BatchSpec

BEST_FILE: Final = "best.safetensors"
"""Weights of the epoch with the lowest validation loss."""

LAST_FILE: Final = "last.safetensors"
"""Weights and optimiser state after the last complete epoch."""

_EVALUATED: Final = 256
_BUCKET: Final = 8
"""Number of batches whose points are sorted by length together, to reduce padding."""


class Schedule(Protocol):
    """Settings of the optimisation in a config; see `TOTOConfig`."""

    @property
    def learning_rate(self) -> float: ...  # noqa: D102
    @property
    def weight_decay(self) -> float: ...  # noqa: D102
    @property
    def clip(self) -> float: ...  # noqa: D102
    @property
    def batch_size(self) -> int: ...  # noqa: D102
    @property
    def min_epochs(self) -> int: ...  # noqa: D102
    @property
    def max_epochs(self) -> int: ...  # noqa: D102
    @property
    def patience(self) -> int: ...  # noqa: D102
    @property
    def spec(self) -> BatchSpec: ...  # noqa: D102
    def to_json(self) -> dict[str, object]: ...  # noqa: D102


class Model(nn.Module, ABC):
    """Model that can be trained and queried."""

    config: Schedule

    @property
    def spec(self) -> BatchSpec:
        """Sizes of the model's batches."""
        return self.config.spec

    @abstractmethod
    def loss(self, inputs: Inputs, labels: Labels) -> Tensor:
        """Returns the mean loss of B points."""

    @abstractmethod
    def predict(self, inputs: Inputs, task: Tensor, allowed: Tensor | None = None) -> Predicted:
        """Returns the predictions at B points of tasks (B,); `allowed` (B, 6) masks navigation actions."""


@dataclass(frozen=True, kw_only=True)
class Epoch:
    """Pass over the training points.

    Attributes:
        number: number, from 1.
        training: mean loss of its steps.
        validation: mean loss of the validation points after it.
        best: number of the epoch with the lowest validation loss so far.
        lowest: that loss.
    """

    number: int
    training: float
    validation: float
    best: int
    lowest: float


OnEpoch = Callable[[Epoch], None]


@dataclass(frozen=True, kw_only=True)
class TrainingSummary:
    """Result of a training.

    Attributes:
        epochs: all epochs.
        points: number of training points in an epoch.
    """

    epochs: tuple[Epoch, ...]
    points: int


def device() -> torch.device:
    """Returns the GPU where there is one, else the CPU."""
    return torch.device("cuda" if torch.cuda.is_available() else "cpu")


def train(
    model: Model,
    training: Examples,
    validation: Examples,
    *,
    folder: Path,
    seed: int,
    about: Mapping[str, object],
    on_epoch: OnEpoch = lambda epoch: None,
) -> TrainingSummary:
    """Trains a model until its validation loss no longer falls, and leaves it with the weights of the best epoch.

    On a CPU equal seeds give equal losses to the last digit. After each epoch the state is written to the folder; after
    an interruption, a further call resumes there and reaches equal weights. A complete training is read, not repeated.

    Args:
        model: model with initial weights drawn from the seed.
        training: training points.
        validation: points for early stopping.
        folder: folder of this training only.
        seed: seed of the order of the points and of dropout.
        about: identity of the training in JSON types: name of the model, encoder, hash of the corpus.
        on_epoch: called after each epoch.

    Raises:
        CheckpointError: the folder holds another training.
        OSError: the folder cannot be written.
    """
    run = _Run(model, folder, seed, about)
    with DeterministicAlgorithms(run.device):
        epochs = run.resume()
        while not _finished(epochs, model.config):
            number = len(epochs) + 1
            torch.manual_seed(mixed_seed(seed, number))  # dropout does not depend on earlier epochs
            loss = run.epoch(training, number)
            found = run.evaluate(validation)
            before = epochs[-1] if epochs else None
            better = before is None or found < before.lowest
            best, lowest = (number, found) if better or before is None else (before.best, before.lowest)
            epochs.append(Epoch(number=number, training=loss, validation=found, best=best, lowest=lowest))
            run.keep(epochs, better)
            on_epoch(epochs[-1])
    checkpoints.restore(folder / BEST_FILE, model)
    return TrainingSummary(epochs=tuple(epochs), points=len(training))


def predict(model: Model, examples: Examples) -> Predicted:
    """Returns the predictions of a model at the given points, on the CPU."""
    where = next(model.parameters()).device
    model.eval()
    parts = []
    with torch.inference_mode():
        for rows in torch.split(torch.arange(len(examples)), _EVALUATED):
            inputs, labels = examples.take(rows, where)
            parts.append(model.predict(inputs, labels.task))
    fields = (torch.cat([getattr(part, name) for part in parts]).cpu() for name in ("move", "slots", "action", "angle"))
    return Predicted(*fields)


def batches(examples: Examples, size: int, seed: int) -> Iterator[Tensor]:
    """Yields rows (size,) of all points, in an order drawn from the seed, points of like length together."""
    generator = torch.Generator().manual_seed(seed)
    order = torch.randperm(len(examples), generator=generator)
    length = sum(
        (examples.inputs[name].sum(1) for name in ("move_mask", "utterance_mask", "action_mask", "objects_mask")),
        start=torch.zeros(len(examples), dtype=torch.int64),
    )
    parts = [part[length[part].argsort(stable=True)] for part in torch.split(order, _BUCKET * size)]
    rows = [batch for part in parts for batch in torch.split(part, size)]
    for place in torch.randperm(len(rows), generator=generator).tolist():
        yield rows[place]


class _Run:
    """Training in progress."""

    def __init__(self, model: Model, folder: Path, seed: int, about: Mapping[str, object]):
        self.model = model
        self.folder = folder
        self.seed = seed
        self.about = {**about, "seed": seed, "config": model.config.to_json()}
        self.device = device()
        model.to(self.device)
        config = model.config
        self.optimiser = torch.optim.AdamW(
            model.parameters(), lr=config.learning_rate, weight_decay=config.weight_decay, fused=True
        )
        on_gpu = self.device.type == "cuda"
        self.loss: Callable[[Inputs, Labels], Tensor] = (
            torch.compile(model.loss, dynamic=True) if on_gpu else model.loss
        )
        self.autocast = torch.autocast(self.device.type, torch.bfloat16, enabled=on_gpu)

    def resume(self) -> list[Epoch]:
        """Restores model and optimiser, and returns the epochs done before."""
        path = self.folder / LAST_FILE
        if not path.exists():
            return []
        written = checkpoints.about(path)
        for name, value in self.about.items():
            if written.get(name) != value:
                raise CheckpointError(f"{path}: was trained with another {name}; choose another folder or delete it")
        checkpoints.restore(path, self.model, self.optimiser)
        return [Epoch(**row) for row in written["epochs"]]

    def epoch(self, examples: Examples, number: int) -> float:
        """Trains on every point once; returns the mean loss."""
        self.model.train()
        total = torch.zeros((), device=self.device)
        for rows in batches(examples, self.model.config.batch_size, mixed_seed(self.seed, number)):
            inputs, labels = examples.take(rows, self.device)
            self.optimiser.zero_grad(set_to_none=True)
            with self.autocast:
                loss = self.loss(inputs, labels)
            backpropagate(loss)
            nn.utils.clip_grad_norm_(self.model.parameters(), self.model.config.clip)
            self.optimiser.step()
            total += loss.detach() * len(labels)
        return float(total) / len(examples)

    def evaluate(self, examples: Examples) -> float:
        """Returns the mean loss of points."""
        self.model.eval()
        total = 0.0
        with torch.inference_mode(), self.autocast:
            for rows in torch.split(torch.arange(len(examples)), _EVALUATED):
                inputs, labels = examples.take(rows, self.device)
                total += float(self.model.loss(inputs, labels)) * len(labels)
        return total / len(examples)

    def keep(self, epochs: list[Epoch], better: bool) -> None:
        """Writes the best weights first: after an interruption in between, the epoch is trained again."""
        if not math.isfinite(epochs[-1].training):
            raise FloatingPointError(
                f"{self.folder}: the loss is {epochs[-1].training} in epoch {len(epochs)}; lower the learning rate, "
                f"which is {self.model.config.learning_rate}"
            )
        if better:
            checkpoints.save(self.folder / BEST_FILE, self.model, {**self.about, "epoch": len(epochs)})
        about = {**self.about, "epochs": [asdict(epoch) for epoch in epochs]}
        checkpoints.save(self.folder / LAST_FILE, self.model, about, self.optimiser)


def _finished(epochs: list[Epoch], config: Schedule) -> bool:
    done = len(epochs)
    if done >= config.max_epochs:
        return True
    return done >= config.min_epochs and done - epochs[-1].best >= config.patience


def mixed_seed(seed: int, number: int) -> int:
    """Returns the seed of an epoch, uncorrelated with those of other epochs."""
    return int.from_bytes(hashlib.sha256(f"{seed}/{number}".encode()).digest()[:7], "little")


class _MemorySetting(Protocol):
    """Setting that torch adds to its module when it is imported."""

    fill_uninitialized_memory: bool


_MEMORY: Final = cast(_MemorySetting, torch.utils.deterministic)


class DeterministicAlgorithms:
    """Context in which torch uses deterministic algorithms, so that results do not depend on thread timing."""

    def __init__(self, where: torch.device):
        self._on = where.type == "cpu"
        self._before = torch.are_deterministic_algorithms_enabled()
        self._filled = _MEMORY.fill_uninitialized_memory

    def __enter__(self) -> None:
        if self._on:
            torch.use_deterministic_algorithms(True)
            _MEMORY.fill_uninitialized_memory = False  # no operation reads it; 7 % of the time

    def __exit__(self, *error: object) -> None:
        torch.use_deterministic_algorithms(self._before)
        _MEMORY.fill_uninitialized_memory = self._filled
