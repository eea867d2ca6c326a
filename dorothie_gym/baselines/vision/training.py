"""Training of vision models: epochs over pictures, resumable after an interruption with equal results."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import ClassVar, Protocol, TypeAlias

import torch
from torch import Tensor, nn

from dorothie_gym.baselines import checkpoints
from dorothie_gym.baselines.gradients import backpropagate
from dorothie_gym.baselines.trainer import BEST_FILE, LAST_FILE, DeterministicAlgorithms, mixed_seed
from dorothie_gym.errors import CheckpointError


class Schedule(Protocol):
    """Settings of the optimisation in a config."""

    @property
    def learning_rate(self) -> float: ...  # noqa: D102
    @property
    def weight_decay(self) -> float: ...  # noqa: D102
    @property
    def warm_up(self) -> float: ...  # noqa: D102
    @property
    def batch_size(self) -> int: ...  # noqa: D102
    @property
    def epochs(self) -> int: ...  # noqa: D102
    def to_json(self) -> dict[str, object]: ...  # noqa: D102


class Learner(ABC):
    """Model with its pictures.

    Attributes:
        model: the model, with initial weights.
        config: its settings.
        device: where it is trained.
        clip: largest norm of the gradient.
    """

    clip: ClassVar[float] = 1.0
    model: nn.Module
    config: Schedule
    device: torch.device

    @property
    @abstractmethod
    def pictures(self) -> int:
        """Number of training pictures."""

    @abstractmethod
    def loss(self, rows: Sequence[int], epoch: int) -> Tensor:
        """Returns the mean loss of the given training pictures in an epoch, counted from 0."""

    @abstractmethod
    def validate(self) -> Mapping[str, float]:
        """Returns figures of the validation pictures; the largest `score` is best."""

    def groups(self) -> list[tuple[list[nn.Parameter], float]]:
        """Returns the parameters in groups, with the factor of the learning rate of each."""
        return [(list(self.model.parameters()), 1.0)]


@dataclass(frozen=True, kw_only=True)
class VisionEpoch:
    """Pass over the training pictures.

    Attributes:
        number: number, from 1.
        loss: mean of its steps.
        figures: figures of the validation pictures after it.
        best: number of the epoch with the best score so far.
        seconds: processor time so far, over all calls [s].
    """

    number: int
    loss: float
    figures: Mapping[str, float]
    best: int
    seconds: float


OnStep: TypeAlias = Callable[[int, int, float], None]
"""Called with the numbers of finished and of all steps, and the loss."""


def train_learner(
    learner: Learner,
    folder: Path,
    *,
    seed: int,
    about: Mapping[str, object],
    clock: Callable[[], float],
    on_step: OnStep = lambda done, planned, loss: None,
) -> list[VisionEpoch]:
    """Trains a model, and leaves it with the weights of the epoch with the best validation score.

    On a CPU equal seeds give equal weights. After each epoch the state is written to the folder; after an interruption,
    a further call resumes there and reaches equal weights. A complete training is read, not repeated.

    Args:
        learner: model and pictures.
        folder: folder of this training only.
        seed: seed of the order of the pictures and of their changes.
        about: identity of the training in JSON types.
        clock: processor time [s].
        on_step: called after each step.

    Raises:
        CheckpointError: the folder holds another training.
        OSError: the folder cannot be written.
    """
    run = _Run(learner, folder, seed, about)
    with DeterministicAlgorithms(learner.device):
        epochs = run.resume()
        while len(epochs) < learner.config.epochs:
            number, begun = len(epochs), clock()
            torch.manual_seed(mixed_seed(seed, number))
            loss = run.epoch(number, on_step)
            learner.model.eval()
            with torch.inference_mode():
                figures = {name: value for name, value in learner.validate().items() if not math.isnan(value)}
            scores = [epoch.figures["score"] for epoch in epochs] + [figures["score"]]
            best = 1 + max(range(len(scores)), key=lambda k: scores[k])
            seconds = (epochs[-1].seconds if epochs else 0.0) + clock() - begun
            epochs.append(VisionEpoch(number=number + 1, loss=loss, figures=figures, best=best, seconds=seconds))
            run.keep(epochs)
    checkpoints.restore(folder / BEST_FILE, learner.model)
    learner.model.eval()
    return epochs


class _Run:
    """Training in progress."""

    def __init__(self, learner: Learner, folder: Path, seed: int, about: Mapping[str, object]) -> None:
        self._learner, self._folder, self._seed = learner, folder, seed
        self._about = {**about, "seed": seed, "config": learner.config.to_json()}
        config = learner.config
        self._steps = math.ceil(learner.pictures / config.batch_size)
        self._factors = [factor for _, factor in learner.groups()]
        parameters = [{"params": group} for group, _ in learner.groups()]
        self._optimiser = torch.optim.AdamW(
            parameters, lr=config.learning_rate, weight_decay=config.weight_decay, fused=True
        )

    def resume(self) -> list[VisionEpoch]:
        """Restores model and optimiser, and returns the epochs done before."""
        path = self._folder / LAST_FILE
        if not path.exists():
            return []
        written = checkpoints.about(path)
        for name, value in self._about.items():
            if written.get(name) != value:
                raise CheckpointError(f"{path}: was trained with another {name}; choose another folder or delete it")
        checkpoints.restore(path, self._learner.model, self._optimiser)
        return [VisionEpoch(**row) for row in written["epochs"]]

    def epoch(self, number: int, on_step: OnStep) -> float:
        """Trains on every picture once; returns the mean loss."""
        learner, config = self._learner, self._learner.config
        learner.model.train()
        generator = torch.Generator().manual_seed(mixed_seed(self._seed, number))
        order = torch.randperm(learner.pictures, generator=generator)
        losses = []
        for place, rows in enumerate(torch.split(order, config.batch_size)):
            step, planned = number * self._steps + place, self._steps * config.epochs
            for group, factor in zip(self._optimiser.param_groups, self._factors, strict=True):
                group["lr"] = config.learning_rate * factor * rate_at(step / planned, config.warm_up)
            self._optimiser.zero_grad(set_to_none=True)
            loss = learner.loss(rows.tolist(), number)
            backpropagate(loss)
            nn.utils.clip_grad_norm_(learner.model.parameters(), learner.clip)
            self._optimiser.step()
            losses.append(float(loss.detach()))
            on_step(step + 1, planned, losses[-1])
        mean = math.fsum(losses) / len(losses)
        if not math.isfinite(mean):
            raise FloatingPointError(
                f"{self._folder}: the loss is {mean} in epoch {number + 1}; lower the learning rate, which is "
                f"{config.learning_rate}"
            )
        return mean

    def keep(self, epochs: list[VisionEpoch]) -> None:
        """Writes the best weights first: after an interruption in between, the epoch is trained again."""
        if epochs[-1].best == epochs[-1].number:
            of_epoch = {"epoch": len(epochs), "figures": dict(epochs[-1].figures)}
            checkpoints.save(self._folder / BEST_FILE, self._learner.model, {**self._about, **of_epoch})
        about = {**self._about, "epochs": [asdict(epoch) for epoch in epochs]}
        checkpoints.save(self._folder / LAST_FILE, self._learner.model, about, self._optimiser)


def rate_at(share: float, warm_up: float) -> float:
    """Returns the factor of the learning rate at a share of the training: an even rise, then an even fall to 0."""
    if share < warm_up:
        return (share + 1e-3) / (warm_up + 1e-3)
    return (1.0 - share) / (1.0 - warm_up)
