"""Views of a car in brookside, made up."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.maps import Town, load_town
from dorothie_gym.ontology import Role
from dorothie_gym.policies.co_wizard.view import CoWizardView


@cache
def town() -> Town:
    return load_town("brookside")


@cache
def _first() -> CoWizardView:
    env = DuoWizardEnv(town())
    observations, _ = env.reset(seed=3)
    return CoWizardView.read(observations[str(Role.CO_WIZARD)], town())


def view(**changes: Any) -> CoWizardView:
    """Returns the first view of a Co-Wizard, with other values in some fields."""
    return replace(_first(), **changes)
