"""Measures what the scripted three promise: errands done by talk, through noise and by words alone.

`python -m tests.evaluation.rollout.promises --sessions 100` plays sessions in all towns that are shipped, exceptions
included; `--word-errors 0.1` with a recogniser between the two, `--text-only` without acts, `--cut` with nothing
getting through. Prints one line of JSON.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.evaluation.rollout import SessionPlan, plan_corpus, play_session
from dorothie_gym.evaluation.rollout.processes import run_tasks
from dorothie_gym.maps import Town
from dorothie_gym.ontology import AGENT_ROLES, Role
from dorothie_gym.policies import Policy, make_policy
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.spaces import NO_MOVE, ActionDict


class Mute(Policy[Any]):
    """Acts as another policy, but nothing that it says leaves its mouth."""

    def __init__(self, policy: Policy[Any]) -> None:
        super().__init__(policy.role, policy.limits)
        self._policy = policy

    def initial_state(self, seed: int, town: Town) -> Any:
        return self._policy.initial_state(seed, town)

    def step(self, observation: Mapping[str, Any], state: Any) -> tuple[ActionDict, Any]:
        action, state = self._policy.step(observation, state)
        return {**action, "move": NO_MOVE, "utterance": ""}, state


@dataclass(frozen=True, kw_only=True)
class Promise:
    """Plays sessions under conditions; towns are kept.

    Attributes:
        config: of the environment.
        cut: whether what the participant and the Co-Wizard say gets lost.
    """

    config: EnvConfig
    cut: bool = False

    def __call__(self, plan: SessionPlan) -> tuple[str, dict[str, Any]]:
        env = _env(plan.town, self.config)
        policies = {role: make_policy("scripted", role, env.limits) for role in AGENT_ROLES}
        if self.cut:
            policies |= {role: Mute(policies[role]) for role in (Role.PARTICIPANT, Role.CO_WIZARD)}
        return plan.town, play_session(env, policies, seed=plan.seed)


_ENVS: dict[tuple[str, EnvConfig], DuoWizardEnv] = {}


def _env(town: str, config: EnvConfig) -> DuoWizardEnv:
    if (town, config) not in _ENVS:
        _ENVS[town, config] = DuoWizardEnv(town, config=config)
    return _ENVS[town, config]


def success(promise: Promise, *, sessions: int, seed: int = 0, workers: int = 1) -> dict[str, Any]:
    """Plays sessions and returns the share of successes, and which sessions failed and how.

    Args:
        promise: the conditions.
        sessions: how many; towns and seeds as those of a corpus.
        seed: of the corpus.
        workers: processes that play.
    """
    plans = plan_corpus(sessions, seed)
    played = list(run_tasks(partial(_same, promise), plans, workers=workers))
    failed = [
        {"town": town, "subgoals": ended["subgoals"], "collisions": ended["collisions"], "seconds": ended["seconds"]}
        for town, ended in played
        if not ended["success"]
    ]
    utterances = sum(ended["utterances"] for _, ended in played)
    return {
        "sessions": sessions,
        "success": 1 - len(failed) / sessions,
        "utterances": round(utterances / sessions, 1),
        "seconds": round(sum(ended["seconds"] for _, ended in played) / sessions, 1),
        "failed": failed,
    }


def _same(promise: Promise) -> Promise:
    return promise


def main() -> None:
    """Measures what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sessions", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--word-errors", type=float, default=EnvConfig.word_error_rate)
    parser.add_argument("--text-only", action="store_true")
    parser.add_argument("--cut", action="store_true")
    asked = parser.parse_args()
    config = EnvConfig(observe_acts=not asked.text_only, word_error_rate=asked.word_errors)
    found = success(
        Promise(config=config, cut=asked.cut), sessions=asked.sessions, seed=asked.seed, workers=asked.workers
    )
    print(json.dumps(found))


if __name__ == "__main__":
    main()
