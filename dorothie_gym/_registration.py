"""Registration of the environments with Gymnasium and PettingZoo, by entry-point strings."""

from __future__ import annotations

import gymnasium
import pettingzoo


def register_environments() -> None:
    """Registers every environment id; the module behind an id is imported when an environment is made."""
    duo_wizard = "dorothie_gym.envs.duo_wizard_v0"
    pettingzoo.register("parallel", "dorothie_gym/DuoWizard-v0", f"{duo_wizard}:parallel_env")
    pettingzoo.register("aec", "dorothie_gym/DuoWizard-v0", f"{duo_wizard}:env")
    for view, role in (("Participant", "participant"), ("CoWizard", "co_wizard"), ("AdWizard", "ad_wizard")):
        gymnasium.register(
            f"dorothie_gym/{view}-v0", "dorothie_gym.envs.single_role_v0:SingleRole", kwargs={"role": role}
        )
    for task in ("UfN", "RfN", "NfD"):
        gymnasium.register(f"dorothie_gym/{task}-v0", f"dorothie_gym.envs.{task.lower()}_v0:{task}Env")
    gymnasium.register("dorothie_gym/Navigation-v0", "dorothie_gym.envs.navigation_v0:NavigationEnv")
    gymnasium.register(
        "dorothie_gym/Navigation-continuous-v0",
        "dorothie_gym.envs.navigation_continuous_v0:NavigationContinuousEnv",
    )
    gymnasium.register(
        "dorothie_gym/Town-v0",
        "dorothie_gym.envs.town_v0:TownEnv",
        vector_entry_point="dorothie_gym.sim.batch.town_vector_env:TownVectorEnv",
    )
