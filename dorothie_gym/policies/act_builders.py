"""Contents that the scripted speakers often have: destinations, errands, and actions of the car."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.ontology.dialogue_acts import DialogueAct, DialogueMove
from dorothie_gym.ontology.slots import ActionValue, GoalStatus, LandmarkName, Slot, SlotValue, StreetName

if TYPE_CHECKING:
    from dorothie_gym.dialogue.direction import Direction
    from dorothie_gym.dialogue.nlu import ParsedText

QUESTIONS = frozenset({DialogueMove.QUERY_W, DialogueMove.QUERY_YN, DialogueMove.CHECK})
"""Moves that require an answer about the drive."""


def destination(place: LandmarkName | None, street: StreetName | None = None) -> Proposition:
    """Returns the proposition that the car should go to a place now, with the street of the place if it is known."""
    return Proposition.of(Predicate.GOAL, place=place, street=named(street))


def errand(place: LandmarkName | None, status: GoalStatus, street: StreetName | None = None) -> Proposition:
    """Returns that the errand at a place has a status."""
    return Proposition.of(Predicate.TASK, place=place, street=named(street), status=status)


def located(place: LandmarkName | None, street: StreetName | None) -> Proposition:
    """Returns the proposition that a place lies on a street."""
    return Proposition.of(Predicate.LOCATED, place=place, street=street)


def action(
    value: ActionValue | None,
    words: ParsedText | None = None,
    *,
    direction: Direction | None = None,
    street: StreetName | None = None,
    place: LandmarkName | None = None,
    speed: int | None = None,
) -> Proposition:
    """Returns the proposition that the car will carry out a requested or planned action.

    Args:
        value: the action; None where only the street is said.
        words: words of the other speaker that give direction and speed.
        direction: direction, where no words give it.
        street: street of the action, or street to enter.
        place: place of the action.
        speed: speed [km/h], where no words give it.
    """
    if words is not None:
        direction = words.direction
        speed = round(words.speed) if words.speed is not None and value is ActionValue.SPEED_CHANGE else None
    return Proposition.of(
        Predicate.WILL, action=value, direction=direction, street=named(street), place=place, speed=speed
    )


def asked_by_slots(
    objects: Sequence[SlotValue],
    actions: Sequence[SlotValue],
    places: Sequence[SlotValue],
    streets: Sequence[SlotValue],
) -> Proposition | None:
    """Returns the proposition of a yes/no question with slot values, from the first of each kind; None if unclear."""
    if ActionValue.LIGHT_CHANGE in actions:
        return Proposition.of(Predicate.LIGHTS_ON)
    if objects:
        return Proposition.of(Predicate.SEES, object=objects[0])
    if places and streets:
        return Proposition.of(Predicate.LOCATED, place=places[0], street=streets[0])
    if places:
        return Proposition.of(Predicate.KNOWS, place=places[0])
    if actions:
        return Proposition.of(Predicate.DOES, action=actions[0])
    return Proposition.of(Predicate.ON_STREET, street=streets[0]) if streets else None


def named(street: StreetName | None) -> StreetName | None:
    """Returns a street, or None for one whose name is unknown."""
    return None if street is StreetName.UNKNOWN else street


def named_streets(act: DialogueAct) -> tuple[StreetName, ...]:
    """Returns the streets that an act names, except "unknown" and "queried"."""
    unnamed = (StreetName.UNKNOWN, StreetName.QUERIED)
    values = act.values(Slot.STREET)
    return tuple(name for name in values if isinstance(name, StreetName) and name not in unnamed)


def named_landmarks(act: DialogueAct) -> tuple[LandmarkName, ...]:
    """Returns the landmarks that an act names, "unknown" and "queried" among them."""
    return tuple(name for name in act.values(Slot.LANDMARK) if isinstance(name, LandmarkName))


def arguments_of(content: Proposition, *kept: str) -> tuple[str, ...]:
    """Returns the names of a content's arguments except `kept`: those that a short answer omits."""
    return tuple(name for name, _ in content.arguments if name not in kept)


def first_name(values: Iterable[object]) -> LandmarkName | None:
    """Returns the first landmark among slot values; None if there is none."""
    return next((value for value in values if isinstance(value, LandmarkName)), None)
