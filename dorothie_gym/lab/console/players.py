"""Policies that play roles of a session in progress, with their states."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from dorothie_gym.evaluation.rollout.play import with_personas
from dorothie_gym.lab.console.seating import Occupancy, SeatPlan
from dorothie_gym.policies.decision_random import policy_seed
from dorothie_gym.policies.policy import AnyPolicy, TypedPolicy, checked_decision, policy_inputs

if TYPE_CHECKING:
    from dorothie_gym.ontology.roles import Role
    from dorothie_gym.session.recording.header import SessionHeader
    from dorothie_gym.session.session_engine import SessionEngine
    from dorothie_gym.session.spaces.actions import AnyAction


class Players:
    """Policies of the roles that no person currently plays.

    Args:
        engine: engine of the sessions.
        plans: plan of the seat of each role.
    """

    def __init__(self, engine: SessionEngine, plans: Mapping[Role, SeatPlan]) -> None:
        self._engine, self._plans, self._seed = engine, plans, 0
        self._policies: dict[Role, AnyPolicy] = {}
        self._states: dict[Role, Any] = {}

    def begin(self, seed: int) -> None:
        """Begins a session: only the roles without a seat are played by policies.

        Args:
            seed: seed of the session.
        """
        self._seed = seed
        self._policies, self._states = {}, {}
        for role, plan in self._plans.items():
            if plan.occupancy is Occupancy.POLICY:
                self.start(role)

    def start(self, role: Role) -> None:
        """Hands a role over to its policy."""
        policy = self._plans[role].player.make(role, self._engine.limits)
        self._policies[role] = policy
        self._states[role] = policy.initial_state(policy_seed(self._seed, role), self._engine.town)

    def stop(self, role: Role) -> None:
        """Hands a role over to a person."""
        self._policies.pop(role, None)
        self._states.pop(role, None)

    def __contains__(self, role: Role) -> bool:
        """Returns whether a policy plays a role."""
        return role in self._policies

    @property
    def roles(self) -> frozenset[Role]:
        """Roles that policies play."""
        return frozenset(self._policies)

    def actions(self) -> dict[str, AnyAction]:
        """Returns the actions of the policies in the current decision, by role."""
        actions: dict[str, AnyAction] = {}
        inputs = policy_inputs(self._engine, self._policies)
        for role, policy in self._policies.items():
            choose = policy.act if isinstance(policy, TypedPolicy) and policy.is_direct else policy.step
            decision = choose(inputs[role], self._states[role])
            actions[role.value], self._states[role] = checked_decision(role, decision)
        return actions

    def sign(self, header: SessionHeader) -> SessionHeader:
        """Returns the header of a record with the personas of the policies."""
        return with_personas(header, self._policies, self._states)
