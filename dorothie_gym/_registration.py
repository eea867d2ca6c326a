"""Registration of the environments with Gymnasium and PettingZoo, by entry-point strings."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Final

import gymnasium
import pettingzoo

NAMESPACE: Final = "dorothie_gym"
_ENVS: Final = "dorothie_gym.envs"


@dataclass(frozen=True, kw_only=True)
class RegisteredEnvironment:
    """Environment and its registration.

    Attributes:
        name: id without namespace.
        entry_point: "module:class".
        description: task of the agent.
        kwargs: arguments that the id sets.
        parallel: whether it is an environment of PettingZoo, with the agents in parallel and alternating (AEC).
        vector_entry_point: "module:class" of the vectorised environment.
        reward_threshold: mean return that counts as solved.
    """

    name: str
    entry_point: str
    description: str
    kwargs: Mapping[str, str] = field(default_factory=dict)
    parallel: bool = False
    vector_entry_point: str | None = None
    reward_threshold: float | None = None

    @property
    def id(self) -> str:
        """Id with namespace."""
        return f"{NAMESPACE}/{self.name}"

    @property
    def api(self) -> str:
        """Library whose interface it implements."""
        return "PettingZoo" if self.parallel else "Gymnasium"

    @property
    def call(self) -> str:
        """Python expression that makes it."""
        return f'pettingzoo.make("parallel", "{self.id}")' if self.parallel else f'gymnasium.make("{self.id}")'


_ROLES: Final = (
    ("Participant", "participant", "guide the Co-Wizard by speech to the places of the errands"),
    ("CoWizard", "co_wizard", "drive the car and talk to the participant"),
    ("AdWizard", "ad_wizard", "change weather, traffic, sensors and errands"),
)
_TASKS: Final = (
    ("UfN", "Infer move and slots of the participant's utterances in recorded sessions"),
    ("RfN", "Predict move and slots of the Co-Wizard's next utterance in recorded sessions"),
    ("NfD", "Predict the Co-Wizard's next navigation action in recorded sessions"),
)

DRIVING_SOLVED: Final = 20.0
"""Mean return of `Navigation-v0` with its default arguments that counts as solved.

A driver that obeys every instruction has a mean return of 20.4 in the sessions of seeds 0 to 39, and succeeds in all.
"""


def environments() -> Iterator[RegisteredEnvironment]:
    """Yields the environments of the package."""
    yield RegisteredEnvironment(
        name="DuoWizard-v0",
        entry_point=f"{_ENVS}.duo_wizard_v0",
        description="Play all three roles: participant, Co-Wizard and Ad-Wizard.",
        parallel=True,
    )
    for name, role, verb in _ROLES:
        yield RegisteredEnvironment(
            name=f"{name}-v0",
            entry_point=f"{_ENVS}.single_role_v0:SingleRole",
            description=f"Play the {name.replace('Wizard', '-Wizard') if 'Wizard' in name else role}: {verb}.",
            kwargs={"role": role},
        )
    yield RegisteredEnvironment(
        name="Navigation-v0",
        entry_point=f"{_ENVS}.navigation_v0:NavigationEnv",
        vector_entry_point=f"{_ENVS}.navigation_vector_env:NavigationVectorEnv",
        description="Drive with given directions, by discrete actions.",
        reward_threshold=DRIVING_SOLVED,
    )
    yield RegisteredEnvironment(
        name="Navigation-continuous-v0",
        entry_point=f"{_ENVS}.navigation_continuous_v0:NavigationContinuousEnv",
        vector_entry_point=f"{_ENVS}.navigation_continuous_vector_env:NavigationContinuousVectorEnv",
        description="Drive with given directions, by throttle, steering and brake.",
    )
    for name, verb in _TASKS:
        yield RegisteredEnvironment(
            name=f"{name}-v0",
            entry_point=f"{_ENVS}.{name.lower()}_v0:{name}Env",
            description=f"{verb}.",
        )
    yield RegisteredEnvironment(
        name="Town-v0",
        entry_point=f"{_ENVS}.town_v0:TownEnv",
        description="Drive among traffic in highway-env, without roles, dialogue and errands.",
    )


def environment_ids() -> list[str]:
    """Returns the ids of the environments."""
    return [env.id for env in environments()]


def register_environments() -> None:
    """Registers every environment id; the module behind an id is imported when an environment is made."""
    for env in environments():
        if env.parallel:
            pettingzoo.register("parallel", env.id, f"{env.entry_point}:parallel_env")
            pettingzoo.register("aec", env.id, f"{env.entry_point}:env")
            continue
        gymnasium.register(
            env.id,
            env.entry_point,
            kwargs=dict(env.kwargs),
            vector_entry_point=env.vector_entry_point,
            reward_threshold=env.reward_threshold,
        )
