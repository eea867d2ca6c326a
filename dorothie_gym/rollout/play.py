"""Playing one session: policies act for the three roles until it is over."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

from dorothie_gym.engine.config import EnvConfig
from dorothie_gym.engine.recorder import SessionRecorder
from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.errors import SessionError
from dorothie_gym.ontology import AGENT_ROLES, Role
from dorothie_gym.policies import Player, Policy
from dorothie_gym.policies.policy import policy_seed
from dorothie_gym.recording import Session, SessionState, SessionWriter, session_state
from dorothie_gym.rollout.folder import PARTS


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


# --- Sessions made one after the other, each of which appears in its folder when it is finished ----------------------


class Planned(Protocol):
    """A session that is to be: everything in it follows from town and seed."""

    @property
    def town(self) -> str:
        """Name or file of its town."""

    @property
    def seed(self) -> int:
        """Its seed."""

    @property
    def path(self) -> str:
        """Its folder within that of all sessions."""


@dataclass
class SessionMaker:
    """Makes sessions, one after the other; towns are kept.

    Attributes:
        root: folder of all sessions, held by `making_in`.
        config: of the environment.
        cast: who plays the three roles.
    """

    root: Path
    config: EnvConfig
    cast: Mapping[Role, Player]
    _envs: dict[str, DuoWizardEnv] = field(default_factory=dict)

    def __call__(self, plan: Planned) -> tuple[Session, Path, bool]:
        """Plays a session, unless it is there; returns it, its folder, and whether it is new.

        Raises:
            SessionError: something else is there.
            ValueError: a policy cannot be made, or does what it cannot; policies may raise others.
        """
        folder = self.root / plan.path
        if session_state(folder) is SessionState.FINISHED:
            session = Session.load(folder)
            there = session.header.town
            same_town = there == plan.town or there == self.env(plan.town).town.name
            if session.header.seed != plan.seed or not same_town:
                raise SessionError(f"{folder}: is another session than belongs here; remove it")
            return session, folder, False
        if folder.is_dir() and any(folder.iterdir()):
            raise SessionError(f"{folder}: is in the way, and no finished session; remove it")
        part = self.root / PARTS / folder.name
        env = self.env(plan.town)
        policies = {role: self.cast[role].make(role, env.limits) for role in AGENT_ROLES}
        play_session(env, policies, seed=plan.seed, folder=part)
        session = Session.load(part)
        folder.parent.mkdir(parents=True, exist_ok=True)
        part.rename(folder)
        return session, folder, True

    def env(self, town: str) -> DuoWizardEnv:
        """The environment of a town."""
        if town not in self._envs:
            self._envs[town] = DuoWizardEnv(town, config=self.config)
        return self._envs[town]
