"""Sources of the objects around the ego: the record of a session, or pictures of the camera on the car."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Protocol

from dorothie_gym.errors import SessionError

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.session.recording.session import Session
    from dorothie_gym.session.recording.surroundings import SceneTable


class Sight(Protocol):
    """Source of objects."""

    @property
    def digest(self) -> str:
        """Text that changes when the same session may have other objects."""
        ...

    def actors(self, session: Session, town: Town) -> SceneTable:
        """Returns the objects at each record of the session's surroundings, as rows of `ACTOR_DTYPE`."""
        ...


def drawing_digest() -> str:
    """Returns a digest of the sources that draw pictures.

    Raises:
        SessionError: the sources cannot be read.
    """
    from dorothie_gym.pictures.camera.array_cache import builder_digest  # here: most features need no camera

    if (digest := builder_digest()) is None:
        raise SessionError("the sources of the camera cannot be read; use the objects of the record")
    return digest


@dataclass(frozen=True)
class VisibleBoxes:
    """Recorded actors that the camera on the car shows: what a detector without errors finds ("oracle boxes")."""

    @property
    def digest(self) -> str:
        """Digest of the sources that draw pictures.

        Raises:
            SessionError: the sources cannot be read.
        """
        return f"visible boxes {drawing_digest()}"

    def actors(self, session: Session, town: Town) -> SceneTable:
        """Returns the recorded actors that the pictures show."""
        from dorothie_gym.pictures.camera.pictured_actors import pictured_actors

        return pictured_actors(session, town)


def seen_by(sight: Sight | None, session: Session, town: Town | None) -> Session:
    """Returns a session with the objects of a sight in place of the recorded ones.

    Sessions without surroundings, or of an unknown town, stay as they are.

    Args:
        sight: source of objects; None for the record.
        session: recorded session.
        town: its town, None if it is unknown.
    """
    if sight is None or town is None or not len(session.scene.actors) or not len(session.trajectory):
        return session
    return replace(session, scene=replace(session.scene, actors=sight.actors(session, town)))
