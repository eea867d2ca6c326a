"""Web server of the console: pages, maps of towns, and the websocket of the seats."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import secrets
from collections.abc import AsyncIterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Final

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from dorothie_gym.dialogue.grammar import load_grammar
from dorothie_gym.lab.console.connection import CloseCode, Closing, Connection, encode
from dorothie_gym.lab.console.messages import Join, MessageError, decode_message
from dorothie_gym.lab.console.pace import run_room
from dorothie_gym.lab.console.spoken_turns import SpokenTurns
from dorothie_gym.lab.gate import gzipped_json
from dorothie_gym.lab.hosts import is_same_origin
from dorothie_gym.lab.pages import SHARED, files, page, redirection
from dorothie_gym.lab.protocols import recognise
from dorothie_gym.lab.town_page import town_page
from dorothie_gym.lab.web import application

if TYPE_CHECKING:
    from dorothie_gym.lab.console.room import Room
    from dorothie_gym.lab.console.seat import Seat

logger = logging.getLogger(__name__)

STATIC: Final = Path(__file__).parent / "static"

STYLE: Final = "/console/console.css"
"""Style sheet of pages with a seat."""

JOIN_SECONDS: Final = 10.0
"""Time for the first message of a connection [s]."""

MOST_JOINING: Final = 400
"""Maximum number of websockets that have not joined yet; beyond it, the one that has waited longest is closed."""

MOST_WATCHING: Final = 500
"""Maximum number of websockets at seats that watch; a seat of a role has one at most, and always has room."""

THREADS: Final = 4
"""Threads for the ticks of all rooms; they share one core, as Python code holds a lock."""


class Console:
    """Rooms of a server and the seats of their links.

    Args:
        rooms: rooms of the server when it starts.
        suspends: whether sessions in progress are interrupted when the server stops, so that another server can resume
            them; otherwise they end.
        speech: whether people can speak in rooms that are opened later.

    Attributes:
        rooms: rooms that are open.
        joining: times of the websockets that have not joined yet, the oldest first.
        connections: number of websockets that have joined a seat.

    Raises:
        SpeechError: people can speak, and the extra `speech` is not installed.
    """

    def __init__(self, rooms: Sequence[Room] = (), *, suspends: bool = False, speech: bool = False) -> None:
        self.rooms = list(rooms)
        self.connections = 0
        self.joining: dict[asyncio.Timeout, None] = {}
        self._suspends = suspends
        self._tasks: dict[Room, asyncio.Task[None]] = {}
        self._threads: tuple[ThreadPoolExecutor, ThreadPoolExecutor] | None = None
        speaks = speech or any(room.config.speech for room in self.rooms)
        self._speech = SpokenTurns(self.find) if speaks else None

    def find(self, token: str) -> tuple[Room, Seat] | None:
        """Returns the room and the seat of a token; None for an unknown one."""
        seats = ((room, seat) for room in self.rooms for seat in room.seats.values())
        given = token.encode()
        return next((found for found in seats if secrets.compare_digest(found[1].token.encode(), given)), None)

    def open(self, room: Room) -> None:
        """Opens a room while the server runs."""
        self.rooms.append(room)
        self._run(room)

    def close(self, room: Room) -> None:
        """Closes a room whose session has ended, and the connections of its seats."""
        self.rooms.remove(room)
        self._tasks.pop(room).cancel()
        for seat in room.seats.values():
            for connection in seat.connections:
                connection.close(CloseCode.UNKNOWN_SEAT)

    def _run(self, room: Room) -> None:
        assert self._threads is not None, "the server does not run"
        self._tasks[room] = asyncio.create_task(run_room(room, *self._threads))

    def town_page(self, name: str) -> bytes | None:
        """Returns the map of a town in which a session takes place; None for others."""
        towns = (room.engine.town for room in self.rooms)
        return next((town_page(town) for town in towns if town.name == name), None)

    def app(self) -> Starlette:
        """Returns the application, which plays the sessions while it runs."""

        @contextlib.asynccontextmanager
        async def lifespan(app: Starlette) -> AsyncIterator[None]:
            async with self.running():
                yield

        return application([redirection("/", "/seat"), *self.routes()], lifespan)

    def routes(self) -> list[BaseRoute]:
        """Returns the routes of seats, maps, static files and the websocket."""

        async def town(request: Request) -> Response:
            found = await asyncio.to_thread(self.town_page, request.path_params["name"])
            if found is None:
                raise HTTPException(404)
            return gzipped_json(found)

        async def websocket(socket: WebSocket) -> None:
            await _serve(self, socket)

        return [
            *([] if self._speech is None else self._speech.routes()),
            page("/seat", "dorothie_gym console", "session", "/console/main.js", STYLE),
            Route("/towns/{name}.json", town),
            WebSocketRoute("/ws", websocket),
            files("/static", SHARED),
            files("/console", STATIC),
        ]

    @contextlib.asynccontextmanager
    async def running(self) -> AsyncIterator[None]:
        """Plays the sessions as long as the block lasts."""
        load_grammar()  # otherwise the first utterance of a script keeps its session waiting
        with (
            ThreadPoolExecutor(THREADS, thread_name_prefix="tick") as threads,
            ThreadPoolExecutor(1, thread_name_prefix="scene") as builders,
        ):
            self._threads = threads, builders
            for room in self.rooms:
                self._run(room)
            try:
                yield
            finally:
                for task in self._tasks.values():
                    task.cancel()
                await asyncio.gather(*self._tasks.values(), return_exceptions=True)
        for room in self.rooms:
            if self._suspends:
                room.suspend()
            else:
                room.shut_down()
        if self._speech is not None:
            self._speech.close()


# --- websocket --------------------------------------------------------------------------------------------------------


async def _serve(console: Console, socket: WebSocket) -> None:
    """Serves one websocket from its first message to its end."""
    if not is_same_origin(socket):
        await socket.close(CloseCode.REFUSED)
        return
    await socket.accept()
    try:
        found = await _join(console, socket)
        if found is not None:
            await _sit(console, *found, socket)
    except WebSocketDisconnect:
        logger.debug("a connection ended before it had a seat")


async def _join(console: Console, socket: WebSocket) -> tuple[Room, Seat] | None:
    """Returns room and seat of the first message, or closes the websocket."""
    text = await _first_text(console, socket)
    if text is None:
        return None
    try:
        message = decode_message(text)
    except MessageError:
        await socket.close(CloseCode.REFUSED)
        return None
    found = console.find(message.token) if isinstance(message, Join) else None
    if found is None:
        await socket.close(CloseCode.UNKNOWN_SEAT)
    elif found[0].failed:
        await socket.close(CloseCode.FAILED)
        return None
    return found


async def _first_text(console: Console, socket: WebSocket) -> str | None:
    """Returns the first text, or closes the websocket if it does not come in time, or must give way to newer ones."""
    loop = asyncio.get_running_loop()
    while len(console.joining) >= MOST_JOINING:
        oldest = next(iter(console.joining))
        del console.joining[oldest]
        if not oldest.expired():
            oldest.reschedule(loop.time())
    text, time = None, asyncio.timeout(JOIN_SECONDS)
    try:
        async with time:
            console.joining[time] = None
            text = await _text(socket)
    except TimeoutError:
        await socket.close(CloseCode.TOO_SLOW)  # a slow browser tries again
    finally:
        console.joining.pop(time, None)
    return text


async def _sit(console: Console, room: Room, seat: Seat, socket: WebSocket) -> None:
    """Talks to a browser that has joined, if there is room for it."""
    if seat.role is None and console.connections >= MOST_WATCHING:
        await socket.close(CloseCode.TOO_SLOW)
        return
    recognise(socket)
    console.connections += 1
    try:
        await _talk(room, seat, socket)
    finally:
        console.connections -= 1


async def _talk(room: Room, seat: Seat, socket: WebSocket) -> None:
    connection = Connection()
    room.join(seat, connection)
    sender = asyncio.create_task(_send(connection, socket))
    try:
        await _receive(room, seat, connection, socket)
        await sender  # closes the websocket
    except WebSocketDisconnect:
        logger.debug("a connection of %s ended", seat.name)
    finally:
        room.leave(seat, connection)
        sender.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await sender


async def _receive(room: Room, seat: Seat, connection: Connection, socket: WebSocket) -> None:
    """Passes messages on to the room, until the browser leaves or sends too many."""
    clock = asyncio.get_running_loop().time
    while True:
        text = await _text(socket)
        if not connection.admits(clock()):
            connection.close(CloseCode.TOO_FAST)
            return
        try:
            room.receive(seat, connection, decode_message(text))
        except MessageError as error:
            connection.send(encode({"k": "refused", "n": None, "reason": str(error)}))


async def _send(connection: Connection, socket: WebSocket) -> None:
    """Sends the queued messages of a connection until it is closed."""
    while True:
        item = await connection.next()
        try:
            if isinstance(item, Closing):
                await socket.close(item.code)
                return
            if isinstance(item, bytes):
                await socket.send_bytes(item)
            else:
                await socket.send_text(item)
        except (WebSocketDisconnect, RuntimeError):
            return  # the browser has gone; the receiver notes it


async def _text(socket: WebSocket) -> str:
    """Returns the next text; empty for bytes, which are not messages; raises `WebSocketDisconnect` at the end."""
    message = await socket.receive()
    if message["type"] == "websocket.disconnect":
        raise WebSocketDisconnect(message.get("code", 1000))
    return str(message.get("text") or "")
