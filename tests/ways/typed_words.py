"""A browser's messages to the console's own application, without sockets: the messages of ASGI."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from dorothie_gym.lab.console.room import Room
from dorothie_gym.lab.console.server import Console


def send_message(
    room: Room, token: str, message: Mapping[str, object], *, joined: Callable[[], None], sent: Callable[[], None]
) -> None:
    """Joins the seat of a token and sends a message over one connection.

    Args:
        room: room with the seat.
        token: token of the seat.
        message: the message.
        joined: called after the seat was joined, before the message.
        sent: called when the message has been read, before the connection ends.
    """

    def messages() -> Iterator[dict[str, Any]]:
        yield {"type": "websocket.connect"}
        yield {"type": "websocket.receive", "text": json.dumps({"k": "join", "token": token})}
        joined()
        yield {"type": "websocket.receive", "text": json.dumps(message)}

    incoming = messages()

    async def talk() -> None:
        read = asyncio.Event()

        async def receive() -> dict[str, Any]:
            for each in incoming:
                return each
            read.set()
            await asyncio.Event().wait()
            raise AssertionError("the connection is open until the task is cancelled")

        async def send(answer: dict[str, Any]) -> None:
            assert answer["type"] in ("websocket.accept", "websocket.send"), answer

        scope = {
            "type": "websocket", "path": "/ws", "raw_path": b"/ws", "root_path": "", "query_string": b"",
            "headers": [(b"host", b"127.0.0.1")], "subprotocols": [],
        }  # fmt: skip
        serving = asyncio.create_task(Console([room]).app()(scope, receive, send))
        await read.wait()
        sent()
        serving.cancel()
        await asyncio.gather(serving, return_exceptions=True)

    asyncio.run(talk())
