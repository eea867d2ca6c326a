"""Floods of a web server on this machine: `python -m tests.floods KIND PORT SECONDS COUNT PAGE FORM`.

A flood has a limited rate, and runs in a process of its own with low priority: it stands for other machines, which take
no time of the processors from the server and from the people of a test.
"""

from __future__ import annotations

import asyncio
import base64
import contextlib
import os
import random
import sys
from collections.abc import Awaitable, Callable

HOST = "127.0.0.1"

RATE = 500.0
"""Connections, and requests on them, that begin per second; of pipelined requests, 100 count as one."""


class Flood:
    """Clients of one server.

    Args:
        port: port of the server.
        page: path of a page.
        form: path to which forms are sent.
    """

    def __init__(self, port: int, page: str, form: str) -> None:
        self._port, self._due = port, 0.0
        self._page = f"GET {page} HTTP/1.1\r\nHost: {HOST}:{port}\r\n\r\n".encode()
        self._form = f"POST {form} HTTP/1.1\r\nHost: {HOST}:{port}\r\nContent-Type: application/json\r\n".encode()

    async def run(self, kinds: list[str], seconds: float, count: int) -> None:
        """Keeps clients up for a time; each begins again when it is refused.

        Args:
            kinds: names in `KINDS`, in turn.
            seconds: the time [s].
            count: number of clients.
        """

        async def client(run: Callable[[Flood], Awaitable[None]]) -> None:
            while True:
                with contextlib.suppress(OSError, TimeoutError):
                    await run(self)
                await asyncio.sleep(0.05)

        clients = [asyncio.ensure_future(client(KINDS[kinds[k % len(kinds)]])) for k in range(count)]
        await asyncio.sleep(seconds)
        for each in clients:
            each.cancel()
        await asyncio.gather(*clients, return_exceptions=True)

    async def _pace(self) -> None:
        """Waits until something may begin."""
        now = asyncio.get_running_loop().time()
        self._due = max(self._due, now) + 1.0 / RATE
        await asyncio.sleep(self._due - now)

    async def _open(self) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
        await self._pace()
        return await asyncio.open_connection(HOST, self._port)

    async def idle(self) -> None:
        """Connects and says nothing."""
        reader, writer = await self._open()
        with contextlib.closing(writer):
            await _until_closed(reader)

    async def half_headers(self) -> None:
        """Sends a request whose headers never end."""
        await self._send_for_ever(self._page.removesuffix(b"\r\n"), b"X-More: 1\r\n")

    async def half_bodies(self) -> None:
        """Sends a form that never ends."""
        await self._send_for_ever(self._form + b"Content-Length: 1000\r\n\r\n{", b" ")

    async def _send_for_ever(self, begin: bytes, more: bytes) -> None:
        reader, writer = await self._open()
        with contextlib.closing(writer):
            writer.write(begin)
            closed = asyncio.ensure_future(_until_closed(reader))
            while not closed.done():
                await asyncio.wait({closed}, timeout=1.0)
                writer.write(more)
            await closed

    async def sockets(self) -> None:
        """Opens a websocket that never joins, and leaves at once when it is to be closed."""
        reader, writer = await self._open()
        with contextlib.closing(writer):
            key = base64.b64encode(os.urandom(16))
            writer.write(
                b"GET /ws HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: " + key + b"\r\n\r\n"
            )
            await reader.readuntil(b"\r\n\r\n")
            while (first := await reader.read(65536)) and first[0] != 0x88:  # the opcode of the end
                pass

    async def requests(self) -> None:
        """Asks for pages, each after the one before, and for some of them on a new connection."""
        reader, writer = await self._open()
        with contextlib.closing(writer):
            for _ in range(random.randrange(1, 20)):
                writer.write(self._page)
                if not await reader.read(65536):
                    return
                await self._pace()

    async def pipelined(self) -> None:
        """Sends many requests without waiting for answers."""
        reader, writer = await self._open()
        with contextlib.closing(writer):
            for _ in range(5):
                writer.write(self._page * 100)
                await self._pace()
            await _until_closed(reader)

    async def garbage(self) -> None:
        """Sends what is no request, or what ends as none."""
        reader, writer = await self._open()
        with contextlib.closing(writer):
            chunked = self._form + b"Transfer-Encoding: chunked\r\n\r\n5\r\n{}zzz\r\nzz\r\n\r\n"
            for part in (os.urandom(200), b"GET / HTTP/9.9\r\n\r\n", chunked, b"GET /ws HTTP/1.1\r\n"):
                if random.random() < 0.5:
                    writer.write(part)
            await asyncio.wait_for(_until_closed(reader), 0.5)


async def _until_closed(reader: asyncio.StreamReader) -> None:
    with contextlib.suppress(OSError):
        while await reader.read(65536):
            pass


KINDS: dict[str, Callable[[Flood], Awaitable[None]]] = {
    "idle": Flood.idle,
    "half_headers": Flood.half_headers,
    "half_bodies": Flood.half_bodies,
    "sockets": Flood.sockets,
    "requests": Flood.requests,
    "pipelined": Flood.pipelined,
    "garbage": Flood.garbage,
}


if __name__ == "__main__":
    os.nice(10)
    kind, port, seconds, count, page, form = sys.argv[1:]
    chosen = list(KINDS) if kind == "mixed" else [kind]
    asyncio.run(Flood(int(port), page, form).run(chosen, float(seconds), int(count)))
