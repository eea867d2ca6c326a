"""`dorothie-gym train co-wizard` and `train participant`: training of a learned role by imitation and practice."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Final, Protocol

from dorothie_gym.cli.output import exit_interrupted, print_json, stage_progress, stdout

OnStage = Callable[[str, int, int], None]


class Fit(Protocol):
    """A fit of a network: the name of its model's folder, its number of examples, and its loss."""

    @property
    def name(self) -> str:
        """Name of the folder."""
        ...

    @property
    def examples(self) -> int:
        """Number of examples."""
        ...

    @property
    def loss(self) -> float:
        """Mean loss of the last pass [nats]."""
        ...


def _train_co_wizard(corpus: Path, folder: Path, seed: int, workers: int, on_stage: OnStage) -> Sequence[Fit]:
    from dorothie_gym.baselines.co_wizard.training import CoWizardTraining, train_co_wizard
    from dorothie_gym.baselines.imitation.rounds import LESSONS

    settings = CoWizardTraining(corpus=corpus, seed=seed)
    return train_co_wizard(settings, folder, workers=workers, on_stage=on_stage, lessons=folder.parent / LESSONS)


def _train_participant(corpus: Path, folder: Path, seed: int, workers: int, on_stage: OnStage) -> Sequence[Fit]:
    from dorothie_gym.baselines.imitation.rounds import LESSONS, RoundSettings
    from dorothie_gym.baselines.participant.training import train_participant

    settings = RoundSettings(corpus=corpus, seed=seed)
    lessons = folder.parent / LESSONS
    return train_participant(settings, folder, workers=workers, on_stage=on_stage, lessons=lessons)


ROLES: Final[Mapping[str, Callable[[Path, Path, int, int, OnStage], Sequence[Fit]]]] = MappingProxyType(
    {"co-wizard": _train_co_wizard, "participant": _train_participant}
)
"""Training of each role by the name of the model, which is that of its option in `rollout` as well."""


def train_role(model: str, corpus: Path, out: Path, *, seeds: int, workers: int | None, as_json: bool) -> None:
    """Trains players of a role with several seeds, each in a folder of its own, and prints how to play them."""
    from dorothie_gym.processors import available_processors

    found: list[tuple[Path, Sequence[Fit]]] = []
    try:
        with stage_progress(quiet=as_json) as on_stage:
            for seed in range(seeds):
                folder = out / model / f"seed-{seed}"
                found.append((folder, ROLES[model](corpus, folder, seed, workers or available_processors(), on_stage)))
    except KeyboardInterrupt:
        exit_interrupted(f"Interrupted with {len(found)} of {seeds} trainings finished; resume with the same command.")
    if as_json:
        runs = [
            {
                "folder": str(folder),
                "fits": [{"model": one.name, "examples": one.examples, "loss": one.loss} for one in stages],
            }
            for folder, stages in found
        ]
        print_json({"model": model, "corpus": str(corpus), "runs": runs})
        return
    for folder, stages in found:
        for one in stages:
            stdout().print(f"{one.name}: {one.examples:,} examples, loss {one.loss:.3f}", markup=False, soft_wrap=True)
        stdout().print(
            f"Play: dorothie-gym rollout --{model} {shlex.quote(str(folder))}", markup=False, soft_wrap=True
        )  # fmt: skip
