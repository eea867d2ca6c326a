"""Playing of sessions by policies, one at a time or as a series in one folder."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

from dorothie_gym.engine.config import EnvConfig
from dorothie_gym.engine.live_session import SessionSummary
from dorothie_gym.engine.recorder import SessionRecorder
from dorothie_gym.engine.session_engine import SessionEngine
from dorothie_gym.errors import SessionError
from dorothie_gym.ontology import AGENT_ROLES, Role
from dorothie_gym.policies import Player, Policy
from dorothie_gym.policies.policy import policy_seed
from dorothie_gym.recording import Session, SessionState, SessionWriter, session_state
from dorothie_gym.rollout.folder import PARTS


class SessionHost(Protocol):
    """Object that plays sessions with an engine inside: a `SessionEngine` itself, or a `DuoWizardEnv`."""

    @property
    def engine(self) -> SessionEngine:
        """Engine of the sessions."""

    def reset(self, seed: int | None = None) -> object:
        """Begins a session."""

    def step(self, actions: Mapping[str, Mapping[str, Any]]) -> object:
        """Plays one decision with an action for each agent."""


def play_session(
    host: SessionHost,
    policies: Mapping[Role, Policy[Any]],
    *,
    seed: int,
    folder: Path | str | None = None,
    on_step: Callable[[SessionEngine], None] | None = None,
) -> SessionSummary:
    """Plays a session from reset to end.

    Args:
        host: a `SessionEngine` or a `DuoWizardEnv`; it is reset.
        policies: one for each of the three roles.
        seed: seed of the session; session and policies follow from it.
        folder: folder in which the session is recorded decision by decision; None records nothing. An interrupted
            session stays in its folder and can be loaded.
        on_step: called with the engine after the reset and after each decision.

    Returns:
        The summary of the session.

    Raises:
        ValueError: a role has no policy.
        SessionError: the folder holds a session already.
        OSError: the folder cannot be written.
    """
    missing = [role for role in AGENT_ROLES if role not in policies]
    if missing:
        raise ValueError(f"policies has none for {', '.join(missing)}; each of the three roles needs one")
    engine = host.engine
    host.reset(seed=seed)
    states = {role: policies[role].initial_state(policy_seed(seed, role), engine.town) for role in AGENT_ROLES}
    with ExitStack() as stack:
        writer = None if folder is None else stack.enter_context(SessionWriter(folder, engine.session_header()))
        recorder = None if writer is None else SessionRecorder(engine, writer)
        if on_step is not None:
            on_step(engine)
        while not engine.over:
            observations = engine.observations.of()
            actions = {}
            for role in AGENT_ROLES:
                actions[str(role)], states[role] = policies[role].step(observations[role], states[role])
            host.step(actions)
            if recorder is not None:
                recorder.record(actions)
            if on_step is not None:
                on_step(engine)
        if writer is not None:
            writer.finish(engine.summary())
    return engine.summary()


# --- series of sessions -----------------------------------------------------------------------------------------------


class Planned(Protocol):
    """Session to be played; it follows from town and seed."""

    @property
    def town(self) -> str:
        """Name or file of the town."""

    @property
    def seed(self) -> int:
        """Seed of the session."""

    @property
    def path(self) -> str:
        """Folder of the session within the folder of all sessions."""


@dataclass
class SessionMaker:
    """Plays planned sessions one after the other; each appears in its folder when it is finished.

    Attributes:
        root: folder of all sessions, locked by `making_in`.
        config: settings of the sessions.
        cast: player of each role.
    """

    root: Path
    config: EnvConfig
    cast: Mapping[Role, Player]
    _engines: dict[str, SessionEngine] = field(default_factory=dict)

    def __call__(self, plan: Planned) -> tuple[Session, Path, bool]:
        """Plays a session unless its folder is finished; returns the session, its folder, and whether it is new.

        Raises:
            SessionError: the folder holds something else.
            ValueError: a policy cannot be made, or its action is malformed; policies may raise other errors.
        """
        folder = self.root / plan.path
        if session_state(folder) is SessionState.FINISHED:
            session = Session.load(folder)
            there = session.header.town
            same_town = there == plan.town or there == self.engine(plan.town).town.name
            if session.header.seed != plan.seed or not same_town:
                raise SessionError(f"{folder}: is another session than belongs here; remove it")
            return session, folder, False
        if folder.is_dir() and any(folder.iterdir()):
            raise SessionError(f"{folder}: is in the way, and no finished session; remove it")
        part = self.root / PARTS / folder.name
        engine = self.engine(plan.town)
        policies = {role: self.cast[role].make(role, engine.limits) for role in AGENT_ROLES}
        play_session(engine, policies, seed=plan.seed, folder=part)
        session = Session.load(part)
        folder.parent.mkdir(parents=True, exist_ok=True)
        part.rename(folder)
        return session, folder, True

    def engine(self, town: str) -> SessionEngine:
        """Returns the engine of a town, which is created once."""
        if town not in self._engines:
            self._engines[town] = SessionEngine(town, config=self.config)
        return self._engines[town]
