"""Sessions with language models, played in the tests."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path

from dorothie_gym.evaluation.rollout.play import play_session
from dorothie_gym.ontology import AGENT_ROLES, Role
from dorothie_gym.policies import make_policy
from dorothie_gym.policies.language_model import LanguageModelConfig, LanguageModelPolicy
from dorothie_gym.policies.language_model.cassette import Reply
from dorothie_gym.policies.language_model.language_model import LanguageModel, Prompt
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.session.session_log import SessionSummary

NOWHERE = LanguageModelConfig(model="reader", url="http://127.0.0.1:9/v1")


class PromptModel(LanguageModel):
    """Model in this process: a function of the text of a prompt; keeps what it was asked and what it answered."""

    def __init__(self, answer: Callable[[str], Mapping[str, str]], latency: float = 0.0) -> None:
        self.answer, self.latency = answer, latency
        self.asked: list[tuple[Prompt, Mapping[str, str]]] = []

    def ask(self, prompt: Prompt) -> Reply:
        answer = self.answer(prompt.text)
        self.asked.append((prompt, answer))
        return Reply(answer=json.dumps(answer), latency=self.latency)


def play(
    models: Mapping[Role, LanguageModelConfig | tuple[LanguageModelConfig, LanguageModel]],
    *,
    town: str = "brookside",
    seed: int = 3,
    config: EnvConfig | None = None,
    folder: Path | None = None,
    on_step: Callable[[SessionEngine], None] | None = None,
    others: str = "scripted",
) -> SessionSummary:
    """Plays a session in which some roles ask a model, and the others follow a policy."""
    engine = SessionEngine(town, config=config)
    policies = {role: make_policy(others, role, engine.limits) for role in AGENT_ROLES}
    for role, given in models.items():
        settings, model = given if isinstance(given, tuple) else (given, None)
        policies[role] = LanguageModelPolicy(role, settings, engine.limits, model)
    return play_session(engine, policies, seed=seed, folder=folder, on_step=on_step)
