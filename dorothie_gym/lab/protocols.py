"""Protocols of the web server: those of uvicorn, with limits for connections, and turns in which requests are read."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final, cast

import h11
from starlette.requests import HTTPConnection
from uvicorn._types import ASGIReceiveEvent, ASGISendEvent
from uvicorn.config import Config
from uvicorn.protocols.http.flow_control import FlowControl
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.utils import ClientDisconnected
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from uvicorn.server import ServerState
from websockets.frames import CloseCode

from dorothie_gym.lab.admission import Turns, Visitor, Visitors

PART: Final = 16 * 1024
"""Bytes of a connection that are read in one turn; parts of a body may be as small as a byte, and cost as much."""

FIRST_BYTES: Final = 32 * 1024
"""Maximum number of bytes of a websocket that has not joined: joining takes 60."""

SLICE: Final = 4 * 1024
"""Bytes of such a websocket that are read in one turn: they may be 700 pings."""

LINGERING: Final = 2.0
"""Time in which the rest of a refused message is received and dropped [s]: a connection that is closed before it has
been read loses the reason that was sent."""

_GUARD: Final = "dorothie_gym.guard"


@dataclass(frozen=True)
class Guard:
    """Shared state of all connections of a server, and the connection of a request."""

    visitors: Visitors
    turns: Turns
    visitor: Visitor | None = None


def recognise(connection: HTTPConnection) -> None:
    """Records that a request, or a websocket, has presented a valid secret: its connection is kept in a flood.

    Does nothing if another web server runs the application.
    """
    guard = connection.scope.get("state", {}).get(_GUARD)
    if guard is not None:
        guard.visitors.recognise(guard.visitor)


class _Flow(FlowControl):
    """Flow of a connection that reports when a handler wants to continue reading."""

    def __init__(self, transport: asyncio.Transport, resumed: Callable[[], None]) -> None:
        super().__init__(transport)
        self._resumed = resumed

    def resume_reading(self) -> None:
        super().resume_reading()
        self._resumed()


class GuardedHttp(H11Protocol):
    """Connection for requests, which are read in turns.

    Args:
        guard: shared state of all connections.
        config, server_state, app_state, _loop: as for uvicorn's protocol.
    """

    def __init__(
        self,
        guard: Guard,
        config: Config,
        server_state: ServerState,
        app_state: dict[str, Any],
        _loop: asyncio.AbstractEventLoop | None = None,
    ) -> None:
        super().__init__(config, server_state, app_state, _loop)
        self._guard = guard
        self._unread = bytearray()
        self._asked = False
        self.visitor: Visitor

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Counts the connection; others, or this one, may be ended."""
        super().connection_made(transport)
        self.flow = _Flow(transport, self._read_on)
        self.visitor = self._guard.visitors.enter(transport)
        guard = Guard(self._guard.visitors, self._guard.turns, self.visitor)
        self.app_state = {**self.app_state, _GUARD: guard}

    def connection_lost(self, exc: Exception | None) -> None:
        """Removes the connection."""
        self._guard.visitors.leave(self.visitor)
        self._unread.clear()
        super().connection_lost(exc)
        self._unset_keepalive_if_required()
        self._let_go()

    def _let_go(self) -> None:
        """Drops references to this object, so that it needs no garbage collection, which stops all threads."""
        self.flow = self.cycle = None  # type: ignore[assignment]

    def data_received(self, data: bytes) -> None:
        """Keeps received data until it is this connection's turn."""
        self._unset_keepalive_if_required()
        self._unread += data
        if len(self._unread) >= PART:
            self.transport.pause_reading()
        self._ask()

    def handle_events(self) -> None:
        """Reads the next request in a turn of its own, if the client has sent several at once."""
        self._ask()

    def on_response_complete(self) -> None:
        """Waits for the next request."""
        self.visitor.since, self.visitor.served = self.loop.time(), self._asked
        super().on_response_complete()

    def take_turn(self) -> None:
        """Reads a part of the received data."""
        self._asked = False
        if self._unread:  # h11 takes empty data for the end of the connection
            self.conn.receive_data(bytes(self._unread[:PART]))
            del self._unread[:PART]
        try:
            super().handle_events()
        except h11.LocalProtocolError:  # malformed, after its answer has begun
            self.transport.abort()
            return
        if self.conn.their_state is h11.ERROR:  # answered by uvicorn; a handler may still wait for the body
            if self.cycle is not None:
                self.cycle.disconnected = True
                self.cycle.message_event.set()
            return
        if self.transport.get_protocol() is not self:
            self._pass_on()
        elif self._unread and not self.flow.read_paused:
            self._ask()
        elif len(self._unread) < PART and not self.flow.read_paused:
            self.transport.resume_reading()
        answering = self.cycle is not None and not self.cycle.response_complete and not self.cycle.more_body
        self.visitor.served = self._asked or answering

    def _pass_on(self) -> None:
        """Leaves the connection to the protocol of its websocket."""
        self.visitor.since, self.visitor.socket = self.loop.time(), True
        self.transport.resume_reading()
        sent, _ = self.conn.trailing_data  # with the request, and before its answer
        if sent or self._unread:
            cast(asyncio.Protocol, self.transport.get_protocol()).data_received(sent + bytes(self._unread))
            self._unread.clear()
        self._let_go()

    def _read_on(self) -> None:
        if self._unread:
            self._ask()

    def _ask(self) -> None:
        if not self._asked:
            self._asked = self.visitor.served = True
            self._guard.turns.ask(self)

    def shutdown(self) -> None:
        """Ends the connection after the current answer."""
        if self.conn.our_state is h11.ERROR:
            self.transport.abort()
        else:
            super().shutdown()


class GuardedSocket(WebSocketsSansIOProtocol):
    """Websocket that is read in turns, and may send little, until it has joined; it gets the reason of a refusal."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        guard: Guard = self.app_state[_GUARD]
        assert guard.visitor is not None
        self._guard, self.visitor = guard, guard.visitor
        self._unread = bytearray()
        self._asked = False
        self._received = 0
        self._refused = False

    def connection_lost(self, exc: Exception | None) -> None:
        """Removes the connection."""
        self._guard.visitors.leave(self.visitor)
        self._unread.clear()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Reads received data, or keeps the data of a stranger until it is this connection's turn."""
        if self._refused:
            return
        if not self._unread and (self.visitor.known or not self.handshake_initiated):
            super().data_received(data)
            return
        self._unread += data
        if len(self._unread) >= PART:
            self.transport.pause_reading()
        if not self.read_paused:
            self._ask()

    async def receive(self) -> ASGIReceiveEvent:
        """Returns the next message; the rest of the received data is read after it."""
        message = await super().receive()
        if self._unread and not self.read_paused:
            self._ask()
        return message

    def take_turn(self) -> None:
        """Reads a slice of the received data; refuses a stranger who has sent more data than joining needs."""
        self._asked = False
        part = bytes(self._unread[:SLICE])
        del self._unread[:SLICE]
        if not self.visitor.known:
            self._received += len(part)
            if self._received > FIRST_BYTES:
                self._refuse_length()
                return
        super().data_received(part)
        if self._refused or self.read_paused:
            return
        if self._unread:
            self._ask()
        else:
            self.transport.resume_reading()

    def _ask(self) -> None:
        if not self._asked:
            self._asked = True
            self._guard.turns.ask(self)

    def _refuse_length(self) -> None:
        if self.handshake_complete:
            self.conn.fail(CloseCode.MESSAGE_TOO_BIG)
            self.handle_parser_exception()
        else:
            self.transport.abort()

    async def send(self, message: ASGISendEvent) -> None:
        """Sends the application's message, unless the websocket has been refused or left.

        A browser may close a websocket, and the server may stop, before the application has answered the handshake.
        Nothing can be sent then (uvicorn 0.54 tries to, and fails an assertion of websockets 17).
        """
        await self.writable.wait()
        if self._refused or (self.conn.eof_sent and not self.handshake_complete):
            self.handshake_complete = True
            raise ClientDisconnected
        await super().send(message)

    def send_500_response(self) -> None:
        """Refuses a handshake that the application does not answer, at most once."""
        if not self._refused and not self.conn.eof_sent:
            super().send_500_response()
        self._refused = self.handshake_complete = True

    def handle_parser_exception(self) -> None:
        """Sends the reason of a refusal; further data of the browser are dropped until it has read the reason."""
        sent = self.conn.close_sent
        assert sent is not None
        self._refused = self.close_sent = True
        self._unread.clear()
        self.queue.put_nowait({"type": "websocket.disconnect", "code": sent.code, "reason": sent.reason})
        self.transport.write(b"".join(self.conn.data_to_send()))
        self.transport.write_eof()
        self.transport.resume_reading()
        self.close_timer = self.loop.call_later(LINGERING, self.transport.abort)
