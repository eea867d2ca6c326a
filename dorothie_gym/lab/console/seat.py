"""Seats of a room, their states, and the messages to their browsers."""

from __future__ import annotations

import enum
import secrets
from dataclasses import dataclass, field

from dorothie_gym.lab.console.connection import CloseCode, Connection
from dorothie_gym.lab.console.inbox import SeatInbox
from dorothie_gym.lab.console.seating import Occupancy, SeatPlan
from dorothie_gym.lab.console.talk_log import TalkLog
from dorothie_gym.ontology.roles import Role

EXPERIMENTER, SPECTATOR = "experimenter", "spectator"
"""Names of the seats without a role."""


class RoomState(enum.StrEnum):
    """State of a room."""

    WAITING = "waiting"
    """The session waits for the people that it needs."""
    RUNNING = "running"
    PAUSED = "paused"
    OVER = "over"


class PauseReason(enum.StrEnum):
    """Reason of a pause."""

    EXPERIMENTER = "experimenter"
    ABSENCE = "absence"


@dataclass(eq=False)
class Seat:
    """Seat of a room.

    Attributes:
        name: role, or `EXPERIMENTER` or `SPECTATOR`.
        role: role that is played here; None for seats that watch.
        plan: player of the role; None for seats that watch.
        talk: conversation as the seat knows it.
        inbox: commands that wait; None for seats that watch.
        token: secret of the link to the seat.
        connections: browsers at the seat; one for a role, any number for seats that watch.
        joined: whether a person has sat here.
        away_since: clock at which the person left [s]; None if no person has left.
        taken_over: whether the policy plays for a person who is away.
        done: last command that was carried out.
        refused: reasons for refusals that were not sent yet.
        recordings: names of the recordings of spoken turns that are kept.
    """

    name: str
    role: Role | None
    plan: SeatPlan | None
    talk: TalkLog
    inbox: SeatInbox | None = None
    token: str = field(default_factory=lambda: secrets.token_urlsafe(16))
    connections: list[Connection] = field(default_factory=list)
    joined: bool = False
    away_since: float | None = None
    taken_over: bool = False
    done: int = 0
    refused: list[str] = field(default_factory=list)
    recordings: set[str] = field(default_factory=set)

    @property
    def present(self) -> bool:
        """Whether a browser is connected."""
        return bool(self.connections)

    @property
    def needs_person(self) -> bool:
        """Whether the session needs a person here."""
        return self.plan is not None and self.plan.occupancy is Occupancy.HUMAN


@dataclass(frozen=True)
class Outgoing:
    """Message, picture or end of a connection, to be passed on by the thread of the event loop."""

    connection: Connection
    content: bytes | None = None
    picture: bytes | None = None
    code: CloseCode | None = None

    def deliver(self) -> None:
        """Passes it to the connection."""
        if self.content is not None:
            self.connection.send(self.content)
        if self.picture is not None:
            self.connection.show(self.picture)
        if self.code is not None:
            self.connection.close(self.code)
