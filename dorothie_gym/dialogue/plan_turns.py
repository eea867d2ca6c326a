"""Turns, lanes and sides of driving plans."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from dorothie_gym.dialogue.clause_moods import ClauseMood
from dorothie_gym.dialogue.plan_frames import (
    NEEDING_PLACE,
    NEGATING,
    PASSING,
    REFUSING,
    Frame,
    PlanState,
    Refusal,
    with_details,
)
from dorothie_gym.dialogue.routes import Anaphor, ConditionRelation, PlaceReference, StepAction

if TYPE_CHECKING:
    from dorothie_gym.dialogue.direction import Direction
    from dorothie_gym.dialogue.plan_items import LaneItem, SideItem, TurnItem


_DOWN: Final = frozenset({"down", "up", "along", "go", "pop", "nip", "duck", "head"})
"""First words of an action that goes along a road: "pop down that road on your left"."""

_KEEPING: Final = frozenset({"keep", "stay", "staying", "move", "go", "pull", "edge", "nudge", "inch", "a", "bit"})
"""First words of an action straight on that may tell a side of the road instead."""


class TurnReader(PlanState):
    """Reads the turns, lanes and sides of a plan."""

    def __init__(self) -> None:
        """Begins without steps."""
        super().__init__()
        self.correcting = False  # whether the sentence holds a correction so far

    def read_turn(self, item: TurnItem) -> None:
        """Reads a direction to turn."""
        if self._passes(item) or self._denies_side():
            return
        item = item._replace(ordinal=self.counted_on(item.ordinal, item.direction))
        if self.negation in REFUSING:
            self.refused = Refusal(item.direction, item.ordinal)
        frame = self.replaced(StepAction.TURN, StepAction.LANE)
        if frame is not None:
            frame.direction = item.direction
            frame.ordinal = item.ordinal if item.ordinal is not None else frame.ordinal
            frame.negated = False
            return
        if self._says_again(item):
            return
        if self._directs(item):
            return
        named = self._bare_street()
        frame = self.open_step(StepAction.TURN)
        frame.direction = item.direction
        frame.ordinal = item.ordinal if item.ordinal is not None else frame.ordinal
        if named is not None and frame.at is None:
            frame.relation, frame.at = ConditionRelation.AT, named
        self._repeat(item)

    def counted_on(self, ordinal: int | None, direction: Direction | None) -> int | None:
        """Returns the number of "the next right" behind a refused turn: "not this one, the next right"."""
        refused = self.refused
        if refused is None or refused.ordinal is not None or ordinal != 1 or self.negation in REFUSING:
            return ordinal
        if direction is not None and refused.direction not in (None, direction):
            return ordinal  # "not this left, the next right"
        self.drop_refused()
        return 2

    def _directs(self, item: TurnItem) -> bool:
        """Returns whether a direction belongs to a step that has been named: "turn at the KFC, that's a right"."""
        frame = self._undirected()
        if frame is None:
            return False
        if frame is not self.frame or (frame.action is StepAction.LANE and frame.direction is None):
            frame.direction = item.direction  # "switch lanes, left"
            return True
        if self.fresh and not self._counts_apart(frame, item):
            return False
        if frame.action is StepAction.TURN and frame.direction is None:
            frame.direction = item.direction
            frame.ordinal = frame.ordinal or item.ordinal
            self._repeat(item)
            return True
        if frame.action is StepAction.U_TURN:
            return True
        if frame.action is None and frame.verb and frame.relation is ConditionRelation.UNTIL:
            self.close()  # "go until the KFC left"
            return False
        return self._turns(frame, item)

    def _counts_apart(self, frame: Frame, item: TurnItem) -> bool:
        """Returns whether a direction behind a comma is that of a counted turn: "take the next one, left"."""
        counted = frame.action is StepAction.TURN and frame.direction is None and frame.ordinal is not None
        passed = frame.at is None or frame.at.to_json().keys() == {"ordinal"}
        return counted and passed and item.ordinal is None and self.joint == ","

    def _turns(self, frame: Frame, item: TurnItem) -> bool:
        """Returns whether a direction makes a turn, or a change of lane, of the current step."""
        if frame.action is StepAction.STRAIGHT and frame.word in _DOWN and self.counting and frame.at is None:
            frame.action = None  # "down the alley to the right"
        getting = frame.word == "get" and frame.action is StepAction.VISIT and frame.place is None
        if getting or (frame.action is None and frame.verb == "get"):
            frame.action, frame.direction = StepAction.LANE, item.direction
            return True
        if frame.action is not None and (frame.action not in NEEDING_PLACE or frame.place is not None):
            return False
        avoided, frame.action = frame.action is StepAction.AVOID, StepAction.TURN
        if avoided:
            self.refused = Refusal(item.direction, item.ordinal)
        frame.direction, frame.ordinal = item.direction, item.ordinal or frame.ordinal
        frame.negated, frame.forbidden = avoided or self.negation in NEGATING, avoided or frame.forbidden
        self._repeat(item)
        return True

    def _undirected(self) -> Frame | None:
        """Returns the current step, or the last one if a new sentence only adds its side: "Switch lanes. Right."."""
        last = self.frames[-1] if self.frames else None
        if self.frame is None and last is not None and last.direction is None and len(self.frames) == self.begun:
            if last.action is StepAction.LANE or (last.action is StepAction.TURN and last.at is not None):
                return last
        return self.frame

    def _denies_side(self) -> bool:
        """Returns whether a direction is a side that is not meant: "stop on the right, not the left"."""
        last = self.frames[-1] if self.frames else None
        sided = last is not None and last.action is StepAction.STOP and last.side is not None
        return sided and self.negation in NEGATING

    def _passes(self, item: TurnItem) -> bool:
        """Returns whether a turn is one to be passed by: "ignore two lefts, take the third"."""
        frame = self.frame
        if frame is None or self.fresh or frame.word not in PASSING or frame.at is not None:
            return False
        frame.direction, frame.ordinal = item.direction, item.ordinal if item.ordinal != 1 else None
        if item.times > 1:
            frame.ordinal = item.times
        return True

    def _bare_street(self) -> PlaceReference | None:
        """Returns a street that has been named without a verb, and takes its step back: "Plymouth, and left"."""
        last = self.frames[-1] if self.frames else None
        if last is None or not last.bare or last.action is not StepAction.FOLLOW or last.place is None or last.at:
            return None  # no "Hubbard up to Hayward, right"
        self.frames.pop()
        self.frame = None
        return last.place

    def _says_again(self, item: TurnItem) -> bool:
        """Returns whether a turn behind a correction is the one said before: "no, LEFT, left at the lights"."""
        last = self.frames[-1] if self.frames else None
        if not self.correcting or last is None or last.action is not StepAction.TURN or self.repairing:
            return False
        here = last.at is not None and last.at.reference is Anaphor.HERE and self.pending.at is None
        if last.direction is not item.direction or (last.at is not None and not here):
            return False
        last.ordinal = item.ordinal or last.ordinal
        if self.pending.at is not None:
            last.relation, last.at, self.pending.at = self.pending.relation, self.pending.at, None
        self.frame, self.fresh = last, False
        return True

    def _repeat(self, item: TurnItem) -> None:
        """Adds the other turns of a number of them; what follows is about the first: "two lefts after the KFC"."""
        first = self.frame
        for _ in range(item.times - 1):
            self.open_step(StepAction.TURN).direction = item.direction
        self.frame = first

    def read_lane(self, item: LaneItem) -> None:
        """Reads a lane by its side."""
        last = self.frames[-1] if self.frames else None
        if last is not None and last.action is StepAction.LANE and last.direction is not None:
            if self.negation in NEGATING and not last.negated:
                return  # "the right lane, not the left"
        frame = self.replaced(StepAction.LANE, StepAction.TURN)
        if frame is None:
            frame = self.frame
            if frame is None or self.fresh or not _may_be_lane(frame):
                frame = self.open_step(StepAction.LANE)
        frame.action, frame.direction, frame.ordinal = StepAction.LANE, item.direction, None
        frame.negated = self.negation in NEGATING

    def read_side(self, item: SideItem) -> None:
        """Reads a side of the street."""
        turns = sum(frame.action in (StepAction.TURN, StepAction.LANE) for frame in self.frames)
        self._place_side(item)
        directed = [frame for frame in self.frames if frame.action in (StepAction.TURN, StepAction.LANE)]
        used = len(directed) > turns or any(frame.direction is item.direction for frame in directed)
        self.aside = self.aside or not used

    def _tells_place(self) -> bool:
        """Returns whether the sentence tells where something is: "my house is the one on the right"."""
        told = (frame for frame in self.frames[self.begun :] if frame.mood is ClauseMood.STATEMENT)
        return any(frame.action is StepAction.VISIT and frame.place is not None for frame in told)

    def _wants_side(self, frame: Frame) -> bool:
        """Makes a stop of a wish for a side, and returns whether it is one: "I need the left kerb"."""
        if frame.action is not None or frame.verb not in ("need", "want") or self.fresh:
            return False
        frame.action, frame.implied = StepAction.STOP, True
        return True

    def _place_side(self, item: SideItem) -> None:
        frame = self.replaced()
        if frame is not None and frame.side is not None:
            frame.side = item.direction
            return
        frame = self.frame
        counting = self.counting and not self._tells_place()
        if frame is None and counting:
            self.open_step(StepAction.TURN).direction = item.direction
        elif frame is None:
            self.pending.side = item.direction
        elif frame.action in (StepAction.TURN, StepAction.LANE) and frame.direction is None:
            frame.direction = item.direction
        elif frame.action is None and frame.verb in ("take", "turn", "make") and not self.fresh:
            frame.action, frame.direction = StepAction.TURN, item.direction  # "take the road on the right"
        elif counting and frame.action is not StepAction.STRAIGHT:
            self.open_step(StepAction.TURN).direction = item.direction
        elif frame.action in (StepAction.STOP, StepAction.WAIT) or self._wants_side(frame):
            frame.side = item.direction
        elif frame.action is StepAction.STRAIGHT and frame.word in _DOWN and counting and frame.at is None:
            frame.action, frame.direction = StepAction.TURN, item.direction
        elif frame.action is StepAction.VISIT and frame.place is not None:
            if item.stated and frame.mood is ClauseMood.STATEMENT:
                self.pending.side = item.direction  # "the house is on the left, stop there"
            else:
                frame.place = self.last_place = with_details(frame.place, side=item.direction)
        elif self.pending.ordinal is not None:
            opened = self.open_step(StepAction.TURN)
            opened.direction = item.direction
        else:
            self.pending.side = item.direction


def _may_be_lane(frame: Frame) -> bool:
    """Returns whether the lane named next is what a step asks for: "keep on the left", "move a bit to the right"."""
    keeps = frame.action is StepAction.STRAIGHT and frame.word in _KEEPING and frame.at is None and not frame.distance
    return keeps or (frame.action in (None, StepAction.LANE, *NEEDING_PLACE) and frame.place is None)
