"""The network of the learned Co-Wizard: two steps of a decision, listening and acting, over one word embedding."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import torch
from torch import Tensor, nn

from dorothie_gym.baselines.roles.co_wizard.features import COMMAND_SIZE, PLACE_SIZE, STATE_SIZE
from dorothie_gym.baselines.roles.co_wizard.memory import FRESH, STATUSES, VARIABLES, GoalEvent
from dorothie_gym.baselines.roles.learned_role.hearing import KEPT, UTTERANCE_SIZE
from dorothie_gym.baselines.roles.learned_role.network import (
    REMARK_WIDTH,
    WIDTH,
    WORD_WIDTH,
    RoleNetwork,
    following_remark,
    hidden_layers,
    without_missing,
)

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
        return cls(state=STATE_SIZE + KEPT * UTTERANCE_SIZE, place=PLACE_SIZE, command=COMMAND_SIZE, remarks=remarks)


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
