"""Source of a language model's policy in commands and rollouts: its name and settings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from dorothie_gym.ontology import Role
from dorothie_gym.policies.language_model.config import LanguageModelConfig
from dorothie_gym.policies.language_model.policy import LanguageModelPolicy
from dorothie_gym.policies.policy_loader import Player
from dorothie_gym.spaces import SpaceLimits

LANGUAGE_MODEL: Final = "llm:"
"""Beginning of the name of a policy that asks a language model; the name of the model follows."""


@dataclass(frozen=True, kw_only=True)
class LanguageModelPlayer(Player):
    """Source of a role's policy that asks a language model; can be sent to other processes.

    Attributes:
        config: settings; the name of the player is "llm:" and the name of the model.
    """

    config: LanguageModelConfig

    @classmethod
    def of(cls, config: LanguageModelConfig) -> LanguageModelPlayer:
        """Returns the player of a model."""
        return cls(name=LANGUAGE_MODEL + config.model, config=config)

    def make(self, role: Role, limits: SpaceLimits) -> LanguageModelPolicy:
        """Returns the policy; raises `PolicyLoadError` if httpx is missing or the cassette cannot be read."""
        return LanguageModelPolicy(role, self.config, limits)

    def settings(self) -> dict[str, object]:
        """Returns in JSON types what the sessions follow from besides the name."""
        return self.config.record()
