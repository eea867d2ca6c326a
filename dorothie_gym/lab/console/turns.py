"""Turns of the connections that have something to be read: a flood of requests cannot occupy the event loop."""

from __future__ import annotations

import asyncio
from collections import OrderedDict, deque
from typing import Final, Protocol

from dorothie_gym.lab.console.visitors import Visitor

TURNS_AT_ONCE: Final = 8
"""Turns between two passes of the event loop, in which seats are served: 10 ms of work."""

PAUSE: Final = 0.002
"""Shortest pause between two series of turns if a connection waits for one [s], for the threads of the sessions."""

REST: Final = 1.0
"""Length of the pause after a series relative to the time that the series and its consequences took: strangers get half
of the event loop's time, whatever a turn costs. A new websocket costs 1.5 ms, ten times as much as a page.
"""


class Reader(Protocol):
    """Connection with something to be read."""

    transport: asyncio.Transport
    visitor: Visitor

    def take_turn(self) -> None:
        """Reads one part."""


class Lane:
    """Connections that wait; addresses take turns, and of an address the newest and the oldest connection in turn.

    If a flood is more than can be read, the oldest connections have little hope of an answer in time, and a person's
    browser is among the newest. If it is less, the newest ones alone would keep some of the others waiting for long.
    """

    def __init__(self) -> None:
        self._queues: OrderedDict[str, deque[Reader]] = OrderedDict()
        self._newest = False

    def __bool__(self) -> bool:
        return bool(self._queues)

    def add(self, reader: Reader) -> None:
        """Appends a connection."""
        self._queues.setdefault(reader.visitor.address, deque()).append(reader)

    def next(self) -> Reader:
        """Removes and returns the next connection; the lane must not be empty."""
        address, queue = self._queues.popitem(last=False)
        self._newest = not self._newest
        reader = queue.pop() if self._newest else queue.popleft()
        if queue:
            self._queues[address] = queue
        return reader


class Turns:
    """Order in which connections are read: known people first; those that ask too often come a lane later."""

    def __init__(self) -> None:
        self._lanes = [Lane(), Lane(), Lane()]
        self._due = False

    def ask(self, reader: Reader) -> None:
        """Requests a turn; each connection has at most one pending request."""
        loop = asyncio.get_running_loop()
        visitor = reader.visitor
        visitor.heavy = not visitor.requests.admits(loop.time())
        self._lanes[visitor.heavy + (not visitor.known)].add(reader)
        if not self._due:
            self._due = True
            loop.call_soon(self._run)

    def _run(self) -> None:
        loop = asyncio.get_running_loop()
        turns, began = 0, loop.time()
        while turns < TURNS_AT_ONCE and (lane := next(filter(None, self._lanes), None)) is not None:
            reader = lane.next()
            if not reader.transport.is_closing():
                reader.take_turn()
                turns += 1
        self._due = bool(turns)
        if turns:
            loop.call_soon(self._rest, began)  # after the first steps of the handlers

    def _rest(self, began: float) -> None:
        """Goes on after a pause; `began` is the clock at the begin of the series [s]."""
        loop = asyncio.get_running_loop()
        loop.call_later(max(PAUSE, REST * (loop.time() - began)), self._run)
