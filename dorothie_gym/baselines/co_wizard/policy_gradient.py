"""Proximal policy optimisation of how the learned Co-Wizard acts: its commands and its first remarks.

PPO with generalised advantage estimation (Schulman et al., arXiv:1707.06347 and 1506.02438), and a penalty for the
divergence from the network before (Jaques et al., ICML 2017), so that its talk stays that of the corpus. How it listens
stays as it was learnt.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.nn.functional import log_softmax, logsigmoid

from dorothie_gym.baselines.co_wizard.experience import Experience
from dorothie_gym.baselines.co_wizard.network import WIDTH, CoWizardNetwork
from dorothie_gym.baselines.co_wizard.policy import TEMPERATURE


@dataclass(frozen=True, kw_only=True)
class Optimisation:
    """Settings of the optimisation.

    Attributes:
        command_temperature: temperature at which commands are drawn.
        discount: factor on the reward of the next decision; 0.998 halves it in about three minutes.
        trace: decay of generalised advantage estimation.
        rate: learning rate.
        passes: greatest number of passes over an experience.
        batch_size: number of decisions of a step.
        clip: range of the ratio of probabilities.
        divergence: mean divergence from the policy that has played, at which an optimisation ends [nats].
        penalty: weight of the divergence from the network before reinforcement.
    """

    command_temperature: float = 0.5
    discount: float = 0.998
    trace: float = 0.95
    rate: float = 1e-4
    passes: int = 4
    batch_size: int = 1024
    clip: float = 0.2
    divergence: float = 0.02
    penalty: float = 0.05


@dataclass(frozen=True, kw_only=True)
class Progress:
    """Figures of an optimisation.

    Attributes:
        decisions: number of decisions.
        sessions: number of sessions.
        reward: mean sum of the rewards of a session.
        divergence: mean divergence from the policy that has played [nats].
        distance: mean divergence from the network before reinforcement [nats].
        explained: share of the variance of the returns that the estimated values explain.
    """

    decisions: int
    sessions: int
    reward: float
    divergence: float
    distance: float
    explained: float


class ValueNetwork(nn.Module):
    """Estimates the discounted sum of the rewards that are still to come from the state (b, s)."""

    def __init__(self, state: int) -> None:
        super().__init__()
        self.layers = nn.Sequential(
            nn.Linear(state, WIDTH), nn.ReLU(), nn.Linear(WIDTH, WIDTH), nn.ReLU(), nn.Linear(WIDTH, 1)
        )

    def forward(self, state: Tensor) -> Tensor:
        """Returns the values (b,)."""
        values: Tensor = self.layers(state).squeeze(1)
        return values


def improve(
    network: CoWizardNetwork, values: ValueNetwork, before: CoWizardNetwork, found: Experience,
    settings: Optimisation, seed: int,
) -> Progress:  # fmt: skip
    """Improves a policy by the experience of whole sessions that it has played.

    Args:
        network: the network that has played; its part that acts is changed.
        values: estimator of the values; it is changed.
        before: network before reinforcement.
        found: the experience.
        settings: settings.
        seed: seed of the order of the decisions.
    """
    played, before = copy.deepcopy(network), before.eval()
    estimates = _in_parts(found, lambda part: values(part.state.float()))
    advantages, returns = advantages_of(found, estimates, settings)
    scaled = (advantages - advantages.mean()) / (advantages.std() + 1e-8)
    old = _in_parts(found, lambda part: log_chance(played, part, settings))
    optimiser = torch.optim.Adam([*acting_parameters(network), *values.parameters()], lr=settings.rate)
    generator = torch.Generator().manual_seed(seed)
    for rows in _batches(len(found), settings, generator):
        part = found.rows(rows)
        ratio = (log_chance(network, part, settings) - old[rows]).exp()
        bounded = ratio.clamp(1.0 - settings.clip, 1.0 + settings.clip)
        gain = torch.minimum(ratio * scaled[rows], bounded * scaled[rows]).mean()
        error = (values(part.state.float()) - returns[rows]).square().mean()
        loss = error - gain + settings.penalty * divergence(network, before, part, settings).mean()
        optimiser.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_([*acting_parameters(network), *values.parameters()], 1.0)
        optimiser.step()
        if float(divergence(network, played, part, settings).mean().detach()) > settings.divergence:
            break
    sessions = int(found.last.sum())
    return Progress(
        decisions=len(found), sessions=sessions, reward=float(found.reward.sum()) / sessions,
        divergence=float(_in_parts(found, lambda part: divergence(network, played, part, settings)).mean()),
        distance=float(_in_parts(found, lambda part: divergence(network, before, part, settings)).mean()),
        explained=1.0 - float((returns - estimates).var() / returns.var().clamp(min=1e-8)),
    )  # fmt: skip


def acting_parameters(network: CoWizardNetwork) -> list[nn.Parameter]:
    """Returns the parameters that reinforcement changes: those of commands and remarks, without the words'."""
    parts = (network.acting, network.command, network.first, network.second, network.remarks)
    return [parameter for part in parts for parameter in part.parameters()]


def advantages_of(found: Experience, values: Tensor, settings: Optimisation) -> tuple[Tensor, Tensor]:
    """Returns the advantages of the choices, and the returns (n,) that the values are to estimate.

    A session that runs out of time has ended: nothing is expected behind its end.

    Args:
        found: whole sessions.
        values: estimated values (n,).
        settings: settings.
    """
    advantages = torch.zeros_like(values)
    after = gain = 0.0
    for k in range(len(values) - 1, -1, -1):
        if found.last[k]:
            after = gain = 0.0
        value = float(values[k])
        gain = float(found.reward[k]) + settings.discount * after - value + settings.discount * settings.trace * gain
        advantages[k], after = gain, value
    return advantages, advantages + values


def log_chance(network: CoWizardNetwork, part: Experience, settings: Optimisation) -> Tensor:
    """Returns the logarithm of the probability of the choices (b,), at the temperatures of the player."""
    commands, first = _acted(network, part)
    chosen = log_softmax(commands / settings.command_temperature, dim=1).gather(1, part.command.long()[:, None])[:, 0]
    first = first / TEMPERATURE
    number = part.first.long()
    silent = log_softmax(first, dim=1)[:, 0]
    form = number.clamp(min=1)
    open_forms = part.possible.clone()
    open_forms[torch.arange(len(form)), form] = True  # a row without a drawn form has none; its value is not used
    among = log_softmax(first.masked_fill(~open_forms, -1e9), dim=1).gather(1, form[:, None])[:, 0]
    speaks = logsigmoid(first[:, 1:].logsumexp(dim=1) - first[:, 0]) + among
    remark = torch.where(number == 0, silent, torch.where(number > 0, speaks, torch.zeros_like(silent)))
    return chosen + remark


def divergence(network: CoWizardNetwork, other: CoWizardNetwork, part: Experience, settings: Optimisation) -> Tensor:
    """Returns the divergence of the choices of a network from those of another one (b,) [nats]."""
    commands, first = _acted(network, part)
    with torch.no_grad():
        other_commands, other_first = _acted(other, part)
    return _divergence(commands, other_commands, settings.command_temperature) + _divergence(
        first, other_first, TEMPERATURE
    )


def _divergence(scores: Tensor, others: Tensor, temperature: float) -> Tensor:
    own, other = log_softmax(scores / temperature, dim=1), log_softmax(others / temperature, dim=1)
    return (own.exp() * (own - other)).sum(dim=1)


def _acted(network: CoWizardNetwork, part: Experience) -> tuple[Tensor, Tensor]:
    """Returns the logits of the commands (b, k) and of the first remark (b, r)."""
    inputs = part.state.float(), part.words.long(), part.commands.float(), part.command_count.long()
    commands, first, _ = network.act(*inputs)
    return commands, first


def _in_parts(found: Experience, compute: Callable[[Experience], Tensor]) -> Tensor:
    """Returns a function of the decisions (n,), computed without gradients and in parts."""
    with torch.no_grad():
        return torch.cat([compute(found.rows(rows)) for rows in torch.split(torch.arange(len(found)), 4096)])


def _batches(count: int, settings: Optimisation, generator: torch.Generator) -> Iterator[Tensor]:
    for _ in range(settings.passes):
        yield from torch.split(torch.randperm(count, generator=generator), settings.batch_size)
