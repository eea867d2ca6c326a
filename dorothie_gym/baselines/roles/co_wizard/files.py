"""Files of the learned Co-Wizard: weights in safetensors, everything else in JSON."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final

import torch

from dorothie_gym.baselines.roles.co_wizard.network import CoWizardNetwork, Layout
from dorothie_gym.baselines.roles.co_wizard.remarks import check_form
from dorothie_gym.baselines.roles.learned_role.model_files import RoleModelPage, load_model, save_model

KIND: Final = "co-wizard"
"""Kind of the model in `model.json`; `policy_loader` selects the loader by it."""

MODEL_FORMAT: Final = 2


@dataclass(frozen=True, kw_only=True)
class ModelPage(RoleModelPage):
    """Content of `model.json`.

    Attributes:
        layout: lengths of inputs and outputs.
    """

    layout: Layout


def save_network(network: CoWizardNetwork, page: ModelPage, folder: Path) -> None:
    """Writes a model into a folder, in half precision; an older one stays whole until it is replaced."""
    save_model(network, page, folder, torch.float16)


def load_network(folder: Path) -> tuple[CoWizardNetwork, ModelPage]:
    """Reads a model from its folder, or from `model.json` in it.

    Raises:
        ModelFileError: a file is missing, damaged, or of another version.
    """
    return load_model(folder, ModelPage, KIND, MODEL_FORMAT, make=_network, check_form=check_form)


def _network(page: ModelPage) -> CoWizardNetwork | None:
    return CoWizardNetwork(page.layout) if page.layout == Layout.of(len(page.vocabulary)) else None
