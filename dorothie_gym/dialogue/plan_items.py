"""Items of route talk: actions, turns, conditions, places, sides and quantities, as the chunker finds them."""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

from dorothie_gym.dialogue.realization_context import Direction
from dorothie_gym.dialogue.routes import ConditionRelation, PlaceReference


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
    """Place, or an opportunity to turn ("the second street") if it names nothing else; or a number of blocks."""

    reference: PlaceReference | None
    ordinal: int | None
    blocks: bool = False


class DistanceItem(NamedTuple):
    """Distance [m]."""

    metres: int


class SpeedItem(NamedTuple):
    """Speed [km/h]; `unit` says whether its unit was named."""

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
