"""Chunker of route talk: tokens of a sentence become actions, turns, conditions, places, sides and quantities."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from dorothie_gym.dialogue.contingencies import find_contingency
from dorothie_gym.dialogue.numerals import read_cardinals, read_ordinal
from dorothie_gym.dialogue.plan_items import (
    ActionItem,
    BoundaryItem,
    ConditionItem,
    ContingencyItem,
    Item,
    LaneItem,
    NegationItem,
    NounPhrase,
    RepairItem,
    SideItem,
    TurnItem,
    UnitItem,
    VerbItem,
    WordItem,
)
from dorothie_gym.dialogue.plan_quantities import QuantityReader
from dorothie_gym.dialogue.realization_context import Direction
from dorothie_gym.dialogue.route_grammar import Match, route_grammar
from dorothie_gym.dialogue.routes import Anaphor, ConditionRelation, PlaceReference
from dorothie_gym.ontology.slots import LandmarkName, ObjectClass, SlotValue, StreetName

_SIDES: Final[Mapping[str, Direction]] = {
    "left": Direction.LEFT,
    "right": Direction.RIGHT,
    "leftwards": Direction.LEFT,
    "rightwards": Direction.RIGHT,
    "lefts": Direction.LEFT,
    "rights": Direction.RIGHT,
}
_SIDE_WORDS: Final = frozenset({"on", "at", "to", "in", "into", "onto", "along", "down"})
_BEFORE_NONE: Final = frozenset({"is", "are", "there's", "was", "have", "has", "got", "with", "see", "need", "want"})
"""Words behind which "no" says that there is none, and corrects nothing."""
_ADJECTIVES: Final = frozenset({"fast", "slow", "quick", "quickly", "slowly", "far", "much", "hard", "close", "early"})
_STATES: Final = frozenset(
    {
        "start",
        "starts",
        "begin",
        "begins",
        "end",
        "ends",
        "is",
        "are",
        "stands",
        "lies",
        "finishes",
        "stops",
        "parked",
        "over",
    }
)
_BESIDE: Final = frozenset({"on", "at", "along", "down"})
_DEGREES: Final = frozenset({"immediate", "hard", "sharp", "far", "very", "available", "possible", "little", "quick"})
_EDGES: Final = frozenset({"side", "side's", "kerb", "curb", "edge"})
"""Nouns that make left and right a side of the street."""
_WHERE: Final = frozenset({"there", "here", "to"})
_PRESENTING: Final = frozenset({"this", "that", "that's", "here's", "here", "there"})
_LAST: Final = frozenset({"", ",", "?", "thanks", "cheers", "ta", "thank", "please", "driver", "and", "so", "fine"})
_CHANCES: Final = frozenset({"chance", "moment", "minute", "second", "opportunity"})
_COMPARED: Final = frozenset({"quicker", "faster", "slower", "quick", "fast", "slow"})
_STATED: Final = frozenset({"it's", "that's", "is", "are", "was", "it'd", "gets", "looks", "there's"})
_TELLING: Final = frozenset({"to", "if", "than", "down", "via", "along", "through", "on", "that", "going", "by", "way"})
_BEING: Final = frozenset({"is", "are", "be", "over", "up"})
_LANES: Final = frozenset({"lane", "lanes"})
_JOINTS: Final = frozenset({",", "then", "and", "turn", "go", "take"})
_LANE_NOUNS: Final = (["lane"], ["one"], ["other"])
_TURN_NOUNS: Final = frozenset({"turn", "turning", "one", "street", "road", "exit", "corner", "fork", "again", "turns"})
_PRONOUNS: Final = frozenset({"it", "that", "those", "them", "this", "these", "him", "her"})
_POSTPOSITIONS: Final = frozenset({"on", "in", "off", "along", "over", "at"})
_IN_VIEW: Final = (
    "comes into view",
    "comes into sight",
    "come into view",
    "comes in sight",
    "appears",
    "pops up",
    "shows up",
    "in view",
    "in sight",
)
_WORDY: Final = frozenset({"when", "once", "as", "soon", "after"})
_TEMPORAL: Final = frozenset({"when", "once", "as", "soon", "where", "wherever"})
_WAITING: Final = frozenset({"who's", "who", "he's", "she's", "they're"})
_JUNCTIONS: Final = frozenset({"corner", "junction", "intersection", "crossing", "crossroads", "roundabout", "fork"})
_UNKNOWN_WORDS: Final = 2
"""Words between an article and the noun that the grammar need not know: "that daft red wall"."""


def read_items(
    words: Sequence[str],
    names: Mapping[int, SlotValue],
    lead: Mapping[int, str],
    contracted: frozenset[int] = frozenset(),
) -> list[Item]:
    """Returns the items of a sentence.

    Args:
        words: lower-case tokens with masked names and directions, see `nlu.understand`.
        names: values of the masked names by their token.
        lead: first words of names that say more than the name: "next" of "next lights".
        contracted: tokens of the names that end in "'s".
    """
    reader = _Reader(words, names, lead, route_grammar())
    reader.contracted = contracted
    return reader.read()


class _Reader(QuantityReader):
    contracted: frozenset[int] = frozenset()

    def read(self) -> list[Item]:
        place = 0
        rules = (
            self._comma,
            self._contingency,
            self._cancelled,
            self._stop_noun,
            self._turn,
            self.read_quantity,
            self._phrase,
            self._noun,
            self._unknown,
        )
        while place < len(self.words):
            self._new_clause(place)
            place = next(end for rule in rules if (end := rule(place)) > place)
        return self.items

    def _new_clause(self, place: int) -> None:
        """Adds the border before a subject with its verb: "go on | there's nothing coming"."""
        before = self.words[place - 1] if place else ","
        if self.words[place] in self.grammar.subjects and before not in (*self.grammar.subordinators, ",", "?"):
            self.items.append(BoundaryItem("and", place))

    def _unknown(self, place: int) -> int:
        word = self.words[place]
        if word in self.grammar.metres and len(word) > 1:
            self.items.append(UnitItem(self.grammar.metres[word] / 1000.0))
        else:
            self.items.append(WordItem(word))
        return place + 1

    def _stop_noun(self, place: int) -> int:
        """Skips "the next stop", which is an errand and no order to stop."""
        number, behind = self._ordinal(place)
        if (number is not None or self.words[place] in ("last", "only")) and self.word_at(
            max(behind, place + 1)
        ) == "stop":
            return max(behind, place + 1) + 1
        return place

    def _comma(self, place: int) -> int:
        if self.words[place] not in (",", "?"):
            return place
        self.items.append(BoundaryItem(",", place + 1))
        return place + 1

    def _contingency(self, place: int) -> int:
        """Skips a condition of the world, unless it is a relation to a place: "once we've passed the KFC"."""
        found = find_contingency(self.words, place, self.grammar)
        if found is None:
            return self._polite(place)
        match = self.grammar.terminals.longest(self.words, place)
        if match is not None and match.group == "relations" and self._noun_phrase(place + match.length)[0] is not None:
            if self.words[place] not in ("if", "unless") or match.length > 1:
                return place
        self.items.append(ContingencyItem(found.end, found.leading))
        return found.end

    def _polite(self, place: int) -> int:
        """Skips politeness that looks like a condition: "whenever you get a chance", "as long as you can"."""
        match = self.grammar.contingencies.longest(self.words, place)
        if match is None or match.kind != "polite":
            return place
        end = place + match.length
        end += self.word_at(end) in _CHANCES
        return end if self.word_at(end) in ("", ",", "?", "please", "and", "then") else place

    # --- left and right ---------------------------------------------------------------------------------------------

    def _turn(self, place: int) -> int:
        """Reads a direction with the words around it: a turn, a lane, or a side."""
        begin = place
        preposition = self.word_at(place) if self.word_at(place) in _SIDE_WORDS else ""
        place += preposition != ""
        ordinal, place = self._ordinal(place)
        while self.word_at(place) in self.grammar.determiners or self.word_at(place) in _DEGREES:
            place += 1
        if ordinal is None:
            ordinal, place = self._ordinal(place)
        while self.word_at(place) in _DEGREES:
            place += 1
        direction = _SIDES.get(self.word_at(place))
        if direction is None:
            return begin
        several = self.word_at(place) in ("lefts", "rights")
        place += 1
        while self.word_at(place) == self.word_at(place - 1) and self.word_at(place) in ("left", "right"):
            place += 1  # "left left left"
        hand = self.word_at(place) in ("hand", "handed")
        place += hand
        if self.word_at(place) == "most":
            place += 1
        if self.word_at(place) in ("a", "one") and self.word_at(place + 1) == "lane":
            self.items.append(LaneItem(direction))  # "move left a lane"
            return place + 2
        changed = preposition == "to" and self.word_at(begin - 1) in ("change", "changing", "switch", "switching")
        if changed or self.word_at(place) in ("lane", "lanes", "file") or self.word_at(begin - 1) in ("lane", "lanes"):
            self.items.append(LaneItem(direction))
            return place + (self.word_at(place) in ("lane", "lanes", "file"))
        if self.word_at(begin - 1) == "of" and self.word_at(begin - 2) == "out" and self.word_at(place) in _LANES:
            return place + 1  # "out of the right lane"
        if self._is_other_lane(begin, place):
            self.items.append(LaneItem(direction))
            return place + (self.word_at(place) == "one")
        pavement = self.names.get(place) is ObjectClass.SIDE_WALK
        aside = (
            self.word_at(place) in _EDGES or pavement or (preposition in ("to", "in") and self._stands_behind_stop())
        )
        aside = aside or (hand and preposition not in ("to", "in") and self.word_at(place) not in _TURN_NOUNS)
        if aside:
            place += self.word_at(place) in _EDGES or pavement
            place = self._behind_street(place)
        elif self.word_at(place) in _TURN_NOUNS:
            place += 1
        turning = self.word_at(place - 1) in _TURN_NOUNS and preposition in ("down", "along")
        if not turning and (aside or (preposition or self.word_at(begin - 1)) in _BESIDE) and ordinal is None:
            stated = self.word_at(begin - 1).endswith("'s") or self.word_at(begin - 1) in _BEING
            self.items.append(SideItem(direction, stated or begin - 1 in self.contracted))
        else:
            count = ordinal or 1 if several else 1
            self.items.append(TurnItem(direction, None if several else ordinal, min(count, 4)))
        return place

    def _is_other_lane(self, begin: int, place: int) -> bool:
        """Returns whether a side tells one of the lanes spoken of: "switch lanes, the right one", "the one on the right"."""
        if _LANES.isdisjoint(self.words[:begin]):
            return False
        near = self.words[max(begin - 3, 0) : begin]
        if not _LANES.isdisjoint(near) and _JOINTS.isdisjoint(near):
            return True  # "one lane more to the right"
        before = [word for word in self.words[max(begin - 4, 0) : begin] if word not in ("which", "that", "is", ",")]
        return self.word_at(place) in ("one", "") and (self.word_at(place) == "one" or before[-1:] in _LANE_NOUNS)

    def _stands_behind_stop(self) -> bool:
        """Returns whether the last item is an order to stop: "stop to the right"."""
        last = self.items[-1] if self.items else None
        return isinstance(last, ActionItem) and last.kind == "stop"

    def _behind_street(self, place: int) -> int:
        """Returns the place behind "of the street"."""
        if self.word_at(place) == "of":
            rest = place + 1 + (self.word_at(place + 1) in self.grammar.determiners)
            return rest + 1 if self.word_at(rest) in ("street", "road", "car") else place
        return place

    def _ordinal(self, place: int) -> tuple[int | None, int]:
        """Returns an ordinal or a small count, and the place behind it."""
        start = place
        while self.word_at(place) in self.grammar.determiners or self.word_at(place) == "very":
            place += 1
        word = self.word_at(place).removesuffix("'s")
        number = read_ordinal(word)
        if number is None and (counts := read_cardinals([word])) and 2 <= counts[0] <= 9:
            number = counts[0]
        return (None, start) if number is None else (number, place + 1)

    # --- phrases and places -----------------------------------------------------------------------------------------

    def _phrase(self, place: int) -> int:
        """Reads a phrase of the grammar; one that is a part of a longer noun phrase is left to it."""
        match = self.grammar.terminals.longest(self.words, place)
        if match is None:
            return place
        end = place + match.length
        if match.group == "relations":
            return self._condition(match, place)
        if self.words[place] == "so" and match.length == 1 and self.word_at(end) in _ADJECTIVES:
            return end
        if match.group == "repairs" and self.words[place] == "no" and match.length == 1:
            if end in self.names or self.word_at(place - 1) in _BEFORE_NONE:
                self.items.append(NegationItem("not"))
                return end
        if match.kind == "stop" and self.words[end - 1] in ("me", "us") and self.words[place] in _PRESENTING:
            if self.word_at(end) not in _LAST:
                return place  # "that's me sorted"
        noun = self.word_at(place - 1) in (*self.grammar.determiners, "two", "three", "more", "many", "few")
        noun = noun or (match.kind == "wait" and self.word_at(place - 1) in _WAITING)
        if noun and (match.kind == "wait" or self.words[place] in ("stop", "stops")):
            return place  # "what's the hold up?", "that stop"
        if match.group == "boundaries":
            self.items.append(BoundaryItem(match.kind, end))
        elif match.group == "repairs":
            self.items.append(RepairItem(end))
        elif match.group == "negations":
            self.items.append(NegationItem(match.kind))
        elif match.group == "verbs":
            self.items.append(VerbItem(self.words[place], end))
        else:
            kind = f"lights_{match.kind}" if match.group == "lights" else match.kind
            if kind == "lane" and self._visits(place, end):
                kind = "visit"  # "let's get over there"
            if kind in ("faster", "slower") and self._compares(place, end):
                return end
            if kind == "leave" and self.words[end - 1] == "off" and not self._has_place(end):
                kind = "stop"  # "that's where I get off", not "get off the highway"
            self.items.append(ActionItem(kind, place, end))
        return end

    def _visits(self, place: int, end: int) -> bool:
        """Returns whether words of changing lanes mean an errand: "get over there", "squeeze in the KFC"."""
        if self.words[place] in ("get", "getting"):
            return self.word_at(end) in _WHERE
        behind = end + (self.word_at(end) in self.grammar.determiners)
        return self.words[place].startswith("squeez") and isinstance(self.names.get(behind), LandmarkName)

    def _compares(self, place: int, end: int) -> bool:
        """Returns whether a comparative tells of a way rather than orders a speed: "Hubbard's quicker"."""
        if self.words[end - 1] not in _COMPARED:
            return False
        before = self.word_at(place - 1)
        told = end == place + 1 and (before in _STATED or place - 1 in self.contracted)
        return told or (self.words[place] == "be" and self.word_at(end) in _TELLING)

    def _has_place(self, place: int) -> bool:
        """Returns whether a noun phrase stands at a place."""
        return place < len(self.words) and self._noun_phrase(place)[0] is not None

    def _cancelled(self, place: int) -> int:
        """Reads the giving up of an errand or a turn: "drop the KFC", "forget that left"."""
        if not self._cancels(place):
            return place
        self.items.append(NegationItem("cancel"))
        return place + 1

    def _cancels(self, place: int) -> bool:
        word, end = self.words[place], place + 2
        if word == "forget" and self.word_at(place + 1) in ("that", "it"):
            return self.word_at(end) in _SIDES or end in self.names or self.word_at(end) in ("turn", "one", "stop")
        if word not in ("drop", "dropping", "lose", "remove", "scrub", "ditch"):
            return False
        behind = place + 1 + (self.word_at(place + 1) in self.grammar.determiners)
        named = isinstance(self.names.get(behind), LandmarkName) and self.names[behind] is not LandmarkName.PERSON
        return named and self.word_at(behind + 1) in (
            "",
            ",",
            "?",
            "please",
            "then",
            "and",
            "from",
            "for",
            "off",
            "now",
        )

    def _is_next_junction(self, found: NounPhrase, behind: int) -> bool:
        """Returns whether a noun phrase is a junction without a number: "at the corner"."""
        last = self.items[-1] if self.items else None
        uncounted = found.reference is None and found.ordinal is None
        if isinstance(last, ActionItem) and last.kind == "u_turn":
            return False
        return uncounted and self.word_at(behind - 1) in _JUNCTIONS and self.word_at(behind) != "of"

    def _condition(self, match: Match, place: int) -> int:
        """Reads a relation with its place: "just past the Shell", "when the Shell comes into view"."""
        end = place + match.length
        if match.kind == "named":
            self.items.append(ConditionItem(ConditionRelation.AT, None))  # "that's where you go right"
            return end
        if self.words[end - 1] in ("over", "up", "down", "along") and self.word_at(end) in ("there", "here"):
            return place
        found, behind = self._noun_phrase(end)
        if found is None and match.kind == "across" and "straight" in self.words[place:end]:
            self.items.append(ActionItem("straight", place, end))
            return end
        if found is not None and match.kind == "at" and self._is_next_junction(found, behind):
            found = NounPhrase(None, 1)
        if found is None:
            if self.word_at(end) not in _PRONOUNS or self.word_at(end - 1) in ("on", "at", "in"):
                return end if match.length > 1 else place
            seen = next((each for each in _IN_VIEW if " ".join(self.words[end + 1 : end + 4]).startswith(each)), None)
            relation = self._relation(match) if seen is None else ConditionRelation.SEEN
            self.items.append(ConditionItem(relation, None))
            return end + 1 + (0 if seen is None else len(seen.split()))
        relation = self._relation(match)
        rest = " ".join(self.words[behind : behind + 3])
        for phrase in _IN_VIEW:
            if rest.startswith(phrase):
                relation, behind = ConditionRelation.SEEN, behind + len(phrase.split())
                break
        if self.words[place] in _WORDY and found.reference is not None and found.reference.object is not None:
            left = self.grammar.leaving.longest(self.words, behind) if self.word_at(behind) else None
            if left is not None:  # "when this lorry is gone"
                relation, behind = ConditionRelation.AFTER, behind + left.length
        if match.kind == "across" and self._goes_along(found, place):
            self.items += [ActionItem("follow", place, end), found]  # "go around over Hubbard"
            return behind
        if match.kind == "across":
            self.items.append(ActionItem("straight", place, end))
        self.items.append(ConditionItem(relation, found))
        while self.word_at(behind) in _STATES and self.words[place] in _TEMPORAL:
            behind += 1
        return behind

    def _goes_along(self, found: NounPhrase, place: int) -> bool:
        """Returns whether "over" and "across" mean along a street, as behind a verb of another kind."""
        street = found.reference is not None and found.reference.street is not None
        return street and place > 0 and self.word_at(place - 1) not in (",", "go", "straight", "head")

    def _relation(self, match: Match) -> ConditionRelation:
        """Returns the relation that a phrase stands for; behind a line one stops before it."""
        if match.kind == "behind":
            stops = any(isinstance(item, ActionItem) and item.kind == "stop" for item in self.items)
            return ConditionRelation.BEFORE if stops else ConditionRelation.AFTER
        return ConditionRelation.PAST if match.kind == "across" else ConditionRelation(match.kind)

    def _noun(self, place: int) -> int:
        found, behind = self._noun_phrase(place)
        if found is None:
            return place
        self.items.append(found)
        return behind

    def _noun_phrase(self, place: int) -> tuple[NounPhrase | None, int]:
        """Returns the noun phrase at a place, and the place behind it."""
        start, ordinal, article = place, None, False
        while True:
            number, behind = self._ordinal(place)
            if number is not None and self._counts(place, behind):
                ordinal, place, article = number, behind, True
            elif self.word_at(place) in self.grammar.modifiers and place not in self.names:
                article, place = True, place + 1
            elif (
                self.word_at(place).endswith("'s")
                and place not in self.names
                and self.word_at(place) not in self.grammar.subjects
            ):
                article, place = True, place + 1  # "granny's house"
            else:
                break
        if (match := self._reference(start)) is not None:
            return NounPhrase(PlaceReference(reference=Anaphor(match.kind)), None), start + match.length
        found, behind = self._head(place, ordinal)
        skipped = 0
        while found is None and article and skipped < _UNKNOWN_WORDS and self._is_unknown(place + skipped):
            skipped += 1
            found, behind = self._head(place + skipped, ordinal)
        if found is None and ordinal is not None and skipped == 0:
            ends = (
                ("", ",", "?", "on", "please", "then", "and")
                if self.word_at(start) in self.grammar.determiners
                else ("on",)
            )
            if self.word_at(place) in ends:
                return NounPhrase(None, ordinal), place  # "not the first, the second"
        return (found, behind) if found is not None else (None, start)

    def _counts(self, place: int, behind: int) -> bool:
        """Returns whether the number between two places belongs to a noun, as in no "first the KFC" or "two lefts"."""
        adverb = self.words[place] == "first" and self.word_at(behind) in (
            *self.grammar.determiners,
            "#landmark",
            "#street",
        )
        return not adverb and _SIDES.get(self.word_at(behind)) is None

    def _reference(self, place: int) -> Match | None:
        asked = self.word_at(place - 1) in ("is", "are") and self.word_at(place + 1) in ("a", "any", "an")
        if self.word_at(place) == "there" and (asked or self.word_at(place + 1) in ("is", "are", "was", "were")):
            return None
        return self.grammar.references.longest(self.words, place) if place < len(self.words) else None

    def _is_unknown(self, place: int) -> bool:
        word = self.word_at(place)
        if not word.isalpha() or word in _SIDES or word in ("lane", "lanes"):
            return False
        return self.grammar.terminals.longest(self.words, place) is None

    def _head(self, place: int, ordinal: int | None) -> tuple[NounPhrase | None, int]:
        """Returns the noun phrase whose noun is at a place."""
        value = self.names.get(place)
        if (
            value is not None
            and value.label != "Queried"
            and isinstance(value, LandmarkName | StreetName | ObjectClass)
        ):
            return self._named(place, value, ordinal)
        match = self.grammar.opportunities.longest(self.words, place) if place < len(self.words) else None
        if match is None:
            return None, place
        end = place + match.length
        if self.word_at(end) == "of" and self.words[place].startswith("corner"):
            end += 1 + (self.word_at(end + 1) in self.grammar.determiners)
            street = self.names.get(end)
            if isinstance(street, StreetName):
                return NounPhrase(PlaceReference(street=street), None), end + 1
            return None, place
        if self.word_at(end) == "after" and self.word_at(end + 1) in ("it", "that", "next"):
            return NounPhrase(None, 2 if self.word_at(end + 1) == "next" else 1), end + 2
        return NounPhrase(None, ordinal, self.words[place] in ("block", "blocks")), end

    def _named(
        self, place: int, value: LandmarkName | StreetName | ObjectClass, ordinal: int | None
    ) -> tuple[NounPhrase, int]:
        if ordinal is None and self.lead.get(place) == "next":
            ordinal = 1
        if isinstance(value, StreetName):
            return NounPhrase(PlaceReference(street=value, ordinal=ordinal), ordinal), place + 1
        street, end = self._street_of(place + 1)
        named = PlaceReference(
            landmark=value if isinstance(value, LandmarkName) else None,
            street=street,
            object=value if isinstance(value, ObjectClass) else None,
            ordinal=ordinal,
        )
        return NounPhrase(named, ordinal), end

    def _street_of(self, place: int) -> tuple[StreetName | None, int]:
        """Returns the street of a place, as in "on Beal" behind "the house", and the token behind it."""
        street = self.names.get(place + 1) if self.word_at(place) in _POSTPOSITIONS else None
        named = isinstance(street, StreetName) and street is not StreetName.QUERIED
        return (street, place + 2) if named and isinstance(street, StreetName) else (None, place)
