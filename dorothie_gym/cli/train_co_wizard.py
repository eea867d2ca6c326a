"""`dorothie-gym train co-wizard`: training of the learned Co-Wizard by imitation and practice."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

from dorothie_gym.cli.output import exit_interrupted, print_json, stage_progress, stdout

if TYPE_CHECKING:
    from dorothie_gym.baselines.co_wizard.training import Stage

CO_WIZARD: Final = "co-wizard"
"""Command of the model."""


def train_co_wizard(corpus: Path, out: Path, *, seeds: int, workers: int | None, as_json: bool) -> None:
    """Trains Co-Wizards with several seeds, each in a folder of its own, and prints how to play them."""
    from dorothie_gym.baselines.co_wizard import training
    from dorothie_gym.processors import available_processors

    found: list[tuple[Path, Sequence[Stage]]] = []
    try:
        with stage_progress(quiet=as_json) as on_stage:
            for seed in range(seeds):
                folder = out / CO_WIZARD / f"seed-{seed}"
                settings = training.CoWizardTraining(corpus=corpus, seed=seed)
                fits = training.train_co_wizard(
                    settings, folder, workers=workers or available_processors(), on_stage=on_stage
                )
                found.append((folder, fits))
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
        print_json({"model": CO_WIZARD, "corpus": str(corpus), "runs": runs})
        return
    for folder, stages in found:
        for one in stages:
            stdout().print(f"{one.name}: {one.examples:,} examples, loss {one.loss:.3f}", markup=False, soft_wrap=True)
        stdout().print(
            f"Play: dorothie-gym rollout --co-wizard {shlex.quote(str(folder))}", markup=False, soft_wrap=True
        )  # fmt: skip
