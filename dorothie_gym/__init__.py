"""Environments in which a human, a driving wizard and an adversary talk while a car drives through a town.

Importing the package registers its environments with Gymnasium and PettingZoo; nothing slow to import is loaded until
a name below is used or an environment is made.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

import gymnasium
import pettingzoo

if TYPE_CHECKING:
    from dorothie_gym.benchmark.teacher_forced import NfDEnv, RfNEnv, UfNEnv
    from dorothie_gym.engine.config import EnvConfig, RewardWeights
    from dorothie_gym.engine.scenario import Scenario, draw_scenario
    from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
    from dorothie_gym.envs.navigation_config import NavigationWeights
    from dorothie_gym.envs.navigation_continuous_v0 import NavigationContinuousEnv
    from dorothie_gym.envs.navigation_v0 import NavigationEnv
    from dorothie_gym.envs.single_role_v0 import SingleRole
    from dorothie_gym.maps import Town, load_town
    from dorothie_gym.ontology import Role
    from dorothie_gym.policies import Policy, make_policy
    from dorothie_gym.policies.navigation import NavigationAction
    from dorothie_gym.recording import Session, load_sessions
    from dorothie_gym.sim.config import WorldConfig
    from dorothie_gym.sim.town_env import TownEnv
    from dorothie_gym.spaces import SpaceLimits, noop
    from dorothie_gym.tasks import load_template, template_names
    from dorothie_gym.wrappers.flatten import FlattenAction, FlattenObservation, flatten
    from dorothie_gym.wrappers.identical_spaces import IdenticalSpaces
    from dorothie_gym.wrappers.record_session import RecordSession
    from dorothie_gym.wrappers.teacher_forcing import TeacherForcing

__version__ = "0.1.0"

_HOME = {
    "DuoWizardEnv": "envs.duo_wizard_v0",
    "EnvConfig": "engine.config",
    "FlattenAction": "wrappers.flatten",
    "FlattenObservation": "wrappers.flatten",
    "IdenticalSpaces": "wrappers.identical_spaces",
    "NavigationAction": "policies.navigation",
    "NavigationContinuousEnv": "envs.navigation_continuous_v0",
    "NavigationEnv": "envs.navigation_v0",
    "NavigationWeights": "envs.navigation_config",
    "NfDEnv": "benchmark.teacher_forced",
    "Policy": "policies",
    "RecordSession": "wrappers.record_session",
    "RewardWeights": "engine.config",
    "RfNEnv": "benchmark.teacher_forced",
    "Role": "ontology",
    "Scenario": "engine.scenario",
    "Session": "recording",
    "SingleRole": "envs.single_role_v0",
    "SpaceLimits": "spaces",
    "TeacherForcing": "wrappers.teacher_forcing",
    "Town": "maps",
    "TownEnv": "sim.town_env",
    "UfNEnv": "benchmark.teacher_forced",
    "WorldConfig": "sim.config",
    "draw_scenario": "engine.scenario",
    "flatten": "wrappers.flatten",
    "load_sessions": "recording",
    "load_template": "tasks",
    "load_town": "maps",
    "make_policy": "policies",
    "noop": "spaces",
    "template_names": "tasks",
}
"""The module that each public name comes from, imported when the name is first used."""

__all__ = [
    "DuoWizardEnv",
    "EnvConfig",
    "FlattenAction",
    "FlattenObservation",
    "IdenticalSpaces",
    "NavigationAction",
    "NavigationContinuousEnv",
    "NavigationEnv",
    "NavigationWeights",
    "NfDEnv",
    "Policy",
    "RecordSession",
    "RewardWeights",
    "RfNEnv",
    "Role",
    "Scenario",
    "Session",
    "SingleRole",
    "SpaceLimits",
    "TeacherForcing",
    "Town",
    "TownEnv",
    "UfNEnv",
    "WorldConfig",
    "__version__",
    "draw_scenario",
    "flatten",
    "load_sessions",
    "load_template",
    "load_town",
    "make_policy",
    "noop",
    "template_names",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


def _register() -> None:
    """Makes the environments known by their ids; the code behind an id is imported when one is made."""
    duo_wizard = "dorothie_gym.envs.duo_wizard_v0"
    pettingzoo.register("parallel", "dorothie_gym/DuoWizard-v0", f"{duo_wizard}:parallel_env")
    pettingzoo.register("aec", "dorothie_gym/DuoWizard-v0", f"{duo_wizard}:env")
    for view, role in (("Participant", "participant"), ("CoWizard", "co_wizard"), ("AdWizard", "ad_wizard")):
        gymnasium.register(
            f"dorothie_gym/{view}-v0", "dorothie_gym.envs.single_role_v0:SingleRole", kwargs={"role": role}
        )
    for task in ("UfN", "RfN", "NfD"):
        gymnasium.register(f"dorothie_gym/{task}-v0", f"dorothie_gym.benchmark.teacher_forced:{task}Env")
    gymnasium.register("dorothie_gym/Navigation-v0", "dorothie_gym.envs.navigation_v0:NavigationEnv")
    gymnasium.register(
        "dorothie_gym/Navigation-continuous-v0",
        "dorothie_gym.envs.navigation_continuous_v0:NavigationContinuousEnv",
    )
    gymnasium.register(
        "dorothie_gym/Town-v0",
        "dorothie_gym.sim.town_env:TownEnv",
        vector_entry_point="dorothie_gym.sim.batch.town_vector_env:TownVectorEnv",
    )


_register()
