"""Playing one session: policies act for the three roles until it is over."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.envs.recorder import SessionRecorder
from dorothie_gym.ontology import AGENT_ROLES, Role
from dorothie_gym.policies import Policy
from dorothie_gym.policies.policy import policy_seed
from dorothie_gym.sessions import SessionWriter


def play_session(
    env: DuoWizardEnv,
    policies: Mapping[Role, Policy[Any]],
    *,
    seed: int,
    folder: Path | str | None = None,
    on_step: Callable[[DuoWizardEnv], None] | None = None,
) -> dict[str, Any]:
    """Plays a session from reset to end.

    Args:
        env: where; it is reset.
        policies: one for each of the three roles.
        seed: everything in the session follows from it and from the policies.
        folder: where the session is recorded as it happens; None records nothing. When the play is interrupted, what
            was recorded until then stays, and can be loaded.
        on_step: called with the environment after the reset and after each decision.

    Returns:
        The environment's summary.

    Raises:
        ValueError: a role has no policy.
        SessionError: the folder holds a session already.
        OSError: the folder cannot be written.
    """
    missing = [role for role in AGENT_ROLES if role not in policies]
    if missing:
        raise ValueError(f"policies has none for {', '.join(missing)}; each of the three roles needs one")
    observations, _ = env.reset(seed=seed)
    states = {role: policies[role].initial_state(policy_seed(seed, role), env.town) for role in AGENT_ROLES}
    with ExitStack() as stack:
        writer = None if folder is None else stack.enter_context(SessionWriter(folder, env.session_header()))
        recorder = None if writer is None else SessionRecorder(env, writer)
        if on_step is not None:
            on_step(env)
        while env.agents:
            actions = {}
            for role in AGENT_ROLES:
                actions[str(role)], states[role] = policies[role].step(observations[str(role)], states[role])
            observations, *_ = env.step(actions)
            if recorder is not None:
                recorder.record(actions)
            if on_step is not None:
                on_step(env)
        if writer is not None:
            writer.finish(env.summary())
    return env.summary()
