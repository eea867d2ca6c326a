"""Places of driving plans: conditions, errands, and streets to follow or avoid."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Final

from dorothie_gym.dialogue.clause_moods import ORDERED, ClauseMood
from dorothie_gym.dialogue.plan_frames import (
    FORBIDDING,
    NEEDING_PLACE,
    NEGATING,
    Frame,
    PlanState,
    Refusal,
    with_details,
)
from dorothie_gym.dialogue.routes import Anaphor, ConditionRelation, PlaceReference, StepAction
from dorothie_gym.ontology.slots import LandmarkName, ObjectClass

if TYPE_CHECKING:
    from dorothie_gym.dialogue.plan_items import ConditionItem, NounPhrase

_FETCHING: Final = frozenset(
    [
        *("fetch", "fetching", "grab", "grabbing", "meet", "meeting", "collect"),
        *("collecting", "pick", "picking", "scoop", "scooping", "after", "once"),
    ]
)
"""First words of phrases by which somebody is fetched."""

_CALLING: Final = frozenset({"swing", "pop", "drop", "call", "come", "nip"})
"""First words of phrases with a "for" by which somebody is fetched: "swing by for my brother"."""

_LATER: Final = frozenset({ConditionRelation.AFTER, ConditionRelation.BEFORE, ConditionRelation.SEEN})
"""Relations of an errand to another place than its own."""

_PASSED: Final = frozenset({ConditionRelation.PAST, ConditionRelation.AFTER})
"""Relations to places that are driven by."""

_ENDING: Final = frozenset({ConditionRelation.PAST, ConditionRelation.UNTIL})
"""Relations to a place up to which a stretch is driven."""

_ALONG: Final = frozenset({"on", "along", "up", "down"})
"""Last words of an order to go on behind which a street is the one to go along."""

_OVERTAKING: Final = frozenset({"pass", "passing", "overtake", "overtaking"})
_ROUND: Final = frozenset({"round", "around", "past", "by"})
"""Last words of an order to get past another vehicle."""


class PlaceReader(PlanState):
    """Reads the places of a plan."""

    def __init__(self) -> None:
        """Begins without places."""
        super().__init__()
        self.reaching: Frame | None = None  # step that ends at the next place: "down to" of "take Fuller down to"
        self.person = False  # whether somebody is to be fetched

    def read_condition(self, item: ConditionItem) -> None:
        """Reads a condition, for the current step or for the next one."""
        place = self._place_of(item)
        known = self.pending.at is not None and item.relation is ConditionRelation.AT
        if item.place is None and (self._is_about(place) or known):
            return  # "just past the KFC, that's where you stop"
        if place is None:
            if item.place is not None and item.place.ordinal is not None:
                self._counted(item.relation, self._number_of(item.place, item.place.ordinal))
            return
        if self._excludes(place, item.relation):
            return
        if place.reference is None and not self._describes(place):
            self.last_place = self._located(place) if item.relation is ConditionRelation.AT else place
        if self.repairing and (frame := self.replaced()) is not None and frame.at is not None:
            frame.relation, frame.at = item.relation, place
            return
        if self.negation == "instead":
            self.negation = None
            return
        frame = self.frame
        direct = frame is not None and self._takes(frame, place)
        if frame is not None and self._passes_next(frame, item.relation):
            frame = self.open_step(StepAction.STRAIGHT)  # "past the KFC, over the bridge"
        if frame is not None and not self.fresh and direct and (frame.action is not None or frame.verb):
            self.attach(frame, item.relation, place)
        elif self.mood is not ClauseMood.STATEMENT:
            self.stop_between()
            self._pass_between(item.relation)
            self.pending.relation, self.pending.at = item.relation, place

    def _place_of(self, item: ConditionItem) -> PlaceReference | None:
        """Returns the place of a condition; that named last for "it", "there" or "the second"."""
        if item.place is None:
            return self.last_place
        if item.place.elliptical:
            return self._counted_alike(item.place.ordinal)
        place = item.place.reference
        there = place is not None and place.reference is Anaphor.THERE and self.last_place is not None
        return self.last_place if there else place

    def _number_of(self, opportunity: NounPhrase, ordinal: int) -> int:
        """Returns the number of an opportunity, which may be counted from a refused one: "left at the one after"."""
        refused = self.refused if opportunity.follows else None
        return ordinal if refused is None else (refused.ordinal or 1) + 1

    def _counted_alike(self, ordinal: int | None) -> PlaceReference | None:
        """Returns the object named last with another number: "straight at the first lights, left at the second"."""
        last = self.last_place
        alike = last is not None and last.object is not None and last.ordinal is not None
        return dataclasses.replace(last, ordinal=ordinal) if alike and last is not None else None

    def _is_about(self, place: PlaceReference | None) -> bool:
        """Makes the place of the next step of one that has been named for it: "the KFC is where you turn right"."""
        last = self.frames[-1] if self.frames else None
        if last is None or not last.bare or last.place is None or last.place != place:
            return False
        self.frames.pop()
        self.frame, self.fresh = None, True
        self.pending.relation, self.pending.at = ConditionRelation.AT, place
        return True

    def _takes(self, frame: Frame, place: PlaceReference) -> bool:
        """Returns whether a step has no place yet, or one that says less: "stop over there, where the people are"."""
        return frame.at is None or frame.borrowed or (self.is_vague(frame) and place.reference is None)

    def is_vague(self, frame: Frame) -> bool:
        """Returns whether the place of a step is only "here" or "there"."""
        return frame.at is not None and frame.at.reference in (Anaphor.HERE, Anaphor.THERE)

    def _passes_next(self, frame: Frame, relation: ConditionRelation) -> bool:
        """Returns whether another place is passed behind the one of a step."""
        goes_on = frame.borrowed and frame.action is StepAction.STRAIGHT and not self.fresh
        return goes_on and frame.relation in _PASSED and relation in _PASSED

    def _pass_between(self, relation: ConditionRelation) -> None:
        """Makes a step of a place that is passed before another one: "past the KFC, over the bridge, then left"."""
        waits = self.pending.at is not None and self.pending.relation in _PASSED
        if waits and self.fresh and relation in _PASSED and self.mood in ORDERED:
            self.open_step(StepAction.STRAIGHT)
            self.frame, self.fresh = None, True

    def _describes(self, place: PlaceReference) -> bool:
        """Returns whether a place only tells where another one is: "the house after the bridge"."""
        frame = self.frame
        if frame is None or self.fresh or frame.place is None or frame.action is not StepAction.VISIT:
            return False
        return frame.place.landmark is not None and place.landmark is None

    def _excludes(self, place: PlaceReference, relation: ConditionRelation) -> bool:
        """Returns whether a negated place is no condition: "not onto Beal, take Fuller", "not at the KFC"."""
        if self.negation in FORBIDDING and relation is ConditionRelation.BEFORE and self.frame is None:
            self.last_place = place  # "don't turn before Upland, turn left there"
            return True
        if self.negation != "not" or (self.frame is not None and self.frame.action is not None and not self.fresh):
            return False
        self.negation = None
        if _names_only_street(place) and self.mood in ORDERED and not self.repairing:
            self.open_step(StepAction.AVOID).place = place
            self.frame, self.fresh = None, True
        return True

    def stop_between(self) -> None:
        """Makes an errand of a place that has waited in vain for a step: "one at the Coco, one at the KFC"."""
        waiting = self.pending.at
        if waiting is not None and waiting.landmark is not None and self.pending.relation is ConditionRelation.AT:
            if (self.fresh and self.frame is None) or (self.fresh and self.frame is not None and self.frame.bare):
                self.pending.at = None
                self.open_step(StepAction.VISIT).place = waiting
                self.frame, self.fresh = None, True

    def attach(self, frame: Frame, relation: ConditionRelation, place: PlaceReference) -> None:
        """Puts a condition into the current step."""
        fetching = (
            frame.place is not None and frame.place.landmark is LandmarkName.PERSON and place.landmark is not None
        )
        if fetching:
            frame.relation, frame.at = ConditionRelation.AT, place  # "pick her up from the KFC"
        elif frame.action is StepAction.VISIT and frame.place is None and relation not in _LATER:
            if _names_only_street(place) and relation in (ConditionRelation.AT, ConditionRelation.BESIDE):
                frame.action = StepAction.FOLLOW  # "get us onto the highway", "go round by Murfin"
            frame.place = place
        elif self._orders_errands(frame, relation, place):
            pass
        elif frame.action is StepAction.VISIT and frame.place is not None and _names_only_street(place):
            frame.place = with_details(frame.place, street=place.street)
        elif frame.action is StepAction.VISIT and frame.place == place:
            pass  # "chicken at the KFC" names it twice
        elif (
            frame.action is StepAction.FOLLOW
            and frame.place is None
            and place.street is not None
            and not place.landmark
        ):
            frame.place = place
        elif frame.action is None and frame.verb == "be" and _names_only_street(place):
            frame.action, frame.place = StepAction.FOLLOW, place  # "you need to be on Division"
        elif frame.action is None and frame.verb == "be" and place.landmark is not None:
            frame.action, frame.place = StepAction.VISIT, place
        elif frame.action is None and frame.verb in ("have", "get", "want", "need") and place.landmark is not None:
            frame.action, frame.place = StepAction.VISIT, place
        else:
            turning = frame.action in (StepAction.TURN, StepAction.STRAIGHT, StepAction.LANE)
            beside = relation is ConditionRelation.BESIDE and turning and frame.action is not StepAction.LANE
            frame.borrowed = False
            frame.relation, frame.at = ConditionRelation.AT if beside else relation, place

    def _orders_errands(self, frame: Frame, relation: ConditionRelation, place: PlaceReference) -> bool:
        """Returns whether a relation puts two errands in order: "do the Shell before the Coco"."""
        errand = frame.action is StepAction.VISIT and frame.place is not None and frame.mood in ORDERED
        named = place.landmark is not None and frame.place != place
        if (
            not errand
            or not named
            or frame.negated
            or relation not in (ConditionRelation.BEFORE, ConditionRelation.AFTER)
        ):
            return False
        other = Frame(action=StepAction.VISIT, mood=frame.mood, place=place, contingent=frame.contingent)
        number = self.frames.index(frame)
        self.frames.insert(number + (relation is ConditionRelation.BEFORE), other)
        return True

    def _counted(self, relation: ConditionRelation, ordinal: int) -> None:
        """Puts "at the second junction" or "after the second crossing" into a step."""
        behind = relation in (ConditionRelation.AFTER, ConditionRelation.PAST)
        current = (
            self.frame if self.frame is not None and not self.fresh and self.frame.action is not None else self.pending
        )
        if current.action is StepAction.STRAIGHT and relation is ConditionRelation.PAST and current.at is None:
            current.ordinal = ordinal  # "go straight through two junctions"
        elif behind or current.action in (StepAction.STOP, StepAction.STRAIGHT):
            current.relation, current.at = relation, PlaceReference(ordinal=ordinal)
        else:
            current.ordinal = ordinal

    def read_place(self, place: PlaceReference) -> None:
        """Reads a place that no relation introduces."""
        if place.reference is None:
            self.last_place = place
        if self._ends_stretch(place) or self._cancels(place) or (self.repairing and self._corrected(place)):
            return
        if place.reference is Anaphor.HERE and self.negation == "not" and self.frame is None:
            self.refused = Refusal(None, None)  # "not here, the next one"
            return
        place = self._resolved(place)
        frame = self.frame
        if frame is None or self.fresh or frame.place is not None:
            self._bare(place)
        elif frame.action in NEEDING_PLACE or frame.verb == "leave":
            self._target(frame, place)
        elif frame.action is None:
            self._object_of_verb(frame, place)
        elif frame.action is StepAction.LANE and place.object is ObjectClass.VEHICLES:
            if frame.word in _OVERTAKING and frame.at is None:
                frame.relation, frame.at = ConditionRelation.PAST, place  # "overtake that lorry"
        elif frame.action is StepAction.LIGHTS and place.reference is not None:
            pass  # "it's dark out there"
        elif frame.at is None and frame.action is not StepAction.SPEED:
            self._object_of_action(frame, place)

    def _ends_stretch(self, place: PlaceReference) -> bool:
        """Returns whether a place ends the stretch of a street that is followed: "Fuller down to the bridge"."""
        frame, self.reaching = self.reaching, None
        if frame is None or frame.at is not None or self.fresh:
            return False
        frame.relation, frame.at = ConditionRelation.UNTIL, self._resolved(place)
        return True

    def _cancels(self, place: PlaceReference) -> bool:
        """Returns whether a place is given up: "skip the KFC"."""
        if self.negation != "cancel":
            return False
        self.negation = None
        if place.landmark is not None:
            self.cancelled.add(place.landmark)
        elif place.street is not None:
            self.open_step(StepAction.AVOID).place = place
        return True

    def _object_of_action(self, frame: Frame, place: PlaceReference) -> None:
        """Puts a place behind an action into its step: "turn right the KFC"."""
        crossed = frame.action is StepAction.STRAIGHT
        if crossed and place.reference is Anaphor.HERE:
            return  # "straight along here"
        if crossed and place.object is ObjectClass.VEHICLES and frame.word in _OVERTAKING:
            frame.action = StepAction.LANE  # "pass that bus on the left"
            frame.relation, frame.at = ConditionRelation.PAST, place
            return
        if crossed and place.landmark is LandmarkName.HOUSE and frame.last == "straight":
            frame.action, frame.place = StepAction.VISIT, place  # "go straight home"
            return
        if crossed and _names_only_street(place) and frame.last in _ALONG:
            frame.action, frame.place = StepAction.FOLLOW, place  # "straight on Bonisteel"
            return
        if frame.action is StepAction.GO and place.landmark is not None:
            frame.action, frame.place = StepAction.VISIT, place  # "go on home"
            return
        frame.relation = ConditionRelation.PAST if crossed else ConditionRelation.AT
        frame.at = place

    def _target(self, frame: Frame, place: PlaceReference) -> None:
        """Completes "take me to", "follow", "avoid" with a place."""
        if frame.action is StepAction.FOLLOW and (place.landmark or place.object is ObjectClass.BUILDING):
            self._lead_to(frame, place)
            return
        if frame.action is StepAction.VISIT and self._leads_along(frame, place):
            frame.action, frame.place = StepAction.FOLLOW, place
            return
        if frame.action is StepAction.TURN and frame.verb == "leave":
            if place.landmark is not None:
                frame.action, frame.place = StepAction.VISIT, place
            else:
                frame.relation, frame.at = ConditionRelation.FROM, place
        elif fetches(frame) and place.object is ObjectClass.PEDESTRIAN:
            self.fetch(frame, place)
        elif place.object is ObjectClass.VEHICLES and frame.last in _ROUND:
            frame.action = StepAction.LANE  # "go round this bus"
            frame.relation, frame.at = ConditionRelation.PAST, place
        elif frame.action is StepAction.VISIT and place.object is not None and frame.word in ("stop", "stopping"):
            frame.action, frame.relation, frame.at = StepAction.STOP, ConditionRelation.BESIDE, place
        elif frame.action is StepAction.VISIT and place.object is not None and place.landmark is None:
            frame.action, frame.relation, frame.at = StepAction.STRAIGHT, ConditionRelation.UNTIL, place
        else:
            frame.place = place
            if self.negation in NEGATING:
                frame.negated = True

    def fetch(self, frame: Frame, place: PlaceReference | None = None) -> None:
        """Makes somebody the aim of an errand: "pick up my nephew"."""
        street = place.street if place is not None else None
        frame.place = PlaceReference(landmark=LandmarkName.PERSON, street=street)
        self.person = self.person or frame.mood in ORDERED

    def _object_of_verb(self, frame: Frame, place: PlaceReference) -> None:
        if place.reference is Anaphor.HERE or place.reference is Anaphor.THERE:
            frame.relation, frame.at = ConditionRelation.AT, place
        elif place.reference is Anaphor.WAY_WE_CAME:
            frame.action, frame.place = StepAction.FOLLOW, place  # "take the same way back"
        elif place.landmark is not None:
            frame.action, frame.place = StepAction.VISIT, place
        elif place.street is not None and place.object is None:
            frame.action, frame.place = StepAction.FOLLOW, place
        frame.negated = self.negation in NEGATING

    def _bare(self, place: PlaceReference) -> None:
        """Reads a place without a verb: an errand, a street to take, or the place of what follows."""
        if place.reference is not None or place.object is not None:
            if self.mood is ClauseMood.STATEMENT and self.frame is None:
                return
            if self.fresh and self.mood is ClauseMood.STATEMENT:
                return  # "don't stop, I'm scared round here"
            if place.reference in (Anaphor.HERE, Anaphor.THERE) and self.frame is not None and self.frame.at is None:
                self.frame.relation, self.frame.at = ConditionRelation.AT, self._resolved(place)
            elif place.reference is Anaphor.WAY_WE_CAME:
                self._return_by(place)
            elif place.reference in (Anaphor.START, Anaphor.LAST_STOP):
                self.open_step(StepAction.VISIT).place = place
            elif place.reference is not None:
                self.pending.relation, self.pending.at = ConditionRelation.AT, self._resolved(place)
            return
        if place.landmark is not None and self._passes_on(place):
            return
        if place.landmark is not None:
            frame = self.open_step(StepAction.VISIT)
            frame.place, frame.bare = place, True
        elif self._adds_street(place):
            return
        elif self.negation in NEGATING or not self.pending.at:
            frame = self.open_step(StepAction.FOLLOW)
            frame.place, frame.bare = place, not frame.negated

    def _leads_along(self, frame: Frame, place: PlaceReference) -> bool:
        """Returns whether words of an errand name a way: "hit Fuller", "return by the same way"."""
        named = frame.word in ("grab", "grabbing", "hit") or frame.last in ("by", "via", "along")
        return place.reference is Anaphor.WAY_WE_CAME or (named and _names_only_street(place))

    def _lead_to(self, frame: Frame, place: PlaceReference) -> None:
        """Reads a place that no way is, behind words of following one."""
        frame.action = None  # "they tore down the old school"
        if place.landmark is not None and frame.word in ("via", "by", "go", "going"):
            self._visit_on_way(frame, place)  # "home by way of the KFC"

    def _visit_on_way(self, frame: Frame, place: PlaceReference) -> None:
        """Makes a place that the way leads by an errand in front of the one that it leads to."""
        before = self.frames.index(frame) - 1
        aimed = before >= 0 and self.frames[before].action is StepAction.VISIT and frame.joint in ("", ",")
        frame.action, frame.place = StepAction.VISIT, place
        if aimed and self.frames[before].place is not None:
            self.frames[before : before + 2] = [frame, self.frames[before]]

    def end_stretch(self) -> None:
        """Ends the stretch named last at a place behind it: "go down Hayward, past the KFC, and then left"."""
        last = self.frames[-1] if self.frames else None
        if last is None or self.pending.at is None or self.pending.relation not in _ENDING or last.at is not None:
            return
        if last.action in (StepAction.FOLLOW, StepAction.STRAIGHT) and last.distance is None and not last.negated:
            last.relation, last.at, self.pending.at = self.pending.relation, self.pending.at, None

    def _return_by(self, place: PlaceReference) -> None:
        """Orders to follow the way so far, also to the place named before it: "go home the way we came"."""
        visit = self.frame if self.frame is not None and not self.fresh else None
        self.open_step(StepAction.FOLLOW).place = place
        if visit is not None and visit.action is StepAction.VISIT and visit.place is not None:
            self.frames[-2:] = [self.frames[-1], visit]

    def _passes_on(self, place: PlaceReference) -> bool:
        """Goes on past a second place: "past the Burger King and the Shell"."""
        frame = self.frame
        if frame is None or frame.action is not StepAction.STRAIGHT or self.joint != "and":
            return False
        if frame.relation not in _PASSED or frame.at is None or frame.at.landmark is None:
            return False
        frame.at, self.fresh = place, False
        return True

    def _adds_street(self, place: PlaceReference) -> bool:
        """Gives the visited place right before it a street without a preposition: "take me to the house, um, Beal"."""
        frame = self.frame
        if frame is None or self.fresh or frame is not self.frames[-1] or frame.place is None:
            return False
        if frame.action is not StepAction.VISIT or frame.place.street is not None or not _names_only_street(place):
            return False
        frame.place = self.last_place = with_details(frame.place, street=place.street)
        return True

    def take_last_place(self) -> None:
        """Orders to visit, or to follow, the place named last: "the KFC, on Draper, go there"."""
        last = self.last_place
        if last is None or any(frame.place == last for frame in self.frames):
            return
        if last.landmark is not None:
            self.pending.at = None
            self.open_step(StepAction.VISIT).place = last
        elif last.street is not None:
            self.open_step(StepAction.FOLLOW).place = last

    def _located(self, place: PlaceReference) -> PlaceReference:
        """Returns the landmark named last with its street for a street alone: "the KFC, on Draper, go there"."""
        last = self.last_place
        if last is None or last.landmark is None or last.street is not None or not _names_only_street(place):
            return place
        return with_details(last, street=place.street)

    def _resolved(self, place: PlaceReference) -> PlaceReference:
        return self.last_place if place.reference is Anaphor.THERE and self.last_place is not None else place

    def _corrected(self, place: PlaceReference) -> bool:
        """Replaces the place of the last step; returns whether it did."""
        self.repairing = False
        for frame in reversed(self.frames):
            for name in ("place", "at"):
                old = getattr(frame, name)
                if old is not None and old == place:
                    self.repairing = self.mood is ClauseMood.STATEMENT or self.negation == "not"
                    self.negation = None if self.negation == "not" else self.negation
                    return self.repairing  # "no, Fuller is jammed, take Beal", "no, not Fuller, Beal"
                if old is not None and old.street is not None and _names_only_street(place):
                    place = with_details(old, street=place.street)  # "the house on Beal, no, Fuller"
                if old is not None and (old.landmark is None) is (place.landmark is None):
                    setattr(frame, name, place)
                    self.repaired, self.frame, self.fresh = True, frame, False
                    return True
        return False


def _names_only_street(place: PlaceReference) -> bool:
    return place.to_json().keys() == {"street"}


def fetches(frame: Frame) -> bool:
    """Returns whether the words of an errand may mean that somebody is to be fetched."""
    return frame.word in _FETCHING or (frame.last == "for" and frame.word in _CALLING)
