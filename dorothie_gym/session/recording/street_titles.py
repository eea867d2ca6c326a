"""Names that the map of a recorded session has for its streets."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Final, TypeAlias

from msgspec import Meta

from dorothie_gym.dialogue.street_titles import NO_TITLES, StreetTitles
from dorothie_gym.errors import SessionError
from dorothie_gym.ontology.slots import StreetName
from dorothie_gym.session.recording.header import STREET_TITLES
from dorothie_gym.support.input_files import checked, raising

if TYPE_CHECKING:
    from dorothie_gym.session.recording.header import SessionHeader

_Title: TypeAlias = Annotated[str, Meta(max_length=200)]
_NAMES: Final = {name.label: name for name in StreetName}


def recorded_titles(header: SessionHeader) -> StreetTitles:
    """Returns the names of the map for the streets of a recorded session.

    Raises:
        SessionError: the field of the header is damaged.
    """
    if STREET_TITLES not in header.extra:
        return NO_TITLES
    with raising(SessionError):
        titles = checked(header.extra[STREET_TITLES], list[_Title], f"header, {STREET_TITLES}")
    return StreetTitles([_NAMES.get(label, StreetName.UNKNOWN) for label in header.street_names], titles)


def recorded_labels(header: SessionHeader) -> list[str]:
    """Returns what maps and boards call the streets of a recorded session: their names in the map, or in the session.

    Raises:
        SessionError: the field of the header is damaged.
    """
    return recorded_titles(header).labels(header.street_names)
