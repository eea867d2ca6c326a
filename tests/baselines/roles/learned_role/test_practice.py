"""Practice: player and teacher act in turns, and held-out personas are left out."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from dorothie_gym.baselines.roles.learned_role.practice import is_held_out, new_remarks, observed, play_in_turns
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

    def decide(self, observation: dict[str, object]) -> dict[str, object]:
        assert "action_mask" in observation
        self.decisions += 1
        return ParticipantAction().encode(self.engine.limits)


def play(seed: int) -> Turns:
    engine = SessionEngine("brookside", config=EnvConfig(max_seconds=10.0))
    engine.reset(seed=seed)
    others = {
        Role.CO_WIZARD: LaneFollowPolicy(engine.limits),
        Role.AD_WIZARD: SilentPolicy(Role.AD_WIZARD, engine.limits),
    }
    turns = Turns(engine, stuck_at=6)
    play_in_turns(Role.PARTICIPANT, turns, others, engine, seed)
    assert engine.over
    return turns


def test_turn_ends_after_its_decisions_or_when_the_player_is_stuck() -> None:
    turns = play(3)
    assert turns.begun[:4] == [0, 4, 6, 10]
    assert turns.decisions > 10


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
