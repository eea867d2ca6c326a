"""Form of the directions that participants give: their steps, and what they name."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Final, NamedTuple

from dorothie_gym.dialogue.propositions import Predicate
from dorothie_gym.ontology.dialogue_acts import ORDERING_MOVES
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import ActionValue

if TYPE_CHECKING:
    from dorothie_gym.session.recording.session import Session

_WAYS: Final = frozenset({ActionValue.J_TURN, ActionValue.LANE_FOLLOW, ActionValue.U_TURN, ActionValue.LANE_SWITCH})


class GivenDirection(NamedTuple):
    """Utterance of the participant that says which way to go.

    Attributes:
        steps: number of its steps.
        names_place: whether it names a landmark or an object.
    """

    steps: int
    names_place: bool


def manner_of(session: Session) -> str | None:
    """Returns the manner in which the participant's persona gives directions; None where none is recorded."""
    personas = session.header.extra.get("personas")
    persona = personas.get(str(Role.PARTICIPANT)) if isinstance(personas, Mapping) else None
    manner = persona.get("directions") if isinstance(persona, Mapping) else None
    return manner if isinstance(manner, str) else None


def directions_of(session: Session) -> Iterator[GivenDirection]:
    """Yields the directions of a session in the order in which they were given."""
    utterances: dict[int, list[bool]] = {}
    for move in session.moves(Role.PARTICIPANT):
        for said in move.meaning if move.act.move in ORDERING_MOVES else ():
            if said.predicate is Predicate.WILL and said.get("action") in _WAYS:
                place = said.get("place") is not None or said.get("object") is not None
                utterances.setdefault(move.utterance, []).append(place)
    for steps in utterances.values():
        yield GivenDirection(len(steps), any(steps))
