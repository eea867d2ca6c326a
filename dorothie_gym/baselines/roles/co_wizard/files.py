"""Files of the learned Co-Wizard."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from dorothie_gym.baselines.roles.co_wizard.network import CoWizardLayout, CoWizardNetwork
from dorothie_gym.baselines.roles.co_wizard.remarks import check_form
from dorothie_gym.baselines.roles.learned_role.model_files import ModelFiles, RoleModelPage


@dataclass(frozen=True, kw_only=True)
class CoWizardModelPage(RoleModelPage):
    """Content of `model.json`.

    Attributes:
        layout: lengths of inputs and outputs.
    """

    layout: CoWizardLayout


FILES: Final = ModelFiles(
    kind="co-wizard",
    version=2,
    page=CoWizardModelPage,
    layout=CoWizardLayout.of,
    make=CoWizardNetwork,
    check_form=check_form,
)
