"""Leftovers of driving plans: parts that have found no step when an utterance ends become one of their own."""

from __future__ import annotations

from typing import Final

from dorothie_gym.dialogue.clause_moods import ORDERED, ClauseMood
from dorothie_gym.dialogue.plan_frames import PlanState
from dorothie_gym.dialogue.routes import ConditionRelation, PlaceReference, StepAction
from dorothie_gym.ontology.slots import ObjectClass

_MOVING: Final = frozenset({ObjectClass.VEHICLES, ObjectClass.PEDESTRIAN, ObjectClass.DYNAMIC})
_PASSED: Final = frozenset({ConditionRelation.PAST, ConditionRelation.UNTIL})
_NEAR: Final = frozenset({ConditionRelation.OPPOSITE, ConditionRelation.BESIDE})
"""Relations by which a place alone tells where to stop."""
_BESIDE: Final = frozenset(
    {"by", "next", "beside", "near", "level", "opposite", "across", "just", "close", "alongside"}
)
"""First words of a sentence that only tells beside what to stop."""

_FEW: Final = 6
"""Words of a sentence that names nothing but a place to pass."""
_WARNING: Final = frozenset({"mind", "watch", "look", "careful", "beware", "see"})


class LeftoverReader(PlanState):
    """Makes steps of what waits for one when everything has been read."""

    def read_leftovers(self) -> None:
        """Makes a step of what waits for one: "the second", "on the right-hand side, please"."""
        acting = [frame for frame in self.frames if frame.action is not None]
        if self.pending.ordinal is not None and acting and acting[-1].action is StepAction.TURN and acting[-1].negated:
            self.open_step(StepAction.TURN)  # "not the next right, the third"
            return
        sided = self.pending.side is not None and self.moods[:1] != [ClauseMood.STATEMENT]
        told = sided and ClauseMood.QUESTION not in self.moods  # "left side please, he's asleep"
        if acting or not (told or ORDERED.issuperset(self.moods)):
            return
        short = self.opportunity and len(self.clauses.words) <= _FEW  # "second exit at the roundabout"
        if self.pending.ordinal is not None and self.negation is None and (len(self.moods) > 1 or short):
            self.open_step(StepAction.TURN)
        elif (
            self.pending.side is not None
            and len(self.clauses.words) == 3
            and self.clauses.words[2] in ("left", "right")
        ):
            self.open_step(StepAction.TURN).direction = self.pending.side  # "on the left", of the ways
            self.aside = False
        elif self.pending.side is not None and (self.opportunity or self._on_street()):
            side, self.pending.side, self.aside = self.pending.side, None, False
            turn = self.open_step(StepAction.TURN)  # "the turning we want is there on the left"
            turn.direction = side
        elif self.pending.side is not None and _WARNING.isdisjoint(self.clauses.words[:1]):
            self.open_step(StepAction.STOP).implied = True
        elif self.pending.bare_number is not None and len(self.clauses.words) <= 4:
            self.open_step(StepAction.SPEED)
        elif self.pending.at and self.pending.relation in _NEAR and self._stands(self.pending.at):
            self.open_step(StepAction.STOP).implied = True  # "next to the Shell, please"
        elif self.pending.at and self.pending.relation in _PASSED and len(self.clauses.words) <= _FEW:
            self._go_past(self.pending.at)
        elif self.pending.relation is ConditionRelation.AT and self.pending.at and self.pending.at.landmark:
            place, self.pending.at = self.pending.at, None
            self.open_step(StepAction.VISIT).place = place

    def _on_street(self) -> bool:
        """Returns whether only a street has been named: "Draper, on the right hand"."""
        last = self.last_place
        if last is None or last.to_json().keys() != {"street"}:
            return False
        self.pending.relation, self.pending.at = ConditionRelation.AT, last
        return True

    def _go_past(self, place: PlaceReference) -> None:
        """Orders to go on past a place, or along a street: "straight past the KFC", "by Hubbard"."""
        if place.to_json().keys() == {"street"}:
            self.pending.at = None
            self.open_step(StepAction.FOLLOW).place = place
        else:
            self.open_step(StepAction.STRAIGHT)

    def _stands(self, place: PlaceReference) -> bool:
        """Returns whether the words can tell to stop beside a place: by a landmark, or "by the hedge" alone."""
        fixed = place.object is not None and place.object not in _MOVING
        return place.landmark is not None or (fixed and self.clauses.words[0] in _BESIDE)
