"""Connection of one browser: sent data, queued messages, and rate limit."""

from __future__ import annotations

import asyncio
import enum
from dataclasses import dataclass
from typing import Any, Final

import msgspec

from dorothie_gym.lab.admission import TokenBucket

MOST_WAITING: Final = 300
"""Messages that may wait for a slow browser, 30 s; beyond that, the connection is closed and can be reopened."""

BURST, RATE = 60.0, 30.0
"""Messages that a browser may send at once, and per second: a person who holds a key down sends 30 in a second."""


class CloseCode(enum.IntEnum):
    """Codes with which the server closes a connection; browsers do not reconnect after codes of 4400 and above."""

    RESTART = 1012
    TOO_SLOW = 1013
    REFUSED = 4400
    UNKNOWN_SEAT = 4404
    REPLACED = 4409
    TOO_FAST = 4429
    FAILED = 4500


@dataclass(frozen=True)
class Closing:
    """Request to close a connection after the queued messages."""

    code: CloseCode


class Connection:
    """Outgoing messages of a browser, and its last view.

    All methods are for the thread of the event loop, except that the thread of a session reads and writes the
    attributes.

    Attributes:
        shown: fields of the view as they were sent last.
        talk: number of lines of the talk that were sent.
        events: number of events that were sent.
        done: last acknowledged command.
        rate: requested pictures per second.
        pictured: decision of the last picture; None before the first.
        greeted: whether the seat has answered its first message.
    """

    def __init__(self) -> None:
        self.shown: dict[str, Any] = {}
        self.talk = self.events = 0
        self.done = 0
        self.rate = 0
        self.pictured: int | None = None
        self.greeted = False
        self._waiting: asyncio.Queue[bytes | Closing] = asyncio.Queue()
        self._picture: bytes | None = None
        self._closed = False
        self._messages = TokenBucket(BURST, RATE)

    # --- incoming ---------------------------------------------------------------------------------------------------

    def admits(self, now: float) -> bool:
        """Returns whether another message is within the rate that a browser may send; `now` is a clock [s]."""
        return self._messages.admits(now)

    # --- outgoing ---------------------------------------------------------------------------------------------------

    def send(self, content: bytes) -> None:
        """Appends a message in JSON; a connection that has too many waiting is closed."""
        if self._closed:
            return
        if self._waiting.qsize() >= MOST_WAITING:
            self.close(CloseCode.TOO_SLOW)
            return
        self._waiting.put_nowait(content)

    def show(self, picture: bytes) -> None:
        """Sets the picture to be sent next; one that a slow browser has not received yet is dropped."""
        if self._closed:
            return
        first = self._picture is None
        self._picture = picture
        if first:
            self._waiting.put_nowait(b"")

    def close(self, code: CloseCode) -> None:
        """Closes the connection after the queued messages."""
        if not self._closed:
            self._closed = True
            self._waiting.put_nowait(Closing(code))

    async def next(self) -> str | bytes | Closing:
        """Returns the next text in JSON, the next picture (bytes), or the request to close the connection."""
        while True:
            item = await self._waiting.get()
            if isinstance(item, Closing):
                return item
            if item:
                return item.decode()
            picture, self._picture = self._picture, None
            if picture is not None:
                return picture


def encode(message: dict[str, Any]) -> bytes:
    """Returns a message in JSON."""
    return msgspec.json.encode(message)


def changes(view: dict[str, Any], shown: dict[str, Any]) -> dict[str, Any]:
    """Returns the fields of a view that differ from those that were sent last."""
    return {name: value for name, value in view.items() if name not in shown or shown[name] != value}
