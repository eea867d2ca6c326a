"""Memory of the last heard utterance, which is observed for one decision only."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.dialogue import Direction
from dorothie_gym.ontology import LABELS, DialogueAct, DialogueMove, LandmarkName, Role
from dorothie_gym.policies.observation_parser import heard_utterance, scalar

RECENT = 20.0
"""Scale of the age of an utterance [s]."""

HEARD_SIZE = len(DialogueMove) + len(LABELS) + len(Direction) + 1
"""Size of the features: one-hot move, slots, one-hot direction, age."""


@dataclass(frozen=True, kw_only=True)
class HeardRemark:
    """Last act of an utterance, the direction of its words, and the time at which it was heard [s]."""

    act: DialogueAct
    direction: Direction | None
    time: float

    @property
    def landmark(self) -> LandmarkName | None:
        """Landmark that the utterance names."""
        found = (value for value in self.act.ordered if isinstance(value, LandmarkName))
        return next((name for name in found if name not in (LandmarkName.UNKNOWN, LandmarkName.QUERIED)), None)

    def vector(self, now: float) -> NDArray[np.float32]:
        """Returns the features of the utterance (HEARD_SIZE,) in 0..1, at a time [s]."""
        values = self._content.copy()
        values[-1] = min((now - self.time) / RECENT, 1.0)
        return values

    @cached_property
    def _content(self) -> NDArray[np.float32]:
        """Features without the age."""
        move = [float(int(self.act.move) == k) for k in range(len(DialogueMove))]
        direction = [float(self.direction is known) for known in Direction]
        return np.array([*move, *self.act.vector, *direction, 0.0], dtype=np.float32)


def listen(observation: Mapping[str, Any], speaker: Role, before: HeardRemark | None) -> HeardRemark | None:
    """Returns the last utterance of a speaker: the one just heard, or the one before.

    Args:
        observation: of the listener.
        speaker: the speaker.
        before: the utterance heard before.
    """
    said = heard_utterance(observation, speaker)
    if said is None or not said.acts:
        return before
    return HeardRemark(act=said.acts[-1], direction=said.words.direction, time=scalar(observation, "time"))
