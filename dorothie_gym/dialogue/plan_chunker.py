"""Chunker of route talk: tokens of a sentence become actions, turns, conditions, places, sides and quantities."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from typing import Final, TypeAlias

from dorothie_gym.dialogue.clause_moods import behind_request, is_participle
from dorothie_gym.dialogue.contingencies import find_contingency
from dorothie_gym.dialogue.plan_directions import DirectionReader, begins_direction
from dorothie_gym.dialogue.plan_items import (
    SIDES,
    ActionItem,
    BoundaryItem,
    ConditionItem,
    ContingencyItem,
    DistanceItem,
    Item,
    NegationItem,
    NounPhrase,
    RepairItem,
    SpeedItem,
    UnitItem,
    VerbItem,
    WordItem,
    begins_ordinal,
)
from dorothie_gym.dialogue.plan_nouns import begins_noun_phrase
from dorothie_gym.dialogue.plan_quantities import begins_quantity
from dorothie_gym.dialogue.plan_relations import RelationReader
from dorothie_gym.dialogue.route_grammar import Match, route_grammar
from dorothie_gym.dialogue.routes import Anaphor, ConditionRelation
from dorothie_gym.ontology.slots import LandmarkName, ObjectClass, SlotValue, StreetName

_BEFORE_NONE: Final = frozenset({"is", "are", "there's", "was", "have", "has", "got", "with", "see", "need", "want"})
"""Words behind which "no" says that there is none, and corrects nothing."""
_ADJECTIVES: Final = frozenset({"fast", "slow", "quick", "quickly", "slowly", "far", "much", "hard", "close", "early"})
_WHERE: Final = frozenset({"there", "here", "to"})
_PRESENTING: Final = frozenset({"this", "that", "that's", "here's", "here", "there"})
_LAST: Final = frozenset({"", ",", "?", "thanks", "cheers", "ta", "thank", "please", "driver", "and", "so", "fine"})
_TAKING_OFF: Final = frozenset({"take", "taking", "knock", "strike", "leave"})
"""Verbs of giving up an errand that has an "off" behind it: "take the KFC off the list"."""

_CANCELLING: Final = frozenset({"forget", "drop", "dropping", "lose", "remove", "scrub", "ditch", *_TAKING_OFF})
"""First words of giving up an errand or a turn."""
_BEHIND_CANCELLED: Final = frozenset({"", ",", "?", "please", "then", "and", "from", "for", "off", "now"})
_RANKS: Final = {"first": "advance", "beforehand": "advance", "last": "defer"}
"""Adverbs behind an errand that put it in front of, or behind the others."""
_BEHIND_RANKS: Final = frozenset({"", ",", "?", "and", "then", "please", "though", "but"})
_CHANCES: Final = frozenset({"chance", "moment", "minute", "second", "opportunity"})
_COMPARED: Final = frozenset({"quicker", "faster", "slower", "quick", "fast", "slow"})
_STATED: Final = frozenset({"it's", "that's", "is", "are", "was", "it'd", "gets", "looks", "there's"})
_TELLING: Final = frozenset({"to", "if", "than", "down", "via", "along", "through", "on", "that", "going", "by", "way"})
_LASTING: Final = frozenset({"let", "letting", "for", "this", "that", "the", "those", "these"})
"""Words behind an order to wait, or to let pass, in front of what the car waits for."""
_CHANGING: Final = frozenset(
    {ObjectClass.TRAFFIC_LIGHT, ObjectClass.VEHICLES, ObjectClass.PEDESTRIAN, ObjectClass.DYNAMIC}
)
"""Objects that move on or change, so that one waits for them."""
_BY_WAY: Final = frozenset({"along", "by", "on", "via", "over"})
_WAITING: Final = frozenset({"who's", "who", "he's", "she's", "they're"})
_INFINITIVES: Final = frozenset(
    {"take", "make", "get", "go", "drive", "do", "have", "keep", "be", "swing", "pull", "head", "move"}
)
_FURTHER: Final = frozenset({"further", "farther", "on", "along", "ahead"})
_BEHIND_STOPS: Final = frozenset({"by", "at", "off", "in", "near", "opposite", "outside", "here", "there"})
"""Words behind a "stop" that is a verb."""

_DEPARTING: Final = frozenset({"drop", "get", "move", "slow"})
"""Verbs of changing the speed that are rarely used of driving somewhere."""


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


class _Reader(DirectionReader, RelationReader):
    def read(self) -> list[Item]:
        place, subjects = 0, self.grammar.subjects
        while place < len(self.words):
            place = self._behind_frame(place)
            word = self.words[place]
            if word in subjects:
                self._new_clause(place)
            place = next(end for rule in _rules_from(word) if (end := rule(self, place)) > place)
        return self.items

    def _behind_frame(self, place: int) -> int:
        """Returns the place behind words that only frame a request, where a clause begins: "do you think you could"."""
        if place and not self._begins_clause(place):
            return place
        return behind_request(self.words, place)

    def _new_clause(self, place: int) -> None:
        """Adds the border before a subject with its verb: "go on | there's nothing coming"."""
        before = self.words[place - 1] if place else ","
        if before not in self.grammar.subordinators and before not in (",", "?"):
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
        if "stop" not in self.words:
            return place
        number, behind = self.ordinal(place)
        alone = behind == place + 1 and self._begins_clause(place) and self.word_at(behind + 1) in _BEHIND_STOPS
        if alone and self.word_at(behind) == "stop":
            return behind  # "..., next stop by the KFC"
        if (number is not None or self.words[place] in ("last", "only")) and self.word_at(
            max(behind, place + 1)
        ) == "stop":
            return max(behind, place + 1) + 1
        return place

    def _ranked(self, place: int) -> int:
        """Reads that the errand named just before comes first or last: "the Shell and the KFC, the KFC first"."""
        kind = _RANKS.get(self.words[place])
        named = isinstance(self.names.get(place - 1), LandmarkName) and self.word_at(place + 1) in _BEHIND_RANKS
        if kind is None or not named:
            return place
        self.items.append(ActionItem(kind, place, place + 1))
        return place + 1

    def _comma(self, place: int) -> int:
        self.items.append(BoundaryItem(",", place + 1))
        return place + 1

    def _contingency(self, place: int) -> int:
        """Skips a condition of the world, unless it is a relation to a place: "once we've passed the KFC"."""
        found = find_contingency(self.words, place, self.grammar)
        if found is None:
            return self._polite(place)
        match = self.grammar.terminals.longest(self.words, place)
        if match is not None and match.group == "relations" and self.noun_phrase(place + match.length)[0] is not None:
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

    # --- phrases and places -----------------------------------------------------------------------------------------

    def _phrase(self, place: int) -> int:
        """Reads a phrase of the grammar; one that is a part of a longer noun phrase is left to it."""
        match = self.grammar.terminals.longest(self.words, place)
        if match is None:
            return self._lets_pass(place)
        if self.word_at(place - 1) == "why" and self.words[place] in ("don't", "dont", "not"):
            return place + 1 + (self.word_at(place + 1) in ("you", "we", "ye"))  # "why don't you turn left"
        end = place + match.length
        if match.kind == "advance" and self.words[place] == "before" and end in self.names:
            match = Match("relations", "before", 1)  # "before that bus"
        if match.group == "relations":
            return self.read_relation(match, place)
        if match.kind == "follow" and match.length == 1 and self.word_at(end) == "there":
            return place  # "not here, down there"
        if self.words[place] == "so" and match.length == 1 and self.word_at(end) in _ADJECTIVES:
            return end
        if (denied := self._denies(match, place)) > place:
            return denied
        if self._is_adverb(match, place):
            return end
        return place if self._is_part(match, place) else self._item(match, place)

    def _denies(self, match: Match, place: int) -> int:
        """Reads words that deny or end what follows them; returns the token behind them, or the place itself."""
        end = place + match.length
        if match.group == "repairs" and self.words[place] == "no" and match.length == 1:
            if end in self.names or self.word_at(place - 1) in _BEFORE_NONE:
                self.items.append(NegationItem("not"))
                return end
            if self.word_at(end) == "u" or self._does(end):
                self.items.append(NegationItem("forbid"))  # "no U-turns", "no stopping"
                return end
        if match.group == "repairs" and self._refuses(place):
            self.items.append(NegationItem("not"))  # "not that turning, the one after"
            return place + 1
        if self._ceases(match, place):
            self.items.append(NegationItem("cease"))  # "stop braking"
            return end
        return place

    def _lets_pass(self, place: int) -> int:
        """Reads an order to wait for somebody who goes first: "let that taxi go past"."""
        lets = self.words[place] in ("let", "letting") and self.names.get(place + 1) in _CHANGING
        if not lets or self.grammar.leaving.longest(self.words, place + 2) is None:
            return place
        self.items.append(ActionItem("wait", place, place + 1))
        return place + 1

    def _refuses(self, place: int) -> bool:
        """Returns whether "not that" stands before an opportunity to turn, and takes nothing back."""
        noun = self.word_at(place + 2)
        return self.word_at(place) == "not" and (noun in SIDES or self.grammar.opportunities.may_begin(noun))

    def _does(self, place: int) -> bool:
        """Returns whether a doing stands at a place: "stopping", "lane changing"."""
        match = self.grammar.terminals.longest(self.words, place)
        if match is None or match.group not in ("actions", "verbs"):
            return False
        return any(is_participle(word) for word in self.words[place : place + match.length])

    def _ceases(self, match: Match, place: int) -> bool:
        """Returns whether "stop" ends a doing, rather than the drive: "stop braking so hard"."""
        if match.kind != "stop" or self.words[place : place + match.length] != ["stop"]:
            return False
        following = self.grammar.terminals.longest(self.words, place + 1)
        relates = following is not None and following.group == "relations"
        return is_participle(self.word_at(place + 1)) and not relates

    def _is_adverb(self, match: Match, place: int) -> bool:
        """Returns whether a phrase adds nothing: the "to" of "to take a left", "further on" behind a distance."""
        end = place + match.length
        following = self.grammar.terminals.longest(self.words, end)
        acting = following is not None and following.group in ("actions", "verbs")
        if match.kind == "visit" and self.words[place:end] == ["to"]:
            return following is not None and following.group == "verbs" and self.words[end] in _INFINITIVES
        if match.kind == "visit" and self.words[place:end] == ["going", "to"]:
            return following is not None and following.group in ("verbs", "actions", "lights")
        last = self.items[-1] if self.items else None
        return acting and isinstance(last, DistanceItem) and self.words[place] in _FURTHER

    def _acts(self, place: int) -> bool:
        """Returns whether an action stands at a place."""
        match = self.grammar.terminals.longest(self.words, place)
        return match is not None and match.group == "actions"

    def _is_part(self, match: Match, place: int) -> bool:
        """Returns whether a phrase is a part of another one: "what's the hold up?", "that stop", "that's me sorted"."""
        end = place + match.length
        if match.kind == "stop" and self.words[end - 1] in ("me", "us") and self.words[place] in _PRESENTING:
            return self.word_at(end) not in _LAST
        counted = (*self.grammar.determiners, "two", "three", "more", "many", "few")
        noun = self.word_at(place - 1) in counted and not self._begins_clause(place)  # not in "after that stop"
        noun = noun or (match.kind == "wait" and self.word_at(place - 1) in _WAITING)
        if self.words[place] == "park" and self.word_at(place - 1) in ("car", "a", "the"):
            return True
        return noun and (match.kind == "wait" or self.words[place] in ("stop", "stops"))

    def _begins_clause(self, place: int) -> bool:
        """Returns whether the last item is a border that ends at a place."""
        last = self.items[-1] if self.items else None
        return isinstance(last, BoundaryItem) and last.place == place

    def _item(self, match: Match, place: int) -> int:
        """Adds the item of a phrase; returns the token behind it."""
        end = place + match.length
        if match.kind in ("slower", "faster") and (found := self._brought_to(place, end)) is not None:
            visits = found.reference is not None and found.reference.landmark is not None
            visits = visits or self.words[end - 2] not in ("up", "down")
            end = end if visits else end - 2  # "up to the lights" tells how far
            self.items.append(ActionItem("visit" if visits else "straight", place, end))
            return end
        if match.kind == "accept" and self.words[place] == "follow" and self._has_place(end - 1):
            self.items.append(ActionItem("follow", place, place + 1))  # "follow that blue car"
            return place + 1
        if match.group == "boundaries":
            self.items.append(BoundaryItem(match.kind, end))
        elif match.group == "repairs":
            self.items.append(RepairItem(end))
        elif match.group == "negations":
            self.items.append(NegationItem(match.kind))
        elif match.group == "verbs":
            self.items.append(VerbItem(self.words[place], end))
        elif match.kind not in ("faster", "slower") or not self._compares(place, end):
            self.items.append(ActionItem(self._kind(match, place), place, end))
        return end

    def _kind(self, match: Match, place: int) -> str:
        """Returns the kind of an action, which what follows may change."""
        end = place + match.length
        if match.kind == "straight" and self._keeps_speed(place, end):
            return "speed"  # "the limit is thirty, stick to it"
        if match.kind == "lane" and self._visits(place, end):
            return "visit"  # "let's get over there"
        if match.kind == "u_turn" and self.words[end - 1] == "back" and self._goes_same_way(end):
            return "follow"  # "take us back along the roads we used"
        if match.kind == "slower" and isinstance(self.names.get(end), StreetName):
            if self.words[end - 1] == "down":
                return "follow"  # "take us down Hubbard"
            return "leave" if "off" in self.words[place:end] else match.kind  # "come off the highway"
        if match.kind == "leave" and self.words[end - 1] == "off" and not self._has_place(end):
            return "stop"  # "that's where I get off", not "get off the highway"
        return f"lights_{match.kind}" if match.group == "lights" else match.kind

    def _goes_same_way(self, place: int) -> bool:
        """Returns whether the way of the drive so far is named, behind a preposition."""
        found = self.noun_phrase(place + 1)[0] if self.word_at(place) in _BY_WAY else None
        return found is not None and found.reference is not None and found.reference.reference is Anaphor.WAY_WE_CAME

    def _brought_to(self, place: int, end: int) -> NounPhrase | None:
        """Returns the place to which words of changing the speed send the car: "bring her up to the lights"."""
        if self.words[end - 1] != "to" or end >= len(self.words) or self._number(end)[0] is not None:
            return None
        found = self.noun_phrase(end)[0]
        vague = found is not None and found.reference is None
        return None if vague and self.words[place] in _DEPARTING else found

    def _keeps_speed(self, place: int, end: int) -> bool:
        """Returns whether "keep to it" is about a speed that has been named."""
        told = self.words[place + 1 : end] in (["to", "it"], ["to", "that"], ["at", "it"])
        return told and any(isinstance(item, SpeedItem) for item in self.items)

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
        return place < len(self.words) and self.noun_phrase(place)[0] is not None

    def _cancelled(self, place: int) -> int:
        """Reads the giving up of an errand or a turn: "drop the KFC", "forget that left"."""
        if not self._cancels(place):
            return place
        self.items.append(NegationItem("cancel"))
        return place + 1

    def _cancels(self, place: int) -> bool:
        word, end = self.words[place], place + 2
        if word in _TAKING_OFF:
            behind = place + 1 + (self.word_at(place + 1) in self.grammar.determiners)
            named = isinstance(self.names.get(behind), LandmarkName) and self.word_at(behind + 1) == "off"
            return named and self.word_at(behind + 2) in (*self.grammar.determiners, "", ",")
        if word == "forget" and self.word_at(place + 1) in ("that", "it"):
            return self.word_at(end) in SIDES or end in self.names or self.word_at(end) in ("turn", "one", "stop")
        behind = place + 1 + (self.word_at(place + 1) in self.grammar.determiners)
        named = isinstance(self.names.get(behind), LandmarkName) and self.names[behind] is not LandmarkName.PERSON
        return named and self.word_at(behind + 1) in _BEHIND_CANCELLED

    def _earlier(self, place: int) -> int:
        """Reads a place of the trip behind "to" or "at": "back to the last stop"."""
        match = self.grammar.references.longest(self.words, place) if self.word_at(place - 1) in ("to", "at") else None
        return place if match is None or match.length < _LEAST_NAMED else self._noun(place)

    def _noun(self, place: int) -> int:
        if self.words[place] == "just" and place + 1 < len(self.words) and self._acts(place + 1):
            return place  # "just turn back", no "just turn"
        found, behind = self.noun_phrase(place)
        if found is None:
            return place
        if self.word_at(place - 1) in _LASTING and self._waits() and found.reference is not None:
            left = self.grammar.leaving.longest(self.words, behind)
            if left is not None or found.reference.object in _CHANGING:
                self.items.append(ConditionItem(ConditionRelation.UNTIL, found))  # "wait for that truck to move"
                return behind + (0 if left is None else left.length)
        self.items.append(found)
        return behind

    def _waits(self) -> bool:
        """Returns whether the last item is an order to wait."""
        said = [item for item in self.items if not isinstance(item, WordItem)]
        last = said[-1] if said else None
        return isinstance(last, ActionItem) and last.kind == "wait"


_Rule: TypeAlias = Callable[[_Reader, int], int]
"""Reads what begins at a token; returns the token behind it, or the token itself if the rule does not apply."""

_LEAST_NAMED: Final = 2
"""Words of a place of the trip that is no mere "here"."""

_STOPS: Final = frozenset({"last", "only"})
"""Words that count stops as ordinals do."""


@functools.lru_cache(maxsize=4096)
def _rules_from(word: str) -> tuple[_Rule, ...]:
    """Returns the rules, in order, that may apply to words of which this is the first; the last one always does."""
    grammar = route_grammar()
    if word in (",", "?"):
        return (_Reader._comma,)
    counts = begins_ordinal(word, grammar)
    rules: tuple[tuple[_Rule, bool], ...] = (
        (_Reader._contingency, grammar.contingencies.may_begin(word)),
        (_Reader._cancelled, word in _CANCELLING),
        (_Reader._earlier, grammar.references.may_begin(word)),
        (_Reader._stop_noun, counts or word in _STOPS),
        (_Reader._ranked, word in _RANKS),
        (_Reader.read_direction, counts or begins_direction(word, grammar)),
        (_Reader.read_quantity, begins_quantity(word)),
        (_Reader._phrase, grammar.terminals.may_begin(word)),
        (_Reader._noun, counts or begins_noun_phrase(word, grammar)),
        (_Reader._unknown, True),
    )
    return tuple(rule for rule, may_apply in rules if may_apply)
