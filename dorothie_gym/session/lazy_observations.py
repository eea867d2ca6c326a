"""Observations of the roles of a session at one decision, built when they are first read."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Protocol

from dorothie_gym.ontology.roles import AGENT_ROLES, Role
from dorothie_gym.session.spaces.observations import Observation

if TYPE_CHECKING:
    from dorothie_gym.session.observations import SessionObserver

_AGENTS = {str(role): role for role in AGENT_ROLES}


class Observable(Protocol):
    """Session whose roles can be observed; `decisions` is the number of decisions played so far."""

    decisions: int
    observer: SessionObserver

    def observations(self, roles: Sequence[Role]) -> dict[str, Observation]:
        """Builds the observations of the given roles at the current decision, by agent."""
        ...


class LazyObservations(Mapping[str, Observation]):
    """Observations of the roles at one decision, each built when it is first read.

    A mapping is valid until the session takes its next step: it raises `RuntimeError` when an observation that was not
    read in time is requested afterwards.
    """

    def __init__(self, session: Observable) -> None:
        self._session, self._decision = session, session.decisions
        self._built: dict[str, Observation] = {}

    def __getitem__(self, agent: str) -> Observation:
        return self.of((_AGENTS[agent],))[agent]

    def __iter__(self) -> Iterator[str]:
        return iter(_AGENTS)

    def __len__(self) -> int:
        return len(_AGENTS)

    def views(self, roles: Sequence[Role]) -> dict[str, Observation]:
        """Returns the observations of the given roles by agent, as views that the next step changes, see `RowView`."""
        if self._session.decisions != self._decision:
            raise RuntimeError("the session has taken a step since; its views show another decision")
        return self._session.observer.views(roles, self._decision)

    def of(self, roles: Sequence[Role] = AGENT_ROLES) -> dict[str, Observation]:
        """Returns the observations of the given roles by agent; missing ones are built together."""
        missing = [role for role in roles if role not in self._built] if self._built else roles
        if not missing:
            return {str(role): self._built[role] for role in roles}
        if self._session.decisions != self._decision:
            raise RuntimeError(f"the session has taken a step since; the observation of {missing[0]} was not read")
        found = self._session.observations(missing)
        self._built.update(found)
        return found if missing is roles else {str(role): self._built[role] for role in roles}
