"""Trainings side by side: each process has one thread, so that what comes out is the same however many there are."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, TypeAlias

import torch

from dorothie_gym.baselines.material import Material
from dorothie_gym.baselines.rows import SIZES
from dorothie_gym.baselines.runs import Job, run
from dorothie_gym.baselines.training.trainer import Epoch
from dorothie_gym.rollout.processes import run_tasks

OnEpoch: TypeAlias = Callable[[Job, Epoch], None]
"""Is told of each epoch of each job that runs in the calling process."""


def run_jobs(
    jobs: Sequence[Job], workers: int, on_epoch: OnEpoch = lambda job, epoch: None
) -> Iterator[tuple[Job, dict[str, Any]]]:
    """Runs jobs of one corpus, as many at a time as there are workers, and yields what comes of them as it comes.

    Models of the published sizes take all cores, or the GPU, by themselves: they run one after another in this process.

    Args:
        jobs: what is to be trained.
        workers: processes; with 1 everything happens in this one.
        on_epoch: is told of each epoch that happens in this process.

    Raises:
        CheckpointError: in the folder of a job lies another training.
        ProcessError: a job failed in another process.
        EncoderError: the encoder is not here.
        SessionError: the corpus cannot be read.
        OSError: a folder cannot be written.
    """
    if not jobs:
        return
    alone = workers <= 1 or len(jobs) == 1 or any(_is_large(job) for job in jobs)
    threads = torch.get_num_threads()
    trainer = _Trainer(jobs[0].corpus, jobs[0].encoder)
    if not alone:
        _ = trainer.load().vectors  # the others find them in the cache
        yield from run_tasks(trainer.prepare, jobs, workers=min(workers, len(jobs)))
        return
    material = trainer.load()
    try:
        for job in jobs:
            torch.set_num_threads(threads if _is_large(job) else 1)
            yield job, run(job, material, partial(on_epoch, job))
    finally:
        torch.set_num_threads(threads)


@dataclass(frozen=True)
class _Trainer:
    """What a process needs in order to train."""

    corpus: Path
    encoder: str

    def load(self) -> Material:
        return Material.load(self.corpus, self.encoder)

    def prepare(self) -> Callable[[Job], tuple[Job, dict[str, Any]]]:
        torch.set_num_threads(1)
        material = self.load()
        return lambda job: (job, run(job, material))


def _is_large(job: Job) -> bool:
    return torch.cuda.is_available() or SIZES[job.size]().width > SIZES["small"]().width
