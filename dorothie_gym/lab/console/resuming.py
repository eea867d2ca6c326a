"""Interrupted sessions with people: the data that a new server needs to resume one."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from dorothie_gym.errors import SessionError
from dorothie_gym.session.recording.files import SessionState
from dorothie_gym.session.recording.seat_log import SeatEvent, SeatEventKind, read_seat_log
from dorothie_gym.session.recording.session import Session, session_state

if TYPE_CHECKING:
    from dorothie_gym.lab.console.config import ConsoleConfig
    from dorothie_gym.ontology.roles import Role

SEATS = "seats"
"""Field of a header with the planned players of a session with people, by role."""


@dataclass(frozen=True, kw_only=True)
class Resumed:
    """Interrupted session.

    Attributes:
        session: its record, up to the last decision.
        seat_events: events at its seats.
    """

    session: Session
    seat_events: tuple[SeatEvent, ...]

    @classmethod
    def load(cls, folder: Path) -> Resumed:
        """Returns the interrupted session of a folder.

        Raises:
            SessionError: there is none, it is complete, or no people took part in it.
        """
        session = Session.load(folder)
        if session.complete:
            raise SessionError(f"{folder}: the session is complete; only an interrupted one can go on")
        events = read_seat_log(folder)
        if events is None or not isinstance(session.header.extra.get(SEATS), Mapping):
            raise SessionError(f"{folder}: is no session of the console; it cannot go on")
        return cls(session=session, seat_events=events)

    @property
    def roles(self) -> str:
        """Players of the roles, as `parse_roles` reads them."""
        seats = self.session.header.extra[SEATS]
        assert isinstance(seats, Mapping)
        return ",".join(f"{role}={player}" for role, player in seats.items())

    def said(self, frame: int) -> Iterator[tuple[Role, str, str | None]]:
        """Yields speaker, words and name of the recording of the spans that people said at a frame."""
        for event in self.seat_events:
            if event.frame == frame and event.kind is SeatEventKind.SAID and event.role is not None:
                audio = event.data.get("audio")
                yield event.role, str(event.data.get("text")), None if audio is None else str(audio)

    def config(self, usual: ConsoleConfig) -> ConsoleConfig:
        """Returns the settings of a console with the pace of the session."""
        return replace(usual, decision_frequency=self.session.header.decision_frequency)


def interrupted_sessions(folder: Path) -> list[Path]:
    """Returns the folders of interrupted sessions in a folder, sorted; empty if there is no such folder."""
    if not folder.is_dir():
        return []
    folders = [each for each in folder.iterdir() if each.is_dir()]
    return sorted(each for each in folders if session_state(each) is SessionState.PARTIAL)
