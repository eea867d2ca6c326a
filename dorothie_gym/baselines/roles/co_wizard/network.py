"""The network of the learned Co-Wizard: two steps of a decision, listening and acting, over one word embedding."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
import torch
from torch import Tensor, nn

from dorothie_gym.baselines.roles.co_wizard.features import COMMAND_SIZE, PLACE_SIZE, STATE
from dorothie_gym.baselines.roles.co_wizard.memory import FRESH, STATUSES, VARIABLES, GoalEvent
from dorothie_gym.baselines.roles.learned_role.inference import (
    Dense,
    Floats,
    FollowingRemark,
    HiddenLayers,
    Scorer,
    numbers_of,
)
from dorothie_gym.baselines.roles.learned_role.network import (
    REMARK_WIDTH,
    WIDTH,
    WORD_WIDTH,
    RoleNetwork,
    following_remark,
    hidden_layers,
    without_missing,
)
from dorothie_gym.baselines.roles.learned_role.utterance_inputs import KEPT, UTTERANCE_SIZE

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from dorothie_gym.baselines.roles.learned_role.decision import InputBatch

SIZES: Final = tuple(VARIABLES.values())
OPTION_WIDTH: Final = 96
"""Width of the layer that scores options."""

DROPOUT: Final = 0.3
"""Share of the hidden units that are left out in training (Srivastava et al., JMLR 2014).

In the sessions of another training, a fit of 20 passes had a loss of 0.42 nats with it; a training without it, 0.53.
"""


@dataclass(frozen=True, kw_only=True)
class CoWizardLayout:
    """Lengths of the inputs and outputs.

    Attributes:
        state: length of state and utterances.
        place: length of the vector of a place.
        command: length of the vector of a command.
        remarks: size of the vocabulary of remarks.
    """

    state: int
    place: int
    command: int
    remarks: int

    @classmethod
    def of(cls, remarks: int) -> CoWizardLayout:
        """Returns the layout of this version for a vocabulary of a given size."""
        return cls(state=STATE.size + KEPT * UTTERANCE_SIZE, place=PLACE_SIZE, command=COMMAND_SIZE, remarks=remarks)


@dataclass(frozen=True, kw_only=True)
class Heard:
    """Outputs of listening: logits of the next memory values, of variables that are set again, of goal and status."""

    values: tuple[Tensor, ...]
    fresh: Tensor
    goal: Tensor
    status: Tensor


class CoWizardNetwork(RoleNetwork):
    """Scores the next memory, commands and remarks."""

    def __init__(self, layout: CoWizardLayout) -> None:
        super().__init__()
        self.layout = layout
        hot = sum(SIZES)
        self.listening = hidden_layers(layout.state + WORD_WIDTH, WIDTH, DROPOUT)
        self.values = nn.Linear(WIDTH, hot)
        self.kept = nn.Parameter(torch.full((hot,), 2.0))
        starts = torch.tensor([0, *SIZES[:-1]]).cumsum(0)
        self.register_buffer("starts", starts, persistent=False)
        self.starts: Tensor
        self.fresh = nn.Linear(WIDTH, len(FRESH))
        self.goal = nn.Linear(WIDTH, len(GoalEvent))
        self.place = _Scorer(layout.place)
        self.status = nn.Linear(WIDTH, len(STATUSES))
        self.acting = hidden_layers(layout.state + WORD_WIDTH, WIDTH, DROPOUT)
        self.command = _Scorer(layout.command)
        self.first = nn.Linear(WIDTH, layout.remarks)
        self.remarks = nn.Embedding(layout.remarks, REMARK_WIDTH)
        self.second = following_remark(layout.remarks)

    def listen(self, state: Tensor, words: Tensor, places: Tensor, count: Tensor, before: Tensor) -> Heard:
        """Returns the logits of the next memory.

        Args:
            state: (b, n).
            words: rows of the latest words (b, w).
            places: vectors of the places (b, k, p).
            count: number of places (b,).
            before: values of the memory (b, v).
        """
        hidden = self.hidden(self.listening, state, words)
        hot = torch.zeros(len(before), sum(SIZES)).scatter_(1, before + self.starts, 1.0)
        values = torch.split(self.values(hidden) + self.kept * hot, list(SIZES), dim=1)
        goal = torch.cat([self.goal(hidden), self.place(hidden, places, count)], dim=1)
        return Heard(values=values, fresh=self.fresh(hidden), goal=goal, status=self.status(hidden))

    def act(self, state: Tensor, words: Tensor, commands: Tensor, count: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Returns the logits of the commands (b, k) and of the first remark (b, r), and the hidden layer for `then`."""
        hidden = self.hidden(self.acting, state, words)
        return self.command(hidden, commands, count), self.first(hidden), hidden

    def then(self, hidden: Tensor, first: Tensor) -> Tensor:
        """Returns the logits of the second remark (b, r) after a first one (b,)."""
        scores: Tensor = self.second(torch.cat([hidden, self.remarks(first)], dim=1))
        return scores


class _Scorer(nn.Module):
    """Scores options by a hidden layer of the state: two layers over both, the first one a sum of two."""

    def __init__(self, option: int) -> None:
        super().__init__()
        self.hidden = nn.Linear(WIDTH, OPTION_WIDTH)
        self.option = nn.Linear(option, OPTION_WIDTH, bias=False)
        self.last = nn.Linear(OPTION_WIDTH, 1)

    def forward(self, hidden: Tensor, options: Tensor, count: Tensor) -> Tensor:
        """Returns the score of each option (b, k), almost minus infinity for those that are only filled in."""
        both = torch.relu(self.hidden(hidden)[:, None, :] + self.option(options))
        return without_missing(self.last(both).squeeze(2), count)


# --- In play ----------------------------------------------------------------------------------------------------------


class HeardNumbers(NamedTuple):
    """Outputs of listening in play, see `Heard`: logits (b, ...)."""

    values: Floats
    fresh: Floats
    goal: Floats
    status: Floats


class CoWizardInference:
    """Forward passes of a trained network in play, with equal results in batches of any size."""

    def __init__(self, network: CoWizardNetwork) -> None:
        """Copies the parameters of a network."""
        self._listening, self._acting = (HiddenLayers(network, each) for each in (network.listening, network.acting))
        self._values, self._fresh = Dense(network.values), Dense(network.fresh)
        self._goal, self._status = Dense(network.goal), Dense(network.status)
        self._kept, self._starts = numbers_of(network.kept), network.starts.numpy()
        self._place, self._command = (
            Scorer(Dense(each.hidden), Dense(each.option), each.last) for each in (network.place, network.command)
        )
        self._first, self.then = Dense(network.first), FollowingRemark(network.remarks, network.second)

    def listen(self, batch: InputBatch, before: NDArray[np.int64]) -> HeardNumbers:
        """Returns the logits of the next memory; `before` are the values of the memory (b, v)."""
        hidden = self._listening(batch)
        values = self._values(hidden)
        kept = before + self._starts
        values[np.arange(len(values))[:, None], kept] += self._kept[kept]
        goal = np.concatenate([self._goal(hidden), self._place(hidden, batch.options, batch.counts)], axis=1)
        return HeardNumbers(values, self._fresh(hidden), goal, self._status(hidden))

    def act(self, batch: InputBatch) -> tuple[Floats, Floats, Floats]:
        """Returns the logits of the commands (b, k) and of the first remark (b, r), and the hidden layer for `then`."""
        hidden = self._acting(batch)
        return self._command(hidden, batch.options, batch.counts), self._first(hidden), hidden
