"""Short sessions of policies, with their actions and events."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.ontology import Role
from dorothie_gym.policies import Policy, make_policy
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.recording import Event


@dataclass
class Played:
    env: DuoWizardEnv
    events: list[Event] = field(default_factory=list)
    actions: list[dict[str, Any]] = field(default_factory=list)
    observations: list[dict[str, Any]] = field(default_factory=list)

    def moves(self, speaker: Role) -> list[str]:
        return [
            str(event.data["move"]) for event in self.events if event.type == "DialogueMove" and event.source is speaker
        ]


def play(
    seed: int,
    *,
    decisions: int = 10_000,
    names: dict[str, str] | None = None,
    policies: dict[str, Policy[Any]] | None = None,
    config: EnvConfig | None = None,
    town: str = "brookside",
    storyboard: str | None = None,
) -> Played:
    env = DuoWizardEnv(town=town, storyboard=storyboard, config=config or EnvConfig())
    observations, _ = env.reset(seed=seed)
    chosen = {
        role: (policies or {}).get(role) or make_policy((names or {}).get(role, "scripted"), Role(role), env.limits)
        for role in env.possible_agents
    }
    states = {role: policy.initial_state(seed + 1, env.town) for role, policy in chosen.items()}
    played = Played(env)
    while env.agents and len(played.actions) < decisions:
        actions = {}
        for role in env.agents:
            actions[role], states[role] = chosen[role].step(observations[role], states[role])
        played.observations.append(observations)
        played.actions.append(actions)
        observations, *_ = env.step(actions)
        played.events.extend(env.last_events)
    return played
