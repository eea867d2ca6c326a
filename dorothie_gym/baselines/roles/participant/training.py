"""Training of the learned participant: imitation of a corpus, then rounds of practice beside the teacher."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

from dorothie_gym.baselines.roles.learned_role.training import LearnedRole, train_role
from dorothie_gym.baselines.roles.participant.demonstrations import follow, practise
from dorothie_gym.baselines.roles.participant.examples import ParticipantExamples
from dorothie_gym.baselines.roles.participant.files import FILES
from dorothie_gym.baselines.roles.participant.fitting import loss_of

if TYPE_CHECKING:
    from dorothie_gym.baselines.roles.learned_role.rounds import FinishedFit, OnStage, RoundSettings

PARTICIPANT: Final = LearnedRole(
    files=FILES, examples=ParticipantExamples, loss=loss_of, follow=follow, practise=practise, branch=31
)
"""The learned participant."""


def train_participant(
    settings: RoundSettings, out: Path, *, workers: int, on_stage: OnStage, lessons: Path | None = None
) -> tuple[FinishedFit, ...]:
    """Trains a participant; a started training is resumed. See `train_in_rounds`."""
    return train_role(PARTICIPANT, settings, out, workers=workers, on_stage=on_stage, lessons=lessons)
