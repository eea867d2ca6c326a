"""Repetitions in driving plans: what is only said again, or named to be corrected, is no step of its own."""

from __future__ import annotations

import itertools

from dorothie_gym.dialogue.clause_moods import ClauseMood
from dorothie_gym.dialogue.plan_frames import Frame, PlanState
from dorothie_gym.dialogue.routes import Anaphor, StepAction


class RepetitionReader(PlanState):
    """Takes back the steps of a plan that only repeat others."""

    def drop_denied_name(self) -> None:
        """Drops a street that is only named to be corrected: "not Hayward, Hubbard"."""
        for before, frame in itertools.pairwise(self.frames):
            names = before.action is StepAction.FOLLOW and before.negated and not before.forbidden and not before.word
            if names and not before.verb and frame.action is StepAction.FOLLOW and frame.bare:
                before.action = None

    def drop_repeated(self) -> None:
        """Drops turns that are only said again, and an errand to the place of another step: "left there, go there"."""
        turns = [frame for frame in self.frames if frame.action is not None and frame.mood is not ClauseMood.STATEMENT]
        for before, frame in itertools.pairwise(turns):
            same = frame.action is StepAction.TURN and before.action is StepAction.TURN and not before.negated
            placed = same and frame.joint == "," and before.at is not None and before.at == frame.at
            placed = placed and (before.direction, before.ordinal) == (frame.direction, frame.ordinal)
            counted = same and frame.joint in ("", ",") and frame.ordinal is not None and _counts_same(before, frame)
            if counted or placed or (same and frame.joint == "," and _says_again(before, frame)):
                frame.relation, frame.at = frame.relation or before.relation, frame.at or before.at
                frame.ordinal, frame.distance = frame.ordinal or before.ordinal, frame.distance or before.distance
                before.action = None
        sides = {frame.direction for frame in turns if frame.action is StepAction.TURN}
        if len(sides) > 1:
            return
        for frame in turns[1:]:
            there = frame.place is not None and frame.place.reference is Anaphor.THERE
            if frame.action is StepAction.VISIT and there:
                frame.action = None


def _says_again(before: Frame, frame: Frame) -> bool:
    """Returns whether a turn behind a comma is the one before it, with the same or with more detail."""
    if before.direction is not frame.direction or frame.direction is None or frame.verb or frame.word:
        return False
    pairs = ((before.ordinal, frame.ordinal), (before.at, frame.at), (before.distance, frame.distance))
    return all(old is None or new is None or old == new for old, new in pairs) and all(old is None for old, _ in pairs)


def _counts_same(before: Frame, frame: Frame) -> bool:
    """Returns whether two turns are the same counted one: "second right, I think it is, yes, second right"."""
    same = (before.direction, before.ordinal) == (frame.direction, frame.ordinal)
    return same and (before.at is None or frame.at is None or before.at == frame.at)
