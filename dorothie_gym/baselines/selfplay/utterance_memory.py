"""What was said last: observed for one decision, remembered until something else is said."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.dialogue import Direction
from dorothie_gym.ontology import LABELS, DialogueAct, DialogueMove, LandmarkName, Role
from dorothie_gym.policies.observation_parser import scalar
from dorothie_gym.policies.utterance_input import heard_utterance

RECENT = 20.0
"""The age of what was said is a share of this [s]."""

HEARD_SIZE = len(DialogueMove) + len(LABELS) + len(Direction) + 1
"""Numbers of one remark: one-hot move, slots, one-hot direction, age."""


@dataclass(frozen=True, kw_only=True)
class HeardRemark:
    """The last act of what somebody said, the direction that its words have, and when it was heard [s]."""

    act: DialogueAct
    direction: Direction | None
    time: float

    @property
    def landmark(self) -> LandmarkName | None:
        """The place that it names."""
        found = (value for value in self.act.ordered if isinstance(value, LandmarkName))
        return next((name for name in found if name not in (LandmarkName.UNKNOWN, LandmarkName.QUERIED)), None)

    def vector(self, now: float) -> NDArray[np.float32]:
        """The remark as numbers (HEARD_SIZE,) in 0..1, at a time [s]."""
        values = self._content.copy()
        values[-1] = min((now - self.time) / RECENT, 1.0)
        return values

    @cached_property
    def _content(self) -> NDArray[np.float32]:
        """All but the age."""
        move = [float(int(self.act.move) == k) for k in range(len(DialogueMove))]
        direction = [float(self.direction is known) for known in Direction]
        return np.array([*move, *self.act.vector, *direction, 0.0], dtype=np.float32)


def listen(observation: Mapping[str, Any], speaker: Role, before: HeardRemark | None) -> HeardRemark | None:
    """What a listener has in mind of a speaker: what it has just heard, else what it heard before.

    Args:
        observation: of the listener.
        speaker: who may have spoken.
        before: what was heard before.
    """
    said = heard_utterance(observation, speaker)
    if said is None or not said.acts:
        return before
    return HeardRemark(act=said.acts[-1], direction=said.words.direction, time=scalar(observation, "time"))
