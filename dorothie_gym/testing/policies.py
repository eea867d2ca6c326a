"""Check that a policy keeps the contract of `dorothie_gym.Policy`."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any, TypeVar

from dorothie_gym.engine.config import EnvConfig
from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.maps import Town
from dorothie_gym.ontology import AGENT_ROLES
from dorothie_gym.policies import Policy, make_policy
from dorothie_gym.spaces import ActionDict
from dorothie_gym.testing.comparison import first_unequal

State = TypeVar("State")


def check_policy(
    policy: Policy[Any],
    *,
    town: str | Path | Town = "brookside",
    seed: int = 0,
    decisions: int = 60,
    config: EnvConfig | None = None,
) -> None:
    """Checks that a policy is stateless, deterministic and acts within its action space.

    The policy plays its role against the scripted policies of the others. At each decision its action must lie in the
    role's action space and be decodable; `step` must change neither the observation nor the state that it is given, and
    must return the same action when it is called again with them. The same session played again, interleaved with a
    second one by the same policy object, must give the same actions.

    Args:
        policy: of any role.
        town: name, file or `Town` to play in.
        seed: of the session; the second session has the next seed.
        decisions: decisions played at most.
        config: of the environment.

    Raises:
        AssertionError: the contract is broken; the message names the rule and the decision.
        ValueError: the policy's action is malformed; the message names the field.
    """
    env = DuoWizardEnv(town, config=config)
    other = DuoWizardEnv(env.town, config=config)
    alone = list(_Run(policy, env, seed, strict=True).play(decisions))
    assert alone, "the session ended before the first decision"
    run, second = _Run(policy, env, seed), _Run(policy, other, seed + 1)
    interleaved = []
    for _ in range(len(alone)):
        interleaved += list(run.play(1))
        list(second.play(1))
    for k, (one, again) in enumerate(zip(alone, interleaved, strict=True)):
        field = first_unequal(one, again)
        assert field is None, (
            f"decision {k}: {field} of the action differs when the policy plays a second session in between; "
            "whatever a policy remembers belongs into its state"
        )


class _Run:
    """A session in which the policy plays its role and scripts play the others."""

    def __init__(self, policy: Policy[Any], env: DuoWizardEnv, seed: int, *, strict: bool = False) -> None:
        self._env, self._strict, self._role = env, strict, policy.role
        self._policies = {role: make_policy("scripted", role, env.limits) for role in AGENT_ROLES}
        self._policies[policy.role] = policy
        self._observations, _ = env.reset(seed=seed)
        self._states: dict[Any, Any] = {
            role: played.initial_state(seed, env.town) for role, played in self._policies.items()
        }

    def play(self, decisions: int) -> list[ActionDict]:
        """Plays some decisions; returns the actions of the checked policy."""
        actions_of_policy: list[ActionDict] = []
        for _ in range(decisions):
            if not self._env.agents:
                break
            actions = {}
            for role, policy in self._policies.items():
                observation, state = self._observations[str(role)], self._states[role]
                if role is self._role and self._strict:
                    action, self._states[role] = self._checked(policy, observation, state, len(actions_of_policy))
                else:
                    action, self._states[role] = policy.step(observation, state)
                actions[str(role)] = action
            actions_of_policy.append(actions[str(self._role)])
            self._observations, *_ = self._env.step(actions)
        return actions_of_policy

    def _checked(
        self, policy: Policy[State], observation: dict[str, Any], state: State, k: int
    ) -> tuple[dict[str, Any], State]:
        before = copy.deepcopy(observation)
        action, after = policy.step(observation, state)
        field = first_unequal(before, observation)
        assert field is None, f"decision {k}: step changed the observation's {field}"
        again, _ = policy.step(observation, state)
        field = first_unequal(action, again)
        assert field is None, f"decision {k}: {field} of the action differs when step is called again on the same state"
        space = self._env.action_space(str(policy.role))
        outside = [name for name, part in space.spaces.items() if name not in action or not part.contains(action[name])]
        outside += [name for name in action if name not in space.spaces]
        assert not outside, f"decision {k}: the action's {outside[0]} is not in the action space of {policy.role}"
        return dict(action), after
