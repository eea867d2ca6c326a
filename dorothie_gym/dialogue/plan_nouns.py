"""Noun phrases of route talk: places, opportunities to turn, and their ordinals."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from dorothie_gym.dialogue.plan_items import SIDES, BoundaryItem, NounPhrase, RepairItem, TokenReader
from dorothie_gym.dialogue.routes import Anaphor, PlaceReference
from dorothie_gym.ontology.slots import LandmarkName, ObjectClass, StreetName

if TYPE_CHECKING:
    from dorothie_gym.dialogue.route_grammar import Match, RouteGrammar

_ONE: Final = frozenset({"a", "one", "another"})
_POSTPOSITIONS: Final = frozenset({"on", "in", "off", "along", "over", "at"})
_SPOKEN_OF: Final = frozenset({"it", "that", "this", "next"})
_NOTHING: Final = frozenset({"", ",", "?", "and", "then", "on", "please"})
"""What may stand behind "the one after" of an opportunity that has been spoken of."""

_NO_OWNERS: Final = frozenset({"let's", "what's", "how's", "here's", "where's", "who's", "when's"})
"""Words in 's that are no owners of what follows."""

_SEVERAL: Final = frozenset({None, LandmarkName.HOUSE, LandmarkName.SHELL, LandmarkName.PERSON})
"""Landmarks of which there are several, and what is none."""

_UNKNOWN_WORDS: Final = 2
"""Words between an article and the noun that the grammar need not know: "that daft red wall"."""


class NounReader(TokenReader):
    """Reads noun phrases."""

    def noun_phrase(self, place: int) -> tuple[NounPhrase | None, int]:
        """Returns the noun phrase at a place, and the place behind it."""
        start, ordinal, article = place, None, False
        while True:
            number, behind = self.ordinal(place)
            if number is not None and self._counts(place, behind):
                ordinal, place, article = number, behind, True
            elif self.word_at(place) in self.grammar.modifiers and place not in self.names:
                article, place = True, place + 1
            elif (
                self.word_at(place).endswith("'s")
                and place not in self.names
                and self.word_at(place) not in self.grammar.subjects
                and self.word_at(place) not in _NO_OWNERS
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
            if found is not None and found.reference is not None and found.reference.landmark not in _SEVERAL:
                found, behind = self._head(place + skipped, None)  # "second call the Ikea"
        if found is None and ordinal is not None and skipped == 0:
            ends = (
                ("", ",", "?", "on", "please", "then", "and")
                if self.word_at(start) in self.grammar.determiners or self._corrects()
                else ("on",)
            )
            if self.word_at(place) in ends:
                follows = self.word_at(place - 1) in ("next", "following")
                return NounPhrase(None, ordinal, follows=follows, elliptical=True), place  # "not the first, the second"
        return (found, behind) if found is not None else (None, start)

    def _corrects(self) -> bool:
        """Returns whether the last item takes something back: "second left, no, third"."""
        items = [item for item in self.items if not isinstance(item, BoundaryItem)]
        return bool(items) and isinstance(items[-1], RepairItem)

    def _counts(self, place: int, behind: int) -> bool:
        """Returns whether the number between two places belongs to a noun, as in no "first the KFC" or "two lefts"."""
        adverb = self.words[place] == "first" and self.word_at(behind) in (
            *self.grammar.determiners,
            "#landmark",
            "#street",
        )
        return not adverb and SIDES.get(self.word_at(behind)) is None

    def _reference(self, place: int) -> Match | None:
        asked = self.word_at(place - 1) in ("is", "are") and self.word_at(place + 1) in ("a", "any", "an")
        if self.word_at(place) == "there" and (asked or self.word_at(place + 1) in ("is", "are", "was", "were")):
            return None
        return self.grammar.references.longest(self.words, place) if place < len(self.words) else None

    def _is_unknown(self, place: int) -> bool:
        word = self.word_at(place)
        if not word.isalpha() or word in SIDES or word in ("lane", "lanes"):
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
        if self.word_at(place + 1) == "block" and self.word_at(place) in _ONE:
            return NounPhrase(None, 1, blocks=True), place + 2
        match = self.grammar.opportunities.longest(self.words, place) if place < len(self.words) else None
        if match is None or (self.words[place] == "one" and self.word_at(place + 1) in self.grammar.metres):
            return None, place
        end = place + match.length
        if self.word_at(end) == "of" and self.words[place].startswith("corner"):
            end += 1 + (self.word_at(end + 1) in self.grammar.determiners)
            street = self.names.get(end)
            if isinstance(street, StreetName):
                return NounPhrase(PlaceReference(street=street), None), end + 1
            return None, place
        if self.word_at(end) == "after" and self.word_at(end + 1) in _SPOKEN_OF:
            count = 2 if self.word_at(end + 1) in ("next", "this") else 1
            behind = end + 2 + (self.word_at(end + 2) == "one")
            if match is not None and self.words[place] not in ("block", "blocks") and not self._acts_at(behind):
                return NounPhrase(None, count, follows=True), behind
        if self.word_at(end) == "after" and self.word_at(end + 1) in _NOTHING:
            return NounPhrase(None, 1, follows=True), end + 1
        follows = self.word_at(place - 1) in ("next", "following")
        blocks = self.words[place] in ("block", "blocks")
        if blocks and ordinal is None and self.word_at(place - 1) in _ONE:
            ordinal = 1
        return NounPhrase(None, ordinal, blocks, follows=follows and not blocks), end

    def _acts_at(self, place: int) -> bool:
        """Returns whether an order begins at a place, so that "after that" stands between two of them."""
        match = self.grammar.terminals.longest(self.words, place)
        return match is not None and match.group in ("actions", "verbs", "lights") and place > 0

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
        place += self.word_at(place) == "somewhere"
        street = self.names.get(place + 1) if self.word_at(place) in _POSTPOSITIONS else None
        named = isinstance(street, StreetName) and street is not StreetName.QUERIED
        return (street, place + 2) if named and isinstance(street, StreetName) else (None, place)


def begins_noun_phrase(word: str, grammar: RouteGrammar) -> bool:
    """Returns whether a word that counts nothing may begin what `NounReader.noun_phrase` reads."""
    named = word.startswith("#") or word.endswith("'s") or word in grammar.modifiers or word in _ONE
    return named or grammar.references.may_begin(word) or grammar.opportunities.may_begin(word)
