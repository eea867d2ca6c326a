"""Waits and starts of driving plans: which of their words order one, and which only fill a pause."""

from __future__ import annotations

from typing import Final

from dorothie_gym.dialogue.clause_moods import ClauseMood
from dorothie_gym.dialogue.plan_frames import PlanState
from dorothie_gym.dialogue.routes import StepAction

_HOLDING: Final = frozenset({"hang", "hold"})
"""First words of a wait that may as well be a pause of the speaker."""


class WaitReader(PlanState):
    """Reads the waits and starts of a plan."""

    def drop_interjection(self) -> None:
        """Takes back a "wait" that only opens what is asked or ordered: "hang on, can you see the bridge?"."""
        acting = [frame for frame in self.frames if frame.action is not None]
        waits = [frame for frame in acting if frame.action is StepAction.WAIT and frame.ends and frame.at is None]
        if self.repaired and len(acting) > len(waits):
            for frame in waits:
                frame.action = None  # "to the KFC, hang on, make that the Ikea"
        for frame in acting[:-1]:
            if frame.action is StepAction.WAIT and frame.word in _HOLDING and frame.at is None and frame.ends:
                frame.action = None  # "right, then hang on, then left"
        first = self.frames[0] if self.frames else None
        if first is None or first.action is not StepAction.WAIT or first.at is not None or not first.ends:
            return
        if (
            self.repaired
            or ClauseMood.QUESTION in self.moods
            or any(frame.action is not None for frame in self.frames[1:])
        ):
            first.action = None

    def start_ahead(self) -> None:
        """Makes a start of a "go ahead" that is all that is said: "yes, go ahead"."""
        acting = [frame for frame in self.frames if frame.action is not None]
        if len(acting) != 1 or acting[0].action is not StepAction.STRAIGHT:
            return
        only = acting[0]
        if (only.word, only.last) == ("go", "ahead") and only.ends and only.at is None and only.distance is None:
            only.action = StepAction.GO
