"""Relations of route talk: words of where or when, with their places, become conditions of steps."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from dorothie_gym.dialogue.plan_items import ActionItem, ConditionItem, NounPhrase, TurnItem
from dorothie_gym.dialogue.plan_nouns import NounReader
from dorothie_gym.dialogue.plan_quantities import QuantityReader
from dorothie_gym.dialogue.routes import ConditionRelation
from dorothie_gym.ontology.slots import ObjectClass

if TYPE_CHECKING:
    from dorothie_gym.dialogue.plan_items import Item
    from dorothie_gym.dialogue.route_grammar import Match

_STATES: Final = frozenset(
    [
        *("start", "starts", "begin", "begins", "end", "ends", "is"),
        *("are", "stands", "lies", "finishes", "stops", "parked", "over"),
    ]
)
_PRONOUNS: Final = frozenset({"it", "that", "those", "them", "this", "these", "him", "her"})
_IN_VIEW: Final = (
    "comes into view", "comes into sight", "come into view", "comes in sight", "appears", "pops up", "shows up",
    "in view", "in sight", "comes up", "comes along", "comes on", "turns up", "pops into view", "pops out",
    "looms", "is visible", "becomes visible", "is in sight", "is in view", "are in sight", "is coming up",
    "is ahead",
)  # fmt: skip
_WORDY: Final = frozenset({"when", "once", "as", "soon", "after"})
_LEAVING: Final = frozenset({*_WORDY, "until", "till", "til", "before"})
"""First words of a relation to an object that leaves: "wait until that truck's gone"."""
_COMING: Final = frozenset({"if", "when", "once", "as", "soon"})
_TEMPORAL: Final = frozenset({"when", "once", "as", "soon", "where", "wherever"})
_ENDS: Final = frozenset({"", ",", "?", "and", "then", "please"})
_JUNCTIONS: Final = frozenset({"corner", "junction", "intersection", "crossing", "crossroads", "roundabout", "fork"})


class RelationReader(NounReader, QuantityReader):
    """Reads relations with their places: "just past the Shell", "when the Shell comes into view"."""

    def _last(self) -> Item | None:
        return self.items[-1] if self.items else None

    def _is_next_junction(self, found: NounPhrase, behind: int) -> bool:
        """Returns whether a noun phrase is a junction without a number: "at the corner"."""
        last, uncounted = self._last(), found.reference is None and found.ordinal is None
        if isinstance(last, ActionItem) and last.kind == "u_turn":
            return False
        return uncounted and self.word_at(behind - 1) in _JUNCTIONS and self.word_at(behind) != "of"

    def read_relation(self, match: Match, place: int) -> int:
        """Reads a relation with its place: "just past the Shell", "when the Shell comes into view"."""
        end = place + match.length
        if match.kind == "named":
            self.items.append(ConditionItem(ConditionRelation.AT, None))  # "that's where you go right"
            return end
        if self.words[end - 1] in ("over", "up", "down", "along") and self.word_at(end) in ("there", "here"):
            return place
        if match.kind == "after" and match.length == 1 and self.measures(end):
            return end  # "after three hundred feet"
        found, behind = self.noun_phrase(end)
        if self.words[place:end] == ["on"] and self.lead.get(end) == "home" and found is not None:
            self.items += [ActionItem("visit", place, end), found]  # "go on home"
            return behind
        if found is None and match.kind == "across" and "straight" in self.words[place:end]:
            self.items.append(ActionItem("straight", place, end))
            return end
        if found is not None and match.kind == "at" and self._is_next_junction(found, behind):
            found = NounPhrase(None, 1)
        if found is None:
            return self._pronoun(match, place)
        relation, behind = self._event(match, place, found, behind)
        if match.kind == "across" and self._goes_along(found, place):
            self.items += [ActionItem("follow", place, end), found]  # "go around over Hubbard"
            return behind
        if match.kind == "across":
            self.items.append(ActionItem("straight", place, end))
        self.items.append(ConditionItem(relation, found))
        if self.words[place] in _COMING and [*self.words[behind : behind + 2]] == ["coming", "up"]:
            behind += 2  # "if you see a bridge coming up"
        while self.word_at(behind) in _STATES and self.words[place] in _TEMPORAL:
            behind += 1
        return behind

    def _event(self, match: Match, place: int, found: NounPhrase, behind: int) -> tuple[ConditionRelation, int]:
        """Returns the relation to a place that comes into view or leaves, and the token behind what tells that."""
        relation = self._relation(match)
        rest = " ".join(self.words[behind : behind + 3])
        for phrase in _IN_VIEW:
            if rest.startswith(phrase):
                relation = relation if relation is ConditionRelation.UNTIL else ConditionRelation.SEEN
                behind += len(phrase.split())
                break
        if self.words[place] in _LEAVING and found.reference is not None and found.reference.object is not None:
            left = self.grammar.leaving.longest(self.words, behind) if self.word_at(behind) else None
            if left is not None:  # "when this lorry is gone"
                lasts = relation in (ConditionRelation.UNTIL, ConditionRelation.BEFORE)
                relation = ConditionRelation.UNTIL if lasts else ConditionRelation.AFTER
                behind += left.length
        return relation, behind

    def _pronoun(self, match: Match, place: int) -> int:
        """Reads a relation with "it" or "that": "just past it", "when it pops up"."""
        end = place + match.length
        if self.words[place] == "after" and self.word_at(end) in _ENDS and isinstance(self._last(), TurnItem):
            self.items.append(ConditionItem(ConditionRelation.AFTER, None))  # "past the KFC and the left after"
            return end
        if self.word_at(end) not in _PRONOUNS or self.word_at(end - 1) in ("on", "at", "in"):
            return end if match.length > 1 else place
        seen = next((each for each in _IN_VIEW if " ".join(self.words[end + 1 : end + 4]).startswith(each)), None)
        relation = self._relation(match) if seen is None else ConditionRelation.SEEN
        self.items.append(ConditionItem(relation, None))
        return end + 1 + (0 if seen is None else len(seen.split()))

    def _goes_along(self, found: NounPhrase, place: int) -> bool:
        """Returns whether "over" and "across" mean along a street, as behind a verb of another kind."""
        street = found.reference is not None and found.reference.street is not None
        return street and place > 0 and self.word_at(place - 1) not in (",", "go", "straight", "head")

    def _relation(self, match: Match) -> ConditionRelation:
        """Returns the relation that a phrase stands for; behind a line one stops before it."""
        if match.kind == "behind":
            stops = any(isinstance(item, ActionItem) and item.kind == "stop" for item in self.items)
            stops = stops and not any(value is ObjectClass.VEHICLES for value in self.names.values())
            return ConditionRelation.BEFORE if stops else ConditionRelation.AFTER
        return ConditionRelation.PAST if match.kind == "across" else ConditionRelation(match.kind)
