"""Files of a learned participant."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from dorothie_gym.baselines.roles.learned_role.model_files import ModelFiles, RoleModelPage
from dorothie_gym.baselines.roles.participant.network import ParticipantLayout, ParticipantNetwork
from dorothie_gym.baselines.roles.participant.remarks import check_form


@dataclass(frozen=True, kw_only=True)
class ParticipantModelPage(RoleModelPage):
    """Content of `model.json`.

    Attributes:
        layout: lengths of inputs and outputs.
    """

    layout: ParticipantLayout


FILES: Final = ModelFiles(
    kind="participant",
    version=1,
    page=ParticipantModelPage,
    layout=ParticipantLayout.of,
    make=ParticipantNetwork,
    check_form=check_form,
)
