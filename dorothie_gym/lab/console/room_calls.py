"""Calls of the event loop that wait for the next tick of a room."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from dorothie_gym.lab.console.connection import Connection
from dorothie_gym.lab.console.messages import Incoming
from dorothie_gym.lab.console.seat import Seat
from dorothie_gym.session.recording.events import EndReason


@dataclass(frozen=True)
class Arrival:
    """A browser connected to a seat."""

    seat: Seat
    connection: Connection


@dataclass(frozen=True)
class Departure:
    """The connection of a browser ended."""

    seat: Seat
    connection: Connection


@dataclass(frozen=True)
class Receipt:
    """A browser sent a message."""

    seat: Seat
    connection: Connection
    message: Incoming


@dataclass(frozen=True)
class Start:
    """Request to start the session without the missing people."""


@dataclass(frozen=True)
class End:
    """Request to end the session."""

    reason: EndReason


Call: TypeAlias = Arrival | Departure | Receipt | Start | End
