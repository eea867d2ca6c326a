"""Connections of a web server under floods: which are kept when there are too many, and in which order they are read.

A connection with a seat or another valid secret is known and is kept. All others are strangers: they share
a limited number of places, and have a limited time. When the places are taken, a new connection is still admitted.
Those of the address with most strangers give way: first those with too many requests, then the oldest. A browser that
sends its request at once is thus served, even if the flood comes from its address.

Connections are read in turns, so that a flood of requests cannot occupy the event loop.
"""

from __future__ import annotations

import asyncio
import ipaddress
from collections import Counter, OrderedDict, deque
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import chain, islice
from typing import Final, Protocol

MOST_STRANGERS: Final = 2000
"""Maximum number of connections without a valid secret: 300 browsers that load the page at once."""

MOST_KNOWN: Final = 1500
"""Maximum number of connections with a valid secret; further ones count as strangers."""

GIVING_WAY: Final = 16
"""Number of connections that give way together, so that they are chosen less often, which costs less."""

PATIENCE: Final = 1.0
"""Time by which a connection that has sent its request may be older than others before it gives way [s]."""

STRANGER_SECONDS: Final = 20.0
"""Time of a stranger to send a request, or to join with a websocket [s]; the slowest page has 100 kB."""

KNOWN_SECONDS: Final = 120.0
"""Time of a known person to send a request [s]: a recording of 1 MB over a line of 64 kbit/s."""

ANSWER_SECONDS: Final = 60.0
"""Time of a stranger to receive an answer [s]."""

REQUESTS: Final = (60.0, 10.0)
"""Requests of a connection that are served in one burst, and per second: a page has 20 files."""

ENDED_AT_ONCE: Final = 50
"""Timed-out connections that are ended in one pass: those of a flood time out together, and all of them would
keep the seats waiting for 0.2 s."""

TURNS_AT_ONCE: Final = 8
"""Turns between two passes of the event loop, in which seats are served: 10 ms of work."""

PAUSE: Final = 0.002
"""Shortest pause between two series of turns if connections wait for one [s], for the threads of the sessions."""

REST: Final = 1.0
"""Length of the pause after a series relative to the time of the series and its consequences: strangers get half of the
time of the event loop, however much a turn costs. A new websocket costs 1.5 ms, ten times as much as a page."""


class TokenBucket:
    """Tokens that are taken one by one and grow back at a constant rate.

    Args:
        burst: maximum and initial number of tokens.
        rate: tokens that grow back per second [1/s].
    """

    def __init__(self, burst: float, rate: float) -> None:
        self._burst, self._rate, self._tokens = burst, rate, burst
        self._seen: float | None = None

    def admits(self, now: float) -> bool:
        """Takes a token; returns whether there was one.

        Args:
            now: clock that does not jump [s].
        """
        passed = 0.0 if self._seen is None else now - self._seen
        self._seen, self._tokens = now, min(self._burst, self._tokens + passed * self._rate)
        if self._tokens < 1.0:
            return False
        self._tokens -= 1.0
        return True


def network_of(host: str | None) -> str:
    """Returns the address by which visitors are counted: one of IPv4, or the /64 network of one of IPv6.

    Args:
        host: address of a connection, or the address reported by a proxy.

    Returns:
        A short text; empty if it is not an address.
    """
    try:
        address = ipaddress.ip_address((host or "").partition("%")[0])
    except ValueError:
        return ""
    if isinstance(address, ipaddress.IPv6Address):
        if address.ipv4_mapped is not None:
            return str(address.ipv4_mapped)
        return str(ipaddress.ip_network((address, 64), strict=False))
    return str(address)


@dataclass(eq=False, kw_only=True)
class Visitor:
    """One connection.

    Attributes:
        address: address by which it is counted.
        transport: the connection itself.
        since: clock at which the server began to wait for its request [s].
        known: whether it has shown a valid secret.
        served: whether the server is working for it; otherwise it waits for the client.
        socket: whether it is a websocket.
        heavy: whether it sends too many requests.
    """

    address: str
    transport: asyncio.Transport
    since: float
    known: bool = False
    served: bool = False
    socket: bool = False
    heavy: bool = False
    requests: TokenBucket = field(default_factory=lambda: TokenBucket(*REQUESTS))

    def is_late(self, now: float) -> bool:
        """Returns whether it has timed out; `now` is the clock [s]."""
        if self.known and (self.socket or self.served):
            return False
        return now - self.since > (KNOWN_SECONDS if self.known else ANSWER_SECONDS if self.served else STRANGER_SECONDS)

    def rank(self) -> tuple[bool, float]:
        """Returns a key by which connections give way, smallest first."""
        return not self.heavy, self.since + (PATIENCE if self.served else 0.0)


class Visitors:
    """Connections of a server.

    Args:
        clock: clock of the server [s].
        strangers: most connections without a valid secret.
        known: most connections with one.
    """

    def __init__(self, clock: Callable[[], float], *, strangers: int = MOST_STRANGERS, known: int = MOST_KNOWN) -> None:
        self._clock = clock
        self._most_strangers, self._most_known = strangers, known
        self._strangers: dict[Visitor, None] = {}
        self._known: set[Visitor] = set()
        self._addresses: Counter[str] = Counter()
        self._closed = False

    def enter(self, transport: asyncio.Transport) -> Visitor:
        """Admits a connection; others give way if there are too many."""
        peer = transport.get_extra_info("peername")
        now = self._clock()
        visitor = Visitor(
            address=network_of(peer[0] if isinstance(peer, tuple) else None), transport=transport, since=now
        )
        if self._closed:
            transport.abort()
            return visitor
        if len(self._strangers) >= self._most_strangers:
            self._make_room()
        self._strangers[visitor] = None
        self._addresses[visitor.address] += 1
        return visitor

    def leave(self, visitor: Visitor) -> None:
        """Removes a connection that has ended."""
        self._known.discard(visitor)
        if visitor in self._strangers:
            del self._strangers[visitor]
            self._addresses[visitor.address] -= 1
            if not self._addresses[visitor.address]:
                del self._addresses[visitor.address]

    def recognise(self, visitor: Visitor) -> None:
        """Records that a connection has presented a valid secret."""
        if visitor in self._strangers and len(self._known) < self._most_known:
            self.leave(visitor)
            self._known.add(visitor)
            visitor.known = True

    def sweep(self) -> None:
        """Ends connections that have timed out, at most `ENDED_AT_ONCE`."""
        now = self._clock()
        late = (each for each in chain(self._strangers, self._known) if each.is_late(now))
        for visitor in list(islice(late, ENDED_AT_ONCE)):
            self._end(visitor)

    def close(self) -> None:
        """Ends the connections of all strangers, and admits no others: the server stops."""
        self._closed = True
        for visitor in list(self._strangers):
            self._end(visitor)

    def _make_room(self) -> None:
        crowded, _ = self._addresses.most_common(1)[0]
        candidates = [each for each in self._strangers if each.address == crowded]
        candidates.sort(key=lambda each: each.rank())
        for visitor in candidates[: min(GIVING_WAY, max(1, len(candidates) // 4))]:
            self._end(visitor)

    def _end(self, visitor: Visitor) -> None:
        self.leave(visitor)
        visitor.transport.abort()


# --- order of reading -------------------------------------------------------------------------------------------------


class Reader(Protocol):
    """Connection with unread data."""

    transport: asyncio.Transport
    visitor: Visitor

    def take_turn(self) -> None:
        """Reads one part."""


class Lane:
    """Waiting connections; addresses take turns, and of an address the newest and the oldest connection alternate.

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
    """Order in which connections are read: known people first; those with too many requests are one lane lower."""

    def __init__(self) -> None:
        self._lanes = [Lane(), Lane(), Lane()]
        self._due = False

    def ask(self, reader: Reader) -> None:
        """Asks for a turn; each connection waits for one at most."""
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
