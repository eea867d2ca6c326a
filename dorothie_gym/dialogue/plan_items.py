"""Items of route talk: actions, turns, conditions, places, sides and quantities, as the chunker finds them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Final, NamedTuple, TypeAlias

from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.dialogue.numerals import NUMBER_WORDS, read_cardinals, read_ordinal
from dorothie_gym.dialogue.routes import ConditionRelation, PlaceReference

if TYPE_CHECKING:
    from dorothie_gym.dialogue.route_grammar import RouteGrammar
    from dorothie_gym.ontology.slots import SlotValue


class ActionItem(NamedTuple):
    """Action, as a kind of the grammar ("stop", "slower", ...); `place` and `end` are its tokens."""

    kind: str
    place: int
    end: int


class VerbItem(NamedTuple):
    """Verb that says something only with what follows: "take", "go"."""

    word: str
    end: int


class TurnItem(NamedTuple):
    """Left or right, perhaps with a number ("the second left") or several times ("two lefts")."""

    direction: Direction
    ordinal: int | None
    times: int


class LaneItem(NamedTuple):
    """Lane by its side."""

    direction: Direction | None


class SideItem(NamedTuple):
    """Side of the street or of the car; `stated` says whether a statement tells it: "the house is on the left"."""

    direction: Direction
    stated: bool = False


class ConditionItem(NamedTuple):
    """Relation to a place; the place is None for "it" and "that"."""

    relation: ConditionRelation
    place: NounPhrase | None


class NounPhrase(NamedTuple):
    """Place, or an opportunity to turn ("the second street") if it names nothing else; or a number of blocks.

    `follows` says whether an opportunity is counted from the one spoken of before: "the one after that"; `elliptical`
    whether a number stands without its noun: "the second".
    """

    reference: PlaceReference | None
    ordinal: int | None
    blocks: bool = False
    follows: bool = False
    elliptical: bool = False


class DistanceItem(NamedTuple):
    """Distance [m]."""

    metres: int


class SpeedItem(NamedTuple):
    """Speed [km/h]; `unit` is true if the unit was named."""

    speed: int
    unit: bool


class BoundaryItem(NamedTuple):
    """Border between clauses: "then", "and", "," or "."; `place` is the token behind it."""

    kind: str
    place: int


class RepairItem(NamedTuple):
    """Words after which the next item replaces the one before."""

    place: int


class NegationItem(NamedTuple):
    """Words that negate the next item: "forbid", "not", "instead", "cancel"."""

    kind: str


class ContingencyItem(NamedTuple):
    """Condition of the world; `place` is the token behind it, `leading` whether what depends on it follows."""

    place: int
    leading: bool


class UnitItem(NamedTuple):
    """Unit of speed without a number: "thirty, miles"; the factor to km/h."""

    factor: float


class WordItem(NamedTuple):
    """Word that the grammar does not know."""

    word: str


Item: TypeAlias = (
    ActionItem
    | VerbItem
    | TurnItem
    | LaneItem
    | SideItem
    | ConditionItem
    | NounPhrase
    | DistanceItem
    | SpeedItem
    | BoundaryItem
    | RepairItem
    | NegationItem
    | ContingencyItem
    | UnitItem
    | WordItem
)


SIDES: Final[Mapping[str, Direction]] = {
    "left": Direction.LEFT,
    "right": Direction.RIGHT,
    "leftwards": Direction.LEFT,
    "rightwards": Direction.RIGHT,
    "lefts": Direction.LEFT,
    "rights": Direction.RIGHT,
}
"""Directions by their words."""


PLURAL_SIDES: Final = frozenset({"lefts", "rights"})
"""Directions that are counted: "two lefts"."""

PAIRS: Final = frozenset({"couple", "pair"})
"""Nouns that count two."""


class TokenReader:
    """Tokens of a sentence, with the items found so far."""

    def __init__(
        self, words: Sequence[str], names: Mapping[int, SlotValue], lead: Mapping[int, str], grammar: RouteGrammar
    ) -> None:
        """Begins with the tokens, the names and first words of `read_items`, and the grammar."""
        self.words, self.names, self.lead, self.grammar = words, names, lead, grammar
        self.items: list[Item] = []

    def word_at(self, place: int) -> str:
        """Returns the token at a place; "" where there is none."""
        return self.words[place] if 0 <= place < len(self.words) else ""

    def ordinal(self, place: int) -> tuple[int | None, int]:
        """Returns an ordinal or a small count, and the place behind it."""
        start = place
        while self.word_at(place) in self.grammar.determiners or self.word_at(place) == "very":
            place += 1
        word = self.word_at(place).removesuffix("'s")
        counted = word == "following" and self.word_at(place - 1) in self.grammar.determiners
        number = 1 if counted else read_ordinal(word)
        if word in PAIRS and self.word_at(place + 1) in ("of", "more", *PLURAL_SIDES):
            return 2, place + 1 + (self.word_at(place + 1) not in PLURAL_SIDES)  # "a couple of lefts"
        if number is None and (word in NUMBER_WORDS or word[:1].isdigit()):
            counts = read_cardinals([word])
            number = counts[0] if counts and 2 <= counts[0] <= 9 else None
        return (None, start) if number is None else (number, place + 1)


def begins_ordinal(word: str, grammar: RouteGrammar) -> bool:
    """Returns whether a word may begin what `TokenReader.ordinal` reads."""
    base = word.removesuffix("'s")
    counted = base == "following" or read_ordinal(base) is not None or base in NUMBER_WORDS or base[:1].isdigit()
    return counted or word in grammar.determiners or word in ("very", *PAIRS)
