"""Policies that play the roles of several sessions at once: a `BatchPolicy` decides once for all of its sessions."""

from __future__ import annotations

from collections.abc import Mapping, MutableMapping, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

from dorothie_gym.policies.policy import AnyPolicy, BatchPolicy, ObservedSession, Players

if TYPE_CHECKING:
    from dorothie_gym.ontology.roles import Role
    from dorothie_gym.session.spaces.actions import AnyAction

States: TypeAlias = MutableMapping["Role", Any]
"""State of each policy of a session, which a decision replaces by the next one."""


class BatchPlayers:
    """Policies that play roles of several sessions, prepared for their decisions.

    Sessions that have the same `BatchPolicy` object in a role are decided with one call of it. Actions and states equal
    those of sessions that are played alone (`Players`).

    Args:
        casts: policies of each session, by role.
    """

    def __init__(self, casts: Sequence[Mapping[Role, AnyPolicy]]) -> None:
        self._players = [Players(cast) for cast in casts]
        self._together: list[set[Role]] = [set() for _ in casts]
        groups: dict[tuple[Role, int], tuple[BatchPolicy[Any], list[int]]] = {}
        for number, cast in enumerate(casts):
            for role, policy in cast.items():
                if isinstance(policy, BatchPolicy) and policy.is_direct:
                    groups.setdefault((role, id(policy)), (policy, []))[1].append(number)
                    self._together[number].add(role)
        self._groups = [(role, str(role), policy, numbers) for (role, _), (policy, numbers) in groups.items()]

    def decide(self, sessions: Mapping[int, tuple[ObservedSession, States]]) -> dict[int, dict[str, AnyAction]]:
        """Returns the actions of the policies at the current decision, by number of the session and agent.

        Args:
            sessions: sessions in progress with the states of their policies, by number.
        """
        inputs, actions = {}, {}
        for number, (session, states) in sessions.items():
            inputs[number] = self._players[number].inputs(session)
            actions[number] = self._players[number].choose(inputs[number], states, self._together[number])
        for role, agent, policy, numbers in self._groups:
            playing = [number for number in numbers if number in sessions]
            if not playing:
                continue
            chosen = policy.act_all(
                [inputs[number][role] for number in playing], [sessions[number][1][role] for number in playing]
            )
            for number, (action, state) in zip(playing, chosen, strict=True):
                actions[number][agent] = action
                sessions[number][1][role] = state
        return actions
