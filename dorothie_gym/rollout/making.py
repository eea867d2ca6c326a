"""Sessions made one after the other, each of which appears in its folder when it is finished."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

from dorothie_gym.envs.config import EnvConfig
from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.ontology import AGENT_ROLES, Role
from dorothie_gym.policies import Player
from dorothie_gym.rollout.folder import PARTS
from dorothie_gym.rollout.play import play_session
from dorothie_gym.sessions import Session, SessionError, SessionState, session_state


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
