"""Experience of the learned Co-Wizard: what it chose in the sessions that it has played, and the rewards."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from dorothie_gym.baselines.co_wizard.demonstrations import TRAINED, observed
from dorothie_gym.baselines.co_wizard.policy import Choice, LearnedCoWizard
from dorothie_gym.baselines.imitation.batches import TensorBatch, reals, whole
from dorothie_gym.engine.session_engine import SessionEngine
from dorothie_gym.ontology.roles import Role
from dorothie_gym.policies.participant.policy import ScriptedParticipant
from dorothie_gym.policies.policy import AnyPolicy, policy_inputs, policy_seed


@dataclass(frozen=True, eq=False)
class Experience(TensorBatch):
    """Decisions in order; the first axis of each tensor is that of the decisions.

    Attributes:
        state: state and utterances (n, s), float16.
        words: rows of the words of the latest utterance (n, w), int16.
        commands: vectors of the commands (n, k, c), float16.
        command_count: number of commands (n,), int16.
        command: index of the chosen one (n,), int16.
        first: number of the first remark; 0 for silence, `UNKNOWN` if none could be chosen (n,), int16.
        possible: whether each form of a remark could be drawn (n, r), bool.
        reward: reward of the decision (n,), float32.
        last: whether it is the last one of its session (n,), bool.
    """

    state: Tensor
    words: Tensor
    commands: Tensor
    command_count: Tensor
    command: Tensor
    first: Tensor
    possible: Tensor
    reward: Tensor
    last: Tensor


def play(player: LearnedCoWizard, engine: SessionEngine, seed: int, ad_wizard: AnyPolicy) -> Experience:
    """Plays a session with a scripted participant that is not of the held-out personas; returns the decisions.

    Args:
        player: the Co-Wizard.
        engine: engine of the town.
        seed: seed of the session.
        ad_wizard: the Ad-Wizard.
    """
    engine.reset(seed=seed)
    others: Mapping[Role, AnyPolicy] = {
        Role.PARTICIPANT: ScriptedParticipant(engine.limits, traits=TRAINED),
        Role.AD_WIZARD: ad_wizard,
    }
    states = {role: policy.initial_state(policy_seed(seed, role), engine.town) for role, policy in others.items()}
    state = player.initial_state(policy_seed(seed, Role.CO_WIZARD), engine.town)
    choices: list[Choice] = []
    rewards: list[float] = []
    while not engine.over:
        inputs, actions = policy_inputs(engine, others), {}
        for role, policy in others.items():
            actions[str(role)], states[role] = policy.step(inputs[role], states[role])
        turn = player.play(observed(engine), state)
        state = turn.state
        outcome = engine.step({**actions, str(Role.CO_WIZARD): turn.action.encode(engine.limits)})
        choices.append(turn.choice)
        rewards.append(sum(outcome.reward_terms[Role.CO_WIZARD].values()))
    return _experience(choices, rewards)


def _experience(choices: Sequence[Choice], rewards: Sequence[float]) -> Experience:
    last = torch.zeros(len(choices), dtype=torch.bool)
    last[-1] = True
    return Experience(
        state=reals([choice.inputs.state for choice in choices]),
        words=torch.from_numpy(np.stack([choice.inputs.words for choice in choices]).astype(np.int16)),
        commands=reals([choice.inputs.options for choice in choices]),
        command_count=whole([len(choice.inputs.rows) for choice in choices]),
        command=whole([choice.command for choice in choices]),
        first=whole([choice.first for choice in choices]),
        possible=torch.from_numpy(np.stack([choice.possible for choice in choices])),
        reward=torch.tensor(rewards, dtype=torch.float32),
        last=last,
    )
