"""Recorded sessions from the perspective of one role, simulated again from their seeds and actions.

An episode contains the role's observations, actions and rewards, and nothing else of its session: no name, storyboard
or seed, from which the errands and the hidden places could be derived. What is exported depends on that only, and so
does the order of the episodes.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from gymnasium import spaces

from dorothie_gym.evaluation.rollout.replay import ReplaySources, begin_replay, recorded_actions
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.observations import RoleMask
from dorothie_gym.session.spaces.actions import ActionDict, action_space
from dorothie_gym.session.spaces.fields import SpaceLimits
from dorothie_gym.session.spaces.observations import Observation
from dorothie_gym.support.copying import digest_of

if TYPE_CHECKING:
    from dorothie_gym.archive.corpus import CorpusEntry
    from dorothie_gym.ontology.roles import Role
    from dorothie_gym.session.session_engine import SessionEngine

_ID_LENGTH: Final = 16
"""Hexadecimal digits of an id."""


@dataclass(frozen=True, kw_only=True)
class RoleEpisode:
    """Session from the perspective of one role.

    Attributes:
        source: name of the session, for messages during the export; it is not exported.
        town: name of its town.
        config: settings of its environment.
        limits: sizes of the spaces.
        observation_space: space of the observations.
        action_space: space of the actions.
        observations: n + 1 observations, the last one after the last action.
        masks: n + 1 masks of the actions, as `info["action_mask"]`.
        actions: n actions.
        rewards: reward of each action.
        terminated: whether the session ended with the task, at its last decision.
    """

    source: str = field(compare=False)
    town: str
    config: EnvConfig
    limits: SpaceLimits
    observation_space: spaces.Dict
    action_space: spaces.Dict
    observations: tuple[Observation, ...]
    masks: tuple[RoleMask, ...]
    actions: tuple[ActionDict, ...]
    rewards: tuple[float, ...]
    terminated: bool

    @property
    def id(self) -> str:
        """Opaque id: a digest of the role's observations and actions, which can be computed from the episode."""
        content = [self.town, self.observations, self.masks, self.actions, self.rewards, self.terminated]
        return digest_of(content)[:_ID_LENGTH]


def role_episodes(
    entries: Iterable[CorpusEntry], role: Role, sources: ReplaySources | None = None
) -> Iterator[RoleEpisode]:
    """Yields the sessions of a corpus from the perspective of a role.

    Args:
        entries: sessions that this package has recorded.
        role: participant, Co-Wizard or Ad-Wizard.
        sources: maps that are not shipped.

    Raises:
        SessionError: a session cannot be read, or has no recorded actions.
        TownError: a map cannot be read.
    """
    found = sources or ReplaySources()
    for entry in entries:
        session = entry.load()
        engine = begin_replay(session, found.town_of(session))
        yield lived_through(engine, role, recorded_actions(engine, session), source=session.name)


def lived_through(
    engine: SessionEngine, role: Role, decisions: Iterable[Mapping[str, ActionDict]], *, source: str
) -> RoleEpisode:
    """Returns the session of an engine as a role lives through it.

    Args:
        engine: engine whose session has just begun; it is stepped.
        role: participant, Co-Wizard or Ad-Wizard.
        decisions: actions of all agents, by decision.
        source: see `RoleEpisode`.
    """
    agent = str(role)
    observations: list[Observation] = [engine.observations.of((role,))[agent]]
    masks, actions, rewards, terminated = [engine.mask(role)], [], [], False
    for taken in decisions:
        outcome = engine.step(taken)
        observations.append(engine.observations.of((role,))[agent])
        masks.append(engine.mask(role))
        actions.append(taken[agent])
        rewards.append(float(sum(outcome.reward_terms[role].values())))
        terminated = outcome.terminated
    return RoleEpisode(
        source=source,
        town=engine.town.name,
        config=engine.config,
        limits=engine.limits,
        observation_space=engine.observation_space(role),
        action_space=action_space(role, engine.limits),
        observations=tuple(observations),
        masks=tuple(masks),
        actions=tuple(actions),
        rewards=tuple(rewards),
        terminated=terminated,
    )


def distinct_ids(ids: Sequence[str]) -> list[str]:
    """Returns sorted ids; duplicates, from sessions with equal observations and actions, are numbered."""
    found, times = [], 0
    for number, name in enumerate(ids):
        times = times + 1 if number and ids[number - 1] == name else 1
        found.append(name if times == 1 else f"{name}-{times}")
    return found
