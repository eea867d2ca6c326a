"""Simulated people at the seats of a room, with a clock of their own: no browser, no waiting."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dorothie_gym.lab.console.config import AbsenceRules, ConsoleConfig
from dorothie_gym.lab.console.connection import CloseCode, Connection
from dorothie_gym.lab.console.messages import decode_message
from dorothie_gym.lab.console.room import Room
from dorothie_gym.lab.console.seating import parse_roles
from dorothie_gym.session.session_engine import SessionEngine

if TYPE_CHECKING:
    from dorothie_gym.maps import Town

TOWN, SEED = "brookside", 7


class Person:
    """Person with a browser at a seat.

    Attributes:
        state: fields of the view, merged from all frames.
        talk: lines of the talk.
        received: all messages as bytes.
        refusals: reasons of refusals.
        done: last acknowledged command.
        closed: code with which the server closed the connection, or None.
    """

    def __init__(self, room: Room, seat: str) -> None:
        self.room, self.seat = room, room.seats[seat]
        self.connection = Connection()
        self.state: dict[str, Any] = {}
        self.hello: dict[str, Any] = {}
        self.talk: list[dict[str, Any]] = []
        self.events: list[dict[str, Any]] = []
        self.answers: list[dict[str, Any]] = []
        self.received: list[bytes] = []
        self.pictures: list[bytes] = []
        self.refusals: list[str] = []
        self.done = self._number = 0
        self.closed: CloseCode | None = None
        room.join(self.seat, self.connection)

    def send(self, k: str, **fields: Any) -> None:
        self.room.receive(self.seat, self.connection, decode_message(json.dumps({"k": k, **fields})))

    def command(self, k: str, **fields: Any) -> int:
        self._number += 1
        self.send(k, n=self._number, **fields)
        return self._number

    def leave(self) -> None:
        self.room.leave(self.seat, self.connection)

    def read(self, content: bytes) -> None:
        self.received.append(content)
        message = json.loads(content)
        kind = message.pop("k")
        if kind == "hello":
            self.hello, self.state, self.talk = message, {}, []
        elif kind == "frame":
            self.done = message.pop("done", self.done)
            self.talk += message.pop("talk", [])
            self.events += message.pop("events", [])
            self.refusals += message.pop("refused", [])
            self.state |= message
        elif kind == "refused":
            self.refusals.append(message["reason"])
        else:
            self.answers.append({"k": kind, **message})

    def said(self) -> list[str]:
        return [line["text"] for line in self.talk]


class Table:
    """Room with people, whose clock runs as fast as its ticks."""

    def __init__(
        self,
        roles: str = "",
        *,
        folder: Path | None = None,
        absence: AbsenceRules | None = None,
        max_seconds: float = 120.0,
        pictures: bool = False,
        seed: int = SEED,
        storyboard: str | None = None,
        town: Town | str = TOWN,
    ) -> None:
        config = ConsoleConfig(max_seconds=max_seconds, pictures=pictures, absence=absence or AbsenceRules())
        engine = SessionEngine(town, storyboard, config=config.environment())
        self.room = Room(engine, parse_roles(roles), config, seed=seed, folder=folder)
        self.people: list[Person] = []
        self.now = 0.0

    def seat(self, name: str) -> Person:
        person = Person(self.room, name)
        self.people.append(person)
        return person

    def tick(self) -> None:
        for out in self.room.tick(self.now):
            for person in self.people:
                if person.connection is out.connection:
                    if out.content is not None:
                        person.read(out.content)
                    if out.picture is not None:
                        person.pictures.append(out.picture)
                    person.closed = out.code or person.closed
        self.now += 0.1

    def run(self, seconds: float) -> None:
        """Lets a time pass on the clock of the room [s]."""
        for _ in range(round(10 * seconds)):
            self.tick()

    def until(self, reached: Callable[[], object], seconds: float = 60.0) -> None:
        """Lets time pass until something is true; fails after `seconds`."""
        for _ in range(round(10 * seconds)):
            if reached():
                return
            self.tick()
        assert reached(), f"not within {seconds} s"

    @property
    def time(self) -> float:
        """Simulated time of the session [s]."""
        return self.room.engine.session.world.time
