"""Players for the tests, which other processes find by their module."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from dorothie_gym.maps import Town
from dorothie_gym.ontology import Role
from dorothie_gym.policies import Policy, ScriptedCoWizard, SilentPolicy
from dorothie_gym.session.spaces import ActionDict, SpaceLimits, noop


class Fainting(SilentPolicy):
    """Gives up after ten decisions in towns where it has an even seed."""

    def initial_state(self, seed: int, town: object) -> Any:
        return [seed % 2, 0]

    def step(self, observation: Mapping[str, Any], state: Any) -> tuple[ActionDict, Any]:
        odd, count = state
        if not odd and count == 10:
            raise RuntimeError("I feel faint")
        action, _ = super().step(observation, None)
        return action, [odd, count + 1]


def load_fainting(path: Path, role: Role, limits: SpaceLimits) -> Policy[Any]:
    if path.read_text() != "faint":
        raise ValueError(f"{path}: is no fainting policy")
    return Fainting(role, limits)


class Forgetful(Policy[Any]):
    """The scripted Co-Wizard, which forgets to act at every seventh decision; its state counts them."""

    def __init__(self, limits: SpaceLimits) -> None:
        super().__init__(Role.CO_WIZARD, limits)
        self._policy = ScriptedCoWizard(limits)

    def initial_state(self, seed: int, town: Town) -> Any:
        return self._policy.initial_state(seed, town), 0

    def persona_of(self, state: Any) -> Mapping[str, float | str] | None:
        return self._policy.persona_of(state[0])

    def step(self, observation: Mapping[str, Any], state: Any) -> tuple[ActionDict, Any]:
        action, own = self._policy.step(observation, state[0])
        return (action if (state[1] + 1) % 7 else noop(self.role, self.limits)), (own, state[1] + 1)


def load_forgetful(path: Path, role: Role, limits: SpaceLimits) -> Policy[Any]:
    return Forgetful(limits)
