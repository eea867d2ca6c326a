"""Opportunities of driving plans: junctions and turnings that are counted, refused or passed by."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from dorothie_gym.dialogue.clause_moods import ORDERED
from dorothie_gym.dialogue.plan_frames import PASSING, REFUSING, PlanState, Refusal
from dorothie_gym.dialogue.routes import Anaphor, StepAction

if TYPE_CHECKING:
    from dorothie_gym.dialogue.plan_items import NounPhrase

_INITIAL: Final = frozenset(
    {"take", "makes", "make", "turn", "hang", "swing", "go", "want", "need", "have", "get", "be", "do"}
)
"""Verbs whose object can be an opportunity to turn: "take the second"."""


class OpportunityReader(PlanState):
    """Reads the opportunities to turn of a plan."""

    def read_opportunity(self, item: NounPhrase) -> None:
        """Reads an opportunity, which may be refused, or counted from one that has been."""
        passing = self.frame is not None and not self.fresh and self.frame.word in PASSING
        if item.follows and self.refused is not None:
            self.negation = None
        if item.follows and self.follow_refused():
            self.counting = self.opportunity = True
            return
        if item.ordinal is not None and self._counts_last(item):
            return
        if self.negation == "not" and self.pending.ordinal is not None and item.ordinal is not None:
            self.negation = None  # "the second, not the first"
            return
        if self.negation in REFUSING or passing:
            self.refused = Refusal(None, item.ordinal)
        self._opportunity(item.ordinal, blocks=item.blocks)

    def _counts_last(self, item: NounPhrase) -> bool:
        """Returns whether a number behind a comma counts the turn before it: "the right turn, the first one"."""
        last = next((frame for frame in reversed(self.frames) if frame.action is not None), None)
        if last is None or not self.fresh or self.joint != "," or item.blocks or self.negation is not None:
            return False
        apart = last.action is StepAction.TURN and last.direction is not None and last.ordinal is None
        somewhere = last.at is not None and last.at.reference not in (Anaphor.HERE, Anaphor.THERE)
        if not apart or somewhere or last.distance is not None or last.negated or self.repairing:
            return False
        last.ordinal, last.at = item.ordinal, None
        return True

    def _opportunity(self, ordinal: int | None, *, blocks: bool) -> None:
        self.counting = True
        self.opportunity = self.opportunity or not blocks
        if self.negation == "cancel" and ordinal is not None:
            self.open_step(StepAction.TURN)  # "skip the next turn"
            self.negation = None
            return
        if ordinal is None:
            frame = self.frame
            if frame is not None and not self.fresh and frame.action is StepAction.FOLLOW and frame.place is None:
                frame.action = StepAction.STRAIGHT  # "stay on this road"
            return
        frame = self.replaced(StepAction.TURN)
        if frame is None:
            frame = self.frame if self.frame is not None and not self.fresh else None
        turned = frame is not None and frame.action is StepAction.TURN and frame.direction is not None
        if blocks and turned and self.mood in ORDERED:
            self.open_step(StepAction.STRAIGHT).ordinal = ordinal  # "right at the KFC, two blocks, then left"
        elif frame is not None and frame.action in (StepAction.TURN, StepAction.STOP):
            frame.ordinal = ordinal if self.repaired or frame.ordinal is None else frame.ordinal
        elif frame is not None and frame.action is None and frame.verb in _INITIAL and not blocks:
            frame.action, frame.ordinal = StepAction.TURN, ordinal
        elif frame is not None and frame.action is StepAction.STRAIGHT and frame.at is None:
            frame.ordinal = ordinal  # "straight over two junctions"
        elif blocks and frame is not None and frame.action is None:
            frame.action, frame.ordinal = StepAction.STRAIGHT, ordinal
        elif blocks and self.mood in ORDERED and self.pending.at is None:
            self.open_step(StepAction.STRAIGHT).ordinal = ordinal  # "two blocks, then left"
        else:
            self.pending.ordinal = None if blocks else ordinal
