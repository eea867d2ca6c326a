"""Sessions of practice (DAgger), in which the player and the teacher of a role act in turns."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Generic, Protocol, TypeVar

import numpy as np

from dorothie_gym.ontology.roles import Role
from dorothie_gym.policies.decision_random import policy_seed
from dorothie_gym.policies.persona import parse_traits
from dorothie_gym.policies.policy import AnyPolicy, Players
from dorothie_gym.session.session_engine import SessionEngine

if TYPE_CHECKING:
    from dorothie_gym.policies.speech import Remark
    from dorothie_gym.session.recording.header import SessionHeader
    from dorothie_gym.session.spaces.actions import AnyAction
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


Question = TypeVar("Question")
Answer = TypeVar("Answer")
Question_co = TypeVar("Question_co", covariant=True)
Answer_contra = TypeVar("Answer_contra", contravariant=True)
Example = TypeVar("Example")


class Turns(Protocol[Question_co, Answer_contra]):
    """Player and teacher of one role, who act alternately."""

    @property
    def is_stuck(self) -> bool:
        """Whether the current turn ends early."""
        ...

    def begin_turn(self, rng: np.random.Generator) -> int:
        """Draws whose turn it is; returns its number of decisions."""
        ...

    def asks(self, observation: ObservationMapping) -> Question_co | None:
        """Returns the question whose answer `decide` needs; None if it needs none."""
        ...

    def decide(self, observation: ObservationMapping, answer: Answer_contra | None) -> AnyAction:
        """Takes a decision."""
        ...


@dataclass(frozen=True, kw_only=True)
class PracticeSession(Generic[Example]):
    """Session of practice to be played.

    Attributes:
        engine: engine of the town, for this session alone.
        seed: seed of the session.
        on_example: receives the teacher's decisions.
    """

    engine: SessionEngine
    seed: int
    on_example: Callable[[Example], None]


def play_in_turns(
    role: Role, turns: Turns[Question, Answer], others: Mapping[Role, AnyPolicy], engine: SessionEngine, seed: int
) -> Generator[Question, Answer, None]:
    """Plays a session to its end, in which player and teacher of a role act alternately.

    Args:
        role: the role.
        turns: player and teacher.
        others: policies of the other roles.
        engine: engine of the town, at the start of the session.
        seed: seed of the session.

    Yields:
        The questions of the turns; the answers are sent back.
    """
    players = Players(others)
    states = {each: policy.initial_state(policy_seed(seed, each), engine.town) for each, policy in others.items()}
    rng, left = np.random.default_rng((policy_seed(seed, role), 2)), 0
    while not engine.over:
        if left <= 0 or turns.is_stuck:
            left = turns.begin_turn(rng)
        left -= 1
        observation = observed(engine, role)
        actions = players.decide(engine, states)
        question = turns.asks(observation)
        answer = None if question is None else (yield question)
        actions[str(role)] = turns.decide(observation, answer)
        engine.step(actions)


def play_together(
    sessions: Sequence[Generator[Question, Answer, None]], answer: Callable[[Sequence[Question]], Sequence[Answer]]
) -> None:
    """Plays sessions of practice to their ends, and answers their questions together.

    Args:
        sessions: sessions of `play_in_turns`.
        answer: returns the answers to questions, at least one.
    """
    asked = {number: next(session, None) for number, session in enumerate(sessions)}
    while waiting := {number: question for number, question in asked.items() if question is not None}:
        answers = answer(list(waiting.values()))
        asked = {number: _question_after(sessions[number], own) for number, own in zip(waiting, answers, strict=True)}


def _question_after(session: Generator[Question, Answer, None], answer: Answer) -> Question | None:
    """Returns the next question of a session; None at its end."""
    try:
        return session.send(answer)
    except StopIteration:
        return None


def observed(engine: SessionEngine, role: Role) -> ObservationMapping:
    """Returns the observation of a role, with its action mask."""
    return {**engine.observations.of([role])[str(role)], "action_mask": engine.mask(role)}


def new_remarks(before: Sequence[Remark], after: Sequence[Remark]) -> tuple[Remark, ...]:
    """Returns the remarks that are new, regardless of their words."""
    known = [(one.act, one.meaning) for one in before]
    return tuple(one for one in after if (one.act, one.meaning) not in known)
