"""Contract of a policy: a stateless object whose memory is passed in and handed back, so that replay is exact.

A policy plays one role. The code that runs a session (`evaluation/rollout/play.py`, the console, a user's loop) asks
each role's policy for an action at each decision and gives all three to the engine. Scripted, learned and
language-model policies fulfil the same contract; `policies/policy_loader.py` finds them by name.

Last of the five files that explain the package. docs/architecture.md continues with paths through the code.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping, MutableMapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Final, Generic, Protocol, TypeAlias, TypeVar

from dorothie_gym.errors import ActionError
from dorothie_gym.session.spaces.fields import SpaceLimits

if TYPE_CHECKING:
    from dataclasses import replace as replace

    from dorothie_gym.maps.town import Town
    from dorothie_gym.ontology.roles import Role
    from dorothie_gym.session.spaces.actions import ActionDict, AnyAction, RoleAction
    from dorothie_gym.session.spaces.observations import ObservationMapping
else:

    def replace(state, **changes):
        """Returns a copy of a frozen state with other values in some of its fields; the state itself where none is new.

        Replaces fields like `dataclasses.replace`, for dataclasses without ``__post_init__``, ``InitVar`` and slots, in
        a quarter of the time, because agents change a dozen groups of their state in every decision. Type checkers see
        the original, which checks names and types of the fields.
        """
        present = state.__dict__
        for name, value in changes.items():
            if present[name] is not value:
                break
        else:
            return state
        copy = object.__new__(type(state))
        copy.__dict__.update(present)
        copy.__dict__.update(changes)
        return copy


State = TypeVar("State")

DECISION_INTERVAL: Final = 0.5
"""Time between decisions at the default decision frequency of 2 Hz [s]."""

DESCRIPTION: Final = "model.json"
"""Name of the file that describes a trained policy in its folder."""


class Policy(ABC, Generic[State]):
    """Chooses the actions of a role from its observations.

    Attributes:
        observes: whether `step` reads the observation; a policy that does not is given an empty one.
        reads_mask: whether `step` reads the action mask of the engine. The observation then has the further field
            `action_mask`, with the content of `info["action_mask"]`.
        reads_refusals: whether `step` reads why its last action was refused. The observation then has the further field
            `refusal_reason`, the text of `info["refusal_reason"]`; empty if nothing was refused.
        role: role that the policy acts for.
        limits: sizes of the role's spaces.
    """

    observes: ClassVar[bool] = True
    reads_mask: ClassVar[bool] = False
    reads_refusals: ClassVar[bool] = False

    def __init__(self, role: Role, limits: SpaceLimits | None = None) -> None:
        """Prepares a policy for `role`; the sizes of the spaces default to those of `SpaceLimits`."""
        self.role = role
        self.limits = SpaceLimits() if limits is None else limits

    @abstractmethod
    def initial_state(self, seed: int, town: Town) -> State:
        """Returns the state before the first decision.

        Args:
            seed: seed of all random draws of the policy.
            town: the map, known to every role; landmarks are part of the observations.
        """

    def persona_of(self, state: State) -> Mapping[str, float | str] | None:
        """Returns the traits of the persona of a state, in JSON types, for the record; None if it has no persona."""
        return None

    def usage_of(self, state: State) -> Mapping[str, object] | None:
        """Returns the costs of a session so far (calls, tokens), in JSON types, for the record; None without costs."""
        return None

    @abstractmethod
    def step(self, observation: ObservationMapping, state: State) -> tuple[ActionDict, State]:
        """Chooses an action.

        Args:
            observation: observation of the role, see `observation_space`, and the further fields that are read.
            state: state that `initial_state` or the previous step returned; it is not changed.

        Returns:
            An action of the role's action space, and the state for the next decision. Fields that the action leaves out
            have no effect: `{"physical": PhysicalAction.STOP}` stops the car.
        """


class TypedPolicy(Policy[State]):
    """Policy that chooses typed actions, which the engine of a session takes as they are.

    Where policies and engine run in one loop (`Players`), nothing is encoded and decoded, and observations are not
    copied. A class that defines a `step` of its own is played by that `step`.
    """

    def step(self, observation: ObservationMapping, state: State) -> tuple[ActionDict, State]:
        """Chooses an action, see `Policy.step`."""
        action, state = self.act(observation, state)
        return action.encode(self.limits), state

    @abstractmethod
    def act(self, observation: ObservationMapping, state: State) -> tuple[RoleAction, State]:
        """Chooses a typed action.

        Args:
            observation: as for `step`. Its arrays may change with the next decision: the state must hold none of them.
            state: as for `step`.
        """

    @property
    def is_direct(self) -> bool:
        """Whether `step` is that of this class, so that `act` can be called in its place."""
        return type(self).step is TypedPolicy.step and "step" not in vars(self)


class BatchPolicy(TypedPolicy[State]):
    """Policy that takes the decisions of several sessions together, such as a network with one forward pass for all."""

    def act(self, observation: ObservationMapping, state: State) -> tuple[RoleAction, State]:
        """Chooses a typed action, see `TypedPolicy.act`."""
        return self.act_all([observation], [state])[0]

    @abstractmethod
    def act_all(
        self, observations: Sequence[ObservationMapping], states: Sequence[State]
    ) -> Sequence[tuple[RoleAction, State]]:
        """Chooses a typed action for each of several sessions, at least one; each result is that of the session alone.

        Args:
            observations: observation of each session, as for `act`.
            states: state of each session.
        """


AnyPolicy: TypeAlias = Policy[Any]
"""Policy whose state type is not known statically."""


def checked_decision(role: Role, decision: object) -> tuple[Any, Any]:
    """Returns what `step` of a policy has returned; raises `ActionError` if it is not the pair (action, state)."""
    if isinstance(decision, tuple) and len(decision) == 2:
        return decision
    count = f" of {len(decision)} values" if isinstance(decision, tuple) else ""
    raise ActionError(
        f"the policy of {role} returned a {type(decision).__name__}{count}; step must return the pair (action, state)"
    )


@dataclass(frozen=True, kw_only=True)
class DecisionClock:
    """Time between decisions, measured from the times of the observations.

    Attributes:
        time: time of the last observation [s]; None before the first.
        interval: time between the last two observations [s]; `DECISION_INTERVAL` until there are two.
    """

    time: float | None = None
    interval: float = DECISION_INTERVAL

    def ticked(self, now: float) -> DecisionClock:
        """Advances the clock to the time of another observation [s]; rounds off floating-point residues."""
        elapsed = round(now - self.time, 6) if self.time is not None else 0.0
        return DecisionClock(time=now, interval=elapsed if elapsed > 0.0 else self.interval)


# --- inputs of the policies of a session ------------------------------------------------------------------------------


class RoleObservations(Protocol):
    """Observations of the roles at one decision."""

    def of(self, roles: Sequence[Role]) -> Mapping[str, ObservationMapping]:
        """Returns the observations of the given roles by agent."""
        ...

    def views(self, roles: Sequence[Role]) -> Mapping[str, ObservationMapping]:
        """Returns the observations of the given roles by agent, as views that the next step changes."""
        ...


class ObservedSession(Protocol):
    """Session whose roles observe and are given action masks, such as a `SessionEngine`."""

    @property
    def observations(self) -> RoleObservations:
        """Observations at the current decision."""
        ...

    def mask(self, role: Role) -> Mapping[str, object]:
        """Returns the mask of a role's action space at the current decision."""
        ...

    def info(self, role: Role) -> Mapping[str, object]:
        """Returns the info dictionary of a role at the current decision."""
        ...


def policy_inputs(session: ObservedSession, policies: Mapping[Role, AnyPolicy]) -> dict[Role, ObservationMapping]:
    """Returns the inputs of policies at the current decision: observations, and masks and refusals where they are read.

    Observations and masks that no policy reads are not computed.

    Args:
        session: session in progress.
        policies: policies by role.
    """
    return _inputs(session, policies, session.observations.of(_observers(policies)))


def _observers(policies: Mapping[Role, AnyPolicy]) -> list[Role]:
    return [role for role, policy in policies.items() if policy.observes]


def _inputs(
    session: ObservedSession, policies: Mapping[Role, AnyPolicy], seen: Mapping[str, ObservationMapping]
) -> dict[Role, ObservationMapping]:
    """Returns the observations of policies, with masks and refusals where they are read."""
    inputs: dict[Role, ObservationMapping] = {}
    for role, policy in policies.items():
        observation = seen.get(role, {})
        if policy.reads_mask:
            observation = {**observation, "action_mask": session.mask(role)}
        if policy.reads_refusals:
            observation = {**observation, "refusal_reason": session.info(role)["refusal_reason"]}
        inputs[role] = observation
    return inputs


class Players:
    """Policies that play roles of sessions, prepared for their decisions.

    Args:
        policies: policies by role.
    """

    def __init__(self, policies: Mapping[Role, AnyPolicy]) -> None:
        self._direct: dict[Role, TypedPolicy[Any]] = {}
        self._others: dict[Role, AnyPolicy] = {}
        for role, policy in policies.items():
            if isinstance(policy, TypedPolicy) and policy.is_direct:
                self._direct[role] = policy
            else:
                self._others[role] = policy
        self._steps = [
            (role, str(role), self._direct[role].act if role in self._direct else policy.step)
            for role, policy in policies.items()
        ]
        self._observers = _observers(self._direct)

    def decide(self, session: ObservedSession, states: MutableMapping[Role, Any]) -> dict[str, AnyAction]:
        """Returns the actions at the current decision of a session, by agent; replaces the state of each policy."""
        return self.choose(self.inputs(session), states)

    def inputs(self, session: ObservedSession) -> dict[Role, ObservationMapping]:
        """Returns the inputs of the policies at the current decision, valid until the next one."""
        inputs = _inputs(session, self._direct, session.observations.views(self._observers))
        return inputs | policy_inputs(session, self._others) if self._others else inputs

    def choose(
        self,
        inputs: Mapping[Role, ObservationMapping],
        states: MutableMapping[Role, Any],
        without: Collection[Role] = (),
    ) -> dict[str, AnyAction]:
        """Returns the actions of the policies, but those of some roles, by agent; replaces their states."""
        actions: dict[str, AnyAction] = {}
        for role, agent, choose in self._steps:
            if role not in without:
                actions[agent], states[role] = checked_decision(role, choose(inputs[role], states[role]))
        return actions
