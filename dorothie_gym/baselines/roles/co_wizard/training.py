"""Training of the learned Co-Wizard: imitation of a corpus, then rounds of practice beside the teacher."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

from dorothie_gym.baselines.roles.co_wizard.demonstrations import CoWizardTraining, follow, practise
from dorothie_gym.baselines.roles.co_wizard.examples import CoWizardExamples
from dorothie_gym.baselines.roles.co_wizard.files import FILES
from dorothie_gym.baselines.roles.co_wizard.fitting import loss_of
from dorothie_gym.baselines.roles.learned_role.training import LearnedRole, train_role

if TYPE_CHECKING:
    from dorothie_gym.baselines.roles.learned_role.rounds import FinishedFit, OnStage

CO_WIZARD: Final = LearnedRole(
    files=FILES, examples=CoWizardExamples, loss=loss_of, follow=follow, practise=practise, branch=29, at_once=16
)
"""The learned Co-Wizard."""


def train_co_wizard(
    settings: CoWizardTraining, out: Path, *, workers: int, on_stage: OnStage, lessons: Path | None = None
) -> tuple[FinishedFit, ...]:
    """Trains a Co-Wizard; a started training is resumed. See `train_in_rounds`."""
    return train_role(CO_WIZARD, settings, out, workers=workers, on_stage=on_stage, lessons=lessons)
