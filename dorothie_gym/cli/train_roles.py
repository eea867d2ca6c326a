"""`dorothie-gym train` for the learned roles: co-wizard and participant."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

from dorothie_gym.cli.completion import ROLE_MODELS
from dorothie_gym.cli.output import exit_interrupted, print_json, stage_progress, stdout
from dorothie_gym.support.processors import available_processors

if TYPE_CHECKING:
    from dorothie_gym.baselines.roles.learned_role.dagger import FinishedFit

OnStage = Callable[[str, int, int], None]


@dataclass(frozen=True, kw_only=True)
class Request:
    """Role to train, and the settings of its training.

    Attributes:
        corpus: folder of the corpus.
        out: folder of the trainings.
        seed: seed.
        workers: number of processes.
        on_stage: callback for the progress.
    """

    corpus: Path
    out: Path
    seed: int
    workers: int
    on_stage: OnStage

    def folder(self, model: str) -> Path:
        """Returns the folder of the training of a model."""
        return self.out / model / f"seed-{self.seed}"


@dataclass(frozen=True, kw_only=True)
class RoleReport:
    """Report of a training.

    Attributes:
        role: the role's option in `rollout`.
        lines: lines to be printed.
        figures: figures in JSON types.
    """

    role: str
    lines: tuple[str, ...]
    figures: Mapping[str, object]


def _train_co_wizard(request: Request) -> RoleReport:
    from dorothie_gym.baselines.roles.co_wizard.demonstrations import CoWizardTraining
    from dorothie_gym.baselines.roles.co_wizard.training import train_co_wizard
    from dorothie_gym.baselines.roles.learned_role.dagger import LESSONS

    folder = request.folder("co-wizard")
    settings = CoWizardTraining(corpus=request.corpus, seed=request.seed)
    stages = train_co_wizard(
        settings, folder, workers=request.workers, on_stage=request.on_stage, lessons=folder.parent / LESSONS
    )
    return _fits("co-wizard", stages)


def _train_participant(request: Request) -> RoleReport:
    from dorothie_gym.baselines.roles.learned_role.dagger import LESSONS, RoundSettings
    from dorothie_gym.baselines.roles.participant.training import train_participant

    folder = request.folder("participant")
    settings = RoundSettings(corpus=request.corpus, seed=request.seed)
    stages = train_participant(
        settings, folder, workers=request.workers, on_stage=request.on_stage, lessons=folder.parent / LESSONS
    )
    return _fits("participant", stages)


def _fits(role: str, stages: Sequence[FinishedFit]) -> RoleReport:
    return RoleReport(
        role=role,
        lines=tuple(f"{one.name}: {one.examples:,} examples, loss {one.loss:.3f}" for one in stages),
        figures={"fits": [{"model": one.name, "examples": one.examples, "loss": one.loss} for one in stages]},
    )


ROLES: Final[Mapping[str, Callable[[Request], RoleReport]]] = MappingProxyType(
    dict(zip(ROLE_MODELS, (_train_co_wizard, _train_participant), strict=True))
)
"""Training of each learned role by the name of the model."""


def train_role(model: str, corpus: Path, out: Path, *, seeds: int, workers: int | None, as_json: bool) -> None:
    """Trains players of a role with several seeds, each in a folder of its own, and prints how to play them."""
    found: list[tuple[Path, RoleReport]] = []
    try:
        with stage_progress(quiet=as_json) as on_stage:
            for seed in range(seeds):
                request = Request(
                    corpus=corpus, out=out, seed=seed, workers=workers or available_processors(), on_stage=on_stage
                )
                found.append((request.folder(model), ROLES[model](request)))
    except KeyboardInterrupt:
        exit_interrupted(f"Interrupted with {len(found)} of {seeds} trainings finished; resume with the same command.")
    if as_json:
        runs = [{"folder": str(folder), **report.figures} for folder, report in found]
        print_json({"model": model, "corpus": str(corpus), "runs": runs})
        return
    for folder, report in found:
        play = f"Play: dorothie-gym rollout --{report.role} {shlex.quote(str(folder))}"
        for line in (*report.lines, play):
            stdout().print(line, markup=False, soft_wrap=True)
