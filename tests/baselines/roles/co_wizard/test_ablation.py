"""The rows of benchmarks/co_wizard_ablation.py replace the part in their name, and no other."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from benchmarks.co_wizard_ablation import make
from dorothie_gym.baselines.roles.co_wizard.memory import WorkingMemory
from dorothie_gym.baselines.roles.co_wizard.policy import LearnedDecision
from dorothie_gym.baselines.roles.learned_role.dagger_sessions import observed
from dorothie_gym.ontology import AGENT_ROLES, Role
from dorothie_gym.policies import make_policy, pretrained_folder
from dorothie_gym.policies.decision_random import policy_seed
from dorothie_gym.policies.policy import AnyPolicy, policy_inputs
from dorothie_gym.session.session_engine import SessionEngine

DECISIONS = 140
"""Decisions of a test: a goal is named, approached and asked about."""

SEED = 15
"""Seed of a session in which the rules rule something out."""


@pytest.fixture(scope="module")
def engine() -> SessionEngine:
    return SessionEngine("brookside")


def turns(row: str, engine: SessionEngine) -> Iterator[LearnedDecision]:
    """Plays a row beside the scripted roles."""
    player = make(row, pretrained_folder("pretrained:co-wizard"), Role.CO_WIZARD, engine.limits)
    others: dict[Role, AnyPolicy] = {
        role: make_policy("scripted", role, engine.limits) for role in AGENT_ROLES if role is not Role.CO_WIZARD
    }
    engine.reset(seed=SEED)
    states = {role: policy.initial_state(policy_seed(SEED, role), engine.town) for role, policy in others.items()}
    state = player.initial_state(policy_seed(SEED, Role.CO_WIZARD), engine.town)
    for _ in range(DECISIONS):
        inputs, actions = policy_inputs(engine, others), {}
        for role, policy in others.items():
            actions[str(role)], states[role] = policy.step(inputs[role], states[role])
        (turn,) = player.play_all([observed(engine, Role.CO_WIZARD)], [state])
        state = turn.state
        engine.step({**actions, str(Role.CO_WIZARD): turn.action.encode(engine.limits)})
        yield turn


def memories(row: str, engine: SessionEngine) -> list[WorkingMemory]:
    return [turn.memory for turn in turns(row, engine)]


def test_full_is_the_shipped_policy(engine: SessionEngine) -> None:
    full = list(turns("full", engine))
    assert any(turn.memory.goal is not None for turn in full) and any(turn.memory.navigator.arrives for turn in full)
    assert any(turn.remarks for turn in full)
    assert len({turn.action.physical.action for turn in full if turn.action.physical is not None}) > 1


def test_frozen_listening_sets_no_goal_and_keeps_the_memory(engine: SessionEngine) -> None:
    kept = memories("frozen-listening", engine)
    assert len({memory.values for memory in kept}) == 1 and {memory.goal for memory in kept} == {None}


def test_without_route_goals_are_set_and_nothing_is_planned(engine: SessionEngine) -> None:
    kept = memories("without-route", engine)
    assert any(memory.goal_mark >= 0 for memory in kept)
    assert not any(memory.navigator.arrives or memory.navigator.goal for memory in kept)


def test_random_commands_are_drawn_among_all_that_are_legal(engine: SessionEngine) -> None:
    drawn = {turn.action.physical for turn in turns("random-commands", engine)}
    assert None in drawn and len(drawn) > 4


def test_a_rule_commands_what_the_memory_holds(engine: SessionEngine) -> None:
    full, ruled = list(turns("full", engine)), list(turns("ruled-commands", engine))
    assert full[0].memory.values == ruled[0].memory.values
    given = [turn.action.physical for turn in ruled if turn.action.physical is not None]
    assert given and [turn.action.physical for turn in full] != [turn.action.physical for turn in ruled]


def test_silent_says_nothing(engine: SessionEngine) -> None:
    said = list(turns("silent", engine))
    assert not any(turn.remarks or turn.action.speech for turn in said)
    assert any(turn.memory.goal is not None for turn in said), "it listens"


def test_without_answers_no_form_of_the_answer_can_be_drawn(engine: SessionEngine) -> None:
    folder = pretrained_folder("pretrained:co-wizard")
    row, full = (make(name, folder, Role.CO_WIZARD, engine.limits) for name in ("without-answers", "full"))
    changed = [number for number, (a, b) in enumerate(zip(row._needs, full._needs, strict=True)) if a != b]
    assert changed == [number for number, needs in enumerate(full._needs) if "answer" in needs] != []


@pytest.mark.parametrize("row", ["without-rules", "random-remarks"])
def test_rows_of_talk_change_remarks(row: str, engine: SessionEngine) -> None:
    full = [turn.remarks for turn in turns("full", engine)]
    assert [turn.remarks for turn in turns(row, engine)] != full
