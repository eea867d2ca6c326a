"""Policies of the three roles that ask a language model, by any endpoint with OpenAI's chat interface.

A policy turns the observation of its role into a prompt, asks for JSON under a schema made from the action space and
its mask, and turns the answer into actions (docs/language-models.md). The package httpx (extra `llm`) is imported when
the first policy is made.
"""

from dorothie_gym.policies.language_model.config import LanguageModelConfig, SimulatedTime
from dorothie_gym.policies.language_model.faults import Fault
from dorothie_gym.policies.language_model.policy import LanguageModelPolicy
from dorothie_gym.policies.language_model.usage import ModelUsage

__all__ = [
    "Fault",
    "LanguageModelConfig",
    "LanguageModelPolicy",
    "ModelUsage",
    "SimulatedTime",
]
