"""Lessons: recorded sessions that are followed beside the teacher, and sessions that the player plays beside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Final, Protocol

import numpy as np

from dorothie_gym.ontology.roles import Role
from dorothie_gym.policies.persona import parse_traits
from dorothie_gym.policies.policy import AnyPolicy, policy_inputs, policy_seed

if TYPE_CHECKING:
    from dorothie_gym.policies.speech import Remark
    from dorothie_gym.session.recording.header import SessionHeader
    from dorothie_gym.session.session_engine import SessionEngine
    from dorothie_gym.session.spaces.actions import ActionDict
    from dorothie_gym.session.spaces.observations import ObservationMapping

TRAINED: Final = parse_traits("talkativeness=0..0.8,certainty=0.2..1")
"""Traits of the participants in training; those who are talkative or uncertain beyond are held out."""


def is_held_out(header: SessionHeader) -> bool:
    """Returns whether the participant of a recorded session has traits outside `TRAINED`."""
    personas = header.extra.get("personas")
    traits = personas.get(str(Role.PARTICIPANT)) if isinstance(personas, Mapping) else None
    if not isinstance(traits, Mapping):
        return False
    return float(traits["talkativeness"]) > 0.8 or float(traits["certainty"]) < 0.2


class Turns(Protocol):
    """Player and teacher of one role, who act alternately."""

    @property
    def is_stuck(self) -> bool:
        """Whether the current turn ends early."""
        ...

    def begin_turn(self, rng: np.random.Generator) -> int:
        """Draws whose turn it is; returns its number of decisions."""
        ...

    def decide(self, observation: ObservationMapping) -> ActionDict:
        """Takes a decision."""
        ...


def play_in_turns(role: Role, turns: Turns, others: Mapping[Role, AnyPolicy], engine: SessionEngine, seed: int) -> None:
    """Plays a session to its end, in which player and teacher of a role act alternately.

    Args:
        role: the role.
        turns: player and teacher.
        others: policies of the other roles.
        engine: engine of the town, at the start of the session.
        seed: seed of the session.
    """
    states = {each: policy.initial_state(policy_seed(seed, each), engine.town) for each, policy in others.items()}
    rng, left = np.random.default_rng((policy_seed(seed, role), 2)), 0
    while not engine.over:
        if left <= 0 or turns.is_stuck:
            left = turns.begin_turn(rng)
        left -= 1
        inputs, actions = policy_inputs(engine, others), {}
        for each, policy in others.items():
            actions[str(each)], states[each] = policy.step(inputs[each], states[each])
        actions[str(role)] = turns.decide(observed(engine, role))
        engine.step(actions)


def observed(engine: SessionEngine, role: Role) -> ObservationMapping:
    """Returns the observation of a role, with its action mask."""
    return {**engine.observations.of([role])[str(role)], "action_mask": engine.mask(role)}


def new_remarks(before: Sequence[Remark], after: Sequence[Remark]) -> tuple[Remark, ...]:
    """Returns the remarks that are new, regardless of their words."""
    known = [(one.act, one.meaning) for one in before]
    return tuple(one for one in after if (one.act, one.meaning) not in known)
