"""Practice: player and teacher act in turns, and held-out personas are left out."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from dorothie_gym.baselines.roles.learned_role.dagger_sessions import (
    is_held_out,
    new_remarks,
    observed,
    play_in_turns,
    play_together,
)
from dorothie_gym.dialogue import CommunicativeFunction as Function
from dorothie_gym.ontology import Role
from dorothie_gym.policies import LaneFollowPolicy, SilentPolicy
from dorothie_gym.policies.speech import intend
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.session.spaces import ParticipantAction
from tests.session.recording.builders import header

TURN = 4
"""Number of decisions of a turn."""


@dataclass
class Turns:
    """Turns of four decisions, of which one ends after two."""

    engine: SessionEngine
    stuck_at: int
    decisions: int = 0
    begun: list[int] = field(default_factory=list)
    draws: list[float] = field(default_factory=list)

    @property
    def is_stuck(self) -> bool:
        return self.decisions == self.stuck_at and self.begun[-1] != self.decisions

    def begin_turn(self, rng: np.random.Generator) -> int:
        self.begun.append(self.decisions)
        self.draws.append(float(rng.random()))
        return TURN

    def asks(self, observation: dict[str, object]) -> int | None:
        return self.decisions if self.decisions % 3 == 0 else None

    def decide(self, observation: dict[str, object], answer: int | None) -> dict[str, object]:
        assert "action_mask" in observation
        assert answer == (None if self.decisions % 3 else 2 * self.decisions)
        self.decisions += 1
        return ParticipantAction().encode(self.engine.limits)


def play(seed: int) -> Turns:
    turns, session = begun(seed)
    play_together([session], doubled)
    assert turns.engine.over
    return turns


def doubled(questions: Sequence[int]) -> list[int]:
    return [2 * question for question in questions]


def begun(seed: int) -> tuple[Turns, Generator[int, int, None]]:
    engine = SessionEngine("brookside", config=EnvConfig(max_seconds=10.0))
    engine.reset(seed=seed)
    others = {
        Role.CO_WIZARD: LaneFollowPolicy(engine.limits),
        Role.AD_WIZARD: SilentPolicy(Role.AD_WIZARD, engine.limits),
    }
    turns = Turns(engine, stuck_at=6)
    return turns, play_in_turns(Role.PARTICIPANT, turns, others, engine, seed)


def test_turn_ends_after_its_decisions_or_when_the_player_is_stuck() -> None:
    turns = play(3)
    assert turns.begun[:4] == [0, 4, 6, 10]
    assert turns.decisions > 10


def test_sessions_that_are_played_together_are_those_played_alone() -> None:
    together = [begun(seed) for seed in (3, 4, 5)]
    play_together([session for _, session in together], doubled)
    for seed, (turns, _) in zip((3, 4, 5), together, strict=True):
        alone = play(seed)
        assert turns.engine.over and turns.decisions == alone.decisions
        assert (turns.begun, turns.draws) == (alone.begun, alone.draws)
        assert turns.engine.summary() == alone.engine.summary()


def test_draws_of_the_turns_follow_from_the_seed() -> None:
    one, again, other = play(3), play(3), play(4)
    assert one.draws == again.draws != other.draws


def test_mask_belongs_to_the_observation() -> None:
    engine = SessionEngine("brookside")
    engine.reset(seed=1)
    found = observed(engine, Role.CO_WIZARD)
    assert found.keys() >= {"action_mask", "time", "landmarks"}


def test_remarks_are_new_whatever_their_words() -> None:
    yes, no = intend(Function.POSITIVE_FEEDBACK), intend(Function.NEGATIVE_FEEDBACK)
    assert new_remarks((yes,), (replace(yes, text="okay"), no)) == (no,)


@pytest.mark.parametrize(
    ("personas", "held_out"),
    [
        ({}, False),
        ({"participant": {"talkativeness": 0.8, "certainty": 0.2}}, False),
        ({"participant": {"talkativeness": 0.9, "certainty": 0.5}}, True),
        ({"participant": {"talkativeness": 0.5, "certainty": 0.1}}, True),
        ({"co_wizard": {"talkativeness": 0.9, "certainty": 0.5}}, False),
    ],
)
def test_talkative_and_uncertain_participants_are_held_out(personas: dict[str, object], held_out: bool) -> None:
    assert is_held_out(header(extra={"personas": personas})) is held_out
